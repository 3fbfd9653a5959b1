"""Numbers beyond all measure: an error with number, line and column, never a
warning of numpy or a traceback.
"""

import subprocess
import sys
import warnings

import pytest

from cnc_core.errors import CncError
from cnc_core.planning import plan_program
from support.osai_programs import SETUP_3, changed

HUGE = "1" + "0" * 400
LONG = "9" * 3000
TINY = "0." + "0" * 300 + "1"
POL = "(PNT,AXI,AXI,QUI,POL)"
BSP = "(PNT,AXI,AXI,QUI,BSP)"


def plan_of(shop, body, setup, head="G61"):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return plan_program(
            shop.profile(body, setup, head=head, programmed=False)
        )


@pytest.mark.parametrize(
    ("body", "number", "line", "column"),
    [
        (f"X0Y0Z0F3000\nX10\nX{HUGE}\nX5", 900012, 5, 1),
        (f"X0Y0Z0F3000\nX10\nX1{'0' * 200}\nX5", 900012, 5, 1),
        (f"X0Y0Z0F3000\nG1 X{LONG}", 900012, 4, 4),
        (f"X0Y0Z0F3000\nX10F{HUGE}\nX20", 900012, 4, 4),
        (f"X0Y0Z0F{HUGE}\nX10", 900012, 3, 7),
        (f"X0Y0Z0F3000\nN{LONG}X10", 900012, 4, 1),
        (f"X0Y0Z0F3000\nG{LONG}X10", 900012, 4, 1),
        (f"X0Y0Z0F3000\nXE{LONG}", 900012, 4, 2),
        ("X0Y0Z0F3000\nX10\nX2000000000", 900012, 5, 1),
    ],
)
def test_words_of_points(shop, body, number, line, column):
    """The word that is wrong is told, with its place."""
    with pytest.raises(CncError) as caught:
        plan_of(shop, body, changed(SETUP_3))
    place = caught.value.place
    assert (caught.value.code, place.line, place.column) == (
        number,
        line,
        column,
    )
    assert len(caught.value.text) < 200


@pytest.mark.parametrize(
    ("body", "number", "line"),
    [
        (
            f"<*,{HUGE},1,100,0\n<X,0,1,0,0,0,0\n<Y,0,0,0,0,0,0\n<Z,0,0,0,0,0,0",
            900012,
            3,
        ),
        (
            "<*,1e-300,1,100,0\n<X,0,1,0,0,0,0\n<Y,0,0,0,0,0,0\n<Z,0,0,0,0,0,0",
            909232,
            3,
        ),
        (
            "<*,1e8,1,100,0\n<X,0,1,0,0,0,1e29\n<Y,0,0,0,0,0,0\n<Z,0,0,0,0,0,0",
            900012,
            3,
        ),
        (
            "<*,10,1,1e20,0\n<X,0,1,0,0,0,0\n<Y,0,0,0,0,0,0\n<Z,0,0,0,0,0,0",
            900012,
            3,
        ),
        (
            f"<*,10,1,100,0\n<X,0,{HUGE},0,0,0,0\n<Y,0,0,0,0,0,0\n<Z,0,0,0,0,0,0",
            900012,
            4,
        ),
    ],
)
def test_polynomials(shop, body, number, line):
    """Length, feed and coefficients, and what they come to at the end."""
    with pytest.raises(CncError) as caught:
        plan_of(shop, body, changed(SETUP_3, PNT=POL))
    assert (caught.value.code, caught.value.place.line) == (number, line)


def test_knots(shop):
    """Knots that differ by nothing a curve could use."""
    knots = "\n".join(f"K{k}" for k in ("1", "1", "1", "1"))
    body = f"X0Y0Z0K0F100\nX1K0\nX2K0\nX3K0\nX4K{TINY}\n{knots}"
    with pytest.raises(CncError) as caught:
        plan_of(shop, body, changed(SETUP_3, PNT=BSP), head="G61 P3")
    assert (caught.value.code, caught.value.place.line) == (909242, 12)


def test_points_that_nearly_coincide(shop):
    """A move of less than a picometre is none, whatever NullMov says."""
    setup = changed(SETUP_3, THR="(THR,0.01,0.0001,0,0,0.05)", CRV=None)
    far, near = (
        plan_of(shop, f"X0Y0Z0F3000\nX10\n{more}X20", setup)
        for more in ("", f"X10Y{TINY}\nX10Y0\n")
    )
    assert near.motion_time_s == pytest.approx(far.motion_time_s)


@pytest.mark.parametrize(
    ("code", "line"),
    [
        ("THR", f"(THR,{HUGE},0.0001,0,0.001,0.05)"),
        ("THR", f"(THR,E{LONG},0.0001,0,0.001,0.05)"),
        ("TOL", f"(TOL,{HUGE},,0,-90,)"),
    ],
)
def test_setups(shop, code, line):
    """Fields of the setup, with the line of the setup."""
    setup = changed(SETUP_3, **{code: line})
    with pytest.raises(CncError) as caught:
        plan_of(shop, "X0Y0Z0F3000\nX10", setup)
    assert caught.value.code == 909205
    assert caught.value.place.file.endswith("CONFIG1")
    assert caught.value.place.line == setup.splitlines().index(line) + 1
    assert len(caught.value.text) < 200


def test_assignments(shop):
    """Variables outside the profile."""
    for text in (f"E1={HUGE}", f"E{LONG}=1", f"E1=E{LONG}"):
        with pytest.raises(CncError) as caught:
            list(shop.program(f"{text}\nG1X1F100\n", SETUP_3).batches())
        assert (caught.value.code, caught.value.place.line) == (900012, 1)


@pytest.mark.ci
def test_nothing_leaks_to_the_terminal(tmp_path):
    """The command prints the error and no warning."""
    (tmp_path / "SETUP").write_text(changed(SETUP_3))
    (tmp_path / "a.osai").write_text(
        f"(HSM,SETUP)\nG61\nX0Y0Z0F3000\nX{HUGE}\nX5\nG60\n"
    )
    command = [
        sys.executable,
        "-P",
        "-m",
        "cnc_core.cli",
        "plan",
        str(tmp_path / "a.osai"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "a.osai:4:1: 900012:" in done.stderr
    assert "Warning" not in done.stderr
