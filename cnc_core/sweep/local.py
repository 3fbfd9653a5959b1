"""Workers on this machine: processes of the standard library."""

from __future__ import annotations

import collections
import contextlib
import os
import selectors
import subprocess
import sys
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from pathlib import Path

from ..errors import CncError, Place
from .ledger import leave

DEATHS_MAX = 3  # of workers at one run, which then counts as failed


class Hand:
    """One worker, and the run that it is at."""

    def __init__(self, study: Path, folder: Path) -> None:
        words = [str(study), str(folder), str(os.getpid())]
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", f"{__package__}.worker", *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        )
        assert self._process.stdin
        assert self._process.stdout
        self._in, self.out = self._process.stdin, self._process.stdout
        self.number = -1

    def give(self, number: int) -> None:
        self.number = number
        with contextlib.suppress(BrokenPipeError):  # dead: its answer says so
            self._in.write(b"%d\n" % number)
            self._in.flush()

    def answer(self) -> list[str]:
        """Words of the next answer; none: the worker is dead."""
        return self.out.readline().decode(errors="replace").split(" ", 2)

    def end(self) -> int:
        """Exit status, below 0 the signal."""
        with contextlib.suppress(BrokenPipeError):
            self._in.close()
        try:
            return self._ended()
        finally:
            self.out.close()

    def _ended(self) -> int:
        for seconds, insist in (
            (0.5, self._process.terminate),
            (10.0, self._process.kill),
        ):
            try:
                return self._process.wait(seconds)
            except subprocess.TimeoutExpired:
                insist()
        return self._process.wait()


class Hands:
    """All workers of a sweep."""

    def __init__(self, study: Path, folder: Path) -> None:
        self._study, self._folder = study, folder
        self._ready = selectors.DefaultSelector()
        self._deaths: Counter[int] = collections.Counter()
        self._left: deque[int] = deque()

    def __enter__(self) -> Hands:
        return self

    def __exit__(self, *_: object) -> None:
        for key in list(self._ready.get_map().values()):
            self._dismiss(key.data)
        self._ready.close()

    def made(self, numbers: Sequence[int], workers: int) -> Iterator[int]:
        """The numbers as their rows are left in the folder."""
        self._left.extend(numbers)
        for _ in range(min(workers, len(numbers))):
            self._hire()
        while self._ready.get_map():
            for key, _ in self._ready.select():
                number = self._heard(key.data)
                if number is not None:
                    yield number

    def _hire(self) -> None:
        hand = Hand(self._study, self._folder)
        self._ready.register(hand.out, selectors.EVENT_READ, hand)
        hand.give(self._left.popleft())

    def _dismiss(self, hand: Hand) -> int:
        self._ready.unregister(hand.out)
        return hand.end()

    def _heard(self, hand: Hand) -> int | None:
        """The number whose row is left; a dead worker is replaced."""
        kind, *words = hand.answer()
        if kind == "failed":
            place = Place(str(self._folder))
            raise CncError(901004, f"run {' '.join(words).strip()}", place)
        made = hand.number if kind == "done" else self._died(hand)
        if kind == "done" and self._left:
            hand.give(self._left.popleft())
        elif kind == "done":
            self._dismiss(hand)
        elif self._left:
            self._hire()
        return made

    def _died(self, hand: Hand) -> int | None:
        """Its run is made again; None, or its number if it kills every worker."""
        status, number = self._dismiss(hand), hand.number
        self._deaths[number] += 1
        if self._deaths[number] < DEATHS_MAX:
            self._left.appendleft(number)
            return None
        how = f"of signal {-status}" if status < 0 else f"with status {status}"
        text = f"the worker died {how}, {DEATHS_MAX} times"
        leave(self._folder, number, {"end": "died", "error": text})
        return number
