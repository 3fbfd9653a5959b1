"""Program flow over source files: places, hops, levels, what is kept and what is not."""

import random
import re

import numpy as np
import pytest

from cnc_core.errors import CncError
from cnc_core.frontend.base.flow import START, Flow, Level, Mark
from cnc_core.frontend.base.source import Source
from cnc_core.frontend.base.variables import (
    REAL64,
    LevelScopes,
    Variable,
    check_dimensions,
    text_type,
    whole_type,
)
from cnc_core.frontend.isg import IsgFrontEnd
from cnc_core.frontend.offline import read_all
from cnc_core.frontend.port import OfflinePort
from support.isg_programs import MACHINE, Run


@pytest.mark.parametrize("chunk", [5, 64, 1 << 20])
def test_hop_finds_the_lines_that_a_loop_over_lines_finds(tmp_path, chunk):
    """Hopping from hit to hit passes exactly the lines between, whatever the
    chunks; seeking back reads them again.
    """
    rng = random.Random(3)
    lines = [
        "".join(rng.choice("ab$ ") for _ in range(rng.randint(0, 9)))
        for _ in range(400)
    ]
    path = tmp_path / "a.txt"
    path.write_bytes("\n".join(lines).encode())
    source, line, hits = Source(path, chunk), 0, []
    while True:
        line += source.hop(re.compile(rb"\$"))
        place = source.position
        text = source.line()
        if text is None:
            break
        hits.append((line, text, place))
        line += 1
    assert [(i, t) for i, t, _ in hits] == [
        (i, t.rstrip()) for i, t in enumerate(lines) if "$" in t
    ]
    assert line == len(lines)
    for _, text, place in rng.sample(hits, 40):
        source.seek(place)
        assert source.line() == text
    source.close()


def test_calls_and_returns(tmp_path):
    """A call goes to its level's beginning, the end of it behind the call; too
    many in each other are refused.
    """
    (tmp_path / "a").write_text("1\n2\n3\n")
    (tmp_path / "b").write_text("4\n")
    flow = Flow(tmp_path / "a", 2, 907002)
    assert flow.source.line() == "1"
    flow.call(Level(flow.file_of(tmp_path / "b"), START))
    assert flow.apply(Mark(2, 1)) == (START, 0)
    assert (flow.file.number, flow.source.line()) == (1, "4")
    with pytest.raises(CncError):
        flow.call(Level(flow.file, START))
    flow.leave()
    assert flow.apply(Mark(2, 1)) == (Mark(2, 1), 0)
    assert flow.source.line() == "2"
    flow.skip(Mark(6, 3))
    assert flow.apply(Mark(4, 2)) == (Mark(6, 3), 1)
    assert flow.files == [tmp_path / "a", tmp_path / "b"]
    flow.close()


@pytest.mark.ci
def test_a_program_read_once_keeps_nothing(tmp_path):
    """Without loops and subprograms neither blocks nor places are kept, however
    long the program is.
    """
    text = "G01 F1000\n" + "X1\nX[1+1]\nP1=3\n" * 20000
    path = tmp_path / "long.nc"
    path.write_text(text)
    reader = IsgFrontEnd(path, MACHINE, OfflinePort(MACHINE.start))
    rows = sum(len(batch) for batch in read_all(reader))
    reader.close()
    assert rows == 40000
    assert (len(reader.flow.file.blocks), len(reader.flow.file.places)) == (
        0,
        0,
    )
    assert reader.block_count == 60001


def test_kept_blocks_are_bounded(tmp_path, monkeypatch):
    """A loop longer than the table of kept blocks still does the same."""
    monkeypatch.setattr("cnc_core.frontend.base.flow.BLOCKS_KEPT", 7)
    monkeypatch.setattr("cnc_core.frontend.base.flow.PLACES_KEPT", 3)
    body = "".join(f"$IF P1 > {i}\nX[P1*{i}+1]\n$ENDIF\n" for i in range(20))
    run = Run(f"G00\n$FOR P1=0,30,1\n{body}$ENDFOR\n", tmp_path)
    wanted = [float(p * i + 1) for p in range(31) for i in range(20) if p > i]
    assert run.x() == [
        x
        for x, before in zip(wanted, [0.0, *wanted], strict=False)
        if x != before
    ]
    assert len(run.reader.flow.file.blocks) <= 7


