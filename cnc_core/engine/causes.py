"""Where the time of a run goes, by what limits the speed."""

from __future__ import annotations

from typing import Any

from cnc_core._engine import lib

CAUSES: dict[str, int] = {
    "feed": lib.ENGINE_CAUSE_FEED,
    "override": lib.ENGINE_CAUSE_OVERRIDE,
    "velocity": lib.ENGINE_CAUSE_VELOCITY,
    "acceleration": lib.ENGINE_CAUSE_ACCELERATION,
    "jerk": lib.ENGINE_CAUSE_JERK,
    "exact_corner": lib.ENGINE_CAUSE_EXACT_CORNER,
    "exact_stop": lib.ENGINE_CAUSE_EXACT_STOP,
    "dwell": lib.ENGINE_CAUSE_DWELL,
    "wait": lib.ENGINE_CAUSE_WAIT,
}
TITLES = {
    "feed": "feed",
    "override": "override",
    "velocity": "axis velocity",
    "acceleration": "axis acceleration",
    "jerk": "axis jerk",
    "exact_corner": "exact corners",
    "exact_stop": "exact stops",
    "dwell": "dwells",
    "wait": "waits",
}
# what helps where a cause takes a large share
HINTS = {
    "exact_corner": "try --tolerance 0.01, or G61/#HSC/G64 in the program",
    "exact_stop": "exact stops (G9, G60) and M functions that wait stop the axes",
    "override": "the PLC or --force keeps the override below 100 %",
    "wait": "the PLC acknowledges or continues late",
}
HINT_SHARE = 0.3
HINT_FROM_S = 0.1
SHOWN_SHARE = 0.005


def time_by_cause(state: Any) -> dict[str, float]:
    """Seconds by cause; together the time of all cycles of programs.

    ``state``: the engine's.
    """
    seconds = list(state.time_by_cause)
    return {name: round(seconds[i], 9) for name, i in CAUSES.items()}


def shares(seconds: dict[str, float]) -> list[tuple[str, float]]:
    """Causes with their shares of the whole, the largest first."""
    whole = sum(seconds.values())
    if whole <= 0.0:
        return []
    found = [(name, value / whole) for name, value in seconds.items()]
    return sorted(
        (pair for pair in found if pair[1] >= SHOWN_SHARE),
        key=lambda pair: -pair[1],
    )


def summary(seconds: dict[str, float]) -> str:
    """One line: shares in percent, the largest first; empty without time."""
    return ", ".join(
        f"{TITLES[name]} {100.0 * share:.0f} %"
        for name, share in shares(seconds)
    )


def hints(seconds: dict[str, float]) -> list[str]:
    """A line for each cause that takes much and can be helped; none where all
    is over at once.
    """
    if sum(seconds.values()) < HINT_FROM_S:
        return []
    return [
        f"{TITLES[name]} {100.0 * share:.0f} %: {HINTS[name]}"
        for name, share in shares(seconds)
        if share >= HINT_SHARE and name in HINTS
    ]


def planner_pace(state: Any) -> dict[str, float]:
    """CPU time of the planner for each ms of motion, us: p50, p99 and most of
    all commits.
    """
    names = ("p50", "p99", "max")
    found = zip(names, state.planner_us_per_ms, strict=True)
    return {name: round(float(us), 3) for name, us in found}
