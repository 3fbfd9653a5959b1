"""#CALL AX, #PUT AX, #SET AX, #AX REQUEST, #AX RELEASE, #AX DEF: axes that come
into the channel and leave it.

Syntax and meaning follow the programming manual of TF5200, pages "Requesting
axes", "Releasing axes" and "Definition of an axis configuration".
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

from cnc_core.blocks import EVENT, EVENT_STORAGE_CLEAR
from cnc_core.errors import ERRORS
from cnc_core.frontend.axes import AxisRequest, ChannelAxes, Placed
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.port import Wait

from ..state.axis_places import refuse_kind
from .base import CommandBase, Items, Run

NUMBER_MAX = 65535
SWITCHES = ("NAM", "NBR", "IDX")
NAME = re.compile("[ABCQUVWXYZ][A-Z0-9]*", re.IGNORECASE)
NAME_LENGTH = 15

Whole = Callable[[], int]


class _Asked(NamedTuple):
    """``[name, number, index]`` of a command."""

    name: str
    number: Whole
    place: Whole
    offset: int


class ExchangeCommands(CommandBase):
    """Axis exchange."""

    # ---------------------------------------------------------------- commands
    def _call_ax(self) -> Run:
        """``#CALL AX [FAST] [name,number,index]..``"""
        self._switches()
        asked = self._sequences()
        return self._exchange(lambda axes: self._called(axes, asked))

    def _set_ax(self) -> Run:
        """``#SET AX ..``: what is not named leaves the channel."""
        default = self._stream.accept_name("DEFAULT") is not None
        self._switches()
        asked = self._sequences() if self._stream.is_op("[") else []
        if not default and not asked:
            raise fail(900010, "axes are expected: [name,number,index]", 0)
        if default and asked:
            raise fail(900003, "#AX DEF DEFAULT with axes", self._start)

        def request(axes: ChannelAxes) -> AxisRequest:
            if default:
                wanted = {i: one for i, one in enumerate(axes.home) if one}
            else:
                wanted = self._wanted(axes, asked)
            stays = {one.number for one in wanted.values()}
            put = [
                one.number
                for one in axes.places
                if one is not None and one.number not in stays
            ]
            return AxisRequest(put, wanted)

        return self._exchange(request)

    def _put_ax(self) -> Run:
        """``#PUT AX [name, ..]``, ``#PUT AX ALL``."""
        if self._stream.accept_name("ALL"):
            return self._exchange(
                lambda axes: AxisRequest(
                    [one.number for one in axes.places if one]
                )
            )
        if self._stream.accept_name("NBR"):
            return self._put_numbers()
        opened, names = self._formulas.open(), []
        while not self._stream.is_op("]"):
            names.append(self._title(opened))
            self._stream.accept(",")
        self._formulas.close(opened)
        return self._exchange(
            lambda axes: AxisRequest(
                [one.number for one in axes.places if one and one.name in names]
            )
        )

    def _put_numbers(self) -> Run:
        numbers: list[Whole] = []
        opened = self._formulas.open()
        while not self._stream.is_op("]"):
            if self._stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            numbers.append(self._axis_number("logical axis number"))
            self._stream.accept(",")
        self._formulas.close(opened)

        def request(axes: ChannelAxes) -> AxisRequest:
            wanted = {number() for number in numbers}
            here = [one.number for one in axes.places if one]
            return AxisRequest([one for one in here if one in wanted])

        return self._exchange(request)

    # ---------------------------------------------------------------- the block
    def _switches(self) -> None:
        """FAST changes nothing: the axes stand anyway, and their positions are
        always known.
        """
        self._stream.accept_name("FAST")
        if self._stream.accept_name(*SWITCHES):
            raise fail(
                900003, "logic switches NAM, NBR, IDX are not supported", 0
            )

    def _sequences(self) -> list[_Asked]:
        found = []
        while self._stream.is_op("["):
            found.append(self._sequence())
        if not found:
            raise fail(
                900010, "axes are expected: [name,number,index]", self._start
            )
        return found

    def _sequence(self) -> _Asked:
        stream = self._stream
        opened = self._formulas.open()
        name = self._title(opened)
        if not stream.accept(","):
            raise fail(21251, ERRORS[21251], stream.current.offset)
        number = self._axis_number("logical axis number")
        if not stream.accept(","):
            raise fail(21252, ERRORS[21252], stream.current.offset)
        index = self._axis_number("axis index")
        if stream.is_op(","):
            raise fail(
                900003,
                "offsets in an axis exchange are not supported",
                stream.current.offset,
            )
        self._formulas.close(opened)
        return _Asked(name, number, index, opened)

    def _title(self, opened: int) -> str:
        """A name: of letters and digits, with the first letter of an axis."""
        stream, offset = self._stream, self._stream.current.offset
        if stream.at_end:
            raise fail(900013, "bracket is not closed", opened)
        found = NAME.match(stream.text, offset)
        name = found[0].upper() if found else ""
        if not name or len(name) > NAME_LENGTH:
            raise fail(
                900010,
                f"expected the name of an axis, found {name or stream.describe()}",
                offset,
            )
        stream.skip_to(offset + len(name))
        return name

    def _axis_number(self, what: str) -> Whole:
        value = self._formulas.expression()
        code = 21253 if what.startswith("logical") else 21254
        most = (
            NUMBER_MAX if code == 21253 else len(self._state.offsets.names) - 1
        )
        least, start = int(code == 21253), self._start

        def whole() -> int:
            found = value()
            if (
                isinstance(found, str)
                or found != round(found)
                or not least <= found <= most
            ):
                raise fail(
                    code, f"{what} {found}: {least} to {most} is allowed", start
                )
            return int(found)

        return whole

    def _called(self, axes: ChannelAxes, asked: list[_Asked]) -> AxisRequest:
        """Axes that are in the channel as they are asked for stay."""
        wanted = {
            place: one
            for place, one in self._wanted(axes, asked).items()
            if axes.places[place] != one
        }
        for place, one in wanted.items():
            here = axes.places[place]
            if here is not None:
                raise fail(
                    21260,
                    f"index {place} has axis {here.number} ({here.name}) already",
                    self._start,
                )
            for other in axes.places:
                if other is not None and other.number == one.number:
                    raise fail(
                        900003,
                        f"axis {one.number} is in the channel already, as"
                        f" {other.name}: #SET AX changes name or index",
                        self._start,
                    )
                if other is not None and other.name == one.name:
                    raise fail(
                        21261,
                        f"axis {other.number} is called {one.name} already",
                        self._start,
                    )
        return AxisRequest(call=wanted)

    def _wanted(
        self, axes: ChannelAxes, asked: list[_Asked]
    ) -> dict[int, Placed]:
        """By place; every name, number and place once."""
        found: dict[int, Placed] = {}
        for one in asked:
            placed, place = Placed(one.name, one.number()), one.place()
            code = (
                21257
                if place in found
                else 21256
                if placed.name in [other.name for other in found.values()]
                else 21258
                if placed.number in [other.number for other in found.values()]
                else 0
            )
            if code:
                raise fail(code, ERRORS[code], one.offset)
            if axes.axis(placed.number) is None:
                raise fail(
                    20312, f"{ERRORS[20312]}: {placed.number}", one.offset
                )
            wrong = refuse_kind(self._state.machine, axes, place, placed)
            if wrong is not None:
                raise fail(wrong.code, wrong.text, one.offset)
            found[place] = placed
        return found

    # ---------------------------------------------------------------- the exchange
    def _exchange(self, request: Callable[[ChannelAxes], AxisRequest]) -> Run:
        """Behind everything ahead of it: the axes stand."""
        if not self._stream.at_end:
            raise fail(
                900010,
                "an axis exchange stands alone in its block",
                self._stream.current.offset,
            )
        self._drain = True
        state, start = self._state, self._start

        def run() -> Items:
            axes = state.port.axes
            if axes is None:
                raise fail(900003, "axis exchange is not supported here", start)
            wanted = request(axes)
            self._possible(axes, wanted)
            place = state.place(start)
            axes.ask(
                AxisRequest(
                    wanted.put,
                    wanted.call,
                    lambda: state.axis_places.take(
                        axes, state.channel.soft_limits
                    ),
                    place,
                )
            )
            state.channel.dynamics.move_axes(
                AxisRequest().numbers(axes.places), wanted.numbers(axes.places)
            )
            if not state.port.answers:
                axes.came()
            return [
                Wait.AXES,
                self._modal.row(EVENT, self._modal.n, code=EVENT_STORAGE_CLEAR),
                *state.channel.dynamics.rows(self._modal.n),
            ]

        return run

    def _possible(self, axes: ChannelAxes, wanted: AxisRequest) -> None:
        state, start = self._state, self._start
        self._not_compensated("axis exchange")
        if state.spaces.transformed:
            raise fail(20684, ERRORS[20684], start)
        first = state.offsets.first_main
        here = axes.places[first] if first >= 0 else None
        facing = here is not None and here.number in wanted.put
        if state.offsets.diameter and facing:
            raise fail(20546, ERRORS[20546], start)
