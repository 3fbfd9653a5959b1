"""An FMU in two importers: fmpy, and a plain one in C."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from cnc_core.cell import Cell
from cnc_core.errors import CncError
from cnc_core.fmu import export_fmu
from hli import layout
from support.command_line import SHM
from support.paths import EVERY, ROOT

fmpy = pytest.importorskip("fmpy")
from fmpy.fmi1 import FMICallException  # noqa: E402
from fmpy.fmi3 import FMU3Slave  # noqa: E402
from fmpy.model_description import read_model_description  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

PART = "G1 F6000 X10\nM8\nG2 X20 Y10 R10\nG1 Y12\nM30\n"
PLC = """
from plc_client import AcknowledgeAll, task

@task(interval=0.004)
class Logic:
    gain: float = 1.0

    def setup(self, hli):
        self.functions = AcknowledgeAll(hli)
        self.count = 0

    def cyclic(self):
        self.functions()
        self.count += 1
"""
STEPS = 300


@dataclass(frozen=True)
class Exported:
    file: Path
    folder: Path  # unpacked
    guid: str
    references: dict[str, int]

    @property
    def library(self) -> Path:
        return self.folder / "binaries/linux64/hli_cosim.so"


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Exported:
    folder = tmp_path_factory.mktemp("fmu with a space")
    (folder / "part.nc").write_text(PART)
    (folder / "plc.py").write_text(PLC)
    file = export_fmu(
        folder / "part.nc",
        folder / "cell.fmu",
        plc=folder / "plc.py",
        input_symbols=["Logic.gain"],
        output_symbols=["Logic.count", "gpCh[0].bahn_state.tool_nr_r"],
    )
    with zipfile.ZipFile(file) as archive:
        archive.extractall(folder / "unpacked")
    model = read_model_description(str(file))
    references = {v.name: v.valueReference for v in model.modelVariables}
    return Exported(file, folder / "unpacked", model.guid, references)


@pytest.fixture(scope="module")
def driven(exported: Exported) -> np.ndarray:
    """X at the end of each cycle, as ``run`` drives it."""
    folder = exported.file.parent
    result = Cell().run(folder / "part.nc", folder / "plc.py", record=True)
    assert result.end == "completed"
    return result.columns["X"][:STEPS]


def test_fmpy_validates_it(exported: Exported) -> None:
    """No complaint about the description."""
    assert validate_fmu(str(exported.file)) == []


@pytest.mark.ci
def test_fmpy_drives_what_run_drives(
    exported: Exported, driven: np.ndarray
) -> None:
    """Bit for bit, with the chosen symbols beside it."""
    out = fmpy.simulate_fmu(
        str(exported.file),
        stop_time=STEPS * 1e-3,
        step_size=1e-3,
        output_interval=1e-3,
        start_values={"Logic.gain": 2.5},
        output=["X.position", "Logic.count", "elements", "ahead0.radius"],
    )
    assert out["X.position"][1 : STEPS + 1].tolist() == driven.tolist()
    assert out["Logic.count"].max() == STEPS // 4
    assert out["elements"].max() == 3
    assert out["ahead0.radius"].max() == pytest.approx(10.0)


@pytest.mark.ci
def test_fmi_3_has_arrays_and_the_hli(
    exported: Exported, driven: np.ndarray
) -> None:
    """The same trajectory; the contour ahead in arrays, the channel's memory as
    Binary; what is not supported is refused by name.
    """
    folder = exported.file.parent
    file = export_fmu(
        folder / "part.nc", folder / "three.fmu", plc=folder / "plc.py", fmi=3
    )
    assert validate_fmu(str(file)) == []
    out = fmpy.simulate_fmu(
        str(file),
        stop_time=STEPS * 1e-3,
        step_size=1e-3,
        output_interval=1e-3,
        output=["X.position", "ahead.radius"],
    )
    assert out["X.position"][1 : STEPS + 1].tolist() == driven.tolist()
    assert out["ahead.radius"][5, 1] == pytest.approx(10.0)
    model = read_model_description(str(file))
    slave = FMU3Slave(
        guid=model.guid,
        unzipDirectory=fmpy.extract(str(file), str(folder / "three")),
        modelIdentifier=model.coSimulation.modelIdentifier,
        instanceName="three",
    )
    references = {v.name: v.valueReference for v in model.modelVariables}
    said: list[str] = []
    slave.instantiate(logMessage=lambda *words: said.append(str(words[-1])))
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.doStep(0.0, 0.1)
    (memory,) = slave.getBinary([references["HLI"]])
    channel = layout.HLI_CHANNEL.from_buffer_copy(memory)
    shown = slave.getFloat64([references["distance"]])[0]
    assert channel.bahn_state.dist_prog_start == pytest.approx(shown * 1e4)
    with pytest.raises(FMICallException):
        slave.getFMUState()
    assert "fmi3GetFMUState is not supported" in said[-1]
    slave.terminate()
    slave.freeInstance()


def importer(exported: Exported, mode: str, **options) -> subprocess.Popen[str]:
    """The importer in C, compiled here, with the FMU's library."""
    program = exported.folder / "importer"
    if not program.exists():
        compiler = shutil.which("cc") or shutil.which("gcc")
        source = ROOT / "tests/support/fmu/importer.c"
        words = [compiler, "-Wall", "-Wextra", "-Werror", source, "-ldl"]
        subprocess.run([*words, "-o", program], check=True)
    places = (exported.references[n] for n in ("X.position", "feed_hold"))
    resources = (exported.folder / "resources").as_uri()
    words = (exported.library, exported.guid, resources, mode, *places)
    return subprocess.Popen(
        [program, *map(str, words)],
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
        **options,
    )


