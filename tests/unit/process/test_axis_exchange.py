"""Axes that go from channel to channel: #CALL AX, #PUT AX, #SET AX."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import parse_config, setups_of
from cnc_core.config.exchange import axes_of, places_of
from cnc_core.errors import CncError
from cnc_core.frontend.axes import OpenAxes
from cnc_core.program import Program
from hli import layout
from support.channels import AUTOMATIC, Channels

TABLE = """
[channels.mill]
guest_axes = [5]
[channels.mill.axes.X]
[channels.mill.axes.Y]
[channels.loader]
[channels.loader.axes.X]
[channels.loader.axes.Z]
v_max_mm_s = 100.0
a_max_mm_s2 = 500.0
j_max_mm_s3 = 4000.0
id = 5
min_mm = -10.0
max_mm = 60.0
start_mm = 7.0
[channels.saw]
guest_axes = [5]
[channels.saw.axes.Y]
id = 6
"""
Z = 3  # gpAx index of the axis: behind X and Y of the mill, X of the loader


def error_of(cnc: Channels, index: int) -> CncError:
    preparation = cnc.channels[index].preparation
    assert preparation is not None
    assert preparation.error is not None
    return preparation.error


def shown(cnc: Channels, index: int) -> list[tuple[int, str]]:
    """Number and name at each place of a channel, as the PLC sees them."""
    return [
        (int(coord.log_axis_nr_r), coord.name.decode())
        for coord in list(cnc.state(index).coord_r)[:3]
    ]


@pytest.mark.sanitize
def test_an_axis_goes_to_another_channel(tmp_path: Path) -> None:
    """The loader moves its axis and puts it; the mill calls it where it stands,
    under a name of its own, and moves it on; both show what they have, and the
    axis has its one area all the time.
    """
    loader = "N10 G1 Z20 F6000\nN20 #PUT AX [Z]\nN30 X50\nN40 M30\n"
    mill = (
        "N10 G1 X3 F6000\nN20 #CALL AX [Z2,5,2]\nN30 G91 Z2=10\nN35 G4 X0.1\n"
        "N40 G90 X8\nN50 M30\n"
    )
    with Channels(tmp_path, [mill, loader, None], TABLE) as cnc:
        assert shown(cnc, 0) == [(1, "X"), (2, "Y"), (0, "")]
        cnc.until(lambda: shown(cnc, 0)[2] == (5, "Z2"))
        assert shown(cnc, 0)[:2] == [(1, "X"), (2, "Y")]
        assert shown(cnc, 1)[1] == (0, "")
        assert shown(cnc, 1)[0][1] == "X"
        assert cnc.positions(0)[2] == pytest.approx(20.0, abs=0.01)
        cnc.until(lambda: cnc.positions(0)[0] > 3.0)
        assert cnc.positions(0)[2] == 30.0
        lr_state = cnc.root.axis[Z].lr_state
        assert lr_state.active_position_acs_r == 300_000
        assert cnc.state(0).coord_r[2].act_position_r == 300_000
        assert cnc.end()[:2] == ["completed", "completed"]
        cnc.run(2)
        assert cnc.positions(1) == [50.0, 30.0]
        assert shown(cnc, 1)[1] == (5, "Z")
        assert shown(cnc, 0)[2] == (0, "")


@pytest.mark.parametrize("number", range(3))
def test_limits_come_with_the_axis(tmp_path: Path, number: int) -> None:
    """The axis moves in the other channel as it may, no faster; its range
    holds there.
    """
    key, order = (("v", 1), ("a", 2), ("j", 3))[number]
    most = {"v": 100.0, "a": 500.0, "j": 4000.0}[key]
    loader = "N10 #PUT AX [Z]\nN20 M30\n"
    mill = "N20 #CALL AX [Z2,5,2]\nN30 G0 Z2=55\nN40 M30\n"
    with Channels(tmp_path, [mill, loader, None], TABLE) as cnc:
        cnc.until(lambda: shown(cnc, 0)[2] == (5, "Z2"))
        track = []
        while not cnc.channels[0].ended_at:
            track.append(cnc.positions(0)[2])
            cnc.run(1)
        assert track[-1] == 55.0
        found = np.abs(np.diff(track, order)).max() / 0.001**order
        assert 0.8 * most < found < 1.02 * most


def test_the_range_of_the_axis_holds(tmp_path: Path) -> None:
    """Beyond the axis's own software limit: the error of the channel that has it."""
    mill = "N20 #CALL AX [Z2,5,2]\nN30 G1 Z2=61 F600\nN40 M30\n"
    with Channels(tmp_path, [mill, None, None], TABLE) as cnc:
        assert cnc.end() == ["error", "unused", "unused"]
        assert error_of(cnc, 0).code == 903001
        assert "axis Z2 would reach 61" in error_of(cnc, 0).text
        assert "-10 to 60" in error_of(cnc, 0).text
        cnc.run(2)
        assert shown(cnc, 1)[1] == (5, "Z")
        assert cnc.positions(1)[1] == 7.0


