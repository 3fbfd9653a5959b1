"""Connection of a PLC: registration, refusals, stepping, exchange, liveness."""

import os
import subprocess
import sys
from collections.abc import Iterator

import pytest

import hli
from hli import layout
from plc_client import clock, connect
from support.fake_cnc import FakeCnc, elements, unique_name


@pytest.fixture
def cnc() -> Iterator[FakeCnc]:
    """A lockstep CNC in a thread: 20 elements of path, 3 log entries."""
    with FakeCnc(elements([10.0] * 20), elements([1.0] * 3)) as fake:
        yield fake


def test_connect_without_a_cnc_is_named() -> None:
    """HliNotFound at once with wait_s 0, and after the wait otherwise."""
    for wait_s in (0.0, 0.05):
        with pytest.raises(hli.HliNotFound):
            connect(unique_name(), wait_s=wait_s)


def test_connect_refuses_what_a_dead_cnc_left_over(cnc: FakeCnc) -> None:
    """The owner's pid and start time tell."""
    cnc.segment.root.segment_head.owner_start += 1
    with pytest.raises(hli.HliNotFound, match="left over"):
        connect(cnc.name)
    cnc.segment.root.segment_head.owner_start -= 1


def test_connect_refuses_a_cnc_that_shuts_down(cnc: FakeCnc) -> None:
    """Nothing is begun that the CNC is about to end."""
    cnc.side.cnc.phase = layout.HLI_PHASE_SHUTDOWN
    with pytest.raises(hli.HliNotFound, match="closed"):
        connect(cnc.name)


def test_plc_registers_and_gives_its_place_back(cnc: FakeCnc) -> None:
    """pid, generation, attached; plc_present_w of platform, channel and configured axes."""
    with connect(cnc.name) as plc:
        side = cnc.side.plc
        assert (side.pid, side.generation, side.attached) == (os.getpid(), 1, 1)
        assert plc.alive()
        assert cnc.areas.gpPform.plc_present_w
        assert cnc.ch.head.plc_present_w
        assert [cnc.areas.gpAx[i].head.plc_present_w for i in range(3)] == [
            True
        ] * 3
    assert cnc.side.plc.attached == 0
    with connect(cnc.name):
        assert cnc.side.plc.generation == 2


def test_second_living_plc_is_refused(cnc: FakeCnc) -> None:
    """HliInUse names the first one's process; a reader may look on."""
    with connect(cnc.name):
        with pytest.raises(hli.HliInUse, match=str(os.getpid())):
            connect(cnc.name)
        with connect(cnc.name, role="reader") as reader:
            assert reader.gpCh[0].head.init_done_r
        assert cnc.side.plc.attached == 1


def test_place_of_a_dead_plc_is_free(cnc: FakeCnc) -> None:
    """A PLC process that was killed leaves nothing locked."""
    code = (
        f"import os; from plc_client import connect; "
        f"connect({cnc.name!r}); os.kill(os.getpid(), 9)"
    )
    assert (
        subprocess.run(
            [sys.executable, "-P", "-c", code], check=False
        ).returncode
        == -9
    )
    assert cnc.side.plc.attached == 1
    with connect(cnc.name) as plc:
        plc.step(3)


def test_step_runs_exactly_so_many_cycles(cnc: FakeCnc) -> None:
    """Lockstep: the CNC stands between the steps."""
    with connect(cnc.name) as plc:
        begin = plc.cycle
        assert plc.step() == begin + 1
        assert plc.step(25) == begin + 26
        assert cnc.cycles == begin + 26
        assert plc.cell_time_s == pytest.approx((begin + 26) * 0.001)
        assert clock.now_ns() == plc.cell_time_ns


def test_step_needs_a_plc_in_lockstep(cnc: FakeCnc) -> None:
    """Refused by name for readers and other clocks."""
    with (
        connect(cnc.name, role="reader") as reader,
        pytest.raises(hli.HliError, match="reader"),
    ):
        reader.step()
    with connect(cnc.name) as plc:
        cnc.side.cnc.clock = layout.HLI_CLOCK_REALTIME
        with pytest.raises(hli.HliError, match="lockstep"):
            plc.step()
        cnc.side.cnc.clock = layout.HLI_CLOCK_LOCKSTEP


def test_step_ends_when_the_cnc_shuts_down(cnc: FakeCnc) -> None:
    """No endless wait for a CNC that has ended."""
    with connect(cnc.name) as plc:
        cnc._stop.set()
        assert cnc._thread is not None
        cnc._thread.join()
        cnc.side.cnc.phase = layout.HLI_PHASE_SHUTDOWN
        with pytest.raises(hli.HliError, match="ended"):
            plc.step(10**6)


def test_exchange_in_lockstep_steps_the_cnc(cnc: FakeCnc) -> None:
    """A notebook asks without a scan runtime."""
    with connect(cnc.name) as plc:
        assert list(plc.exchange(1, 0)["block_number"]) == [20, 30]
        assert list(plc.exchange(15.0, 10.0)["start_position"]) == [10.0, 20.0]


def test_new_cnc_behind_the_same_memory_is_not_the_one_connected_to(
    cnc: FakeCnc,
) -> None:
    """alive() follows generation, pid and start."""
    with connect(cnc.name) as plc:
        cnc.side.cnc.generation += 1
        assert not plc.alive()


def test_snapshot_is_a_private_copy(cnc: FakeCnc) -> None:
    """bahn_state as a whole."""
    with connect(cnc.name) as plc:
        before = plc.snapshot()
        distance = before.dist_prog_start
        plc.step(3)
        assert before.dist_prog_start == distance
        assert plc.snapshot().dist_prog_start == distance + 3


def test_unknown_role_is_refused(cnc: FakeCnc) -> None:
    """ValueError."""
    with pytest.raises(ValueError, match="watcher"):
        connect(cnc.name, role="watcher")  # type: ignore[arg-type]
