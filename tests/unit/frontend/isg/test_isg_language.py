"""The ISG language where a golden program cannot show it: lenient mode, skip
levels, external storage, tables, docs.
"""

import ctypes
import re

import numpy as np
import pytest

from cnc_core.blocks import LINEAR
from cnc_core.config import CellConfig, parse_config
from cnc_core.engine import external
from cnc_core.errors import CncError, ConfigError
from cnc_core.frontend.base.variables import Scope
from cnc_core.frontend.isg.commands.parser import table as command_table
from cnc_core.frontend.isg.language import gcodes
from cnc_core.frontend.machine import External
from cnc_core.process.live_port import LivePort
from cnc_core.program import Program
from support.isg_programs import MACHINE, Run


def test_lenient_turns_unknown_things_into_warnings(tmp_path):
    """Unknown # commands and undefined M functions are errors, in lenient mode
    warnings; not what is refused.
    """
    text = "#NONSENSE ON [A=1]\nM99 G00 X1\n#BCS ON [1,0,0,0,0,0]\nV.L.A=2\nX[V.L.A+P9]\n"
    strict, lenient = Run(text, tmp_path), Run(text, tmp_path, lenient=True)
    assert strict.codes == [900002, 900009, 900003, 907010, 907010]
    assert lenient.codes == [900003]
    assert lenient.warned == [907041, 907041]
    assert lenient.x() == [1.0, 2.0]


def test_lenient_takes_later_program_lines_as_comments(tmp_path):
    """Some posts write % lines as comments."""
    run = Run("%A\nG00 X1\n% tool change\nX2\n", tmp_path, lenient=True)
    assert (run.x(), run.codes, run.warned) == ([1.0, 2.0], [], [907040])


def test_program_takes_lenient(tmp_path):
    """``Program`` hands the option to the front end."""
    path = tmp_path / "a.nc"
    path.write_text("M99\n")
    for lenient, errors in ((False, 1), (True, 0)):
        program = Program(path, CellConfig(), collect=True, lenient=lenient)
        list(program.batches())
        assert len(program.errors) == errors


@pytest.mark.parametrize(
    ("mask", "x"),
    [(0, [1, 2, 3, 4]), (1, [1, 3]), (2, [1, 2, 4]), (0x3FF, [1])],
)
def test_skip_levels(tmp_path, mask, x):
    """Blocks of the levels that are on are not executed; / alone is level 1."""
    assert (
        Run("G00 X1\n/X2\n/2 N20 X3\n/1 X4\n", tmp_path, skip=mask).x()
        == x[: 2 if mask == 1 else None]
    )


def test_skipped_statements_open_nothing(tmp_path):
    """A skipped $IF is no $IF, also for searches."""
    text = "G00\n$IF 0\n/$IF 1\nX1\n$ENDIF\nX2\n"
    assert Run(text, tmp_path, skip=1).x() == [2.0]


def test_static_variables_survive(tmp_path):
    """V.S goes on in the next program, V.P does not."""
    static = Scope()
    Run("V.S.A=5 V.P.A=6\n", tmp_path, static=static)
    run = Run("G00 X[V.S.A] Y[EXIST[V.P.A]]\n", tmp_path, static=static)
    assert run.x() == [5.0]
    assert run.ends[0, 1] == 0.0


def test_m19_with_position(tmp_path):
    """S.POS is the additional value of M19."""
    rows = Run("M19 S.POS=90\nS[M3 REV1000 POS45 M19]\n", tmp_path).rows
    assert rows["code"].tolist() == [19, 0, 3, 19]
    assert rows["value"].tolist() == [90.0, 1000.0, 0.0, 45.0]


def test_mirroring_swaps_the_compensated_side(tmp_path):
    """With one axis mirrored, G41 works on the other side: the radius of the row is negative."""
    rows = Run(
        "D1 G21 G00 X0 Y0\nG41 G01 F100 X10\nX20\nG40 X30\n", tmp_path
    ).rows
    assert rows["value"][rows["type"] == 15].tolist()[0] == -5.0


def test_feed_of_circles_in_g194_takes_the_slower_axis(tmp_path):
    """A circle passes through every direction of its plane: the slower axis of it counts."""
    rows = Run("G194 F50 G01 X100\nG03 X0 I-50\nG01 Y1\n", tmp_path).rows
    assert rows["feed"].tolist() == [150.0, 100.0, 100.0]


@pytest.mark.parametrize("turn", ["#CS ON [0,0,0,0,0,{}]", "G68 R{} X0 Y0"])
@pytest.mark.parametrize(
    ("degrees", "feeds"),
    [
        # X is driven by Y alone, and the other way round
        (90, [100.0, 150.0]),
        # X is driven by both at once, X-Y by X alone
        (45, [100.0 * np.sqrt(2.0), 150.0]),
    ],
)
def test_feed_in_g194_is_that_of_the_axes_that_move(
    tmp_path, turn, degrees, feeds
):
    """In turned coordinates too: the share is of what the axes can do."""
    second = "Y1" if degrees == 90 else "X11 Y-1"
    text = f"{turn.format(degrees)}\nG194 F50 G01 X10\n{second}\n"
    rows = Run(text, tmp_path).rows
    moved = rows["feed"][rows["type"] == LINEAR]
    assert moved.tolist() == pytest.approx(feeds, rel=1e-9)


