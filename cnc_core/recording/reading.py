"""Reading a recording.

Recording("run.parquet").cycles["v"]
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from cnc_core.units import AnyArray

from ..errors import CncError, Place
from .channels import OneChannel
from .parts import (
    folder_of,
    is_folder_of_parts,
    living_owner,
    source_of_parts,
)
from .source import (
    ArrowSource,
    NpzSource,
    ParquetSource,
    Source,
    not_a_recording,
)
from .trust import trusted

SOURCES: dict[str, Any] = {
    ".parquet": ParquetSource,
    ".arrow": ArrowSource,
    ".npz": NpzSource,
}


class Table:
    """One table: ``table["v"]`` is a column as a numpy array."""

    def __init__(self, source: Source, name: str) -> None:
        self._source = source
        self.name = name
        self.columns: tuple[str, ...] = tuple(source.tables[name])
        known = source.meta.get("columns", {}).get(name, {})
        self.units: dict[str, str] = {c: known.get(c, "") for c in self.columns}
        self.types: dict[str, str] = dict(source.tables[name])

    def __len__(self) -> int:
        return self._source.rows(self.name)

    def __getitem__(self, column: str) -> AnyArray:
        """The whole column (n,); KeyError names the columns that there are."""
        self.check(column)
        parts = [
            chunk.column(column).to_numpy()
            for chunk in self._source.chunks(self.name, [column])
        ]
        if not parts:
            return np.empty(0, dtype_of(self.types[column]))
        return np.concatenate(parts)

    def check(self, column: str) -> None:
        """KeyError if there is no such column."""
        if column not in self.columns:
            raise KeyError(
                f"{self.name} has no column {column!r}: {', '.join(self.columns)}"
            )

    def chunks(self, columns: Sequence[str] | None = None) -> Iterator[Any]:
        """The rows in order as Arrow tables; memory for one of them."""
        return self._source.chunks(
            self.name, self.columns if columns is None else columns
        )

    def row(self, index: int) -> dict[str, Any]:
        """One row by its number; IndexError if there is none."""
        first = 0
        for chunk in self.chunks():
            if index < first + len(chunk):
                found: dict[str, Any] = chunk.slice(
                    index - first, 1
                ).to_pylist()[0]
                return found
            first += len(chunk)
        raise IndexError(f"{self.name} has {first} rows")


class Recording:
    """A recorded run, from any kind of file or the parts of a dead run.

    ``complete``: it was written to its end.  ``meta``: units, cell, program,
    versions, what was lost.  CncError: no such file, or no recording.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._take(trusted(self.path, _open(self.path)))

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels; empty: it is of a cell with one channel, or one
        channel of several.
        """
        return tuple(one["name"] for one in self.meta.get("channels", ()))

    def channel(self, name: str) -> Recording:
        """One channel of several as if it had been alone; CncError 902001 names
        the channels that there are.
        """
        if name not in self.channels:
            known = ", ".join(self.channels) or "it has one channel"
            raise CncError(902001, f"{self.path}: no channel {name!r}: {known}")
        found = Recording.__new__(Recording)
        found.path = self.path
        found._take(OneChannel(self.source, name))
        return found

    def _take(self, source: Source) -> None:
        self.source = source
        self.meta: dict[str, Any] = source.meta
        self.complete: bool = source.complete
        self.tables: tuple[str, ...] = tuple(source.tables)

    def table(self, name: str) -> Table:
        """A table by name; KeyError names the tables that there are."""
        if name not in self.tables:
            raise KeyError(f"no table {name!r}: {', '.join(self.tables)}")
        return Table(self.source, name)

    @property
    def cycles(self) -> Table:
        """Every cycle: time, axes, speed, override, block."""
        return self.table("cycles")

    @property
    def requests(self) -> Table:
        """Requests of the contour look-ahead."""
        return self.table("requests")

    @property
    def functions(self) -> Table:
        """M, H, S and T functions."""
        return self.table("functions")

    @property
    def elements(self) -> Table:
        """The contour."""
        return self.table("elements")

    @property
    def plc(self) -> Table:
        """Watched symbols of the PLC, one row a scan."""
        return self.table("plc")

    @property
    def exchange(self) -> Table:
        """What CNC and PLC changed in the memory, scan by scan."""
        return self.table("exchange")

    @property
    def events(self) -> Table:
        """Errors, messages, overruns."""
        return self.table("events")

    def frame(self, table: str = "cycles") -> Any:
        """A table as a pandas DataFrame, a polars one if there is no pandas, an
        Arrow table if there is neither.
        """
        import pyarrow as pa  # noqa: PLC0415

        found = self.table(table)
        whole = pa.table({name: found[name] for name in found.columns})
        if find_spec("pandas"):
            return whole.to_pandas()
        if find_spec("polars"):
            import polars  # noqa: PLC0415

            return polars.from_arrow(whole)
        return whole


def dtype_of(arrow_type: str) -> np.dtype[Any]:
    """The numpy dtype of an Arrow type by name."""
    names = {"double": "f8", "bool": "?", "string": "O"}
    return np.dtype(names.get(arrow_type, arrow_type))


def _open(path: Path) -> Source:
    parts = path if path.is_dir() else folder_of(path)
    if path.is_dir() and not is_folder_of_parts(path):
        raise not_a_recording(path, "a folder")
    if not path.is_file() and parts.is_dir():
        return source_of_parts(parts, live=bool(living_owner(parts)))
    if not path.is_file():
        raise CncError(901001, "file not found", Place(str(path)))
    kind = SOURCES.get(path.suffix)
    if kind is None:
        raise not_a_recording(
            path, f"the name must end in {', '.join(SOURCES)}"
        )
    source: Source = kind(path)
    return source
