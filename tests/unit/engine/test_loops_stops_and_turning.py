"""What a hostile PLC found: each test is the smallest program and sequence of
commands that went wrong.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from support.commanded import NO_JERK
from support.inside import Inside
from support.limits import legal

pytestmark = pytest.mark.sanitize("engine")

LOOP = (
    "#RT WHILE\nN30 G1 X10 F6000\nN40 Y10\nN50 X0 Y0\n#RT ENDWHILE\nN70 X-5\n"
)


def _passes(cnc: Inside, cycles: int) -> int:
    """How often N30 begins again."""
    count, before = 0, 0
    for _ in range(cycles):
        cnc.run(1)
        block = int(cnc.state.block_number_r)
        count += before == 50 and block == 30
        before = block
    return count


@pytest.mark.parametrize(
    "ahead", ["", "N10 G1 F6000\n", "N10 G1 X1 F6000\nN20 X0\n"]
)
def test_a_loop_that_begins_the_program_is_repeated(
    tmp_path: Path, ahead: str
) -> None:
    """isg_contour_lookahead 9, T3: the PLC sets the loop's condition; nothing
    has to stand ahead of the loop.
    """
    with Inside(tmp_path, ahead + LOOP, levels={"rt_loop_enable": True}) as cnc:
        assert _passes(cnc, 1500) >= 2


@pytest.mark.parametrize("modulo", ["", " [MODULO]"])
def test_the_distance_is_continuous_where_a_loop_begins_again(
    tmp_path: Path, modulo: str
) -> None:
    """isg_contour_lookahead 5.5 and 8: no whole pass too much while it stands
    at ENDWHILE in single block.
    """
    with Inside(
        tmp_path,
        LOOP.replace("#RT WHILE", "#RT WHILE" + modulo),
        levels={"rt_loop_enable": True},
    ) as cnc:
        cnc.level(cnc.bahn.single_block, True)
        before, length = 0.0, 100_000 * (2 + np.sqrt(2))
        for k in range(3000):
            cnc.level(cnc.bahn.continue_machining, k % 200 > 100)
            cnc.run(1)
            now = float(cnc.state.dist_prog_start)
            step = now - before
            assert -1 <= step < 1100 or (
                modulo and abs(step + length) < 1100
            ), (k, before, now)
            before = now
        assert modulo or before > 1.2 * length


def _ahead(cnc: Inside) -> list[tuple[int, float, float]]:
    """N, start position and tangent_variation of what mode 2 tells."""
    return [
        (b["block_number"], b["start_position"], b["tangent_variation"])
        for b in cnc.request(cnc.state.dist_prog_start + 1, 1e9)
    ]


CORNER = "N10 G1 X10 F6000\n#RT WHILE\nN30 X20 Y10\nN40 X10\nN50 Y0\n#RT ENDWHILE\nN70 X20\n"
LENGTH = 100_000 * (2 + np.sqrt(2))


@pytest.mark.parametrize("modulo", ["", " [MODULO]"])
def test_mode_2_tells_the_pass_that_is_driven(
    tmp_path: Path, modulo: str
) -> None:
    """isg_contour_lookahead 8: copy 1 is measured against the block ahead of the
    loop, every other one against the loop's last element.
    """
    text = CORNER.replace("#RT WHILE", "#RT WHILE" + modulo)
    with Inside(tmp_path, text, levels={"rt_loop_enable": True}) as cnc:
        entry = _ahead(cnc)[1]
        assert entry == pytest.approx((30, 100_000, np.pi / 4))
        assert not cnc.state.inside_rt_loop_r
        cnc.until(lambda: cnc.state.inside_rt_loop_r)
        assert cnc.state.rt_loop_count_r == 0
        for passes in (1, 2):
            cnc.until(lambda n=passes: cnc.state.rt_loop_count_r == n)
            shift = 0 if modulo else passes * LENGTH
            cnc.until(lambda: cnc.state.block_number_r == 30)
            assert _ahead(cnc)[0] == pytest.approx(
                (30, 100_000 + shift, 3 * np.pi / 4)
            )
        cnc.level(cnc.bahn.rt_loop_enable, False)
        cnc.until(lambda: cnc.state.block_number_r == 70)
        assert not cnc.state.inside_rt_loop_r
        assert _ahead(cnc)[0][2] == pytest.approx(np.pi / 2)


def test_a_loop_that_is_not_enabled_is_left_out(tmp_path: Path) -> None:
    """[EXT] if the real-time variable is not set, the loop is skipped: the path
    does not stop for it, nothing of it is told or displayed.
    """
    with Inside(tmp_path, CORNER.replace("N70 X20", "N70 X20 Y0")) as cnc:
        assert [n for n, *_ in _ahead(cnc)] == [10]
        seen = set()
        while not cnc.state.program_end_r:
            cnc.run(1)
            seen.add(int(cnc.state.block_number_r))
            if cnc.state.block_number_r == 70:
                assert cnc.state.active_feed_r > 0 or cnc.state.program_end_r
            known = cnc.clah.state.max_dist_prog_start
            assert known >= cnc.state.dist_prog_start - 1e-3
        assert seen <= {0, 10, 70}
        assert cnc.state.dist_prog_start == pytest.approx(200_000)
        assert cnc.state.rt_loop_count_r == 0
        last = cnc.request(0, 1e9)[-1]
        assert last["block_number"] == 70
        assert last["start_position"] == pytest.approx(100_000)
        assert last["tangent_variation"] == pytest.approx(0.0)


def test_loops_can_be_left_out_backward_and_one_behind_the_other(
    tmp_path: Path,
) -> None:
    """Display and position agree wherever the path turns."""
    second = LOOP.replace("#RT WHILE\n", "X0 Y0\n#RT WHILE\n")
    text = LOOP + second.replace("X-5", "X-9")
    with Inside(tmp_path, text) as cnc:
        for k in range(12):
            cnc.level(cnc.bahn.backward_motion, k % 3 == 2)
            cnc.level(cnc.bahn.rt_loop_enable, k % 4 == 1)
            cnc.run(90)
            known = cnc.clah.state.max_dist_prog_start
            assert known >= cnc.state.dist_prog_start - 1e-3
        cnc.level(cnc.bahn.backward_motion, False)
        cnc.level(cnc.bahn.rt_loop_enable, False)
        cnc.end()
        assert cnc.pos[-1] == pytest.approx([-9, 0, 0])
        legal(cnc.pos, cnc.cell)


# ------------------------------------------------------------------------- inserted stops, turning
SQUARE = "N10 G1 F18000\nN20 X20\nN30 X10\nN40 Y10\nN50 X0\n"
Command = tuple[
    int, str, object
]  # cycle, level unit of bahn_mc_control or "insert", value


def _insert(cnc: Inside, distance: float, mode: int, m_function: int) -> None:
    unit = cnc.bahn.insert_cmd
    unit.command_w.dist_or_pos, unit.command_w.rel_abs_mode = distance, mode
    unit.command_w.axis_nr, unit.command_w.m_function_nr = 0, m_function
    unit.enable_w = unit.command_semaphor_rw = True


def _drive(cnc: Inside, commands: list[Command], cycles: int) -> None:
    """The commands at their cycles; at every cycle no jump, nothing infeasible."""
    last = cnc.cell.axis_values("start_mm")
    for k in range(cycles):
        for _, name, value in (c for c in commands if c[0] == k):
            if name == "insert":
                _insert(cnc, *value)  # type: ignore[misc]
            else:
                cnc.level(getattr(cnc.bahn, name), value)
        cnc.run(1)
        now = cnc.parts[-1][-1]
        assert np.abs(now - last).max() < 0.31, (k, last, now)
        assert cnc.engine.state.infeasible == 0, k
        last = now
    legal(cnc.pos, cnc.cell)


def test_an_insert_command_while_it_stands_at_an_inserted_stop(
    tmp_path: Path,
) -> None:
    """hli_reference 5.3, a new one replaces the old: the rest of the block is
    driven, not left out in one cycle.
    """
    text = "N10 G1 F6000\nN20 G1 X16.6501 Y-11.4414 Z18.2071\nN30 G1 X16.5866 Y-11.5615\n"
    with Inside(tmp_path, text) as cnc:
        inserted: list[Command] = [
            (88, "insert", (20000, 0, 0)),
            (150, "insert", (20000, 2, 1)),
        ]
        _drive(cnc, [*inserted, (400, "continue_machining", True)], 900)
        assert cnc.state.program_end_r


@pytest.mark.ci
def test_an_insert_command_shortly_ahead_of_a_sharp_corner(
    tmp_path: Path,
) -> None:
    """5.3: the path stops briefly; M01, not enabled, in a stop that lies where
    the path can just come to rest.
    """
    text = (
        "N10 G1 F18000\nN20 X0.0723 Y0.3203\n"
        "N30 G2 X-3.4852 Y2.3357 I-1.147 J2.1228\n"
        "N40 G0 X-3.4851 Y2.3372\n"
    )
    for cycle in range(60, 90):
        with Inside(tmp_path, text) as cnc:
            _drive(cnc, [(cycle, "insert", (1000, 2, 1))], 700)
            assert cnc.state.program_end_r


@pytest.mark.parametrize("hold", [False, True])
def test_backward_from_an_inserted_stop_at_the_end(
    tmp_path: Path, hold: bool
) -> None:
    """hli_reference 4.1 and 5.1: going back is no program end, and nothing is
    driven from another place.
    """
    commands: list[Command] = [
        (100, "insert", (600_000, 2, 0)),
        (1000, "backward_motion", True),
    ]
    if hold:
        commands += [(900, "feedhold", True), (1100, "feedhold", False)]
    with Inside(tmp_path, SQUARE) as cnc:
        _drive(cnc, commands, 2600)
        assert cnc.pos[-1] == pytest.approx([0, 0, 0])
        assert not cnc.state.program_end_r


@pytest.mark.parametrize("cycle", [280, 284, 286, 287, 295, 400, 520, 560])
def test_m00_is_not_lost_by_turning_at_it(tmp_path: Path, cycle: int) -> None:
    """isg_language 8, hli_reference 5.1: only continue_machining leaves M00."""
    text = (
        SQUARE.replace("N40", "M00\nN40") if cycle < 500 else SQUARE + "M00\n"
    )
    commands: list[Command] = [
        (cycle, "feedhold", True),
        (cycle + 150, "backward_motion", True),
        (cycle + 200, "backward_motion", False),
        (cycle + 250, "feedhold", False),
    ]
    with Inside(tmp_path, text) as cnc:
        _drive(cnc, commands, cycle + 600)
        assert cnc.state.wait_continue_r
        assert not cnc.state.program_end_r


def test_a_dwell_is_not_lost_by_turning_at_it(tmp_path: Path) -> None:
    """Turned around twice while it dwells: the dwell is made."""
    commands: list[Command] = [
        (290, "feedhold", True),
        (300, "backward_motion", True),
        (350, "backward_motion", False),
        (400, "feedhold", False),
    ]
    ended = []
    for dwell in ("", "G04 0.5\n"):
        with Inside(tmp_path, SQUARE.replace("N40", dwell + "N40")) as cnc:
            _drive(cnc, commands, 900)
            assert cnc.state.dist_prog_start >= 300_000
            ended.append(bool(cnc.state.program_end_r))
    assert ended == [True, False]  # 900 cycles are not enough with the dwell


@pytest.mark.ci
def test_turning_twice_at_the_end_of_the_path(tmp_path: Path) -> None:
    """The path comes to rest at its very end with backward motion commanded:
    turned again it stands where it stood.
    """
    text = (
        "N10 G1 F18000\nN30 G0 X14.5361 Y40.6046\nN40 G1 X-19.3452 Y27.5431\n"
    )
    for back in range(380, 460, 4):
        commands: list[Command] = [
            (back, "backward_motion", True),
            (back + 30, "feedhold", True),
            (back + 137, "backward_motion", False),
            (back + 200, "feedhold", False),
        ]
        with Inside(tmp_path, text) as cnc:
            _drive(cnc, commands, back + 600)
            assert cnc.state.program_end_r
            assert cnc.pos[-1] == pytest.approx([-19.3452, 27.5431, 0])


@pytest.mark.parametrize("turned", [60, 100])
@pytest.mark.parametrize("forward", [40, 200, 400])
def test_turned_at_the_end_the_program_ends_when_it_is_there_again(
    tmp_path: Path, turned: int, forward: int
) -> None:
    """The turn back comes so late that braking reaches the end: behind the turn forward the
    program had ended, wherever the path stood.
    """
    for text in ("G1 X8 F6000\n", "G1 X4 F6000\nX8\n", "G1 X4 F6000\nY4\n"):
        with Inside(tmp_path, text) as cnc:
            cnc.run(turned)
            cnc.level(cnc.bahn.backward_motion, True)
            cnc.run(forward)
            cnc.level(cnc.bahn.backward_motion, False)
            for _ in range(3000):
                cnc.run(1)
                if cnc.state.program_end_r:
                    break
            assert np.abs(cnc.pos[-1]).sum() == pytest.approx(8.0)


@pytest.mark.ci
def test_an_insert_command_replaces_one_that_is_still_ahead(
    tmp_path: Path,
) -> None:
    """hli_reference 5.3, a new one replaces the old, also when the old stop is
    already planned: no stop passed at speed (one where the path is already
    bound to come to rest stays).
    """
    text = "N50 G0 X-14.439 Y19.0161\nN60 G0 X-15.81 Y20.143\n"
    for gap in (1, 5, 12):
        for cycle in range(60, 100, 8):
            with Inside(tmp_path, text) as cnc:
                _drive(
                    cnc,
                    [
                        (cycle, "insert", (20000, 2, 0)),
                        (cycle + gap, "insert", (300_000, 2, 0)),
                    ],
                    700,
                )
                assert cnc.state.wait_continue_r


def test_turning_while_a_function_is_waited_for(tmp_path: Path) -> None:
    """Backward motion begins although the CNC waits for an acknowledgement with
    motion prepared behind it.
    """
    text = "N10 G1 X20 F6000\nN20 M8\nN30 X40\n"
    with Inside(tmp_path, text, '[channel.m_synch]\n8="MVS_SVS"') as cnc:
        cnc.until(lambda: bool(cnc.state.wait_techno_acknowledge_r))
        cnc.run(50)
        cnc.level(cnc.bahn.backward_motion, True)
        cnc.run(1000)
        assert abs(cnc.pos[-1][0]) < 1e-6


@pytest.mark.parametrize("jerk", [True, False])
def test_nothing_jumps_where_a_full_circle_is_left_out(
    tmp_path: Path, jerk: bool
) -> None:
    """The way to the end of a circle that is deleted at its start has no length:
    the path goes on behind it from rest.
    """
    text = "N10 G01 X10 F6000\nN20 M00\nN30 G02 X10 Y0 I5 J0\nN40 G01 X20\n"
    with Inside(tmp_path, text, "" if jerk else NO_JERK) as cnc:
        cnc.until(lambda: bool(cnc.state.wait_continue_r))
        cnc.level(cnc.bahn.delete_distance_to_go, True)
        cnc.run(5)
        cnc.level(cnc.bahn.delete_distance_to_go, False)
        for pressed in (True, False, True):  # M00 may be come to once more
            cnc.level(cnc.bahn.continue_machining, pressed)
            cnc.run(3)
        cnc.end(5000)
        assert cnc.pos[:, 1] == pytest.approx(0.0, abs=1e-9)
        assert cnc.pos[-1] == pytest.approx([20.0, 0.0, 0.0])
        legal(cnc.pos, cnc.cell)
