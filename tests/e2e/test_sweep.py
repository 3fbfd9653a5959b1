"""A sweep by real processes: its table, and what a kill leaves of it."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from cnc_core.errors import CncError
from cnc_core.sweep import Results, sweep
from cnc_core.sweep.ledger import Ledger
from support.command_line import command
from support.paths import EVERY

STUDY = """
programs = ["part.nc", "wrong.nc"]
measure = ["plan", "run"]

[parameters]
"run.tolerance" = [0.0, 0.05]
"cell.axes.X.v_max_mm_s" = [100.0, 200.0, -1.0]

[figures]
fastest = {symbol = "v", of = "max"}
"""
PART = "G1 F60000 X10\nY10\nM30\n"
RUNS = 12
MANY = max(200 // EVERY, 40)


def study_in(folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "part.nc").write_text(PART)
    (folder / "wrong.nc").write_text("G1 F1000 X10\nXY\nM30\n")
    file = folder / "study.toml"
    file.write_text(STUDY)
    return file


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """The study by one worker, in one go."""
    folder = tmp_path_factory.mktemp("sweep")
    return sweep(study_in(folder), folder / "out", workers=1)


@pytest.mark.ci
def test_the_table_has_a_row_a_run(whole: Results) -> None:
    """Parameters and figures beside each other; what fails is a row with its
    reason.
    """
    assert whole.runs == RUNS
    good = [row for row in whole.rows() if row["end"] == "completed"]
    assert [row["number"] for row in good] == [0, 1, 3, 4]
    sharp, blended = good[0], good[2]
    assert sharp["run.tolerance"] < blended["run.tolerance"]
    assert sharp["sim_time_s"] > blended["sim_time_s"]
    assert sharp["plan.path_deviation_mm"] < 1e-9
    assert 0.01 < blended["plan.path_deviation_mm"] <= 0.05
    assert good[0]["fastest"] < good[1]["fastest"] <= 300.0
    errors = [row["error"] for row in whole.rows() if row["end"] == "error"]
    assert sum("v_max_mm_s" in text for text in errors) == 4
    assert sum("wrong.nc:2" in text for text in errors) == 4


def children(pid: int) -> Iterator[int]:
    for task in Path(f"/proc/{pid}/task").iterdir():
        yield from map(int, (task / "children").read_text().split())


def complete(folder: Path) -> int:
    """Rows in the ledger of a sweep that runs."""
    if not (folder / "ledger.sqlite").exists():
        return 0
    ledger = Ledger(folder)
    try:
        return len(ledger.rows())
    finally:
        ledger.close()


@pytest.mark.ci
def test_kills_lose_nothing_that_was_complete(
    whole: Results, tmp_path: Path
) -> None:
    """A worker is killed, then the sweep; --resume makes the rest, and the
    table is the same to the bit.
    """
    study, out = study_in(whole.path.parents[1]), tmp_path / "out"
    words = ("sweep", study, "-o", out, "--workers", 2)
    first = subprocess.Popen(command(*words), stderr=subprocess.DEVNULL)
    while complete(out) < 1:
        assert first.poll() is None
        time.sleep(0.02)
    os.kill(next(children(first.pid)), signal.SIGKILL)
    before = complete(out)
    while complete(out) <= before:
        assert first.poll() is None
        time.sleep(0.02)
    first.kill()
    first.wait()
    kept = complete(out)
    assert 0 < kept < RUNS
    with pytest.raises(CncError, match="--resume goes on"):
        sweep(study, out)
    done: list[int] = []
    results = sweep(
        study, out, resume=True, workers=1, tick=lambda n, _: done.append(n)
    )
    assert done[0] >= kept
    assert results.path.read_bytes() == whole.path.read_bytes()


@pytest.mark.long
def test_two_hundred_runs_and_five_kills(tmp_path: Path) -> None:
    """The sweep is killed behind random numbers of runs; the table is that of a sweep in
    one go, and no file of a run is left.
    """
    study = study_in(tmp_path)
    study.write_text(
        'programs = ["part.nc"]\n[parameters]\n'
        f'"run.tolerance" = {{low = 0.0, high = 0.05, count = {MANY}}}\n'
    )
    aside = tmp_path / "aside"
    aside.mkdir()
    environment = os.environ | {"TMPDIR": str(aside)}
    words = ("sweep", study, "-o", tmp_path / "out", "--workers", 2, "--resume")
    moments = sorted(random.Random(7).sample(range(1, MANY - 10), 5))
    for moment in moments:  # so many runs are complete
        one = subprocess.Popen(
            command(*words), stderr=subprocess.PIPE, env=environment
        )
        while complete(tmp_path / "out") < moment:
            assert one.poll() is None
            time.sleep(0.05)
        one.kill()
        _, said = one.communicate()
        assert b"Traceback" not in said
    kept = complete(tmp_path / "out")
    assert 0 < kept < MANY
    # the next sweep removes what a killed one had no time to remove
    subprocess.run(command(*words), env=environment, check=True)
    killed = sweep(study, tmp_path / "out", resume=True)
    whole = sweep(study, tmp_path / "whole")
    assert killed.path.read_bytes() == whole.path.read_bytes()
    assert (killed.runs, killed.failed) == (MANY, 0)
    assert list(aside.iterdir()) == []


def test_a_changed_study_does_not_go_on(whole: Results, tmp_path: Path) -> None:
    """Rows of two studies never meet in one table."""
    study, out = study_in(tmp_path), tmp_path / "out"
    ledger = Ledger(out)
    ledger.begin("of another study")
    ledger.close()
    with pytest.raises(CncError, match="is not what it was"):
        sweep(study, out, resume=True)


@pytest.mark.ci
def test_rows_that_cannot_be_kept_end_the_sweep(tmp_path: Path) -> None:
    """The reason is told; nothing is said to be complete that is not."""
    study, out = study_in(tmp_path), tmp_path / "out"

    def spoil(done: int, of: int) -> None:
        if done == 0:
            (out / "rows").rmdir()
            (out / "rows").write_text("in the way")

    with pytest.raises(CncError, match=r"run 0 .*Not a directory"):
        sweep(study, out, workers=1, tick=spoil)
    assert not (out / "study.parquet").exists()


def test_a_missing_file_is_named_before_anything_runs(tmp_path: Path) -> None:
    """No folder is made for it."""
    study = study_in(tmp_path)
    (tmp_path / "part.nc").unlink()
    with pytest.raises(CncError, match=r"part.nc.*file not found"):
        sweep(study, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.ci
def test_the_command_prints_what_the_contract_says(tmp_path: Path) -> None:
    """runs, done, failed and table; --engine names who runs them."""
    study = study_in(tmp_path)
    study.write_text('programs = ["part.nc"]\n')
    words = ("sweep", study, "-o", tmp_path / "out", "--engine", "local")
    done = subprocess.run(
        command(*words, "--json"), capture_output=True, check=True
    )
    said = json.loads(done.stdout)
    assert (said["runs"], said["done"], said["failed"]) == (1, 1, 0)
    assert Path(said["table"]).is_file()
