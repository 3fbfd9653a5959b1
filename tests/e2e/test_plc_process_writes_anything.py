"""A hostile PLC as a process of its own, through the command line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from support.command_line import T1, Outcome
from support.paths import PLC_PROGRAMS, TESTS

HOSTILE = PLC_PROGRAMS / "writes_anything.py"


@pytest.mark.ci
def test_scribbling_plc_changes_no_sample(
    cli: Callable[..., Outcome],
    program: Callable[..., Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The recorded path is bit for bit that of a run beside the default PLC."""
    monkeypatch.setenv("PYTHONPATH", str(TESTS))
    part = program(T1)
    quiet = cli("run", part, "--record", "quiet.npz", "--json")
    hostile = cli(
        "run", part, "--plc", HOSTILE, "--record", "hostile.npz", "--json"
    )
    assert (quiet.status, hostile.status) == (0, 0), hostile.err
    assert hostile.json["plc"]["result"]["bytes"] > 1_000_000
    a, b = np.load(tmp_path / "quiet.npz"), np.load(tmp_path / "hostile.npz")
    for key in ("pos", "s"):
        n = min(len(a[key]), len(b[key]))
        assert n > 1000
        assert np.array_equal(a[key][:n], b[key][:n])


@pytest.mark.ci
def test_random_mode_commands_do_not_kill_the_cnc(
    cli: Callable[..., Outcome],
    program: Callable[..., Path],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Wrong modes, states and program names (too long ones too) are refused and reported."""
    monkeypatch.setenv("PYTHONPATH", str(TESTS))
    monkeypatch.setenv("HOSTILE_MODES", "1")
    done = cli("run", program(T1), "--plc", HOSTILE, "--json", timeout=100)
    assert "Traceback" not in done.err
    assert "died" not in done.out
    assert done.json["warnings"]
