"""Ctrl-C while a process of ours starts.

A terminal sends it to every process of its group.  A Python that still reads its
packages would answer with a traceback.  So it is held until the process can take it.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def interrupts_held() -> Iterator[Callable[[], object]]:
    """Ctrl-C waits, here and in a process that is started meanwhile.

    It comes at the end, or where the function is called that this gives.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})

    def let_come() -> object:
        return signal.pthread_sigmask(signal.SIG_SETMASK, before)

    try:
        yield let_come
    finally:
        let_come()


def take_interrupts() -> None:
    """This process was started with Ctrl-C held: it can take it now."""
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
