"""Axis words to motions, through transformations, origins and offsets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import MotionWords, Row

from ..base.text import AXIS_LETTERS
from ..language.words import Words
from .rotary import target_of

if TYPE_CHECKING:
    from .executor import Array, Executor


def motion(executor: Executor, words: Words) -> list[Row]:
    """The motion of a block, by the G function in force."""
    given = targets(executor, words)
    arc = executor.modal.motion >= 2
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
        executor,
        given,
        centre,
        radius,
        940 in words.codes,
        words.block.n,
        offset,
    )


def targets(executor: Executor, words: Words) -> dict[int, tuple[float, bool]]:
    """Axis words of a motion: value, and whether it counts from where the axis
    is, by axis.
    """
    given: dict[int, tuple[float, bool]] = {}
    names = [letter for letter in AXIS_LETTERS if letter not in words.used]
    for letter in names:
        for name in (letter, "D" + letter):
            if name in words.values and name not in words.used:
                axis = executor.axis(letter, words.offset(name))
                if axis in given:
                    raise fail(
                        900005,
                        f"{letter} twice in one block",
                        words.offset(name),
                    )
                given[axis] = (
                    words.values[name],
                    name != letter or not executor.modal.absolute,
                )
                words.used.add(name)
    return given


def place_of(executor: Executor, given: dict[int, tuple[float, bool]]) -> Array:
    """(axes,) machine position that axis words lead to, through
    transformations, origins and offsets.
    """
    position, frame = executor.modal.position, executor.frame.total
    place, moved = transformed(
        executor, given, executor.transform.backward(position - frame), frame
    )
    return np.where(moved, place, position)


def transformed(
    executor: Executor,
    given: dict[int, tuple[float, bool]],
    now: Array,
    frame: Array,
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """(axes,) machine position of axis words seen from ``now`` in the
    transformed system, and (axes,) which move.
    """
    point = now.copy()
    for axis, (value, relative) in given.items():
        point[axis] = target(
            executor,
            axis,
            value * executor.scale(axis),
            relative,
            float(now[axis]),
        )
    moved = np.asarray(executor.transform.matrix[:, list(given)].any(axis=1))
    return executor.transform.forward(point) + frame, moved


def move(
    executor: Executor,
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
    modal = executor.modal
    relative = {is_relative for _, is_relative in given.values()}
    simple = (
        executor.plain_geometry
        and not without_origin
        and relative <= {not modal.absolute}
    )
    if simple and not any(executor.rotary_modes.get(axis) for axis in given):
        words = MotionWords(
            axis={axis: value for axis, (value, _) in given.items()},
            centre=centre,
            r=radius,
            n=n,
        )
        return applied(executor, words, offset)
    return through_transformations(
        executor, given, centre, radius, without_origin, n, offset
    )


def applied(executor: Executor, words: MotionWords, offset: int) -> list[Row]:
    """Rows of words that the modal state takes."""
    error, row = executor.modal.apply(words)
    if error:
        text = ERRORS[error]
        if error == 900007:
            text += (
                f"; allowed is {executor.parameters.length('SGLR'):g} mm (SGLR)"
            )
        raise fail(error, text, offset)
    return [] if row is None else executor.emit(row)


def through_transformations(
    executor: Executor,
    given: dict[int, tuple[float, bool]],
    centre: dict[str, float],
    radius: float | None,
    without_origin: bool,
    n: int,
    offset: int,
) -> list[Row]:
    """Through the transformations, in machine coordinates."""
    modal, transform = executor.modal, executor.transform
    frame = executor.frame.total - (
        executor.frame.origin.acting if without_origin else 0.0
    )
    now = transform.backward(modal.position - frame)
    place, moved = transformed(executor, given, now, frame)
    words = MotionWords(
        axis={int(i): float(place[i]) for i in np.flatnonzero(moved)},
        n=n,
        motion=modal.motion,
    )
    if modal.motion >= 2:
        arc_words(executor, words, centre, radius, now, frame, offset)
    return in_machine_coordinates(executor, words, offset)


def target(
    executor: Executor, axis: int, value: float, relative: bool, now: float
) -> float:
    """Where an axis goes; rotary axes by their mode."""
    if relative:
        return now + value
    mode = executor.rotary_modes.get(axis, 0)
    if mode == 4:
        mode = 1 if executor.modal.motion < 2 else 0
    return target_of(mode, now, value)


def arc_words(
    executor: Executor,
    words: MotionWords,
    centre: dict[str, float],
    radius: float | None,
    now: Array,
    frame: Array,
    offset: int,
) -> None:
    """Centre and radius of an arc in machine coordinates."""
    first, second = executor.plane_pair
    similar = executor.transform.similarity(first, second)
    if not executor.plane_code:
        raise fail(909115, ERRORS[909115], offset)
    if similar is None:
        raise fail(909116, ERRORS[909116], offset)
    scale, kept = similar
    if kept == executor.plane_reversed:
        words.motion = 5 - executor.modal.motion
    if radius is not None:
        words.r = radius * executor.modal.unit_mm * scale
    if not centre:
        return
    absolute = executor.modal.absolute and not executor.parameters["ARC_REL"]
    point = now.copy()
    for letter, axis in (("I", first), ("J", second)):
        point[axis] = centre.get(letter, 0.0) * executor.modal.unit_mm + (
            0.0 if absolute else now[axis]
        )
    place = executor.transform.forward(point) + frame
    pair = (second, first) if executor.plane_reversed else (first, second)
    words.centre = {
        letter: float(place[axis])
        for letter, axis in zip("IJ", pair, strict=True)
    }


def in_machine_coordinates(
    executor: Executor, words: MotionWords, offset: int
) -> list[Row]:
    """Rows of words that count from home, in mm and absolute."""
    modal = executor.modal
    absolute, inch, motion = modal.absolute, modal.unit_mm != 1.0, modal.motion
    modal.set_offset(np.zeros(len(executor.machine.axes)))
    modal.set_absolute(True)
    modal.apply(MotionWords(inch=False, centre_absolute=True))
    try:
        return applied(executor, words, offset)
    finally:
        modal.apply(
            MotionWords(
                inch=inch,
                centre_absolute=not executor.parameters["ARC_REL"],
                motion=motion,
            )
        )
        modal.set_absolute(absolute)
        executor.frame.update()
