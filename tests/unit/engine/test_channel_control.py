"""Control of the channel through the HLI, one unit at a time, on the engine in this process."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core.engine import Event
from cnc_core.process.start_units import NO_FUNCTIONS
from hli import layout
from support.inside import Inside
from support.limits import legal

pytestmark = pytest.mark.sanitize("engine")

L_SHAPE = "N10 G1 X50 F6000\nN20 Y20\nN30 X0\nN40 Y0\n"
M8 = '[channel.m_synch]\n8="{}"'


def _insert(
    cnc: Inside, value: float, mode: int, axis: int = 0, m: int = 0
) -> None:
    unit = cnc.bahn.insert_cmd
    unit.enable_w = True
    command = unit.command_w
    (
        command.dist_or_pos,
        command.rel_abs_mode,
        command.axis_nr,
        command.m_function_nr,
    ) = value, mode, axis, m
    unit.command_semaphor_rw = True
    cnc.run(2)
    assert not unit.command_semaphor_rw


def _continue(cnc: Inside) -> None:
    for command in (True, False):
        cnc.level(cnc.bahn.continue_machining, command)
        cnc.run(1)


def _stops(cnc: Inside) -> list[float]:
    """Distances, mm, at which the path stood until the program's end; each stop is continued."""
    out = []
    while True:
        cnc.until(
            lambda: bool(cnc.state.wait_continue_r or cnc.state.program_end_r)
        )
        if cnc.state.program_end_r:
            return out
        assert cnc.state.stop_condition_r & 2048
        out.append(cnc.state.dist_prog_start / 10000.0)
        _continue(cnc)


# ---------------------------------------------------------------- inserted stops
@pytest.mark.parametrize(
    ("value", "mode", "axis", "stops"),
    [
        (60.0, 1, 0, [60.0]),
        (12.5, 1, 0, [12.5]),
        (50.0, 1, 0, [50.0]),
        (10.0, 1, 2, [60.0]),  # Y = 10 mm
        (500.0, 1, 0, [140.0]),  # beyond the end: at the end
    ],
)
def test_absolute_stop(
    value: float, mode: int, axis: int, stops: list[float], tmp_path: Path
) -> None:
    """An absolute stop stands where it was asked for, in a block, at its end,
    at an axis position, at the end.
    """
    with Inside(tmp_path, L_SHAPE) as cnc:
        cnc.until(lambda: cnc.state.dist_prog_start > 20_000)
        _insert(cnc, value * 10000, mode, axis)
        assert _stops(cnc) == pytest.approx(stops, abs=1e-6)
        legal(cnc.pos, cnc.cell)
        assert cnc.engine.state.infeasible == 0


def test_relative_stops(tmp_path: Path) -> None:
    """Relative once counts from where the command came; repeated stops follow
    each other at that distance.
    """
    with Inside(tmp_path, L_SHAPE) as cnc:
        cnc.until(lambda: cnc.state.dist_prog_start > 50_000)
        at = cnc.state.dist_prog_start / 10000
        _insert(cnc, 300_000, 0)
        stops = _stops(cnc)
        assert np.diff([*stops]) == pytest.approx(
            [30.0] * (len(stops) - 1), abs=1e-6
        )
        assert stops[0] == pytest.approx(at + 30, abs=0.3)
        assert len(stops) == 4
        assert cnc.bahn.insert_cmd.state_r.distance_of_next_stop == -1.0


def test_a_stop_too_near_stands_as_soon_as_possible(tmp_path: Path) -> None:
    """A stop nearer than the path can brake stands where it can; the state
    tells where the next stop is.
    """
    with Inside(tmp_path, "N10 G1 X200 F18000\n") as cnc:
        cnc.until(lambda: cnc.state.dist_prog_start > 500_000)
        at = cnc.state.dist_prog_start / 10000
        _insert(cnc, (at + 1) * 10000, 1)
        cnc.run(20)
        told = cnc.bahn.insert_cmd.state_r.distance_of_next_stop / 10000
        assert _stops(cnc) == pytest.approx([told], abs=1e-6)
        assert at + 1 < told < at + 30
        legal(cnc.pos, cnc.cell)


