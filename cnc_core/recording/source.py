"""Where the rows of a recording come from: Arrow streams, Parquet, npz.

Every source gives a table in chunks of columns, so that a reader needs no more
memory than a chunk.
"""

from __future__ import annotations

import json
import mmap
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from hli.part_file import END_OF_STREAM, META

from ..errors import CncError
from .npz_member import BROKEN, KINDS, META_BYTES, TEXT, array_of
from .schema import TABLES

BEGIN_OF_STREAM = b"\xff\xff\xff\xff"
CHUNK_ROWS = 131_072
"""Rows of a chunk that is written; readers take what they find."""
TOUCHED_BYTES = 1 << 26
"""Of a mapped file that stay in memory while it is read; the rest is given back."""


OTHER = "it is not of hli-cosim"


class Source(Protocol):
    """One file of a recording."""

    meta: dict[str, Any]
    complete: bool  # it was written to its end
    tables: dict[str, dict[str, str]]  # Arrow type by column by table

    def rows(self, table: str) -> int:
        """Rows of a table."""
        ...

    def chunks(self, table: str, columns: Sequence[str]) -> Iterator[Any]:
        """The table's rows in order, as Arrow tables with these columns."""
        ...


class ArrowSource:
    """An Arrow stream, as far as it was written; ``live``: it may still change."""

    def __init__(self, path: Path, live: bool = False) -> None:
        import pyarrow as pa  # noqa: PLC0415

        self._path, self._live = path, live
        self.meta: dict[str, Any] = {}
        self.tables: dict[str, dict[str, str]] = {}
        self._rows: dict[str, int] = {}
        self._batches = 0
        self._ended = False
        try:
            schema = self._open()[0].schema
        except (pa.ArrowInvalid, OSError):
            if not _may_be_cut(path):
                raise not_a_recording(path, "no Arrow stream") from None
            self.complete = False
            return
        if META not in (schema.metadata or {}):
            raise not_a_recording(path, OTHER)
        self.meta = meta_of(schema.metadata)
        try:
            self.tables = {
                field.name: {p.name: str(p.type) for p in field.type.value_type}
                for field in schema
            }
        except (AttributeError, TypeError):
            raise not_a_recording(path, OTHER) from None
        self._rows = dict.fromkeys(self.tables, 0)
        for batch in self._read():
            self._batches += 1
            for name in self.tables:
                self._rows[name] += len(batch.column(name).values)
        self.complete = self._ended and bool(self.meta.get("complete"))

    def rows(self, table: str) -> int:
        """Rows of a table."""
        return self._rows.get(table, 0)

    def chunks(self, table: str, columns: Sequence[str]) -> Iterator[Any]:
        """One chunk a batch that has rows of the table."""
        import pyarrow as pa  # noqa: PLC0415

        for batch in self._read(self._batches):
            rows = batch.column(table).values
            if len(rows):
                arrays = [rows.field(name) for name in columns]
                yield pa.table(arrays, names=list(columns))

    def _read(self, limit: int | None = None) -> Iterator[Any]:
        """Batches up to the first that is not whole."""
        import pyarrow as pa  # noqa: PLC0415

        stream, mapped = self._open()
        touched = 0
        while limit is None or limit > 0:
            try:
                batch = stream.read_next_batch()
                yield batch
                touched += batch.nbytes
                if mapped is not None and touched > TOUCHED_BYTES:
                    touched = 0
                    mapped.madvise(mmap.MADV_DONTNEED)
            except StopIteration:
                self._ended = self._tail() == END_OF_STREAM
                return
            except (pa.ArrowInvalid, OSError):
                return
            limit = None if limit is None else limit - 1

    def _open(self) -> tuple[Any, mmap.mmap | None]:
        """The stream, and the memory that the file is mapped to."""
        import pyarrow as pa  # noqa: PLC0415

        if self._path.stat().st_size == 0:
            raise pa.ArrowInvalid("empty")
        if self._live:
            # a file that somebody cuts must not end the reader
            return pa.ipc.open_stream(pa.OSFile(str(self._path))), None
        with self._path.open("rb") as file:
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        source = pa.BufferReader(pa.py_buffer(mapped))
        return pa.ipc.open_stream(source), mapped

    def _tail(self) -> bytes:
        with self._path.open("rb") as file:
            file.seek(-len(END_OF_STREAM), 2)
            return file.read()


def _may_be_cut(path: Path) -> bool:
    """Whether a file without a schema is the beginning of a stream."""
    try:
        with path.open("rb") as file:
            begin = file.read(len(BEGIN_OF_STREAM))
    except OSError:
        return True
    return BEGIN_OF_STREAM.startswith(begin)


