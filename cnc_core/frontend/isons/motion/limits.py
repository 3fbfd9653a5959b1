"""Primary and secondary software limits (G81)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cnc_core.frontend.machine import ProgramMachine
from cnc_core.units import FloatArray

from ..base.parameters import Parameters

UNIT_MM = 0.001


class Limits:
    """Which limit is in force at each end of each axis."""

    def __init__(self, machine: ProgramMachine, parameters: Parameters) -> None:
        self._names = [name.upper() for name in machine.axes]
        self._parameters = parameters
        count = len(self._names)
        far = np.full(count, np.inf)
        self._cell = machine.limits or (-far, far)
        # negative, positive
        self._secondary: npt.NDArray[np.bool_] = np.zeros(
            (2, count), dtype=bool
        )
        self.refresh()

    def stricter(self) -> tuple[FloatArray, FloatArray] | None:
        """Lowest and highest position of the axes, without bound where the cell's
        limits, which hold in any case, say the same; None: they all do.
        """
        low, high = self._cell
        tighter = (self.low > low) | (self.high < high)
        if not tighter.any():
            return None
        return (
            np.where(tighter, self.low, -np.inf),
            np.where(tighter, self.high, np.inf),
        )

    def _name(self, end: int, axis: str, secondary: bool) -> str:
        return f"{'2ND_' if secondary else ''}LIMITE_{'NP'[end]}_{axis}"

    def choose(self, axis: int, mode: int) -> None:
        """G81: 0 primary positive, 1 primary negative, 2 secondary positive, 3
        secondary negative.
        """
        self._secondary[0 if mode % 2 else 1, axis] = mode >= 2

    def refresh(self) -> None:
        self.low = self._values(0)
        self.high = self._values(1)

    def _values(self, end: int) -> FloatArray:
        found = np.array(self._cell[end], dtype=np.float64)
        for i, axis in enumerate(self._names):
            for secondary in (False, True):
                name = self._name(end, axis, secondary)
                if secondary <= bool(
                    self._secondary[end, i]
                ) and self._parameters.given(name):
                    found[i] = self._parameters[name] * UNIT_MM
        return found
