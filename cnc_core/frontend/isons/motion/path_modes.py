"""Interpolation modes G63 ..

G75, corner rules, AFC and filters: what the program has chosen, as rows for the
stages.

The stages know no G function: ``PATH_MODE`` and ``FILTER`` rows tell them
(``cnc_core/geometry/stages/path_mode.py``, ``filters/run_filter.py``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cnc_core.blocks import (
    FILTER,
    HAS_VALUE,
    NC_AXES,
    PATH_MODE,
    SMOOTH_CUT,
    SMOOTH_ON,
    SMOOTHING,
)
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.machine import ProgramMachine

from ..base.parameters import Parameters
from ..base.text import AXIS_LETTERS
from .axis_dynamics import AxisDynamics

DEFAULT = 64
NO_AXIS = 255
# what F counts along, and the corner test (path_mode.py)
FEED_ALONG = {
    63: 1,
    64: 2,
    65: 1,
    67: 3,
    68: 4,
    75: 5,
}
CORNER_TEST = {
    63: 0,
    64: 1,
    65: 2,
    67: 1,
    68: 4,
    75: 3,
}
THRESHOLDS = 2
DEPTH_OFF = 20  # G69 up to this switches the filters off
FILTERS = 6
SGL3D_UNIT = (
    1000.0  # change of direction of an axis, 0..2, in the guide's units
)
ARC_SCALE_FROM, ARC_SCALE = 100.0, 10.0
MILD_LOW, MILD_HIGH = 1.0, 1000.0  # values outside leave the axis sharp
# of the spline's segments: half their sagitta where the radius is five times
# their length
DRIVEN_SHARE = 80.0
DRIVEN_MM, DRIVEN_MIN_MM, DRIVEN_MAX_MM = 0.005, 0.0005, 0.05
MICRO_MM = 1.0  # longer segments are driven exactly
# how far a first-order lag of 1 cuts a right angle at a speed of 1
CORNER_LAG = math.log(2.0) / math.sqrt(2.0)


@dataclass
class Filters:
    """Settings of G72, G73, G74, G106, G66; lengths in mm, feeds in mm/s."""

    noise: int = 0  # 1 NOISE, 2 FINE NOISE, 3 both
    noise_angle: float = 25.0
    noise_length: float = 0.4
    cusps: bool = False
    nurbs: bool = False
    nurbs_length: float = 0.2
    nurbs_order: int = 3
    nurbs_step: float = 0.2
    short: bool = False
    short_length: float = 0.5
    smooth: dict[int, float] = field(default_factory=dict)  # level by axis
    smooth_length: float = 0.0
    feed_control: int = 0  # samples of the average, 0 off
    inertia: float = 1.0
    dead_band: float = 0.0
    feed_floor: float = 0.0


class PathModes:
    """``mode``: 63, 64, 65, 67, 68, 75.

    ``depth``: of G69, 0 off; ``tangential``: its axis, None none. ``tip_on``:
    RTCP is on.
    """

    def __init__(
        self, machine: ProgramMachine, modal: Modal, parameters: Parameters
    ) -> None:
        self.tip_on = False
        self._rotary = sum(
            1 << i for i, turns in enumerate(machine.rotary) if turns
        )
        self._names = [name.upper() for name in machine.axes]
        self._modal, self._parameters = modal, parameters
        self.mode = DEFAULT
        self.transport_limit = 0.0  # of G68 X
        self.depth = 0
        self.tangential: int | None = None
        self.filters = Filters()
        self.mild: set[int] = set()
        self.mild_on = False
        self._limits = AxisDynamics(machine, modal, parameters)
        # all off
        self._sent = [
            _key(self._modal.row(FILTER, 0, code=code))
            for code in range(1, FILTERS + 1)
        ]

    @property
    def filtering(self) -> bool:
        return self.depth > DEPTH_OFF

    def program_starts(self) -> None:
        """G66, G69, G72, G73, G74, G106 are off."""
        self.depth = 0
        self.tangential = None
        self.filters = Filters()

    def rows(
        self, plane: tuple[int, int], depth_axis: int | None, n: int
    ) -> list[Row]:
        """Rows that tell the stages; none if nothing has changed."""
        made = [
            *self._filter_rows(plane, depth_axis, n),
            self._mode_row(plane, n),
            *self._mild_rows(n),
            *self._limits.rows(n),
        ]
        keys = [_key(row) for row in made]
        out = [
            row
            for row, key in zip(made, keys, strict=True)
            if key not in self._sent
        ]
        self._sent = keys
        return out

    # the mode

    def _mode_row(self, plane: tuple[int, int], n: int) -> Row:
        p, row = self._parameters, self._modal.row(PATH_MODE, n)
        adaptive = self.filtering and self.filters.feed_control > 0
        row["code"] = FEED_ALONG[self.mode]
        row["pool"] = THRESHOLDS if adaptive else CORNER_TEST[self.mode]
        row["degree"], row["fill_1"], row["plane"] = *plane, NO_AXIS
        if self.mode == 68 and self.transport_limit:
            row["plane"] = (
                NO_AXIS if self.tangential is None else self.tangential
            )
            row["length"] = max(self.transport_limit, 0.0) or 1e-9
        stop = p["SGLP"] / 10.0
        row["angle"] = math.radians(stop)
        row["radius"] = math.radians(stop * p["SGLP_RED"] / 100.0)
        row["value"] = 1.0 - p["MAX_RED"] / 100.0
        row["programmed_radius"] = (
            arc_acceleration(p["ACC_RAGGIO_MAX"]) * 1000.0
        )
        row["end"] = self._per_axis("SGL3D", 1.0 / SGL3D_UNIT)
        return row

    def _per_axis(
        self, name: str, factor: float
    ) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        out = np.zeros(NC_AXES)
        for i, axis in enumerate(self._names):
            if axis in AXIS_LETTERS:
                out[i] = self._parameters[f"{name}_{axis}"] * factor
        return out

    # filters

    def _filter_rows(
        self, plane: tuple[int, int], depth_axis: int | None, n: int
    ) -> list[Row]:
        f, on = self.filters, self.filtering
        depth = self.depth_of(plane, depth_axis)
        noise = {
            "angle": math.radians(f.noise_angle),
            "length": f.noise_length,
            "value": float(f.cusps),
        }
        nurbs = {
            "length": f.nurbs_length,
            "value": f.nurbs_order,
            "radius": f.nurbs_step,
        }
        sample_s = self._parameters["TAU"] / 1000.0
        levels = np.zeros(NC_AXES)
        for axis, level in f.smooth.items():
            levels[axis] = level
        speed_limits = self._per_axis(
            "SGLAFC", self._parameters.speed_unit / 60.0
        )
        made: list[tuple[int, bool, dict[str, Any]]] = [
            (1, bool(f.noise & 1), noise),
            (2, f.nurbs, nurbs),
            (3, bool(f.noise & 2), noise),
            (4, f.short, {"length": f.short_length, "value": sample_s}),
            (
                5,
                bool(f.smooth),
                {"length": f.smooth_length, "value": sample_s, "end": levels},
            ),
            (6, f.feed_control > 0, self._feed_control(speed_limits)),
        ]
        rows = []
        for code, wanted, values in made:
            row = self._modal.row(
                FILTER, n, code=code, flags=HAS_VALUE if on and wanted else 0
            )
            if on and wanted:
                row["degree"], row["fill_1"], row["plane"] = *plane, depth
                row["center"][0, 0] = self._following(*plane, depth)
                for name, value in values.items():
                    row[name] = value
            rows.append(row)
        return rows

    def _feed_control(
        self, limits: np.ndarray[tuple[int], np.dtype[np.float64]]
    ) -> dict[str, Any]:
        f, p = self.filters, self._parameters
        accel = p["ACC_LAV"] / (p["TAU"] ** 2) * 1000.0
        return {
            "end": limits,
            "value": f.feed_control,
            "radius": f.inertia,
            "length": f.dead_band,
            "angle": f.feed_floor,
            "length_min": accel or 1000.0,
            "pool": self.depth,
        }

    def depth_of(self, plane: tuple[int, int], depth_axis: int | None) -> int:
        """The axis across the plane: of G48, else the one that is left of X, Y,
        Z; 255 none.
        """
        if depth_axis is not None and depth_axis not in plane:
            return depth_axis
        main = [
            self._names.index(name) for name in "XYZ" if name in self._names
        ]
        left = [axis for axis in main if axis not in plane]
        return left[0] if len(left) == 1 else NO_AXIS

    def _following(self, *filtered: int) -> int:
        """Mask of the axes that follow a filtered path: the tangential one, with
        RTCP the rotary ones.
        """
        own = 0 if self.tangential is None else 1 << self.tangential
        mask = own | (self._rotary if self.tip_on else 0)
        for axis in filtered:
            mask &= ~(1 << axis)
        return mask

    # edge smoothing

    def _mild_rows(self, n: int) -> list[Row]:
        """A first-order lag of TAU * 1000 / MILD cuts corners by what depends
        on the feed; so does the smoothing. A lag never swings out.

        The largest of the tolerances holds. Those of G60 and of the filters
        only say how the axes may drive: the PLC sees the programmed motions.
        """
        tolerance = self._mild_tolerance() if self.mild_on else 0.0
        driven, longest = max(self._driven(), self._without_stops())
        cuts = tolerance > 0.0 and tolerance >= driven
        code = SMOOTH_CUT if cuts else SMOOTH_ON
        row = self._modal.row(
            SMOOTHING, n, code=code, value=max(tolerance, driven)
        )
        if driven > tolerance:
            row["flags"], row["length"] = HAS_VALUE, longest
        self._smoothing_told = self._smoothing_told or bool(
            row["value"][0] > 0.0
        )
        return [row] if self._smoothing_told else []

    def _without_stops(self) -> tuple[float, float]:
        """(tolerance, longest segment), mm, of G60: segments of any length."""
        if self._modal.exact_stop:
            return 0.0, 0.0
        return self._parameters.length("TOL_G60"), 0.0

    _smoothing_told = False

    def _driven(self) -> tuple[float, float]:
        """(tolerance, longest segment), mm: how filtered runs are driven; (0,
        0) exactly.

        Filters leave vertices, and no axis can change its speed at once:
        without a tolerance the axes stand at each.
        """
        f = self.filters
        spline = f.nurbs and f.nurbs_order > 1
        if not self.filtering or not (
            spline or f.noise or f.short or f.smooth or f.feed_control
        ):
            return 0.0, 0.0
        longest = (
            2.0 * MICRO_MM
            if f.short and f.short_length <= MICRO_MM
            else MICRO_MM
        )
        if not spline:
            return DRIVEN_MM, longest
        return min(
            max(f.nurbs_step / DRIVEN_SHARE, DRIVEN_MIN_MM), DRIVEN_MAX_MM
        ), max(longest, f.nurbs_step)

    def rounded_axes(self) -> frozenset[int]:
        """Axes that the edge smoothing lets lag; none: it is off."""
        return frozenset(self._lagging()) if self.mild_on else frozenset()

    def exact_corner(self, n: int) -> list[Row]:
        """The order that ends a smoothed section and begins the next one."""
        return self._mild_rows(n)

    def _lagging(self) -> dict[int, float]:
        values = {
            axis: self._parameters[f"MILD_{self._names[axis]}"]
            for axis in self.mild
        }
        return {a: v for a, v in values.items() if MILD_LOW < v < MILD_HIGH}

    def _mild_tolerance(self) -> float:
        acting = self._lagging().values()
        if not acting:
            return 0.0
        lag_s = self._parameters["TAU"] / 1000.0 * MILD_HIGH / min(acting)
        feed = (
            self._modal.feed
            * self._parameters["FEEDRES"]
            / 60.0
            * self._modal.feed_unit
        )
        return CORNER_LAG * feed * lag_s


def _key(row: Row) -> bytes:
    """What a row says, without its place in the text."""
    key = row.copy()
    key["n"] = key["line"] = key["count"] = key["file"] = 0
    return bytes(key.tobytes())


def arc_acceleration(value: float) -> float:
    """m/s2 of ACC_RAGGIO_MAX: the value, over 100 a tenth of what is beyond."""
    return (
        (value - ARC_SCALE_FROM) / ARC_SCALE
        if value > ARC_SCALE_FROM
        else value
    )
