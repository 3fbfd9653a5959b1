"""What works where the extras are not installed."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from support.command_line import T1, Outcome, command

Cli = Callable[..., Outcome]
HIDING = """
import importlib.abc, sys

class Hidden(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("matplotlib", "scipy", "starlette", "uvicorn", "websockets",
                                  "asyncua", "pyads"):
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Hidden())
"""


@pytest.fixture
def cli(tmp_path: Path) -> Cli:
    """The command in a Python of its own: what is imported counts here."""

    def call(*arguments: object) -> Outcome:
        done = subprocess.run(
            command(*arguments),
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        return Outcome(done.returncode, done.stdout, done.stderr)

    return call


@pytest.fixture
def no_extras(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No process finds a package of an extra."""
    (tmp_path / "hide").mkdir()
    (tmp_path / "hide" / "sitecustomize.py").write_text(HIDING)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "hide"))


@pytest.mark.usefixtures("no_extras")
@pytest.mark.ci
def test_the_demo_runs_without_a_picture(cli: Cli, tmp_path: Path) -> None:
    """And names the extra."""
    outcome = cli("demo", "--seconds", "1")
    assert outcome.status == 0, outcome.err
    assert "hli-cosim[pictures]" in "".join(outcome.out.split())
    assert not (tmp_path / "hli-cosim-demo" / "demo.png").exists()


@pytest.mark.ci
@pytest.mark.usefixtures("no_extras")
def test_a_picture_names_its_extra(
    cli: Cli, program: Callable[..., Path]
) -> None:
    """Before the program is planned."""
    outcome = cli("plan", program(T1), "--picture", "p.png")
    assert outcome.status == 1
    assert "hli-cosim[pictures]" in outcome.err
    assert cli("plan", program(T1), "--samples", "s.npz").status == 0


@pytest.mark.ci
@pytest.mark.usefixtures("no_extras")
def test_the_monitor_names_its_extra(cli: Cli) -> None:
    """Alone, and before a cell is started for it."""
    for words in (("monitor",), ("demo", "--monitor")):
        outcome = cli(*words)
        assert outcome.status == 1
        assert "hli-cosim[monitor]" in outcome.err
        assert "Traceback" not in outcome.err


@pytest.mark.ci
@pytest.mark.usefixtures("no_extras")
def test_opcua_names_its_extra(cli: Cli) -> None:
    """One line, no traceback."""
    outcome = cli("opcua", "none")
    assert outcome.status == 1
    assert "hli-cosim[opcua]" in "".join(outcome.err.split())
