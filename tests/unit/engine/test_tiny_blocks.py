"""Blocks shorter than 1e-7 mm: nothing jumps for them, nothing stands at their
corners, and the path behind them is where it is programmed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import parse_config
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.commanded import NO_JERK
from support.drive import FloatArray, curve_rows, drive, line_rows
from support.inside import Inside
from support.limits import legal, ratios

pytestmark = pytest.mark.sanitize("engine")

QUICK = "cycle_s = 0.00025\n"


def _with_tiny(size: float, run: int, sideways: bool) -> FloatArray:
    """A line of 20 mm in blocks of 1 mm, behind each a run of tiny blocks; the
    last ones end the path.
    """
    rng = np.random.default_rng(3)
    points = [np.zeros(3)]
    for _ in range(20):
        points.append(points[-1] + [1.0, 0.0, 0.0])
        for _ in range(run):
            way = rng.normal(size=3) if sideways else np.array([1.0, 0.0, 0.0])
            points.append(points[-1] + size * way / np.linalg.norm(way))
    return np.array(points)


@pytest.mark.parametrize("jerk", [True, False])
@pytest.mark.parametrize("sideways", [False, True])
@pytest.mark.parametrize(
    ("size", "run"), [(1e-9, 1), (9e-8, 1), (1e-9, 30), (1e-8, 9), (2e-11, 300)]
)
def test_tiny_blocks_neither_show_nor_cost_time(
    size: float, run: int, sideways: bool, jerk: bool
) -> None:
    """At 0.25 ms a place that jumps by 1e-7 mm is a fifth of the jerk limit, 30
    such blocks eight times as much.
    """
    cell = parse_config(QUICK)
    plain = line_rows(
        np.array(
            [[0.0, 0.0, 0.0], *([float(x), 0.0, 0.0] for x in range(1, 21))]
        ),
        100.0,
    )
    points = _with_tiny(size, run, sideways)
    pos, state = drive(line_rows(points, 100.0), cell, jerk=jerk)
    assert max(ratios(pos, cell, jerk)) <= 1.02
    assert pos[-1] == pytest.approx(points[-1], abs=1e-10)
    least = float(drive(plain, cell, jerk=jerk)[1].motion_time_s)
    assert float(state.motion_time_s) < 1.05 * least + 0.002


@pytest.mark.parametrize("size", [1e-8, 9e-8, 2e-7])
def test_a_path_of_tiny_blocks_alone_is_legal(size: float) -> None:
    """400 of them, along a line and all over the place: what they add up to is driven."""
    cell, rng = parse_config(QUICK), np.random.default_rng(1)
    steps = rng.normal(size=(400, 3))
    steps[:200] = [1.0, 1.0, 0.0]
    points = np.vstack(
        [
            np.zeros(3),
            np.cumsum(
                size * steps / np.linalg.norm(steps, axis=1)[:, None], axis=0
            ),
        ]
    )
    pos, _ = drive(line_rows(points, 100.0), cell)
    assert max(ratios(pos, cell)) <= 1.02
    assert pos[-1] == pytest.approx(points[-1], abs=1e-10)


def _wave(size: float, sideways: bool) -> str:
    """Quarter circles that join without a corner, with a tiny block between
    them, along the path or across.
    """
    lines, x, y = ["G1 X10 F6000"], 10.0, 0.0
    for i in range(20):
        sign = 1 if i % 2 else -1
        x, y = (x, y + sign * size) if sideways else (x + size, y)
        lines.append(f"G1 X{x:.11f} Y{y:.11f}")
        x, y = x + 1, y + sign
        lines.append(f"G{3 if sign > 0 else 2} X{x:.11f} Y{y:.11f} I0 J{sign}")
        x, y = (x + size, y) if sideways else (x, y + sign * size)
        lines.append(f"G1 X{x:.11f} Y{y:.11f}")
        x, y = x + 1, y + sign
        lines.append(f"G{2 if sign > 0 else 3} X{x:.11f} Y{y:.11f} I1 J0")
    return "\n".join([*lines, f"G1 X{x + size:.11f}"]) + "\n"


@pytest.mark.parametrize("jerk", [True, False])
@pytest.mark.parametrize("sideways", [False, True])
def test_arcs_take_the_displacement_of_a_tiny_block_with_them(
    tmp_path: Path, sideways: bool, jerk: bool
) -> None:
    """As quick as without the tiny blocks, legal, and nowhere further off than
    one of them is long.
    """
    cell, times = parse_config(QUICK), []
    for size in (0.0, 9e-8):
        path = tmp_path / f"wave{size}.nc"
        path.write_text(_wave(size, sideways))
        result = plan_program(Program(path, cell, "isg"), jerk=jerk)
        times.append(result.motion_time_s)
        assert (
            max(
                ratio
                for ratio in result.max_ratio.values()
                if ratio is not None
            )
            <= 1.02
        )
        assert result.path_deviation_mm <= 1e-7
    assert times[1] < 1.02 * times[0]


@pytest.mark.parametrize("jerk", [True, False])
def test_polynomials_take_it_too(jerk: bool) -> None:
    """A line, a block of 8e-8 mm across it, and a parabola that leaves the line
    without a corner.
    """
    cell, tiny, bend = parse_config(QUICK), 8e-8, 0.02
    points = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, tiny, 0.0]])
    coef = np.array(
        [[[10.0, 1.0, 0.0], [tiny, 0.0, bend], [0.0, 0.0, 0.0]]]
    )  # y = bend x^2 over 5 mm
    w = 2.0 * bend * 5.0
    length = (w * np.sqrt(1.0 + w * w) + np.arcsinh(w)) / (4.0 * bend)
    curve, pool = curve_rows(coef, np.array([5.0]), np.array([length]), 100.0)
    pos, _ = drive(
        np.concatenate([line_rows(points, 100.0), curve]),
        cell,
        pool=pool,
        jerk=jerk,
    )
    assert max(ratios(pos, cell, jerk)) <= 1.02
    assert pos[-1] == pytest.approx([15.0, tiny + 25.0 * bend, 0.0], abs=1e-10)
    on = pos[pos[:, 0] > 10.0]
    assert np.abs(on[:, 1] - bend * (on[:, 0] - 10.0) ** 2).max() < 1e-7


def test_functions_and_exact_stops_find_the_programmed_place(
    tmp_path: Path,
) -> None:
    """M00 behind tiny blocks stands where they end; an exact stop at one is
    kept; the end is the last point.
    """
    text = (
        "G1 X5 F6000\nX5.00000004\nM0\nX10\nX10.00000006 Y0.00000003\n"
        "G60 X10.00000009\nG360\nX12\nX12.00000005\n"
    )
    with Inside(tmp_path, text, QUICK) as cnc:
        cnc.until(
            lambda: (
                len(cnc.pos) > 8
                and bool((cnc.pos[-8:] == cnc.pos[-1]).all())
                and cnc.pos[-1][0] > 1.0
            )
        )
        assert cnc.pos[-1] == pytest.approx([5.00000004, 0.0, 0.0], abs=1e-11)
        cnc.level(cnc.bahn.continue_machining, True)
        cnc.end()
        assert cnc.pos[-1] == pytest.approx(
            [12.00000005, 0.00000003, 0.0], abs=1e-11
        )
        speed = (
            np.linalg.norm(np.diff(cnc.pos, axis=0), axis=1) / cnc.cell.cycle_s
        )
        slowest = int(
            np.argmin(
                np.where(np.abs(cnc.pos[1:, 0] - 10.0) < 0.1, speed, np.inf)
            )
        )
        assert speed[slowest] < 0.01
        assert cnc.pos[slowest] == pytest.approx(
            [10.00000009, 0.00000003, 0.0], abs=5e-7
        )
        legal(cnc.pos, cnc.cell)


@pytest.mark.parametrize("jerk", [True, False])
@pytest.mark.parametrize("way", [1.1e-9, 3e-9, 8e-9, 2e-8])
def test_an_arc_is_left_backward_just_behind_its_start(
    tmp_path: Path, way: float, jerk: bool
) -> None:
    """A way back of so few mm to the start of the program keeps all limits of
    the plan, and the arc is driven to its end behind it.
    """
    text = "N10 G02 X10 Y0 R6 F6000\nN20 G01 X20\n"
    config = "" if jerk else NO_JERK
    with Inside(tmp_path, text, config, levels={"feedhold": True}) as cnc:
        insert = cnc.bahn.insert_cmd
        insert.enable_w = True
        insert.command_w.dist_or_pos = 1e4 * way
        insert.command_w.rel_abs_mode = 1
        insert.command_semaphor_rw = True
        cnc.run(20)
        cnc.level(cnc.bahn.feedhold, False)
        cnc.run(60)
        assert 0.0 < np.abs(cnc.pos[-1]).max() <= way
        cnc.level(cnc.bahn.backward_motion, True)
        cnc.run(60)
        assert (cnc.pos[-1] == 0.0).all()
        cnc.level(cnc.bahn.backward_motion, False)
        cnc.end()
        assert cnc.pos[-1] == pytest.approx([20.0, 0.0, 0.0], abs=1e-10)
        legal(cnc.pos, cnc.cell)
        assert int(cnc.engine.state.infeasible) == 0
