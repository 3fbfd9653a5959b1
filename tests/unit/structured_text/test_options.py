"""Options of Structured Text: on the command line, as words, in the environment."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from cnc_core.cell.plc_choice import PlcChoice
from cnc_core.commands.console import app
from cnc_core.commands.options import StOptions
from cnc_core.errors import CncError
from plc_client.st.machine.tasks import load_st, options_of
from plc_client.task import PlcError, spec_of

TEXT = """{IF defined (WIDE)}
PROGRAM MAIN
VAR a : INT; END_VAR
a := 1;
END_PROGRAM
{ELSE}
PROGRAM OTHER
END_PROGRAM
{END_IF}
"""


@pytest.fixture
def logic(tmp_path: Path) -> Path:
    """A program that depends on a define."""
    path = tmp_path / "logic.st"
    path.write_text(TEXT)
    return path


def test_words_give_tasks_intervals_and_defines(logic: Path) -> None:
    """The task class has the interval and the priority that were given."""
    shown = StOptions(task=("A:2.5:7=MAIN",), define=("WIDE",), interval=0.004)
    words = shown.words()
    (cls,) = load_st(logic, options_of(words))
    assert (spec_of(cls).interval, spec_of(cls).priority) == (0.0025, 7)
    (cls,) = load_st(logic, options_of(["interval=0.004"]))
    assert (cls.__name__, spec_of(cls).interval) == ("OTHER", 0.004)


def test_environment_comes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """Words of the command line add to it; the last interval counts."""
    monkeypatch.setenv("HLI_COSIM_ST", "short-circuit interval=0.002 define=X")
    found = options_of(["interval=0.003", "define=Y"])
    assert found.short_circuit
    assert (found.interval, found.defines) == (0.003, ("X", "Y"))


@pytest.mark.parametrize(
    "word",
    [
        "shortcircuit",
        "interval=0",
        "interval=nan",
        "interval=x",
        "task=A",
        "task=A:x=MAIN",
        "task=A:0=MAIN",
        "task=A:1:1=",
        "task==MAIN",
    ],
)
def test_wrong_word_is_refused(word: str) -> None:
    """Its text says what is expected."""
    with pytest.raises(PlcError, match=r"options?|interval|task"):
        options_of([word])


@pytest.mark.ci
def test_check_takes_the_options(logic: Path) -> None:
    """A define changes what is checked; a wrong task is a usage error."""
    runner = CliRunner()
    for define, name in ((["--define", "WIDE"], 1), ([], 1)):
        done = runner.invoke(app, ["check", str(logic), "--json", *define])
        assert json.loads(done.output)["pous"] == name
    done = runner.invoke(app, ["check", str(logic), "--task", "A:x=MAIN"])
    assert done.exit_code == 2


def test_options_reach_the_plc_process(logic: Path) -> None:
    """They are arguments of the PLC process; a built-in PLC has none."""
    choice = PlcChoice.of(logic).structured(["interval=0.002"])
    assert choice.arguments[-2:] == ("--st", "interval=0.002")
    with pytest.raises(CncError, match="Structured Text"):
        PlcChoice.of(None).structured(["interval=0.002"])
