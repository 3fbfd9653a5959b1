"""The CNC's part of a recording: a thread empties the engine's rings into a file.

GEO never waits for it.  In real time what finds no room is counted as lost; in
virtual time the engine stops until there is room.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hli.part_file import PartFile

from ..config import CellConfig
from ..engine import Engine
from ..engine.recorded import Recorded, Rows
from .schema import PLC_TABLES, types_of

POLL_S = 0.05  # what a killed process may lose
Columns = dict[str, Any]


class Recorder:
    """Records one engine from now on.

    ``record_only``: tables and columns of ``cycles`` that are kept; empty: all.
    ``follows``: by a thread; FALSE: the cycles come by ``feed``.
    """

    def __init__(
        self,
        engine: Engine,
        path: Path,
        cell: CellConfig,
        meta: bytes,
        record_only: tuple[str, ...] = (),
        follows: bool = True,
    ) -> None:
        self._engine = engine
        self._axes = cell.axis_names
        self._cycle_s = cell.cycle_s
        self._tables = chosen(types_of(cell), record_only)
        self._file = PartFile(path, self._tables, meta)
        self._events: deque[Columns] = deque()
        self._elements: deque[Rows] = deque()
        self._next_element = 0
        self._overruns = 0
        self._unwritten: dict[str, int] = {}
        self._broken: Exception | None = None
        self._kinds = np.array(_kinds(), dtype=object)
        self._room = threading.Condition()
        self._rounds = 0
        self._hurry = threading.Event()
        self._closing = False
        self._thread = threading.Thread(
            target=self._write, name="recorder", daemon=True
        )
        if follows:
            self._thread.start()

    def feed(self, samples: Rows) -> None:
        """Write these cycles and whatever else there is, without a thread."""
        self._put(
            samples,
            self._engine.take(Recorded.FUNCTIONS),
            self._engine.take(Recorded.REQUESTS),
        )

    # ------------------------------------------------- by the thread of the cell
    def make_room(self) -> None:
        """Wait until the rings have been emptied once."""
        if not self._thread.is_alive():
            self._round()
            return
        with self._room:
            rounds = self._rounds
            self._hurry.set()
            self._room.wait_for(lambda: self._rounds > rounds, timeout=1.0)

    def elements(self) -> None:
        """Record the elements that have been pushed since the last call."""
        if "elements" not in self._tables:
            return
        rows = self._engine.elements_from(self._next_element)
        if len(rows):
            self._next_element = int(rows["element"][-1]) + 1
            self._elements.append(rows)

    def event(
        self,
        kind: str,
        text: str = "",
        code: int = 0,
        line: int = 0,
        cycle: int | None = None,
    ) -> None:
        """Record an event of a cycle, by default of the present one."""
        now = int(self._engine.state.cycle) if cycle is None else cycle
        self._events.append(
            {
                "cycle": now,
                "kind": kind,
                "code": code,
                "line": line,
                "text": text,
            }
        )

    def close(self) -> None:
        """Write what is left; the engine's threads stand."""
        if self._closing:
            return
        if self._thread.is_alive():
            self.make_room()
            self._engine.end_record()
            self._closing = True
            self._hurry.set()
            self._thread.join()
        else:
            self._closing = True
            self._engine.end_record()
            self._round()
        self._file.close()

    @property
    def lost(self) -> dict[str, int]:
        """Rows a table that are not in the file; tables without loss are left out."""
        rings = {
            "cycles": Recorded.SAMPLES,
            "functions": Recorded.FUNCTIONS,
            "requests": Recorded.REQUESTS,
        }
        counts = {
            table: self._unwritten.get(table, 0)
            + (self._engine.lost(rings[table]) if table in rings else 0)
            for table in self._tables
        }
        return {table: count for table, count in counts.items() if count}

    @property
    def problem(self) -> str:
        """Why rows could not be written, empty if nothing was wrong."""
        error = self._file.problem
        if error:
            return error.strerror or str(error)
        return repr(self._broken) if self._broken else ""

    # ------------------------------------------------------------- the thread
    def _write(self) -> None:
        while not self._closing:
            self._hurry.wait(POLL_S)
            self._hurry.clear()
            self._round()
        self._round()

    def _round(self) -> None:
        """Empty everything once."""
        samples = self._engine.take(Recorded.SAMPLES)
        functions = self._engine.take(Recorded.FUNCTIONS)
        requests = self._engine.take(Recorded.REQUESTS)
        with self._room:
            self._rounds += 1
            self._room.notify_all()
        self._put(samples, functions, requests)

    def _put(self, samples: Rows, functions: Rows, requests: Rows) -> None:
        """One batch if there is anything; a batch that fails is counted."""
        self._note_overruns(samples)
        counts = {
            "cycles": len(samples),
            "functions": len(functions),
            "requests": len(requests),
            "elements": sum(map(len, self._elements)),
            "events": len(self._events),
        }
        try:
            written = self._write_batch(samples, functions, requests)
        except Exception as error:
            self._broken = self._broken or error
            written = False
        if not written:
            for table, count in counts.items():
                before = self._unwritten.get(table, 0)
                self._unwritten[table] = before + count

    def _write_batch(
        self, samples: Rows, functions: Rows, requests: Rows
    ) -> bool:
        """Whether everything there is now is in the file."""
        found = {
            "cycles": self._cycles(samples),
            "functions": self._functions(functions),
            "requests": self._requests(requests),
            "elements": self._element_columns(),
            "events": self._event_columns(),
        }
        rows = {
            table: columns
            for table, columns in found.items()
            if table in self._tables and _length(columns)
        }
        return not rows or self._file.add(rows)

    def _note_overruns(self, samples: Rows) -> None:
        if not len(samples):
            return
        counts = np.concatenate([[self._overruns], samples["overruns"]])
        for i in np.flatnonzero(np.diff(counts.astype(np.int64))):
            more = int(counts[i + 1]) - int(counts[i])
            self._events.append(
                {
                    "cycle": int(samples["cycle"][i]),
                    "kind": "overrun",
                    "code": 0,
                    "line": 0,
                    "text": f"{more} cycles too late",
                }
            )
        self._overruns = int(counts[-1])

    def _times(self, cycle: Any) -> Columns:
        return {"cycle": cycle, "t": cycle * self._cycle_s}

    def _cycles(self, rows: Rows) -> Columns:
        if not len(rows):
            return {}
        columns = self._times(np.ascontiguousarray(rows["cycle"]))
        for i, name in enumerate(self._axes):
            columns[name] = np.ascontiguousarray(rows["position"][:, i])
        for name, member in CYCLE_MEMBERS.items():
            columns[name] = np.ascontiguousarray(rows[member])
        columns["override"] = rows["override"] * 100.0
        for name, bit in FLAGS.items():
            columns[name] = (rows["flags"] & bit) != 0
        return columns

    def _functions(self, rows: Rows) -> Columns:
        columns = self._times(rows["issued"])
        for name in FUNCTION_MEMBERS:
            columns[name] = np.ascontiguousarray(rows[name])
        columns["kind"] = self._kinds[rows["type"]]
        columns["seen"] = rows["seen"] != 0
        return columns

    def _requests(self, rows: Rows) -> Columns:
        columns = self._times(rows["cycle"])
        for name in ("mode", "start", "length", "elements"):
            columns[name] = np.ascontiguousarray(rows[name])
        columns["answer_us"] = rows["answer_ns"] / 1000.0
        return columns

    def _element_columns(self) -> Columns:
        found = [self._elements.popleft() for _ in range(len(self._elements))]
        if not found:
            return {}
        rows = np.concatenate(found)
        names = rows.dtype.names or ()
        return {name: np.ascontiguousarray(rows[name]) for name in names}

    def _event_columns(self) -> Columns:
        found = [self._events.popleft() for _ in range(len(self._events))]
        if not found:
            return {}
        columns = {name: [row[name] for row in found] for name in found[0]}
        return columns | self._times(np.array(columns["cycle"], np.uint64))


