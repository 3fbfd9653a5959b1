"""Measured times: a bounded, uniform sample of any number of values, and the totals of one PLC process."""

from __future__ import annotations

import math
import random
from typing import Any

RESERVOIR = 20_000


class Reservoir:
    """Uniform random sample (algorithm R, seeded) of at most `size` values; the maximum and the count are exact."""

    def __init__(self, size: int = RESERVOIR) -> None:
        self.n = 0
        self.max = 0
        self.min = 0
        self.total = 0
        self._size = size
        self._kept: list[int] = []
        self._random = random.Random(1)

    def add(self, value: int) -> None:
        """Take one value."""
        if value > self.max or not self.n:
            self.max = value
        if value < self.min or not self.n:
            self.min = value
        self.total += value
        self.n += 1
        if len(self._kept) < self._size:
            self._kept.append(value)
        elif (slot := self._random.randrange(self.n)) < self._size:
            self._kept[slot] = value

    def quantiles(self) -> dict[str, int]:
        """p50, p99, p999 of the sample (nearest rank), exact max and n; zeros without values."""
        ordered = sorted(self._kept)

        def rank(q: float) -> int:
            return ordered[max(math.ceil(q * len(ordered)), 1) - 1] if ordered else 0

        return {"p50": rank(0.5), "p99": rank(0.99), "p999": rank(0.999), "max": self.max, "n": self.n}

    def summary_us(self) -> dict[str, Any]:
        """Exact min, mean, max in us of values in ns."""
        mean = self.total / self.n if self.n else 0.0
        return {"min_us": self.min / 1e3, "mean_us": mean / 1e3, "max_us": self.max / 1e3}


HANDSHAKES = Reservoir()
"""ns from placing a request until the PLC took its answer, over all contour look-ahead blocks of this process."""
