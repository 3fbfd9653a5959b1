"""Level blocks and commands on the path against the mock CNC."""

import math
import random
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from plc_client import (
    ABSOLUTE_ONCE,
    RELATIVE,
    AutoContinue,
    AxisControl,
    ContinueMachining,
    DeleteDistanceToGo,
    ExternalSpeed,
    FeedControl,
    FeedHold,
    InsertStop,
    LevelState,
    LevelUnit,
    OptionalStop,
    Override,
    PathDirection,
    RtLoop,
    SingleBlock,
    SkipLevels,
    State,
    connect,
)
from plc_client.builtin import acknowledge
from plc_client.mock import MockCnc, line, m, optional_stop, stop

Make = Callable[..., tuple[MockCnc, Any]]


@pytest.fixture
def make() -> Iterator[Make]:
    """A mock CNC and the PLC's connection."""
    opened: list[Any] = []

    def build(*script: Any, **options: Any) -> tuple[MockCnc, Any]:
        cnc = MockCnc(script, **options)
        hli = connect(cnc.name)
        opened.extend((cnc, hli))
        return cnc, hli

    yield build
    for item in reversed(opened):
        item.close()


def test_feed_hold_stands_and_goes_on(make: Make) -> None:
    """The CNC shows it in state_r; standing only when nothing moves."""
    cnc, hli = make(line(100))
    fb = FeedHold(hli.gpCh[0])
    cnc.run_to(100)
    fb(True)
    assert fb.state is LevelState.COMMANDED
    cnc.run_to(110)
    assert fb(True)
    assert (fb.state, fb.done) == (LevelState.EFFECTIVE, True)
    here = cnc.distance
    cnc.run_to(150)
    assert cnc.distance == here
    fb(False)
    cnc.run_to(200)
    assert cnc.distance > here
    fb(False, enable=False)
    assert (fb.state, hli.gpCh[0].bahn_mc_control.feedhold.enable_w) == (
        LevelState.RELEASED,
        False,
    )


def test_override_acts_and_leaves_the_rapid_one_alone(make: Make) -> None:
    """50 % is half the speed; the rapid unit is not touched when it is not given."""
    cnc, hli = make(line(100))
    fb = Override(hli.gpCh[0])
    fb(path=50.0)
    cnc.run_to(100)
    fb(path=50.0)
    assert cnc.speed_mm_s == 50.0
    assert (fb.path, fb.effective, fb.done) == (50.0, 50.0, True)
    assert not hli.gpCh[0].bahn_mc_control.rapid_override.enable_w
    fb(path=50.0, rapid=30.0)
    cnc.cycle()
    fb(path=50.0, rapid=30.0)
    assert fb.rapid == 30.0


@pytest.mark.parametrize("percent", [-1.0, 200.1, math.nan])
def test_override_out_of_range_is_an_error_and_changes_nothing(
    make: Make, percent: float
) -> None:
    """error_id 1."""
    _, hli = make(line(1))
    fb = Override(hli.gpCh[0])
    fb(path=80.0)
    fb(path=percent)
    assert (fb.error, fb.error_id, fb.state) == (True, 1, LevelState.ERROR)
    assert hli.gpCh[0].bahn_mc_control.override.command_w == 800


def test_level_unit_tells_a_missing_presence(make: Make) -> None:
    """plc_present_w FALSE: error 2; the command waits in the unit."""
    _, hli = make(line(1))
    hli.set_present(False)
    fb = LevelUnit(hli.gpCh[0].bahn_mc_control.m01_stop_enable)
    fb(True, True)
    assert (fb.error_id, fb.state) == (2, LevelState.ERROR)


def test_release_happens_once_so_that_another_block_can_have_the_unit(
    make: Make,
) -> None:
    """A block that is not enabled does not write the enable of others away."""
    _, hli = make(line(1))
    idle, user = OptionalStop(hli.gpCh[0]), OptionalStop(hli.gpCh[0])
    user(True)
    idle(False, enable=False)
    assert hli.gpCh[0].bahn_mc_control.m01_stop_enable.enable_w


def test_optional_stop_and_continue(make: Make) -> None:
    """M01 stands only when enabled; continue waits for the stop, gives an edge,
    is done when the CNC goes on.
    """
    cnc, hli = make(line(10), optional_stop(), line(10))
    m01, go_on = OptionalStop(hli.gpCh[0]), ContinueMachining(hli.gpCh[0])
    m01(True)
    for _ in range(50):
        assert not go_on(True)
        cnc.cycle()
    assert go_on.state is State.WAIT_FREE  # no stop yet: the edge is kept back
    for _ in range(60):
        cnc.cycle()
        if go_on(True):
            break
    assert go_on.done
    cnc.run_to(400)
    assert cnc.ended


def test_optional_stop_not_enabled_passes(make: Make) -> None:
    """P-CHAN default: M01 is nothing."""
    cnc, hli = make(line(1), optional_stop(), line(1))
    OptionalStop(hli.gpCh[0])(False)
    cnc.run_to(100)
    assert cnc.ended