def test_a_new_insert_replaces_the_old_and_zero_deletes(tmp_path: Path) -> None:
    """Of two commands the second counts; relative 0 deletes."""
    with Inside(tmp_path, L_SHAPE) as cnc:
        cnc.run(20)
        _insert(cnc, 600_000, 1)
        cnc.run(20)
        _insert(cnc, 900_000, 1)
        assert _stops(cnc) == pytest.approx([90.0], abs=1e-6)
    with Inside(tmp_path, L_SHAPE) as cnc:
        cnc.run(20)
        _insert(cnc, 600_000, 1)
        cnc.run(20)
        _insert(cnc, 0.0, 0)
        assert _stops(cnc) == []


def test_an_inserted_function_is_waited_for(tmp_path: Path) -> None:
    """An inserted M function goes to the PLC as MVS_SVS, at the place asked for, once."""
    with Inside(tmp_path, L_SHAPE) as cnc:
        cnc.run(20)
        _insert(cnc, 700_000, 1, m=77)
        unit = cnc.channel.techno_unit_std_sync[0]
        cnc.until(lambda: bool(unit.please_rw))
        assert int.from_bytes(bytes(unit.attribut_r.data[:4]), "little") == 77
        cnc.run(300)
        assert cnc.state.dist_prog_start == pytest.approx(700_000, abs=1e-3)
        assert cnc.state.wait_techno_acknowledge_r
        unit.please_rw = False
        cnc.run(5)
        unit.done_w = True
        cnc.end()
        assert not unit.please_rw


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1e300])
def test_a_wrong_insert_is_taken_and_does_nothing(
    value: float, tmp_path: Path
) -> None:
    """Numbers that are none are taken off the unit and counted."""
    with Inside(tmp_path, L_SHAPE) as cnc:
        cnc.run(5)
        _insert(cnc, value, 1)
        assert cnc.engine.state.bad_commands == 1
        assert _stops(cnc) == []


# ---------------------------------------------------------------- delete distance to go
def test_delete_distance_to_go(tmp_path: Path) -> None:
    """The rising edge brakes and leads straight to the end of the next motion
    block; functions between are not lost.
    """
    with Inside(
        tmp_path,
        "N10 G1 X50 F6000\nN15 M8\nN20 Y20\nN30 X0\nN40 Y0\n",
        M8.format("MOS"),
    ) as cnc:
        cnc.until(lambda: cnc.state.dist_prog_start > 200_000)
        cnc.level(cnc.bahn.delete_distance_to_go, True)
        cnc.run(1)
        assert cnc.bahn.delete_distance_to_go.state_r
        assert cnc.state.delete_distance_to_go_active_r
        cnc.end()
        assert cnc.channel.techno_unit_std_sync[0].please_rw
        corner = np.abs(cnc.pos - [50.0, 20.0, 0.0]).max(axis=1).argmin()
        turn = np.flatnonzero(cnc.pos[:, 1] > 1e-9)[0]
        way = cnc.pos[turn:corner]
        straight, driven = (
            np.array([50.0, 20.0]) - cnc.pos[turn - 1, :2],
            way[:, :2] - cnc.pos[turn - 1, :2],
        )
        off = (
            straight[0] * driven[:, 1] - straight[1] * driven[:, 0]
        ) / np.linalg.norm(straight)
        assert np.abs(off).max() < 1e-2
        assert cnc.pos[-1] == pytest.approx([0, 0, 0])
        assert cnc.state.dist_prog_start == pytest.approx(1_400_000)
        assert not cnc.state.delete_distance_to_go_active_r
        legal(cnc.pos, cnc.cell)


def test_delete_distance_to_go_to_a_mark(tmp_path: Path) -> None:
    """With a valid end mark the path leads straight to it; a mark without a
    common bit does not count.
    """
    text = (
        "N10 G1 X50 F6000\nN20 Y20\n#DEL DIST2GO [END = 8]\nN30 X40\n"
        "N40 Y30\n#DEL DIST2GO [END = 4]\nN50 X0\n"
    )
    with Inside(tmp_path, text) as cnc:
        cnc.level(cnc.bahn.del_dist_to_go_end, 4)
        cnc.until(lambda: cnc.state.dist_prog_start > 200_000)
        cnc.level(cnc.bahn.delete_distance_to_go, True)
        cnc.end()
        assert not (cnc.pos[:, 0] > 40.001).any()
        assert (np.abs(cnc.pos - [40.0, 30.0, 0.0]).max(axis=1) < 0.2).any()
        assert cnc.pos[-1] == pytest.approx([0, 30, 0])


