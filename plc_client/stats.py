"""Measured times: a bounded, uniform sample of any number of values, and the
totals of one PLC process.
"""

from __future__ import annotations

import contextlib
import math
import random
from bisect import bisect_right
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

RESERVOIR = 20_000
EDGES_US = [10.0 ** (k / 4) for k in range(-4, 21)]
"""Of histograms of times: four a factor of ten."""

SHOWN = 1000  # of them in a histogram
_LARGEST = 1.0 - 1e-12


class Totals:
    """Count, sum, smallest and largest of any number of values in ns."""

    __slots__ = ("max", "min", "n", "total")

    def __init__(self) -> None:
        self.n = self.max = self.min = self.total = 0

    def add(self, value: int) -> None:
        """Take one value."""
        if value > self.max:  # noqa: PLR1730 (quicker than max())
            self.max = value
        if value < self.min or not self.n:
            self.min = value
        self.total += value
        self.n += 1

    def add_many(self, n: int, total: int, low: int, high: int) -> None:
        """Take n > 0 values of which these are known."""
        self.max = max(self.max, high)
        self.min = min(self.min, low) if self.n else low
        self.total += total
        self.n += n

    def summary_us(self) -> dict[str, Any]:
        """Min, mean, max in us."""
        mean = self.total / self.n if self.n else 0.0
        return {
            "min_us": self.min / 1e3,
            "mean_us": mean / 1e3,
            "max_us": self.max / 1e3,
        }


class Reservoir:
    """Uniform random sample (algorithm L of K.-H.

    Li, ACM TOMS 20, 1994; seeded) of at most `size` values >= 0.

    The maximum and the count are exact.  Once the sample is full, nearly every
    value costs two comparisons: how many are passed over until the next one is
    kept is drawn beforehand.
    """

    def __init__(self, size: int = RESERVOIR) -> None:
        self.n = 0
        self.max = 0
        self._size = size
        self._kept: list[int] = []
        self._random = random.Random(1)
        self._weight = 1.0
        self._next = 0  # count at which the next value is kept

    def add(self, value: int) -> None:
        """Take one value."""
        self.n += 1
        if value > self.max:  # noqa: PLR1730 (quicker than max())
            self.max = value
        if self.n >= self._next:
            self._keep(value)

    def _keep(self, value: int) -> None:
        if len(self._kept) < self._size:
            self._kept.append(value)
            if len(self._kept) < self._size:
                return
        else:
            self._kept[self._random.randrange(self._size)] = value
        self._weight = min(
            self._weight * self._uniform() ** (1.0 / self._size), _LARGEST
        )
        self._next = (
            self.n
            + int(math.log(self._uniform()) / math.log1p(-self._weight))
            + 1
        )

    def _uniform(self) -> float:
        """Above 0, up to 1."""
        return 1.0 - self._random.random()

    def quantiles(self) -> dict[str, int]:
        """p50, p99, p999 of the sample (nearest rank), exact max and n; zeros
        without values.
        """
        return self._quantiles(sorted(self._kept))

    def _quantiles(self, ordered: list[int]) -> dict[str, int]:
        def rank(q: float) -> int:
            return (
                ordered[max(math.ceil(q * len(ordered)), 1) - 1]
                if ordered
                else 0
            )

        return {
            "p50": rank(0.5),
            "p99": rank(0.99),
            "p999": rank(0.999),
            "max": self.max,
            "n": self.n,
        }

    def histogram_us(self) -> dict[str, Any]:
        """How often which time came, of values in ns: counts of a part of the
        sample between ``edges`` (us, four a factor of ten), quantiles in us.

        A part, because it is asked for between two scans.
        """
        step = -(-len(self._kept) // SHOWN) or 1
        part = sorted(self._kept[::step])
        ends = [bisect_right(part, 1e3 * edge) for edge in EDGES_US]
        quantiles = self._quantiles(part)
        n = quantiles.pop("n")
        return {
            "edges": EDGES_US,
            "counts": [b - a for a, b in pairwise([0, *ends, len(part)])],
            "n": n,
            **{name: value / 1e3 for name, value in quantiles.items()},
        }


HANDSHAKES = Reservoir()
"""ns from placing a request until the PLC took its answer.

All contour look-ahead blocks of this process count.
"""


class _Unmeasured(Reservoir):
    """Takes nothing."""

    def add(self, value: int) -> None:
        """Nothing."""


@contextlib.contextmanager
def unmeasured() -> Iterator[None]:
    """Handshakes do not count meanwhile: nobody answers them (a replay)."""
    global HANDSHAKES  # noqa: PLW0603 - the arbiters look it up in every scan
    before, HANDSHAKES = HANDSHAKES, _Unmeasured()
    try:
        yield
    finally:
        HANDSHAKES = before
