"""The iso front end: text, messages, end of program, order of execution, modal
state, extensions.
"""

import math

import numpy as np
import pytest

from cnc_core.blocks import (
    COMPENSATION,
    DWELL,
    EXACT_STOP,
    LINEAR,
    STANDSTILL,
    M,
    S,
    T,
)
from cnc_core.config import CellConfig
from cnc_core.errors import CncError
from cnc_core.frontend import create, detect
from cnc_core.frontend.iso import IsoFrontEnd
from cnc_core.frontend.machine import ProgramMachine, Tool
from cnc_core.frontend.offline import read_all
from cnc_core.frontend.port import OfflinePort
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.programs import error_of

MACHINE = ProgramMachine(
    axes=("X", "Y", "Z", "A"),
    rotary=(False, False, False, True),
    main=(0, 1, 2),
    start=np.array([1.0, 2.0, 3.0, 0.0]),
    tools={1: Tool(5.0, 20.0)},
    m_functions={10: "MOS"},
)


@pytest.fixture
def read(tmp_path):
    """Function from program text to (rows, front end)."""

    def run(text, **options):
        path = tmp_path / "program.ngc"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        reader = IsoFrontEnd(
            path,
            MACHINE,
            OfflinePort(MACHINE.start, options.pop("switches", 0)),
            **options,
        )
        batches = [batch.rows for batch in read_all(reader, 7)]
        return (np.concatenate(batches) if batches else np.empty(0)), reader

    return run


@pytest.mark.parametrize("scan", [True, False])
@pytest.mark.parametrize(
    "line",
    ["G1 X12.5 Y-3 F60", "g1x12.5y-3f60", "G 0 1 X 1 2 . 5 Y - 3 F 6 0",
     "n5 G1.0 (a) X12.5 (b) Y-3. F60 ; c", "/ G1 X+12.5 Y-3F60"],
)  # fmt: skip
def test_spellings_of_one_line(read, line, scan):
    """Case, blanks anywhere, comments, decimals in G, a closed block delete
    switch do not matter.
    """
    rows, _ = read("G0 X1\n" + line, scan=scan)
    assert rows["end"][0][:2].tolist() == [12.5, -3.0]
    assert rows["feed"][0] == 1.0


def test_block_delete(read):
    """`/` lines are skipped while their switch is on; without a number it is switch 1."""
    assert len(read("G0 X9\n/X8\n/2 X7\n")[0]) == 3
    assert len(read("G0 X9\n/X8\n/2 X7\n", switches=0b01)[0]) == 2
    assert len(read("G0 X9\n/X8\n/2 X7\n", switches=0b11)[0]) == 1


def test_columns_count_in_the_line_of_the_file(read):
    """Blanks and comments are part of the line that the user sees."""
    error = error_of(read, "G0 X5\n  G1 (feed) F 1 0  Q 5\n")
    assert (error.code, error.place.line, error.place.column) == (908001, 2, 20)
    assert error.place.source.endswith("Q 5")


def test_messages(read):
    """MSG as it stands, PRINT and DEBUG with values; other comments say nothing."""
    _, reader = read(
        "#1=2.5 #<a b>=3\n(msg, Hi #1)\n(PRINT,#1 and #<a b>)\n"
        "(debug, x)\n(x, y)\n; (MSG, no)\nG0 X5 (MSG,m)"
    )
    assert reader._port.messages == ["Hi #1", "2.500000 and 3.000000", "x", "m"]


def test_percent_delimits(read):
    """What follows the closing % is not read; it may follow without an opening one."""
    assert len(read("\n(head)\n%\nG0 X5\n%\nnonsense\n")[0]) == 1
    assert len(read("G0 X5\n%\nnonsense\n")[0]) == 1


def test_program_ends(read):
    """M2 and M30 end the program behind the motion of their line."""
    for end in ("M2", "M30"):
        rows, _ = read(f"G0 X5 {end}\nnonsense")
        assert rows["type"].tolist() == [LINEAR, M]
        assert rows["flags"][1] == STANDSTILL


def test_backslash_joins_nothing(read):
    r"""A line that ends with \ ends there."""
    assert len(read("G0 X5 ; C:\\dir\\\nX6\n")[0]) == 2


def test_order_of_execution(read):
    """Feed, speed, tool, spindle, coolant, dwell, compensation, motion, stop:
    whatever the order in the text.
    """
    rows, _ = read("M1 X9 G1 G41 D1 G4 P2 M8 M3 M6 T1 S500 F60 M10")
    assert rows["type"].tolist() == [
        S,
        T,
        M,
        M,
        M,
        M,
        DWELL,
        COMPENSATION,
        LINEAR,
        M,
    ]
    assert rows["code"][rows["type"] == M].tolist() == [6, 3, 8, 10, 1]
    assert rows["feed"][-2] == 1.0


def test_feed_counts_in_the_unit_before_the_change(read):
    """F is taken before G20 and G21 of its line."""
    assert read("G20 F60 G1 X0")[0]["feed"][0] == 1.0
    assert read("G20\nF60 G1 X0")[0]["feed"][0] == pytest.approx(25.4)


def test_exact_stop(read):
    """G61 and G61.1 stop at every end, G64 ends that."""
    rows, _ = read("G61 G0 X5\nX6\nG64 P0.1 X7\nG61.1\nX8")
    rows = rows[rows["type"] == LINEAR]
    assert (rows["flags"] & EXACT_STOP > 0).tolist() == [
        True,
        True,
        False,
        True,
    ]


