"""M functions of type MNE_SNS: put out where the probe trips in the block's
motion, waited for at its end.
"""

from __future__ import annotations

import numpy as np

from cnc_core.blocks import EXACT_STOP, LINEAR, M
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.probe import trip
from cnc_core.frontend.base.scanner import Row
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.units import FloatArray

MEASURING = "MNE_SNS"


def measures(row: Row, machine: ProgramMachine) -> bool:
    """The row is such a function."""
    return bool(row["type"][0] == M) and MEASURING in machine.m_functions.get(
        int(row["code"][0]), ""
    )


def place_functions(
    before: list[Row],
    motion: list[Row],
    start: FloatArray,
    machine: ProgramMachine,
) -> tuple[list[Row], list[Row]]:
    """Rows ahead of a block's motion, and its motion with the function in it.

    A straight motion is parted where the probe trips. Without a trip the
    function stands behind the motion.
    """
    mine = [row for row in before if measures(row, machine)]
    if not mine:
        return before, motion
    if len(mine) > 1:
        raise fail(20156, ERRORS[20156], 0)
    rest = [row for row in before if not measures(row, machine)]
    lines = [i for i, row in enumerate(motion) if row["type"][0] == LINEAR]
    found = None
    if len(lines) == 1:
        row = motion[lines[0]]
        found = trip(
            start,
            row["end"][0][: len(start)].astype(np.float64),
            machine.axes,
            machine.probe,
        )
    if found is None:
        return rest, motion + mine
    share, place = found
    first, second = row.copy(), row.copy()
    first["end"][0][: len(start)] = place
    first["flags"] &= ~np.uint16(
        EXACT_STOP
    )  # the stop belongs to the block's end
    for name in ("length", "length_min"):
        first[name] = row[name] * share
        second[name] = row[name] * (1.0 - share)
    parts = [
        part
        for part in (first, *mine, second)
        if part["type"][0] == M or part["length"][0] > 0.0
    ]
    at = lines[0]
    return rest, [*motion[:at], *parts, *motion[at + 1 :]]