@pytest.mark.ci
def test_a_program_that_does_not_end_is_stopped(tmp_path):
    """Blocks without any row are counted; reading comes back now and then, so
    that it can be interrupted.
    """
    path = tmp_path / "endless.nc"
    path.write_text("$DO\nP1=1\n$ENDDO\n")
    reader = IsgFrontEnd(path, MACHINE, OfflinePort(MACHINE.start))
    reader.idle_blocks_max = 250_000
    seen = []

    def drive():
        while (item := reader.read(10)) is not None:
            seen.append(len(item))

    with pytest.raises(CncError) as caught:
        drive()
    reader.close()
    assert (caught.value.code, seen) == (907001, [0] * 250)


def test_a_program_without_loops_is_never_stopped(tmp_path):
    """However many blocks come before the first motion."""
    run = Run("P1=1 (a (b))\n" * 400 + "G00 X1\n", tmp_path, idle=100)
    assert (run.codes, run.x()) == ([], [1.0])


def test_waiting_for_nobody_ends(tmp_path):
    """Without a PLC a program that polls an external variable is stopped soon."""
    run = Run("$WHILE V.E.GO == 0\n$ENDWHILE\n", tmp_path)
    assert run.codes == [907001]


def test_motion_resets_the_count_of_idle_blocks(tmp_path):
    """A loop that moves may go on for ever."""
    run = Run(
        "G01 F100\n$FOR P1=1,2000,1\nX[P1]\nP2=1\n$ENDFOR\n", tmp_path, idle=20
    )
    assert not run.codes
    assert len(run.rows) == 2000


def test_lines_and_counts_of_loops_and_subprograms(tmp_path):
    """Rows know their file and line; block_count goes on with every line that
    is read, also again, or passed.
    """
    (tmp_path / "sub.nc").write_text("\nG00 X[P1]\nM17\n")
    run = Run("$FOR P1=1,2,1\n; text\nL sub.nc\n$ENDFOR\nX9\n", tmp_path)
    assert run.rows["file"].tolist() == [1, 1, 0]
    assert run.rows["line"].tolist() == [2, 2, 5]
    assert run.rows["count"].tolist() == [5, 12, 19]


@pytest.mark.parametrize("ending", ["", "\n"])
def test_the_end_of_a_file_is_no_line(tmp_path, ending):
    """With and without a last line break the parser sees the same lines, also
    where it alone reads them.
    """
    for options in ({}, {"scan": False}):
        assert (
            Run("G00 X1\nX2" + ending, tmp_path, **options).reader.block_count
            == 2
        )
    (tmp_path / "sub.nc").write_text("G93 F2\nG01 X2" + ending)
    run = Run(
        "F600 G01 X1\nL CYCLE [NAME=sub.nc]\nX3" + ending, tmp_path, idle=100
    )
    assert (run.x(), run.codes) == ([1.0, 2.0, 3.0], [])


def test_types():
    """Whole types round halves away from zero and refuse what does not fit;
    texts are as long as declared.
    """
    byte = whole_type("UNS08", 8, signed=False)
    assert [byte.convert(v, "a", 0) for v in (0.4, 0.5, 254.5)] == [
        0.0,
        1.0,
        255.0,
    ]
    for value in (-0.5, 255.5, float("nan"), "5"):
        with pytest.raises(CncError):
            byte.convert(value, "a", 0)
    assert text_type(2).convert("ab", "a", 0) == "ab"
    for value in ("abc", 1.0):
        with pytest.raises(CncError):
            text_type(2).convert(value, "a", 0)
    for value in (float("inf"), float("nan")):
        with pytest.raises(CncError):
            REAL64.convert(value, "a", 0)


def test_arrays_are_stored_row_by_row():
    """Elements of several dimensions lie as numpy lays them."""
    variable = Variable("a", REAL64, check_dimensions("a", [2.0, 3.0, 4.0], 0))
    variable.fill([float(i) for i in range(24)], 0)
    wanted = np.arange(24.0).reshape(2, 3, 4)
    for place in np.ndindex(2, 3, 4):
        assert variable.load([float(i) for i in place]) == wanted[place]
    for wrong in ([2.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0]):
        with pytest.raises(CncError):
            variable.load(wrong)
    with pytest.raises(CncError):
        check_dimensions("a", [1000.0, 1000.0, 1000.0], 0)


def test_scopes_hide_and_vanish():
    """The innermost variable of a name is found; it is gone with its level."""
    scopes = LevelScopes()
    scopes.innermost["A"] = Variable("A", REAL64)
    scopes.push()
    assert scopes.get("A") is not None
    inner = scopes.innermost["A"] = Variable("A", REAL64)
    assert scopes.get("A") is inner
    scopes.pop()
    assert scopes.get("A") is not inner
    assert scopes.delete("A")
    assert not scopes.delete("A")