def test_inverse_time(read):
    """G93: F is one over minutes, for each motion anew; afterwards F has to be given again."""
    rows, _ = read("G93 G1 X31 F2\nG0 X0\nG1 X10 F1\n")
    assert rows["feed"].tolist() == [30.0 / 30.0, 0.0, 10.0 / 60.0]
    assert error_of(read, "G93 G1 X9 F2\nX8").code == 900006
    assert error_of(read, "F9 G93 G1 X9 F2\nG94 X8").code == 900005
    assert error_of(read, "G93 G1 X9 F2\nG94 X8").code == 900006


def test_compensation_takes_the_tool(read):
    """D names the tool, without it the one in the spindle counts; corners are
    arcs; the stage gets radius and side.
    """
    for word in ("T1 M6 G42", "G42 D1"):
        rows, _ = read(f"{word}\nG0 X5\nG40 X6")
        assert rows[rows["type"] == COMPENSATION]["code"].tolist() == [42, 40]
        assert rows[rows["type"] == COMPENSATION]["value"][0] == 5.0
        assert rows[rows["type"] == COMPENSATION]["degree"][0] == 26


def test_nothing_in_the_way_of_compensation(read):
    """Change of plane, cycles and G28 while it is active are refused."""
    for line, code in (
        ("G18", 20133),
        ("F9 G81 X1 Z-5 R4", 906003),
        ("G28", 906003),
    ):
        assert error_of(read, f"G41 D1\nG0 X5\n{line}").code == code


def test_tool_length_acts_on_coordinates_alone(read):
    """G43 moves nothing; the same coordinate then lies higher, in any plane on Z."""
    rows, _ = read("G0 Z5\nG18 G43 H1\nZ5\nY5\nG49 Z5")
    assert rows["end"][:, 2].tolist() == [5.0, 25.0, 25.0, 5.0]


def test_machine_without_tools(tmp_path):
    """Without any tool G43 H takes length 0 and says so; with tools an unknown one is an error."""
    path = tmp_path / "p.ngc"
    path.write_text("G0 G43 H4 Z5")
    port = OfflinePort(np.zeros(3))
    reader = create(
        "iso",
        path,
        ProgramMachine(("X", "Y", "Z"), (False,) * 3, (0, 1, 2), np.zeros(3)),
        port,
    )
    assert next(iter(read_all(reader))).rows["end"][0][2] == 5.0
    assert [w.code for w in reader.warnings] == [908006]
    assert "length of tool 4 is taken as 0" in port.messages[0]


def test_home_is_the_start(read):
    """G28 goes by the programmed point to the machine's start, of the named axes or of all."""
    rows, _ = read("G0 X9 Y9 Z9\nG28 Z20\nG28\nX5\n")
    assert rows["end"][:, :3].tolist() == [
        [9, 9, 9],
        [9, 9, 20],
        [9, 9, 3],
        [1, 2, 3],
        [5, 2, 3],
    ]


def test_parameters_set_behind_the_line(read):
    """An assignment acts from the next line on; a failed line assigns nothing."""
    rows, _ = read("G0 #1=5 X#1\nX#1\n#1=7 X\nX[#1+1]", collect=True)
    assert rows["end"][:, 0].tolist() == [0.0, 5.0, 6.0]


def test_retract_levels(read):
    """G98 goes back to the level before the series of cycles, G99 to R; the
    series ends with another motion.
    """
    rows, _ = read(
        "F60 G0 Z30\nG99 G81 X5 Z-1 R2\nG98 X6\nG80\nG0 Z10\nG81 X7 Z-1 R2\n"
    )
    ends = {
        line: rows[rows["line"] == line]["end"][-1][2] for line in (2, 3, 6)
    }
    assert ends == {2: 2.0, 3: 30.0, 6: 10.0}


def test_sticky_words_end_with_their_cycle(read):
    """Another cycle needs its own R and Z."""
    assert error_of(read, "F60 G81 X5 Z-1 R2\nG82 X6 P1").code == 908004


def test_deep_nesting(read):
    """Brackets and parameters may stand in each other within bounds."""
    assert error_of(read, "G0 X" + "[" * 2000).code == 20927
    assert error_of(read, "G0 X" + "#" * 2000 + "1").code == 20927
    assert error_of(read, "G0 X" + "#[" * 2000 + "1").code == 20927
    assert error_of(read, "G0 X1" + " " * 5000 + "Y").code == 20301


def test_extensions(tmp_path):
    """CAM extensions stand for this dialect, .nc does not."""
    assert {
        detect(tmp_path / f"a{e}")
        for e in (".ngc", ".TAP", ".iso", ".gcode", ".cnc")
    } == {"iso"}
    assert detect(tmp_path / "a.nc") == "isg"


def test_the_tolerance_of_g64_is_used(tmp_path):
    """G64 P: the path may leave the contour by P, in the unit of the program;
    G61 and G64 without P end it.
    """
    wave = "".join(
        f"X{0.1 * i:.2f} Y{round(3 * math.sin(i / 20), 3)}\n"
        for i in range(200)
    )
    text = f"G21 G90 G64 P0.02\nG1 F3000 X0 Y0\n{wave}G61\nX0 Y0\nG20 G64 P0.001\nG64\nX1\nM2\n"
    path = tmp_path / "part.ngc"
    path.write_text(text)
    smooth = plan_program(Program(path, CellConfig(), "iso"))
    path.write_text(text.replace("P0.02", ""))
    exact = plan_program(Program(path, CellConfig(), "iso"))
    assert exact.path_deviation_mm <= 1e-9
    assert 1e-4 < smooth.path_deviation_mm <= 0.02
    assert smooth.motion_time_s < 0.5 * exact.motion_time_s
    path.write_text("G64 P-1\nM2\n")
    with pytest.raises(CncError, match="negative"):
        list(Program(path, CellConfig(), "iso").batches())
