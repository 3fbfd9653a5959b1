"""A part of a recording: an Arrow IPC stream that grows batch by batch.

Each side of a cell writes one of its own.  A column of the stream is a table, a
list of rows; a batch holds one list a table.  So one stream carries several
tables of any lengths, and ``explode`` and ``unnest`` of any Arrow tool show
them.  A file that was cut anywhere holds every batch that was written whole.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from io import FileIO
from pathlib import Path
from typing import Any

META = b"hli-cosim"
END_OF_STREAM = b"\xff\xff\xff\xff\0\0\0\0"

Schema = Mapping[str, Mapping[str, str]]
"""Columns of each table and their Arrow types by name."""


def arrow_schema(tables: Schema, meta: bytes) -> Any:
    """The schema of a stream; ``meta``: JSON for the key ``hli-cosim``."""
    import pyarrow as pa  # noqa: PLC0415

    fields = [
        pa.field(name, pa.list_(pa.struct(_fields(columns))))
        for name, columns in tables.items()
    ]
    return pa.schema(fields, metadata={META: meta})


def _fields(columns: Mapping[str, str]) -> list[Any]:
    import pyarrow as pa  # noqa: PLC0415

    return [
        pa.field(name, pa.type_for_alias(kind))
        for name, kind in columns.items()
    ]


def batch_of(schema: Any, tables: Mapping[str, Mapping[str, Any]]) -> Any:
    """One batch; tables that are not named have no rows in it.

    ``tables``: columns (n,) of each table.
    """
    import pyarrow as pa  # noqa: PLC0415

    lists = []
    for field in schema:
        inner = field.type.value_type
        columns = tables.get(field.name, {})
        arrays = [
            pa.array(columns.get(part.name, ()), part.type) for part in inner
        ]
        struct = pa.StructArray.from_arrays(arrays, fields=list(inner))
        offsets = pa.array([0, len(struct)], pa.int32())
        lists.append(pa.ListArray.from_arrays(offsets, struct, type=field.type))
    return pa.record_batch(lists, schema=schema)


class PartFile:
    """Appends batches to a file; a batch that does not fit leaves no trace.

    ``problem``: the first error of the disk, None while there was none.  A file
    that cannot be made takes no batch.
    """

    def __init__(self, path: Path, tables: Schema, meta: bytes) -> None:
        self.schema = arrow_schema(tables, meta)
        self.problem: OSError | None = None
        self._file: FileIO | None = None
        try:
            self._file = path.open("wb", buffering=0)
        except OSError as error:
            self.problem = error
        self._good = 0
        self._begun = False

    def add(self, tables: Mapping[str, Mapping[str, Any]]) -> bool:
        """Whether the batch is in the file; the next one may fit again."""
        return self._begin() and self._append(
            batch_of(self.schema, tables).serialize()
        )

    def close(self) -> None:
        """End the stream; nothing more is added."""
        if self._begin():
            self._append(END_OF_STREAM)
        if self._file is not None:
            self._file.close()

    def _begin(self) -> bool:
        """Whether the schema is in the file."""
        self._begun = self._begun or self._append(self.schema.serialize())
        return self._begun

    def _append(self, data: Any) -> bool:
        file = self._file
        if file is None:
            return False
        view = memoryview(data)
        try:
            while view:
                view = view[file.write(view) or 0 :]
        except OSError as error:
            self.problem = self.problem or error
            with contextlib.suppress(OSError):
                os.ftruncate(file.fileno(), self._good)
                file.seek(self._good)
            return False
        self._good = file.tell()
        return True
