"""Random ISG programs whose contour is computed beside the writing of their text:
no parser, no row of the product has a part in it.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.float64]
Facts = dict[str, float]
# first, second and third axis
PLANES = {"G17": (0, 1, 2), "G18": (2, 0, 1), "G19": (1, 2, 0)}
MIRRORS = {"G20": (1, 1), "G21": (-1, 1), "G22": (1, -1), "G23": (-1, -1)}
INCH, TENTH_UM, DIGITS = 25.4, 1e4, 12


def rotation(angles: tuple[float, float, float]) -> Vector:
    """#CS: about Z, then the new Y, then the newest X; degrees X, Y, Z."""
    out = np.eye(3)
    for axis in (2, 1, 0):
        angle = math.radians(angles[axis])
        c, s = math.cos(angle), math.sin(angle)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
        out = out @ turn
    return out


def turned(before: Vector | None, behind: Vector) -> float:
    """Angle between two directions; 0 if there is none before."""
    if before is None:
        return 0.0
    a = before / np.linalg.norm(before)
    b = behind / np.linalg.norm(behind)
    return 2 * math.atan2(
        float(np.linalg.norm(a - b)), float(np.linalg.norm(a + b))
    )


@dataclass
class WrittenContour:
    """A program (``text``) and what the look-ahead has to say of it (``due``)."""

    seed: int
    blocks: int = 30
    lines: list[str] = field(default_factory=list)
    due: list[Facts] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.rng = random.Random(self.seed)
        self.at = np.zeros(3)  # as programmed, mm
        self.frame = np.eye(3)
        self.mirror = np.ones(3)
        self.unit, self.plane, self.number = 1.0, "G17", 0
        self.incremental = self.absolute_centre = False
        self.distance = 0.0
        self.direction: Vector | None = None
        self.lines.append("G17 G90 G71 G162 F3000")
        for _ in range(self.blocks):
            kind = self.rng.random()
            if kind < 0.4:
                self._line()
            elif kind < 0.75:
                self._arc()
            else:
                self._switch()
        self.lines.append("M30")

    @property
    def text(self) -> str:
        return "\n".join([*self.lines, ""])

    def _rounded(self, value: float) -> float:
        """As it stands in the text."""
        return round(value / self.unit, DIGITS) * self.unit

    def _word(self, letter: str, value: float) -> str:
        return f"{letter}{value / self.unit:.{DIGITS}f}"

    def _target(self, to: Vector) -> Vector:
        """Where the words of the text lead."""
        origin = self.at if self.incremental else np.zeros(3)
        return origin + [self._rounded(v) for v in to - origin]

    def _axis(self, axis: int, to: Vector) -> str:
        value = to[axis] - (self.at[axis] if self.incremental else 0.0)
        return self._word("XYZ"[axis], value)

    def _machine(self, at: Vector) -> Vector:
        return np.asarray(self.frame @ (self.mirror * at))

    def _element(
        self,
        length: float,
        into: Vector,
        out: Vector,
        circle: tuple[float, float] | None = None,
    ) -> None:
        radius, angle = circle or (0.0, 0.0)
        self.due.append(
            {
                "block_type": 2.0 if circle else 1.0,
                "block_number": self.number,
                "block_count_r": len(self.lines),
                "start_position": self.distance,
                "length": length * TENTH_UM,
                "length_min": length * TENTH_UM,
                "programmed_radius": radius * TENTH_UM,
                "compensated_radius": radius * TENTH_UM,
                "circle_angle": angle,
                "tangent_variation": turned(self.direction, into),
            }
        )
        self.distance += length * TENTH_UM
        self.direction = out

    def _block(self, words: list[str]) -> None:
        self.number += self.rng.choice([1, 7, 10])
        self.lines.append(" ".join([f"N{self.number}", *words]))

    def _line(self) -> None:
        ways = [self.rng.uniform(-10, 10) for _ in range(3)]
        to = self._target(self.at + ways)
        axes = self.rng.sample(range(3), self.rng.randint(1, 3))
        for axis in set(range(3)) - set(axes):
            to[axis] = self.at[axis]
        code = "G00" if self.rng.random() < 0.15 else "G01"
        self._block([code, *(self._axis(axis, to) for axis in axes)])
        way = self._machine(to) - self._machine(self.at)
        self._element(float(np.linalg.norm(way)), way, way)
        self.at = to

    def _arc(self) -> None:
        a, b, c = PLANES[self.plane]
        radius = self.rng.choice([0.5, 3.0, 12.0])
        begin = self.rng.uniform(-math.pi, math.pi)
        full = self.rng.random() < 0.15
        sweep = 2 * math.pi if full else self.rng.uniform(0.1, 6.1)
        sweep *= self.rng.choice([1, -1])
        start = self.at[[a, b]]
        arm = radius * np.array([math.cos(begin), math.sin(begin)])
        words = start - arm if self.absolute_centre else -arm
        words = np.array([self._rounded(v) for v in words])
        centre = words if self.absolute_centre else start + words
        to = self.at.copy()
        end = begin + sweep
        if not full:
            to[a] = centre[0] + radius * math.cos(end)
            to[b] = centre[1] + radius * math.sin(end)
        rises = self.rng.random() < 0.3
        to[c] += self.rng.uniform(-4, 4) * rises
        to = self._target(to)
        by_radius = not full and self.rng.random() < 0.25
        by_radius = by_radius and abs(abs(sweep) - math.pi) > 0.2
        code = ["G03" if sweep > 0 else "G02"]
        if not full:
            code += [self._axis(a, to), self._axis(b, to)]
        if rises:
            code.append(self._axis(c, to))
        if by_radius:
            code.append(
                self._word("R", math.copysign(radius, math.pi - abs(sweep)))
            )
        else:
            code += [
                self._word("IJK"[i], v)
                for i, v in zip((a, b), words, strict=True)
            ]
        self._block(code)
        self._circle((a, b, c), centre, radius, sweep, to)

    def _circle(
        self,
        axes: tuple[int, int, int],
        centre: Vector,
        radius: float,
        sweep: float,
        to: Vector,
    ) -> None:
        a, b, c = axes

        def tangent(at: Vector) -> Vector:
            arm, out = at[[a, b]] - centre, np.zeros(3)
            out[a], out[b] = -arm[1] * sweep, arm[0] * sweep
            out[c] = to[c] - self.at[c]
            return self._machine(out)

        side = self.mirror[a] * self.mirror[b]
        length = math.hypot(radius * sweep, to[c] - self.at[c])
        circle = (radius, float(sweep * side))
        self._element(length, tangent(self.at), tangent(to), circle)
        self.at = to

    def _switch(self) -> None:
        kind = self.rng.choice(
            ["plane", "measure", "unit", "centre", "mirror", "frame"]
        )
        if kind == "plane":
            self.plane = self.rng.choice(list(PLANES))
            self.lines.append(self.plane)
        elif kind == "measure":
            self.incremental = not self.incremental
            self.lines.append("G91" if self.incremental else "G90")
        elif kind == "unit":
            metric = self.unit != 1.0
            self.unit = 1.0 if metric else INCH
            self.lines.append("G71 F3000" if metric else "G70 F100")
        elif kind == "centre":
            self.absolute_centre = not self.absolute_centre
            self.lines.append("G161" if self.absolute_centre else "G162")
        else:
            self._other_frame(kind)

    def _other_frame(self, kind: str) -> None:
        """Another frame; then a line of all axes in it."""
        here = self._machine(self.at)
        if kind == "mirror":
            code, (x, y) = self.rng.choice(list(MIRRORS.items()))
            self.mirror = np.array([x, y, 1.0])
        elif np.array_equal(self.frame, np.eye(3)):
            a, b, c = (round(self.rng.uniform(-80, 80), 3) for _ in range(3))
            code, self.frame = (
                f"#CS ON [0,0,0,{a},{b},{c}]",
                rotation((a, b, c)),
            )
        else:
            code, self.frame = "#CS OFF", np.eye(3)
        self.incremental = False
        self.lines += [code, "G90"]
        to = self._target(
            np.array([self.rng.uniform(-20, 20) for _ in range(3)])
        )
        self._block(["G01", *(self._axis(axis, to) for axis in range(3))])
        way = self._machine(to) - here
        self._element(float(np.linalg.norm(way)), way, way)
        self.at = to