def test_delete_distance_to_go_in_the_last_block(tmp_path: Path) -> None:
    """Without a next motion the rest is left out; the next program starts where the axes stand."""
    with Inside(tmp_path, "N10 G1 X50 F6000\n#FLUSH WAIT\nN20 X60\n") as cnc:
        cnc.until(lambda: cnc.state.dist_prog_start > 200_000)
        cnc.level(cnc.bahn.delete_distance_to_go, True)
        cnc.end()
        assert cnc.pos[-1] == pytest.approx([60, 0, 0])
        legal(cnc.pos, cnc.cell)
        assert np.diff(cnc.pos[:, 0]).min() > -1e-9


def test_backward_motion_waits_for_the_way_back_to_the_path(
    tmp_path: Path,
) -> None:
    """The rest of a block is deleted, and the axes stand beside the path: there
    is nothing to turn back on.
    """
    with Inside(
        tmp_path, "N10 G1 X50 F6000\n#FLUSH WAIT\nN15 G4 X0.05\nN20 Y20\n"
    ) as cnc:
        cnc.until(lambda: cnc.state.dist_prog_start > 200_000)
        cnc.level(cnc.bahn.feedhold, True)
        cnc.run(200)
        cnc.level(cnc.bahn.delete_distance_to_go, True)
        cnc.run(50)
        cnc.level(cnc.bahn.backward_motion, True)
        cnc.run(50)
        cnc.level(cnc.bahn.backward_motion, False)
        cnc.level(cnc.bahn.feedhold, False)
        cnc.end()
        assert cnc.pos[-1] == pytest.approx([50, 20, 0])
        legal(cnc.pos, cnc.cell)


# ---------------------------------------------------------------- backward
def test_storage_clear_bounds_backward_motion(tmp_path: Path) -> None:
    """Backward motion ends at #BACKWARD STORAGE CLEAR; the distance falls on
    the way; mode 1 stays readable.
    """
    path = "N10 G1 X20 F6000\n#BACKWARD STORAGE CLEAR\nN20 Y20\nN30 X0\n"
    text = f"#CONTOUR LOOKAHEAD LOG ON\n{path}#CONTOUR LOOKAHEAD LOG OFF\n"
    with Inside(tmp_path, text) as cnc:
        cnc.until(
            lambda: (
                cnc.state.block_number_r == 30
                and cnc.state.dist_prog_start > 450_000
            )
        )
        before = cnc.request(0, 0)
        cnc.level(cnc.bahn.backward_motion, True)
        seen = []
        for _ in range(800):
            cnc.run(1)
            seen.append(cnc.state.dist_prog_start)
        assert cnc.request(0, 0) == before
        assert cnc.pos[-1] == pytest.approx([20, 0, 0])
        assert cnc.state.dist_prog_start == pytest.approx(200_000)
        turned = int(np.argmax(seen))
        assert (np.diff(seen[turned:]) <= 1e-9).all()
        cnc.level(cnc.bahn.backward_motion, False)
        cnc.end()
        assert cnc.pos[-1] == pytest.approx([0, 20, 0])


def test_backward_motion_has_a_speed_of_its_own(tmp_path: Path) -> None:
    """VEL_GO_LINE_RETRACE of the cell: backward 600 mm/min, forward again faster."""
    with Inside(
        tmp_path,
        "N10 G1 X20 F6000\nN20 G0 Y20\nN30 G1 X0\n",
        "[isons]\nVEL_GO_LINE_RETRACE = 600\n",
    ) as cnc:
        cnc.until(lambda: cnc.state.block_number_r == 30)
        cnc.level(cnc.bahn.backward_motion, True)
        cnc.run(1000)
        seen = -np.diff(_distances(cnc, 1500))
        assert seen.max() == pytest.approx(
            10.0 * 10, rel=0.02
        )  # 0.1 um a cycle
        cnc.level(cnc.bahn.backward_motion, False)
        cnc.run(300)
        assert np.diff(_distances(cnc, 100)).max() > 800.0
        cnc.end()


