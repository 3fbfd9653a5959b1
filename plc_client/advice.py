"""What passes in silence and should not: warnings with the mend.

They cost a scan nothing: a class is looked at before it runs, times are looked
at when it has run.
"""

from __future__ import annotations

import functools

from hli import layout

from .online import stored_names
from .program import Program

LONG_INTERVAL_S = 1.0
MEASURED_SCANS = 3


@functools.cache
def status_members() -> frozenset[str]:
    """Members of the HLI that the CNC alone writes: ``_r``."""
    names = {
        name
        for structure in layout.structures()
        for name, *_ in structure._fields_
    }
    return frozenset(name for name in names if name.endswith("_r"))


def is_status(path: str) -> bool:
    """A symbol that the CNC writes in each cycle."""
    member = path.rpartition(".")[2].partition("[")[0]
    return member in status_members()


def of_class(program: Program) -> list[str]:
    """Warnings of a task's interval and text."""
    found = []
    interval = program.spec.interval
    if interval >= LONG_INTERVAL_S:
        found.append(
            f"task {program.name}: interval {interval:g} s; intervals are in s:"
            f" for ms write interval={interval / 1000.0:g}"
        )
    instance = program.instance
    written = stored_names(type(instance)) & status_members()
    own = set(vars(instance)) if hasattr(instance, "__dict__") else set()
    found += [
        f"task {program.name}: assigns {name}, which the CNC writes in each"
        " cycle; write command_w or another _w member"
        for name in sorted(written - own)
    ]
    return found


def of_times(program: Program) -> list[str]:
    """A warning where ``cyclic()`` takes longer than its interval."""
    times, interval = program.times, program.spec.interval
    if times.n < MEASURED_SCANS or times.total <= times.n * interval * 1e9:
        return []
    return [
        f"task {program.name}: cyclic() takes {times.total / times.n / 1e6:.3g}"
        f" ms, its interval is {interval * 1e3:g} ms; a scan must not wait:"
        " no sleep or input, TON for times"
    ]
