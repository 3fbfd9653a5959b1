"""Every command as a user calls it: help with an example, JSON alone on
standard output, usage errors.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from support.command_line import T1, Outcome

Cli = Callable[..., Outcome]
Write = Callable[..., Path]
COMMANDS = [
    "demo",
    "check",
    "blocks",
    "plan",
    "run",
    "lookahead",
    "cnc",
    "plc",
    "types",
    "bench handshake",
    "bench cycle",
]
COMMANDS += ["bench planner", "bench parser"]


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_an_example(cli: Cli, name: str) -> None:
    """--help of every command shows how to call it."""
    outcome = cli(*name.split(), "--help")
    assert outcome.status == 0
    assert f"Example: hli-cosim {name}" in " ".join(outcome.out.split())


@pytest.mark.parametrize(
    "arguments",
    [
        ("nothing",),
        ("run",),
        ("plan", "x.nc", "--lookahead", "5"),
        ("lookahead", "x.nc"),
        ("types",),
        ("bench",),
        ("run", "x.nc", "--plc", "a.py", "--plc=b.py"),
    ],
)
def test_wrong_usage_ends_with_status_2(
    cli: Cli, arguments: tuple[str, ...]
) -> None:
    """Wrong usage is told apart from a wrong program."""
    assert cli(*arguments).status == 2


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    "arguments", [("check",), ("plan",), ("run",), ("lookahead", "--index", 0)]
)
def test_json_is_one_object_and_nothing_else(
    cli: Cli, program: Write, arguments: tuple[object, ...]
) -> None:
    """--json leaves standard output to one JSON object."""
    command, *rest = arguments
    outcome = cli(command, program(T1), *rest, "--json")
    assert outcome.status == 0
    assert isinstance(json.loads(outcome.out), dict)


def test_blocks_prints_the_canonical_rows(cli: Cli, program: Write) -> None:
    """One JSON object a row; T1's marker, arc and places."""
    rows = cli("blocks", program(T1), "--json").lines
    assert [r["type"] for r in rows] == [
        "marker",
        "linear",
        "linear",
        "circular",
        "marker",
        "circular",
        "linear",
        "marker",
    ]
    arc = rows[3]
    assert arc["center"] == pytest.approx({"X": 10.0, "Y": 40.0})
    assert (arc["line"], arc["n"], arc["count"], arc["plane"]) == (
        5,
        50,
        5,
        "XY",
    )
    assert rows[0]["action"] == "on"
    assert rows[0]["param"] == 1.0


@pytest.mark.ci
def test_plan_writes_samples_as_the_contract_says(
    cli: Cli, program: Write, tmp_path: Path
) -> None:
    """t, pos, axes, s, v, block at the cycle; the last sample is the end point."""
    target = tmp_path / "samples.npz"
    result = cli(
        "plan",
        program(T1),
        "--samples",
        target,
        "--picture",
        tmp_path / "p.png",
        "--json",
    ).json
    with np.load(target) as a:
        assert set(a.files) == {"t", "pos", "axes", "s", "v", "block"}
        assert a["t"] == pytest.approx(
            np.arange(len(a["t"])) * result["cycle_s"], abs=1e-12
        )
        assert a["pos"][-1].tolist() == [-20.0, 70.0, 0.0]
        assert list(a["axes"]) == ["X", "Y", "Z"]
    assert set(result["max_ratio"]) == {
        "velocity",
        "acceleration",
        "jerk",
        "feed",
    }
    assert result["max_ratio"]["acceleration"] <= 1.02
    assert (tmp_path / "p.png").stat().st_size > 1000


@pytest.mark.ci
def test_types_in_three_languages(cli: Cli, tmp_path: Path) -> None:
    """The C header compiles with its assertions, the JSON names the look-ahead
    unit, ST has the pointers.
    """
    header = tmp_path / "hli.h"
    header.write_text(cli("types", "--c").out)
    subprocess.run(
        [
            "gcc",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-fsyntax-only",
            "-x",
            "c",
            header,
        ],
        check=True,
    )
    assert (
        cli("types", "--json").json["structures"][
            "HLI_CONTOUR_LOOKAHEAD_BLOCK"
        ]["size"]
        == 72
    )
    assert (
        "gpCh : ARRAY [0..11] OF POINTER TO HLI_CHANNEL;"
        in cli("types", "--st").out
    )


@pytest.mark.ci
@pytest.mark.parametrize("name", ["handshake", "cycle", "planner", "parser"])
def test_benchmarks_print_their_object(cli: Cli, name: str) -> None:
    """Each benchmark runs and prints one JSON object with the contract's names;
    nothing timed is asserted.
    """
    value = cli("bench", name, "--seconds", 1, "--json").json
    if name == "handshake":
        assert {
            "raw_us",
            "immediate_us",
            "python_us",
            "cyclic_us",
            "period_us",
            "payload_bytes",
            "n",
            "pinned",
        } <= set(value)
        assert value["torn_reads"] == 0
        assert value["payload_bytes"] >= 50 * 72
    if name == "cycle":
        assert set(value["cycle_ns"]) == {"p50", "p99", "p999", "max"}
    if name == "parser":
        assert all(v > 0 for v in value["lines_per_s"].values())


@pytest.mark.ci
def test_demo_writes_its_picture(cli: Cli, tmp_path: Path) -> None:
    """Both modes are used, the override was lowered, picture and recording are there."""
    value = cli("demo", "--seconds", 3, "--out", tmp_path / "d", "--json").json
    assert value["end"] == "completed"
    assert value["requests"]["mode1"] > 0
    assert value["requests"]["mode2"] > 0
    assert value["lowest_override"] < 100.0
    assert (tmp_path / "d" / "demo.png").stat().st_size > 10_000


@pytest.mark.ci
@pytest.mark.parametrize(
    ("text", "status"), [("G999 F3000\nG1 X100\nM30\n", 1), ("M30\n", 0)]
)
def test_a_request_at_the_start_of_a_program_that_does_not_move(
    cli: Cli, program: Write, text: str, status: int
) -> None:
    """`lookahead --at start` ends, too, when the program is refused while it is
    prepared, or has nothing to move.
    """
    file = program(text)
    outcome = cli(
        "lookahead",
        file,
        "--distance",
        "0",
        "50000",
        "--at",
        "start",
        "--json",
        "--dialect",
        "isg",
    )
    assert outcome.status == status
    assert json.loads(outcome.out)["response"] == []
    assert ("20131" in outcome.err) == (status == 1)
