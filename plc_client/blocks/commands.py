"""Commands on the path: continue, delete distance to go, inserted stop
(hli_reference 5.1, 5.3).
"""

from __future__ import annotations

import math

from hli.structures import (
    HLI_CHANNEL,
    MC_CONTROL_BOOL_UNIT,
    MC_CONTROL_INSERT_CMD_UNIT,
    MC_CONTROL_UNS32_UNIT,
)

from .base import (
    ERROR_INPUT,
    ERROR_NOT_PRESENT,
    TIMEOUT_S,
    ExecuteBlock,
    present,
)
from .level import LevelUnit, command
from .owner import channel_of

_Inputs = tuple[float, int, int, int, int]


class _Edge(ExecuteBlock):
    """A level unit whose rising edge counts: command TRUE, the CNC shows it in
    ``state_r``, command FALSE.
    """

    def __init__(
        self, ch: HLI_CHANNEL, unit: MC_CONTROL_BOOL_UNIT, timeout_s: float
    ) -> None:
        super().__init__(timeout_s)
        self._ch, self._unit = ch, unit

    def _check(self) -> int:
        return 0 if present(self._ch) else ERROR_NOT_PRESENT

    def _may_send(self) -> bool:
        """The edge needs a FALSE that the CNC has seen."""
        if self._unit.state_r:
            command(self._unit, False)
            return False
        return True

    def _send(self) -> None:
        command(self._unit, True)

    def _taken(self) -> bool:
        return bool(self._unit.state_r)

    def _leave(self) -> None:
        command(self._unit, False)


class ContinueMachining(_Edge):
    """Leaves M00, M01, a single block or an inserted stop:
    ``ContinueMachining(ch)(execute)``.

    Waits until the channel really stands and its axes are in position
    (``wait_continue_r``, ``wait_axes_in_position_r``), so that the edge is
    never given too early; done when the channel waits no longer.
    """

    def __init__(
        self,
        ch: HLI_CHANNEL | MC_CONTROL_BOOL_UNIT,
        timeout_s: float = math.inf,
    ) -> None:
        ch = channel_of(self, ch, "bahn_mc_control.continue_machining")
        super().__init__(ch, ch.bahn_mc_control.continue_machining, timeout_s)
        self._status = ch.bahn_state
        self.waiting = False

    def __call__(self, execute: bool) -> bool:
        """One scan; output ``waiting``: the channel waits for "continue"."""
        self.waiting = (
            bool(self._status.wait_continue_r)
            and not self._status.wait_axes_in_position_r
        )
        return self._run(execute)

    def _may_send(self) -> bool:
        return super()._may_send() and self.waiting


class SingleBlock(LevelUnit):
    """``bahn_mc_control.single_block`` with the key that goes on:
    ``SingleBlock(ch)(enable, next_block)``.

    Outputs ``waiting`` (stands between two blocks), ``steps`` (how often it
    went on).
    """

    def __init__(self, ch: HLI_CHANNEL | MC_CONTROL_BOOL_UNIT) -> None:
        ch = channel_of(self, ch, "bahn_mc_control.single_block")
        super().__init__(ch.bahn_mc_control.single_block)
        self._continue = ContinueMachining(ch)
        self.waiting = False
        self.steps = 0

    def __call__(self, enable: bool, next_block: bool = False) -> bool:
        """One scan; a rising edge of ``next_block`` executes one block.

        Returns ``waiting``.
        """
        super().__call__(enable, True)
        was_done = self._continue.done
        self.steps += self._continue(next_block) and not was_done
        self.waiting = self._continue.waiting
        return self.waiting


