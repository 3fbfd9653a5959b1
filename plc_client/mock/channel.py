"""One channel of the mock CNC: plays the CNC's side of its area, cycle by
cycle, in the caller's thread.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from hli._sync import lib

from hli import layout
from hli.areas import Areas
from hli.handshake import ContourUnit, word_pointer

from ..blocks.mode import ProcessState
from .ahead import MockAhead
from .script import (
    TENTH_UM_PER_MM,
    Step,
    element_rows,
    without_skipped,
)
from .units import Edge, ErrorQueue, ModeMachine, Technology, Watchdogs, level

VERSION = "hli-cosim 0.1"
ACTIVE = ProcessState.ACTIVE


@dataclass(frozen=True)
class MockSettings:
    """What a mock does where its script says nothing (``MockCnc``)."""

    feed_mm_s: float = 100.0
    rapid_mm_s: float = 300.0
    cycle_s: float = 0.001
    ahead: int = 120
    auto_start: bool = True
    program: str = "mock.nc"
    state_after_end: ProcessState = ProcessState.SELECTED


class MockChannel:
    """One channel with a script instead of an NC program.

    ``ch``: its area.  ``requests``, ``functions``: what it was asked and has put
    out.  ``others_run``: whether another channel executes its script.
    """

    def __init__(
        self,
        areas: Areas,
        index: int,
        axes: int,
        script: Sequence[Step],
        settings: MockSettings,
    ) -> None:
        self.areas, self.index = areas, index
        self.cycle_s, self.ahead = settings.cycle_s, settings.ahead
        self.feed_mm_s = settings.feed_mm_s
        self.rapid_mm_s = settings.rapid_mm_s
        self.program = settings.program
        self.others_run: Callable[[], bool] = lambda: False
        self._script = list(script)
        self.ch = areas.gpCh[index]
        self._axes: list[Any] = [
            areas.gpAx[i] for i in range(index * axes, (index + 1) * axes)
        ]
        self.requests: list[tuple[float, float]] = []
        self.functions: list[tuple[str, int]] = []
        self.cycles = 0
        self._unit = ContourUnit(self.ch.contour_lookahead)
        self._seq = word_pointer(areas.root, "channel_seq")
        self.errors = ErrorQueue(self.ch.mc_error)
        self.mode = ModeMachine(
            self.ch.channel_mc_control.mode_and_state,
            self.errors,
            settings.state_after_end,
        )
        self.watchdogs = Watchdogs(self.ch.head, self.cycle_s, self.errors)
        c = self.ch.bahn_mc_control
        self._continue, self._delete = (
            Edge(c.continue_machining),
            Edge(c.delete_distance_to_go),
        )
        self._techno = {
            (i - 1, late): Technology(a, late)
            for i, a in enumerate([self.ch, *self._axes])
            for late in (False, True)
        }
        self._ahead = MockAhead(self)
        self._auto_start = settings.auto_start
        self._stop_at_mm: float | None = (
            None  # may be commanded before program start
        )
        self._identify(axes)
        self._load()
        self._publish()

    # -- life
    def _identify(self, axes: int) -> None:
        head = self.ch.head
        head.version_r.zeichen = VERSION
        head.sizeof_interface_r, head.channel_nr = (
            ctypes.sizeof(layout.HLI_CHANNEL),
            self.index + 1,
        )
        for i, axis in enumerate(self._axes, self.index * axes):
            axis.head.sizeof_interface_r, axis.head.log_ax_n_r = (
                ctypes.sizeof(layout.HLI_AXIS),
                i + 1,
            )
        self.ch.bahn_mc_control.insert_cmd.state_r.distance_of_next_stop = -1.0
        head.init_done_r = True

    def _phase(self, phase: int) -> None:
        """The cell ends with the last channel."""
        if phase != layout.HLI_PHASE_ENDED or not self.others_run():
            self.areas.sidecar.cnc.phase = phase

    # -- the program
    def _load(self) -> None:
        """Program start: skip levels are looked at now, all distances are 0."""
        mask = self.ch.decoder_mc_control.program_block_ignore
        self.steps = without_skipped(
            self._script, mask.command_w if mask.enable_w else 0
        )
        self.path, self.log = element_rows(self.steps)
        self._at = 0  # step being executed
        self._inside_mm = 0.0  # covered of a motion
        self._element = 0  # motions begun before this step
        self._epoch_end = self._find_epoch_end()
        self._entered = False
        self._single_passed = False
        self._left_s = 0.0
        self.speed_mm_s = 0.0
        self.ended = self.waiting_continue = False

    @property
    def done(self) -> bool:
        """Whether the program is at its end."""
        return self._at >= len(self.steps)

    @property
    def step(self) -> Step | None:
        """The step being executed."""
        return None if self.done else self.steps[self._at]

    @property
    def distance(self) -> float:
        """``dist_prog_start``, 0.1 um."""
        step = self.step
        if step is not None and step.is_motion:
            return (
                float(self.path["start_position"][self._element])
                + self._inside_mm * TENTH_UM_PER_MM
            )
        if self._element == 0 or self._just_reset():
            return 0.0
        last = self.path[self._element - 1]
        return float(last["start_position"] + last["length"])

    def _just_reset(self) -> bool:
        for step in reversed(self.steps[: self._at]):
            if step.is_motion or step.kind == "distance_reset":
                return step.kind == "distance_reset"
        return False

    def _find_epoch_end(self) -> int:
        """Motions before the next distance reset: no further elements are known."""
        motions = 0
        for i, step in enumerate(self.steps):
            if step.kind == "distance_reset" and i >= self._at:
                return motions
            motions += step.is_motion
        return motions

    def known(self) -> float:
        """``max_dist_prog_start``: the end of the last motion of the window, or
        of the stretch before a reset.
        """
        last = min(
            self._element + 1 + self.ahead, self._epoch_end, len(self.path)
        )
        if last == 0 or last <= self._epoch_begin():
            return self.distance
        return float(
            self.path["start_position"][last - 1]
            + self.path["length"][last - 1]
        )

    def _epoch_begin(self) -> int:
        begin, motions = 0, 0
        for step in self.steps[: self._at]:
            motions += step.is_motion
            begin = motions if step.kind == "distance_reset" else begin
        return begin

    # -- one cycle
    def act(self) -> None:
        """PLC data, commands, motion, technology."""
        present = bool(self.ch.head.plc_present_w)
        self._take_commands(present)
        self._move(present)
        for array in self._techno.values():
            array.cycle()
        self.errors.cycle()
        self.watchdogs.cycle(present)
        if self.ch.lc_error.semaphor_rw:
            self.ch.lc_error.semaphor_rw = False
        self.cycles += 1

    def show(self) -> None:
        """Status, then look-ahead."""
        self._publish()
        self._serve()

    def _take_commands(self, present: bool) -> None:
        c, lr = (
            self.ch.bahn_mc_control,
            [ax.lr_mc_control for ax in self._axes],
        )
        # every one shows its state
        released = False not in [
            level(a.release_feedhold, present, True) for a in lr
        ]
        self._hold = bool(level(c.feedhold, present, False)) or not released
        self._percent = self._override(c.override, c.override_valid, present)
        # shown; P-CHAN-00181 is 0 here
        self._override(c.rapid_override, c.rapid_override_valid, present)
        self._single, self._m01 = (
            level(c.single_block, present, False),
            level(c.m01_stop_enable, present, False),
        )
        self._backward = bool(level(c.backward_motion, present, False))
        for unit in (
            c.simulate_motion,
            c.backward_storage_off,
            c.rt_loop_enable,
        ):
            level(unit, present, False)
        level(self.ch.decoder_mc_control.program_block_ignore, present, 0)
        self._go_on = self._continue(present)
        if self._delete(present):
            self._skip_rest()
        self._insert(present)
        action = self.mode.cycle(present)
        if self._auto_start and present:
            self._auto_start = False
            self.mode.enter(ACTIVE)
            action = "start"
        if action == "start":
            self._load()
            self._phase(layout.HLI_PHASE_RUNNING)
        elif action == "abort":
            self._abort()

    def _abort(self) -> None:
        self._at, self.ended, self.waiting_continue, self.speed_mm_s = (
            len(self.steps),
            True,
            False,
            0.0,
        )
        for array in self._techno.values():
            array.reset()
        self._phase(layout.HLI_PHASE_ENDED)

    def _override(self, unit: Any, valid: Any, present: bool) -> float:
        percent = level(unit, present, 1000) / 10.0
        return min(percent, 200.0) if level(valid, present, False) else 100.0

    def _skip_rest(self) -> None:
        """Delete distance to go: straight on to the target of the next motion
        (here: at once).
        """
        step = self.step
        if step is not None and step.is_motion:
            self._inside_mm = step.length_mm

    def _insert(self, present: bool) -> None:
        unit = self.ch.bahn_mc_control.insert_cmd
        if not (present and unit.enable_w and unit.command_semaphor_rw):
            return
        c, here = unit.command_w, self.distance / TENTH_UM_PER_MM
        at = c.dist_or_pos / TENTH_UM_PER_MM + (
            0.0 if c.rel_abs_mode == 1 else here
        )
        self._stop_at_mm = (
            None if c.rel_abs_mode == 0 and c.dist_or_pos == 0 else at
        )
        unit.state_r.distance_of_next_stop = (
            -1.0 if self._stop_at_mm is None else at * TENTH_UM_PER_MM
        )
        unit.command_semaphor_rw = False

    # -- motion
    def _move(self, present: bool) -> None:
        left = self.cycle_s if self.mode.state == ACTIVE else 0.0
        self.speed_mm_s = 0.0
        while left > 0.0 and not self.done:
            left = self._execute(left, present)
        if self.done and not self.ended:
            self.ended = True
            self._phase(layout.HLI_PHASE_ENDED)
            self.mode.program_ended()

    def _execute(self, left: float, present: bool) -> float:
        """Spend time on the present step; returns what is left (0: stands, or
        the cycle is used up).
        """
        step = self.steps[self._at]
        if (
            self._backward
            and not self._entered
            and self._element
            and not step.is_motion
        ):
            return self._back_over()
        if step.is_motion:
            return self._motion(step, left)
        if not self._entered:
            self._enter(step, present)
        return self._stand(step, left)

    def _enter(self, step: Step, present: bool) -> None:
        self._entered = True
        if step.is_function:
            self.functions.append((step.kind, step.number))
            if present:
                self._techno[step.axis, step.late].put_out(step, self._at + 1)
        self._left_s = step.seconds
        self.waiting_continue = step.kind == "stop" or (
            step.kind == "optional_stop" and bool(self._m01)
        )
        if step.kind == "error":
            self._fail(step)

    def _fail(self, step: Step) -> None:
        state = self.ch.bahn_state
        self.errors.add(step.number, step.n, self.program)
        state.error_id_r, state.error_r = step.number, True
        self._abort()
        self.mode.enter(ProcessState.ERROR)

    def _stand(self, step: Step, left: float) -> float:
        if self.done:
            return 0.0
        if (
            step.is_function
            and not step.late
            and self._techno[step.axis, False].open
        ):
            return 0.0
        if self.waiting_continue:
            if not self._go_on:
                return 0.0
            self.waiting_continue = self._go_on = False
        if self._left_s > 0.0:
            used = min(left, self._left_s)
            self._left_s -= used
            left -= used
            if self._left_s > 1e-12:
                return 0.0
        self._next()
        return left

    def _back_over(self) -> float:
        self._at -= 1
        step = self.steps[self._at]
        if step.is_motion:
            self._element -= 1
            self._inside_mm = step.length_mm
        return self.cycle_s

    def _motion(self, step: Step, left: float) -> float:
        if (
            self._single
            and not self._entered
            and not self._single_passed
            and self._element
        ):
            self.waiting_continue = True
            if not self._go_on:
                return 0.0
            self.waiting_continue = self._go_on = False
        if self.waiting_continue:  # an inserted stop inside the motion
            if not self._go_on:
                return 0.0
            self.waiting_continue = self._go_on = False
        self._entered = self._single_passed = True
        speed = self._speed(step)
        if self._backward:
            return self._move_back(speed, left)
        rest = step.length_mm - self._inside_mm
        way = min(rest, speed * left, self._to_inserted_stop())
        self._inside_mm += way
        self.speed_mm_s = speed
        if (
            self._stop_at_mm is not None
            and self.distance / TENTH_UM_PER_MM >= self._stop_at_mm - 1e-9
        ):
            self._stop_at_mm, self.waiting_continue = None, True
            self.ch.bahn_mc_control.insert_cmd.state_r.distance_of_next_stop = (
                -1.0
            )
            self.speed_mm_s = 0.0
            return 0.0
        if self._inside_mm < step.length_mm - 1e-12:
            return 0.0
        self._element += 1
        self._next()
        return max(left - way / speed, 0.0) if speed > 0.0 else left

    def _to_inserted_stop(self) -> float:
        if self._stop_at_mm is None:
            return float("inf")
        return max(self._stop_at_mm - self.distance / TENTH_UM_PER_MM, 0.0)

    def _move_back(self, speed: float, left: float) -> float:
        way = min(self._inside_mm, speed * left)
        self._inside_mm -= way
        self.speed_mm_s = speed if way > 0.0 else 0.0
        if self._inside_mm > 1e-12 or self._at == 0:
            return 0.0
        self._entered = False
        self._at -= 1
        while self._at and not self.steps[self._at].is_motion:
            self._at -= 1
        if self.steps[self._at].is_motion:
            self._element -= 1
            self._inside_mm = self.steps[self._at].length_mm
        return max(left - way / speed, 0.0) if speed > 0.0 else 0.0

    def _speed(self, step: Step) -> float:
        if self._hold:
            return 0.0
        speed = (
            self.rapid_mm_s if step.rapid else step.feed_mm_s or self.feed_mm_s
        )
        return speed * self._percent / 100.0

    def _next(self) -> None:
        reset = self.steps[self._at].kind == "distance_reset"
        self._at += 1
        self._inside_mm, self._entered, self._single_passed = 0.0, False, False
        if reset:
            self._epoch_end = self._find_epoch_end()

    # -- what the PLC sees
    def _publish(self) -> None:
        state, clah, step = (
            self.ch.bahn_state,
            self.ch.contour_lookahead.state,
            self.step,
        )
        lib.hs_seq_begin(self._seq)
        state.dist_prog_start = self.distance
        state.active_feed_r = round(self.speed_mm_s * 1000.0)
        state.command_feed_r = round(
            (step.feed_mm_s or self.feed_mm_s if step is not None else 0.0)
            * 1000.0
        )
        state.rapid_active_r = bool(step is not None and step.rapid)
        state.block_number_r = step.n if step is not None else 0
        state.block_count_r = min(self._at + 1, len(self.steps))
        state.program_end_r = self.ended
        state.wait_continue_r = self.waiting_continue
        state.wait_techno_acknowledge_r = bool(
            step is not None and step.is_function and self._entered
        )
        state.dwell_time_active_r = bool(
            step is not None and step.kind == "dwell"
        )
        state.interpolation_active_r = self.speed_mm_s > 0.0
        state.axes_in_position_r = self.speed_mm_s == 0.0
        if self.cycles:
            state.feedhold_active_r, state.override_r = (
                self._hold,
                round(self._percent * 10.0),
            )
            state.backward_active_r = (
                self._backward and self.mode.state == ACTIVE
            )
        clah.max_dist_prog_start = self.known()
        clah.count_logged_blocks = len(self.log)
        self._ahead.publish()
        lib.hs_seq_end(self._seq)

    def _serve(self) -> None:
        """Answer a look-ahead request that is there."""
        request = self._unit.wait_request(0.0)
        if request is not None:
            self.requests.append(request)
            self._unit.answer(self._ahead.tell(*request))
        self._ahead.serve()
