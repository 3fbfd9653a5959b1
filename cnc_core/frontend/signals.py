"""Signals between the channels of a cell, as a front end sends and awaits them.

The programming manual of TF5200 states them: pages "Sending signals" and
"Waiting for signals".
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from ..errors import CncError, Place

Values = Mapping[int, float]


@dataclass(frozen=True)
class Signal:
    """What #SIGNAL sends.

    ``receivers``: numbers of channels from 1 on; empty: to all (broadcast).
    ``count``: how many waits use it up; 0: as the manual has it where no COUNT
    stands, one each for named receivers, any number for a broadcast.
    """

    number: int
    receivers: tuple[int, ...] = ()
    values: Values = field(default_factory=dict)
    count: int = 0


@dataclass(frozen=True)
class Wanted:
    """What #WAIT waits for.

    ``senders``: numbers of channels, one signal of each is used up; empty: a
    broadcast of any channel.  ``take`` gets the values that came along; it may
    raise CncError.
    """

    number: int
    senders: tuple[int, ...] = ()
    take: Callable[[Values], None] = lambda _: None
    place: Place = field(default_factory=Place)


@dataclass(frozen=True)
class Removal:
    """What #SIGNAL REMOVE takes back: signals of these numbers to these
    receivers; without receivers broadcasts.

    ``highest``: the end of a range, all of which goes; None: one signal of
    ``lowest`` goes, the oldest, for each receiver.
    """

    lowest: int
    highest: int | None = None
    receivers: tuple[int, ...] = ()


class ChannelSignals(Protocol):
    """The signals as one channel sees them."""

    def check(self, number: int, place: Place) -> None:
        """CncError: the cell has no channel of this number."""
        ...

    def send(self, signal: Signal) -> None:
        """Send at once."""
        ...

    def later(self, what: Signal | Removal) -> float:
        """The value of a command on the path: it is sent, or removed, when the
        path has passed the command.
        """
        ...

    def remove(self, removal: Removal) -> None:
        """Remove at once."""
        ...

    def read(self, wanted: Wanted) -> bool:
        """Use it up if it is there, without a wait; whether it was."""
        ...

    def wait(self, wanted: Wanted) -> None:
        """Wait for this from now on, until ``came``."""
        ...

    def came(self) -> bool:
        """Whether what was waited for has come; then it is used up.

        CncError: the channels wait for each other.
        """
        ...


class OpenSignals:
    """A channel that is read alone, without motion: what it waits for counts as
    sent, with zeros for values.

    ``names``: of the cell's channels.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names = names

    def check(self, number: int, place: Place) -> None:
        check_channel(number, self._names, place)

    def send(self, signal: Signal) -> None:
        """Nobody receives it."""

    def later(self, what: Signal | Removal) -> float:
        return 0.0

    def remove(self, removal: Removal) -> None:
        """Nothing has been sent."""

    def read(self, wanted: Wanted) -> bool:
        wanted.take(_Zeros())
        return True

    def wait(self, wanted: Wanted) -> None:
        wanted.take(_Zeros())

    def came(self) -> bool:
        return True


class _Zeros(defaultdict[int, float]):
    """A value for every index."""

    def __init__(self) -> None:
        super().__init__(float)

    def __contains__(self, _: object) -> bool:
        return True


def check_channel(number: int, names: Sequence[str], place: Place) -> None:
    """CncError: the cell has no channel of this number, counted from 1."""
    if not 1 <= number <= len(names):
        raise CncError(
            250008,
            f"CH={number}: the cell has channels 1 to {len(names)}"
            f" ({', '.join(names)})",
            place,
        )
