"""From the parts of a run to the file that the user named.

It is written aside and takes its name when it is whole.
"""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hli.part_file import END_OF_STREAM, arrow_schema, batch_of

from ..errors import CncError
from .mcap_file import need_mcap, write_mcap
from .schema import is_wall
from .source import Source, rechunked

STREAM_ROWS = 65_536  # rows of a batch; a list counts them in 32 bits
GROUP_ROWS = 131_072  # rows of a row group
ZSTD_LEVEL = 1
PATH_COLUMNS = ("s", "v", "block")  # of each channel


def write_target(source: Source, target: Path) -> None:
    """Write the recording as the kind of file that the name says.  OSError: what
    the disk says; then nothing of it is left.
    """
    aside = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        WRITERS[target.suffix](source, aside)
        aside.replace(target)
    finally:
        aside.unlink(missing_ok=True)


def whole_meta(source: Source) -> dict[str, Any]:
    """The recording's own account, with its rows."""
    rows = {table: source.rows(table) for table in source.tables}
    columns = source.meta.get("columns", {})
    shown = {
        table: {name: columns.get(table, {}).get(name, "") for name in names}
        for table, names in source.tables.items()
    }
    return source.meta | {
        "rows": rows,
        "columns": shown,
        "types": source.tables,
    }


def _chunks(
    source: Source, table: str, columns: list[str] | None = None
) -> Iterator[Any]:
    """A table in the order of the file."""
    if table == "events":
        return _in_order(source.chunks(table, list(source.tables[table])))
    return source.chunks(table, columns or list(source.tables[table]))


def _in_order(chunks: Iterator[Any]) -> Iterator[Any]:
    """Events by their cycles: those of the path are noticed some time later."""
    import pyarrow as pa  # noqa: PLC0415

    held = list(chunks)
    if held:
        keys = ("cycle", "channel", "kind", "text")
        whole = pa.concat_tables(held)
        yield whole.sort_by(
            [(key, "ascending") for key in keys if key in whole.column_names]
        )


def _write_arrow(source: Source, aside: Path) -> None:
    meta = json.dumps(whole_meta(source)).encode()
    schema = arrow_schema(source.tables, meta)
    with aside.open("wb") as file:
        file.write(schema.serialize())
        for table in source.tables:
            for chunk in rechunked(_chunks(source, table), STREAM_ROWS):
                columns = {
                    name: chunk.column(name).chunk(0)
                    for name in chunk.column_names
                }
                file.write(batch_of(schema, {table: columns}).serialize())
        file.write(END_OF_STREAM)


