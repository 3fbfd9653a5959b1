"""Planes and transformations of the plane: G17 .. G19, G70, G48, G22 .. G28,
G50 .. G52, G120, G121, G1050, G1051.
"""

from __future__ import annotations

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail

from ..base.text import AXIS_LETTERS
from ..base.words import Words
from .state import PLANE_AXES, ChannelState
from .transform import Rotation, Scaling


def plane_function(
    channel: ChannelState, code: int, offset: int, words: Words
) -> None:
    """G17, G18, G19, G70, G48."""
    channel.not_compensated(f"G{code}", offset)
    if code == 48:
        depth_axis(channel, words, offset)
    elif code == 70:
        letters = list(words.block.named)
        channel.named_axes(words)
        if len(letters) != 2:
            raise fail(900004, "G70: two axes are expected", offset)
        channel.set_plane(letters[0], letters[1], offset)
    else:
        channel.set_plane(*PLANE_AXES[code], offset)
    channel.transform.plane = channel.plane_pair
    channel.transform.rebuild()


def depth_axis(channel: ChannelState, words: Words, offset: int) -> None:
    """G48."""
    axes = channel.named_axes(words)
    if len(axes) != 1:
        raise fail(900004, "G48: one axis is expected", offset)
    if axes[0] in channel.plane_pair:
        raise fail(
            909114,
            f"{ERRORS[909114]} ({channel.machine.axes[axes[0]]})",
            offset,
        )
    channel.depth_axis = axes[0]
    channel.modes_changed = True


def transform_function(
    channel: ChannelState, code: int, offset: int, words: Words
) -> None:
    """Mirrors, swaps, rotation and scaling of the plane."""
    channel.not_compensated(f"G{code}", offset)
    transform = channel.transform
    if code in (120, 121, 24, 25):
        axis = channel.axis("Y" if code > 100 else "X", offset)
        (
            transform.mirrored.add
            if code in (120, 24)
            else transform.mirrored.discard
        )(axis)
    elif code in (22, 23):
        transform.plane_swap = channel.plane_pair if code == 22 else None
    elif code in (26, 27, 28):
        swap(channel, code, offset, words)
    elif code in (50, 51, 52):
        rotation(channel, code, words)
    else:
        scaling(channel, code, offset, words)
    transform.rebuild()
    similar = transform.similarity(*channel.plane_pair)
    channel.output.corners.factor = similar[0] if similar else 1.0


def swap(channel: ChannelState, code: int, offset: int, words: Words) -> None:
    """G26, G27, G28."""
    if code == 26:
        axes = channel.named_axes(words)
        if len(axes) != 2:
            raise fail(900004, "G26: two axes are expected", offset)
        channel.transform.named_swap = (axes[0], axes[1])
    channel.transform.named_swap_on = code != 27


def rotation(channel: ChannelState, code: int, words: Words) -> None:
    """G50, G51, G52."""
    rotation = channel.transform.rotation
    if code == 50:
        unit = channel.modal.unit_mm
        here = channel.transform.backward(
            channel.modal.position - channel.frame.total
        )
        values = [rotation.first, rotation.second]
        for i, letter in enumerate("XY"):
            absolute = words.take(letter)
            relative = words.take("D" + letter)
            if absolute is not None:
                values[i] = absolute * unit
            elif relative is not None:
                values[i] = float(here[channel.plane_pair[i]]) + relative * unit
        angle = words.take("Z")
        channel.transform.rotation = Rotation(
            values[0],
            values[1],
            rotation.degrees if angle is None else angle,
            True,
        )
    else:
        rotation.on = code == 52


def scaling(
    channel: ChannelState, code: int, offset: int, words: Words
) -> None:
    """G1050, G1051."""
    scaling = channel.transform.scaling
    if code == 1050:
        scaling.on = False
        return
    given = {letter: words.take(letter) for letter in (*AXIS_LETTERS, *"IJKP")}
    if all(value is None for value in given.values()):
        scaling.on = True
        return
    ratio = dict(scaling.ratio)
    centre: dict[int, float] = {}
    program = channel.transform.backward(
        channel.modal.position - channel.frame.total
    )
    here = channel.transform.before_scaling() @ program
    for letter, word in zip("XYZ", "IJK", strict=True):
        value = given["P"] if given["P"] is not None else given[word]
        axis = channel.axes.get(letter)
        if axis is None:
            continue
        if value is not None:
            if value == 0:
                raise fail(900012, "G1051: a ratio is 0", offset)
            ratio[axis] = value
        at = given[letter]
        centre[axis] = (
            float(here[axis]) if at is None else at * channel.scale(axis)
        )
    channel.transform.scaling = Scaling(ratio, centre, True)
