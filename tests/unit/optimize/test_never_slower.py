"""The Path Optimizer's output is no slower than its input, or it is the input;
points of the axes become points of the tip with the length they were made for.
"""

import numpy as np
import pytest

from cnc_core.config import CellConfig
from cnc_core.errors import CncError
from cnc_core.optimize import optimize
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.osai_programs import CELL_5, SETUP_3, SETUP_5, changed

SMT = "(SMT,0.02,0.02,0.002,1,1,1,{0},{0},{0})\n"
FIVE = changed(SETUP_5, PNT="(PNT,AXI,AXI,QUI)", CRV=None)


def made(folder, body, setup, cell=None):
    """What ``optimize`` tells of a profile."""
    cell = cell or CellConfig()
    (folder / "SETUP").write_text(setup)
    (folder / "in.osai").write_text(f"(HSM,SETUP)\nG61\n{body}\nG60\n")
    names = ("in.osai", "SETUP", "out.osai")
    return optimize(*[folder / name for name in names], cell)


def corner():
    """A smooth quarter of a wave, a sharp corner, and the way back."""
    t = np.linspace(0.0, 20.0, 41)
    there = np.column_stack([t, np.sin(t / 9.0)])
    back = there[-2::-1] + np.outer(np.arange(1, 41) / 2.0, [0.0, 1.0])
    points = np.vstack([there, back])
    words = [f"X{x:.5f}Y{y:.5f}Z0" for x, y in points]
    return "\n".join([f"{words[0]}F6000", *words[1:]])


@pytest.mark.ci
@pytest.mark.parametrize("code", ["G63", "G67"])
def test_an_edge_that_costs_time_keeps_the_input(tmp_path, code):
    """Smooth points with a stop in the corner: whatever C0 makes of it, the
    output is not slower, and where that is the input's doing it says so.
    """
    result = made(
        tmp_path, corner(), changed(SETUP_3, CRV=None) + SMT.format(code)
    )
    assert result.time_after_s <= result.time_before_s * 1.0005
    program = Program(tmp_path / "out.osai", CellConfig(), "osai")
    after = plan_program(program).motion_time_s
    assert after == pytest.approx(result.time_after_s)
    assert result.input_kept == any("909272" in w for w in result.warnings)
    text = (tmp_path / "out.osai").read_text()
    assert ("X0.00000Y0.00000Z0F6000" in text) == result.input_kept


def tilted():
    t = np.linspace(0, 20, 30)
    lines = [f"X{x:.5f}Y{2 * np.sin(x / 5):.5f}Z0A30B-20" for x in t]
    return "\n".join([f"{lines[0]}F3000", *lines[1:]])


def test_axi_points_need_the_length_they_were_made_for(tmp_path):
    """Five axes, a tool of 100 mm and an empty OriginLen: an error at TOL."""
    setup = changed(FIVE, TOL="(TOL,100,0,0,-90,)") + SMT.format("G66")
    with pytest.raises(CncError, match="TOL, OriginLen") as error:
        made(tmp_path, tilted(), setup, CELL_5)
    assert error.value.code == 909204


@pytest.mark.parametrize(("length", "told"), [(40, True), (100, False)])
def test_another_tool_ends_elsewhere_with_a_word(tmp_path, length, told):
    """The tip's path stays: with another tool the axes end elsewhere."""
    tol = f"(TOL,100,0,0,-90,{length})"
    result = made(
        tmp_path, tilted(), changed(FIVE, TOL=tol) + SMT.format("G66"), CELL_5
    )
    assert not result.input_kept
    assert any("909273" in w for w in result.warnings) == told


def test_three_axes_become_the_tip_as_asked(tmp_path):
    """AXI points with the feed on CLP: the output programs the tip, the points
    less OriginLen along TOD.
    """
    setup = changed(
        SETUP_3,
        PNT="(PNT,AXI,CLP,QUI)",
        TOL="(TOL,30,,0,-90,30)",
        TOD="(TOD,0,0.6,0.8)",
        CRV=None,
        EDG="(EDG,30,0,G63,1)",
    )
    result = made(tmp_path, corner(), setup + SMT.format("G66"))
    assert not result.input_kept
    assert "(PNT,CLP,CLP,QUI,POL)" in (tmp_path / "out.osai.setup").read_text()
    first = (tmp_path / "out.osai").read_text().splitlines()[3:6]
    starts = [float(line.split(",")[1]) for line in first]
    assert starts == pytest.approx([0.0, -18.0, -24.0], abs=0.03)
    program = Program(tmp_path / "out.osai", CellConfig(), "osai")
    rows = np.concatenate([b.rows for b in program.batches()])
    program.reader.close()
    end = rows[(rows["type"] <= 3) & (rows["flags"] & 256 == 0)]["end"][-1]
    assert end[:3] == pytest.approx([0.0, 20.0, 0.0], abs=0.03)


def square():
    t = np.linspace(0.0, 50.0, 41)
    there = np.column_stack([t, 0.0 * t])
    up = np.column_stack([np.full(40, 50.0), t[1:]])
    words = [f"X{x:.5f}Y{y:.5f}Z0" for x, y in np.vstack([there, up])]
    return "\n".join([f"{words[0]}F6000", *words[1:]])


def test_a_joining_piece_is_no_stop(tmp_path):
    """G63: the speed of the parameter does not jump at the piece's ends, where
    the path would stop twice in place of once.
    """
    setup = changed(SETUP_3, CRV=None, JRK="(JRK,ENA,,,,,)")
    setup = setup.replace("EDG,30,0,G66", "EDG,30,0,G63")
    result = made(tmp_path, square(), setup + SMT.format("G63"))
    assert result.joints == 1
    assert not result.input_kept
    text = (tmp_path / "out.osai").read_text()
    found = [line.split(",") for line in text.splitlines() if "<" in line]
    rows = np.array([[float(x) for x in c[1:7]] for c in found if len(c) == 7])
    spans = [float(c[1]) for c in found if c[0] == "<*"]
    speeds = rows.reshape(-1, 3, 6)[:, :, 1:] * np.arange(1, 6)
    for left, span, right in zip(speeds, spans, speeds[1:], strict=False):
        end = (left * span ** np.arange(5)).sum(axis=1)
        assert end == pytest.approx(right[:, 0], abs=1e-9)