def _distances(cnc: Inside, cycles: int) -> list[float]:
    found = []
    for _ in range(cycles):
        cnc.run(1)
        found.append(cnc.state.dist_prog_start)
    return found


def test_without_storage_there_is_no_backward_motion(tmp_path: Path) -> None:
    """fb_storage_size 0: backward motion and deleted distance to go are not available."""
    with Inside(tmp_path, L_SHAPE, "[channel]\nfb_storage_size = 0") as cnc:
        cnc.run(100)
        cnc.level(cnc.bahn.backward_motion, True)
        cnc.level(cnc.bahn.delete_distance_to_go, True)
        cnc.end()
        assert cnc.state.dist_prog_start == pytest.approx(1_400_000)


@pytest.mark.parametrize(
    ("synch", "waits"), [("MVS_SVS", False), ("MVS_SVS | BWD_SYNCH", True)]
)
def test_functions_in_backward_motion(
    synch: str, waits: bool, tmp_path: Path
) -> None:
    """Backward, a function is put out without being waited for, unless it is flagged BWD_SYNCH."""
    with Inside(
        tmp_path, "N10 G1 X20 F6000\nN20 M8\nN30 X40\n", M8.format(synch)
    ) as cnc:
        unit = cnc.channel.techno_unit_std_sync[0]
        cnc.until(lambda: bool(unit.please_rw))
        unit.please_rw, unit.done_w = False, True
        cnc.until(lambda: cnc.state.dist_prog_start > 250_000)
        cnc.level(cnc.bahn.backward_motion, True)
        cnc.until(lambda: bool(unit.please_rw))
        unit.please_rw = False
        cnc.run(1000)
        assert bool(cnc.state.wait_techno_acknowledge_r) is waits
        assert cnc.pos[-1][0] == pytest.approx(20.0 if waits else 0.0)
        unit.done_w = True
        cnc.run(1000)
        assert cnc.pos[-1][0] == pytest.approx(0.0)


def test_simulated_motion_does_not_wait_for_functions(tmp_path: Path) -> None:
    """simulate_motion: functions ahead go out as MOS, the path does not wait for them."""
    with Inside(
        tmp_path, "N10 G1 X20 F6000\nN20 M8\nN30 X40\n", M8.format("MVS_SVS")
    ) as cnc:
        cnc.level(cnc.bahn.simulate_motion, True)
        cnc.end(3000)
        assert cnc.channel.techno_unit_std_sync[0].please_rw


# ---------------------------------------------------------------- speed
def test_external_speed_forward_and_backward(tmp_path: Path) -> None:
    """ext_command_speed replaces the programmed feed; negative drives backward;
    active_feed_r has its sign.
    """
    with Inside(tmp_path, L_SHAPE) as cnc:
        cnc.run(200)
        cnc.level(cnc.bahn.ext_command_speed, 20_000)
        cnc.level(cnc.bahn.ext_command_speed_valid, True)
        cnc.run(300)
        assert cnc.state.active_feed_r == 20_000
        cnc.level(cnc.bahn.ext_command_speed, -30_000)
        cnc.run(300)
        assert cnc.state.active_feed_r == -30_000
        assert cnc.state.backward_active_r
        cnc.bahn.ext_command_speed_valid.enable_w = False
        cnc.end()
        legal(cnc.pos, cnc.cell)


def test_feed_hold_of_one_axis(tmp_path: Path) -> None:
    """A held axis that stands does not stop the others; the path stands ahead
    of its next motion.
    """
    with Inside(tmp_path, L_SHAPE) as cnc:
        cnc.axes[1].head.plc_present_w = True
        cnc.run(100)
        cnc.level(cnc.axes[1].ipo_mc_control.feedhold, True)
        cnc.run(2000)
        assert cnc.pos[-1] == pytest.approx([50, 0, 0], abs=1e-6)
        assert cnc.state.stop_condition_r & 2
        cnc.level(cnc.axes[1].ipo_mc_control.feedhold, False)
        cnc.run(80)
        cnc.level(cnc.axes[1].ipo_mc_control.feedhold, True)
        cnc.run(500)
        assert 0 < cnc.pos[-1][1] < 20
        cnc.level(cnc.axes[1].ipo_mc_control.feedhold, False)
        cnc.end()
        legal(cnc.pos, cnc.cell)


