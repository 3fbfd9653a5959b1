"""The ISG front end: resumable reading, waits, errors, files."""

import numpy as np
import pytest

from cnc_core.blocks import (
    EXACT_STOP,
    FLUSH,
    HAS_VALUE,
    LINEAR,
    MARKER,
    RAPID,
    STANDSTILL,
    WAIT,
    M,
)
from cnc_core.errors import CncError
from cnc_core.frontend import create, detect
from cnc_core.frontend.base.source import Source
from cnc_core.frontend.isg import IsgFrontEnd
from cnc_core.frontend.machine import ProgramMachine, Tool
from cnc_core.frontend.port import OfflinePort, Wait
from support.programs import error_of, rows_of

MACHINE = ProgramMachine(
    axes=("X", "Y", "Z", "X1", "XR"),
    rotary=(False, False, False, False, True),
    main=(0, 1, 2),
    start=np.zeros(5),
    tools={1: Tool(5.0, 20.0)},
    m_functions={3: "MOS", 52: "MOS"},
)


@pytest.fixture
def front_end(tmp_path):
    """Function from program text (or bytes) to a front end, closed behind the test."""
    made = []

    def make(text, **options):
        path = tmp_path / "program.nc"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        made.append(
            IsgFrontEnd(path, MACHINE, OfflinePort(MACHINE.start), **options)
        )
        return made[-1]

    yield make
    for reader in made:
        reader.close()


def test_batches_of_any_size_give_the_same_rows(front_end):
    """Reading one row at a time loses and repeats nothing."""
    text = "G01 F600 X1\nM3 S5 X2 M00\n#FLUSH WAIT\nX3\nX4\nM30\n"
    whole = rows_of(front_end(text))
    assert (rows_of(front_end(text), size=1) == whole).all()
    assert len(whole) == 9


def test_wait_comes_behind_its_rows(front_end):
    """#FLUSH WAIT hands out its row, then waits, then reading goes on."""
    reader = front_end("G00 X1\n#FLUSH WAIT\nX2\n")
    first = reader.read(10)
    assert first.rows["type"].tolist() == [LINEAR, FLUSH]
    assert first.rows["flags"].tolist() == [RAPID, STANDSTILL | WAIT]
    assert reader.read(10) is Wait.DRAINED
    assert len(reader.read(10)) == 1
    assert reader.read(10) is None
    assert reader.read(10) is None


def test_log_clear_waits_before_its_row(front_end):
    """LOG CLEAR drains the channel first."""
    reader = front_end("G00 X1\n#CONTOUR LOOKAHEAD LOG CLEAR\n")
    assert len(reader.read(10)) == 1
    assert reader.read(10) is Wait.DRAINED
    assert reader.read(10).rows["type"].tolist() == [MARKER]


@pytest.mark.parametrize("scan", [True, False])
def test_error_comes_behind_the_rows_before_it(front_end, scan):
    """Rows of earlier blocks are handed out, then the error is raised, again and again."""
    reader = front_end("G00 X1\nX2\nG02 X9\nX3\n", scan=scan)
    assert len(reader.read(10)) == 2
    for _ in range(2):
        with pytest.raises(CncError, match="900006"):
            reader.read(10)
    assert str(reader.errors[0]).splitlines()[1].strip() == "G02 X9"


def test_collecting_reports_all_errors(front_end):
    """With collect every wrong block is reported once and skipped."""
    reader = front_end("G00 X1 Q5\nM77\nX2\n#NOPE\n", collect=True)
    assert rows_of(reader)["end"][:, 0].tolist() == [2.0]
    assert [(e.place.line, e.place.column, e.code) for e in reader.errors] == [
        (1, 8, 900001),
        (2, 1, 900009),
        (4, 2, 900002),
    ]


def test_error_in_continuation_names_its_physical_line(front_end):
    """An error behind a line break points at the line the user sees."""
    error = error_of(rows_of, front_end("G00 X1 \\\n  Y[2 + \\\n  QQ]\n"))
    assert (error.place.line, error.place.column, error.place.source) == (
        3,
        3,
        "  QQ]",
    )


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [
        ("CONTOUR LOOKAHED LOG ON", "CONTOUR LOOKAHEAD"),
        ("CONTUR MODE ON", "CONTOUR MODE ON"),
        ("HSK OFF", "HSC OFF"),
    ],
)
def test_a_slip_in_a_command_is_told_with_what_was_meant(
    front_end, wrong, meant
):
    """It is unknown, not a function that the manual has and this does not."""
    said = f"unknown command #{wrong}; did you mean #{meant}?"
    error = error_of(rows_of, front_end(f"#{wrong}\n"))
    assert (error.code, error.text) == (900002, said)


def test_a_command_that_is_refused_is_no_slip(front_end):
    """Its name is known: 900003."""
    assert error_of(rows_of, front_end("#CYL FOO\n")).code == 900003


def test_program_lines(front_end):
    """%NAME opens the main program; a later % line ends it, with a warning
    unless it is a local subprogram.
    """
    reader = front_end("; head\n%MAIN\nG00 X1\n%OTHER\nX2\n")
    assert len(rows_of(reader)) == 1
    assert reader.program_name == "MAIN"
    assert reader.block_count == 4
    assert [w.code for w in reader.warnings] == [900020]
    reader = front_end("%L SUB\nG00 X5\nM17\n%MAIN\nG00 X1\n%L BEHIND\nX3\n")
    assert rows_of(reader)["end"][:, 0].tolist() == [1.0]
    assert not reader.warnings
    assert error_of(rows_of, front_end("%L SUB\nM17\n")).code == 907033
    assert error_of(rows_of, front_end("G00 X1\n%MAIN\n")).code == 900017