@pytest.mark.ci
@pytest.mark.sanitize
def test_back_and_forth_fifty_times(tmp_path: Path) -> None:
    """Two channels move one axis by turns; the way of each is what its text says,
    and the axis ends where both together have brought it.
    """
    times = 50
    mill = (
        f"$FOR P1=1,{times},1\n#WAIT [ID=1 CH=2]\n#CALL AX [A,5,2]\n"
        "G91 G1 A=2 X1 F60000\n#PUT AX [A]\n#SIGNAL [ID=2 CH=2]\n$ENDFOR\nM30\n"
    ).replace("A=2", "A2")
    loader = (
        f"$FOR P1=1,{times},1\nG91 G1 Z-1.5 X2 F60000\n#PUT AX [Z]\n"
        "#SIGNAL [ID=1 CH=1]\n#WAIT [ID=2 CH=1]\n#CALL AX [Z,5,1]\n$ENDFOR\nM30\n"
    )
    with Channels(tmp_path, [mill, loader, None], TABLE) as cnc:
        assert cnc.end()[:2] == ["completed", "completed"]
        assert cnc.positions(0)[0] == pytest.approx(times * 1.0, abs=1e-9)
        assert cnc.positions(1) == pytest.approx(
            [times * 2.0, 7.0 + times * (2.0 - 1.5)], abs=1e-9
        )


def test_who_comes_second_waits(tmp_path: Path) -> None:
    """Three channels want the axis: each waits until the one before has put it,
    told as a wait for that channel; the path of the others goes on meanwhile.
    """
    loader = "N10 G1 Z8 F60\nN20 #PUT AX [Z]\nN30 M30\n"
    mill = "N20 #CALL AX [Z2,5,2]\nN30 G1 Z2=9 F60\nN40 #PUT AX ALL\nN50 M30\n"
    saw = "N10 G1 Y5 F600\nN20 #CALL AX [W,5,1]\nN30 G1 W10 F600\nN40 M30\n"
    with Channels(tmp_path, [mill, loader, saw], TABLE) as cnc:
        cnc.run(600)
        assert cnc.positions(2) == [5.0, 0.0]
        said = [w.what for w in cnc.channels[0].waits.now()]
        assert said == ["axis 5 (Z2), which channel loader has"]
        cnc.until(lambda: shown(cnc, 0)[2][0] == 5, 10)
        assert cnc.positions(0)[2] == pytest.approx(8.0, abs=0.01)
        cnc.until(lambda: shown(cnc, 2)[1] == (5, "W"), 10)
        assert cnc.positions(2)[1] == pytest.approx(9.0, abs=0.1)
        assert cnc.end() == ["completed"] * 3
        cnc.run(2)
        assert cnc.positions(1)[1] == 10.0


def test_a_deadlock_of_axes_and_signals_is_told(tmp_path: Path) -> None:
    """The mill waits for the axis, the loader, which has it, for a signal of the
    mill: both end with an error that says so.
    """
    mill = "N20 #CALL AX [Z2,5,2]\nN30 #SIGNAL [ID=1 CH=2]\nN40 M30\n"
    loader = "N10 #WAIT [ID=1 CH=1]\nN20 #PUT AX [Z]\nN30 M30\n"
    with Channels(tmp_path, [mill, loader, None], TABLE) as cnc:
        cnc.plc = True
        assert cnc.end() == ["error", "error", "unused"]
        for index in (0, 1):
            error = error_of(cnc, index)
            assert error.code == 907056
            assert "axis 5 (Z2), which channel loader has" in error.text
            assert "waits for signal 1 of channel mill" in error.text


def test_a_reset_gives_the_axis_back(tmp_path: Path) -> None:
    """The PLC resets the channel in the middle of its motion with the axis: the
    axis goes home where it stands, and the home channel's program has it.
    """
    mill = "N20 #CALL AX [Z2,5,2]\nN30 G1 Z2=50 F600\nN40 M30\n"
    with Channels(tmp_path, [mill, None, None], TABLE) as cnc:
        cnc.run(1500)
        cnc.command(0, AUTOMATIC, layout.HLI_IMCM_PROCESS_RESETTING)
        assert cnc.end()[0] == "aborted"
        cnc.run(2)
        stands = cnc.positions(1)[1]
        assert 8.0 < stands < 49.0
        assert shown(cnc, 1)[1] == (5, "Z")
        assert shown(cnc, 0)[2] == (0, "")
        program = tmp_path / "home.nc"
        program.write_text("N10 G91 G1 Z1 F600\nN20 M30\n")
        cnc.channels[1].modes.select(program)
        cnc.channels[1].modes.start()
        assert cnc.end()[1] == "completed"
        assert cnc.positions(1)[1] == pytest.approx(stands + 1.0, abs=1e-9)


