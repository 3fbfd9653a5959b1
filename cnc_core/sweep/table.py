"""The table of a study: a row a run, parameters and figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cnc_core.units import AnyArray

from ..errors import CncError, Place
from .points import Point

TABLE = "study.parquet"
# of a row, but not the same every time
NOT_KEPT = ("seconds",)
LAST = ("end", "error")


class Results(Mapping[str, AnyArray]):
    """Columns of the table by name: ``number``, ``program``, ``cell``, ``plc``,
    each parameter, each figure, ``end`` and ``error``; a row a run.
    """

    def __init__(self, folder: str | Path) -> None:
        self.path = Path(folder) / TABLE
        try:
            self._table = pq.read_table(self.path)
        except FileNotFoundError:
            text = "no table: the sweep has not ended; --resume goes on"
            raise CncError(901001, text, Place(str(self.path))) from None
        except pa.ArrowInvalid as error:
            raise CncError(901002, str(error), Place(str(self.path))) from None

    def __getitem__(self, name: str) -> AnyArray:
        if name not in self._table.column_names:
            there = ", ".join(self._table.column_names)
            raise KeyError(f"no column {name!r}; there are: {there}")
        return np.asarray(
            self._table.column(name).to_numpy(zero_copy_only=False)
        )

    def __iter__(self) -> Iterator[str]:
        return iter(self._table.column_names)

    def __len__(self) -> int:
        return len(self._table.column_names)

    @property
    def runs(self) -> int:
        """Rows of the table."""
        return int(self._table.num_rows)

    @property
    def failed(self) -> int:
        """Runs that did not complete."""
        return int(np.sum(self["end"] != "completed"))

    def rows(self) -> list[dict[str, Any]]:
        """Every run as a dict."""
        out: list[dict[str, Any]] = self._table.to_pylist()
        return out

    def frame(self) -> Any:
        """As a pandas frame; ImportError without pandas."""
        return self._table.to_pandas()


def write_table(
    folder: Path, runs: Sequence[Point], rows: Mapping[int, dict[str, Any]]
) -> Results:
    """The rows in the order of the study, the same bytes for the same rows."""
    lines = [_line(run, rows[run.number]) for run in runs]
    names = list(dict.fromkeys(name for line in lines for name in line))
    names = [name for name in names if name not in LAST] + list(LAST)
    columns = {
        name: _column([line.get(name) for line in lines]) for name in names
    }
    part = folder / f"{TABLE}.part"
    try:
        pq.write_table(pa.table(columns), part, compression="zstd")
        part.replace(folder / TABLE)
    except OSError as error:
        part.unlink(missing_ok=True)
        text = f"table cannot be written: {error.strerror or error}"
        raise CncError(901004, text, Place(str(folder / TABLE))) from None
    return Results(folder)


def _line(run: Point, row: dict[str, Any]) -> dict[str, Any]:
    begin = {
        "number": run.number,
        "program": run.program,
        "cell": run.cell,
        "plc": run.plc,
        **run.parameters,
    }
    kept = {k: v for k, v in row.items() if k not in NOT_KEPT}
    return begin | kept


def _column(values: list[Any]) -> Any:
    """An Arrow column; values of several types become texts."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int, float} and len(kinds) > 1:
        values = [None if v is None else float(v) for v in values]
    elif len(kinds) > 1 or kinds & {dict, list}:
        values = [None if v is None else str(v) for v in values]
    return pa.array(values)
