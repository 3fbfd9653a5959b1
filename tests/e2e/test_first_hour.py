"""What a new user meets in the first hour; each was a defect once."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core import Cell
from cnc_core.errors import CncError
from hli.symbol import SymbolError
from plc_client.task import PlcError, load_tasks, task
from support.command_line import Outcome, command

Cli = Callable[..., Outcome]
Write = Callable[..., Path]
PART = "N10 G1 X1 Y2 F1000\nN20 X3\nM30\n"


@pytest.mark.ci
def test_samples_are_what_their_name_says(cli: Cli, program: Write) -> None:
    """.csv holds the numbers of .npz, exactly; another name is refused."""
    path = program(PART)
    folder = path.parent
    for name in ("s.csv", "s.npz"):
        assert cli("plan", path, "--samples", folder / name).status == 0
    table = np.genfromtxt(folder / "s.csv", delimiter=",", names=True)
    assert table.dtype.names == ("t", "X", "Y", "Z", "s", "v", "block")
    with np.load(folder / "s.npz") as arrays:
        for i, axis in enumerate("XYZ"):
            assert (table[axis] == arrays["pos"][:, i]).all()
        for name in ("t", "s", "v", "block"):
            assert (table[name] == arrays[name]).all()
    refused = cli("plan", path, "--samples", folder / "s.txt")
    assert (refused.status, (folder / "s.txt").exists()) == (1, False)
    assert ".npz or .csv" in refused.err


@pytest.mark.ci
@pytest.mark.parametrize(("seconds", "most"), [(1, 2.0), (5, 7.0), (20, 23.0)])
def test_the_demo_takes_the_time_it_was_given(
    cli: Cli, seconds: int, most: float
) -> None:
    """About so many seconds of the cell's time; the log is closed."""
    result = cli("demo", "--seconds", seconds, "--json").json
    assert result["end"] == "completed"
    assert 0.7 * seconds < result["sim_time_s"] < most
    assert result["log_entries"] >= 3


def test_a_binary_file_is_one_error(cli: Cli, tmp_path: Path) -> None:
    """Not an error for each byte, for no command."""
    path = tmp_path / "part.nc"
    path.write_bytes(Path(sys.executable).read_bytes()[:100_000])
    for name in ("check", "blocks", "plan"):
        outcome = cli(name, path, "--dialect", "isg")
        assert outcome.status == 1
        assert (
            outcome.err
            == f"{path}:1:5: 901009: no text: byte 0x02 at offset 4\n"
        )


@pytest.mark.ci
def test_a_wrong_program_shows_twenty_errors(cli: Cli, program: Write) -> None:
    """And how many there are more; --all and --json tell all of them."""
    path = program("FOO\n" * 50 + "M30\n")
    few = cli("check", path)
    assert few.err.count("part.nc:") == 20
    assert few.err.endswith("and 30 more errors; --all shows them\n")
    assert cli("check", path, "--all").err.count("part.nc:") == 50
    assert len(cli("check", path, "--json").json["errors"]) == 50


def test_control_characters_are_shown_as_codes(
    cli: Cli, tmp_path: Path
) -> None:
    """A terminal does not obey a wrong program."""
    path = tmp_path / "part.nc"
    path.write_bytes(b"G1 X1 F1\n\x07\x0bfoo \xc2\x9b2J\nM30\n")
    said = cli("check", path).err
    assert r"\x07\x0bfoo \x9b2J" in said
    assert said.replace("\n", "").isprintable()


@pytest.mark.ci
def test_programs_with_a_number_are_read(cli: Cli, program: Write) -> None:
    """As a control of Fanuc's kind has them, by their content alone."""
    fanuc = "%\nO1001 (PART)\n(TOOL 3)\nG21 G90\nG0 X1 Y1\nG1 X9 F500\nM30\n%\n"
    outcome = cli("check", program(fanuc))
    assert outcome.status == 0
    assert "dialect: iso" in outcome.err
    assert cli("check", program("%\nO1001\nG1 X1 F9\n%\n")).status == 0
    later = "G0 X1\nO1001\nM30\n"
    second = "O1\nO2\nM30\n"
    for text, line in ((later, 2), (second, 2), ("O1 G0 X1\nM30\n", 1)):
        wrong = cli("check", program(text), "--dialect", "iso", "--json").json
        assert [e["line"] for e in wrong["errors"]] == [line]
        assert wrong["errors"][0]["code"] == 900003


