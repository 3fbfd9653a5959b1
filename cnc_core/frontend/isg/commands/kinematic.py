"""Commands of machine coordinates and kinematics: #MCS, #KIN ID, #TRAFO, #TLC,
#PTP, #ORI MODE, #TOOL ORI CS.
"""

from __future__ import annotations

from collections.abc import Callable

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import Kind, fail

from .base import Items, Run
from .coordinate_base import NOT_IN_MCS, Commands, CoordinateBase

TRAFO_WORDS = ("OFF", "ON", "NONE", "DEFAULT")


class KinematicCommands(CoordinateBase):
    """Commands of everything between the tool's tip and the axes."""

    def _kinematic_commands(self) -> Commands:
        return (
            (("MCS", "ON"), self._mcs_on),
            (("MCS", "OFF"), self._mcs_off),
            (("KIN", "ID"), self._kin_id),
            (("TRAFO", "ON"), self._trafo_on),
            (("TRAFO", "OFF"), self._trafo_off),
            (("TRAFO",), self._trafo_steps),
            (("RTCP", "ON"), self._trafo_on),
            (("TLC", "ON"), self._tlc_on),
            (("TLC", "OFF"), self._tlc_off),
            (("RTCP", "OFF"), self._trafo_off),
            (("PTP", "ON"), self._ptp_on),
            (("PTP", "OFF"), self._ptp_off),
            (("ORI", "MODE"), self._ori_mode),
            (("TOOL", "ORI", "CS"), self._tool_ori_cs),
        )

    # machine coordinates

    def _mcs_on(self) -> Run:
        """Transformations and offsets off.

        EX TOOL: also the offsets of tools selected meanwhile.
        """
        ex_tool = False
        if self._stream.accept("["):
            for word in ("EX", "TOOL"):
                if not self._stream.accept_name(word):
                    raise fail(
                        900010,
                        f"#MCS ON: expected {word}",
                        self._stream.current.offset,
                    )
            self._stream.expect("]", 900010)
            ex_tool = True
        spaces = self._state.spaces
        return self._changing(
            "#MCS ON",
            lambda: spaces.set_machine_coordinates(True, ex_tool=ex_tool),
            in_ptp=21531,
            in_mcs=True,
        )

    def _mcs_off(self) -> Run:
        spaces = self._state.spaces
        return self._changing(
            "#MCS OFF",
            lambda: spaces.set_machine_coordinates(False),
            in_mcs=True,
        )

    # kinematics

    def _kin_id(self) -> Run:
        """``#KIN ID [n]``: the transformation that #TRAFO ON switches on.

        Without a number: the transformation of the start.
        """
        spaces, start = self._state.spaces, self._start
        fields = self._bracket() if self._stream.is_op("[") else []
        if not self._stream.at_end and not fields:
            raise fail(
                900010, "#KIN ID: a number is expected in brackets", start
            )
        if fields and (len(fields) != 1 or fields[0] is None):
            raise fail(900010, "#KIN ID: one number is expected", start)
        number = (
            self._whole(fields[0], "#KIN ID", 0, 999)
            if fields and fields[0] is not None
            else None
        )

        def run() -> Items:
            spaces.select_kinematic(None if number is None else number(), start)
            return []

        return run

    def _trafo_on(self) -> Run:
        return self._trafo(lambda: True)

    def _trafo_off(self) -> Run:
        spaces = self._state.spaces
        off = self._trafo(lambda: False)
        return lambda: off() if spaces.active_kin is not None else []

    def _trafo(self, on: Callable[[], bool]) -> Run:
        spaces, start = self._state.spaces, self._start

        def change() -> None:
            if not on():
                spaces.set_trafo(None, start)
                return
            if spaces.kin_id is None:
                raise fail(
                    292005,
                    "#TRAFO ON: the cell has no kinematics ([kinematics.N])",
                    start,
                )
            if spaces.tlc_mm is not None:
                raise fail(20669, ERRORS[20669], start)
            spaces.set_trafo(spaces.kin_id, start)

        def run() -> Items:
            if self._state.channel.compensation.choice.active:
                raise fail(906003, f"#TRAFO: {ERRORS[906003]}", start)
            return self._changing("#TRAFO", change, in_ptp=21552)()

        return run

    def _trafo_steps(self) -> Run:
        """``#TRAFO [id1, id2]``: numbers or OFF, ON, NONE, DEFAULT; one step
        may be on.
        """
        if not self._stream.is_op("["):
            words = " ".join(self._words(9))
            if words:
                raise fail(
                    900003, f"#TRAFO {words} is not supported", self._start
                )
            raise fail(
                900010, "#TRAFO: ON, OFF or [id] is expected", self._start
            )
        steps = self._steps()
        spaces, start = self._state.spaces, self._start
        if len(steps) > 2:
            raise fail(900010, "#TRAFO: at most two steps", start)
        if len(steps) == 2 and steps[1] == "ON":
            raise fail(
                900003, "#TRAFO with a second step is not supported", start
            )
        first, second = steps[0], steps[1] if len(steps) == 2 else "NONE"

        def chosen() -> bool:
            if isinstance(second, str):
                pass
            elif second():
                raise fail(
                    900003, "#TRAFO with a second step is not supported", start
                )
            if first == "NONE":
                return spaces.active_kin is not None
            if first == "DEFAULT":
                spaces.select_kinematic(None, start)
            elif not isinstance(first, str):
                spaces.select_kinematic(first(), start)
            return first != "OFF"

        return self._trafo(chosen)

    def _steps(self) -> list[str | Callable[[], int]]:
        stream, found = self._stream, list[str | Callable[[], int]]()
        opened = self._formulas.open()
        while True:
            word = stream.current.text.upper()
            if stream.current.kind is Kind.NAME and word in TRAFO_WORDS:
                stream.next()
                found.append(word)
            elif stream.is_op(",") or stream.is_op("]"):
                found.append("NONE")
            else:
                found.append(
                    self._whole(self._formulas.expression(), "#TRAFO", 0, 999)
                )
            if not stream.accept(","):
                break
        self._formulas.close(opened)
        return found

    def _tlc_on(self) -> Run:
        """``#TLC ON [dl]``: the tool is dl longer than the axes are programmed for."""
        fields = self._bracket_expected("#TLC ON")
        if len(fields) != 1 or fields[0] is None:
            raise fail(900010, "#TLC ON: one length is expected", self._start)
        value, spaces, start = fields[0], self._state.spaces, self._start

        def change() -> None:
            length = value()
            if isinstance(length, str) or not abs(length) <= 1e9:
                raise fail(900012, f"#TLC ON: {length} is no length", start)
            if spaces.active_kin is not None:
                raise fail(20669, ERRORS[20669], start)
            spaces.set_tlc(length * self._modal.unit_mm, start)

        return self._changing("#TLC ON", change)

    def _tlc_off(self) -> Run:
        spaces, start = self._state.spaces, self._start
        off = self._changing("#TLC OFF", lambda: spaces.set_tlc(None, start))
        return lambda: off() if spaces.tlc_mm is not None else []

    def _ptp_on(self) -> Run:
        """Blocks are straight lines of the axes; their ends are programmed as
        before.
        """
        return self._ptp(True)

    def _ptp_off(self) -> Run:
        spaces, off = self._state.spaces, self._ptp(False)
        return lambda: off() if spaces.ptp else []

    def _ptp(self, on: bool) -> Run:
        spaces, start = self._state.spaces, self._start

        def change() -> None:
            if on and spaces.active_kin is None:
                raise fail(21527, ERRORS[21527], start)
            spaces.set_ptp(on)

        def run() -> Items:
            self.not_compensated("#PTP", 21525)
            return self._changing("#PTP", change)()

        return run

    def _ori_mode(self) -> Run:
        """``#ORI MODE [ANGLE]``: orientation is programmed by the angles of the
        rotary axes, as always here.
        """
        stream = self._stream
        if not stream.accept("["):
            raise fail(900010, "#ORI MODE: [ANGLE] is expected", self._start)
        if not stream.accept_name("ANGLE"):
            raise fail(
                900003,
                f"#ORI MODE [{' '.join(self._words(9))}] is not supported",
                self._start,
            )
        stream.expect("]", 900010)
        return list

    def _tool_ori_cs(self) -> Run:
        """Turn the tool into the Z axis of the coordinate system.

        The rotary axes take their nearest position.
        """
        spaces, start = self._state.spaces, self._start

        def run() -> Items:
            self.not_compensated("#TOOL ORI CS", 906003)
            if spaces.mcs:
                raise fail(
                    NOT_IN_MCS, f"#TOOL ORI CS: {ERRORS[NOT_IN_MCS]}", start
                )
            return list(spaces.orient_tool(self._modal.n, start))

        return run
