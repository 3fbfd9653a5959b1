"""The engine by itself: windows, log rules, distance epochs, rows it refuses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core.blocks import NC_BLOCK, POLYNOMIAL, BlockBatch
from cnc_core.config import CellConfig, parse_config
from cnc_core.engine import Engine
from cnc_core.errors import CncError
from support.command_line import Outcome
from support.drive import line_rows

pytestmark = pytest.mark.sanitize("engine")

Cli = Callable[..., Outcome]
Write = Callable[..., Path]


def straight(blocks: int, head: str = "") -> str:
    return "\n".join(
        [
            "F6000 G1",
            head,
            *(f"N{i} X{i}" for i in range(1, blocks + 1)),
            "M30",
            "",
        ]
    )


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    ("channel", "known"),
    [
        ("", 121),
        ('interpolator_function = "FCT_LOOK_AHEAD_LOW | FCT_CONTOUR_LAH"', 31),
        (
            'interpolator_function = "FCT_LOOK_AHEAD_HIGH | FCT_CONTOUR_LAH"',
            129,
        ),
        (
            'interpolator_function = "FCT_LOOK_AHEAD_HIGH | '
            'FCT_CONTOUR_LAH"\ncontour_lookahead_log_max = 500',
            191,
        ),
        (
            'interpolator_function = "FCT_LOOK_AHEAD_LOW"\n'
            'fct_enable = "FCT_LOOK_AHEAD_HIGH|FCT_CONTOUR_LAH"',
            129,
        ),
        ('build_generation = "2.11.20"', 71),
        (
            'build_generation = "2.11.20"\n'
            'interpolator_function = "FCT_LOOK_AHEAD_HIGH | FCT_CONTOUR_LAH"',
            121,
        ),
        (
            'interpolator_function = "FCT_LOOK_AHEAD_CUSTOM | '
            'FCT_CONTOUR_LAH"\nlookahead_blocks = 17',
            18,
        ),
        ("contour_lookahead_log_max = 5", 6),
        ("contour_lookahead_log_max = 0", 0),
        ('interpolator_function = "FCT_IPO_DEFAULT"', 0),
    ],
)
def test_mode_2_knows_the_active_block_and_the_window(
    cli: Cli, program: Write, channel: str, known: int
) -> None:
    """Before motion: active block + min(N, P-CHAN-00658) elements, by build
    generation and function table.
    """
    config = program(f"[channel]\n{channel}\n", "cell.toml")
    answer = cli(
        "lookahead",
        program(straight(400)),
        "--distance",
        0,
        1e12,
        "--at",
        "start",
        "--config",
        config,
        "--json",
    )
    assert len(answer.json["response"]) == known
    assert answer.json["state"]["max_dist_prog_start"] == known * 10_000.0


LOG = "#CONTOUR LOOKAHEAD LOG"


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    ("lines", "entries", "warning"),
    [
        (
            [
                f"{LOG} ON",
                "X1",
                f"{LOG} OFF",
                f"{LOG} ON",
                "X2",
                f"{LOG} [PARAM=4]",
                f"{LOG} OFF",
            ],
            [3, 1, 5],
            "further",
        ),
        (
            [
                f"{LOG} ON",
                "X1",
                f"{LOG} OFF",
                f"{LOG} CLEAR",
                f"{LOG} ON [PARAM=9]",
                "X2",
                "X3",
            ],
            [3, 1, 1],
            None,
        ),
        ([f"{LOG} ON", "X1", f"{LOG} CLEAR", "X2"], [], None),
        ([f"{LOG} [PARAM=1]", "X1", f"{LOG} OFF"], [], "PARAM"),
        ([f"{LOG} ON", "X1", f"{LOG} ON [PARAM=8]", "X2"], [3, 1, 5], "closes"),
        (
            [f"{LOG} ON", "X1", "X1", "G4 X0.001", f"{LOG}", "X2"],
            [3, 1, 4, 1],
            None,
        ),
    ],
)
def test_log_rules(
    cli: Cli,
    program: Write,
    lines: list[str],
    entries: list[int],
    warning: str | None,
) -> None:
    """First area only, CLEAR frees, PARAM needs an area, ON inside an area
    closes it, no entry without motion.
    """
    outcome = cli(
        "lookahead",
        program("\n".join(["F6000 G1", *lines, ""])),
        "--index",
        0,
        "--json",
    )
    assert [b["block_type"] for b in outcome.json["response"]] == entries
    assert outcome.json["state"]["count_logged_blocks"] == len(entries)
    assert outcome.json["state"]["f_log_is_active"] is False
    assert (
        (warning in outcome.err) if warning else "look-ahead" not in outcome.err
    )


def test_overflow_keeps_the_oldest_entries(cli: Cli, program: Write) -> None:
    """contour_lookahead_log_max 3: three entries, one warning."""
    config = program("[channel]\ncontour_lookahead_log_max = 3\n", "cell.toml")
    outcome = cli(
        "lookahead",
        program(straight(9, f"{LOG} ON [PARAM=1]")),
        "--index",
        0,
        "--config",
        config,
        "--json",
    )
    assert [b["block_number"] for b in outcome.json["response"]] == [0, 1, 2]
    assert outcome.err.count("dropped") == 1


@pytest.mark.ci
def test_without_backward_storage_mode_1_is_off(
    cli: Cli, program: Write
) -> None:
    """P-STUP-00033 = 0: nothing is logged, one warning; mode 2 works."""
    config = program("[channel]\nfb_storage_size = 0\n", "cell.toml")
    path = program(straight(9, f"{LOG} ON"))
    by_index = cli(
        "lookahead", path, "--index", 0, "--config", config, "--json"
    )
    assert by_index.json["response"] == []
    assert "nothing is logged" in by_index.err
    by_distance = cli(
        "lookahead", path, "--distance", 0, 1e9, "--config", config, "--json"
    )
    assert len(by_distance.json["response"]) == 9


@pytest.mark.ci
@pytest.mark.parametrize(
    "command", ["#DISTANCE PROG START CLEAR", "#DISTANCE PROGRAM START CLEAR"]
)
def test_a_distance_reset_bounds_mode_2_until_it_is_passed(
    cli: Cli, program: Write, command: str
) -> None:
    """Before it: elements up to the reset; behind it: the later elements, counted from 0."""
    path = program(
        "\n".join(
            ["F6000 G1", "N1 X5", "N2 X9", command, "N3 X10", "N4 X12", ""]
        )
    )
    before = cli(
        "lookahead", path, "--distance", 0, 1e9, "--at", "start", "--json"
    ).json
    assert [
        (b["block_number"], b["start_position"]) for b in before["response"]
    ] == [(1, 0.0), (2, 50_000.0)]
    assert before["state"]["max_dist_prog_start"] == 90_000.0
    after = cli("lookahead", path, "--distance", 0, 1e9, "--json").json
    assert [
        (b["block_number"], b["start_position"]) for b in after["response"]
    ] == [(3, 0.0), (4, 10_000.0)]
    assert after["state"]["max_dist_prog_start"] == 30_000.0


def refused(row: Any) -> int:
    engine = Engine(CellConfig())
    with pytest.raises(CncError) as caught:
        engine.push(BlockBatch(row))
    engine.close()
    return caught.value.code


@pytest.mark.parametrize("member", ["length", "feed", "end", "value"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_rows_that_are_not_finite_are_refused(
    member: str, value: float
) -> None:
    """A NaN never reaches the planner."""
    rows = line_rows(np.array([[0.0, 0, 0], [1.0, 0, 0]]), 10.0)
    rows[member] = value
    assert refused(rows) == 904002


def test_rows_of_unknown_kind_are_refused() -> None:
    """A kind the engine does not execute is an error, not a silent skip."""
    rows = np.zeros(1, NC_BLOCK)
    for kind in (0, POLYNOMIAL, 200):
        rows["type"] = kind
        assert refused(rows) == 904001


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("[channel]\nlookahead_block = 5\n", "lookahead_blocks"),
        ("cycle = 0.001\n", "cycle_s"),
        ("[axes.X]\nv_max = 5\n", "v_max_mm_s"),
        ("[axes.X]\nv_max_mm_s = -5\n", "greater than 0"),
        ("[axes.X]\nmin_mm = 5\nmax_mm = 1\n", "not below"),
        ("[axes.X]\nv_max_mm_s = nan\n", "v_max_mm_s"),
        ("[axes.H]\n", "axis name"),
        ("cycle_s = 0\n", "cycle_s"),
        ("cycle_s = nan\n", "finite"),
        ('cycle_s = "0.002"\n', "valid number"),
        ("[axes.X]\nv_max_mm_s = true\n", "valid number"),
        ("[channel]\nfb_storage_size = true\n", "valid integer"),
        ('[channel.m_synch]\n060 = "MOS"\n', "leading zeros"),
        ("[axes.X]\nid = 2\n[axes.Y]\n", "not all different"),
        ("[axes.X\nkind=\n", "cell.toml:1:8: 902001: not TOML"),
        ("[axes", "TOML"),
    ],
)
def test_wrong_configurations_are_refused(text: str, hint: str) -> None:
    """Unknown keys name the nearest known one, numbers out of range their range."""
    with pytest.raises(CncError) as caught:
        parse_config(text, "cell.toml")
    assert hint in str(caught.value)
    assert "cell.toml" in str(caught.value)