@pytest.mark.ci
def test_two_instances_in_c(exported: Exported, driven: np.ndarray) -> None:
    """The first drives what ``run`` drives, the second stands by its own feed
    hold.
    """
    process = importer(exported, "run")
    out, _ = process.communicate(timeout=120)
    assert process.returncode == 0, out
    one, two = np.array([line.split() for line in out.splitlines()], float).T
    assert one.tolist() == driven.tolist()
    assert two[:100].tolist() == one[:100].tolist()
    assert two[-1] == two[-50] < one[-1]


@pytest.mark.ci
def test_what_is_refused_is_told_to_the_importer(exported: Exported) -> None:
    """By name and with the reason; a refused call breaks nothing, and 100
    instances that make no step leave nothing.
    """
    process = importer(exported, "f")
    out, _ = process.communicate(timeout=120)
    assert process.returncode == 0, out
    step, state, parameter = out.splitlines()
    assert "0.0015 s is no multiple of the cell's cycle, 0.001 s" in step
    assert "fmi2GetFMUstate is not supported" in state
    assert "an output cannot be set" in parameter


def of_session(session: int) -> list[int]:
    """Living processes that descend from an importer."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            words = (place / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(words[3]) == session and words[0] != "Z":
            found.append(int(place.name))
    return found


@pytest.mark.ci
def test_a_killed_importer_ends_the_cell(exported: Exported) -> None:
    """No process and no segment of it is left."""
    process = importer(exported, "hang")
    assert process.stdout is not None
    assert process.stdout.readline() == "stands\n"
    owners = of_session(process.pid)
    assert len(owners) > 1
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()
    for _ in range(500):
        if not of_session(process.pid):
            break
        time.sleep(0.02)
    assert of_session(process.pid) == []
    begins = tuple(f"hli-cosim-{pid}-" for pid in owners)
    assert not [name for name in os.listdir(SHM) if name.startswith(begins)]


@pytest.mark.ci
def test_a_killed_cell_is_told(exported: Exported) -> None:
    """The step fails with the reason, the next one, too; nothing hangs."""
    process = importer(exported, "orphan", stdin=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == "0\n"
    for pid in of_session(process.pid):
        if pid != process.pid:
            os.kill(pid, signal.SIGKILL)
    out, _ = process.communicate("go\n", timeout=60)
    assert out.splitlines() == [
        "log one 3 logStatusError: the process of the cell has died",
        "3",
        "log one 3 logStatusError: the cell has ended",
        "3",
    ]


@pytest.mark.long
def test_a_hundred_lives_leave_nothing(
    exported: Exported, tmp_path: Path
) -> None:
    """Instances that make a step and are freed: no process, no segment, no
    file.
    """
    before = set(os.listdir(SHM))
    environment = os.environ | {
        "TMPDIR": str(tmp_path),
        "LIVES": str(100 // EVERY),
    }
    process = importer(exported, "lives", env=environment)
    out, _ = process.communicate(timeout=600)
    assert process.returncode == 0, out
    assert of_session(process.pid) == []
    assert list(tmp_path.iterdir()) == []
    left = {n for n in os.listdir(SHM) if n.startswith("hli-cosim-")} - before
    assert not [name for name in left if not alive(name)]


def alive(name: str) -> bool:
    """Whether the segment's maker lives: then it is another test's."""
    words = name.split("-")
    return len(words) > 2 and Path(f"/proc/{words[2]}").exists()


def test_a_second_importer_drives_what_run_drives(
    exported: Exported, driven: np.ndarray
) -> None:
    """Bit for bit, in ecos, an importer in C++."""
    try:
        import ecospy  # noqa: PLC0415
    except (ImportError, OSError) as error:  # it wants libtbb.so.12
        pytest.skip(f"ecos: {error}")
    structure = ecospy.EcosSimulationStructure()
    structure.add_model("cell", str(exported.file))
    simulation = ecospy.EcosSimulation(1e-3, structure=structure)
    simulation.init()
    seen = []
    for _ in range(STEPS):
        simulation.step(1)
        seen.append(simulation.get_real("cell::X.position"))
    simulation.terminate()
    assert seen == driven.tolist()


def test_an_interpreter_that_is_not_there_is_named(exported: Exported) -> None:
    """The cure is told."""
    environment = os.environ | {"HLI_COSIM_PYTHON": "/nowhere/python"}
    process = importer(exported, "run", env=environment)
    out, _ = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "/nowhere/python cannot be started: set HLI_COSIM_PYTHON" in out


def test_a_wrong_program_is_refused_at_the_export(tmp_path: Path) -> None:
    """With its line; no file is written."""
    (tmp_path / "part.nc").write_text("G1 X1\n")
    with pytest.raises(CncError, match=r"part.nc:1"):
        export_fmu(tmp_path / "part.nc", tmp_path / "a.fmu")
    assert not list(tmp_path.glob("*.fmu*"))
