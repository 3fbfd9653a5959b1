"""Recordings of a cell with several channels: many parts as one file, and one
channel of it as a recording of its own.

In the file a row of ``cycles`` is a cycle of all channels; a column is called
``CHANNEL.column``.  The other tables of the CNC have the rows of one channel
after the other, with a column ``channel``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import reduce
from typing import Any

import numpy as np

from .axis_ways import Way, ways_of
from .schema import PLC_TABLES, TABLES
from .source import Source

SHARED = ("cycle", "t")
CHANNEL = "channel"


class ChannelsSource:
    """The parts of all channels of one run.

    A cycle is a row where every channel has recorded it: always in virtual time.
    """

    def __init__(self, sources: Sequence[Source]) -> None:
        self._sources = sources
        self._names = [source.meta["channel"]["name"] for source in sources]
        self.complete = False
        self._ways = ways_of(sources)
        self._guests = {
            f"{name}.{axis}"
            for name, source in zip(self._names, sources, strict=True)
            for axis in source.meta["axes"]
        } - self._ways.keys()
        self.tables = self._joined_tables()
        self.meta = self._joined_meta()
        self._aligned_rows = -1

    def _joined_tables(self) -> dict[str, dict[str, str]]:
        found: dict[str, dict[str, str]] = {}
        for table in TABLES:
            for name, source in zip(self._names, self._sources, strict=True):
                own = source.tables.get(table)
                if own is None:
                    continue
                if table == "cycles":
                    columns = found.setdefault(table, {})
                    for column, kind in own.items():
                        joined = _joined(name, column)
                        if joined not in self._guests:
                            columns[joined] = kind
                else:
                    found.setdefault(table, {CHANNEL: "string", **own})
        return found

    def _joined_meta(self) -> dict[str, Any]:
        """Of the run, with the account of each channel in ``channels``."""
        first = self._sources[0].meta
        meta = {k: v for k, v in first.items() if k != CHANNEL}
        units: dict[str, str] = {}
        accounts = []
        for name, source in zip(self._names, self._sources, strict=True):
            own = source.meta
            for column, unit in own["columns"]["cycles"].items():
                units[_joined(name, column)] = unit
            at_home = {
                key: {
                    axis: value
                    for axis, value in own[key].items()
                    if f"{name}.{axis}" not in self._guests
                }
                for key in ("axes", "start")
            }
            accounts.append(
                {"index": own[CHANNEL]["index"], "name": name}
                | at_home
                | {"program": own["program"]}
            )
        for key in ("axes", "start"):
            meta[key] = {
                f"{one['name']}.{axis}": value
                for one in accounts
                for axis, value in one[key].items()
            }
        others = {
            table: {CHANNEL: "", **columns}
            for table, columns in first["columns"].items()
            if table not in PLC_TABLES
        }
        meta["columns"] = others | {"cycles": units}
        return meta | {"channels": accounts}

    def rows(self, table: str) -> int:
        """Rows of a table."""
        if table != "cycles":
            return sum(source.rows(table) for source in self._sources)
        if self._aligned_rows < 0:
            self._aligned_rows = sum(map(len, self._cycles(["cycle"])))
        return self._aligned_rows

    def chunks(self, table: str, columns: Sequence[str]) -> Iterator[Any]:
        """The table's rows in order, as Arrow tables with these columns."""
        if table == "cycles":
            yield from self._cycles(columns)
            return
        for name, source in zip(self._names, self._sources, strict=True):
            if table in source.tables:
                own = [column for column in columns if column != CHANNEL]
                asked = own or [next(iter(source.tables[table]))]
                for chunk in source.chunks(table, asked):
                    yield _told_apart(chunk, name, columns)

    def _cycles(self, columns: Sequence[str]) -> Iterator[Any]:
        """Rows of the same cycle side by side; memory for a chunk a channel."""
        plain = [name for name in columns if name not in self._ways]
        ways = {
            name: self._ways[name] for name in columns if name in self._ways
        }
        own = [_of_channel(name, plain) for name in self._names]
        asked = [[*SHARED, *wanted.values()] for wanted in own]
        spots = {spot for way in ways.values() for spot in way.spots if spot}
        for part, column in sorted(spots):
            asked[part].append(column)
        streams = [
            source.chunks("cycles", wanted)
            for source, wanted in zip(self._sources, asked, strict=True)
        ]
        last: dict[str, float] = {}
        held = [next(stream, None) for stream in streams]
        while all(part is not None for part in held):
            heads, rests = _cut(held)
            for i, rest in enumerate(rests):
                held[i] = rest if len(rest) else next(streams[i], None)
            if len(heads[0]):
                positions = _positions(ways, heads, last)
                yield _side_by_side(heads, own, positions, columns)


def _joined(channel: str, column: str) -> str:
    return column if column in SHARED else f"{channel}.{column}"


def _of_channel(channel: str, columns: Sequence[str]) -> dict[str, str]:
    """The channel's own columns among these, by their joined names."""
    begin = f"{channel}."
    return {
        column: column[len(begin) :]
        for column in columns
        if column.startswith(begin)
    }


