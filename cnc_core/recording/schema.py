"""Tables of a recording: columns, types, units.

The version counts changes that readers have to know.  Columns that come are no
such change; a reader shows what it finds.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..config import CellConfig

VERSION = 1
PLC_TABLES = ("plc", "exchange")  # the PLC process writes them
TABLES = (
    "cycles",
    "requests",
    "functions",
    "elements",
    *PLC_TABLES,
    "events",
)
AXES = "axes"  # stands for one column an axis
AXES_PLACED = "axes"
"""Kind of an event: axis exchange, ``place=logical number``, 0: none."""


@dataclass(frozen=True)
class Column:
    """A column: Arrow type, unit, what it tells.

    ``wall``: it depends on the wall clock and so differs from run to run.
    """

    type: str
    unit: str
    text: str
    wall: bool = False


_TIME = {
    "cycle": Column("uint64", "", "cycle of the CNC, counted from its start"),
    "t": Column("double", "s", "cell time: cycle times the cycle time"),
}
_PLACE = {
    "n": Column("uint32", "", "block number N, 0: none"),
    "count": Column("uint32", "", "block_count: lines read by the decoder"),
}
_LINE = {"line": Column("uint32", "", "line of the source, 0: none")}

COLUMNS: dict[str, dict[str, Column]] = {
    "cycles": {
        **_TIME,
        AXES: Column("double", "mm", "position of the axis (rotary: degrees)"),
        "s": Column("double", "mm", "path driven since the program's start"),
        "v": Column("double", "mm/s", "speed along the path"),
        "acceleration": Column("double", "mm/s2", "change of v over the cycle"),
        "jerk": Column(
            "double", "mm/s3", "change of acceleration over the cycle"
        ),
        "feed": Column("double", "mm/s", "commanded feed, 0: rapid"),
        "override": Column("double", "%", "override in force"),
        "dist_prog_start": Column("double", "0.1 um", "displayed distance"),
        "max_dist_prog_start": Column(
            "double", "0.1 um", "end of the contour that the PLC can see"
        ),
        "block": Column("uint64", "", "active element of the contour"),
        **_PLACE,
        **_LINE,
        "tool": Column("int32", "", "number of the tool"),
        "stop_condition": Column("uint32", "", "stop_condition_r, bits"),
        "state": Column("uint32", "", "state of the operation mode"),
        "elements_ahead": Column(
            "uint32", "", "prepared elements ahead of the active one"
        ),
        "phases_ahead": Column(
            "uint32", "", "committed phases of motion not begun"
        ),
        "rapid": Column("bool", "", "the block is rapid"),
        "backward": Column("bool", "", "the path is driven backward"),
        "tail": Column("bool", "", "GEO follows the stopping tail"),
        "overruns": Column(
            "uint32", "", "cycles that began too late, counted", wall=True
        ),
        "planner_us_per_ms": Column(
            "double",
            "us",
            "CPU time of the planner for each ms of motion, at its last commit",
            wall=True,
        ),
    },
    "requests": {
        **_TIME,
        "mode": Column("uint32", "", "1 by index, 2 by distance, 0 refused"),
        "start": Column("double", "0.1 um", "start_position; mode 1: index"),
        "length": Column("double", "0.1 um", "length; mode 1: 0"),
        "elements": Column("uint32", "", "elements in the answer"),
        "answer_us": Column(
            "double", "us", "wall time of the service for it", wall=True
        ),
    },
    "functions": {
        **_TIME,
        "fetched": Column("uint64", "", "cycle of the fetch, 0: not fetched"),
        "acknowledged": Column(
            "uint64", "", "cycle of the acknowledgement, 0: none seen"
        ),
        "kind": Column("string", "", "M, H, S or T"),
        "code": Column("int32", "", "its number"),
        "value": Column("double", "", "additional value; S: rev/min"),
        **_PLACE,
        **_LINE,
        "synch": Column("uint32", "", "type of synchronisation (P-CHAN-00041)"),
        "seen": Column("bool", "", "a PLC was there to see it"),
    },
    "elements": {
        "element": Column("uint64", "", "number, as cycles.block"),
        "type": Column("uint32", "", "block_type of the HLI"),
        **_PLACE,
        "start": Column("double", "0.1 um", "start_position"),
        "length": Column("double", "0.1 um", "length"),
        "length_min": Column(
            "double", "0.1 um", "length on the scaled contour"
        ),
        "programmed_radius": Column("double", "0.1 um", "programmed_radius"),
        "compensated_radius": Column("double", "0.1 um", "compensated_radius"),
        "angle": Column("double", "rad", "circle_angle"),
        "turn": Column("double", "rad", "tangent_variation"),
        "epoch": Column("uint32", "", "distance resets ahead of it"),
    },
    "plc": {
        **_TIME,
        "scan": Column("uint64", "", "number of the PLC's scan"),
    },
    "exchange": {
        "cycle": _TIME["cycle"],
        "scan": Column("uint64", "", "scan of the PLC, 0: its setup()"),
        "by_plc": Column(
            "bool", "", "changed in this scan; false: since the one before"
        ),
        "word": Column(
            "uint32", "", "place in the HLI's segment: offset / 8 bytes"
        ),
        "value": Column("uint64", "", "the 8 bytes there"),
    },
    "events": {
        **_TIME,
        "kind": Column(
            "string",
            "",
            "start, end, error, warning, message, mode, overrun, axes",
        ),
        "code": Column("int64", "", "number of an error, 0: none"),
        **_LINE,
        "text": Column("string", "", "what was told"),
    },
}


def units_of(cell: CellConfig) -> dict[str, dict[str, str]]:
    """Unit of every column of every table of a cell."""
    axes = {
        name: "deg" if axis.kind == "rotary" else "mm"
        for name, axis in cell.axes.items()
    }
    return {
        table: {
            key: unit
            for name, column in columns.items()
            for key, unit in (
                axes.items() if name == AXES else ((name, column.unit),)
            )
        }
        for table, columns in COLUMNS.items()
    }


def types_of(cell: CellConfig) -> dict[str, dict[str, str]]:
    """Arrow type of every column that the CNC records."""
    units = units_of(cell)
    return {
        table: {
            name: COLUMNS[table].get(name, COLUMNS[table].get(AXES, _NONE)).type
            for name in units[table]
        }
        for table in TABLES
        if table not in PLC_TABLES
    }


_NONE = Column("double", "", "")


def is_wall(table: str, column: str) -> bool:
    """Whether a column depends on the wall clock."""
    if table == "cycles":  # of several channels: CHANNEL.column
        column = column.rpartition(".")[2]
    known = COLUMNS.get(table, {}).get(column)
    return known is not None and known.wall
