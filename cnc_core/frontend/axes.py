"""Axes that go from channel to channel, as a front end asks for them.

The programming manual of TF5200 states it: pages "Axis exchange commands",
"Requesting axes", "Releasing axes", "Definition of an axis configuration".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from ..errors import Place


class Placed(NamedTuple):
    """The axis at a place of a channel: as the channel calls it, its logical
    number.
    """

    name: str
    number: int


@dataclass
class AxisData:
    """One axis of the cell.

    ``limits``: velocity mm/s, acceleration mm/s2, jerk mm/s3 (0: no limit).
    ``low``, ``high``, ``position``: mm or degrees.  ``home``: index of the
    channel that begins with it, ``place`` its place and ``name`` its name there.
    """

    number: int
    name: str
    rotary: bool
    limits: tuple[float, float, float]
    low: float
    high: float
    position: float
    home: int
    place: int


@dataclass(frozen=True)
class AxisRequest:
    """What an exchange changes in a channel.

    ``put``: numbers of axes that it gives away, at once.  ``call``: the axes
    that it asks for, by place, all together; they may be in it already.
    ``taken`` is called when they are there.  ``place``: where it is written.
    """

    put: Sequence[int] = ()
    call: Mapping[int, Placed] = field(default_factory=dict)
    taken: Callable[[], None] = lambda: None
    place: Place = field(default_factory=Place)

    def numbers(self, places: Sequence[Placed | None]) -> list[int | None]:
        """Of the axes at the channel's places, when it has been carried out."""
        gone = {*self.put, *(one.number for one in self.call.values())}
        out: list[int | None] = [
            None if one is None or one.number in gone else one.number
            for one in places
        ]
        for place, one in self.call.items():
            out[place] = one.number
        return out


class ChannelAxes(Protocol):
    """The axes as one channel sees them."""

    @property
    def places(self) -> Sequence[Placed | None]:
        """What stands at each place of the channel; None: nothing."""
        ...

    @property
    def home(self) -> Sequence[Placed | None]:
        """What stands there when a program begins."""
        ...

    @property
    def jerk_limited(self) -> bool:
        """The channel is planned with limits of the jerk."""
        ...

    def axis(self, number: int) -> AxisData | None:
        """The axis of a logical number; None: the cell has none."""
        ...

    def ask(self, request: AxisRequest) -> None:
        """Ask for this from now on, until ``came``."""
        ...

    def came(self) -> bool:
        """Whether the exchange has been carried out.

        CncError: the channels wait for each other.
        """
        ...

    def alone(self) -> ChannelAxes:
        """The same axes for a reader without motion, as they begin."""
        ...


class OpenAxes:
    """A channel that is read alone, without motion: every axis of the cell is
    free, and stands where it starts.

    ``axes``: of the cell by number.  ``home``: of the channel by place.
    """

    def __init__(
        self, axes: Mapping[int, AxisData], home: Sequence[Placed | None]
    ) -> None:
        self._axes, self.home = axes, tuple(home)
        self.places = list(home)
        self._request: AxisRequest | None = None
        self.jerk_limited = True

    def axis(self, number: int) -> AxisData | None:
        return self._axes.get(number)

    def ask(self, request: AxisRequest) -> None:
        self._request = request

    def came(self) -> bool:
        request, self._request = self._request, None
        if request is not None:
            self.places = arranged(self.places, request)
            request.taken()
        return True

    def alone(self) -> OpenAxes:
        return OpenAxes(self._axes, self.home)


def arranged(
    places: Sequence[Placed | None], request: AxisRequest
) -> list[Placed | None]:
    """The places behind an exchange."""
    gone = {*request.put, *(one.number for one in request.call.values())}
    found = [
        None if one is not None and one.number in gone else one
        for one in places
    ]
    for place, one in request.call.items():
        found[place] = one
    return found