def test_live_files_stay_in_the_folder(tmp_path):
    """#MSG SAVE writes below the folder of the run, one line more each time."""
    port = LivePort(MACHINE.start, folder=tmp_path / "out")
    port.append_file("a/b.txt", "1\n")
    port.append_file("a/b.txt", "2\n")
    assert (tmp_path / "out" / "a" / "b.txt").read_text() == "1\n2\n"


@pytest.mark.parametrize(
    ("kind", "value", "raw"),
    [
        ("BOOLEAN", 1.0, "01"),
        ("SGN08", -2.0, "fe"),
        ("UNS16", 65535.0, "ffff"),
        ("SGN32", -1.0, "ffffffff"),
        ("UNS32", 4294967295.0, "ffffffff"),
        ("REAL64", 1.0, "000000000000f03f"),
        ("STRING", "ab", "616200"),
    ],
)
def test_external_storage(kind, value, raw):
    """Every variable begins at its 24-byte block; elements follow each other,
    bytes are little-endian.
    """
    area = bytearray(external.AREA_BYTES)
    variable = External("A", kind, 3, 2)
    external.write(area, variable, 1, value)
    begin = 24 * 3
    assert area[begin : begin + len(raw) // 2].hex() == raw
    assert not any(area[:begin])
    assert external.read(area, variable, 1) == value


def test_external_reads_what_is_not_finite_as_zero():
    """The other side may write anything."""
    area = bytearray(external.AREA_BYTES)
    ctypes.c_double.from_buffer(area, 0).value = float("nan")
    assert external.read(area, External("A", "REAL64", 1), 0) == 0.0
    with pytest.raises(CncError):
        external.write(area, External("T", "STRING", 1), 0, "\u20ac")


def test_external_places_follow_the_configuration():
    """Without a block number variables are packed in order, per scope; overlaps
    and wrong names are refused.
    """
    cell = parse_config(
        '[external.A]\n[external."S.B"]\nsize = 3\n[external.T]\ntype = "STRING"\ncharacters = 30\n'
        '[external.G]\nscope = "global"\n[external.C]\n'
    )
    assert {n: v.number for n, v in cell.externals.items()} == {
        "A": 1,
        "S.B": 2,
        "T": 5,
        "G": 1,
        "C": 7,
    }
    for wrong in (
        "[external.A]\nblock = 1\n[external.B]\nblock = 1",
        "[external.A]\nsize = 900\n[external.B]\nsize = 101",
        "[external.A]\nfoo = 1",
        "[zero_offsets.1]\nQ = 1.0",
        "[zero_offsets.97]\nX = 1.0",
        '[channel.g_programs]\n90 = "a.nc"',
        "[channel]\nskip_levels = [11]",
    ):
        with pytest.raises(ConfigError):
            parse_config(wrong)


def test_zero_offsets_and_user_codes_of_the_cell(tmp_path):
    """cell.toml gives zero offsets, subprograms of G80 and M06, skip levels."""
    (tmp_path / "u.nc").write_text("G00 X[@P1]\n")
    (tmp_path / "t.nc").write_text("G00 Z[V.G.T_AKT]\n")
    (tmp_path / "a.nc").write_text("G80 [3]\nT4 M6\n/X9\nG54 X1\n")
    cell = parse_config(
        '[channel]\nm6_program = "t.nc"\nskip_levels = [1]\n'
        'g_programs = { 80 = "u.nc" }\n[zero_offsets.1]\nX = 10.0\n'
    )
    program = Program(tmp_path / "a.nc", cell)
    ends = [
        row["end"][:3].tolist()
        for batch in program.batches()
        for row in batch.rows
        if row["type"] == 1
    ]
    assert ends == [[3, 0, 0], [3, 0, 4], [11, 0, 4]]


SEVERAL_LINES = {
    "VAR",
    "ENDVAR",
    "IF",
    "ELSE",
    "ENDIF",
    "COMMENT BEGIN",
    "COMMENT END",
}


@pytest.mark.parametrize(
    "name", sorted(set(command_table.TABLE) - SEVERAL_LINES)
)
def test_every_command_does_what_its_table_says(tmp_path, name):
    """Refused commands are refused by name, stored ones say so once, the others are known."""
    run = Run(f"#{name}\n", tmp_path)
    state = command_table.TABLE[name]
    if state == command_table.REFUSED:
        assert run.codes == [900003]
        assert (
            re.match(r"[A-Z ]+", name)[0].strip() in run.reader.errors[0].text
        )
    elif state == command_table.STORED:
        assert (run.codes, run.warned[-1]) == ([], 907042)
    else:
        assert not {900002, 900003} & set(run.codes)


@pytest.mark.parametrize("code", sorted(gcodes.REFUSED))
def test_refused_g_functions_are_refused_by_name(tmp_path, code):
    """Each by its number, at its place."""
    run = Run(f"G{code} X1\n", tmp_path)
    assert run.codes[0] == 900003
    assert f"G{code:02d}" in run.reader.errors[0].text