def test_single_block_steps(make: Make) -> None:
    """One motion per edge of next_block."""
    cnc, hli = make(line(1), line(1), line(1))
    fb = SingleBlock(hli.gpCh[0])
    for _ in range(30):
        fb(True, False)
        cnc.cycle()
    assert (fb(True, False), cnc.distance) == (True, 10_000.0)
    for _ in range(30):
        fb(True, True)
        cnc.cycle()
    assert (cnc.distance, fb.steps) == (20_000.0, 1)
    for key in [False] * 5 + [True] * 30:
        fb(True, key)
        cnc.cycle()
    assert cnc.ended


def test_auto_continue_leaves_every_stop_of_a_program(make: Make) -> None:
    """Two M00 in a row."""
    cnc, hli = make(line(1), stop(), stop(), line(1))
    flow = AutoContinue(hli.gpCh[0])
    for _ in range(80):
        flow()
        cnc.cycle()
    assert (cnc.ended, flow.count) == (True, 2)


@pytest.mark.parametrize("continued", [True, False])
def test_the_built_in_plc_in_single_block(make: Make, continued: bool) -> None:
    """It continues every block, or leaves that to the operator."""
    cnc, hli = make(line(1), line(1), line(1))
    control = hli.gpCh[0].bahn_mc_control
    plc = acknowledge.Plc({"single_block": continued})
    plc.setup(hli)
    control.single_block.enable_w = control.single_block.command_w = True
    key = ContinueMachining(hli.gpCh[0])
    for _ in range(60):
        plc.cyclic()
        cnc.cycle()
    assert cnc.ended == continued
    if continued:
        return
    assert (cnc.distance, plc.result()["continued"]) == (10_000.0, 0)
    for _ in range(60):
        key(True)
        plc.cyclic()
        cnc.cycle()
    assert key.done
    assert cnc.distance == 20_000.0


def test_backward_and_forward_again(make: Make) -> None:
    """dist_prog_start decreases, then grows again to the same end."""
    cnc, hli = make(line(20), line(20))
    fb = PathDirection(hli.gpCh[0])
    cnc.run_to(300)
    top = cnc.distance
    for _ in range(200):
        fb(backward=True)
        cnc.cycle()
    fb(backward=True)
    assert fb.backward_active
    assert fb.distance < top - 150_000.0
    fb()
    cnc.run_to(900)
    assert (cnc.ended, cnc.distance) == (True, 400_000.0)
    fb(backward=True, simulate=True)
    assert fb.error_id == 1


def test_delete_distance_to_go_goes_on_with_the_next_motion(make: Make) -> None:
    """Rising edge; the unit is FALSE again afterwards, so the next edge works."""
    cnc, hli = make(line(50), line(50))
    fb = DeleteDistanceToGo(hli.gpCh[0])
    cnc.run_to(100)
    for target in (500_000.0, 1_000_000.0):
        fb(True)
        for _ in range(5):
            cnc.cycle()
            fb(fb.busy)
        assert not hli.gpCh[0].bahn_mc_control.delete_distance_to_go.command_w
        cnc.run_to(cnc.cycles + 3)
        assert cnc.distance >= target - 1.0
    assert fb.state is State.IDLE


def test_inserted_stop_stands_at_its_distance(make: Make) -> None:
    """Semaphore, done when taken; the CNC stands there and waits for continue."""
    cnc, hli = make(line(50))
    fb = InsertStop(hli.gpCh[0])
    assert fb.next_stop == -1.0
    fb(True, 200_000.0, ABSOLUTE_ONCE)
    assert fb.busy
    cnc.cycle()
    assert fb(True)
    assert fb.next_stop == 200_000.0
    cnc.run_to(400)
    assert cnc.distance == pytest.approx(200_000.0)
    assert hli.gpCh[0].bahn_state.wait_continue_r


@pytest.mark.parametrize(
    "inputs", [(math.nan, 1), (0.0, 3), (0.0, 1, 70_000), (0.0, 1, 0, -1)]
)
def test_inserted_stop_checks_its_inputs(
    make: Make, inputs: tuple[Any, ...]
) -> None:
    """error_id 1, nothing sent."""
    _, hli = make(line(1))
    fb = InsertStop(hli.gpCh[0])
    fb(True, *inputs)
    assert (
        fb.error_id,
        hli.gpCh[0].bahn_mc_control.insert_cmd.command_semaphor_rw,
    ) == (1, False)


def test_relative_zero_deletes_the_inserted_stop(make: Make) -> None:
    """hli_reference 5.3."""
    cnc, hli = make(line(20))
    fb = InsertStop(hli.gpCh[0])
    for inputs in ((100_000.0, ABSOLUTE_ONCE), (0.0, RELATIVE)):
        fb(True, *inputs)
        cnc.cycle()
        fb(True, *inputs)
        fb(False)
    cnc.run_to(300)
    assert cnc.ended


