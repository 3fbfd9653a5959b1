"""What the look-ahead has to say of a program, from the rows of ``blocks``.

Plain geometry with numpy: lengths by quadrature, directions by derivatives.  It
shares no code with the engine, which sees rows only behind all stages.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cnc_core.blocks import (
    CIRCULAR,
    DISTANCE_RESET,
    LINEAR,
    MARKER,
    MARKER_OFF,
    MARKER_ON,
    POLYNOMIAL,
    RT_LOOP_BEGIN,
    RT_LOOP_END,
    BlockBatch,
)

TENTH_UM = 1e4
PLANES = {17: (0, 1), 18: (2, 0), 19: (1, 2)}
TYPES = {LINEAR: 1, CIRCULAR: 2, POLYNOMIAL: 6}
MEMBERS = (
    "block_type",
    "block_number",
    "block_count_r",
    "start_position",
    "length",
    "programmed_radius",
    "compensated_radius",
    "circle_angle",
    "length_min",
    "tangent_variation",
)
Facts = dict[str, float]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


def turn(before: Any, behind: Any) -> float:
    """Angle between two directions, 0..pi; 0 if one is unknown."""
    if before is None or behind is None:
        return 0.0
    a, b = before / np.linalg.norm(before), behind / np.linalg.norm(behind)
    return 2.0 * math.atan2(
        float(np.linalg.norm(a - b)), float(np.linalg.norm(a + b))
    )


@dataclass
class Element:
    """Facts as the first pass sees them; what other passes see."""

    facts: Facts
    #: distance resets ahead of it; these and ends of loops
    section: int
    epoch: int
    direction_in: Any
    loop: int = -1
    #: tangent_variation from the second pass of its loop on, and with its
    #: loop left out
    again: float | None = None
    skipped: float | None = None


@dataclass
class Loop:
    first: int
    end: int
    length: float
    modulo: bool


@dataclass
class Contour:
    """Elements in order, log entries, loops."""

    elements: list[Element] = field(default_factory=list)
    log: list[Facts] = field(default_factory=list)
    loops: list[Loop] = field(default_factory=list)


def _polynomial(row: Any, pool: Any, axes: int) -> tuple[float, Any, Any]:
    order = int(row["degree"]) + 1
    first = int(row["pool"])
    coef = pool[first : first + axes * order].reshape(axes, order)[:3]
    slope = coef[:, 1:] * np.arange(1, order)
    end, parts = float(row["angle"]), 64
    length = 0.0
    for k in range(parts):
        w = end * (k + 0.5 * (NODES + 1.0)) / parts
        speed = slope @ w ** np.arange(order - 1)[:, None]
        length += float(
            (np.linalg.norm(speed, axis=0) * WEIGHTS).sum() * end / parts / 2
        )
    return length, slope[:, 0], slope @ end ** np.arange(order - 1)


def _circle(row: Any, start: Any, end: Any) -> tuple[float, float, Any, Any]:
    """Radius, swept angle, directions in and out (derivatives by share)."""
    a, b = PLANES[int(row["plane"])]
    third = 3 - a - b
    centre = np.array(row["center"], dtype=float)
    from_, to = start[[a, b]] - centre, end[[a, b]] - centre
    radius = float(np.hypot(*from_))
    sign = math.copysign(1.0, float(row["angle"]))
    sweep = (
        sign
        * (math.atan2(to[1], to[0]) - math.atan2(from_[1], from_[0]))
        % (2 * math.pi)
    )
    turns = round((abs(float(row["angle"])) - sweep) / (2 * math.pi))
    angle = sign * (sweep + 2 * math.pi * turns)
    directions = []
    for at in (from_, to):
        direction = np.zeros(3)
        direction[a], direction[b] = -at[1] * angle, at[0] * angle
        direction[third] = end[third] - start[third]
        directions.append(direction)
    return radius, angle, directions[0], directions[1]


class Oracle:
    """Follows rows; ``start``: (axes,) where the program begins."""

    def __init__(self, start: Any) -> None:
        self.at = np.array(start, dtype=float)
        self.direction: Any = None
        self.distance = 0.0
        self.section = self.epoch = 0
        self.found = Contour()
        self._logging = self._over = False
        self._shift = 0.0
        self._items: list[tuple[str, Facts]] | None = None
        self._opened: tuple[int, float, bool, Any] | None = None
        self._before: Any = None  # direction ahead of the loop left last

    def follow(self, batches: Iterable[BlockBatch]) -> Contour:
        for batch in batches:
            for row in batch.rows:
                self._row(row, batch.pool)
        return self.found

    def _row(self, row: Any, pool: Any) -> None:
        kind = int(row["type"])
        if kind <= POLYNOMIAL:
            self._motion(row, pool)
        elif kind == DISTANCE_RESET:
            self.distance, self._shift = 0.0, 0.0
            self.section += 1
            self.epoch += 1
        elif kind == MARKER:
            facts = dict.fromkeys(MEMBERS, 0.0)
            facts |= {
                "block_number": float(row["n"]),
                "block_count_r": float(row["count"]),
                "start_position": self.distance,
                "length": float(row["value"]),
            }
            code = int(row["code"])
            name = {MARKER_ON: "on", MARKER_OFF: "off"}.get(code, "param")
            self._entry(name, facts)
        elif kind == RT_LOOP_BEGIN:
            first = len(self.found.elements)
            modulo = bool(row["flags"] & 128)
            self._opened = (first, self.distance, modulo, self.direction)
            self._items = []
        elif kind == RT_LOOP_END:
            self._loop_end()

    def _motion(self, row: Any, pool: Any) -> None:
        end = np.array(row["end"][: len(self.at)], dtype=float)
        start, kind = self.at, int(row["type"])
        facts = dict.fromkeys(MEMBERS, 0.0)
        main = end[:3] - start[:3]
        if kind == LINEAR:
            length = float(np.linalg.norm(main))
            into = out = main if length > 1e-12 else None
            length = length or float(np.linalg.norm(end - start))
        elif kind == CIRCULAR:
            radius, angle, into, out = _circle(row, start[:3], end[:3])
            length = float(np.linalg.norm(into))
            whole = math.ceil(abs(angle) / (2 * math.pi) - 1e-9) - 1
            facts["compensated_radius"] = radius * TENTH_UM
            facts["programmed_radius"] = (
                float(row["programmed_radius"]) * TENTH_UM
            )
            facts["circle_angle"] = angle - math.copysign(
                2 * math.pi * whole, angle
            )
        else:
            length, into, out = _polynomial(row, pool, len(self.at))
        facts |= {
            "block_type": float(TYPES[kind]),
            "block_number": float(row["n"]),
            "block_count_r": float(row["count"]),
            "start_position": self.distance,
            "length": length * TENTH_UM,
            "length_min": length * TENTH_UM,
            "tangent_variation": turn(self.direction, into),
        }
        element = Element(facts, self.section, self.epoch, into)
        if self._opened is not None:
            element.loop = len(self.found.loops)
        elif self._before is not None:
            element.skipped = turn(self._before[0], into)
        self._before = None
        self.found.elements.append(element)
        self._entry("element", facts)
        self.distance += length * TENTH_UM
        self.direction = self.direction if out is None else out
        self.at = end

    def _loop_end(self) -> None:
        assert self._opened is not None
        assert self._items is not None
        first, begin, modulo, before = self._opened
        items, self._opened, self._items = self._items, None, None
        elements = self.found.elements
        length = self.distance - begin
        loop = Loop(first, len(elements), length, modulo)
        self.found.loops.append(loop)
        self.epoch += 1
        again = None
        if loop.end > first:
            again = turn(self.direction, elements[first].direction_in)
            elements[first].again = again
            self._before = (before,)
        copies = 3 if self._logging else 1
        for copy in range(copies):
            fresh = copy > 0
            for name, entry in items:
                facts = dict(entry)
                if fresh and name == "element" and again is not None:
                    facts["tangent_variation"] = again
                    fresh = False
                self._entry(name, facts)
            if copy + 1 < copies:
                self._shift += length

    def _entry(self, name: str, facts: Facts) -> None:
        if self._items is not None:
            self._items.append((name, facts))
            return
        types = {"on": 3.0, "param": 4.0, "off": 5.0}
        if name == "on" and not self._over:
            self._logging = True
        if not self._logging:
            return
        entry = dict(facts)
        entry["start_position"] += self._shift
        entry["block_type"] = types.get(name, facts["block_type"])
        self.found.log.append(entry)
        if name == "off":
            self._logging, self._over = False, True


def differences(mine: list[Facts], theirs: list[Facts]) -> list[str]:
    """Members that differ by more than 1e-4 of their unit, as texts."""
    out = []
    if len(mine) != len(theirs):
        out.append(f"{len(mine)} elements, {len(theirs)} due")
    for k, (a, b) in enumerate(zip(mine, theirs, strict=False)):
        out += [
            f"element {k} N{b['block_number']:.0f} {name}: {a[name]} {b[name]}"
            for name in MEMBERS
            if not abs(a[name] - b[name]) <= 1e-4
        ]
    return out
