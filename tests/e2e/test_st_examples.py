"""The example programs in Structured Text behave as their twins in Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core import Cell
from support.seeds import as_long

EXAMPLES = Path(__file__).parents[2] / "examples"
PAIRS = {
    "override_from_contour": ("part.nc", "cell.toml", {}),
    "read_marked_log": ("part.nc", "cell.toml", {"count": "count"}),
    "where_in_t": (
        "arc_line_arc.nc",
        "",
        {
            "path.distance": "path.distance",
            "open": "opened",
            "worst_um": "worst_um",
            "naive_um": "naive_um",
            "compared": "compared",
            "edges": "edges",
        },
    ),
    "osai/watch_elements": (
        "part.osai",
        "cell.toml",
        {"ahead": "ahead", "known_mm": "known_mm", "sharpest": "sharpest"},
    ),
    "laser_power/with_lookahead": (
        "part.nc",
        "cell.toml",
        {"power_w": "power_w"},
    ),
    "laser_power/without_lookahead": (
        "part.nc",
        "cell.toml",
        {"power_w": "power_w"},
    ),
    "dispenser/with_lookahead": ("part.nc", "cell.toml", {"open": "open"}),
    "dispenser/without_lookahead": ("part.nc", "cell.toml", {"open": "open"}),
    "sharp_tangents/with_lookahead": (
        "part.nc",
        "cell.toml",
        {"percent": "percent"},
    ),
    "sharp_tangents/without_lookahead": (
        "part.nc",
        "cell.toml",
        {"percent": "percent"},
    ),
    "spark_erosion/with_lookahead": ("part.nc", "cell.toml", {"fine": "fine"}),
    "spark_erosion/without_lookahead": (
        "part.nc",
        "cell.toml",
        {"fine": "fine"},
    ),
}
"""Program -> NC program, cell, watched variables: those of Python and of its twin."""
SEEN = (
    "gpCh[0]^.bahn_state.dist_prog_start",
    "gpCh[0]^.bahn_state.active_feed_r",
    "gpCh[0]^.bahn_mc_control.override.command_w",
    "gpCh[0]^.bahn_mc_control.feedhold.command_w",
)
_TASKS = {
    "override_from_contour": ("OverrideFromContour", "MAIN"),
    "read_marked_log": ("ReadMarkedLog", "ReadMarkedLog"),
    "where_in_t": ("WhereInT", "WhereInT"),
    "osai/watch_elements": ("Watch", "Watch"),
    "laser_power": ("LaserPower", "LaserPower"),
    "dispenser": ("Valve", "Valve"),
    "sharp_tangents": ("Feed", "Feed"),
    "spark_erosion": ("Generator", "Generator"),
}
PLAIN = ("override_from_contour", "sharp_tangents/with_lookahead")


def _watched(name: str, side: int) -> dict[str, Any]:
    """What one of the twins shows in each scan, by the names in Python."""
    program, cell, variables = PAIRS[name]
    folder = (EXAMPLES / name).parent
    task = _TASKS.get(name) or _TASKS[name.partition("/")[0]]
    paths = {
        key: f"{task[side]}.{variables[key] if side else key}"
        for key in variables
    }
    with Cell(folder / cell if cell else None) as made:
        result = made.run(
            folder / program,
            EXAMPLES / f"{name}{('.py', '.st')[side]}",
            watch=[*SEEN, *paths.values()],
        )
    assert result.end == "completed", result.errors
    found = result.plc["watch"]
    rows = {key: found[path] for key, path in paths.items()}
    return {"t": found["t"], **rows, **{path: found[path] for path in SEEN}}


@pytest.mark.parametrize(
    "name",
    [name if name in PLAIN else as_long(name) for name in PAIRS],
)
@pytest.mark.ci_cases
def test_twins_of_the_examples_do_the_same_in_every_scan(name: str) -> None:
    """What they show and command is the same, scan by scan, in lockstep."""
    python, twin = _watched(name, 0), _watched(name, 1)
    assert len(python["t"]) > 50
    for key, values in python.items():
        expected = np.array(values, float)
        assert np.array(twin[key], float) == pytest.approx(
            expected, rel=1e-9, abs=1e-9
        ), key


def test_every_look_ahead_program_has_its_twin() -> None:
    """A program with tasks that stands in the examples alone is an error; one
    that does not look at the contour needs none.
    """
    programs = {
        str(path.relative_to(EXAMPLES).with_suffix(""))
        for path in EXAMPLES.rglob("*.py")
        if "@task" in path.read_text()
        and "ahead" in f"{path.name} {path.read_text()}".lower()
    }
    assert programs == set(PAIRS)
