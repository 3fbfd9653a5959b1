"""The filter of a profile's speed over time (JRK Tstab, Ttop)."""

import numpy as np
import pytest

from cnc_core.geometry.profiles.time_filter import _Caps, _opened
from cnc_core.planning import plan_program
from support.inside import Inside
from support.osai_programs import SETUP_3, changed

BENDS = {
    "CRV": None,
    "EDG": None,
    "DIN_X": "(DIN,X,,300)",
    "DIN_Y": "(DIN,Y,,300)",
}


def opened(share, time, window):
    """Every stretch in turn: the largest share, up to its least one, at which it
    lasts the window; nothing falls below the least of all.
    """
    n, out = len(share), np.full(len(share), share.min())
    for j in range(n):
        for k in range(j, n):
            stretch = slice(j, k + 1)
            lasts = (time[stretch] * share[stretch]).sum() / window
            at = min(share[stretch].min(), lasts)
            out[stretch] = np.maximum(out[stretch], at)
    return out


@pytest.mark.parametrize("seed", range(5))
def test_opening(seed):
    """Against stretches taken one by one; never more than the share itself."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 60))
    share, time = rng.uniform(0.1, 1.0, n), rng.integers(1, 9, n) / 64.0
    made = _opened(_Caps(share, time, np.zeros(n, np.bool_)), 0.5)
    assert made == pytest.approx(opened(share, time, 0.5))
    assert (made <= share).all()


def wave():
    x = np.linspace(0.0, 100.0, 200)
    y = np.sin(1.2 * x) * np.exp(-(((x - 50.0) / 20.0) ** 2))
    lines = [f"X{a:.5f}Y{b:.5f}Z0" for a, b in zip(x, y, strict=True)]
    return "\n".join([lines[0] + "F6000", *lines[1:]])


@pytest.mark.ci
def test_needless_accelerations_are_removed(shop):
    """The longer of Tstab and Ttop: less up and down of the speed, no more of
    anything than without.
    """
    swing, time = [], []
    for jrk in ("(JRK,ENA)", "(JRK,ENA,,,100,150,)", "(JRK,ENA,,,100,150,400)"):
        program = shop.profile(
            wave(), changed(SETUP_3, JRK=jrk, **BENDS), programmed=False
        )
        made = plan_program(program, keep_samples=True)
        swing.append(float(np.abs(np.diff(made.samples["v"])).sum()))
        time.append(made.motion_time_s)
    assert swing[1] < 0.5 * swing[0]
    assert swing[2] < 0.7 * swing[1]
    assert time[0] < time[1] < time[2] < 1.5 * time[0]


def test_swings_by_the_change_of_curvature_are_removed(shop):
    """Twelve half circles to and fro: only the jerk where the curvature changes
    its sign limits them.  The speed swung 24 times by 13 mm/s as without Tstab.
    """
    turn = np.linspace(np.pi, 0.0, 17)[1:]
    lines = ["X0Y0Z0F6000"]
    for i in range(12):
        x = 1.6 * i + 0.8 + 0.8 * np.cos(turn)
        y = (1 - i % 2 * 2) * 0.8 * np.sin(turn)
        lines += [f"X{a:.5f}Y{b:.5f}" for a, b in zip(x, y, strict=True)]
    setup = changed(SETUP_3, JRK="(JRK,ENA,,,400,150,200)", CRV=None, EDG=None)
    made = plan_program(
        shop.profile("\n".join(lines), setup, programmed=False),
        keep_samples=True,
    )
    speed = made.samples["v"]
    driven = speed[int(0.1 * len(speed)) : int(0.9 * len(speed))]
    assert driven.min() > 0.97 * driven.max()
    assert made.max_ratio["jerk"] <= 1.02


def test_a_short_stretch_does_not_creep(shop):
    """Behind a sharp bend a stretch shorter than Tstab at full feed is not
    driven at the speed of the bend (it took seven times as long).
    """
    body = "X0Y0Z0F6000\nX20\nG63\nX20Y20"
    times = [
        plan_program(
            shop.profile(
                body, changed(SETUP_3, JRK=jrk, **BENDS), programmed=False
            )
        ).motion_time_s
        for jrk in ("(JRK,ENA)", "(JRK,ENA,,,400,,)")
    ]
    assert times[0] <= times[1] < 1.5 * times[0]


def test_batches_do_not_show(shop):
    """The same feeds whether the program is read in small or large batches, and nothing is lost."""
    setup = changed(SETUP_3, JRK="(JRK,ENA,,,200)", **BENDS)
    feeds = []
    for rows in (7, 5000):
        program, found = shop.profile(wave(), setup, programmed=False), []
        while (batch := program.read(rows)) is not None:
            found.append(
                batch.rows[batch.rows["type"] <= 3]["feed"]
                if hasattr(batch, "rows")
                else np.empty(0)
            )
        feeds.append(np.concatenate(found))
    assert len(feeds[0]) == 199
    assert feeds[0] == pytest.approx(feeds[1], rel=1e-9)


def test_a_long_curve_is_not_slowed_for_its_sharpest_spot(shop):
    """One polynomial that lasts longer than the window keeps the planner's own speeds."""
    body = "<*,60,1,6000,0\n<X,0,1,0,0,0,0\n<Y,0,0,0,0,0.00002,-0.0000004\n<Z,0,0,0,0,0,0"
    time = []
    for jrk in ("(JRK,ENA)", "(JRK,ENA,,,100,,)"):
        setup = changed(SETUP_3, JRK=jrk, PNT="(PNT,AXI,AXI,QUI,POL)", **BENDS)
        time.append(
            plan_program(
                shop.profile(body, setup, programmed=False)
            ).motion_time_s
        )
    assert time[1] == pytest.approx(time[0])