def test_commands_of_the_axis_go_with_it(tmp_path: Path) -> None:
    """Feed hold in the axis's own area stands the channel that has it, and that
    one alone.
    """
    mill = "N20 #CALL AX [Z2,5,2]\nN30 G1 Z2=50 F600\nN40 M30\n"
    loader = "N10 #PUT AX [Z]\nN20 G1 X100 F600\nN30 M30\n"
    with Channels(tmp_path, [mill, loader, None], TABLE) as cnc:
        area = cnc.root.axis[Z]
        area.head.plc_present_w = True
        cnc.run(1000)
        area.ipo_mc_control.feedhold.command_w = True
        area.ipo_mc_control.feedhold.enable_w = True
        cnc.run(500)
        stood, others = cnc.positions(0)[2], cnc.positions(1)[0]
        cnc.run(500)
        assert cnc.positions(0)[2] == stood
        assert cnc.positions(1)[0] > others + 4.0
        area.ipo_mc_control.feedhold.command_w = False
        assert cnc.end()[:2] == ["completed", "completed"]
        cnc.run(2)
        assert cnc.positions(1)[1] == 50.0


def test_a_program_waits_for_its_own_axes(tmp_path: Path) -> None:
    """A program that starts while another channel has one of its axes begins
    when that is back; what the channel puts is its own again at the next start.
    """
    mill = "N20 #CALL AX [Z2,5,2]\nN30 G1 Z2=9 F60\nN40 M30\n"
    with Channels(tmp_path, [mill, None, None], TABLE) as cnc:
        cnc.run(100)
        program = tmp_path / "home.nc"
        program.write_text("N10 G91 G1 Z1 X1 F600\nN20 M30\n")
        cnc.channels[1].modes.select(program)
        cnc.channels[1].modes.start()
        cnc.run(500)
        assert cnc.positions(1)[0] == 0.0
        assert cnc.end()[:2] == ["completed", "completed"]
        assert cnc.positions(1) == [1.0, 10.0]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("#CALL AX [C,9,2]", 20312),
        ("#CALL AX [Z,5,3]", 21254),
        ("#CALL AX [Z,5,1]", 21260),
        ("#CALL AX [X,5,2]", 21261),
        ("#CALL AX [Z,70000,2]", 21253),
        ("#CALL AX [Z,5,2] [W,5,0]", 21258),
        ("#CALL AX [Z,5,2] [Z,1,0]", 21256),
        ("#CALL AX [Z,5,2] [W,1,2]", 21257),
        ("#CALL AX [Z 5,2]", 21251),
        ("#CALL AX [Z,5 2]", 21252),
        ("#CALL AX [Z,5,2,ALL]", 900003),
        ("#AX REQUEST NAM [Z,5,2]", 900003),
        ("#PUT AX [X] X3", 900010),
        ("#GET AX", 900003),
        ("#CS ON [1,2,3,0,0,0]\nN15 #PUT AX [X]", 20684),
        ("G51 X4\nN15 #PUT AX [X]", 20546),
        ("#PUT AX [X]\nN15 G1 X3 F100", 900001),
        ("G18 G2 X4 I2 F100", 903001),
    ],
)
def test_what_is_wrong_is_told(tmp_path: Path, text: str, code: int) -> None:
    """Each error of an exchange ends the program with its number."""
    with Channels(
        tmp_path, [f"N10 {text}\nN20 M30\n", None, None], TABLE
    ) as cnc:
        assert cnc.end()[0] == "error"
        assert error_of(cnc, 0).code == code