class DeleteDistanceToGo(_Edge):
    """Brakes and goes straight to the target of the next motion block:
    ``DeleteDistanceToGo(ch)(execute)``.

    ``mask`` not 0 is commanded as ``del_dist_to_go_end`` with it (for ``#DEL
    DIST2GO [END=mask]``).  Output ``active``: the shortcut is running.  Done
    when the CNC has seen the edge.
    """

    def __init__(
        self,
        ch: HLI_CHANNEL | MC_CONTROL_BOOL_UNIT | MC_CONTROL_UNS32_UNIT,
        timeout_s: float = TIMEOUT_S,
    ) -> None:
        ch = channel_of(
            self,
            ch,
            "bahn_mc_control.delete_distance_to_go",
            "bahn_mc_control.del_dist_to_go_end",
        )
        super().__init__(
            ch, ch.bahn_mc_control.delete_distance_to_go, timeout_s
        )
        self._status = ch.bahn_state
        self._end = ch.bahn_mc_control.del_dist_to_go_end
        self._mask = 0
        self.active = False

    def __call__(self, execute: bool, mask: int = 0) -> bool:
        """One scan."""
        self._mask = mask
        self.active = bool(self._status.delete_distance_to_go_active_r)
        return self._run(execute)

    def _check(self) -> int:
        return (
            ERROR_INPUT if not 0 <= self._mask < 1 << 32 else super()._check()
        )

    def _send(self) -> None:
        if self._mask:
            command(self._end, self._mask)
        super()._send()


RELATIVE = 0
"""InsertStop: so far from here, again and again."""
ABSOLUTE_ONCE = 1
"""InsertStop: at a distance from program start, once."""
RELATIVE_ONCE = 2
"""InsertStop: so far from here, once."""


class InsertStop(ExecuteBlock):
    """A stop with an M function at a distance: ``InsertStop(ch)(execute,
    500_000.0, ABSOLUTE_ONCE)``.

    ``distance``: 0.1 um of path from program start (``ABSOLUTE_ONCE``) or from
    here (``RELATIVE_ONCE``; ``RELATIVE``: again after every stop, 0 deletes);
    with ``axis`` (logical number) a position of that axis.  ``m_function`` 0:
    M00, 1: M01, else that M as MVS_SVS with ``add_value``.  Done when the CNC
    has taken the command. Outputs ``next_stop`` (0.1 um, -1: none found),
    ``positions`` (0.1 um, per axis of the channel).
    """

    def __init__(
        self,
        ch: HLI_CHANNEL | MC_CONTROL_INSERT_CMD_UNIT,
        timeout_s: float = TIMEOUT_S,
    ) -> None:
        ch = channel_of(self, ch, "bahn_mc_control.insert_cmd")
        super().__init__(timeout_s)
        self._ch = ch
        self._unit = ch.bahn_mc_control.insert_cmd
        self._inputs: _Inputs = (0.0, 0, 0, 0, 0)
        self.next_stop = -1.0

    def __call__(
        self,
        execute: bool,
        distance: float = 0.0,
        mode: int = ABSOLUTE_ONCE,
        axis: int = 0,
        m_function: int = 0,
        add_value: int = 0,
    ) -> bool:
        """One scan; the inputs count in the call with the rising edge."""
        if not self.busy:
            self._inputs = (distance, mode, axis, m_function, add_value)
        self.next_stop = float(self._unit.state_r.distance_of_next_stop)
        return self._run(execute)

    @property
    def positions(self) -> list[int]:
        """Axis positions at the next stop."""
        return list(self._unit.state_r.position_at_next_stop)

    def _check(self) -> int:
        distance, mode, axis, m_function, _ = self._inputs
        usable = math.isfinite(distance) and mode in (
            RELATIVE,
            ABSOLUTE_ONCE,
            RELATIVE_ONCE,
        )
        if not (usable and 0 <= axis <= 65535 and 0 <= m_function <= 65535):
            return ERROR_INPUT
        return 0 if present(self._ch) else ERROR_NOT_PRESENT

    def _may_send(self) -> bool:
        return not self._unit.command_semaphor_rw

    def _send(self) -> None:
        c = self._unit.command_w
        c.dist_or_pos, c.rel_abs_mode, c.axis_nr, c.m_function_nr, c.add_nr = (
            self._inputs
        )
        self._unit.enable_w = True
        self._unit.command_semaphor_rw = True

    def _taken(self) -> bool:
        return not self._unit.command_semaphor_rw