class ParquetSource:
    """A Parquet file: a row group belongs to one table, which ``table`` names.

    The columns of a table are called ``table.column``.
    """

    def __init__(self, path: Path) -> None:
        import pyarrow as pa  # noqa: PLC0415
        import pyarrow.parquet as pq  # noqa: PLC0415

        try:
            self._file = pq.ParquetFile(path, memory_map=False)
        except pa.ArrowInvalid:
            raise not_a_recording(
                path, "no Parquet file, or one that was cut"
            ) from None
        self.meta = meta_of(self._file.schema_arrow.metadata)
        if not self.meta:
            raise not_a_recording(path, OTHER)
        self.complete = bool(self.meta.get("complete"))
        try:
            self.tables = {
                name: {str(n): str(kind) for n, kind in columns.items()}
                for name, columns in self.meta["types"].items()
            }
            self._groups: dict[str, list[int]] = {}
            left = self._file.num_row_groups
            for name, count in self.meta["row_groups"]:
                first = self._file.num_row_groups - left
                left -= count
                if count < 0 or left < 0:
                    raise ValueError
                groups = self._groups.setdefault(name, [])
                groups += range(first, first + count)
        except (KeyError, TypeError, ValueError, AttributeError):
            raise not_a_recording(path, OTHER) from None
        self._path = path
        if not self._is_likely():
            raise not_a_recording(path, "it has other columns than it says")

    def _is_likely(self) -> bool:
        """Whether the file has the columns of its account."""
        types = {one.name: str(one.type) for one in self._file.schema_arrow}
        told = {
            f"{table}.{column}": kind
            for table, columns in self.tables.items()
            for column, kind in columns.items()
        }
        return told.items() <= types.items()

    def rows(self, table: str) -> int:
        """Rows of a table."""
        info = self._file.metadata
        groups = self._groups.get(table, [])
        return sum(info.row_group(i).num_rows for i in groups)

    def chunks(self, table: str, columns: Sequence[str]) -> Iterator[Any]:
        """One chunk a row group; CncError: its pages are damaged."""
        import pyarrow as pa  # noqa: PLC0415

        names = [f"{table}.{column}" for column in columns]
        for group in self._groups.get(table, []):
            try:
                found = self._file.read_row_group(group, columns=names)
            except (pa.ArrowException, OSError):
                raise self._damaged(table) from None
            found = found.select(names).rename_columns(list(columns))
            if any(column.null_count for column in found.columns):
                raise self._damaged(table)  # its rows are of another table
            yield found

    def _damaged(self, table: str) -> CncError:
        return not_a_recording(self._path, f"{table} is damaged")


class NpzSource:
    """An npz file: one array a column, called ``table.column``."""

    def __init__(self, path: Path) -> None:
        self._path = path  # opened for each table: nobody closes a recording
        try:
            with zipfile.ZipFile(path) as file:
                text = array_of(file, "meta", (), TEXT, META_BYTES)
            self.meta = json.loads(str(text))
            self.tables = {
                name: {str(n): str(kind) for n, kind in columns.items()}
                for name, columns in self.meta["types"].items()
            }
            self._rows = {n: int(k) for n, k in self.meta["rows"].items()}
            if not all(map(self._is_likely, self.tables)):
                raise KeyError
        except (zipfile.BadZipFile, EOFError, ValueError, RecursionError):
            raise not_a_recording(path, "no npz file") from None
        except BROKEN:
            raise not_a_recording(path, OTHER) from None
        self.complete = bool(self.meta.get("complete"))

    def _is_likely(self, table: str) -> bool:
        """Whether a table has rows only where it has columns."""
        rows = self.rows(table)
        return rows >= 0 and bool(self.tables[table] or not rows)

    def rows(self, table: str) -> int:
        """Rows of a table."""
        return self._rows.get(table, 0)

    def chunks(self, table: str, columns: Sequence[str]) -> Iterator[Any]:
        """The whole table; CncError: a column is not what the account says."""
        if not self.rows(table):
            return
        kinds = {name: KINDS[self.tables[table][name]] for name in columns}
        try:
            found = self._columns(table, kinds)
        except BROKEN:
            why = f"{table}: a column is not what the account says"
            raise not_a_recording(self._path, why) from None
        yield found

    def _columns(self, table: str, kinds: dict[str, np.dtype[Any]]) -> Any:
        import pyarrow as pa  # noqa: PLC0415

        shape = (self.rows(table),)
        with zipfile.ZipFile(self._path) as file:
            arrays = [
                pa.array(array_of(file, f"{table}.{name}", shape, kind))
                for name, kind in kinds.items()
            ]
        return pa.table(arrays, names=list(kinds))


class JoinedSource:
    """The parts of one run: each table is in one of them."""

    def __init__(self, sources: Sequence[Source]) -> None:
        self._sources = sources
        self.meta: dict[str, Any] = {}
        for source in sources:
            for key, value in source.meta.items():
                known = self.meta.get(key)
                if isinstance(known, dict) and isinstance(value, dict):
                    value = {**known, **value}  # noqa: PLW2901
                self.meta[key] = value
        self.complete = False
        self.tables = {
            name: columns
            for table in TABLES
            for source in sources
            for name, columns in source.tables.items()
            if name == table
        }

    def rows(self, table: str) -> int:
        """Rows of a table."""
        return sum(source.rows(table) for source in self._sources)

    def chunks(self, table: str, columns: Sequence[str]) -> Iterator[Any]:
        """The chunks of the part that holds the table."""
        for source in self._sources:
            if table in source.tables:
                yield from source.chunks(table, columns)


def meta_of(metadata: dict[bytes, bytes] | None) -> dict[str, Any]:
    """What a schema says of the recording, empty if it is none."""
    text = (metadata or {}).get(META, b"{}")
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}


def rechunked(chunks: Iterator[Any], rows: int = CHUNK_ROWS) -> Iterator[Any]:
    """The same rows in chunks of one size, whatever the batches were."""
    import pyarrow as pa  # noqa: PLC0415

    held: list[Any] = []
    count = 0
    for chunk in chunks:
        held.append(chunk)
        count += len(chunk)
        while count >= rows:
            table = pa.concat_tables(held)
            yield table.slice(0, rows).combine_chunks()
            held, count = [table.slice(rows)], count - rows
    if count:
        yield pa.concat_tables(held).combine_chunks()


def not_a_recording(path: Path, why: str) -> CncError:
    """The error for a file that is no recording."""
    return CncError(901002, f"{path}: no recording: {why}")