@pytest.mark.parametrize(
    "unit", ["drive_on", "torque_permission", "release_feedhold"]
)
def test_an_axis_that_is_not_released_holds_the_path(
    unit: str, tmp_path: Path
) -> None:
    """Drive enables and the feed release of every axis are needed, with bit 12 while they miss."""
    with Inside(tmp_path, L_SHAPE) as cnc:
        cnc.axes[2].head.plc_present_w = True
        cnc.level(getattr(cnc.axes[2].lr_mc_control, unit), False)
        cnc.engine.hold_start(True)
        cnc.run(2)
        cnc.engine.hold_start(False)
        cnc.run(300)
        assert cnc.state.dist_prog_start == 0
        assert cnc.state.stop_condition_r & 4096
        cnc.level(getattr(cnc.axes[2].lr_mc_control, unit), True)
        cnc.end()


# ---------------------------------------------------------------- modes
def _mode(
    cnc: Inside, state: int, mode: int = 2, parameter: bytes = b""
) -> None:
    unit = cnc.channel.channel_mc_control.mode_and_state
    unit.enable_w = True
    (
        unit.command_w.to_mode,
        unit.command_w.to_state,
        unit.command_w.parameter,
    ) = mode, state, parameter
    unit.command_semaphor_rw = True


def test_stop_and_resume(tmp_path: Path) -> None:
    """ACTIVE to HOLD brakes and stands, bit 10; HOLD to ACTIVE goes on; the
    semaphore falls in that cycle.
    """
    with Inside(tmp_path, L_SHAPE) as cnc:
        unit = cnc.channel.channel_mc_control.mode_and_state
        cnc.run(100)
        _mode(cnc, 5)
        cnc.run(1)
        assert not unit.command_semaphor_rw
        assert unit.state_r.state == layout.HLI_IMCM_PROCESS_STOPPING
        cnc.run(300)
        assert unit.state_r.state == layout.HLI_IMCM_PROCESS_HOLD
        assert cnc.state.stop_condition_r & 1024
        stood = cnc.state.dist_prog_start
        cnc.run(100)
        assert cnc.state.dist_prog_start == stood
        _mode(cnc, 4)
        cnc.end()
        legal(cnc.pos, cnc.cell)


@pytest.mark.parametrize(
    ("mode", "state"),
    [(0, 3), (6, 3), (2, 6), (2, 0), (1, 4), (2, 14), (2, 2**32 - 1)],
)
def test_an_impossible_target_is_an_error_and_nothing_else(
    mode: int, state: int, tmp_path: Path
) -> None:
    """Error 270061 in mc_error; the command is taken, nothing happens."""
    with Inside(tmp_path, L_SHAPE) as cnc:
        cnc.channel.mc_error.enable_w = True
        cnc.run(50)
        _mode(cnc, state, mode)
        cnc.run(2)
        assert not cnc.channel.channel_mc_control.mode_and_state.command_semaphor_rw
        assert cnc.channel.mc_error.semaphor_rw
        assert cnc.channel.mc_error.satz_r.kopf.error_id == 270061
        cnc.end()
        assert Event.MODE_COMMAND not in cnc.events


def test_errors_queue_behind_one_the_plc_has_not_taken(tmp_path: Path) -> None:
    """Each record waits until the one before it has been taken; the order is kept."""
    with Inside(tmp_path, L_SHAPE) as cnc:
        record = cnc.channel.mc_error
        record.enable_w = True
        for _ in range(3):
            _mode(cnc, 9)
            cnc.run(1)
        taken = 0
        while record.semaphor_rw:
            taken += 1
            record.semaphor_rw = False
            cnc.run(2)
        assert taken == 3


