"""Level control units (hli_reference 2.2): the PLC's value counts as long as it
is enabled.
"""

from __future__ import annotations

import ctypes
from enum import Enum
from typing import Any

from hli.structures import (
    HLI_AXIS,
    HLI_CHANNEL,
    MC_CONTROL_BOOL_UNIT,
    MC_CONTROL_SGN32_UNIT,
    MC_CONTROL_UNS16_UNIT,
    MC_CONTROL_UNS32_UNIT,
)

from .base import ERROR_INPUT, ERROR_NOT_PRESENT, FunctionBlock
from .owner import (
    AnyLevelUnit,
    area_around,
    axis_of,
    channel_of,
    level_unit_of,
)


class LevelState(Enum):
    """States of a level block (docs/reference/plc.md draws them)."""

    RELEASED = "released"  # enable FALSE: the operator's value counts
    COMMANDED = "commanded"  # command_w is set, the CNC does not show it yet
    EFFECTIVE = "effective"  # state_r shows the command
    ERROR = "error"


# a scan looks at them in every call: a global is found sooner than a member
_RELEASED, _COMMANDED = LevelState.RELEASED, LevelState.COMMANDED
_EFFECTIVE, _ERROR = LevelState.EFFECTIVE, LevelState.ERROR


def command(unit: Any, value: Any) -> None:
    """Command a level unit: the value before the enable, so that no old value
    ever acts.
    """
    # reading the structure itself is quick; writing goes through the checks of
    # the view
    memory = unit._c
    held = memory.command_w
    if held != value or type(held) is not type(value):
        unit.command_w = value
    if not memory.enable_w:
        unit.enable_w = True


class LevelUnit(FunctionBlock):
    """One level unit: ``LevelUnit(ch.bahn_mc_control.feedhold)(enable=True,
    value=True)`` once per scan.

    Outputs: ``value`` (what the CNC uses, ``state_r``), ``request`` (what the
    operator asks for, ``request_r``), ``done`` (the CNC uses the command),
    ``busy`` (not yet), ``enabled`` (by this block). ``enable`` FALSE gives the
    unit back to the operator.
    """

    def __init__(self, unit: AnyLevelUnit) -> None:
        unit = level_unit_of(self, unit)
        super().__init__()
        self.unit = unit
        # the structures themselves: reading them has nothing to check
        self._memory, self._head = unit._c, area_around(unit)._c.head
        self.state = LevelState.RELEASED
        self.value: Any = unit.state_r
        self.request: Any = unit.request_r
        self.enabled = False

    def __call__(self, enable: bool, value: Any) -> Any:
        """One scan; returns what the CNC uses.

        A value the unit cannot hold is error 1 and changes nothing.
        """
        memory = self._memory
        error = self._command(value) if enable else self._release()
        effective = memory.state_r
        if error:
            state = _ERROR
        elif not enable:
            state = _RELEASED
        else:
            reached = effective == memory.command_w
            state = _EFFECTIVE if reached else _COMMANDED
        self.value, self.request = effective, memory.request_r
        self.state, self.error_id = state, error
        self.done, self.busy = state is _EFFECTIVE, state is _COMMANDED
        self.error = state is _ERROR
        return effective

    def _command(self, value: Any) -> int:
        try:
            command(self.unit, value)
        except (OverflowError, TypeError):
            return ERROR_INPUT
        self.enabled = True
        return 0 if self._head.plc_present_w else ERROR_NOT_PRESENT

    def _release(self) -> int:
        if self.enabled:  # only once: the unit may be another block's by now
            self.unit.enable_w = self.enabled = False
        return 0

    def release(self) -> None:
        """Give the unit back to the operator."""
        self(False, 0)


def stretch_of(*units: Any) -> memoryview:
    """The bytes of one channel or axis from the first of these units to the end
    of the last one.
    """
    area = area_around(units[0])
    first = min(unit._address for unit in units)
    end = max(unit._address + ctypes.sizeof(unit._c) for unit in units)
    return memoryview(area._c).cast("B")[
        first - area._address : end - area._address
    ]