def _cut(held: Sequence[Any]) -> tuple[list[Any], list[Any]]:
    """Up to the last cycle that all parts reach: rows of cycles that all have,
    and what is behind them.
    """
    numbers = [part.column("cycle").to_numpy() for part in held]
    last = min(int(each[-1]) for each in numbers)
    counts = [int(np.searchsorted(each, last, "right")) for each in numbers]
    found = [each[:n] for each, n in zip(numbers, counts, strict=True)]
    rests = [part.slice(n) for part, n in zip(held, counts, strict=True)]
    heads = [part.slice(0, n) for part, n in zip(held, counts, strict=True)]
    if any(not np.array_equal(each, found[0]) for each in found[1:]):
        common = reduce(np.intersect1d, found)
        heads = [
            head.take(np.flatnonzero(np.isin(each, common)))
            for head, each in zip(heads, found, strict=True)
        ]
    return heads, rests


def _positions(
    ways: dict[str, Way], heads: Sequence[Any], last: dict[str, float]
) -> dict[str, Any]:
    """Columns of axes; one that is nowhere stands where it was ``last``."""
    import pyarrow as pa  # noqa: PLC0415

    cycles = heads[0].column("cycle").to_numpy()
    found = {}
    for name, way in ways.items():
        values = way.values(cycles, heads)
        known = np.flatnonzero(~np.isnan(values))
        if len(known) < len(values):
            before = np.searchsorted(known, np.arange(len(values)), "right")
            kept = np.concatenate([[last.get(name, np.nan)], values[known]])
            values = kept[before]
        last[name] = float(values[-1])
        found[name] = pa.chunked_array([values])
    return found


def _side_by_side(
    heads: Sequence[Any],
    own: Sequence[dict[str, str]],
    positions: dict[str, Any],
    columns: Sequence[str],
) -> Any:
    import pyarrow as pa  # noqa: PLC0415

    arrays = {name: heads[0].column(name) for name in SHARED} | positions
    for head, wanted in zip(heads, own, strict=True):
        arrays |= {
            joined: head.column(plain) for joined, plain in wanted.items()
        }
    chosen = [arrays[column].combine_chunks() for column in columns]
    return pa.table(chosen, names=list(columns))


def _told_apart(chunk: Any, channel: str, columns: Sequence[str]) -> Any:
    import pyarrow as pa  # noqa: PLC0415

    arrays = [
        pa.repeat(pa.scalar(channel), len(chunk))
        if column == CHANNEL
        else chunk.column(column)
        for column in columns
    ]
    return pa.table(arrays, names=list(columns))


class OneChannel:
    """One channel of a recording, as if it had been alone in its cell."""

    def __init__(self, source: Source, name: str) -> None:
        self._source, self._name = source, name
        self.complete = source.complete
        account = next(
            one for one in source.meta["channels"] if one["name"] == name
        )
        units = source.meta["columns"]
        self.tables = {
            table: self._plain(table, columns)
            for table, columns in source.tables.items()
        }
        self.meta = {
            **{k: v for k, v in source.meta.items() if k != "channels"},
            **{key: account[key] for key in ("axes", "start", "program")},
            CHANNEL: name,
            "columns": {
                table: self._plain(table, columns)
                for table, columns in units.items()
            },
        }
        self._counts: dict[str, int] = {}

    def _plain(self, table: str, columns: dict[str, str]) -> dict[str, str]:
        """A table's columns as a recording of one channel has them."""
        if table in PLC_TABLES:
            return columns
        if table == "cycles":
            shared = {name: columns[name] for name in SHARED if name in columns}
            wanted = _of_channel(self._name, list(columns))
            return shared | {
                plain: columns[joined] for joined, plain in wanted.items()
            }
        return {k: v for k, v in columns.items() if k != CHANNEL}

    def _is_told_apart(self, table: str) -> bool:
        return CHANNEL in self._source.tables.get(table, {})

    def rows(self, table: str) -> int:
        """Rows of a table."""
        if not self._is_told_apart(table):
            return self._source.rows(table)
        if table not in self._counts:
            found = self.chunks(table, list(self.tables[table])[:1])
            self._counts[table] = sum(map(len, found))
        return self._counts[table]

    def chunks(self, table: str, columns: Sequence[str]) -> Iterator[Any]:
        """The table's rows in order, as Arrow tables with these columns."""
        if table == "cycles":
            names = [_joined(self._name, column) for column in columns]
            for chunk in self._source.chunks(table, names):
                yield chunk.rename_columns(list(columns))
            return
        if not self._is_told_apart(table):
            yield from self._source.chunks(table, columns)
            return
        for chunk in self._source.chunks(table, [CHANNEL, *columns]):
            at = [
                i
                for i, name in enumerate(chunk.column(CHANNEL).to_pylist())
                if name == self._name
            ]
            if at:
                yield chunk.select(list(columns)).take(at)