def test_error_record_of_the_plc(tmp_path: Path) -> None:
    """lc_error is taken, its number reaches the cell."""
    with Inside(tmp_path, L_SHAPE) as cnc:
        record = cnc.channel.lc_error
        record.satz_r.kopf.error_id, record.satz_r.kopf.reaction_class = 4711, 3
        record.semaphor_rw = True
        assert cnc.engine.run(5) is Event.PLC_ERROR
        assert not record.semaphor_rw
        assert cnc.engine.take_plc_error() == (4711, 3)


# ---------------------------------------------------------------- watchdogs
def test_watchdog_of_the_plc(tmp_path: Path) -> None:
    """alive_state_r rises with the first sign of life; a miss lets it fall for
    good, with error 270053.
    """
    with Inside(tmp_path, L_SHAPE) as cnc:
        dog = cnc.channel.head.mc_watchdog
        dog.cycle_time_w, dog.enable_w = 50_000, True
        cnc.run(100)
        assert not dog.alive_state_r
        for _ in range(5):
            dog.alive_rw = True
            cnc.run(40)
            assert not dog.alive_rw
            assert dog.alive_state_r
        while (event := cnc.engine.run(200)) is Event.NEED_BLOCKS:
            cnc.preparation.pump()
        assert event is Event.WATCHDOG
        cnc.engine.run(1)
        assert not dog.alive_state_r
        assert cnc.channel.mc_error.satz_r.kopf.error_id == 270053
        dog.alive_rw = True
        cnc.engine.run(5)
        assert not dog.alive_state_r


def test_watchdog_of_the_cnc(tmp_path: Path) -> None:
    """The CNC sets lc_watchdog.alive_rw again and again while it is enabled."""
    with Inside(tmp_path, L_SHAPE) as cnc:
        dog = cnc.channel.head.lc_watchdog
        cnc.run(3)
        assert not dog.alive_rw
        dog.enable_w = True
        for _ in range(3):
            dog.alive_rw = False
            cnc.run(1)
            assert dog.alive_rw


# ---------------------------------------------------------------- spindle
SPINDLE = """[axes.X]
[axes.Y]
[axes.Z]
[spindles.S]
id = 6
m3_synch="MVS_SVS"
m5_synch="MOS"
m19_synch="MOS"
s_synch="MOS"
"""


def _spindle(cnc: Inside) -> layout.HLI_S_PROZESS:
    unit = cnc.axes[3].techno_unit_std_sync[0]
    cnc.until(lambda: bool(unit.please_rw), limit=5000)
    assert unit.fkt_ctrl_r == 3
    data = layout.HLI_S_PROZESS.from_buffer_copy(
        bytes(unit.attribut_r.data)[: ctypes.sizeof(layout.HLI_S_PROZESS)]
    )
    unit.please_rw = False
    return data


def test_spindle_functions_go_to_the_spindles_axis(tmp_path: Path) -> None:
    """M3 with its speed is waited for, a new S is told, M5 stops; all in the
    spindle's axis area.
    """
    text = (
        "N10 S1000 M3\nN20 G1 X10 F6000\nN30 S2000\nN40 X20\nN50 M5\nN60 X30\n"
    )
    with Inside(tmp_path, text, SPINDLE) as cnc:
        axis = cnc.axes[3]
        axis.head.plc_present_w = True
        first = _spindle(cnc)
        assert (
            first.move_cmd,
            first.pos_cmd,
            first.rev,
            first.axis_nr,
            first.satz_nr,
        ) == (3, 0, 6_000_000, 6, 10)
        cnc.run(200)
        assert cnc.state.dist_prog_start == 0
        axis.techno_unit_std_sync[0].done_w = True
        second = _spindle(cnc)
        assert (second.move_cmd, second.rev) == (3, 12_000_000)
        third = _spindle(cnc)
        assert third.move_cmd == 5
        cnc.end()
        assert not any(
            unit.please_rw for unit in cnc.channel.techno_unit_std_sync
        )


def test_spindle_without_plc_present_is_acknowledged(tmp_path: Path) -> None:
    """The axis' own plc_present_w counts: without it spindle functions count as acknowledged."""
    with Inside(tmp_path, "N10 S1000 M3\nN20 G1 X10 F6000\n", SPINDLE) as cnc:
        cnc.end()
        assert cnc.engine.state.techno_unseen == 1


