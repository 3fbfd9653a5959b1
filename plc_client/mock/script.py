"""The script a mock CNC plays: one ``Step`` for every element, function and
marker, in mm, s and rad.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hli import layout
from hli.view import BLOCK_DTYPE

TENTH_UM_PER_MM = 10_000.0
MOTIONS = ("line", "arc", "polynomial")
MARKERS = {
    "log_on": layout.HLI_CLAH_LOG_ON,
    "log_param": layout.HLI_CLAH_LOG_PARAM,
    "log_off": layout.HLI_CLAH_LOG_OFF,
}
TYPES = {
    "line": layout.HLI_CLAH_LINEAR,
    "arc": layout.HLI_CLAH_CIRCULAR,
    "polynomial": layout.HLI_CLAH_POLYNOMIAL,
}
FUNCTIONS = {"M": 1, "H": 2, "S": 3, "T": 4}  # fkt_ctrl_r


@dataclass(frozen=True)
class Step:
    """One step; which members count depends on ``kind``.

    Made by the functions of this module.
    """

    kind: str
    length_mm: float = 0.0
    radius_mm: float = 0.0
    angle: float = 0.0
    tangent: float = 0.0
    length_min_mm: float | None = None
    n: int = 0
    feed_mm_s: float | None = None
    rapid: bool = False
    number: int = 0
    value: int = 0
    waits: bool = True
    late: bool = False
    axis: int = -1  # technology: -1 the channel's array, else that axis' array
    seconds: float = 0.0
    param: float = 0.0
    skip: int = 0  # skip level 1..10, 0: none

    @property
    def is_motion(self) -> bool:
        """Whether the step is path."""
        return self.kind in MOTIONS

    @property
    def is_function(self) -> bool:
        """Whether the step goes out by a technology unit."""
        return self.kind in FUNCTIONS


def line(length_mm: float, **others: Any) -> Step:
    """A line; ``n``, ``tangent`` (rad, against the motion before),
    ``feed_mm_s``, ``length_min_mm``, ``skip``.
    """
    return Step("line", length_mm, **others)


def rapid(length_mm: float, **others: Any) -> Step:
    """A rapid line."""
    return Step("line", length_mm, rapid=True, **others)


def arc(radius_mm: float, angle: float, **others: Any) -> Step:
    """A circle; ``angle`` in rad, clockwise negative."""
    return Step("arc", abs(radius_mm * angle), radius_mm, angle, **others)


def polynomial(length_mm: float, **others: Any) -> Step:
    """A polynomial element."""
    return Step("polynomial", length_mm, **others)


def m(number: int, value: int = 0, **others: Any) -> Step:
    """An M function; ``waits`` FALSE: MOS, which must be fetched only; ``late``
    TRUE: the late array; ``axis``.
    """
    return Step("M", number=number, value=value, **others)


def h(number: int, value: int = 0, **others: Any) -> Step:
    """An H function."""
    return Step("H", number=number, value=value, **others)


def s(rev: int, axis: int = 0, **others: Any) -> Step:
    """A spindle function (``rev`` in 1e-3 deg/s) in the array of an axis."""
    return Step("S", number=rev, axis=axis, **others)


def t(number: int, **others: Any) -> Step:
    """A tool function."""
    return Step("T", number=number, **others)


def dwell(seconds: float, **others: Any) -> Step:
    """G04."""
    return Step("dwell", seconds=seconds, **others)


def stop(**others: Any) -> Step:
    """M00: stands until "continue"."""
    return Step("stop", **others)


def optional_stop(**others: Any) -> Step:
    """M01: stands if ``m01_stop_enable``."""
    return Step("optional_stop", **others)


def log_on(param: float = 0.0, **others: Any) -> Step:
    """``#CONTOUR LOOKAHEAD LOG ON [PARAM=param]``."""
    return Step("log_on", param=param, **others)


def log_param(param: float, **others: Any) -> Step:
    """``#CONTOUR LOOKAHEAD LOG [PARAM=param]``."""
    return Step("log_param", param=param, **others)


def log_off(param: float = 0.0, **others: Any) -> Step:
    """``#CONTOUR LOOKAHEAD LOG OFF [PARAM=param]``."""
    return Step("log_off", param=param, **others)


def distance_reset(**others: Any) -> Step:
    """``#DISTANCE PROG START CLEAR``."""
    return Step("distance_reset", **others)


def cnc_error(number: int, **others: Any) -> Step:
    """The program stops with this error; the record goes to ``mc_error``."""
    return Step("error", number=number, **others)


def by_channel(
    script: Sequence[Step] | Sequence[Sequence[Step]],
) -> list[Sequence[Step]]:
    """One script a channel; a script of steps is that of the only one."""
    scripts = [one for one in script if not isinstance(one, Step)]
    if scripts and len(scripts) == len(script):
        return scripts
    return [script]  # type: ignore[list-item]


def numbered(steps: Iterable[Step]) -> list[Step]:
    """Steps with N10, N20 ...

    where none was given.  TypeError: something that is no step.
    """
    steps = list(steps)
    for i, step in enumerate(steps):
        if not isinstance(step, Step):
            raise TypeError(
                f"script[{i}] = {step!r}: a step is needed: line(30), arc(10, 1.57), m(8) ..."
            )
    return [
        step if step.n else replace(step, n=10 * (i + 1))
        for i, step in enumerate(steps)
    ]


def without_skipped(steps: Iterable[Step], mask: int) -> list[Step]:
    """The steps that are left when the skip levels of `mask` (bit n-1 = level
    n) act.
    """
    return [
        step
        for step in steps
        if not (step.skip and mask >> (step.skip - 1) & 1)
    ]


def element_rows(steps: list[Step]) -> tuple[Any, Any]:
    """(path, log): the elements of the motions with their distances, the
    entries of the first marked area.
    """
    path, log, marked, closed, distance = [], [], False, False, 0.0
    for i, step in enumerate(steps):
        if step.kind == "distance_reset":
            distance = 0.0
        elif step.is_motion:
            row = _motion_row(step, i + 1, distance)
            path.append(row)
            log += [row] if marked else []
            distance += step.length_mm * TENTH_UM_PER_MM
        elif (
            step.kind in MARKERS
            and not closed
            and (marked or step.kind == "log_on")
        ):
            log.append(_marker_row(step, i + 1, distance))
            marked = step.kind != "log_off"
            closed = not marked
    return _array(path), _array(log)


def _array(rows: list[Any]) -> Any:
    return np.array(rows, BLOCK_DTYPE) if rows else np.zeros(0, BLOCK_DTYPE)


def _motion_row(step: Step, count: int, distance: float) -> Any:
    row = np.zeros(1, BLOCK_DTYPE)[0]
    row["block_type"], row["block_number"], row["block_count_r"] = (
        TYPES[step.kind],
        step.n,
        count,
    )
    row["start_position"], row["length"] = (
        distance,
        step.length_mm * TENTH_UM_PER_MM,
    )
    shortest = (
        step.length_mm if step.length_min_mm is None else step.length_min_mm
    )
    row["length_min"] = shortest * TENTH_UM_PER_MM
    row["programmed_radius"] = row["compensated_radius"] = (
        step.radius_mm * TENTH_UM_PER_MM
    )
    row["circle_angle"], row["tangent_variation"] = step.angle, step.tangent
    return row


def _marker_row(step: Step, count: int, distance: float) -> Any:
    row = np.zeros(1, BLOCK_DTYPE)[0]
    row["block_type"], row["block_number"], row["block_count_r"] = (
        MARKERS[step.kind],
        step.n,
        count,
    )
    row["start_position"], row["length"] = distance, step.param
    return row