SCRIPT = """
from __future__ import annotations
from cnc_core import Cell
from plc_client import Hli, task

with Cell() as cell:
    result = cell.run("part.nc")
end = result.end
LIMIT = 5

@task(interval=0.001)
class Below:
    def setup(self, hli: Hli) -> None:
        self.n = LIMIT
    def cyclic(self) -> None:
        self.n += 1
    def result(self) -> bool:
        return self.n > LIMIT

with Cell() as cell:
    print(end, cell.run("part.nc", Below).plc["result"])
"""


@pytest.mark.ci
def test_a_class_below_a_run_is_found(program: Write) -> None:
    """A script runs one cell, then defines a task and runs that."""
    program(PART)
    script = program(SCRIPT, "script.py")
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=script.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stdout, done.stderr) == ("completed True\n", "")


@pytest.mark.parametrize(
    ("method", "right"),
    [
        ("def setup(self): pass", "write def setup(self, hli): not def setup"),
        ("def setup(hli): pass", "write def setup(self, hli): not def setup"),
        ("def result(self, hli): pass", "write def result(self): not def"),
        ("def finished(): pass", "write def finished(self): not def finished"),
        ("def __init__(self, hli): pass", "write def setup(self, hli): not"),
    ],
)
def test_a_wrong_method_is_told_with_its_line(
    program: Write, method: str, right: str
) -> None:
    """The user's line, not one of the runtime."""
    path = program(
        "from plc_client import task\n@task(interval=0.001)\nclass A:\n"
        f"    def cyclic(self): pass\n    {method}\n",
        "plc.py",
    )
    with pytest.raises(PlcError) as error:
        load_tasks(str(path))
    assert str(error.value).startswith(f"{path}:5: TypeError: {right}")


@pytest.mark.parametrize(
    ("interval", "right"),
    [
        ("T#1ms", "write interval=0.001"),
        ("t#2.5s", "write interval=2.5"),
        ("1ms", "0.001 is a millisecond"),
        (None, "0.001 is a millisecond"),
    ],
)
def test_an_interval_is_a_number_of_seconds(interval: str, right: str) -> None:
    """A time of Structured Text is told as the number to write."""
    with pytest.raises(TypeError, match=right):
        task(interval=interval)  # type: ignore[call-overload]


@pytest.mark.parametrize(
    ("text", "right"),
    [
        ("feedhold.command_w=maybe", "is a BOOL; write TRUE or FALSE"),
        ("override.command_w=much", "is a number, 0 now; write a number"),
        ("override=500", "is no single value; name a member"),
    ],
)
def test_a_force_that_does_not_fit_says_what_fits(
    cli: Cli, program: Write, text: str, right: str
) -> None:
    """One line, without the value's Python."""
    outcome = cli(
        *("run", program(PART), "--force"), f"gpCh[0].bahn_mc_control.{text}"
    )
    assert outcome.status == 1
    last = outcome.err.splitlines()[-1]
    assert last.endswith(right)
    assert last.count("force ") == 1
    assert SymbolError.__name__ not in outcome.err


@pytest.mark.ci
def test_cnc_tells_errors_before_a_plc_comes(program: Write) -> None:
    """Not only when somebody has started a PLC."""
    path = program("N10 G1 X1 F9\nN20 FOO\nM30\n")
    name = f"first-hour-{path.parent.parent.name}"
    with subprocess.Popen(
        command("cnc", path, "--name", name),
        stderr=subprocess.PIPE,
        text=True,
    ) as cnc:
        assert cnc.stderr is not None
        assert "part.nc:2:5: 900004" in cnc.stderr.readline()
        assert "N20 FOO" in cnc.stderr.readline()
        assert "waiting for a PLC" in cnc.stderr.readline()
        cnc.terminate()


