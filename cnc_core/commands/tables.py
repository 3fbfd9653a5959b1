"""Results as people read them: units, four significant digits, 80 columns."""

from __future__ import annotations

import math
import os
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

from hli import layout
from hli.owners import unit_of_path

from .console import COLUMNS, out, say_causes

DIGITS = 4
# ending of a key: the unit of its value; longer endings first
UNITS = {
    "_per_s": "1/s",
    "_mm_s": "mm/s",
    "_mm": "mm",
    "_us": "us",
    "_ns": "ns",
    "_mb": "MB",
    "_s": "s",
}
KINDS = {
    layout.HLI_CLAH_LINEAR: "line",
    layout.HLI_CLAH_CIRCULAR: "circle",
    layout.HLI_CLAH_LOG_ON: "LOG ON",
    layout.HLI_CLAH_LOG_PARAM: "LOG PARAM",
    layout.HLI_CLAH_LOG_OFF: "LOG OFF",
    layout.HLI_CLAH_POLYNOMIAL: "polynomial",
}


def number(value: float) -> str:
    """Whole numbers as they are, others with four significant digits."""
    if isinstance(value, int) or not math.isfinite(value):
        return str(value)
    if value and not 1e-4 <= abs(value) < 1e9:
        return f"{value:.{DIGITS}g}"
    rounded = float(f"{value:.{DIGITS}g}")
    return f"{rounded:.10f}".rstrip("0").rstrip(".")


def print_table(title: str, head: Sequence[str], rows: Iterable[Any]) -> None:
    """A table in 80 columns; long cells go on in the next line."""
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD)
    for i, name in enumerate(head):
        table.add_column(name, overflow="fold", justify=_side(i, head))
    for row in rows:
        table.add_row(*row)
    out.print(table, width=COLUMNS, soft_wrap=False)


def _side(column: int, head: Sequence[str]) -> Any:
    return "right" if column and len(head) > 2 else "left"


def say_figures(title: str, value: dict[str, Any]) -> None:
    """A table of named figures, one a row; causes that took no time are left
    out.
    """
    causes = value.get("time_by_cause")
    if causes:
        value = {k: v for k, v in value.items() if v is not causes}
        value["time_by_cause_s"] = {k: v for k, v in causes.items() if v}
    print_table(title, ("figure", "value"), _figures(value))


def _figures(value: dict[str, Any], above: str = "") -> Iterator[list[str]]:
    """Rows of a dictionary; one within it becomes a row, or rows of its own."""
    for key, item in value.items():
        name, unit = _named(key)
        path = f"{above}, {name}" if above else name
        if isinstance(item, dict):
            if any(isinstance(one, dict) for one in item.values()):
                yield from _figures(item, path)
            else:
                yield from ([path, text] for text in _joined(item, unit))
        elif isinstance(item, list):
            for one in item:
                yield from ([path, text] for text in _joined(one, unit))
        elif item is not None:
            yield [path, _with_unit(item, unit)]


def _named(key: str) -> tuple[str, str]:
    """A key in words, and its unit."""
    ending = next((e for e in UNITS if key.endswith(e)), "")
    name = key[: len(key) - len(ending)] if ending else key
    if ending == "_per_s":
        return f"{name} a second".replace("_", " "), ""
    return name.replace("_", " "), UNITS.get(ending, "")


def _with_unit(item: Any, unit: str) -> str:
    if isinstance(item, bool):
        return "yes" if item else "no"
    text = number(item) if isinstance(item, (int, float)) else str(item)
    return f"{text} {unit}".strip()


def _joined(item: Any, unit: str) -> list[str]:
    """One cell of a small dictionary or a single value; none if it is empty."""
    if not isinstance(item, dict):
        return [_with_unit(item, unit)]
    parts = []
    for key, one in item.items():
        if one is None:
            continue
        name, own = _named(str(key))
        parts.append(f"{name} {_with_unit(one, own)}")
    ending = f" {unit}" if unit else ""
    return [", ".join(parts) + ending] if parts else []


# ------------------------------------------------------------------------------------------------
# values
SHOWN = 60  # characters of a value
TENTH_UM, TENTHS_A_MM = "0.1 um", 10_000.0


def value_lines(values: dict[str, Any], indent: int = 0) -> Iterator[str]:
    """A line a value with its unit, members below their structure."""
    for path, value in values.items():
        yield from _value(path, path, value, indent)


def _value(path: str, name: str, value: Any, indent: int) -> Iterator[str]:
    edge = " " * indent
    if isinstance(value, dict):
        yield f"{edge}{name}"
        for member, item in value.items():
            yield from _value(f"{path}.{member}", member, item, indent + 2)
        return
    text = f"{name} = {_with_millimetres(value, unit_of_path(path))}".rstrip()
    yield from textwrap.wrap(
        text,
        COLUMNS,
        initial_indent=edge,
        subsequent_indent=f"{edge}    ",
    )


def _with_millimetres(value: Any, unit: str) -> str:
    """A value with its unit; millimetres beside 0.1 um."""
    if isinstance(value, bool):
        return _text(value)
    if unit == TENTH_UM and isinstance(value, (int, float)):
        return f"{value:.0f} x {unit} ({number(value / TENTHS_A_MM)} mm)"
    return f"{_text(value)} {_times(unit)}"


def _times(unit: str) -> str:
    """A unit behind a value: "x 0.1 %", and "um/s" for "1 um/s"."""
    if unit.startswith("1 "):
        return unit[2:]
    return f"x {unit}" if unit[:1].isdigit() else unit


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, float):
        return number(value)
    if isinstance(value, list):
        inner = ", ".join(map(_text, value))
        return f"[{inner}]" if len(inner) <= SHOWN else f"[{inner[:SHOWN]}..]"
    text = str(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}.."


