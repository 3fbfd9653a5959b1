"""Programs that a program starts in other channels, as a front end orders them.

The Job Manager of TF5200 states it: pages "Commanding agents", "#WAIT MC_Status
command", "#MCV_GroupResetForced command".
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Protocol

from ..errors import CncError, Place


class JobState(IntEnum):
    """As a program compares it; the numbers are reconstructed."""

    MC_NEW = 1
    MC_BUSY = 2
    MC_ACTIVE = 3
    MC_DONE = 4
    MC_ABORTED = 5
    MC_ERROR = 6


ENDS = frozenset((JobState.MC_DONE, JobState.MC_ABORTED, JobState.MC_ERROR))


@dataclass(frozen=True)
class Order:
    """``number``: of the job, once in the program that orders it.  ``channel``:
    where it is executed, from 1 on.  ``program``: name of a file; empty: the
    channel is reset.  ``values``: what the program reads as @PL1, @PL2 ..
    """

    number: int
    channel: int
    program: str = ""
    values: Mapping[int, float] = field(default_factory=dict)
    place: Place = field(default_factory=Place)


class ChannelJobs(Protocol):
    """Jobs as one channel sees them."""

    @property
    def values(self) -> Mapping[int, float]:
        """What came with the job that is executed here; empty: it is none."""
        ...

    def order(self, order: Order) -> None:
        """Put it into the queue of its channel.

        CncError: this program is a job itself; no such channel or file; the
        number has been used.
        """
        ...

    def reached(
        self, number: int, states: Collection[JobState], place: Place
    ) -> bool:
        """Whether a job has come to one of these states.

        CncError: there is no such job, or it can come to none of them.
        """
        ...

    def seen(self, number: int) -> JobState:
        """The state that ended the last wait for it.

        CncError: nobody has waited for it.
        """
        ...


class OpenJobs:
    """A channel that is read alone, without motion: jobs are done at once."""

    values: Mapping[int, float] = {}

    def __init__(self) -> None:
        self._known: set[int] = set()

    def order(self, order: Order) -> None:
        self._known.add(order.number)

    def reached(
        self, number: int, states: Collection[JobState], place: Place
    ) -> bool:
        if number not in self._known:
            raise unknown(number, place)
        return True

    def seen(self, number: int) -> JobState:
        return JobState.MC_DONE


def unknown(number: int, place: Place) -> CncError:
    return CncError(
        907057, f"job {number}: this program has not ordered it", place
    )