class _Levels(FunctionBlock):
    """Several level units of one channel or axis commanded together; the
    outputs are those of all.

    A call that finds inputs and memory as they were in the last call, which
    changed nothing, is done at once.  Scans run this every millisecond: what
    they look at are the structures themselves.
    """

    def __init__(self, *units: Any) -> None:
        super().__init__()
        self._units = units
        self._structures = [unit._c for unit in units]
        self._enabled = [False] * len(units)  # by this block
        self._memory = stretch_of(*units)
        self._head = area_around(units[0])._c.head
        self._given: tuple[Any, ...] | None = None
        self._settled = b""  # the memory, where a call changed nothing
        self.state = LevelState.RELEASED

    def _run(self, enable: bool, *values: Any) -> None:
        """Command the units, in the order in which they were given; None: the
        operator's value counts.
        """
        given = enable, values, self._head.plc_present_w
        before = self._memory.tobytes() if given == self._given else b""
        if before and before == self._settled:
            return
        if enable:
            self._command(values)
        else:
            self.release()
            self.error, self.error_id = False, 0
        self._given = given
        settled = bool(before) and self._memory.tobytes() == before
        self._settled = before if settled else b""

    def _command(self, values: tuple[Any, ...]) -> None:
        absent = 0 if self._head.plc_present_w else ERROR_NOT_PRESENT
        error_id = effective = waiting = 0
        for i, value in enumerate(values):
            if value is None:
                self._release_one(i)
                continue
            wrong = self._command_one(i, value) or absent
            structure = self._structures[i]
            if wrong:
                error_id = error_id or wrong
            elif structure.state_r == structure.command_w:
                effective += 1
            else:
                waiting += 1
        self.error, self.error_id = error_id != 0, error_id
        self.busy = waiting > 0
        self.done = effective > 0 and not (waiting or error_id)
        self.state = (
            _ERROR if error_id else
            _EFFECTIVE if self.done else
            _COMMANDED if self.busy else _RELEASED
        )  # fmt: skip

    def _command_one(self, i: int, value: Any) -> int:
        """The error number."""
        try:
            command(self._units[i], value)
        except (OverflowError, TypeError):
            return ERROR_INPUT
        self._enabled[i] = True
        return 0

    def _release_one(self, i: int) -> None:
        """Only once: the unit may be another block's by now."""
        if self._enabled[i]:
            self._units[i].enable_w = self._enabled[i] = False

    def _refuse(self) -> None:
        """An input is not usable: error 1, the units keep what they have."""
        self.refused += 1
        self.error, self.error_id, self.state = True, ERROR_INPUT, _ERROR
        self.done = self.busy = False
        self._given = None

    def release(self) -> None:
        """Give the units back to the operator's values."""
        for i in range(len(self._units)):
            self._release_one(i)
        self.done = self.busy = False
        self.state = _RELEASED
        self._given = None


class FeedHold(_Levels):
    """``bahn_mc_control.feedhold``: ``FeedHold(ch)(hold=True)`` brakes and
    stands; the mode stays ACTIVE.

    Output ``standing``: the hold acts and nothing moves.
    """

    def __init__(self, ch: HLI_CHANNEL | MC_CONTROL_BOOL_UNIT) -> None:
        ch = channel_of(self, ch, "bahn_mc_control.feedhold")
        super().__init__(ch.bahn_mc_control.feedhold)
        self._status = ch.bahn_state
        self.standing = False

    def __call__(self, hold: bool, enable: bool = True) -> bool:
        """One scan; returns ``standing``."""
        self._run(enable, hold)
        self.standing = (
            bool(self._status.feedhold_active_r)
            and self._status.active_feed_r == 0
        )
        return self.standing


class Override(_Levels):
    """Path and rapid override in percent (0..200 in steps of 0.1); None leaves
    one of them to the operator.

    ``bahn_mc_control.override``, ``override_valid``, ``rapid_override``,
    ``rapid_override_valid``.  Outputs ``path`` and ``rapid``: percent the units
    show, ``effective``: percent the path follows now.
    """

    def __init__(self, ch: HLI_CHANNEL | MC_CONTROL_UNS16_UNIT) -> None:
        ch = channel_of(
            self,
            ch,
            "bahn_mc_control.override",
            "bahn_mc_control.rapid_override",
        )
        c = ch.bahn_mc_control
        super().__init__(
            c.override,
            c.override_valid,
            c.rapid_override,
            c.rapid_override_valid,
        )
        self._status = ch.bahn_state._c
        self._path, _, self._rapid, _ = self._structures
        self.path = self.rapid = self.effective = 100.0

    def __call__(
        self,
        path: float | None = 100.0,
        rapid: float | None = None,
        enable: bool = True,
    ) -> None:
        """One scan; a value outside 0..200 (or NaN) is error 1 and changes nothing."""
        tenths, rapid_tenths = _tenths(path), _tenths(rapid)
        if _UNUSABLE in (tenths, rapid_tenths):
            self._refuse()
            return
        valid = None if path is None else True
        rapid_valid = None if rapid is None else True
        self._run(enable, tenths, valid, rapid_tenths, rapid_valid)
        self.path = self._path.state_r / 10.0
        self.rapid = self._rapid.state_r / 10.0
        self.effective = self._status.override_r / 10.0

    def _commanded(self) -> float:
        """Percent that the path's unit commands now; 100 while it is free."""
        unit = self._path
        return unit.command_w / 10.0 if unit.enable_w else 100.0


OVERRIDE_MAX_PERCENT = 200.0


_UNUSABLE = -1


def _tenths(percent: float | None) -> int | None:
    """What the unit holds; ``_UNUSABLE``: it cannot hold that."""
    if percent is None:
        return None
    usable = 0.0 <= percent <= OVERRIDE_MAX_PERCENT
    return round(percent * 10.0) if usable else _UNUSABLE


