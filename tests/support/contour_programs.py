"""Seeded programs with marked contours, for the tests of the look-ahead.

A program is a list of sections: lines, arcs, helices, splines, polynomials, in
any plane, with markers, distance resets and real-time loops.  Every section may
be smoothed by the words of its dialect; the plain twin has a comment in their
place, so that lines keep their numbers.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field

ON = "#CONTOUR LOOKAHEAD LOG ON"
OFF = "#CONTOUR LOOKAHEAD LOG OFF"
PLANES = {"G17": (0, 1), "G18": (2, 0), "G19": (1, 2)}
OFFSETS = "IJK"
SMOOTH = {
    "isg": [
        ("#HSC ON [BSPLINE PATH_DEV 0.05]", "#HSC OFF"),
        ("#FILTER ON [AX_DEV 0.03]", "#FILTER OFF"),
    ],
    "iso": [("G64 P0.04", "G61")],
    "isons": [],
    "osai": [],
}
MARKED = ("isg", "isons")  # dialects with marks of the look-ahead
HEAD = {
    "isg": "G17 G90 G01 F3000",
    "iso": "G21 G90 G17 G61 F3000",
    "isons": "G60 G63 F50",
    "osai": "(HSM,CONFIG1)\nG90 G01 F3000",
}


@dataclass
class Contours:
    """One random program of a dialect; ``text`` smoothed, ``plain`` not."""

    seed: int
    dialect: str = "isg"
    #: how many sections
    sections: int = 4
    loops: bool = True
    resets: bool = True
    lines: list[str] = field(default_factory=list)
    loop_enabled: bool = False

    def __post_init__(self) -> None:
        self.rng = random.Random(f"{self.dialect}{self.seed}")
        self.at = [0.0, 0.0, 0.0]
        self.plane = "G17"
        self.n = 0
        self._switches: dict[int, str] = {}
        self._make()

    @property
    def text(self) -> str:
        return "\n".join([*self.lines, ""])

    @property
    def plain(self) -> str:
        """The same lines without words that smooth."""
        lines = list(self.lines)
        for at in self._switches:
            lines[at] = "(plain)" if self.dialect == "iso" else "; plain"
        return "\n".join([*lines, ""])

    # ---------------------------------------------------------------- pieces
    def _block(self, words: str) -> None:
        self.n += 10
        self.lines.append(f"N{self.n} {words}")

    def _number(self, value: float) -> str:
        return f"{value:.9f}"

    def _near(self, step: float) -> list[float]:
        return [v + self.rng.uniform(-step, step) for v in self.at]

    def _go(self, code: str, to: list[float], more: str = "") -> None:
        words = " ".join(
            f"{axis}{self._number(v)}"
            for axis, v in zip("XYZ", to, strict=True)
        )
        self._block(f"{code} {words}{more}")
        self.at = [float(self._number(v)) for v in to]

    def _line(self) -> None:
        step = self.rng.choice([0.02, 0.5, 5.0, 20.0])
        code = "G00" if self.rng.random() < 0.1 else "G01"
        self._go(code, self._near(step))

    def _arc(self) -> None:
        if self.dialect == "osai":  # which has none
            return
        first, second = PLANES[self.plane]
        radius = self.rng.choice([0.3, 2.0, 10.0])
        begin = self.rng.uniform(-math.pi, math.pi)
        sweep = self.rng.uniform(0.2, 6.2) * self.rng.choice([-1, 1])
        centre = [
            self.at[first] - radius * math.cos(begin),
            self.at[second] - radius * math.sin(begin),
        ]
        to = list(self.at)
        to[first] = centre[0] + radius * math.cos(begin + sweep)
        to[second] = centre[1] + radius * math.sin(begin + sweep)
        third = 3 - first - second
        if self.rng.random() < 0.4:
            to[third] += self.rng.uniform(-5, 5)
        if self.dialect != "isons":  # which names the centre itself
            centre = [centre[0] - self.at[first], centre[1] - self.at[second]]
        offsets = (
            f" {OFFSETS[first]}{self._number(centre[0])}"
            f" {OFFSETS[second]}{self._number(centre[1])}"
        )
        self._go("G03" if sweep > 0 else "G02", to, offsets)

    def _wave(self) -> None:
        """Many short lines, what smoothing is made for."""
        x, y, z = self.at
        height = self.rng.uniform(0.2, 2.0)
        for i in range(1, self.rng.randint(6, 16)):
            self._go(
                "G01",
                [x + 0.4 * i, y + height * math.sin(0.7 * i), z + 0.1 * i],
            )

    def _spline(self) -> None:
        if self.dialect != "isg":
            return
        kind = self.rng.choice(["AKIMA", "BSPLINE"])
        self.lines += [f"#SPLINE TYPE {kind}", "#SPLINE ON"]
        for _ in range(self.rng.randint(4, 7)):
            to = self._near(6.0)
            self._go("G01", to)
        self.lines.append("#SPLINE OFF")

    def _profile(self) -> None:
        """A profile: points that a curve goes through, straight stretches and
        edges between them.
        """
        if self.dialect != "osai":
            return
        self.lines.append(self.rng.choice(["G61", "G61 P3", "G61 P5"]))
        turn = self.rng.choice([0.1, 0.4, 1.0])
        at, course = list(self.at), self.rng.uniform(-3, 3)
        for k in range(self.rng.randint(6, 30)):
            if k:
                step = self.rng.choice([0.3, 2.0, 8.0])
                at[0] += step * math.cos(course)
                at[1] += step * math.sin(course)
                at[2] += self.rng.uniform(-0.1, 0.1) * step
                course += self.rng.uniform(-turn, turn)
                course += 1.5 * (self.rng.random() < 0.1)
            words = zip("XYZ", at, strict=True)
            self._block(" ".join(f"{a}{self._number(v)}" for a, v in words))
        self.lines.append("G60")
        self.at = [float(self._number(v)) for v in at]

    def _motions(self, count: int) -> None:
        for _ in range(count):
            self.rng.choice([self._line, self._line, self._arc, self._wave])()

    # -------------------------------------------------------------- sections
    def _smoothed(self) -> None:
        words = SMOOTH[self.dialect]
        chosen = self.rng.choice(words) if words else None
        if chosen:
            self._switches[len(self.lines)] = chosen[0]
            self.lines.append(chosen[0])
        self._motions(self.rng.randint(1, 4))
        if chosen:
            self._switches[len(self.lines)] = chosen[1]
            self.lines.append(chosen[1])

    def _loop(self) -> None:
        if self.dialect != "isg" or not self.loops:
            return
        modulo = self.rng.choice(["", " [MODULO]"])
        begin = list(self.at)
        self.lines.append(f"#RT WHILE{modulo}")
        for _ in range(self.rng.randint(2, 5)):
            self._line()
        self._go("G01", begin)
        self.lines.append("#RT ENDWHILE")

    def _switch_plane(self) -> None:
        if self.dialect in ("isons", "osai"):
            return
        self.plane = self.rng.choice(list(PLANES))
        self.lines.append(self.plane)

    def _reset(self) -> None:
        if self.resets and self.dialect in MARKED:
            self.lines.append("#DISTANCE PROG START CLEAR")

    def _compensated(self) -> None:
        if self.dialect != "isg":
            return
        side = self.rng.choice(["G41", "G42"])
        self.lines += ["G17", "D1"]
        self.plane = "G17"
        x, y, z = self.at
        self._go(f"{side} G01", [x + 10, y, z])
        for dx, dy in ((30, 0), (0, 20), (12, 9), (-15, 30)):
            self._go("G01", [self.at[0] + dx, self.at[1] + dy, z])
        self._go("G03", [self.at[0] - 20, self.at[1] + 20, z], " I-20 J0")
        self._go("G40 G01", [self.at[0] - 30, self.at[1], z])

    def _param(self) -> None:
        if self.dialect in MARKED:
            self.lines.append(
                f"#CONTOUR LOOKAHEAD LOG [PARAM={self.rng.uniform(0, 9):.3f}]"
            )

    def _make(self) -> None:
        marked = self.dialect in MARKED
        self.lines += HEAD[self.dialect].splitlines()
        if self.dialect == "iso":
            self.lines.append("G1")
        self._motions(1)
        if marked:
            self.lines.append(f"{ON} [PARAM=1]")
        kinds = [
            self._smoothed,
            self._smoothed,
            self._spline,
            self._loop,
            self._switch_plane,
            self._reset,
            self._compensated,
            self._param,
            lambda: self._motions(2),
        ]
        if self.dialect == "osai":
            kinds += [self._profile] * 6
        for _ in range(self.sections):
            self.rng.choice(kinds)()
        self._smoothed()
        self._motions(1)
        if marked:
            self.lines.append(f"{OFF} [PARAM=2]")
        self._motions(1)
        self.lines.append("M30")