# column of ``cycles``: member of the C struct
CYCLE_MEMBERS = {
    "s": "path",
    "v": "speed",
    "acceleration": "acceleration",
    "jerk": "jerk",
    "feed": "feed",
    "dist_prog_start": "dist",
    "max_dist_prog_start": "known",
    "block": "element",
    "n": "n",
    "count": "count",
    "line": "line",
    "tool": "tool",
    "stop_condition": "stops",
    "state": "state",
    "elements_ahead": "elements",
    "phases_ahead": "phases",
    "overruns": "overruns",
    "planner_us_per_ms": "planner_us_per_ms",
}
FLAGS = {"rapid": 1, "backward": 2, "tail": 4}
FUNCTION_MEMBERS = (
    "fetched",
    "acknowledged",
    "code",
    "value",
    "n",
    "count",
    "line",
    "synch",
)


def _kinds() -> list[str]:
    """Letters of functions by the type of their row."""
    from ..blocks import TYPE_NAMES  # noqa: PLC0415

    return [
        name.upper() if name in ("m", "h", "s", "t") else ""
        for name in (TYPE_NAMES.get(i, "") for i in range(max(TYPE_NAMES) + 1))
    ]


def _length(columns: Mapping[str, Any]) -> int:
    return (
        len(columns["cycle" if "cycle" in columns else "element"])
        if columns
        else 0
    )


def chosen(
    types: dict[str, dict[str, str]], only: tuple[str, ...]
) -> dict[str, dict[str, str]]:
    """The tables and columns to record; ``only``: names of tables, of columns of
    ``cycles``, or ``table.column``.  Cycle and time are always there.
    """
    if not only:
        return types
    wanted: dict[str, set[str]] = {"cycles": {"cycle", "t"}}
    for name in only:
        if name in PLC_TABLES:
            continue
        table, _, column = name.rpartition(".")
        if name in types:
            wanted.setdefault(name, set()).update(types[name])
        elif column in types.get(table or "cycles", {}):
            keys = {"cycle", "t"} & types[table or "cycles"].keys()
            wanted.setdefault(table or "cycles", keys).add(column)
        else:
            raise unknown(name, types)
    return {
        table: {k: v for k, v in columns.items() if k in wanted[table]}
        for table, columns in types.items()
        if table in wanted
    }


def check_columns(cell: CellConfig, only: tuple[str, ...]) -> None:
    """CncError 902001 for a name that is no table and no column."""
    chosen(types_of(cell), only)


def unknown(name: str, types: dict[str, dict[str, str]]) -> Exception:
    """The error for a column that there is not, with the nearest one."""
    import difflib  # noqa: PLC0415

    from ..errors import CncError  # noqa: PLC0415

    known = [*types, *types["cycles"]]
    known += [f"{table}.{c}" for table in types for c in types[table]]
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"; did you mean {near[0]}?" if near else ""
    return CncError(902001, f"--record-only {name}: no such column{hint}")
