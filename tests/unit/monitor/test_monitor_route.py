"""What the monitor draws of a program, and where it finds the file."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from cnc_core.monitor.route import POINTS, read_route
from cnc_core.monitor.source import Source, source_of
from cnc_core.process.options import CncOptions, RunOptions

Write = Callable[..., Path]
PART = """N10 G01 X30 Y0 F6000
N20 G03 X40 Y10 I0 J10
N25 #CONTOUR LOOKAHEAD LOG ON [PARAM=1]
N30 G01 Y40
M30
"""


def test_a_route_follows_lines_and_arcs(program: Write) -> None:
    """Points lie on the path, at their distance, with line and count."""
    route = read_route(Source(program(PART)))
    assert (route.whole, route.problem) == (True, "")
    assert route.marked == [3]
    assert route.lines == PART.splitlines()
    assert route.points[0][:4] == [0, 0, 0, 0]
    arc = [p for p in route.points if p[4] == 2]
    assert len(arc) > 10
    for x, y, _, distance, *_ in arc:
        assert math.hypot(x - 30, y - 10) == pytest.approx(10, abs=1e-3)
        angle = (distance - 30) / 10
        assert x == pytest.approx(30 + 10 * math.sin(angle), abs=1e-3)
    assert route.points[-1][:3] == [40, 40, 0]
    length = 30 + 5 * math.pi + 30
    assert route.points[-1][3] == pytest.approx(length, abs=1e-3)


@pytest.mark.ci
def test_a_long_program_is_thinned(
    program: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The number of points is bounded; begin and end stay."""
    monkeypatch.setattr("cnc_core.monitor.route.READ_S", 600.0)
    text = "G01 F6000\n" + "".join(f"X{i / 1000}\n" for i in range(30_000))
    route = read_route(Source(program(text)))
    assert len(route.points) <= POINTS
    assert route.points[-1][0] == pytest.approx(29.999)


def test_a_wrong_program_tells_its_error(program: Write) -> None:
    """The lines are there, and what lies ahead of the error."""
    route = read_route(Source(program("G01 X10 F1000\nG999\nX20\n")))
    assert "2:" in route.problem
    assert not route.whole
    assert len(route.lines) == 3
    gone = read_route(Source(Path("/nowhere/part.nc")))
    assert gone.problem
    assert gone.points == []


@pytest.mark.parametrize("launched", [False, True])
def test_the_command_line_tells_the_program(
    program: Write, tmp_path: Path, launched: bool
) -> None:
    """Of ``cnc``, relative to its folder; of a run, from its options."""
    part = program(PART)
    cell = program("[axes.X]\n", "cell.toml")
    words = ["cnc", part.name, "--config", cell.name, "--dialect=isg"]
    if launched:
        options = CncOptions(part, "x", RunOptions(dialect="isg"), config=cell)
        words = [options.as_json()]
    sleep = "import sys; print(flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-c", sleep, *words],
        cwd=tmp_path,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        wanted = Source(part, cell, "isg")
        assert source_of(process.pid, part.name) == wanted
        assert source_of(process.pid, "other.nc") is None
        process.kill()
    assert source_of(os.getpid(), part.name) is None
    assert source_of(2**22 + 1, part.name) is None


@pytest.mark.parametrize("text", ["{", "{}", '{"file": 1}', "{" * 5000])
def test_options_that_are_none(text: str) -> None:
    """A command line that only looks like a launcher's."""
    from cnc_core.monitor.source import _from_options  # noqa: PLC0415

    assert _from_options(text, "part.nc") is None
