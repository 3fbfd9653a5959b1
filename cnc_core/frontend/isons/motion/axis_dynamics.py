"""Limits of the axes that machine parameters lower: VMAXG0 and ACC_G0 of the
cell, VMAX and ACC_LAV where the program writes them.

The machine's own limits are never exceeded; ``DYNAMICS`` rows tell the planner
the shares.
"""

from __future__ import annotations

import numpy as np

from cnc_core._engine import lib
from cnc_core.blocks import DYNAMICS
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.units import SECONDS_PER_MINUTE, FloatArray

from ..base.parameters import Parameters, acceleration
from ..base.text import AXIS_LETTERS

LOWEST = 0.001
FEED, RAPID = 0, 1
VELOCITY, ACCELERATION = (
    lib.NC_DYNAMICS_VELOCITY,
    lib.NC_DYNAMICS_ACCELERATION,
)


class AxisDynamics:
    """``rows`` are repeated once any of them has said something."""

    def __init__(
        self, machine: ProgramMachine, modal: Modal, parameters: Parameters
    ) -> None:
        self._modal, self._parameters = modal, parameters
        self._names = [name.upper() for name in machine.axes]
        count = len(self._names)
        self._velocity = _or_ones(machine.velocity, count)
        self._acceleration = _or_ones(machine.acceleration, count)
        self._told = False

    def rows(self, n: int) -> list[Row]:
        """Shares of speed and acceleration, of feed and of rapids."""
        speed, feed = self._speed(), self._accel("ACC_LAV")
        ceiling = self._parameters["VMAXG0"] / 100.0 or 1.0
        rapid = self._accel("ACC_G0") if self._parameters["ACC_G0"] else feed
        shares = {
            (VELOCITY, FEED): speed,
            (VELOCITY, RAPID): speed * ceiling,
            (ACCELERATION, FEED): feed,
            (ACCELERATION, RAPID): rapid,
        }
        self._told = self._told or any(
            (share < 1.0).any() for share in shares.values()
        )
        if not self._told:
            return []
        rows = []
        for (kind, motion), share in shares.items():
            row = self._modal.row(DYNAMICS, n, code=kind, value=motion)
            row["end"][0][: len(share)] = np.clip(share, LOWEST, 1.0)
            rows.append(row)
        return rows

    def _speed(self) -> FloatArray:
        p, share = self._parameters, np.ones(len(self._names))
        for i, name in enumerate(self._names):
            key = f"VMAX_{name}"
            if name in AXIS_LETTERS and key in p.written and p[key] > 0.0:
                limit = p.speed(key) / SECONDS_PER_MINUTE
                share[i] = limit / self._velocity[i]
        return np.minimum(share, 1.0)

    def _accel(self, name: str) -> FloatArray:
        """ACC_LAV of the cell is the machine's own limit, unless rapids have a
        larger one.
        """
        p = self._parameters
        acts = name == "ACC_G0" or {"ACC_LAV", "TAU"} & p.written
        larger = p["ACC_G0"] > p["ACC_LAV"]
        if p[name] <= 0.0 or not (acts or larger):
            return np.ones(len(self._names))
        limit = acceleration(p[name], p["TAU"])
        share: FloatArray = np.minimum(limit / self._acceleration, 1.0)
        return share


def _or_ones(values: FloatArray | None, count: int) -> FloatArray:
    return np.ones(count) if values is None else values
