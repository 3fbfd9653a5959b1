"""The signals of a cell: who has sent what, who waits for what.

Sent and used up where the channels' preparation is served, in the order of the
channels; so a run in virtual time is the same every time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from ..errors import CncError, Place
from ..frontend.signals import Removal, Signal, Values, Wanted, check_channel

EVENTS_MAX = 150  # P-STUP-00119 without a value
FIRST_TOKEN = 2.0**40  # of a command on the path; programs' own are below


@dataclass(frozen=True)
class AxisWait:
    """A channel waits for axes.

    ``holders``: channels that have them; ``said``: which, for people.
    """

    place: Place
    holders: Callable[[], list[int]]
    said: Callable[[], str]

    def in_vain(self) -> bool:
        return bool(self.holders())

    def hopes(self, stuck: set[int]) -> bool:
        return not stuck & set(self.holders())


class OtherWait(Protocol):
    """A wait for something else than a signal.

    ``hopes``: whether it may come true, although these channels wait in vain.
    """

    @property
    def place(self) -> Place: ...

    @property
    def said(self) -> Callable[[], str]: ...

    def in_vain(self) -> bool: ...

    def hopes(self, stuck: set[int]) -> bool: ...


@dataclass(eq=False)
class _Sent:
    """A signal on its way; ``receiver`` None: a broadcast; ``left`` None: it
    stays until it is removed.
    """

    number: int
    sender: int
    receiver: int | None
    values: Values
    left: int | None


class SignalBoard:
    """The signals of all channels; channels by index.

    ``plc``: whether somebody is there who could start a program.
    ``all_begun``: the programs of the cell's start have begun; before that a
    wait is no deadlock.
    """

    def __init__(
        self, names: list[str], plc: Callable[[], bool] = lambda: False
    ) -> None:
        self.names, self._plc = names, plc
        self.all_begun = False
        self._sent: list[_Sent] = []
        self._waits: dict[int, Wanted | OtherWait] = {}
        # whether a job will begin in a channel
        self.queued: Callable[[int], bool] = lambda _: False
        self._later: dict[float, tuple[int, Signal | Removal]] = {}
        self._next_token = FIRST_TOKEN
        self._running: set[int] = set()
        self._doomed: dict[int, CncError] = {}

    # ---------------------------------------------------------------- programs
    def begins(self, index: int) -> None:
        """A program begins in this channel."""
        self._running.add(index)
        self._forget(index)

    def ends(self, index: int) -> None:
        """It has ended: nobody waits there, and nothing comes from its path.
        What it has sent stays.
        """
        self._running.discard(index)
        self._forget(index)

    def _forget(self, index: int) -> None:
        self._waits.pop(index, None)
        self._doomed.pop(index, None)
        self._later = {
            token: later
            for token, later in self._later.items()
            if later[0] != index
        }

    # ---------------------------------------------------------------- signals
    def send(self, index: int, signal: Signal) -> None:
        """CncError: more signals wait than the cell keeps."""
        broadcast = signal.count or None
        for number in signal.receivers or (None,):
            receiver = None if number is None else number - 1
            left = broadcast if number is None else signal.count or 1
            self._sent.append(
                _Sent(signal.number, index, receiver, signal.values, left)
            )
        if len(self._sent) > EVENTS_MAX:
            raise CncError(
                250001,
                f"signal {signal.number}: more than {EVENTS_MAX} signals wait"
                " for somebody who takes them",
            )

    def later(self, index: int, what: Signal | Removal) -> float:
        token, self._next_token = self._next_token, self._next_token + 1.0
        self._later[token] = index, what
        return token

    def passed(self, token: float) -> bool:
        """The path has passed a command; False: it is no signal."""
        index, what = self._later.pop(token, (-1, None))
        if what is None:
            return False
        if isinstance(what, Removal):
            self.remove(what)
        else:
            self.send(index, what)
        return True

    def remove(self, removal: Removal) -> None:
        low, high = removal.lowest, removal.highest
        numbers = range(low, (low if high is None else high) + 1)
        for number in removal.receivers or (None,):
            receiver = None if number is None else number - 1
            found = [
                one
                for one in self._sent
                if one.number in numbers and one.receiver == receiver
            ]
            gone = found[:1] if high is None else found
            self._sent = [one for one in self._sent if one not in gone]

    def reset(self, index: int) -> None:
        """The channel is reset: signals to it go, broadcasts stay."""
        self._sent = [one for one in self._sent if one.receiver != index]

    # ---------------------------------------------------------------- waits
    def wait(self, index: int, wanted: Wanted) -> None:
        self._waits[index] = wanted

    def came(self, index: int) -> bool:
        wanted = self._waits[index]
        assert isinstance(wanted, Wanted)
        found = self._matching(index, wanted)
        if found is None:
            return self._goes_on(index)
        self.over(index)
        self._use_up(found, wanted)
        return True

    def read(self, index: int, wanted: Wanted) -> bool:
        found = self._matching(index, wanted)
        if found is not None:
            self._use_up(found, wanted)
        return found is not None

    def _use_up(self, found: list[_Sent], wanted: Wanted) -> None:
        for one in found:
            if one.left is not None:
                one.left -= 1
        self._sent = [one for one in self._sent if one.left != 0]
        wanted.take({k: v for one in found for k, v in one.values.items()})

    def _goes_on(self, index: int) -> bool:
        """What it waits for is not there: False; CncError: nor can it come."""
        if self.all_begun:
            self._look_for_deadlock()
        doom = self._doomed.pop(index, None)
        if doom is None:
            return False
        del self._waits[index]
        raise doom

    def over(self, index: int) -> None:
        """It waits no more."""
        self._waits.pop(index, None)
        self._doomed.pop(index, None)

    def missing(self, index: int, wait: OtherWait) -> bool:
        """A channel waits: False; CncError: the channels wait for each other."""
        self._waits[index] = wait
        return self._goes_on(index)

    def _matching(self, index: int, wanted: Wanted) -> list[_Sent] | None:
        """The signals that end a wait, first come first served; None: not all
        of them are there.
        """
        found = []
        for sender in wanted.senders or (None,):
            receiver = None if sender is None else index
            one = next(
                (
                    one
                    for one in self._sent
                    if one.number == wanted.number
                    and one.receiver == receiver
                    and sender in (None, one.sender + 1)
                ),
                None,
            )
            if one is None:
                return None
            found.append(one)
        return found

    def awaited(self, index: int) -> str:
        """What a channel waits for, for people; empty: no signal."""
        wanted = self._waits.get(index)
        if wanted is None:
            return ""
        if not isinstance(wanted, Wanted):
            return wanted.said()
        names = [self.names[one - 1] for one in wanted.senders]
        whose = " and ".join(f"channel {name}" for name in names)
        return f"signal {wanted.number} of {whose or 'any channel'}"

    # ---------------------------------------------------------------- deadlock
    def _look_for_deadlock(self) -> None:
        """Channels that wait, and all who could end it wait as well."""
        paths = {index for index, _ in self._later.values()}
        stuck = {
            index
            for index, wanted in self._waits.items()
            if index not in paths and self._in_vain(index, wanted)
        }
        while free := {one for one in stuck if self._hopes(one, stuck)}:
            stuck -= free
        if not stuck:
            return
        said = "; ".join(self._said(index) for index in sorted(stuck))
        for index in stuck:
            place = self._waits[index].place
            self._doomed.setdefault(
                index, CncError(907056, f"nobody can go on: {said}", place)
            )

    def _in_vain(self, index: int, wanted: Wanted | OtherWait) -> bool:
        if not isinstance(wanted, Wanted):
            return wanted.in_vain()
        return self._matching(index, wanted) is None

    def _hopes(self, index: int, stuck: set[int]) -> bool:
        """Whether somebody who does not wait in vain may send what is missing."""
        wanted = self._waits[index]
        if not isinstance(wanted, Wanted):
            return wanted.hopes(stuck)
        missing = [
            sender - 1
            for sender in wanted.senders
            if self._matching(index, Wanted(wanted.number, (sender,))) is None
        ]
        if wanted.senders:
            return all(self._may_send(one, stuck) for one in missing)
        others = (one for one in range(len(self.names)) if one != index)
        return any(self._may_send(one, stuck) for one in others)

    def _may_send(self, index: int, stuck: set[int]) -> bool:
        if index in self._running:
            return index not in stuck
        # a PLC or another program could start one there
        return self._plc() or self.queued(index) or bool(self._running - stuck)

    def runs(self, index: int) -> bool:
        """Whether a channel executes a program."""
        return index in self._running

    @property
    def plc_there(self) -> bool:
        return self._plc()

    def _said(self, index: int) -> str:
        place = self._waits[index].place
        where = f" ({Path(place.file).name}:{place.line})" if place.line else ""
        return f"channel {self.names[index]} waits for {self.awaited(index)}{where}"


class SignalsOf:
    """The board as one channel sees it (``ChannelSignals``)."""

    def __init__(self, board: SignalBoard, index: int) -> None:
        self._board, self._index = board, index

    def check(self, number: int, place: Place) -> None:
        check_channel(number, self._board.names, place)

    def send(self, signal: Signal) -> None:
        self._board.send(self._index, signal)

    def later(self, what: Signal | Removal) -> float:
        return self._board.later(self._index, what)

    def remove(self, removal: Removal) -> None:
        self._board.remove(removal)

    def reset(self) -> None:
        self._board.reset(self._index)

    def read(self, wanted: Wanted) -> bool:
        return self._board.read(self._index, wanted)

    def wait(self, wanted: Wanted) -> None:
        self._board.wait(self._index, wanted)

    def came(self) -> bool:
        return self._board.came(self._index)

    def passed(self, token: float) -> bool:
        """The path has passed a command; False: it is no signal."""
        return self._board.passed(token)

    def begins(self) -> None:
        self._board.begins(self._index)

    def ends(self) -> None:
        self._board.ends(self._index)

    @property
    def awaited(self) -> str:
        return self._board.awaited(self._index)