def test_skip_levels_count_at_program_start_only(make: Make) -> None:
    """Level 1 and 3 are left out; a level out of range is an error."""
    cnc, hli = make(
        line(10, skip=1), line(10), line(10, skip=3), auto_start=True
    )
    fb = SkipLevels(hli.gpCh[0])
    fb((1, 3))
    cnc.cycle()
    assert len(cnc.path) == 1
    fb((1,))
    cnc.run_to(200)
    assert (cnc.ended, len(cnc.path)) == (True, 1)
    fb((11,))
    assert fb.error_id == 1
    assert hli.gpCh[0].decoder_mc_control.program_block_ignore.command_w == 1


def test_axis_that_is_not_released_stops_the_path(make: Make) -> None:
    """release_feedhold of one axis FALSE: no path motion."""
    cnc, hli = make(line(10))
    axes = [AxisControl(ax) for ax in hli.gpAx if ax is not None]
    for fb in axes:
        fb()
    axes[2](release=False)
    cnc.run_to(50)
    assert cnc.distance == 0.0
    axes[2](release=True)
    cnc.run_to(200)
    assert cnc.ended
    axes[0](override=300.0)
    assert axes[0].error_id == 1


def test_rt_loop_and_external_speed_command_their_units(make: Make) -> None:
    """Command before enable, valid with the speed."""
    _, hli = make(line(1))
    RtLoop(hli.gpCh[0])(True)
    ExternalSpeed(hli.gpCh[0])(-5000)
    c = hli.gpCh[0].bahn_mc_control
    assert (c.rt_loop_enable.command_w, c.rt_loop_enable.enable_w) == (
        True,
        True,
    )
    assert (
        c.ext_command_speed.command_w,
        c.ext_command_speed_valid.command_w,
    ) == (-5000, True)


def test_function_that_is_never_fetched_stops_the_program(make: Make) -> None:
    """The mock plays the manual's pitfall too: an M function nobody fetches."""
    cnc, hli = make(line(1), m(50, waits=False), line(1))
    cnc.run_to(200)
    assert (cnc.ended, hli.gpCh[0].bahn_state.wait_techno_acknowledge_r) == (
        False,
        True,
    )


class _Blocks:
    """Blocks on one channel, and what somebody else may do to their units."""

    def __init__(self, cnc: MockCnc, hli: Any, skip: bool) -> None:
        self.cnc, self.ch, self.skip = cnc, hli.gpCh[0], skip
        self.override, self.feed = Override(self.ch), FeedControl(self.ch)
        self.hold, self.direction = FeedHold(self.ch), PathDirection(self.ch)

    def act(self, what: int, value: float, flag: bool) -> None:
        control = self.ch.bahn_mc_control
        if not self.skip:
            self.override._settled = self.hold._settled = self.feed._settled = (
                self.direction._settled
            ) = None
        actions: list[Callable[[], Any]] = [
            lambda: self.override(path=None, rapid=100.0 if flag else None),
            lambda: self.override(path=value),
            lambda: self.override(path=value, rapid=100.0 if flag else None),
            lambda: self.override(path=value, enable=flag),
            self.override.release,
            lambda: self.hold(flag),
            lambda: self.feed(override=min(value, 200.0), feedhold=flag),
            lambda: self.direction(backward=flag, simulate=value > 100.0),
            lambda: setattr(control.override, "command_w", int(value)),
            lambda: setattr(control.feedhold, "enable_w", flag),
            lambda: setattr(self.ch.head, "plc_present_w", flag),
            lambda: self.cnc.run_to(self.cnc.cycles + 1),
        ]
        actions[what % len(actions)]()

    def seen(self) -> tuple[Any, ...]:
        blocks, o = (self.override, self.hold, self.direction), self.override
        outputs = [
            (b.state, b.done, b.busy, b.error, b.error_id) for b in blocks
        ]
        values = (
            o.path,
            o.rapid,
            o.effective,
            self.hold.standing,
            self.feed.override,
            self.feed.feedhold,
        )
        return (
            outputs,
            values,
            self.direction.backward_active,
            bytes(self.ch.bahn_mc_control._c),
        )


def test_a_call_that_is_done_at_once_is_the_same_call(make: Make) -> None:
    """Blocks that skip what cannot have changed do as blocks that never skip,
    whoever else writes the units.
    """
    rng = random.Random(7)
    quick, thorough = (
        _Blocks(*make(line(1000)), skip) for skip in (True, False)
    )
    for step in range(3000):
        again = step % 3  # the same twice more: what a skip is for
        if not again:
            action = (
                rng.randrange(12),
                rng.choice((0.0, 50.0, 100.0, 250.0)),
                rng.random() < 0.5,
            )
        for blocks in (quick, thorough):
            blocks.act(*action)
            if again == 1:
                blocks.act(11, 0.0, False)  # the CNC answers
        assert quick.seen() == thorough.seen(), (step, action)
