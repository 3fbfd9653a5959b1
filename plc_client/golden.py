"""Golden runs: what a run gave is kept beside the test, and compared with a
tolerance from then on.

A golden file is text (CSV with a header) so that a change can be read in a
review.  Columns are numbers: samples of the path, watched variables of the PLC.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

Columns = Mapping[str, Any]
Array = np.ndarray[Any, Any]
DIGITS = 12


class GoldenMismatchError(AssertionError):
    """A run differs from its golden file; the text names the first place of
    every column that does.
    """


def write(path: Path, columns: Columns) -> None:
    """Write the golden file; all columns must have one length.  Raises ValueError."""
    table = _table(columns)
    path.parent.mkdir(parents=True, exist_ok=True)
    header = ",".join(f'"{name}"' for name in table)
    rows = np.column_stack(list(table.values()))
    np.savetxt(
        path,
        rows,
        delimiter=",",
        header=header,
        comments="",
        fmt=f"%.{DIGITS}g",
    )


def read(path: Path) -> dict[str, Array]:
    """The columns of a golden file."""
    with path.open() as file:
        names = [
            name.strip('"') for name in file.readline().strip().split('","')
        ]
        rows = np.loadtxt(file, delimiter=",", ndmin=2)
    return {name: rows[:, i] for i, name in enumerate(names)}


def compare(
    path: Path, columns: Columns, tolerance: float | Mapping[str, float] = 1e-9
) -> None:
    """Raises GoldenMismatchError.

    ``tolerance``: absolute, for all columns or by name (others: 1e-9).
    """
    expected, found = read(path), _table(columns)
    problems = [
        f"column {name!r} is missing" for name in expected if name not in found
    ]
    problems += [
        f"column {name!r} is new" for name in found if name not in expected
    ]
    both = [name for name in expected if name in found]
    lengths = {len(found[name]) for name in both} | {
        len(expected[name]) for name in both
    }
    if len(lengths) > 1:
        found_rows = len(next(iter(found.values())))
        expected_rows = len(next(iter(expected.values())))
        problems.append(f"{found_rows} rows instead of {expected_rows}")
    for name in both:
        limit = (
            tolerance
            if isinstance(tolerance, (int, float))
            else tolerance.get(name, 1e-9)
        )
        problems += _column(
            name, expected[name], found[name], limit, expected.get("t")
        )
    if problems:
        raise GoldenMismatchError(f"{path}:\n  " + "\n  ".join(problems))


def _table(columns: Columns) -> dict[str, Array]:
    table = {
        name: np.asarray(values, np.float64).ravel()
        for name, values in columns.items()
    }
    if len({len(values) for values in table.values()}) > 1:
        raise ValueError(
            f"columns of different length: { {n: len(v) for n, v in table.items()} }"
        )
    return table


def _column(
    name: str, expected: Array, found: Array, limit: float, time_s: Array | None
) -> list[str]:
    n = min(len(expected), len(found))
    e, f = expected[:n], found[:n]
    neither = np.isnan(e) & np.isnan(f)
    same = (np.abs(e - f) <= limit) | neither
    if same.all():
        return []
    i = int(np.argmin(same))
    at = f" (t = {time_s[i]:g} s)" if time_s is not None else ""
    worst = float(np.nanmax(np.abs(e - f)))
    count = int((~same).sum())
    values = f"{f[i]:.{DIGITS}g} instead of {e[i]:.{DIGITS}g}"
    return [
        f"{name!r}: row {i}{at}: {values}; {count} rows, at most {worst:.3g} off"
    ]


def check(
    path: Path,
    columns: Columns,
    tolerance: float | Mapping[str, float] = 1e-9,
    *,
    update: bool = False,
) -> None:
    """Compare, or write with ``update``; a golden file that is not there is an
    error that says how to make it.
    """
    if update:
        write(path, columns)
    elif not path.is_file():
        raise GoldenMismatchError(
            f"{path}: no golden file; write it with pytest --golden-update and look at it"
        )
    else:
        compare(path, columns, tolerance)
