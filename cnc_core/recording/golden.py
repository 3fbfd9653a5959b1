"""Golden recordings: a run is kept beside the test, and compared from then on."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from plc_client.golden import GoldenMismatchError

from .compare import Comparison, compare
from .reading import Recording
from .targets import write_target


def check_recording(
    path: Path,
    recording: Recording | str | Path,
    tolerance: float | Mapping[str, float] = 1e-9,
    update: bool = False,
) -> None:
    """Compare with the golden file, or write it with ``update``.

    ``tolerance``: largest difference of all numbers, or by column (others: 0).
    Raises GoldenMismatchError: the recording differs, or there is no golden file.
    """
    found = (
        recording if isinstance(recording, Recording) else Recording(recording)
    )
    if update:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_target(found.source, path)
        return
    if not path.is_file():
        raise GoldenMismatchError(
            f"{path}: no golden file; write it with pytest --golden-update"
            " and look at it"
        )
    golden = Recording(path)
    bounds = (
        tolerance
        if isinstance(tolerance, Mapping)
        else dict.fromkeys(_numbers(golden), tolerance)
    )
    said = compare(golden, found, tolerance=bounds)
    if not said.equal:
        raise GoldenMismatchError(f"{path}: {_text(said)}")


def _numbers(recording: Recording) -> list[str]:
    """Columns of numbers that are measured, not counted."""
    return [
        f"{name}.{column}"
        for name in recording.tables
        for column, kind in recording.table(name).types.items()
        if kind == "double"
    ]


def _text(said: Comparison) -> str:
    """The first difference, and what else differs."""
    lines = []
    if said.first is not None:
        first = said.first
        column = first.column or "number of rows"
        place = f" (line {first.line})" if first.line else ""
        a, b = json.dumps(first.a), json.dumps(first.b)
        lines.append(
            f"{first.table} row {first.row}{place}: {column}: {b} instead of {a}"
        )
    lines += [
        f"{table}.{column or 'rows'}: {count} differ"
        for table, columns in said.counts.items()
        for column, count in columns.items()
    ]
    return "\n  ".join(lines)
