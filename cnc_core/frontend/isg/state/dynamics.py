"""Limits that a program sets for its motions: G127-G134, G230-G233, #OVERRIDE
RAPID_FACT, #VECTOR LIMIT, #SLOPE.

Weights are percent of the machine's own limits, each relative to 100 %, never
above them.  They go to the engine as ``DYNAMICS`` rows, which hold for all
motions behind them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_core._engine import lib
from cnc_core.blocks import DYNAMICS
from cnc_core.frontend.base.lexer import Warn, fail
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.units import SECONDS_PER_MINUTE, FloatArray

LOWEST = 0.001  # share: smaller weights, 0 too, count as this (R)
FEED, RAPID = 0, 1
VELOCITY, ACCELERATION, JERK = (
    lib.NC_DYNAMICS_VELOCITY,
    lib.NC_DYNAMICS_ACCELERATION,
    lib.NC_DYNAMICS_JERK,
)
PROFILES = {"STEP": 0, "TRAPEZ": 1, "SIN2": 2, "HSC": 3}


@dataclass(frozen=True)
class Weight:
    """The quantity that a G function weights.

    ``ramp``: percent of the ramp time: more is slower.
    """

    name: str
    per_axis: bool
    ramp: bool = False


WEIGHTS: dict[int, Weight] = {
    127: Weight("velocity", True),
    128: Weight("velocity", False),
    129: Weight("rapid", False),
    130: Weight("feed acceleration", True),
    131: Weight("feed acceleration", False),
    132: Weight("feed ramp", True, ramp=True),
    133: Weight("feed ramp", False, ramp=True),
    134: Weight("geometric ramp", False, ramp=True),
    230: Weight("rapid acceleration", True),
    231: Weight("rapid acceleration", False),
    233: Weight("rapid ramp", False, ramp=True),
}
# (kind, feed or rapid) -> the weights that count for it; the smallest of them holds
PARTS: dict[tuple[int, int], tuple[str, ...]] = {
    (VELOCITY, FEED): ("velocity",),
    (VELOCITY, RAPID): ("velocity", "rapid"),
    (ACCELERATION, FEED): ("feed acceleration",),
    (ACCELERATION, RAPID): ("rapid acceleration",),
    (JERK, FEED): ("feed ramp", "geometric ramp"),
    (JERK, RAPID): ("rapid ramp", "geometric ramp"),
}
# #VECTOR LIMIT: places in the row's ``end``
PATH = {
    "VEL": 0,
    "ACC": 1,
    "RADIAL_ACC": 2,
    "TRANS_ACC": 3,
    "JERK": 4,
    "RADIAL_JERK": 5,
}
# seconds per minute, to the power of the unit's
MINUTES = {
    "VEL": 1,
    "ACC": 2,
    "DEC": 2,
    "RADIAL_ACC": 2,
    "TRANS_ACC": 2,
    "JERK": 3,
    "RADIAL_JERK": 3,
}


class Dynamics:
    """Modal state of one channel; every change gives rows for the engine."""

    def __init__(self, modal: Modal, axes: int, warn: Warn) -> None:
        self._modal, self._axes, self._warn = modal, axes, warn
        self._weights: dict[str, FloatArray] = {
            w.name: np.ones(axes) for w in WEIGHTS.values()
        }
        self._told: dict[tuple[int, int], FloatArray] = {
            key: np.ones(axes) for key in PARTS
        }
        self._path: dict[str, float] = {}
        self._path_on: set[str] = set()
        self._path_rapid = False
        self._path_told = {FEED: [0.0] * 6, RAPID: [0.0] * 6}
        self.rapid_factor = 1.0
        self.profile = "HSC"

    def weigh(self, code: int, values: dict[int, float], offset: int) -> None:
        """Percent by channel axis.

        A G function for all axes gives the same value to each.
        """
        weight = WEIGHTS[code]
        for axis, percent in values.items():
            self._weights[weight.name][axis] = self._share(
                weight, code, percent, offset
            )

    def move_axes(
        self, before: list[int | None], after: list[int | None]
    ) -> None:
        """Weights go with their axes, given by number for each place.

        An axis that comes has the weight that all others share, else 100 % (R).
        """
        for name, old in self._weights.items():
            shares: dict[int | None, float] = {
                number: share
                for number, share in zip(before, old, strict=True)
                if number is not None
            }
            common = set(shares.values())
            new = common.pop() if len(common) == 1 else 1.0
            self._weights[name] = np.array(
                [shares.get(number, new) for number in after]
            )

    def _share(
        self, weight: Weight, code: int, percent: float, offset: int
    ) -> float:
        if not 0 <= percent <= 1e6:
            raise fail(900012, f"G{code}: {percent:g} % out of range", offset)
        share = percent / 100.0
        if weight.ramp:
            share = 1.0 / share if share > 0 else np.inf
        if share > 1.0:
            self._warn(
                50130,
                f"G{code}: {percent:g} % would exceed the machine's own limit, which holds",
                offset,
            )
        return min(1.0, max(LOWEST, share))

    def set_rapid_factor(self, factor: float) -> None:
        """#OVERRIDE RAPID_FACT, 1 for 100 %."""
        self.rapid_factor = factor

    def rows(self, n: int) -> list[Row]:
        """Rows of the changes since the last call."""
        rows = []
        for key, names in PARTS.items():
            shares = np.minimum.reduce([self._weights[name] for name in names])
            if key == (VELOCITY, RAPID):
                shares = np.minimum(
                    self._weights["rapid"] * self.rapid_factor,
                    self._weights["velocity"],
                )
                shares = np.maximum(shares, LOWEST)
            if not np.array_equal(shares, self._told[key]):
                self._told[key] = shares.copy()
                rows.append(self._row(key[0], key[1], shares, n))
        return rows + self._path_rows(n)

    def _row(
        self, code: int, value: int, end: FloatArray | list[float], n: int
    ) -> Row:
        row = self._modal.row(DYNAMICS, n, code=code, value=value)
        row["end"][0][: len(end)] = end
        return row

    # path limits

    def limit_path(self, limits: dict[str, float | None], rapid: bool) -> None:
        """#VECTOR LIMIT ON: values in units of minutes, None: as given last."""
        for name, value in limits.items():
            if value is not None:
                self._path[name] = value / SECONDS_PER_MINUTE ** MINUTES[name]
            self._path_on.add(name)
        self._path_rapid = rapid

    def limit_path_again(self) -> None:
        """#VECTOR LIMIT ON ALL."""
        self._path_on |= set(self._path)

    def free_path(self, names: set[str]) -> None:
        """#VECTOR LIMIT OFF: of the named limits, of all if none is named."""
        self._path_on -= names or set(MINUTES)

    @property
    def path_velocity(self) -> float:
        """Limit of the path feed, mm/s; 0: none."""
        return self._path.get("VEL", 0.0) if "VEL" in self._path_on else 0.0

    def _path_values(self) -> list[float]:
        values = [0.0] * 6
        for name, place in PATH.items():
            if name in self._path_on:
                values[place] = self._path.get(name, 0.0)
        if "DEC" in self._path_on and self._path.get("DEC"):
            values[PATH["ACC"]] = min(
                values[PATH["ACC"]] or np.inf, self._path["DEC"]
            )
        return values

    def _path_rows(self, n: int) -> list[Row]:
        rows, values = [], self._path_values()
        for which in (FEED, RAPID):
            wanted = values if which == FEED or self._path_rapid else [0.0] * 6
            if wanted != self._path_told[which]:
                self._path_told[which] = list(wanted)
                rows.append(self._row(lib.NC_DYNAMICS_PATH, which, wanted, n))
        return rows

    # profile

    def set_profile(self, name: str, n: int) -> list[Row]:
        """#SLOPE."""
        if name == self.profile:
            return []
        self.profile = name
        return [
            self._modal.row(
                DYNAMICS, n, code=lib.NC_DYNAMICS_PROFILE, value=PROFILES[name]
            )
        ]