def test_set_ax_moves_and_lets_go(tmp_path: Path) -> None:
    """Only what #SET AX names stays; an axis may change its place. #AX DEF DEFAULT
    is the cell file again, and what is not there can be put without an error.
    """
    mill = (
        "N10 G1 X3 Y4 F6000\nN20 #SET AX [Y,2,0] [V,5,2]\nN30 G91 Y1 V1\n"
        "N35 G4 0.05\nN40 #AX DEF DEFAULT\nN50 G90 G1 X5 Y6\nN60 #PUT AX [B, X]\n"
        "N65 G4 0.05\nN70 M30\n"
    )
    with Channels(tmp_path, [mill, None, None], TABLE) as cnc:
        cnc.until(lambda: shown(cnc, 0)[2] == (5, "V"))
        assert shown(cnc, 0) == [(2, "Y"), (0, ""), (5, "V")]
        cnc.until(lambda: shown(cnc, 0)[2] == (0, ""))
        cnc.run(1)
        assert shown(cnc, 0)[:2] == [(1, "X"), (2, "Y")]
        assert cnc.positions(0) == pytest.approx([3.0, 5.0, 0.0], abs=0.01)
        assert cnc.positions(1)[1] == 8.0
        cnc.until(lambda: shown(cnc, 0)[0] == (0, ""))
        assert cnc.end()[0] == "completed"
        cnc.run(2)
        assert cnc.positions(0) == [5.0, 6.0, 0.0]


def test_weights_go_with_their_axes(tmp_path: Path) -> None:
    """G130 weighs X by 20 %: wherever it stands, X is driven with that, and Y is
    not.
    """
    text = (
        "G90 G01 F6000\nG130 X20\n#SET AX [Y,2,0][X,1,1]\n"
        "X20\n#FLUSH WAIT\nY20\nM30\n"
    )
    cell = "[axes.X]\nid = 1\n[axes.Y]\nid = 2\n"
    with Channels(tmp_path, [text], cell) as cnc:
        places = []
        while cnc.channels[0].modes.running:
            places.append(cnc.positions(0))
            cnc.run(1)
        most = np.abs(np.diff(places, 2, axis=0)).max(axis=0) * 1e6
    y, x = most  # at their places now
    assert x == pytest.approx(600.0, rel=0.02)
    assert y > 2000.0


@pytest.mark.parametrize(
    ("word", "most"), [("G130 X20", 2500.0), ("G131=20", 500.0)]
)
def test_an_axis_that_comes_is_weighted_as_all_are(
    tmp_path: Path, word: str, most: float
) -> None:
    """Not by what was at its place or is told of others."""
    texts = [
        f"G90 G01 F3000\n{word}\n#CALL AX [Z,5,2]\n#FLUSH WAIT\nZ30\nM30\n",
        "#PUT AX [Z]\nM30\n",
        "M30\n",
    ]
    table = TABLE.replace(
        "a_max_mm_s2 = 500.0", "a_max_mm_s2 = 2500.0"
    ).replace("j_max_mm_s3 = 4000.0", "j_max_mm_s3 = 200000.0")
    with Channels(tmp_path, texts, table) as cnc:
        places = []
        while cnc.channels[0].modes.running:
            places.append(cnc.positions(0)[2])
            cnc.run(1)
    inside = np.abs(np.diff(places, 2))[2:]
    jumps = inside[inside < 5e-3] * 1e6  # it appears where it stands
    assert jumps.max() == pytest.approx(most, rel=0.02)


def test_plain_lines_mean_the_axis_that_is_there(tmp_path: Path) -> None:
    """A letter means another axis behind the exchange, in plain lines that come
    again too.
    """
    mill = (
        "$FOR P1=0,1,1\nG91 G1 X2 F6000\n$IF P1 == 0\n#SET AX [Y,1,0] [X,2,1]\n"
        "$ENDIF\n$ENDFOR\nG91 G1 X1 Y0.5\nG4 0.05\nM30\n"
    )
    with Channels(tmp_path, [mill, None, None], TABLE) as cnc:
        assert cnc.end()[0] == "completed"
        cnc.run(2)
        # first X moves axis 1, then axis 2
        assert cnc.positions(0)[:2] == [2.5, 3.0]


def test_a_program_is_checked_alone(tmp_path: Path) -> None:
    """Without motion every axis is free: names and limits are followed."""
    setups = setups_of(parse_config(TABLE))
    program = tmp_path / "one.nc"
    program.write_text(
        "N10 G1 X1 F600\nN20 #CALL AX [W,5,2]\nN30 W59\nN40 W61\nN50 Z3\nN60 M30\n"
    )
    axes = OpenAxes(axes_of(setups), places_of(setups[0]))
    found = Program(program, setups[0].cell, collect=True, axes=axes)
    ends = [
        row["end"][:3].tolist()
        for batch in found.batches()
        for row in batch.rows[batch.rows["type"] <= 2]
    ]
    assert ends[:2] == [[1.0, 0.0, 0.0], [1.0, 0.0, 59.0]]
    assert [(e.code, e.place.line) for e in found.errors] == [
        (903001, 4),
        (900001, 5),
    ]
