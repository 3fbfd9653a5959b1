"""Commands of coordinate systems: #CS, #ACS, the named stack, #ROTATION, #SCALE."""

from __future__ import annotations

from collections.abc import Callable

from cnc_core.blocks import motion_planes
from cnc_core.blocks.coordinates import Frame
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import fail

from ..state.coordinate_systems import SEQUENCES, Order, Systems, frame_of
from ..state.spaces import Rotation
from .base import Items, Run
from .coordinate_base import NOT_IN_MCS, Commands, CoordinateBase

ID_MAX = 2**31 - 1


class FrameCommands(CoordinateBase):
    """Commands that turn and shift; each gives the row for the stages."""

    def _frame_commands(self) -> Commands:
        return (
            (("CS", "DEF"), self._cs_def),
            (("CS", "ON"), self._cs_on),
            (("CS", "OFF"), self._cs_off),
            (("CS", "ADD"), self._cs_add),
            (("CS", "SET"), self._cs_set),
            (("CS", "SELECT"), self._cs_select),
            (("CS", "DEL"), self._cs_del),
            (("CS", "MODE", "ON"), self._cs_mode),
            (("CS", "MODE", "OFF"), self._cs_mode_off),
            (("ACS", "DEF"), self._acs_def),
            (("ACS", "ON"), self._acs_on),
            (("ACS", "OFF"), self._acs_off),
            (("ROTATION", "ON"), self._rotation_on),
            (("ROTATION", "OFF"), self._rotation_off),
            (("SCALE", "ON"), self._scale_on),
            (("SCALE", "OFF"), self._scale_off),
        )

    # values

    def _frame(self, fields: list[Formula | None]) -> Callable[[], Frame]:
        """Up to three shifts and three angles."""
        start, modal, spaces = self._start, self._modal, self._state.spaces
        if len(fields) > 6:
            raise fail(
                900010,
                f"a coordinate system has six values, not {len(fields)}",
                start,
            )

        def make() -> Frame:
            values = []
            for field in fields:
                value = 0.0 if field is None else field()
                if isinstance(value, str):
                    raise fail(907011, ERRORS[907011], start)
                if not abs(value) <= 1e9:
                    raise fail(
                        900012,
                        f"coordinate system: {value} out of range",
                        start,
                    )
                values.append(value)
            return frame_of(values, modal.unit_mm, spaces.order)

        return make

    def _number(self, field: Formula | None) -> Callable[[], int]:
        if field is None:
            raise fail(
                900004,
                "a number of a coordinate system is expected",
                self._start,
            )
        return self._whole(field, "number of a coordinate system", 1, ID_MAX)

    def _definition(
        self,
    ) -> tuple[Callable[[], int] | None, Callable[[], Frame] | None]:
        """``[id][values]``, ``[values]``, ``[id]`` (one value alone) or nothing."""
        if not self._stream.is_op("["):
            return None, None
        first = self._bracket()
        if self._stream.is_op("["):
            if len(first) != 1:
                raise fail(
                    900010,
                    "a number of a coordinate system is expected in the first bracket",
                    self._start,
                )
            return self._number(first[0]), self._frame(self._bracket())
        if len(first) == 1 and first[0] is not None:
            return self._number(first[0]), None
        return None, self._frame(first)

    # #CS and #ACS

    def _systems_def(self, systems: Systems) -> Run:
        """``DEF [id][v1,v2,v3,f1,f2,f3]``: nothing changes yet."""
        start = self._start
        if not self._stream.is_op("["):
            raise fail(
                900010, f"#{systems.name} DEF: values are expected", start
            )
        first = self._bracket()
        two = self._stream.is_op("[")
        number = self._number(first[0]) if two and len(first) == 1 else None
        if two and number is None:
            raise fail(
                900010,
                "a number of a coordinate system is expected in the first bracket",
                start,
            )
        frame = self._frame(self._bracket() if two else first)

        def run() -> Items:
            if self._state.spaces.mcs:
                raise fail(
                    NOT_IN_MCS,
                    f"#{systems.name} DEF: {ERRORS[NOT_IN_MCS]}",
                    start,
                )
            systems.define(None if number is None else number(), frame(), start)
            return []

        return run

    def _systems_on(self, systems: Systems) -> Run:
        """``ON``, ``ON [id]``, ``ON [values]``, ``ON [id][values]``."""
        spaces, start = self._state.spaces, self._start
        number, frame = self._definition()

        def change() -> None:
            wanted = None if number is None else number()
            if frame is not None:
                wanted = systems.define(wanted, frame(), start)
            spaces.switch_on(systems, systems.find(wanted, start), start)

        return self._changing(f"#{systems.name} ON", change, in_ptp=21550)

    def _systems_off(self, systems: Systems) -> Run:
        """``OFF``: the last one, ``OFF ALL``."""
        every = self._stream.accept_name("ALL") is not None
        if self._stream.is_op("["):
            raise fail(
                900010,
                f"#{systems.name} OFF takes no number: the last one is deselected",
                self._start,
            )
        spaces = self._state.spaces

        def change() -> None:
            spaces.switch_off(systems, every=every)

        name = f"#{systems.name} OFF"
        changing = self._changing(name, change, in_ptp=21550)
        return lambda: changing() if systems.stack else []

    def _cs_def(self) -> Run:
        return self._systems_def(self._state.spaces.cs)

    def _cs_on(self) -> Run:
        return self._systems_on(self._state.spaces.cs)

    def _cs_off(self) -> Run:
        return self._systems_off(self._state.spaces.cs)

    def _acs_def(self) -> Run:
        return self._systems_def(self._state.spaces.acs)

    def _acs_on(self) -> Run:
        return self._systems_on(self._state.spaces.acs)

    def _acs_off(self) -> Run:
        return self._systems_off(self._state.spaces.acs)

    # the named stack

    def _system_name(self) -> str:
        """``[NAME]``"""
        stream = self._stream
        if not stream.is_op("["):
            raise fail(
                900010,
                "the name of a coordinate system is expected in brackets",
                self._start,
            )
        begin = stream.current.offset + 1
        end = stream.text.find("]", begin)
        if end < 0:
            raise fail(900013, "bracket is not closed", begin - 1)
        name = stream.text[begin:end].strip().strip('"').upper()
        stream.skip_to(end + 1)
        return name

    def _cs_add(self) -> Run:
        """``#CS ADD [NAME][v1,..,f3]``: on top of the stack, not in force yet."""
        spaces, start, name = (
            self._state.spaces,
            self._start,
            self._system_name(),
        )
        frame = self._frame(self._bracket_expected("#CS ADD"))

        def run() -> Items:
            spaces.add_named(name, frame(), start)
            return []

        return run

    def _cs_set(self) -> Run:
        """``#CS SET [NAME][v1,..,f3]``: other values, in force at once if they
        are used.
        """
        spaces, start, name = (
            self._state.spaces,
            self._start,
            self._system_name(),
        )
        frame = self._frame(self._bracket_expected("#CS SET"))
        return self._changing(
            "#CS SET",
            lambda: spaces.set_named(name, frame(), start),
            in_ptp=21550,
        )

    def _cs_select(self) -> Run:
        """``#CS SELECT [NAME]``: the chain up to NAME; MCS: none."""
        spaces, start, name = (
            self._state.spaces,
            self._start,
            self._system_name(),
        )
        return self._changing(
            "#CS SELECT", lambda: spaces.select_named(name, start), in_ptp=21550
        )

    def _cs_del(self) -> Run:
        """``#CS DEL``: the topmost one, ``#CS DEL ALL``."""
        spaces, every = (
            self._state.spaces,
            self._stream.accept_name("ALL") is not None,
        )
        return self._changing(
            "#CS DEL", lambda: spaces.delete_named(every=every), in_ptp=21550
        )

    def _cs_mode(self) -> Run:
        """``#CS MODE ON [ROTATION_SEQUENCE=XYZ ROTATION_MODE_FIXED]``: of the
        definitions that follow.
        """
        stream, sequence, fixed = self._stream, "ZYX", False
        if not stream.accept("["):
            raise fail(
                900010,
                "#CS MODE ON: ROTATION_SEQUENCE or ROTATION_MODE_FIXED is expected",
                self._start,
            )
        while not stream.is_op("]"):
            word = stream.accept_name(
                "ROTATION_SEQUENCE", "ROTATION_MODE_FIXED"
            )
            if word is None:
                text = (
                    "#CS MODE ON: expected ROTATION_SEQUENCE or "
                    f"ROTATION_MODE_FIXED, found {stream.describe()}"
                )
                raise fail(900010, text, stream.current.offset)
            if word.text.upper() == "ROTATION_MODE_FIXED":
                fixed = True
            else:
                stream.accept("=")
                token = stream.next()
                sequence = token.text.upper()
                if sequence not in SEQUENCES:
                    raise fail(
                        900003,
                        f"#CS MODE ON: ROTATION_SEQUENCE {sequence} is not supported",
                        token.offset,
                    )
            stream.accept(",")
        stream.expect("]", 900010)
        return self._order(Order(sequence, fixed))

    def _cs_mode_off(self) -> Run:
        return self._order(Order())

    def _order(self, order: Order) -> Run:
        spaces = self._state.spaces

        def run() -> Items:
            spaces.order = order
            return []

        return run

    # contour rotation

    def _rotation_on(self) -> Run:
        """``#ROTATION ON [ANGLE=..

        CENTER1=.. CENTER2=..]``: in the plane, about a programmed point.
        """
        known = {"ANGLE": True, "CENTER1": True, "CENTER2": True}
        keys = self._keys(known) if self._stream.is_op("[") else {}
        start, spaces = self._start, self._state.spaces

        def value(key: str) -> float:
            formula = keys.get(key)
            found = 0.0 if formula is None else formula()
            if isinstance(found, str) or not abs(found) <= 1e9:
                raise fail(
                    900012, f"#ROTATION ON: {key} {found} out of range", start
                )
            return found

        def change() -> None:
            plane, offsets = self._modal.plane, self._state.offsets
            first, second = (
                offsets.main[place] for place in motion_planes(plane)[:2]
            )
            if min(first, second) < 0:
                raise fail(900016, f"#ROTATION ON: {ERRORS[900016]}", start)
            centre = (
                offsets.from_zero(first, value("CENTER1")),
                offsets.from_zero(second, value("CENTER2")),
            )
            spaces.set_rotation(Rotation(plane, value("ANGLE"), centre))
            self._state.rotation_in_cycle(start)

        return self._changing("#ROTATION ON", change)

    def _rotation_off(self) -> Run:
        spaces = self._state.spaces
        changing = self._changing(
            "#ROTATION OFF", lambda: spaces.set_rotation(None)
        )
        return lambda: changing() if spaces.rotation else []

    # scale

    def _scale_on(self) -> Run:
        """``#SCALE ON [X2 Y2 Z2]``: factors of the words of main axes, from the
        next absolute word on.
        """
        stream, formulas, start, offsets = (
            self._stream,
            self._formulas,
            self._start,
            self._state.offsets,
        )
        if not stream.is_op("["):
            raise fail(900010, "#SCALE ON: factors of axes are expected", start)
        opened, factors = formulas.open(), dict[int, Callable[[], float]]()
        while not stream.is_op("]"):
            token = stream.current
            name = self._axis_name()
            if name is None or self._axes[name] not in self._state.machine.main:
                raise fail(
                    900010,
                    f"#SCALE ON: expected a main axis, found {token.text or 'the end'}",
                    token.offset,
                )
            stream.accept("=")
            factors[self._axes[name]] = formulas.number(name, token.offset)
            stream.accept(",")
        formulas.close(opened)
        if not factors:
            raise fail(900010, "#SCALE ON: factors of axes are expected", start)

        def run() -> Items:
            self.not_compensated("#SCALE ON", 906003)
            offsets.factor[:] = 1.0
            for axis, factor in factors.items():
                value = factor()
                if not 1e-6 <= value <= 1e6:
                    raise fail(
                        900012,
                        f"#SCALE ON: factor {value:g} out of range 0.000001..1000000",
                        start,
                    )
                offsets.factor[axis] = value
            offsets.update()
            return []

        return run

    def _scale_off(self) -> Run:
        offsets = self._state.offsets

        def run() -> Items:
            if (offsets.factor != 1.0).any():
                self.not_compensated("#SCALE OFF", 906003)
                offsets.factor[:] = 1.0
                offsets.update()
            return []

        return run
