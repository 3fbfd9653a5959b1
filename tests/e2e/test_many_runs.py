"""Many small runs from Python: a warm worker, configurations as values."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core import Cell, CellConfig, CncError, Recording
from cnc_core.cell import worker
from cnc_core.config import load_config
from cnc_core.config.reading import config_of, config_text
from cnc_core.errors import ConfigError
from support.paths import ROOT

DISTANCE = "gpCh[0].bahn_state.dist_prog_start"
PART = "N10 G1 X2 F1000\nM30\n"
AXES: dict[str, Any] = {"X": {"v_max_mm_s": 10.0}, "Y": {}, "Z": {}}


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "part.nc"
    path.write_text(PART)
    return path


@pytest.mark.ci
def test_runs_of_a_worker_are_those_of_new_processes(part: Path) -> None:
    """All come from the worker."""
    results = []
    for _ in range(4):
        with Cell() as cell:
            results.append(cell.run(part, watch=[DISTANCE]).check())
    assert worker._state["worker"].usable
    first = results[0]
    for other in results[1:]:
        assert other.cycles == first.cycles
        for name, column in first.columns.items():
            assert np.array_equal(column, other.columns[name])


@pytest.mark.ci
def test_each_run_has_folder_and_environment_of_its_time(
    part: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a process that is started anew would have them."""
    plc = tmp_path / "plc.py"
    plc.write_text(
        "import os\nfrom plc_client import task\n@task(interval=0.001)\n"
        "class A:\n    def cyclic(self): pass\n"
        "    def result(self): return [os.getcwd(), os.environ.get('MINE')]\n"
    )
    for name in ("a", "b", "c"):
        folder = tmp_path / name
        folder.mkdir()
        monkeypatch.chdir(folder)
        monkeypatch.setenv("MINE", name)
        with Cell() as cell:
            found = cell.run(part, plc).check().plc["result"]
        assert found == [str(folder), name]


@pytest.mark.ci
def test_a_dead_worker_is_replaced(part: Path) -> None:
    """A run after its end completes as before."""
    with Cell() as cell:
        for _ in range(2):
            cell.run(part).check()
        process = worker._state["worker"]._process
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        assert cell.run(part).check().end == "completed"


@pytest.mark.ci
def test_a_cell_takes_path_dict_or_config(part: Path, tmp_path: Path) -> None:
    """The CNC process gets the same limits each way."""
    path = tmp_path / "cell.toml"
    path.write_text(
        "[axes.X]\nv_max_mm_s = 10.0\n[axes.Y]\n[axes.Z]\n", encoding="utf-8"
    )
    values = {"axes": AXES}
    cycles = set()
    for config in (path, str(path), values, CellConfig.model_validate(values)):
        with Cell(config) as cell:
            cycles.add(cell.run(part).check().cycles)
    assert len(cycles) == 1
    assert cycles.pop() > 200
    with pytest.raises(ConfigError, match="v_max: unknown key"):
        Cell({"axes": {"X": {"v_max": 1.0}}})


@pytest.mark.parametrize(
    "path",
    sorted(
        {*ROOT.glob("examples/**/*.toml")}
        - {*ROOT.glob("examples/**/study.toml")}
    ),
    ids=lambda path: f"{path.parent.name}-{path.stem}",
)
def test_a_configuration_survives_its_text(path: Path, tmp_path: Path) -> None:
    """What the CNC process reads is what Python has."""
    cell = load_config(path)
    text = tmp_path / "cell.json"
    text.write_text(config_text(cell))
    assert load_config(text) == cell
    assert config_of(cell) is cell


@pytest.mark.cell({"axes": AXES})
def test_the_fixture_takes_a_configuration(cell: Cell, part: Path) -> None:
    """By the mark ``cell``."""
    assert cell.config.axes["X"].v_max_mm_s == 10.0
    assert cell.run(part).check().cycles > 200


@pytest.mark.parametrize(
    "cell", [{"axes": AXES}, None], indirect=True, ids=["own", "built-in"]
)
def test_the_fixture_takes_several(cell: Cell) -> None:
    """By indirect parameters."""
    assert cell.config.axes["X"].v_max_mm_s in (10.0, 300.0)


def test_check_raises_with_the_reason(part: Path) -> None:
    """The error, its place and the source line."""
    part.write_text("N10 G1 X1 F1000\nN20 FOO\n")
    with Cell() as cell:
        result = cell.run(part)
    with pytest.raises(CncError) as error:
        result.check()
    assert f"{part}:2:5: 900004" in str(error.value)
    assert "N20 FOO" in str(error.value)


@pytest.mark.ci
def test_columns_of_a_recorded_run(part: Path) -> None:
    """A row a cycle; a watched symbol is that of the last scan; the recording
    goes with its last reader.
    """
    with Cell() as cell:
        result = cell.run(part, record=True, watch=DISTANCE).check()
    columns = result.columns
    assert len({len(column) for column in columns.values()}) == 1
    assert columns["X"][-1] == pytest.approx(2.0)
    assert columns["v"].max() == pytest.approx(1000.0 / 60.0)
    seen, shown = columns[DISTANCE], columns["dist_prog_start"]
    assert np.array_equal(seen[1:], shown[1:])
    assert result.recording is not None
    folder = result.recording.path.parent
    assert folder.is_dir()
    del result, columns
    assert not folder.exists()


@pytest.mark.ci
def test_columns_of_a_named_recording(part: Path, tmp_path: Path) -> None:
    """The same from a file; an export that nobody reads has none."""
    target = tmp_path / "run.npz"
    with Cell() as cell:
        result = cell.run(part, "none", record=target).check()
        export = cell.run(part, "none", record=tmp_path / "run.csv").check()
    assert np.array_equal(result.columns["X"], Recording(target).cycles["X"])
    assert target.exists()
    assert not export.columns


def test_an_unknown_column_is_told(part: Path) -> None:
    """With the columns that there are, and how to get the others."""
    with Cell() as cell:
        result = cell.run(part, watch=DISTANCE).check()
    with pytest.raises(KeyError, match=r"'v'; there are: t, gpCh.*record=True"):
        result.columns["v"]
