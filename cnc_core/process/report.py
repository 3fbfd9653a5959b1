"""The report of a CNC process: figures of the engine, warnings of the log."""

from __future__ import annotations

from typing import Any

from ..engine.causes import planner_pace, time_by_cause

KEPT_TEXTS = 1000
# a counter of the engine's state: the warning when it is not zero
LOG_WARNINGS = {
    "techno_unseen": (
        "technology functions counted as acknowledged: {count};"
        " plc_present_w is FALSE"
    ),
    "log_disabled": (
        "contour look-ahead: nothing is logged (needs FCT_CONTOUR_LAH,"
        " fb_storage_size and contour_lookahead_log_max)"
    ),
    "log_dropped": (
        "contour look-ahead: {count} entries dropped,"
        " contour_lookahead_log_max is {limit}"
    ),
    "log_ignored_areas": (
        "contour look-ahead: a further marked area is ignored,"
        " LOG CLEAR frees the log"
    ),
    "log_stray_params": (
        "contour look-ahead: LOG PARAM outside a marked area has no effect"
    ),
    "log_on_closed": (
        "contour look-ahead: LOG ON inside a marked area closes it"
        " (meant as LOG OFF?)"
    ),
}
UNUSED_END = "unused"  # of a channel that never had a program
# how a run with several channels ended: as the worst of them
ENDS = ("aborted", "error", "completed", UNUSED_END)
SUMS = ("blocks", "techno_functions", "bad_commands")
TEXTS = ("messages", "warnings", "errors", "waiting")
# of one channel, in the list of channels
BY_CHANNEL = (
    "index",
    "name",
    "program",
    "end",
    "requests",
    "time_by_cause",
    "blocks",
    "techno_functions",
    "dialect",
    *TEXTS,
)
COUNTERS = (
    "overruns",
    "planner_late",
    "planner_late_cycles",
    "bad_commands",
    "techno_functions",
    "techno_wait_cycles",
    "record_lost",
    "fault",
)


def log_warnings(state: Any, limit: int) -> list[str]:
    """Warnings that only show when the log is written, one each per program.

    ``state``: the engine's; ``limit``: contour_lookahead_log_max.
    """
    counts = {name: int(getattr(state, name)) for name in LOG_WARNINGS}
    return [
        text.format(count=counts[name], limit=limit)
        for name, text in LOG_WARNINGS.items()
        if counts[name]
    ]


def engine_figures(state: Any, cycle_s: float) -> dict[str, Any]:
    """Cycles, times, requests and counters of the engine's state."""
    requests = {
        name: int(getattr(state, f"requests_{name}"))
        for name in ("mode1", "mode2", "bad")
    }
    counters = {name: int(getattr(state, name)) for name in COUNTERS}
    return {
        "cycles": int(state.cycle),
        "sim_time_s": int(state.cycle) * cycle_s,
        "requests": requests,
        "time_by_cause": time_by_cause(state),
        "planner_away_s": float(state.planner_away_s),
        "planner_us_per_ms": planner_pace(state),
    } | counters


def worst_end(ends: list[str]) -> str:
    """How a run ended of which the channels ended so."""
    return min(ends, key=ENDS.index)


def joined_report(reports: list[dict[str, Any]], end: str) -> dict[str, Any]:
    """The report of a process: of its first channel, with ``channels``.

    Of several channels texts, requests and blocks are those of all; a text
    names its channel.
    """
    first, *others = reports
    channels = [{key: one[key] for key in BY_CHANNEL} for one in reports]
    if not others:
        return first | {"channels": channels}
    joined = first | {
        "end": end,
        "channels": channels,
        "source": next((one["source"] for one in reports if one["source"]), ""),
        "aborted_by_plc": any(one["aborted_by_plc"] for one in reports),
        "fault": next((one["fault"] for one in reports if one["fault"]), 0),
    }
    for key in (*SUMS, "record_lost"):
        joined[key] = sum(one[key] for one in reports)
    joined["requests"] = {
        mode: sum(one["requests"][mode] for one in reports)
        for mode in first["requests"]
    }
    joined["recording"] = _missing([one["recording"] for one in reports])
    for key in TEXTS:
        joined[key] = [
            _of_channel(text, one["name"], key)
            for one in reports
            for text in one[key]
        ]
    return joined


def _missing(parts: list[dict[str, Any]]) -> dict[str, Any]:
    """What is missing in the parts of all channels."""
    told = [part for part in parts if part]
    if not told:
        return {}
    lost: dict[str, int] = {}
    for part in told:
        for table, count in part["lost"].items():
            lost[table] = lost.get(table, 0) + count
    problem = next((part["problem"] for part in told if part["problem"]), "")
    return {"lost": lost, "problem": problem}


def _of_channel(text: Any, name: str, key: str) -> Any:
    """A message, warning, error or wait that says whose it is."""
    if key == "errors":
        return text | {"channel": name}
    if key == "messages" and isinstance(text, str):
        return f"channel {name}: {text}"
    if key == "warnings" and not text.startswith(f"channel {name}: "):
        return f"channel {name}: {text}"
    return text