def test_the_speed_of_the_spindle_is_shown(tmp_path: Path) -> None:
    """The programmed one, and that of now: negative for M4, 0 behind M5."""
    text = "N10 S1000 M4\nN20 G1 X10 F6000\nN30 M5\nN40 X20\n"
    with Inside(tmp_path, text, SPINDLE + 'm4_synch="MOS"\n') as cnc:
        state = cnc.axes[3].lr_state
        cnc.until(lambda: bool(state.active_rev_r))
        turns = state.cmd_rev_r, state.active_rev_r, state.current_rev_r
        assert turns == (6_000_000, -6_000_000, -6_000_000)
        cnc.end()
        assert (state.active_rev_r, state.current_rev_r) == (0, 0)


def test_axes_tell_who_they_are(tmp_path: Path) -> None:
    """By the names of the manual: in the channel and in their own areas."""
    with Inside(tmp_path, L_SHAPE, SPINDLE) as cnc:
        coord = cnc.state.coord_r[1]
        assert coord.axis_name_r.zeichen == coord.name
        assert coord.log_axis_nr_r == cnc.axes[1].ipo_state.log_achs_nr_r == 2
        kinds = [cnc.axes[k].ipo_state.type_r for k in (1, 3)]
        assert kinds == [1, 4]
        turns = [cnc.axes[k].ipo_state.spindle_axis_r for k in (1, 3)]
        assert turns == [False, True]


def test_functions_can_be_suppressed(tmp_path: Path) -> None:
    """Execution mode 0x2000: no function goes to the PLC, none is waited for."""
    assert NO_FUNCTIONS == 0x2000
    with Inside(
        tmp_path, "N10 G1 X10 F6000\nN20 M8\nN30 X20\n", M8.format("MVS_SVS")
    ) as cnc:
        cnc.engine.suppress_functions(True)
        cnc.end()
        assert not cnc.channel.techno_unit_std_sync[0].please_rw


def level_units(channel: Any) -> list[str]:
    """Names of the level units of bahn_mc_control."""
    return [
        n
        for n, t in layout.HLI_BAHN_MC_CONTROL._fields_
        if t is layout.MC_CONTROL_BOOL_UNIT
    ]  # type: ignore[misc]


def test_every_level_unit_shows_its_state(tmp_path: Path) -> None:
    """state_r follows command_w while enabled and present, and falls back to
    the default otherwise.
    """
    with Inside(tmp_path, L_SHAPE) as cnc:
        for name in level_units(cnc.channel):
            unit = getattr(cnc.bahn, name)
            cnc.level(unit, True)
            cnc.run(1)
            assert unit.state_r, name
            unit.enable_w = False
            cnc.run(1)
            assert not unit.state_r, name


def test_what_the_cnc_shows_is_shown_again_whoever_overwrites_it(
    tmp_path: Path,
) -> None:
    """Status members hold the CNC's values behind every cycle, also those that
    did not change in it.
    """
    with (
        Inside(tmp_path, L_SHAPE) as first,
        Inside(tmp_path, L_SHAPE) as second,
    ):
        for cnc in (first, second):
            cnc.run(40)
        for member in (
            "dist_prog_start",
            "command_feed_r",
            "block_number_r",
            "stop_condition_r",
            "override_r",
        ):
            setattr(second.state, member, 7)
        for member in (
            "feedhold_active_r",
            "program_end_r",
            "dwell_time_active_r",
            "wait_continue_r",
        ):
            setattr(second.state, member, True)
        second.bahn.override.state_r, second.bahn.feedhold.state_r = 3, True
        second.channel.contour_lookahead.state.max_dist_prog_start = -1.0
        second.channel.channel_mc_control.mode_and_state.state_r.mode = 99
        for cnc in (first, second):
            cnc.run(1)
        second.state.prog_name_r = first.state.prog_name_r
        for part in (
            "bahn_state",
            "bahn_mc_control",
            "decoder_state",
            "channel_mc_control",
        ):
            assert bytes(getattr(first.channel, part)) == bytes(
                getattr(second.channel, part)
            ), part
        assert bytes(first.channel.contour_lookahead.state) == bytes(
            second.channel.contour_lookahead.state
        )
