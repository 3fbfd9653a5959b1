"""Programs of the soak, and what each has to come to: an oracle of its own.

Lengths and ends follow from the numbers that are written into the text, by
elementary geometry and without a function of the project.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field

DIALECTS = ("isg", "iso", "isons", "osai")
REACH_MM = 400.0
FUNCTION_EVERY = 20
FIRST_FUNCTION = 70
FUNCTIONS = 10
FEEDS = {  # as the dialect writes 600 to 12000 mm/min
    "isg": ("600", "3000", "12000"),
    "iso": ("600", "3000", "12000"),
    "isons": ("0.6", "3", "12"),
    "osai": ("600", "3000", "12000"),
}
DWELLS = {"isg": "G4 0.05", "iso": "G4 P0.05"}
Point = tuple[float, float, float]


@dataclass
class Part:
    """A program, and what it has to come to; mm."""

    dialect: str
    lines: list[str] = field(default_factory=list)
    at: Point = (0.0, 0.0, 0.0)
    starts: list[float] = field(default_factory=list)
    """Of each motion: distance from the program's start."""
    lengths: list[float] = field(default_factory=list)
    functions: list[int] = field(default_factory=list)
    way: float = 0.0

    @property
    def text(self) -> str:
        """Of the file."""
        return "\n".join(self.lines) + "\n"

    def drive(self, to: Point, length: float) -> None:
        """Add a motion."""
        self.starts.append(self.way)
        self.lengths.append(length)
        self.way += length
        self.at = to


def _words(to: Point) -> str:
    return " ".join(f"{n}{v:.3f}" for n, v in zip("XYZ", to, strict=True))


def _line(one: Part, rng: random.Random, feed: str) -> None:
    step = rng.choice((0.05, 1.0, 10.0, 60.0))
    moved = (v + rng.uniform(-step, step) for v in one.at)
    x, y, z = (round(max(-REACH_MM, min(REACH_MM, v)), 3) for v in moved)
    to = (x, y, z)
    if (length := math.dist(one.at, to)) < 0.01:
        return
    if one.dialect in ("isg", "iso") and rng.random() < 0.2:
        by = [round(b - a, 3) for a, b in zip(one.at, to, strict=True)]
        words = _words((by[0], by[1], by[2]))
        one.lines += ["G91", f"G1 {words} F{feed}", "G90"]
    else:
        one.lines.append(f"G1 {_words(to)} F{feed}")
    one.drive(to, length)


def _arc(one: Part, rng: random.Random, feed: str) -> None:
    """A half or a full circle, its centre beside the place in X or Y; as a helix
    now and then."""
    by = round(rng.choice((-1, 1)) * rng.uniform(0.5, 20.0), 3)
    along = rng.randrange(2)
    x, y, z = one.at
    rises = round(rng.uniform(-5.0, 5.0), 3) if rng.random() < 0.3 else 0.0
    full = rng.random() < 0.3
    if not full:
        x, y = (x + 2 * by, y) if along == 0 else (x, y + 2 * by)
    to = (round(x, 3), round(y, 3), round(z + rises, 3))
    if max(map(abs, to)) > REACH_MM:
        return
    centre = f"I{by:.3f} J0" if along == 0 else f"I0 J{by:.3f}"
    turned = math.pi * abs(by) * (2 if full else 1)
    one.lines.append(f"G{rng.choice((2, 3))} {_words(to)} {centre} F{feed}")
    one.drive(to, math.hypot(turned, rises))


def part(rng: random.Random, dialect: str, start: Point, motions: int) -> Part:
    """Lines of 0.05 to 60 mm, arcs and dwells where the dialect has them;
    M70 to M79 in turn.
    """
    one = Part(dialect, at=start)
    first = (0.0, 0.0, 0.0)
    one.lines.append(f"G0 {_words(first)}")
    if math.dist(start, first) > 0:
        one.drive(first, math.dist(start, first))
    feeds = FEEDS[dialect]
    for k in range(motions):
        round_ = dialect in ("isg", "iso") and rng.random() < 0.2
        (_arc if round_ else _line)(one, rng, rng.choice(feeds))
        if k % FUNCTION_EVERY == FUNCTION_EVERY // 2:
            number = FIRST_FUNCTION + len(one.functions) % FUNCTIONS
            one.functions.append(number)
            one.lines.append(f"M{number}")
        if dialect in DWELLS and rng.random() < 0.01:
            one.lines.append(DWELLS[dialect])
    one.lines.append("M30")
    return one