class OptionalStop(_Levels):
    """``bahn_mc_control.m01_stop_enable``: M01 stops at the block's end."""

    def __init__(self, ch: HLI_CHANNEL | MC_CONTROL_BOOL_UNIT) -> None:
        ch = channel_of(self, ch, "bahn_mc_control.m01_stop_enable")
        super().__init__(ch.bahn_mc_control.m01_stop_enable)

    def __call__(self, stop: bool, enable: bool = True) -> None:
        """One scan."""
        self._run(enable, stop)


class RtLoop(_Levels):
    """``bahn_mc_control.rt_loop_enable``: while TRUE, the loop of ``#RT WHILE``
    is driven, and once more at its end (V.RTG.LOOP.ENABLED).
    """

    def __init__(self, ch: HLI_CHANNEL | MC_CONTROL_BOOL_UNIT) -> None:
        ch = channel_of(self, ch, "bahn_mc_control.rt_loop_enable")
        super().__init__(ch.bahn_mc_control.rt_loop_enable)

    def __call__(self, loop: bool, enable: bool = True) -> None:
        """One scan."""
        self._run(enable, loop)


SKIP_LEVELS = 10


class SkipLevels(_Levels):
    """``decoder_mc_control.program_block_ignore``: the skip levels 1..10 whose
    ``/n`` blocks are left out.

    Evaluated at program start only; a change while a program runs acts on the
    next one.
    """

    def __init__(self, ch: HLI_CHANNEL | MC_CONTROL_UNS32_UNIT) -> None:
        ch = channel_of(self, ch, "decoder_mc_control.program_block_ignore")
        super().__init__(ch.decoder_mc_control.program_block_ignore)

    def __call__(
        self, levels: tuple[int, ...] = (), enable: bool = True
    ) -> None:
        """One scan; a level outside 1..10 is error 1 and changes nothing."""
        if any(not 1 <= level <= SKIP_LEVELS for level in levels):
            self._refuse()
            return
        self._run(enable, sum({1 << (level - 1) for level in levels}))


class PathDirection(_Levels):
    """Backward and simulated forward motion on the path: ``backward_motion``,
    ``simulate_motion``.

    Outputs ``backward_active`` (the path runs backwards), ``distance``
    (``dist_prog_start``, which decreases then). ``clear_storage`` commands
    ``backward_storage_off`` (only without an active program).
    """

    def __init__(self, ch: HLI_CHANNEL | MC_CONTROL_BOOL_UNIT) -> None:
        ch = channel_of(
            self,
            ch,
            "bahn_mc_control.backward_motion",
            "bahn_mc_control.simulate_motion",
        )
        c = ch.bahn_mc_control
        super().__init__(
            c.backward_motion, c.simulate_motion, c.backward_storage_off
        )
        self._status = ch.bahn_state
        self.backward_active = False
        self.distance = 0.0

    def __call__(
        self,
        backward: bool = False,
        simulate: bool = False,
        clear_storage: bool = False,
        enable: bool = True,
    ) -> None:
        """One scan; backward and simulated forward motion together are error 1."""
        if backward and simulate:
            self._refuse()
            return
        self._run(enable, backward, simulate, clear_storage)
        self.backward_active = bool(self._status.backward_active_r)
        self.distance = float(self._status.dist_prog_start)


class ExternalSpeed(_Levels):
    """External path speed, 1 um/s, negative = backward: ``ext_command_speed``,
    ``ext_command_speed_valid``.
    """

    def __init__(self, ch: HLI_CHANNEL | MC_CONTROL_SGN32_UNIT) -> None:
        ch = channel_of(self, ch, "bahn_mc_control.ext_command_speed")
        c = ch.bahn_mc_control
        super().__init__(c.ext_command_speed, c.ext_command_speed_valid)

    def __call__(self, speed: int, enable: bool = True) -> None:
        """One scan."""
        self._run(enable, speed, True)


class AxisControl(_Levels):
    """One axis or spindle ``gpAx[i]``: releases, feedhold and its own override
    (percent; None: none).

    ``lr_mc_control.release_feedhold``, ``drive_on``, ``torque_permission``,
    ``ipo_mc_control.feedhold``, ``override``, ``override_valid``.  A falling
    release brakes the path; every axis that shall move must be released.
    """

    def __init__(self, ax: HLI_AXIS) -> None:
        ax = axis_of(self, ax)
        lr, ipo = ax.lr_mc_control, ax.ipo_mc_control
        super().__init__(
            lr.release_feedhold,
            lr.drive_on,
            lr.torque_permission,
            ipo.feedhold,
            ipo.override,
            ipo.override_valid,
        )

    def __call__(
        self,
        release: bool = True,
        feedhold: bool = False,
        override: float | None = None,
        drive_on: bool = True,
        torque_permission: bool = True,
        enable: bool = True,
    ) -> None:
        """One scan; an override outside 0..200 is error 1 and changes nothing."""
        tenths = _tenths(override)
        if tenths == _UNUSABLE:
            self._refuse()
            return
        valid = None if override is None else True
        levels = release, drive_on, torque_permission, feedhold
        self._run(enable, *levels, tenths, valid)
