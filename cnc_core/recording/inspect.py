"""What a recording holds: tables, statistics, the state at one place."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import CncError
from .reading import Recording, Table

KEYS = {"time": "t", "cycle": "cycle", "line": "line", "distance": "s"}


def summary(recording: Recording) -> dict[str, Any]:
    """Rows, columns with units, and the account without texts."""
    tables = {
        name: {
            "rows": len(recording.table(name)),
            "columns": recording.table(name).units,
        }
        for name in recording.tables
    }
    hidden = ("columns", "types", "row_groups", "rows")
    meta = {k: v for k, v in recording.meta.items() if k not in hidden}
    return {"complete": recording.complete, "tables": tables, "meta": meta}


def statistics(table: Table) -> dict[str, dict[str, Any]]:
    """Smallest, largest and mean value of each column of numbers."""
    found = {}
    for name in table.columns:
        if table.types[name] == "string" or not len(table):
            continue
        values = table[name]
        found[name] = {
            "min": values.min().item(),
            "max": values.max().item(),
            "mean": float(np.mean(values)),
        }
    return found


def parse_at(text: str) -> tuple[str, float]:
    """``time=S``, ``cycle=N``, ``line=N`` or ``distance=MM``; CncError otherwise."""
    key, equals, value = text.partition("=")
    try:
        if equals and key in KEYS:
            return key, float(value)
    except ValueError:
        pass
    raise CncError(
        902001, f"--at {text}: time=S, cycle=N, line=N or distance=MM"
    )


def state_at(
    recording: Recording, key: str, value: float
) -> dict[str, dict[str, Any] | None]:
    """One row a table: the last that is not behind the place; None: none yet.

    The cycle of the place is found first; the other tables are looked up by it.
    """
    row = _cycle_row(recording.cycles, key, value)
    if row is None:
        raise CncError(
            902001, f"--at {key}={value:g}: nothing is recorded there"
        )
    cycle = recording.cycles.row(row)
    found: dict[str, dict[str, Any] | None] = {}
    for name in recording.tables:
        table = recording.table(name)
        if name == "cycles":
            found[name] = cycle
        elif "cycle" in table.columns:
            cycles = table["cycle"]
            before = int(np.searchsorted(cycles, cycle["cycle"], "right"))
            found[name] = table.row(before - 1) if before else None
        elif "element" in table.columns and "block" in cycle:
            same = np.flatnonzero(table["element"] == cycle["block"])
            found[name] = table.row(int(same[0])) if len(same) else None
    return found


def _cycle_row(cycles: Table, key: str, value: float) -> int | None:
    """Number of the first cycle of the line, or of the last one that is not
    behind the time, cycle or distance.
    """
    column = KEYS[key]
    if column not in cycles.columns:
        return None
    values = cycles[column]
    if not len(values):
        return None
    if key == "line":
        same = np.flatnonzero(values == value)
        return int(same[0]) if len(same) else None
    if key == "distance":
        reached = np.flatnonzero(values >= value)
        return int(reached[0]) if len(reached) else None
    # times are products of the cycle time: half a row is not missed by rounding
    slack = 1e-9 * max(1.0, abs(value))
    before = int(np.searchsorted(values, value + slack, "right"))
    return before - 1 if before else None
