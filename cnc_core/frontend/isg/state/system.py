"""System variables V.G and V.A.

Names that are not in the tables are refused by name.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence

from cnc_core.blocks import motion_planes
from cnc_core.frontend.base.expression import round_half_away
from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.variables import READ_ONLY, WRONG_INDEX, Value
from cnc_core.frontend.machine import HscSetting

from .state import ProgramState
from .store import Reference, Setter

Plain = Callable[[ProgramState], Value]
# how to read and to write it; None: there is no such variable
Access = tuple[Formula, Setter | None] | None
TIMERS = 128
# machining states of the high-speed settings (``hscs.*`` of the channel)
STATES = ("deselect", "rough", "prefinish", "finish")


def _level(state: ProgramState) -> float:
    return float(len(state.flow.levels))


def _rotation_centre(state: ProgramState, which: int) -> float:
    """As a program would write it now, on the first or second axis of the plane."""
    rotation, offsets = state.spaces.rotation, state.offsets
    if rotation is None:
        return 0.0
    axis = offsets.main[motion_planes(rotation.plane)[which]]
    return offsets.word(axis, rotation.centre[which])


# channel-wide variables without an index, read only
SIMPLE: dict[str, Plain] = {
    "BLOCK_NR": lambda c: float(c.modal.n),
    "FILE_OFFSET": lambda c: float(c.flow.source.position),
    "PROG_LEVEL": _level,
    "PROG_NAME": lambda c: c.flow.level.name,
    "MAIN_PROG_NAME": lambda c: c.flow.levels[0].name,
    "FILE_NAME": lambda c: c.flow.file.path.name,
    "MAIN_FILE_NAME": lambda c: c.flow.levels[0].file.path.name,
    "MASS_MM": lambda c: float(c.modal.unit_mm != 1.0),
    "MASS_360": lambda c: 0.0,
    "I": lambda c: c.modal.centre_words[0],
    "J": lambda c: c.modal.centre_words[1],
    "K": lambda c: c.modal.centre_words[2],
    "R": lambda c: c.modal.radius_word,
    "PROG_ABS": lambda c: float(c.modal.absolute),
    "FEEDRATE": lambda c: c.channel.feeds.programmed,
    "FEEDRATE_MODE": lambda c: float(c.channel.feeds.mode),
    "T_AKT": lambda c: float(c.channel.tool),
    "D_AKT": lambda c: float(c.channel.data),
    "NP_DEFAULT": lambda c: 0.0,
    "CS_ACTIVE": lambda c: float(
        bool(c.spaces.cs.stack) or c.spaces.selected is not None
    ),
    "CS_COUNT": lambda c: float(len(c.spaces.cs.stack)),
    "ACS_ACTIVE": lambda c: float(bool(c.spaces.acs.stack)),
    "ACS_COUNT": lambda c: float(len(c.spaces.acs.stack)),
    "ROT_ACTIVE": lambda c: float(c.spaces.rotation is not None),
    "ROT_ANGLE": lambda c: (
        c.spaces.rotation.degrees if c.spaces.rotation else 0.0
    ),
    "ROT_CENTER1": lambda c: _rotation_centre(c, 0),
    "ROT_CENTER2": lambda c: _rotation_centre(c, 1),
    "TOOL_COMP": lambda c: float(c.channel.compensation.choice.side),
    "CNC_CHANNEL": lambda c: float(c.port.channel),
    "SIGNAL_READ": lambda c: float(c.signal_read),
}
ALIASES = {"SATZ_NR": "BLOCK_NR", "WZR": "WZ_AKT"}
# per axis, read only: (state, axis) -> value in programmed units
PER_AXIS: dict[str, Callable[[ProgramState, int], float]] = {
    "ABS": lambda c, a: c.offsets.programmed(a, float(c.modal.position[a])),
    "PROG": lambda c, a: c.offsets.programmed(a, float(c.modal.position[a])),
    "MENT": lambda c, a: (
        c.offsets.programmed(a, float(c.modal.position[a]))
        * float(c.offsets.mirror[a])
    ),
    "ACS.ABS": lambda c, a: float(c.spaces.axes()[a]) / c.offsets.scale(a),
    "ACT_POS": lambda c, a: float(c.spaces.axes()[a]) / c.offsets.scale(a),
    "BZP": lambda c, a: float(c.offsets.g92[a]) / c.offsets.scale(a),
    "REF": lambda c, a: 1.0,
    "MANUAL_OFFSETS": lambda c, a: 0.0,
    "MODE": lambda c, a: 0.0,
    "-SWE": lambda c, a: _limit(c, a, 0, now=True),
    "+SWE": lambda c, a: _limit(c, a, 1, now=True),
    "-SWE_MDS": lambda c, a: _limit(c, a, 0),
    "+SWE_MDS": lambda c, a: _limit(c, a, 1),
}
AXIS_ALIASES = {"SOFFS": "MANUAL_OFFSETS"}


def _limit(
    state: ProgramState, axis: int, side: int, *, now: bool = False
) -> float:
    limits = (
        state.channel.soft_limits if now else None
    ) or state.machine.limits
    value = (-1e9, 1e9)[side] if limits is None else float(limits[side][axis])
    return value / state.offsets.scale(axis)


class System:
    """V.G and V.A of one channel."""

    def __init__(self, state: ProgramState) -> None:
        self.state = state
        # kinematic parameters and the like: kept, without effect
        self.stored: dict[tuple[Value, ...], Value] = {}
        self._random = random.Random(1)

    def reference(
        self,
        family: str,
        names: list[str],
        indices: Sequence[Formula],
        offset: int,
    ) -> Reference:
        """V.G, V.A or V.RTG with names in capitals; unknown ones are refused."""
        name = f"V.{family}.{'.'.join(names)}"
        find = {
            "A": self._axis,
            "RTG": self._real_time,
            "RTA": self._real_time_axis,
        }.get(family, self._channel)
        found = find(names, indices, offset)
        if found is None:
            raise fail(900003, f"variable {name} is not supported", offset)
        load, store = found
        return Reference(
            name,
            load,
            store or _read_only(name, offset),
            lambda: True,
            family in ("RTG", "RTA"),
        )

    # V.A

    def _axis(
        self, names: list[str], indices: Sequence[Formula], offset: int
    ) -> Access:
        state = self.state
        name = ".".join(names if indices else names[:-1])
        read = PER_AXIS.get(AXIS_ALIASES.get(name, name))
        if read is None:
            return None
        axis = (
            self._axis_by_index(indices, offset)
            if indices
            else self.axis_named(names[-1], offset)
        )
        return (lambda: read(state, axis())), None

    def axis_named(self, name: str, offset: int) -> Callable[[], int]:
        """Channel index of an axis, or of @X .. @Z."""
        names = self.state.offsets.names
        if name in ("@X", "@Y", "@Z"):
            return lambda: self._main_axis(name, offset)
        if name not in names:
            raise fail(900016, f"the machine has no axis {name}", offset)
        index = names.index(name)
        return lambda: index

    def _main_axis(self, name: str, offset: int) -> int:
        """@X, @Y, @Z: of the plane in force."""
        state = self.state
        state.store.needs_cycle(name, offset)
        axis = state.machine.main[
            motion_planes(state.modal.plane)["XYZ".index(name[1])]
        ]
        if axis < 0:
            raise fail(900016, f"{name}: the machine lacks this axis", offset)
        return axis

    def _axis_by_index(
        self, indices: Sequence[Formula], offset: int
    ) -> Callable[[], int]:
        count = len(self.state.offsets.names)
        return lambda: _index(indices, count, "axis", offset)

    # V.G

    def _channel(
        self, names: list[str], indices: Sequence[Formula], offset: int
    ) -> Access:
        first, rest = ALIASES.get(names[0], names[0]), names[1:]
        if not rest and not indices and first in SIMPLE:
            state, read = self.state, SIMPLE[first]
            return (lambda: read(state)), None
        special = {
            "RANDOM": self._random_number,
            "TIMER": self._timer,
            "@P": self._argument_valid,
            "NP": self._zero_offset,
            "NP_AKT": self._active_offset,
            "WZ_AKT": self._active_tool,
            "WZ": self._tool,
            "KIN": self._kinematic,
            "HSCS": self._hsc_tolerance,
        }.get(first)
        return special(indices, rest, offset) if special else None

    def _real_time(
        self, names: list[str], indices: Sequence[Formula], offset: int
    ) -> Access:
        """V.RTG.LOOP.ENABLED and COUNT."""
        state = self.state
        if indices or names[:1] != ["LOOP"]:
            return None

        def store(value: Value) -> None:
            state.loop.enable(_number(value, offset) != 0.0)

        def count(value: Value) -> None:
            state.loop.count(_number(value, offset))

        def read(place: int) -> Formula:
            return lambda: float(state.port.loop_state(state.loop.last)[place])

        return {
            "ENABLED": (read(0), store),
            "COUNT": (read(1), count),
        }.get(".".join(names[1:]))

    def _real_time_axis(
        self, names: list[str], indices: Sequence[Formula], offset: int
    ) -> Access:
        """V.RTA.ACS.ACT_POS.X, CUR_POS: mm or degrees."""
        known = names[:1] == ["ACS"] and names[1:2] in (
            ["ACT_POS"],
            ["CUR_POS"],
        )
        if indices or not known or len(names) != 3:
            return None
        axis = self.axis_named(names[2], offset)
        return (lambda: float(self.state.port.position()[axis()])), None

    def _random_number(
        self, indices: Sequence[Formula], rest: list[str], offset: int
    ) -> Access:
        """V.G.RANDOM: 0..1, the same numbers in every run."""
        return None if indices or rest else (self._random.random, None)

    def _timer(
        self, indices: Sequence[Formula], rest: list[str], offset: int
    ) -> Access:
        """V.G.TIMER[id], ms."""
        if rest or len(indices) != 1:
            return None
        return (
            lambda: self.state.timers.read_ms.get(
                _index(indices, TIMERS, "timer", offset), 0.0
            )
        ), None

    def _argument_valid(
        self, indices: Sequence[Formula], rest: list[str], offset: int
    ) -> Access:
        """V.G.@P[i].VALID"""
        if rest != ["VALID"] or len(indices) != 1:
            return None
        store = self.state.store
        return (
            lambda: float(
                _index(indices, 201, "@P", offset) in store.arguments[-1]
            )
        ), None

    def _zero_offset(
        self, indices: Sequence[Formula], rest: list[str], offset: int
    ) -> Access:
        """V.G.NP[j].V.X"""
        if len(indices) != 1 or len(rest) != 2 or rest[0] != "V":
            return None
        offsets, axis = (
            self.state.offsets,
            self.axis_named(rest[1], offset)(),
        )

        def row() -> int:
            number = _index(indices, 97, "zero offset", offset)
            if number == 0:
                raise fail(
                    WRONG_INDEX, "zero offset 0 (G53) has no values", offset
                )
            return number

        def store(value: Value) -> None:
            offsets.stored(row())[axis] = _number(
                value, offset
            ) * offsets.scale(axis)

        return (
            lambda: float(offsets.stored(row())[axis]) / offsets.scale(axis)
        ), store

    def _active_offset(
        self, indices: Sequence[Formula], rest: list[str], offset: int
    ) -> Access:
        """V.G.NP_AKT.V.X"""
        if indices or len(rest) != 2 or rest[0] != "V":
            return None
        state, axis = self.state, self.axis_named(rest[1], offset)()
        offsets = state.offsets

        def store(value: Value) -> None:
            state.channel.not_compensated("V.G.NP_AKT", offset)
            offsets.active[axis] = _number(value, offset) * offsets.scale(axis)
            offsets.update()

        return (
            lambda: float(offsets.active[axis]) / offsets.scale(axis)
        ), store

    def _active_tool(
        self, indices: Sequence[Formula], rest: list[str], offset: int
    ) -> Access:
        """V.G.WZ_AKT.R and .L, mm or inch; .P[i] is kept without effect."""
        channel, modal = self.state.channel, self.state.modal
        if rest == ["P"]:
            return self._stored("WZ_AKT.P", indices)
        if indices or rest not in (["R"], ["L"], ["OK"], ["ME"]):
            return None
        if rest[0] in ("OK", "ME"):
            value = float(rest[0] == "OK")
            return (lambda: value), None
        radius = rest[0] == "R"

        def store(value: Value) -> None:
            channel.change_tool(radius, _number(value, offset) * modal.unit_mm)

        def load() -> Value:
            tool = channel.tool_data
            return (
                tool.radius_mm if radius else tool.length_mm
            ) / modal.unit_mm

        return load, store

    def _tool(
        self, indices: Sequence[Formula], rest: list[str], offset: int
    ) -> Access:
        """V.G.WZ[j].R and .L of the tool table, mm or inch, read only."""
        if len(indices) != 1 or rest not in (["R"], ["L"]):
            return None
        modal, tools = self.state.modal, self.state.machine.tools

        def load() -> Value:
            number = _index(indices, 2**31, "tool", offset)
            if number not in tools:
                raise fail(900014, f"the machine has no tool {number}", offset)
            tool = tools[number]
            return (
                tool.radius_mm if rest[0] == "R" else tool.length_mm
            ) / modal.unit_mm

        return load, None

    def _hsc_tolerance(
        self, indices: Sequence[Formula], rest: list[str], offset: int
    ) -> Access:
        """V.G.HSCS.FINISH.TOLERANCE and the like, mm or inch, read only."""
        state = self.state
        if (
            indices
            or len(rest) != 2
            or rest[0].lower() not in STATES
            or rest[1] != "TOLERANCE"
        ):
            return None
        setting = state.machine.hsc_settings.get(rest[0].lower(), HscSetting())
        return (lambda: setting.tolerance_mm / state.modal.unit_mm), None

    def _kinematic(
        self, indices: Sequence[Formula], rest: list[str], offset: int
    ) -> Access:
        """V.G.KIN[i].*: kept without effect."""
        return (
            self._stored(f"KIN.{'.'.join(rest)}", indices)
            if indices and rest
            else None
        )

    def _stored(self, name: str, indices: Sequence[Formula]) -> Access:
        """Kept and read back, without effect."""

        def key() -> tuple[Value, ...]:
            return (name, *(index() for index in indices))

        def store(value: Value) -> None:
            self.stored[key()] = value

        return (lambda: self.stored.get(key(), 0.0)), store


def _read_only(name: str, offset: int) -> Setter:
    def store(value: Value) -> None:
        raise fail(READ_ONLY, f"{name} is read only", offset)

    return store


def _index(
    indices: Sequence[Formula], count: int, what: str, offset: int
) -> int:
    value = indices[0]()
    if (
        len(indices) != 1
        or isinstance(value, str)
        or not -0.5 < value < count - 0.5
    ):
        raise fail(
            WRONG_INDEX, f"{what} {value} out of range 0..{count - 1}", offset
        )
    return round_half_away(value)


def _number(value: Value, offset: int) -> float:
    if isinstance(value, str):
        raise fail(907011, "a number is expected, not a text", offset)
    return value