# ------------------------------------------------------------------------------------------------
# runs
def print_run(result: Any, title: str) -> None:
    """What a run came to; one that an error ended at its first block has
    nothing to show.
    """
    if result.cycles and (result.blocks or not result.errors):
        print_table(title, ("run", ""), _run_rows(result))
        if len(result.channels) > 1:
            rows = [_channel_row(one) for one in result.channels]
            print_table(
                "channels", ("channel", "end", "blocks", "program"), rows
            )
        _print_tasks(result.plc.get("tasks") or {})
        _print_result(result.plc.get("result"))
        print_watch(result.plc.get("watch") or {})
        say_causes(result.time_by_cause)
    for message in result.messages:
        out.print(message)


def _run_rows(result: Any) -> Iterator[list[str]]:
    if result.name and not result.name.startswith(f"hli-cosim-{os.getpid()}-"):
        yield ["name", result.name]
    yield ["end", result.end]
    yield [
        "cell's time",
        f"{number(result.sim_time_s)} s, {result.cycles} cycles",
    ]
    yield [
        "wall time",
        f"{number(result.wall_time_s)} s,"
        f" {number(result.realtime_factor)} x real time",
    ]
    yield ["blocks", str(result.blocks)]
    asked = {
        name: n
        for name, n in (
            ("by index (mode 1)", result.requests.get("mode1")),
            ("by distance (mode 2)", result.requests.get("mode2")),
            ("refused", result.requests.get("bad")),
        )
        if n
    }
    if asked:
        yield ["look-ahead requests", *_joined(asked, "")]
    yield from (["handshake", t] for t in _joined(result.handshake_us, "us"))
    pace = result.planner_us_per_ms
    if pace.get("max"):
        yield ["planner", *_joined(pace, "us a ms of motion")]
    for name in ("overruns", "planner_late", "recorded"):
        if getattr(result, name):
            yield [name, str(getattr(result, name))]


def _channel_row(channel: dict[str, Any]) -> list[str]:
    return [
        f"{channel['index']} {channel['name']}",
        channel["end"],
        str(channel["blocks"]),
        Path(channel["program"]).name if channel["program"] else "",
    ]


def _print_tasks(tasks: dict[str, dict[str, Any]]) -> None:
    for name, task in tasks.items():
        late = f", {task['overruns']} overruns" if task["overruns"] else ""
        line = (
            f"task {name}: {task['scans']} scans every"
            f" {number(task['interval_s'] * 1000.0)} ms,"
            f" {number(task.get('mean_us') or 0.0)} us each,"
            f" {number(task.get('max_us') or 0.0)} us at most{late}"
        )
        out.print(textwrap.fill(line, COLUMNS, subsequent_indent="  "))


def _print_result(result: Any) -> None:
    """What ``result()`` of the tasks gave."""
    if result is None:
        return
    for row in value_lines({"result": result}):
        out.print(row)


def print_watch(columns: dict[str, list[float | None]]) -> None:
    """Last, smallest and largest value of each watched symbol, and how often it
    changed.
    """
    rows = []
    for name, column in columns.items():
        values = [v for v in column if v is not None]
        if name == "t" or not values:
            continue
        changes = sum(a != b for a, b in pairwise(values))
        figures = map(number, (values[-1], min(values), max(values)))
        rows.append([name, *figures, str(changes)])
    if rows:
        head = ("watched", "last", "min", "max", "changes")
        print_table("", head, rows)


# ------------------------------------------------------------------------------------------------
# answers of the look-ahead
EMPTY_LOG = (
    "the log is empty: #CONTOUR LOOKAHEAD LOG ON in the program marks blocks;\n"
    "  --distance START LENGTH asks for any part of the path"
)
NO_TURN = 1e-9  # rad; below it rounding alone


def print_answer(answer: dict[str, Any]) -> None:
    """Request, state and elements of an answer."""
    request, state = answer["request"], answer["state"]
    if answer["mode"] == 1:
        asked = f"entries of the log from {request['start_position']:g} on"
    else:
        start, length = request["start_position"], request["length"]
        asked = f"{_both(length)} of path from {_both(start)} on"
    out.print(f"mode {answer['mode']}: {asked}")
    log = "on" if state["f_log_is_active"] else "off"
    out.print(
        f"the CNC knows {_both(state['max_dist_prog_start'])};"
        f" log {log}, {state['count_logged_blocks']} entries"
    )
    head = ("kind", "N", "start", "start", "length", "radius", "angle", "turn")
    units = ("", "", "0.1 um", "mm", "mm", "mm", "rad", "rad")
    rows = map(_element, answer["response"])
    print_table(
        "", [f"{h}\n{u}" for h, u in zip(head, units, strict=True)], rows
    )
    if answer["mode"] == 1 and not state["count_logged_blocks"]:
        out.print(EMPTY_LOG)


def _both(tenth_um: float) -> str:
    return f"{tenth_um / 1e4:.4f} mm ({tenth_um:.0f})"


def _element(row: dict[str, Any]) -> list[str]:
    kind = KINDS.get(row["block_type"], str(row["block_type"]))
    marker = kind.startswith("LOG")
    length, turn = row["length"], row["tangent_variation"]
    return [
        kind,
        str(row["block_number"]),
        f"{row['start_position']:.0f}",
        f"{row['start_position'] / 1e4:.4f}",
        f"PARAM {number(length)}" if marker else f"{length / 1e4:.4f}",
        number(row["compensated_radius"] / 1e4),
        number(row["circle_angle"]),
        number(turn if abs(turn) > NO_TURN else 0.0),
    ]