def _write_parquet(source: Source, aside: Path) -> None:
    import pyarrow as pa  # noqa: PLC0415
    import pyarrow.parquet as pq  # noqa: PLC0415

    fields = [pa.field("table", pa.string())]
    for table, columns in source.tables.items():
        fields += [
            pa.field(f"{table}.{name}", pa.type_for_alias(kind))
            for name, kind in columns.items()
        ]
    groups = [
        [table, -(-source.rows(table) // GROUP_ROWS)] for table in source.tables
    ]
    meta = json.dumps(whole_meta(source) | {"row_groups": groups})
    schema = pa.schema(fields, metadata={b"hli-cosim": meta.encode()})
    split = {
        field.name: "BYTE_STREAM_SPLIT"
        for field in fields
        if pa.types.is_floating(field.type)
    }
    with pq.ParquetWriter(
        aside,
        schema,
        compression="zstd",
        compression_level=ZSTD_LEVEL,
        use_dictionary=False,
        column_encoding=split,
        store_schema=True,
    ) as writer:
        for table in source.tables:
            for chunk in rechunked(_chunks(source, table), GROUP_ROWS):
                writer.write_table(
                    _wide(schema, table, chunk), row_group_size=GROUP_ROWS
                )


def _wide(schema: Any, table: str, chunk: Any) -> Any:
    """The rows of one table among the columns of all of them."""
    import pyarrow as pa  # noqa: PLC0415

    count = len(chunk)
    nulls: dict[Any, Any] = {}
    arrays = []
    for field in schema:
        owner, _, column = field.name.partition(".")
        if field.name == "table":
            arrays.append(pa.repeat(pa.scalar(table), count))
        elif owner == table:
            arrays.append(chunk.column(column))
        else:
            arrays.append(
                nulls.setdefault(field.type, pa.nulls(count, field.type))
            )
    return pa.table(arrays, schema=schema)


# ------------------------------------------------------------------- exports
def _start_row(source: Source) -> dict[str, Any]:
    """Where the axes stood before the first cycle, as ``plan --samples`` has it."""
    start = source.meta.get("start", {})
    names = [
        f"{one['name']}.{column}"
        for one in source.meta.get("channels", ())
        for column in PATH_COLUMNS
    ]
    return {"t": 0.0, **start, **dict.fromkeys(names or PATH_COLUMNS, 0.0)}


def _export_chunks(source: Source) -> Iterator[dict[str, Any]]:
    """Time, axes, path, speed and block of the cycles in chunks."""
    start = _start_row(source)
    yield {name: np.array([value]) for name, value in start.items()}
    names = list(start)
    if set(names) <= source.tables.get("cycles", {}).keys():
        for chunk in source.chunks("cycles", names):
            yield {name: chunk.column(name).to_numpy() for name in names}


def _write_npz(source: Source, aside: Path) -> None:
    """Without what depends on the wall clock: equal runs give equal arrays."""
    meta = whole_meta(source)
    meta.pop("created", None)
    meta["types"] = {
        table: {k: v for k, v in columns.items() if not is_wall(table, k)}
        for table, columns in source.tables.items()
    }
    axes = list(source.meta.get("start", {}))
    count = sum(len(part["t"]) for part in _export_chunks(source))
    with zipfile.ZipFile(aside, "w", zipfile.ZIP_STORED) as file:
        for name in _start_row(source):
            if name in axes:
                continue
            _put(
                file,
                name,
                (count,),
                (part[name] for part in _export_chunks(source)),
            )
        _put(
            file,
            "pos",
            (count, len(axes)),
            (
                np.column_stack([part["t"], *(part[a] for a in axes)])[:, 1:]
                for part in _export_chunks(source)
            ),
        )
        _put_array(file, "axes", np.array(axes))
        _put_array(file, "meta", np.array(json.dumps(meta)))
        for table, columns in meta["types"].items():
            for name in columns:
                _put_column(file, source, table, name)


def _put_column(
    file: zipfile.ZipFile, source: Source, table: str, name: str
) -> None:
    """A column; texts as fixed-width unicode, which needs no pickle."""
    kind = source.tables[table][name]
    if kind == "string":
        texts = [
            text
            for chunk in _chunks(source, table)
            for text in chunk.column(name).to_pylist()
        ]
        _put_array(file, f"{table}.{name}", np.array(texts, dtype=np.str_))
        return
    parts = (
        chunk.column(name).to_numpy()
        for chunk in _chunks(source, table, columns=[name])
    )
    dtype = np.dtype({"double": "f8", "bool": "?"}.get(kind, kind))
    _put(file, f"{table}.{name}", (source.rows(table),), parts, dtype)


def _put(
    file: zipfile.ZipFile,
    name: str,
    shape: tuple[int, ...],
    parts: Iterator[Any],
    dtype: np.dtype[Any] | None = None,
) -> None:
    """An array that comes in parts."""
    kind = np.dtype(np.float64) if dtype is None else dtype
    head = io.BytesIO()
    np.lib.format.write_array_header_2_0(
        head,
        {
            "descr": np.lib.format.dtype_to_descr(kind),
            "fortran_order": False,
            "shape": shape,
        },
    )
    with file.open(f"{name}.npy", "w", force_zip64=True) as out:
        out.write(head.getvalue())
        for part in parts:
            out.write(np.ascontiguousarray(part, kind).tobytes())


def _put_array(file: zipfile.ZipFile, name: str, array: Any) -> None:
    with file.open(f"{name}.npy", "w") as out:
        np.lib.format.write_array(out, array, allow_pickle=False)


def _write_csv(source: Source, aside: Path) -> None:
    names = list(_start_row(source))
    with aside.open("w") as file:
        file.write(",".join(names) + "\n")
        for part in _export_chunks(source):
            table = np.column_stack([part[name] for name in names])
            np.savetxt(file, table, delimiter=",", fmt="%.9g")


WRITERS: dict[str, Callable[[Source, Path], None]] = {
    ".parquet": _write_parquet,
    ".arrow": _write_arrow,
    ".npz": _write_npz,
    ".csv": _write_csv,
    ".mcap": write_mcap,
}


def check_kind(path: Path) -> None:
    """CncError if a recording cannot be written as this kind of file."""
    if path.suffix not in WRITERS:
        raise CncError(
            902001,
            f"recording {path}: the name must end in {', '.join(WRITERS)}",
        )
    if path.suffix == ".mcap":
        need_mcap()