def test_a_missing_axis_is_one_error(cli: Cli, program: Write) -> None:
    """However often the program names it; the text says where to add it."""
    path = program("N10 G1 X1 W2 F900\nN20 W3\nN30 W4 A5\nM30\n")
    for dialect in ("isg", "iso"):
        wrong = cli("check", path, "--dialect", dialect, "--json").json
        told = [(e["line"], e["text"]) for e in wrong["errors"]]
        assert told[0][0] == 1
        assert "W is no axis of the cell; [axes]" in told[0][1]
        assert len([text for _, text in told if "W is no" in text]) == 1


@pytest.mark.parametrize(
    ("name", "right"),
    [
        ("plc.py", "--plc"),
        ("cell.toml", "--config"),
        ("run.npz", "hli-cosim inspect"),
    ],
)
def test_a_file_of_another_kind_names_its_option(
    cli: Cli, program: Write, name: str, right: str
) -> None:
    """One error, not one for each line that is no block."""
    outcome = cli("check", program("import this\n", name))
    assert outcome.status == 1
    (told,) = outcome.err.splitlines()
    assert f"{name}: 901010: no NC program but" in told
    assert right in told


LOOP = """from plc_client import task
@task(interval=0.001)
class Loop:
    def setup(self, hli):
        while True: pass
    def cyclic(self): pass
"""


@pytest.mark.ci
def test_a_setup_that_hangs_names_its_line(cli: Cli, program: Write) -> None:
    """While it hangs, and the time of --max-wall ends the run with its reason."""
    plc = program(LOOP, "plc.py")
    run = cli("run", program(PART), "--plc", plc, "--max-wall", 5)
    assert run.status == 1
    assert "plc.py:5: setup() of Loop has not returned for" in run.err
    assert "it is at: while True: pass" in run.err
    last = run.err.splitlines()[-1]
    assert last.startswith("905025: ")
    assert "--max-wall" in last
    assert "waits for a scan of the PLC" in last


ENDLESS = """PROGRAM MAIN
VAR i : INT := 1; END_VAR
WHILE i > 0 DO i := 1; END_WHILE
END_PROGRAM
"""


WARNED = [
    ("N10 #SET SPLINE ON\nN20 M30\n", "part.nc", "907040"),
    (
        "PROGRAM MAIN\nVAR i : INT; END_VAR\ni := 1;\n"
        "gpCh[0]^.bahn_mc_control.override.command_w := 0;\nEND_PROGRAM\n",
        "plc.st",
        "enable_w",
    ),
]


@pytest.mark.parametrize(("text", "name", "said"), WARNED)
def test_strict_makes_warnings_of_a_check_errors(
    cli: Cli, program: Write, text: str, name: str, said: str
) -> None:
    """The same words, another status."""
    path = program(text, name)
    for options, status in (((), 0), (("--strict",), 1)):
        outcome = cli("check", path, *options)
        assert said in outcome.err
        assert outcome.status == status


@pytest.mark.ci
def test_a_loop_of_structured_text_is_told_ahead_of_its_error(
    cli: Cli, program: Write
) -> None:
    """With its block; the error behind it has the line."""
    run = cli("run", program(PART), "--plc", program(ENDLESS, "plc.st"))
    assert run.status == 1
    told = "a loop in MAIN has not ended for 2 s"
    error = "plc.st:3:1: 905003: "
    assert told in run.err
    assert error in run.err
    assert run.err.index(told) < run.err.index(error)


