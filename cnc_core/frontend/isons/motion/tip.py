"""RTCP: whether the tool tip is programmed, and where it is then.

The words of G103, G104 and G105 are read in ``tip_words.py``.
"""

from __future__ import annotations

import numpy as np

from cnc_core.frontend.machine import ProgramMachine, TipMachine
from cnc_core.units import FloatArray


class Tip:
    """State of RTCP.

    ``values``: of G103 by axis letter.  ``on``: the tool tip is programmed.
    ``length``: of the tool, mm, as it was when RTCP was switched on.
    """

    def __init__(self, machine: ProgramMachine) -> None:
        self._machine = machine
        self.values: dict[str, float] = {}
        self.on = False
        self.length = 0.0

    @property
    def machine(self) -> TipMachine | None:
        """The kinematics in force, None if the machine has none."""
        number = self._machine.kin_id
        return None if number is None else self._machine.kinematics.get(number)

    def programmed(self, axes: FloatArray) -> FloatArray:
        """(axes,) what is programmed where the axes stand."""
        machine = self.machine
        if not self.on or machine is None:
            return axes
        return np.asarray(machine.programmed(axes[None, :], self.length)[0])
