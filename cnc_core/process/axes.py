"""The axes of a cell: which channel has which, who waits for one.

Taken and given back where the channels' preparation is served, in the order of
the channels; so a run in virtual time is the same every time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ..config import ChannelSetup
from ..config.exchange import axes_of, places_of
from ..engine.placed import PlacedAxis
from ..frontend.axes import (
    AxisData,
    AxisRequest,
    OpenAxes,
    Placed,
    arranged,
)
from .identity import LINEAR, ROTARY
from .signals import AxisWait, SignalBoard

Put = Callable[[Mapping[int, PlacedAxis]], None]


class AxisBoard:
    """All axes; channels by index.

    ``signals``: knows who waits for what; None: there is one channel.
    """

    def __init__(
        self, setups: Sequence[ChannelSetup], signals: SignalBoard | None
    ) -> None:
        self._setups, self._signals = setups, signals
        self._axes = axes_of(setups)
        self.home = [places_of(setup) for setup in setups]
        self.places = [list(one) for one in self.home]
        self._holder: dict[int, int | None] = {
            number: axis.home for number, axis in self._axes.items()
        }
        self._requests: dict[int, AxisRequest] = {}
        self._running: set[int] = set()
        # of each channel: put axes at places, where its axes stand
        self._put: dict[int, Put] = {}
        self._stand: dict[int, Callable[[], Sequence[float]]] = {}

    def join(
        self, index: int, put: Put, stand: Callable[[], Sequence[float]]
    ) -> None:
        """A channel's engine: puts axes at places, tells where they stand."""
        self._put[index], self._stand[index] = put, stand

    def placed(self, index: int) -> dict[int, PlacedAxis]:
        """What stands at every place of a channel."""
        return {
            place: self._placed(index, place, one)
            for place, one in enumerate(self.places[index])
        }

    def axis(self, number: int) -> AxisData | None:
        return self._axes.get(number)

    def jerk_limited(self, index: int) -> bool:
        cell = self._setups[index].cell
        return bool(cell.axis_values("j_max_mm_s3").any())

    def alone(self, index: int) -> OpenAxes:
        """The axes for a reader without motion."""
        return OpenAxes(self._axes, self.home[index])

    # ---------------------------------------------------------------- programs
    def begins(self, index: int) -> None:
        """A program begins in this channel: with the axes of the cell file,
        which it asks for where it has not got them.
        """
        self._running.add(index)
        self.ask(index, AxisRequest(call=self._missing(index)))

    def ends(self, index: int) -> None:
        """It has ended: every axis goes home that has one free there."""
        self._running.discard(index)
        self._requests.pop(index, None)
        foreign = [
            one.number
            for one, own in zip(
                self.places[index], self.home[index], strict=True
            )
            if one is not None and one != own
        ]
        self._arrange(index, AxisRequest(put=foreign))
        self._send_home()

    def _send_home(self) -> None:
        """Free axes of channels that execute no program."""
        for channel in range(len(self._setups)):
            if channel not in self._running:
                free = {
                    place: one
                    for place, one in self._missing(channel).items()
                    if self._holder[one.number] is None
                }
                self._arrange(channel, AxisRequest(call=free))

    def _missing(self, index: int) -> dict[int, Placed]:
        return {
            place: own
            for place, own in enumerate(self.home[index])
            if own is not None and self.places[index][place] != own
        }

    # ---------------------------------------------------------------- exchange
    def ask(self, index: int, request: AxisRequest) -> None:
        """What is put is free at once."""
        self._arrange(index, AxisRequest(put=request.put))
        self._send_home()
        self._requests.pop(index, None)  # who asks last comes last
        self._requests[index] = request

    def came(self, index: int) -> bool:
        request = self._requests[index]
        if self._holders(index, request) or self._behind_others(index):
            if self._signals is None:
                return False
            wait = AxisWait(
                request.place,
                lambda: self._holders(index, request),
                lambda: self._said(index, request),
            )
            return self._signals.missing(index, wait)
        if self._signals is not None:
            self._signals.over(index)
        del self._requests[index]
        self._arrange(index, AxisRequest(call=request.call))
        request.taken()
        return True

    def _holders(self, index: int, request: AxisRequest) -> list[int]:
        """Channels that execute a program and hold what is asked for."""
        found = (self._holder[one.number] for one in request.call.values())
        return [one for one in found if one != index and one in self._running]

    def _behind_others(self, index: int) -> bool:
        """Somebody who has asked earlier for one of these axes may have all
        that he has asked for.
        """
        wanted = {one.number for one in self._requests[index].call.values()}
        for other, request in self._requests.items():
            if other == index:
                return False
            shared = wanted & {one.number for one in request.call.values()}
            if shared and not self._holders(other, request):
                return True
        return False

    def _said(self, index: int, request: AxisRequest) -> str:
        """What is missing, for people."""
        texts = []
        for one in request.call.values():
            holder = self._holder[one.number]
            if holder != index and holder in self._running:
                name = self._setups[holder].place.name
                texts.append(
                    f"axis {one.number} ({one.name}), which channel {name} has"
                )
        return " and ".join(texts)

    def _arrange(self, index: int, request: AxisRequest) -> None:
        """Carry it out: all that is called is free."""
        if not request.put and not request.call:
            return
        for one in request.call.values():
            holder = self._holder[one.number]
            if holder is not None and holder != index:
                self._arrange(holder, AxisRequest(put=[one.number]))
        before = self.places[index]
        self._read_positions(index)
        self.places[index] = after = arranged(before, request)
        for number in request.put:
            if self._holder[number] == index:
                self._holder[number] = None
        for one in request.call.values():
            self._holder[one.number] = index
        self._put[index](
            {
                place: self._placed(index, place, after[place])
                for place in range(len(after))
                if before[place] != after[place]
            }
        )

    def _read_positions(self, index: int) -> None:
        stand = self._stand[index]()
        for place, one in enumerate(self.places[index]):
            if one is not None:
                self._axes[one.number].position = float(stand[place])

    def _placed(self, index: int, place: int, one: Placed | None) -> PlacedAxis:
        """As the engine takes it; an empty place moves nothing."""
        setup = self._setups[index]
        if one is None:
            like = list(setup.cell.axes.values())[place]
            limits = (like.v_max_mm_s, like.a_max_mm_s2, like.j_max_mm_s3)
            return PlacedAxis(limits, 0.0)
        axis = self._axes[one.number]
        return PlacedAxis(
            axis.limits,
            axis.position,
            self._setups[axis.home].place.axis_base + axis.place,
            one.number,
            ROTARY if axis.rotary else LINEAR,
            one.name,
        )


class AxesOf:
    """The board as one channel sees it (``ChannelAxes``)."""

    def __init__(self, board: AxisBoard, index: int) -> None:
        self._board, self._index = board, index

    @property
    def places(self) -> Sequence[Placed | None]:
        return self._board.places[self._index]

    @property
    def home(self) -> Sequence[Placed | None]:
        return self._board.home[self._index]

    @property
    def jerk_limited(self) -> bool:
        return self._board.jerk_limited(self._index)

    def axis(self, number: int) -> AxisData | None:
        return self._board.axis(number)

    def ask(self, request: AxisRequest) -> None:
        self._board.ask(self._index, request)

    def came(self) -> bool:
        return self._board.came(self._index)

    def alone(self) -> OpenAxes:
        return self._board.alone(self._index)

    def begins(self) -> None:
        self._board.begins(self._index)

    def ends(self) -> None:
        self._board.ends(self._index)
