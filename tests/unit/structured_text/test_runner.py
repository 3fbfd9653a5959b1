"""ST programs in the scan runtime: fixture, symbols, twins, retained variables, cache."""

from __future__ import annotations

from pathlib import Path

import pytest

from cnc_core.pytest_plugin import PlcFactory
from hli.symbol import SymbolError
from plc_client.mock import arc, line
from plc_client.st import build, sources_of, testing
from plc_client.st.build import check
from plc_client.st.machine.loader import StProgram
from plc_client.task import PlcError

EXAMPLES = Path(__file__).parents[3] / "examples"
LOGIC = """VAR_GLOBAL nShared : INT; END_VAR
VAR_GLOBAL RETAIN nKept : INT; END_VAR
PROGRAM MAIN
VAR bOpen : BOOL; nScans : UDINT; fb : TON; END_VAR
nScans := nScans + 1;
nShared := nShared + 2;
nKept := nKept + 1;
fb(IN := bOpen, PT := T#3ms);
END_PROGRAM
"""
TESTS = """FUNCTION_BLOCK FB_Sums EXTENDS FB_TestSuite
METHOD Test_Good
TEST('good');
AssertEquals(Expected := 5, Actual := 2 + 3, Message := 'sum');
END_METHOD
METHOD Test_Bad
TEST('bad');
AssertEquals(Expected := 6, Actual := 2 + 3, Message := 'sum');
END_METHOD
END_FUNCTION_BLOCK
"""