def test_single_block_sees_one_block(tmp_path):
    """G61 .. G60 is one block, with limits, filter and an edge inside: every
    start but one leads past it.
    """
    setup = changed(SETUP_3, **BENDS | {"EDG": "(EDG,30,0,G66,1)"})
    (tmp_path / "CONFIG1").write_text(setup)
    profile = "G61\nX5Y0Z0\nX10Y1\nX15Y0\nG66\nX15Y10\nG0X20Y10\nG1X25Y9\nG60"
    text = f"(HSM,CONFIG1)\nG1X5F6000\n{profile}\nG1X30\nX35\n"
    stops = []
    with Inside(tmp_path, text) as cnc:
        cnc.level(cnc.bahn.single_block, True)
        for _ in range(6):
            cnc.run(1500)
            stops.append(float(cnc.pos[-1, 0]))
            cnc.level(cnc.bahn.continue_machining, True)
            cnc.run(20)
            cnc.level(cnc.bahn.continue_machining, False)
    seen = [
        round(x, 3)
        for i, x in enumerate(stops)
        if not i or abs(x - stops[i - 1]) > 1e-6
    ]
    assert [x for x in seen if x] == [5.0, 25.0, 30.0, 35.0]


@pytest.mark.parametrize("pieces", [2, 5])
def test_it_does_not_matter_how_a_curve_is_cut(shop, pieces):
    """Arcs that bend at their ends alone: in four polynomials each or in many,
    the same rise is taken away.
    """
    setup = changed(
        SETUP_3,
        PNT="(PNT,CLP,CLP,QUI,POL)",
        JRK="(JRK,ENA,,,400,150,200)",
        **BENDS,
    )
    times = []
    for cut in (4, 4 * pieces):
        lines = []
        for k in range(
            8
        ):  # y = 0.002 (x - 6)^4 over 0..12, mirrored in every other one; x is the parameter
            for i in range(cut):
                arc = np.polynomial.Polynomial(
                    [0.0, 0.0, 0.0, 0.0, 0.002 if k % 2 == 0 else -0.002]
                )
                y = arc(
                    np.polynomial.Polynomial([12.0 * i / cut - 6.0, 1.0])
                ).coef
                y[0] -= arc(6.0)
                lines += [
                    f"<*,{12.0 / cut:.12f},1,12000,5",
                    f"<X,{12.0 * k + 12.0 * i / cut:.12f},1,0,0,0,0",
                ]
                lines += [
                    "<Y," + ",".join(f"{c:.12f}" for c in y) + ",0",
                    "<Z,0,0,0,0,0,0",
                ]
        program = shop.profile(
            "\n".join(lines), setup, head="G61 P5", programmed=False
        )
        times.append(plan_program(program).motion_time_s)
    assert times[1] == pytest.approx(times[0], rel=0.03)