@pytest.mark.parametrize("end", ["M02", "M30", "M17", "M29"])
def test_program_end(front_end, end):
    """Nothing behind the program end is read; the motion of its block is driven first."""
    rows = rows_of(front_end(f"G00 X1 {end}\nX2\n"))
    assert rows["type"].tolist() == (
        [LINEAR, M] if end in ("M02", "M30") else [LINEAR]
    )


def test_functions_and_values(front_end):
    """M52=-345 carries a value; M00 stands behind the motion of its block, others before it."""
    rows = rows_of(front_end("G00 M00 M52=-345 X1\n"))
    assert rows["type"].tolist() == [M, LINEAR, M]
    assert rows["code"].tolist() == [52, 0, 0]
    assert rows["value"][0] == -345.0
    assert rows["flags"].tolist() == [HAS_VALUE, RAPID, STANDSTILL]


def test_axis_names_of_several_letters(front_end):
    """The longest name wins and needs `=`."""
    rows = rows_of(front_end("G00 X1=10 XR=180 X=5\nX1\n"))
    assert rows["end"][0][:5].tolist() == [5.0, 0.0, 0.0, 10.0, 180.0]
    assert rows["end"][1][0] == 1.0


def test_exact_stop(front_end):
    """G60 stops at the end of its block, G360 at every one, G359 ends that;
    plain lines follow too.
    """
    rows = rows_of(front_end("G00 G60 X1\nX2\nG360\nX3\nG359 X4\n"))
    assert (rows["flags"] & EXACT_STOP != 0).tolist() == [
        True,
        False,
        True,
        False,
    ]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2+3*4", 14),
        ("[2+3]*4", 20),
        ("-2**2", 4),
        ("2**3**2", 64),
        ("11 MOD 3", 2),
        ("7-2-1", 4),
        ("SIN[90]", 1),
        ("COS[180]", -1),
        ("TAN[45]", 1),
        ("ATAN2[1,-1]", 135),
        ("SQRT[SQR[3]+16]", 5),
        ("INT[-2.7]", -2),
        ("FRACT[2.5]", 0.5),
        ("ROUND[2.5]", 3),
        ("CEIL[2.1]", 3),
        ("FLOOR[-2.1]", -3),
        ("6&3", 2),
        ("6|3", 7),
        ("6^3", 5),
        ("1<2", 1),
        ("1==2||1", 1),
        ("1 XOR 1", 0),
        ("NOT[0]", 1),
        ("INV[0]", -1),
        ("DEXP[2]", 100),
        ("LOG[1000]", 3),
        ("LN[EXP[2]]", 2),
        ("ABS[-3]", 3),
        ("PI", 3.141592653589793),
        ("ACOT[1]", 45),
        ("+5 - -3", 8),
        ("TRUE+1", 2),
        ("MAX[1,2]", 2),
        ("1-2>0", 0),
    ],
)
def test_expressions(front_end, text, value):
    """Operators, precedence and functions, angles in degrees."""
    reader = front_end(f"G00 X[{text}]\nY {text}\nZ=1")
    rows = rows_of(reader)
    assert reader.modal.position[0] == pytest.approx(value, abs=1e-12)
    assert reader.modal.position[1] == pytest.approx(value, abs=1e-12)
    assert len(rows)


def test_deep_brackets_are_refused(front_end):
    """Nesting is bounded."""
    assert error_of(rows_of, front_end("X" + "[" * 2000)).code == 20927


def test_block_too_long(front_end):
    """Over 4096 characters, in one line or in several, is error 20301; the
    block is skipped as a whole.
    """
    text = "G00 X1 ;" + "x" * 70000 + "\nX2 \\\n" + ("; \\\n" * 2000) + "\nX3\n"
    reader = front_end(text, collect=True)
    assert rows_of(reader)["end"][:, 0].tolist() == [3.0]
    assert (reader.errors[0].code, reader.errors[0].place.line) == (20301, 1)
    assert {e.code for e in reader.errors} == {20301}
    assert reader.block_count == text.count("\n")


def test_small_chunks_change_nothing(front_end, tmp_path):
    """Lines that lie across chunks of the file are read whole."""
    text = "\ufeffG01 F600 X1.25 ; \xe4\r\nM3\r\nX2 \\\r\nY3\r\n\r\nX4"
    whole = rows_of(front_end(text))
    for chunk in (1, 3, 7):
        reader = front_end(text)
        reader.close()
        reader._source = Source(tmp_path / "program.nc", chunk)
        assert (rows_of(reader) == whole).all()
    assert len(whole) == 4


def test_latin_1_comment(front_end):
    """Bytes that are not UTF-8 do no harm."""
    assert len(rows_of(front_end(b"G00 X1 (\xe4\xff)\nM3 ;\xe4\n"))) == 2


def test_files(tmp_path):
    """Missing and unreadable files, dialects that do not exist yet, detection by extension."""
    port = OfflinePort(MACHINE.start)
    for path, dialect, code in [
        (tmp_path / "none.nc", "isg", 901001),
        (tmp_path, "isg", 901002),
        (tmp_path / "a.nc", "fanuc", 901003),
    ]:
        with pytest.raises(CncError) as caught:
            create(dialect, path, MACHINE, port)
        assert caught.value.code == code
    assert detect(tmp_path / "A.NC") == "isg"
    assert detect(tmp_path / "a.txt") == "isg"