@pytest.fixture
def logic(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A program with a retain file of its own."""
    monkeypatch.setenv("HLI_COSIM_RETAIN", str(tmp_path / "kept.json"))
    path = tmp_path / "logic.st"
    path.write_text(LOGIC)
    return path


def test_fixture_reads_and_writes_variables(
    plc: PlcFactory, logic: Path
) -> None:
    """Variables are attributes; a timer runs on the cell's clock."""
    runner = plc(logic, script=[line(30)])
    runner.step(2)
    runner["MAIN"].bOpen = True
    runner.step(4)
    assert runner["MAIN"].fb.Q
    assert runner["MAIN"].nScans == 6
    assert runner["logic"].nShared == 12


def test_symbols_are_watched_and_forced_by_their_paths(
    plc: PlcFactory, logic: Path
) -> None:
    """A forced variable keeps its value; globals go by the list's name."""
    runner = plc(logic, script=[line(30)])
    runner.force("MAIN.bopen", True)
    runner.watch("MAIN.nScans", "logic.nShared")
    runner.step(5)
    assert runner.symbol("MAIN.fb.Q").value is True
    assert list(runner.trace()["logic.nShared"]) == [2, 4, 6, 8, 10]


def test_a_symbol_without_its_task_is_told_with_it(
    plc: PlcFactory, tmp_path: Path
) -> None:
    """The task that has the variable; lists of the library are not named."""
    path = tmp_path / "logic.st"
    path.write_text(
        "PROGRAM MAIN\nVAR n : INT; o : Override; END_VAR\nEND_PROGRAM\n"
    )
    runner = plc(path, script=[line(30)])
    with pytest.raises(SymbolError, match=r"did you mean MAIN\.n\?"):
        runner.symbol("n")
    with pytest.raises(SymbolError, match=r"; tasks: MAIN$"):
        runner.symbol("other")


def test_retained_variables_outlive_a_restart(
    plc: PlcFactory, logic: Path
) -> None:
    """RETAIN goes on after a restart, all else begins anew."""
    runner = plc(logic, script=[line(30)])
    runner.step(3)
    runner.restart()
    runner.step(1)
    assert runner["logic"].nKept == 4
    assert runner["MAIN"].nScans == 1


def test_example_behaves_as_its_python_twin(plc: PlcFactory) -> None:
    """The override command is the same in every scan."""
    command = "gpCh[0]^.bahn_mc_control.override.command_w"
    traces = []
    for suffix in (".py", ".st"):
        path = EXAMPLES / f"override_from_contour{suffix}"
        runner = plc(path, script=[line(20), arc(3, 2.0), line(20)])
        runner.watch(command)
        runner.run_to_end()
        traces.append(list(runner.trace()[command]))
        runner.close()
    assert traces[0] == traces[1]
    assert {600.0, 1000.0} <= set(traces[0])


def test_wrong_program_is_refused_with_its_place(
    plc: PlcFactory, tmp_path: Path
) -> None:
    """The error names file, line and column."""
    path = tmp_path / "bad.st"
    path.write_text("PROGRAM MAIN\nx := 1;\nEND_PROGRAM\n")
    with pytest.raises(PlcError, match=r"bad\.st:2:1: 952001: name x"):
        plc(path, script=[line(30)])


def test_an_edit_compiles_what_changed(tmp_path: Path) -> None:
    """The second build compiles one object, the third none."""
    path = tmp_path / "edit.st"
    path.write_text(LOGIC)
    build(sources_of([path]))
    path.write_text(LOGIC.replace("+ 2", "+ 3"))
    assert build(sources_of([path])).compiled <= 1
    assert build(sources_of([path])).compiled == 0


def test_two_programs_of_one_text_share_nothing() -> None:
    """Each instance has its own memory."""
    built = build({"logic.st": LOGIC})
    first, second = StProgram(built), StProgram(built)
    first.start()
    second.start()
    first.run(first.entry("MAIN"), 0)
    assert first["MAIN"].nScans == 1
    assert second["MAIN"].nScans == 0


@pytest.mark.ci
def test_assertions_of_st_tests_tell_their_line(tmp_path: Path) -> None:
    """One method passes, the other one fails with line and values."""
    path = tmp_path / "test_sums.st"
    path.write_text(TESTS)
    assert [row[1] for row in testing.tests_of(path)] == [
        "Test_Good",
        "Test_Bad",
    ]
    testing.run_test(path, "FB_Sums", "Test_Good")
    with pytest.raises(
        testing.StTestFailedError, match=r":8: .*expected 6, found 5"
    ):
        testing.run_test(path, "FB_Sums", "Test_Bad")


def test_types_of_the_hli_export_are_taken(tmp_path: Path) -> None:
    """A project that holds the files of ``types --twincat`` compiles."""
    from hli.export import twincat_files  # noqa: PLC0415

    for name, content in twincat_files().items():
        (tmp_path / name).write_text(content)
    text = "PROGRAM MAIN\nVAR x : LREAL; END_VAR\n"
    text += "x := gpCh[0]^.bahn_state.dist_prog_start;\nEND_PROGRAM\n"
    (tmp_path / "main.st").write_text(text)
    assert not check(sources_of([tmp_path])).log.errors


@pytest.mark.parametrize(
    "content",
    ['{"MAIN.n": ["DINT", "8902', "[]", '{"a": 5}', '{"a": ["DINT", "zz"]}'],
)
def test_a_file_without_retained_values_is_kept_aside(
    plc: PlcFactory,
    logic: Path,
    content: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """The program starts with its initial values and says why."""
    kept = logic.parent / "kept.json"
    kept.write_text(content)
    runner = plc(logic, script=[line(30)])
    runner.step(3)
    assert runner["logic"].nKept == 3
    assert "kept.json: no retained values in it" in capfd.readouterr().err
    assert (logic.parent / "kept.unreadable").read_text() == content


def test_a_retain_file_that_cannot_be_written_is_told(
    plc: PlcFactory,
    logic: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """Its folder is a file."""
    monkeypatch.setenv("HLI_COSIM_RETAIN", str(logic / "kept.json"))
    runner = plc(logic, script=[line(30)])
    runner.step(3)
    runner.restart()
    runner.step(1)
    assert "the values are lost" in capfd.readouterr().err
