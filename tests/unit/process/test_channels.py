"""Several channels in one CNC: one order, no mixing, each its own life."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.cell.programs import programs_of
from cnc_core.config import parse_config
from cnc_core.errors import CncError
from hli import layout
from hli.errors import HliNotConfigured
from hli.handshake import ContourUnit, snapshot
from support.channels import AUTOMATIC, THREE, Channels
from support.inside import Inside

MILL = "N10 G1 X8 Y4 F6000\nN20 X0 Y0\nN30 M30\n"
LOADER = "N10 G1 X3 Z-6 F3000\nN20 G2 X5 Z-4 I2 K0 G18\nN30 M30\n"
SAW = "N10 G1 Y2 F600\nN20 M30\n"


def test_each_channel_shows_itself(tmp_path: Path) -> None:
    """``gNrCh``, ``gpCh[i]`` and ``gpAx`` tell numbers, names and axes of every
    channel; an axis has its place behind those of the channels before.
    """
    with Channels(tmp_path, [MILL, LOADER, SAW]) as cnc:
        cnc.run(40)
        hli = cnc.hli
        assert (hli.gNrCh, hli.gNrAx) == (3, 5)
        assert hli.gpPform._c.channel_count_r == 3
        heads = [hli.gpCh[i].head for i in range(3)]
        assert [head.channel_nr for head in heads] == [1, 2, 3]
        assert all(head.init_done_r for head in heads)
        with pytest.raises(HliNotConfigured, match="channel 3"):
            _ = hli.gpCh[3]
        assert [hli.gpAx[i].head.log_ax_n_r for i in range(5)] == [
            1,
            2,
            3,
            4,
            5,
        ]
        names = {
            cnc.state(i).prog_name_r.decode(): cnc.channels[i].file
            for i in range(3)
        }
        assert all(name == file.name for name, file in names.items() if file)
        for index, base in ((0, 0), (1, 2), (2, 4)):
            for k, position in enumerate(cnc.positions(index)):
                shown = hli.gpAx[base + k].lr_state.active_position_acs_r
                assert shown == round(position * 1e4)


def test_a_channel_moves_as_it_does_alone(tmp_path: Path) -> None:
    """Beside others a channel's positions are bit by bit those of a cell that
    has only this channel.
    """
    alone = []
    for text, axes in ((MILL, "XY"), (LOADER, "XZ"), (SAW, "Y")):
        config = "".join(f"[axes.{name}]\n" for name in axes)
        with Inside(tmp_path, text, config) as one:
            rows = []
            for _ in range(150):
                one.run(1)
                state = one.engine.state
                rows.append(tuple(list(state.position)[: len(axes)]))
        alone.append(rows)
    with Channels(tmp_path, [MILL, LOADER, SAW]) as cnc:
        together = []
        for _ in range(150):
            cnc.run(1)
            together.append([tuple(cnc.positions(i)) for i in range(3)])
    for index, rows in enumerate(alone):
        assert [row[index] for row in together] == rows


def test_every_channel_answers_its_own_contour(tmp_path: Path) -> None:
    """A request to each unit in the same cycle: each answer holds the elements
    of this channel's program.
    """
    with Channels(tmp_path, [MILL, LOADER, SAW]) as cnc:
        cnc.run(5)
        units = [
            ContourUnit(cnc.hli.gpCh[i].contour_lookahead) for i in range(3)
        ]
        for unit in units:
            assert unit.request(0.0, 1e7)
        cnc.run(1)
        lengths = []
        for unit in units:
            count = unit.take()
            lengths.append(unit.rows[:count]["length"].tolist())
        assert lengths[0] == pytest.approx([8e4 * np.sqrt(1.25)] * 2)
        assert lengths[1][0] == pytest.approx(np.hypot(3e4, 6e4))
        assert lengths[2] == pytest.approx([2e4])
        cnc.run(1)
        stats = cnc.root.sidecar.stats
        assert stats.requests_mode2 == 3


def test_feed_hold_of_one_leaves_the_others_alone(tmp_path: Path) -> None:
    """The held channel stands, the others reach their end."""
    with Channels(tmp_path, [MILL, LOADER, SAW]) as cnc:
        cnc.level(0, "feedhold", True)
        cnc.until(lambda: bool(cnc.channels[1].ended_at), 20)
        cnc.until(lambda: bool(cnc.channels[2].ended_at), 20)
        assert not cnc.channels[0].ended_at
        assert cnc.state(0).stop_condition_r & 1
        assert not cnc.state(1).stop_condition_r & 1
        cnc.level(0, "feedhold", False)
        assert cnc.end() == ["completed"] * 3


def test_an_error_of_one_leaves_the_others_alone(tmp_path: Path) -> None:
    """The error is told in its channel alone, with its number; the cell's phase
    ends with the last program.
    """
    wrong = "N10 G1 X1 F600\nN20 G1 X=V.P.NOTHING\n"
    with Channels(tmp_path, [MILL, wrong, SAW]) as cnc:
        cnc.until(lambda: bool(cnc.channels[1].ended_at), 20)
        assert cnc.root.sidecar.cnc.phase == layout.HLI_PHASE_RUNNING
        assert cnc.end() == ["completed", "error", "completed"]
        cnc.run(2)
        assert cnc.root.sidecar.cnc.phase == layout.HLI_PHASE_ENDED
        assert [bool(cnc.state(i).error_r) for i in range(3)] == [
            False,
            True,
            False,
        ]
        record = cnc.root.channel[1].mc_error.satz_r.kopf
        assert record.channel == 2
        assert not cnc.root.channel[0].mc_error.semaphor_rw


def test_a_channel_is_reset_and_started_by_the_plc(tmp_path: Path) -> None:
    """The PLC aborts one channel and starts another program in it, while the
    other channel goes on.
    """
    (tmp_path / "again.nc").write_text("N10 G1 X1 F6000\nN20 M30\n")
    long = "N10 G1 X80 F3000\nN20 M30\n"
    with Channels(tmp_path, [long, LOADER, None]) as cnc:
        cnc.run(20)
        cnc.command(1, AUTOMATIC, layout.HLI_IMCM_PROCESS_RESETTING)
        cnc.until(lambda: bool(cnc.channels[1].ended_at))
        assert cnc.channels[1].end == "aborted"
        assert not cnc.channels[0].ended_at
        cnc.run(5)
        cnc.command(1, AUTOMATIC, layout.HLI_IMCM_PROCESS_ACTIVE, "again.nc")
        cnc.until(lambda: cnc.state(1).prog_name_r == b"again.nc")
        assert cnc.end() == ["completed", "completed", "unused"]
        assert cnc.positions(0) == [80.0, 0.0]


def test_global_variables_are_of_all_channels(tmp_path: Path) -> None:
    """What one program writes, the other reads; a channel's own variable is of
    this channel alone.
    """
    config = (
        '[external.SHARED]\ntype = "SGN32"\nscope = "global"\n'
        '[external.OWN]\ntype = "SGN32"\nscope = "channel"\n' + THREE
    )
    writes = "N10 V.E.SHARED = 7\nN20 V.E.OWN = 5\nN30 #FLUSH WAIT\nN40 M30\n"
    reads = (
        "N10 G4 X0.05\nN20 #FLUSH WAIT\n"
        "N30 G1 X=V.E.SHARED Z=V.E.OWN F6000\nN40 M30\n"
    )
    with Channels(tmp_path, [writes, reads, None], config) as cnc:
        assert cnc.end()[:2] == ["completed", "completed"]
        assert cnc.positions(1) == [7.0, 0.0]
        own = [cnc.root.ext_var_channel[i].value[0] for i in range(2)]
        assert own == [5, 0]
        assert cnc.root.ext_var_global.value[0] == 7


def test_a_copy_of_any_channel_is_consistent(tmp_path: Path) -> None:
    """``snapshot`` takes the status of every channel."""
    with Channels(tmp_path, [MILL, LOADER, SAW]) as cnc:
        cnc.run(30)
        for i in range(3):
            copy = snapshot(cnc.hli.gpCh[i].bahn_state)
            assert copy.dist_prog_start == cnc.state(i).dist_prog_start > 0


def test_a_wait_names_its_channel(tmp_path: Path) -> None:
    """A channel that stands says whose program waits and who could end it."""
    with Channels(tmp_path, ["N10 M0\nN20 M30\n", LOADER, None]) as cnc:
        cnc.until(lambda: bool(cnc.state(0).wait_continue_r))
        cnc.run(5)
        (waiting,) = cnc.channels[0].waits.now()
        assert waiting.channel == "mill"
        assert "continue at M0" in waiting.what
        assert str(waiting).startswith("channel mill: ")


def test_more_programs_than_channels_are_refused() -> None:
    """Nobody's program is left out in silence."""
    cell = parse_config(THREE)
    with pytest.raises(CncError, match=r"4 programs .* for 3 channels"):
        programs_of(cell, ["a", "b", "c", "d"])
    with pytest.raises(CncError, match="no program"):
        programs_of(cell, [])
    assert programs_of(cell, "a") == (Path("a"), None, None)
