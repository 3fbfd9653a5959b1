"""``plan`` of a cell with several channels."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from support.command_line import Outcome

Cli = Callable[..., Outcome]
CELL = "[channels.a.axes.X]\n[channels.b.axes.X]\n"
FIRST = "N10 G1 X10 F600\nN20 #SIGNAL SYN [ID=1 CH=2]\nN30 M30\n"
SECOND = "N10 #WAIT [ID=1 CH=1]\nN20 G4 2\nN30 M30\n"


def written(folder: Path, first: str, second: str) -> list[str]:
    """Arguments of ``plan`` behind its name."""
    for name, text in (("c.toml", CELL), ("a.nc", first), ("b.nc", second)):
        (folder / name).write_text(text)
    files = [str(folder / "a.nc"), str(folder / "b.nc")]
    return [*files, "--cell", str(folder / "c.toml")]


def test_all_channels_in_one_call(cli: Cli, tmp_path: Path) -> None:
    """The time of each, with what it waits for the other, and of the whole."""
    outcome = cli("plan", *written(tmp_path, FIRST, SECOND), "--json")
    assert outcome.status == 0
    value = json.loads(outcome.out)
    first, second = value["channels"]
    assert first["time_s"] == pytest.approx(1.03, abs=0.05)
    assert second["wait_s"] == pytest.approx(first["time_s"], abs=0.05)
    assert second["time_s"] == pytest.approx(first["time_s"] + 2.0, abs=0.05)
    assert value["time_s"] == second["time_s"]
    assert [one["end"] for one in value["channels"]] == ["completed"] * 2


def test_a_wrong_program_is_told(cli: Cli, tmp_path: Path) -> None:
    """The table has how each ended, the error its place."""
    arguments = written(tmp_path, FIRST, "N10 G1 Q1 F600\nN20 M30\n")
    outcome = cli("plan", *arguments)
    assert outcome.status == 1
    assert "error" in outcome.out
    assert "b.nc:1" in outcome.err
    assert "900001" in outcome.err


@pytest.mark.parametrize("option", ["--no-jerk", "--lookahead=20"])
def test_what_is_for_one_channel_asks_for_it(
    cli: Cli, tmp_path: Path, option: str
) -> None:
    """An option that measures one path names --channel."""
    outcome = cli("plan", *written(tmp_path, FIRST, SECOND), option)
    assert outcome.status == 1
    assert "--channel" in outcome.err
