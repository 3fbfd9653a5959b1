"""Supervision of the two processes until both have ended."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from hli import segment
from hli.errors import HliError

from .child import Job

POLL_S = 0.005
OUT_OF_TIME = 905025  # --max-time, --max-wall


GRACE_S = 3.5  # after one side ended: how long the other may take to notice


# without a PLC: how long the program may stand at a stop that nobody will leave
STALL_S = 0.5


# the CNC keeps the wall time itself; behind it the launcher ends a CNC that
# does not answer
BACKSTOP_S = 5.0


def supervise(
    job: Job,
    max_wall: float = 0.0,
    look: Callable[[str], None] = lambda _: None,
) -> None:
    """Until both have ended; when one has, the other gets a short time to follow.

    ``max_wall``: s; 0: no limit.  ``look``: called with the segment's name.
    """
    alone_since = 0.0
    end = time.monotonic() + max_wall + BACKSTOP_S if max_wall else math.inf
    if job.plc is None:
        supervise_alone(job, end, look)
        job.out_of_time = time.monotonic() >= end
        return
    while not (job.cnc.ended and job.plc.ended) and time.monotonic() < end:
        time.sleep(POLL_S)
        look(job.name)
        if job.cnc.ended or job.plc.ended:
            alone_since = alone_since or time.monotonic()
            # a PLC that ended well (status 0) leaves the CNC to finish;
            # anything else ends the run
            if time.monotonic() - alone_since > GRACE_S or _is_over(job):
                return
    job.out_of_time = time.monotonic() >= end


def _is_over(job: Job) -> bool:
    """Nothing comes of waiting for the other side."""
    return _time_is_up(job) or _plc_never_came(job)


def _plc_never_came(job: Job) -> bool:
    """The PLC has failed before it attached: the CNC waits for it in vain."""
    assert job.plc is not None
    if not job.plc.process.poll():
        return False
    try:
        with segment.attach(job.name) as view:
            return not view.root.sidecar.plc.pid
    except HliError:  # the CNC is just starting, or has ended
        return False


def _time_is_up(job: Job) -> bool:
    """Whether the CNC has ended the run for its time."""
    if not job.cnc.ended:
        return False
    errors = job.cnc.report().get("errors", ())
    return any(error["code"] == OUT_OF_TIME for error in errors)


def supervise_alone(job: Job, end: float, look: Callable[[str], None]) -> None:
    """Without a PLC: until the CNC has ended, or stands where only a PLC could help.

    ``end``: monotonic time at which that is over.
    """
    view: segment.Segment | None = None
    since = 0.0
    while not job.cnc.ended and time.monotonic() < end:
        time.sleep(POLL_S)
        look(job.name)
        try:
            view = view or segment.attach(job.name)
        except HliError:
            continue
        since = (
            (since or time.monotonic())
            if view.root.channel[0].bahn_state.wait_continue_r
            else 0.0
        )
        if since and time.monotonic() - since > STALL_S:
            job.stalled = True
            break
    if view is not None:
        view.close()


def stop(job: Job) -> None:
    """End both processes: ask, then insist."""
    for child in job.children:
        if not child.ended:
            child.process.terminate()
    for child in job.children:
        child.end(1.0)
