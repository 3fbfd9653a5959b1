"""What commands print for people: units, few digits, 80 columns, errors last."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from cnc_core.cli import app
from cnc_core.commands.tables import number, value_lines
from support.command_line import T1, Outcome

Cli = Callable[..., Outcome]
Write = Callable[..., Path]
WATCHED = "gpCh[0].bahn_state.active_feed_r"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (7, "7"),
        (1234567, "1234567"),
        (12.34567, "12.35"),
        (123456.7, "123500"),
        (0.00012345, "0.0001234"),
        (7.589e-15, "7.589e-15"),
        (-2.0, "-2"),
        (float("nan"), "nan"),
    ],
)
def test_numbers_have_four_digits(value: float, text: str) -> None:
    """Whole numbers are exact, nothing has sixteen digits."""
    assert number(value) == text


@pytest.mark.parametrize(
    "arguments",
    [
        ("plan",),
        ("blocks",),
        ("run", "--watch", WATCHED),
        ("lookahead", "--index", "0"),
        ("lookahead", "--distance", "0", "500000"),
    ],
    ids=["plan", "blocks", "run", "index", "distance"],
)
@pytest.mark.ci_cases
def test_tables_are_for_people(
    cli: Cli, program: Write, arguments: tuple[str, ...]
) -> None:
    """At most 80 columns, no JSON, no long numbers."""
    name, *options = arguments
    outcome = cli(name, program(T1), *options)
    assert outcome.status == 0
    assert max(map(len, outcome.out.splitlines())) <= 80
    assert not re.search(r"[{}\"]|\d\.\d{7}", outcome.out)
    assert "\x1b" not in outcome.out


@pytest.mark.ci
def test_bench_tables_are_for_people(cli: Cli) -> None:
    """Nested figures have a row each, with their unit."""
    outcome = cli("bench", "cycle", "--seconds", "1")
    assert max(map(len, outcome.out.splitlines())) <= 80
    assert "{" not in outcome.out
    assert re.search(r"cycle +p50 .* ns", outcome.out)


@pytest.mark.ci
def test_a_run_tells_tasks_and_watched_symbols(
    cli: Cli, program: Write
) -> None:
    """A line for each task; last, smallest, largest value and changes."""
    out = cli("run", program(T1), "--watch", WATCHED).out
    assert re.search(r"task acknowledge: \d+ scans every 1 ms, .* at most", out)
    row = next(line for line in out.splitlines() if WATCHED in line)
    last, low, high, changes = map(int, row.split()[1:])
    assert (last, low) == (0, 0)
    assert high > 0
    assert changes > 10


@pytest.mark.ci
def test_an_answer_names_kinds_and_millimetres(
    cli: Cli, program: Write
) -> None:
    """Both units of a place; PARAM of a marker is no length."""
    out = cli("lookahead", program(T1), "--index", "0").out
    assert re.search(r"LOG PARAM +60 .* PARAM 5\.5 ", out)
    assert re.search(r"line +30 +0 +0\.0000 +30\.0000 ", out)
    assert re.search(r"circle +50 .* 20 +1\.571 ", out)


@pytest.mark.ci
def test_an_error_comes_last_and_without_zeros(
    cli: Cli, program: Write
) -> None:
    """A run that never drove has no table; one that did has its error behind it."""
    outcome = cli("run", program("N10 FOO\n"))
    assert outcome.out == ""
    assert "part.nc:1:5: 900004" in outcome.err.splitlines()[-2]
    driven = cli("run", program("N10 G1 X1 F1000\nN20 T7 D7\nM30\n"))
    assert "error" in driven.out
    assert driven.err.splitlines()[-1].strip() == "N20 T7 D7"


@pytest.mark.ci
def test_every_command_explains_itself_in_80_columns() -> None:
    """Its help, with an example, at the width of a plain terminal."""
    names = [name for name, _ in commands(typer.main.get_command(app))]
    assert len(names) > 18
    for name in names:
        shown = CliRunner().invoke(
            app, [*name.split(), "-h"], env={"COLUMNS": "80"}, prog_name="h"
        )
        assert shown.exit_code == 0, name
        assert max(map(len, shown.output.splitlines())) <= 80, name
        assert "Example:" in shown.output, name


def commands(group: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every command by its full name; groups are unfolded."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, f"{prefix}{name} ")
        else:
            yield prefix + name, command


def test_values_have_units_and_few_digits() -> None:
    """Of the HLI and of tasks; millimetres beside 0.1 um, long texts cut."""
    place = "gpCh[0]^.bahn_state.dist_prog_start"
    unit = "HLI_Global_Variables.gpCh[0]^.bahn_mc_control.override.command_w"
    given = {place: 123456.789, unit: 500, "T.x": 1 / 3, "T.on": True}
    lines = list(
        value_lines(given | {"T.text": "x" * 200, "T.list": [0.1] * 99})
    )
    assert lines[:4] == [
        f"{place} = 123457 x 0.1 um (12.35 mm)",
        f"{unit} = 500 x 0.1 %",
        "T.x = 0.3333",
        "T.on = TRUE",
    ]
    assert max(map(len, lines)) <= 80
    nested = list(value_lines({"gpCh[0].bahn_state": {"override_r": 1000}}, 2))
    (speed,) = value_lines({"gpCh[0].bahn_state.active_feed_r": 5})
    assert speed.endswith(" = 5 um/s")
    assert nested == ["  gpCh[0].bahn_state", "    override_r = 1000 x 0.1 %"]


@pytest.mark.ci
def test_usual_options(cli: Cli) -> None:
    """--version, -h, completion."""
    assert re.fullmatch(r"hli-cosim \d+\.\d+\.\d+\S*\n", cli("--version").out)
    assert "Usage: hli-cosim" in cli("-h").out
    assert "Example:" in cli("plan", "-h").out
    shown = cli("--show-completion", "bash")
    assert shown.status == 0
    assert "complete" in shown.out


def test_no_color_is_obeyed(
    cli: Cli, program: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    """NO_COLOR counts more than FORCE_COLOR."""
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("FORCE_COLOR", "1")
    out = cli("plan", program(T1)).out
    assert not re.search(r"\x1b\[(?:\d+;)*(?:3|4|9|10)[0-7]", out)
