"""Planes and transformations of the plane: G17 .. G19, G70, G48, G22 .. G28,
G50 .. G52, G120, G121, G1050, G1051.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import MotionWords

from ..base.text import AXIS_LETTERS
from ..language.words import Words
from .transform import Rotation, Scaling

if TYPE_CHECKING:
    from .executor import Executor

PLANE_AXES = {17: ("X", "Y"), 18: ("Z", "X"), 19: ("Y", "Z")}


def plane_function(
    executor: Executor, code: int, offset: int, words: Words
) -> None:
    """G17, G18, G19, G70, G48."""
    executor.not_compensated(f"G{code}", offset)
    if code == 48:
        depth_axis(executor, words, offset)
    elif code == 70:
        letters = list(words.block.named)
        executor.named_axes(words)
        if len(letters) != 2:
            raise fail(900004, "G70: two axes are expected", offset)
        set_plane(executor, letters[0], letters[1], offset)
    else:
        set_plane(executor, *PLANE_AXES[code], offset)
    executor.transform.plane = executor.plane_pair
    executor.transform.rebuild()


def depth_axis(executor: Executor, words: Words, offset: int) -> None:
    """G48."""
    axes = executor.named_axes(words)
    if len(axes) != 1:
        raise fail(900004, "G48: one axis is expected", offset)
    if axes[0] in executor.plane_pair:
        raise fail(
            909114,
            f"{ERRORS[909114]} ({executor.machine.axes[axes[0]]})",
            offset,
        )
    executor.depth_axis = axes[0]
    executor.modes_changed = True


def set_plane(executor: Executor, first: str, second: str, offset: int) -> None:
    """The plane of two axes; ``offset`` 0: nothing is said if the machine has
    none of them.
    """
    if first not in executor.axes or second not in executor.axes:
        if offset:
            raise fail(900016, ERRORS[900016], offset)
        return
    executor.plane_pair = (executor.axes[first], executor.axes[second])
    executor.modes_changed = True
    pairs = {pair: code for code, pair in PLANE_AXES.items()}
    executor.plane_reversed = (second, first) in pairs
    executor.plane_code = pairs.get(
        (first, second), pairs.get((second, first), 0)
    )
    if executor.plane_code:
        executor.modal.apply(MotionWords(plane=executor.plane_code))
    corners = executor.output.corners
    corners.plane, corners.code, corners.reversed = (
        executor.plane_pair,
        executor.plane_code,
        executor.plane_reversed,
    )


def transform_function(
    executor: Executor, code: int, offset: int, words: Words
) -> None:
    """Mirrors, swaps, rotation and scaling of the plane."""
    executor.not_compensated(f"G{code}", offset)
    transform = executor.transform
    if code in (120, 121, 24, 25):
        axis = executor.axis("Y" if code > 100 else "X", offset)
        (
            transform.mirrored.add
            if code in (120, 24)
            else transform.mirrored.discard
        )(axis)
    elif code in (22, 23):
        transform.plane_swap = executor.plane_pair if code == 22 else None
    elif code in (26, 27, 28):
        swap(executor, code, offset, words)
    elif code in (50, 51, 52):
        rotation(executor, code, words)
    else:
        scaling(executor, code, offset, words)
    transform.rebuild()
    similar = transform.similarity(*executor.plane_pair)
    executor.output.corners.factor = similar[0] if similar else 1.0


def swap(executor: Executor, code: int, offset: int, words: Words) -> None:
    """G26, G27, G28."""
    if code == 26:
        axes = executor.named_axes(words)
        if len(axes) != 2:
            raise fail(900004, "G26: two axes are expected", offset)
        executor.transform.named_swap = (axes[0], axes[1])
    executor.transform.named_swap_on = code != 27


def rotation(executor: Executor, code: int, words: Words) -> None:
    """G50, G51, G52."""
    rotation = executor.transform.rotation
    if code == 50:
        unit = executor.modal.unit_mm
        here = executor.transform.backward(
            executor.modal.position - executor.frame.total
        )
        values = [rotation.first, rotation.second]
        for i, letter in enumerate("XY"):
            absolute, relative = words.take(letter), words.take("D" + letter)
            if absolute is not None:
                values[i] = absolute * unit
            elif relative is not None:
                values[i] = (
                    float(here[executor.plane_pair[i]]) + relative * unit
                )
        angle = words.take("Z")
        executor.transform.rotation = Rotation(
            values[0],
            values[1],
            rotation.degrees if angle is None else angle,
            True,
        )
    else:
        rotation.on = code == 52


def scaling(executor: Executor, code: int, offset: int, words: Words) -> None:
    """G1050, G1051."""
    scaling = executor.transform.scaling
    if code == 1050:
        scaling.on = False
        return
    given = {letter: words.take(letter) for letter in (*AXIS_LETTERS, *"IJKP")}
    if all(value is None for value in given.values()):
        scaling.on = True
        return
    ratio = dict(scaling.ratio)
    centre: dict[int, float] = {}
    program = executor.transform.backward(
        executor.modal.position - executor.frame.total
    )
    here = executor.transform.before_scaling() @ program
    for letter, word in zip("XYZ", "IJK", strict=True):
        value = given["P"] if given["P"] is not None else given[word]
        axis = executor.axes.get(letter)
        if axis is None:
            continue
        if value is not None:
            if value == 0:
                raise fail(900012, "G1051: a ratio is 0", offset)
            ratio[axis] = value
        at = given[letter]
        centre[axis] = (
            float(here[axis]) if at is None else at * executor.scale(axis)
        )
    executor.transform.scaling = Scaling(ratio, centre, True)
