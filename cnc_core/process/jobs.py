"""Jobs: programs that programs of other channels have ordered.

Each channel has a queue.  A job begins where the channels are served, in the
order of the channels; so a run in virtual time is the same every time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from ..errors import CncError, Place
from ..frontend.jobs import ENDS, JobState, Order, unknown
from ..frontend.signals import check_channel
from .signals import SignalBoard

QUEUE_MAX = 20  # jobs that wait for one channel
STATES = {
    "completed": JobState.MC_DONE,
    "aborted": JobState.MC_ABORTED,
    "error": JobState.MC_ERROR,
}


class Agent(Protocol):
    """A channel as the board moves it."""

    def find_program(self, name: str) -> Path: ...

    def free_for_job(self) -> bool: ...

    def start_job(self, path: Path) -> None: ...

    def reset_by_job(self) -> None: ...


@dataclass(eq=False)
class _Job:
    order: Order
    path: Path | None
    state: JobState = JobState.MC_BUSY


@dataclass
class _Channel:
    """``active``: the job that is executed.  ``ordered``: what the present
    program has ordered, ``seen`` the states that ended its waits.
    """

    agent: Agent
    queue: deque[_Job] = field(default_factory=deque)
    active: _Job | None = None
    ordered: dict[int, _Job] = field(default_factory=dict)
    seen: dict[int, JobState] = field(default_factory=dict)


@dataclass(frozen=True)
class JobWait:
    """A channel waits for a job in another one."""

    place: Place
    said: Callable[[], str]
    in_vain: Callable[[], bool]
    hopes: Callable[[set[int]], bool]


class JobBoard:
    """Channels by index."""

    def __init__(self, signals: SignalBoard) -> None:
        self._signals, self._names = signals, signals.names
        self._channels: dict[int, _Channel] = {}
        signals.queued = self.queued

    def join(self, index: int, agent: Agent) -> None:
        self._channels[index] = _Channel(agent)

    def queued(self, index: int) -> bool:
        """Whether a job will begin in this channel."""
        channel = self._channels.get(index)
        return channel is not None and bool(channel.queue)

    @property
    def open(self) -> bool:
        """Whether a job waits that can begin."""
        return any(
            one.queue and one.agent.free_for_job()
            for one in self._channels.values()
        )

    def serve(self) -> None:
        """Jobs begin in channels that are free."""
        for index in sorted(self._channels):
            channel = self._channels[index]
            while channel.queue and channel.queue[0].path is None:
                self._reset(channel)
            if channel.queue and channel.agent.free_for_job():
                job = channel.active = channel.queue.popleft()
                job.state = JobState.MC_ACTIVE
                assert job.path is not None
                channel.agent.start_job(job.path)

    @staticmethod
    def _reset(channel: _Channel) -> None:
        channel.queue.popleft().state = JobState.MC_DONE
        channel.agent.reset_by_job()

    def begins(self, index: int) -> None:
        """A program begins: what the one before has ordered is forgotten."""
        self._channels[index].ordered.clear()
        self._channels[index].seen.clear()

    def ended(self, index: int, end: str) -> None:
        """A program has ended."""
        job, self._channels[index].active = self._channels[index].active, None
        if job is not None:
            job.state = STATES[end]

    # ---------------------------------------------------------------- a client
    def values(self, index: int) -> Mapping[int, float]:
        job = self._channels[index].active
        return job.order.values if job is not None else {}

    def order(self, index: int, order: Order) -> None:
        client = self._channels[index]
        if client.active is not None:
            raise CncError(280611, place=order.place)
        check_channel(order.channel, self._names, order.place)
        if order.channel - 1 == index:
            text = f"CH={order.channel} is the channel of this program itself"
            raise CncError(250008, text, order.place)
        if order.number in client.ordered:
            text = f"job {order.number}: its number has been used already"
            raise CncError(907057, text, order.place)
        agent = self._channels[order.channel - 1]
        if len(agent.queue) >= QUEUE_MAX:
            text = f"{QUEUE_MAX} jobs wait for channel {order.channel} already"
            raise CncError(907057, text, order.place)
        path = (
            agent.agent.find_program(order.program) if order.program else None
        )
        job = client.ordered[order.number] = _Job(order, path)
        if path is None:
            agent.queue.appendleft(job)  # it aborts what is executed
        else:
            agent.queue.append(job)

    def reached(
        self,
        index: int,
        number: int,
        states: Collection[JobState],
        place: Place,
    ) -> bool:
        client = self._channels[index]
        job = client.ordered.get(number)
        if job is None:
            raise unknown(number, place)
        if job.state in states:
            client.seen[number] = job.state
            self._signals.over(index)
            return True
        if job.state in ENDS:
            text = f"job {number} has ended as {job.state.name}"
            raise CncError(907057, f"#WAIT MC_Status: {text}", place)
        agent = job.order.channel - 1
        wait = JobWait(
            place,
            lambda: f"job {number} in channel {self._names[agent]}",
            lambda: job.state not in states,
            lambda stuck: self._hopes(agent, job, stuck),
        )
        return self._signals.missing(index, wait)

    def _hopes(self, agent: int, job: _Job, stuck: set[int]) -> bool:
        if self._signals.runs(agent):
            return agent not in stuck
        return (
            job.state is JobState.MC_ACTIVE
            or self._channels[agent].agent.free_for_job()
            or self._signals.plc_there
        )

    def seen(self, index: int, number: int) -> JobState:
        found = self._channels[index].seen.get(number)
        if found is None:
            raise CncError(
                907057, f"job {number}: no #WAIT MC_Status ahead of this"
            )
        return found


class JobsOf:
    """The board as one channel sees it (``ChannelJobs``)."""

    def __init__(self, board: JobBoard, index: int) -> None:
        self._board, self._index = board, index

    @property
    def values(self) -> Mapping[int, float]:
        return self._board.values(self._index)

    def order(self, order: Order) -> None:
        self._board.order(self._index, order)

    def reached(
        self, number: int, states: Collection[JobState], place: Place
    ) -> bool:
        return self._board.reached(self._index, number, states, place)

    def seen(self, number: int) -> JobState:
        return self._board.seen(self._index, number)

    def begins(self) -> None:
        self._board.begins(self._index)

    def ended(self, end: str) -> None:
        self._board.ended(self._index, end)

    def serve(self) -> None:
        self._board.serve()
