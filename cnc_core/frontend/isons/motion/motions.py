"""Axis words to motions, through transformations, origins and offsets."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import MotionWords, Row
from cnc_core.units import FloatArray

from ..base.text import AXIS_LETTERS
from ..base.words import Words
from .rotary import target_of
from .state import ChannelState


def motion(channel: ChannelState, words: Words) -> list[Row]:
    """The motion of a block, by the G function in force."""
    given = targets(channel, words)
    arc = channel.modal.motion >= 2
    centre = {}
    if arc:
        centre = {
            letter: words.values[letter]
            for letter in "IJ"
            if letter in words.values
        }
        words.used |= {"I", "J", "R"}
    radius = words.values.get("R") if arc else None
    if radius is not None and not (given or centre):
        raise fail(
            900007,
            "wrong circle: R needs an end point, a full circle has I and J",
            words.block.offsets["R"],
        )
    if not (given or centre):
        return []
    offset = min(
        words.block.offsets[name]
        for name in words.block.offsets
        if name.lstrip("D") in "XYZABCUVWIJ"
    )
    return move(
        channel,
        given,
        centre,
        radius,
        940 in words.codes,
        words.block.n,
        offset,
    )


def targets(
    channel: ChannelState, words: Words
) -> dict[int, tuple[float, bool]]:
    """Axis words of a motion: value, and whether it counts from where the axis
    is, by axis.
    """
    given: dict[int, tuple[float, bool]] = {}
    names = [letter for letter in AXIS_LETTERS if letter not in words.used]
    for letter in names:
        for name in (letter, "D" + letter):
            if name in words.values and name not in words.used:
                axis = channel.axis(letter, words.offset(name))
                if axis in given:
                    raise fail(
                        900005,
                        f"{letter} twice in one block",
                        words.offset(name),
                    )
                given[axis] = (
                    words.values[name],
                    name != letter or not channel.modal.absolute,
                )
                words.used.add(name)
    return given


def place_of(
    channel: ChannelState, given: dict[int, tuple[float, bool]]
) -> FloatArray:
    """(axes,) machine position that axis words lead to, through
    transformations, origins and offsets.
    """
    position, frame = channel.modal.position, channel.frame.total
    place, moved = transformed(
        channel, given, channel.transform.backward(position - frame), frame
    )
    return np.where(moved, place, position)


def transformed(
    channel: ChannelState,
    given: dict[int, tuple[float, bool]],
    now: FloatArray,
    frame: FloatArray,
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """(axes,) machine position of axis words seen from ``now`` in the
    transformed system, and (axes,) which move.
    """
    point = now.copy()
    for axis, (value, relative) in given.items():
        point[axis] = target(
            channel,
            axis,
            value * channel.scale(axis),
            relative,
            float(now[axis]),
        )
    moved = np.asarray(
        channel.transform.matrix[:, list(given)].any(axis=1),
    )
    return channel.transform.forward(point) + frame, moved


def move(
    channel: ChannelState,
    given: dict[int, tuple[float, bool]],
    centre: dict[str, float],
    radius: float | None,
    without_origin: bool,
    n: int,
    offset: int,
) -> list[Row]:
    """The words as they are where nothing stands between program and machine,
    else through it.
    """
    modal = channel.modal
    relative = {is_relative for _, is_relative in given.values()}
    simple = (
        channel.plain_geometry
        and not without_origin
        and not any(channel.rotary_modes.get(axis) for axis in given)
    )
    as_modal = relative <= {not modal.absolute}
    # DX under G90: a line as under G91
    distances = relative == {True} and modal.motion < 2
    if not (simple and (as_modal or distances)):
        return through_transformations(
            channel, given, centre, radius, without_origin, n, offset
        )
    words = MotionWords(
        axis={axis: value for axis, (value, _) in given.items()},
        centre=centre,
        r=radius,
        n=n,
    )
    if as_modal:
        return applied(channel, words, offset)
    modal.set_absolute(False)
    try:
        return applied(channel, words, offset)
    finally:
        modal.set_absolute(True)


def applied(
    channel: ChannelState, words: MotionWords, offset: int
) -> list[Row]:
    """Rows of words that the modal state takes."""
    error, row = channel.modal.apply(words)
    if error:
        text = ERRORS[error]
        if error == 900007:
            text += (
                f"; allowed is {channel.parameters.length('SGLR'):g} mm (SGLR)"
            )
        raise fail(error, text, offset)
    return [] if row is None else channel.emit(row)


def through_transformations(
    channel: ChannelState,
    given: dict[int, tuple[float, bool]],
    centre: dict[str, float],
    radius: float | None,
    without_origin: bool,
    n: int,
    offset: int,
) -> list[Row]:
    """Through the transformations, in machine coordinates."""
    modal, transform = channel.modal, channel.transform
    frame = channel.frame.total - (
        channel.frame.origin.acting if without_origin else 0.0
    )
    now = transform.backward(modal.position - frame)
    place, moved = transformed(channel, given, now, frame)
    moving = np.flatnonzero(moved)
    words = MotionWords(
        axis={int(i): float(place[i]) for i in moving},
        n=n,
        motion=modal.motion,
    )
    if modal.motion >= 2:
        arc_words(channel, words, centre, radius, now, frame, offset)
    return in_machine_coordinates(channel, words, offset)


def target(
    channel: ChannelState, axis: int, value: float, relative: bool, now: float
) -> float:
    """Where an axis goes; rotary axes by their mode."""
    if relative:
        return now + value
    mode = channel.rotary_modes.get(axis, 0)
    if mode == 4:
        mode = 1 if channel.modal.motion < 2 else 0
    return target_of(mode, now, value)


def arc_words(
    channel: ChannelState,
    words: MotionWords,
    centre: dict[str, float],
    radius: float | None,
    now: FloatArray,
    frame: FloatArray,
    offset: int,
) -> None:
    """Centre and radius of an arc in machine coordinates."""
    first, second = channel.plane_pair
    similar = channel.transform.similarity(first, second)
    if not channel.plane_code:
        raise fail(909115, ERRORS[909115], offset)
    if similar is None:
        raise fail(909116, ERRORS[909116], offset)
    scale, kept = similar
    if kept == channel.plane_reversed:
        words.motion = 5 - channel.modal.motion
    if radius is not None:
        words.r = radius * channel.modal.unit_mm * scale
    if not centre:
        return
    absolute = channel.modal.absolute and not channel.parameters["ARC_REL"]
    point = now.copy()
    for letter, axis in (("I", first), ("J", second)):
        point[axis] = centre.get(letter, 0.0) * channel.modal.unit_mm + (
            0.0 if absolute else now[axis]
        )
    place = channel.transform.forward(point) + frame
    pair = (second, first) if channel.plane_reversed else (first, second)
    words.centre = {
        letter: float(place[axis])
        for letter, axis in zip("IJ", pair, strict=True)
    }


def in_machine_coordinates(
    channel: ChannelState, words: MotionWords, offset: int
) -> list[Row]:
    """Rows of words that count from home, in mm and absolute."""
    modal = channel.modal
    absolute = modal.absolute
    inch = modal.unit_mm != 1.0
    motion = modal.motion
    modal.set_offset(np.zeros(len(channel.machine.axes)))
    modal.set_absolute(True)
    modal.apply(MotionWords(inch=False, centre_absolute=True))
    try:
        return applied(channel, words, offset)
    finally:
        modal.apply(
            MotionWords(
                inch=inch,
                centre_absolute=not channel.parameters["ARC_REL"],
                motion=motion,
            )
        )
        modal.set_absolute(absolute)
        channel.frame.update()
