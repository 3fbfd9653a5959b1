"""What goes into an FMU and what comes out of it: M functions, external
variables, symbols of the PLC, the program, limits.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from cnc_core.errors import CncError
from cnc_core.fmu import export_fmu

pytest.importorskip("fmpy")
from fmpy.fmi1 import FMICallException

from support.fmu.driving import driven

CELL = """
[axes.X]
[axes.Y]
[axes.Z]
[channel]
m_synch = {"8" = "MVS_SVS", "9" = "MOS", "30" = "MNS_SNS"}
[external.GO]
type = "SGN32"
[external.LEVEL]
size = 2
"""
PART = """G1 F6000 X0.5
M8
M9
$IF V.E.GO == 7
G1 X1.5
$ENDIF
G1 Y0.5
M30
"""
PLC = """
from plc_client import AcknowledgeAll, task

@task(interval=0.001)
class Logic:
    gain: float = 1.5
    steps: int = 3
    allowed: bool = True
    name: str = "drill"

    def setup(self, hli):
        self.functions = AcknowledgeAll(hli)
        self.seen = 0.0

    def cyclic(self):
        self.functions()
        self.seen = self.gain * self.steps if self.allowed else -1.0
"""
ST = """
PROGRAM Main
VAR
    gain : REAL := 1.5;
    steps : DINT := 3;
    allowed : BOOL := TRUE;
    seen : LREAL;
END_VAR
seen := SEL(allowed, -1.0, gain * steps);
END_PROGRAM
"""


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("variables")
    (folder / "part.nc").write_text(PART)
    (folder / "plc.py").write_text(PLC)
    (folder / "cell.toml").write_text(CELL)
    return export_fmu(
        folder / "part.nc",
        folder / "cell.fmu",
        config=folder / "cell.toml",
        plc=folder / "plc.py",
        input_symbols=["Logic.gain", "Logic.steps", "Logic.allowed"],
        output_symbols=["Logic.seen", "V.E.GO", "gpCh[0].bahn_state.tool_nr_r"],
    )


@pytest.mark.ci
def test_what_does_not_fit_is_refused_and_breaks_nothing(
    exported: Path, tmp_path: Path
) -> None:
    """An override that is no number, a step that is no multiple of the cycle;
    then the cell goes on.
    """
    with driven(exported, tmp_path) as one:
        one.begin().step()
        one["override"] = float("nan")
        with pytest.raises(FMICallException):
            one.step()
        assert "override nan: 0 to 200 is allowed" in one.said[-1]
        one["override"] = 50.0
        with pytest.raises(FMICallException):
            one.slave.doStep(0.0, 1.5e-3)
        assert "no multiple of the cell's cycle" in one.said[-1]
        one.step(3)
        assert one["override_now"] == 50.0


def to_end(one, steps: int = 2000) -> None:
    for _ in range(steps):
        one.step()
        if one["program_end"]:
            return
    raise AssertionError("the program has not ended")


@pytest.mark.ci
def test_functions_variables_and_symbols(
    exported: Path, tmp_path: Path
) -> None:
    """M functions come out in order, V.E decides in the program, symbols of the
    PLC go both ways with the type that they have.
    """
    with driven(exported, tmp_path) as one:
        one["V.E.LEVEL[1]"] = 2.5
        one.begin()
        assert one["m_functions"] == 0
        assert one["m0"] == -1
        one.step()
        assert one["Logic.seen"] == 4.5
        one["Logic.steps"] = 4
        one["V.E.GO"] = 7
        one.step()
        assert one["Logic.seen"] == 6.0
        assert one["V.E.GO.now"] == 7
        one["Logic.allowed"] = False
        one.step()
        assert one["Logic.seen"] == -1.0
        to_end(one)
        assert [one["m0"], one["m1"], one["m2"]] == [30, 9, 8]
        assert one["m_functions"] == 3
        assert one["X.position"] == 1.5


@pytest.mark.ci
def test_a_structured_text_plc_has_symbols_both_ways(tmp_path: Path) -> None:
    """REAL, DINT and BOOL go in; what the program makes of them comes out."""
    (tmp_path / "part.nc").write_text("G1 F6000 X0.5\nM30\n")
    (tmp_path / "plc.st").write_text(ST)
    file = export_fmu(
        tmp_path / "part.nc",
        tmp_path / "cell.fmu",
        plc=tmp_path / "plc.st",
        input_symbols=["Main.gain", "Main.steps", "Main.allowed"],
        output_symbols=["Main.seen"],
    )
    with driven(file, tmp_path / "unpacked") as one:
        one.begin().step()
        assert one["Main.seen"] == 4.5
        one["Main.steps"] = 4
        one.step()
        assert one["Main.seen"] == 6.0
        one["Main.allowed"] = False
        one.step()
        assert one["Main.seen"] == -1.0


@pytest.mark.ci
def test_program_and_limits_are_parameters(
    exported: Path, tmp_path: Path
) -> None:
    """Another program runs, at the speed that the importer allows; behind the
    initialization both stand.
    """
    (tmp_path / "other.nc").write_text("G1 F6000 Y2\nM30\n")
    with driven(exported, tmp_path / "unpacked") as one:
        one["program"] = str(tmp_path / "other.nc")
        one["Y.v_max"] = 20.0
        assert one["program"] == str(tmp_path / "other.nc")
        one.begin()
        fastest = 0.0
        for _ in range(2000):
            one.step()
            fastest = max(fastest, one["speed"])
            if one["program_end"]:
                break
        assert one["Y.position"] == 2.0
        assert fastest == pytest.approx(20.0)
        with pytest.raises(FMICallException):
            one["Y.v_max"] = 30.0
        assert "a parameter is set before the initialization" in one.said[-1]


@pytest.mark.ci
@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("program", "nowhere.nc", "nowhere.nc: 901001: file not found"),
        ("X.v_max", -1.0, "X"),
    ],
)
def test_a_wrong_parameter_is_told(
    exported: Path, tmp_path: Path, name: str, value: object, said: str
) -> None:
    """The initialization fails, with the reason in the importer's log."""
    with driven(exported, tmp_path) as one:
        one[name] = value
        with pytest.raises(FMICallException):
            one.begin()
        assert said in one.said[-1]


@pytest.mark.ci
def test_an_error_of_the_program_is_told(
    exported: Path, tmp_path: Path
) -> None:
    """The step fails; the importer's logger has number, text and line."""
    (tmp_path / "wrong.nc").write_text("G1 F6000 X0.2\nG1 X[1/0]\nM30\n")
    with driven(exported, tmp_path / "unpacked") as one:
        one["program"] = str(tmp_path / "wrong.nc")
        with pytest.raises(FMICallException):
            one.begin().step(2000)
        assert "wrong.nc:2" in one.said[-1]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"output_symbols": ["Logic.name"]}, "'Logic.name' is no number"),
        ({"input_symbols": ["Logic.nothing"]}, "Logic.nothing"),
        ({"output_symbols": ["V.E.NO"]}, "V.E.GO, V.E.LEVEL"),
        ({"output_symbols": ["Logic.seen"] * 2}, "two variables 'Logic.seen'"),
    ],
)
def test_a_wrong_choice_is_refused_at_the_export(
    exported: Path, tmp_path: Path, given: dict[str, list[str]], said: str
) -> None:
    """With its name; no file is written."""
    folder = exported.parent
    with pytest.raises(CncError, match=said.replace("[", r"\[")):
        export_fmu(
            folder / "part.nc",
            tmp_path / "a.fmu",
            config=folder / "cell.toml",
            plc=folder / "plc.py",
            **given,
        )
    assert list(tmp_path.iterdir()) == []