@pytest.mark.ci
def test_a_plc_that_waits_for_its_cnc_says_so(program: Write) -> None:
    """Again and again, with the command that starts one."""
    plc = program(LOOP, "plc.py")
    name = f"first-hour-{plc.parent.name}"
    with subprocess.Popen(
        command("plc", plc, "--name", name), stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        assert name in process.stderr.readline()
        for _ in range(2):
            line = process.stderr.readline()
            assert line.startswith("waits for a CNC for")
            assert line.endswith(f"hli-cosim cnc FILE --name {name}\n")
        process.terminate()


WRONG_PLC = {
    "trap.st": (
        "PROGRAM Main\nVAR i : INT; z : INT; END_VAR\ni := i + 1;\n"
        "IF i > 3 THEN\n  z := i / z;\nEND_IF\nEND_PROGRAM\n",
        5,
        "division of 4 by zero",
    ),
    "no_hli.py": (
        "from plc_client import task\n\n@task()\nclass A:\n"
        "    def setup(self): pass\n    def cyclic(self): pass\n",
        5,
        "write def setup(self, hli)",
    ),
}


@pytest.mark.ci
@pytest.mark.parametrize("name", WRONG_PLC)
def test_an_error_of_the_plc_is_told_at_its_own_place(
    cli: Cli, program: Write, name: str
) -> None:
    """File and line of the user's text, not of what found it."""
    text, line, told = WRONG_PLC[name]
    path = program(PART)
    plc = path.parent / name
    plc.write_text(text)
    (error,) = cli("run", path, "--plc", plc, "--json").json["errors"]
    assert (error["file"], error["line"]) == (str(plc), line)
    assert told in error["text"]
    assert str(plc) not in error["text"]


def test_a_priority_is_a_whole_number() -> None:
    """A text was taken, and sorted as one."""
    with pytest.raises(TypeError, match="priority='high': a whole number"):
        task(interval=0.001, priority="high")  # type: ignore[call-overload]


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        ("run {folder}", 1, "a folder, no program"),
        ("run /dev/zero", 1, "/dev/zero is a device"),
        ("check {folder}", 2, "no Structured Text in this folder"),
        ("lookahead {part} --index 0 --at start", 0, "the log is empty"),
        ("fmu {part} -o {folder}/x.txt", 2, "must end in .fmu"),
    ],
)
def test_what_gave_an_empty_answer_is_told(
    cli: Cli, program: Write, words: str, status: int, said: str
) -> None:
    """No empty table, no file that nobody can open, no death of a process."""
    part = program(PART)
    folder = part.parent / "empty"
    folder.mkdir()
    outcome = cli(*words.format(part=part, folder=folder).split())
    assert (outcome.status, said in outcome.out + outcome.err) == (status, True)


def test_a_long_line_is_shown_around_its_error(
    cli: Cli, program: Write
) -> None:
    """The excerpt keeps to the terminal, and holds the wrong word."""
    line = f"N10 G1 X1 F1000 {'(comment) ' * 30}G999 {'(comment) ' * 30}"
    outcome = cli("check", program(f"{line}\nM30\n"), "--dialect", "isg")
    assert outcome.status == 1
    excerpt = outcome.err.splitlines()[-1]
    assert "G999" in excerpt
    assert len(excerpt) <= 80


def test_a_name_that_is_none_is_refused_at_once(
    cli: Cli, program: Write
) -> None:
    """Not behind a line that tells of waiting on it."""
    outcome = cli("cnc", program(PART), "--name", "bad/name")
    assert outcome.status == 1
    assert "waiting" not in outcome.err
    assert "905015" in outcome.err


@pytest.mark.parametrize(
    ("chosen", "said"),
    [
        ({"plcs": "x.py"}, "no argument 'plcs'; did you mean plc?"),
        ({"tolerance": "much"}, "tolerance 'much': a number of mm"),
        ({"max_time": "5 s"}, "max_time '5 s': a number of s"),
    ],
)
def test_a_wrong_argument_of_a_run_is_named(
    program: Write, chosen: dict[str, Any], said: str
) -> None:
    """It told of a class of ours, or of no name at all."""
    path = program(PART)
    with Cell() as cell, pytest.raises((TypeError, CncError), match=said) as e:
        cell.run(path, **chosen)
    assert "RunOptions" not in str(e.value)
