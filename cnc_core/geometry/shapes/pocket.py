"""Tool paths of a rectangular pocket: plunges, concentric passes, finishing
passes.

The tool's centre runs on curves parallel to the pocket's edge, from the middle
outwards.  So the distance of two passes is the width of cut.  The outermost pass
leaves the allowance.  Coordinates are the pocket's own: centre 0,0, length along
X, width along Y, Z absolute.  ``placed`` turns and shifts them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from cnc_core import plain

# widest cut in tool radii: wider passes leave the outer corners between them
# uncut
WIDEST = 1.4
# at what speed: rapid, feed in the plane, feed of the plunge
RAPID, PLANE, DOWN = "rapid", "plane", "down"


@dataclass(frozen=True)
class Move:
    """A motion of the tool's centre to (x, y, z); None: as before.

    ``centre``: of an arc; ``turn`` 1 counter-clockwise, -1 clockwise, 0 for a line.
    """

    speed: str
    x: float | None = None
    y: float | None = None
    z: float | None = None
    centre: tuple[float, float] | None = None
    turn: int = 0


@dataclass(frozen=True)
class Pocket:
    """``corner``: radius of the corners, at least the tool's.  Lengths in one
    unit; ``surface`` is a coordinate.

    ``cut``: width and ``infeed``: depth of one cut at most.  ``safety``: height
    at which feed begins. ``edge``, ``base``: allowances that roughing leaves.
    ``helix``: radius and pitch of the plunge, None: straight. ``turn``: 1 runs
    counter-clockwise, -1 clockwise.  ``lead``: radius of the arcs to and from a
    finished wall.  ``round_infeed``: from pass to pass in a semicircle.
    """

    length: float
    width: float
    corner: float
    depth: float
    surface: float
    safety: float
    tool: float
    cut: float
    infeed: float
    edge: float = 0.0
    base: float = 0.0
    helix: tuple[float, float] | None = None
    turn: int = 1
    lead: float = 0.0
    round_infeed: bool = False


@dataclass(frozen=True)
class Ring:
    """A rounded rectangle: half sides, radius of its corners."""

    x: float
    y: float
    corner: float


def outermost(pocket: Pocket, edge: float) -> Ring:
    """Where the tool's centre runs to leave ``edge`` at the wall."""
    inset = pocket.tool + edge
    return Ring(
        pocket.length / 2 - inset,
        pocket.width / 2 - inset,
        max(pocket.corner - inset, 0.0),
    )


def levels(pocket: Pocket, depth: float) -> list[float]:
    """Z of the floors down to ``depth`` below the surface, equally spaced; the
    last one exactly.
    """
    count = max(1, math.ceil(depth / pocket.infeed - 1e-9))
    return [pocket.surface - depth * k / count for k in range(1, count)] + [
        pocket.surface - depth
    ]


def rough(pocket: Pocket) -> Iterator[Move]:
    """Clear the pocket level by level, down to the base allowance; the tool
    stands above the centre before.
    """
    yield Move(RAPID, z=pocket.safety)
    above = pocket.surface
    for floor in levels(pocket, pocket.depth - pocket.base):
        yield from _plunge(pocket, above, floor)
        yield from _clear(pocket, outermost(pocket, pocket.edge))
        yield Move(PLANE, 0.0, 0.0)
        above = floor


def finish(pocket: Pocket) -> Iterator[Move]:
    """The floor if roughing has left something there, then the wall, level by
    level; from above the centre.
    """
    ring = outermost(pocket, 0.0)
    bottom = pocket.surface - pocket.depth
    yield Move(RAPID, z=pocket.safety)
    if pocket.base > 0:
        yield Move(DOWN, z=bottom)
        yield from _clear(pocket, outermost(pocket, pocket.edge))
        yield Move(PLANE, 0.0, 0.0)
        yield Move(RAPID, z=pocket.safety)
    lead = min(pocket.lead, ring.x, ring.y)
    enter, leave = -lead * pocket.turn, lead * pocket.turn
    for floor in levels(pocket, pocket.depth):
        yield Move(PLANE, ring.x - lead, enter)
        yield Move(DOWN, z=floor)
        if lead > 0:
            yield Move(
                PLANE,
                ring.x,
                0.0,
                centre=(ring.x - lead, 0.0),
                turn=pocket.turn,
            )
        yield from _around(ring, pocket.turn)
        if lead > 0:
            yield Move(
                PLANE,
                ring.x - lead,
                leave,
                centre=(ring.x - lead, 0.0),
                turn=pocket.turn,
            )
    yield Move(PLANE, 0.0, 0.0)


def placed(
    moves: Iterable[Move], centre: tuple[float, float], degrees: float
) -> Iterator[Move]:
    """The moves turned about Z and shifted to the pocket's centre."""
    c = plain.cos(math.radians(degrees))
    s = plain.sin(math.radians(degrees))
    if degrees % 90.0 == 0.0:
        c = float(round(c))
        s = float(round(s))

    def point(x: float, y: float) -> tuple[float, float]:
        first = centre[0] + c * x - s * y
        return first, centre[1] + s * x + c * y

    for move in moves:
        if move.x is None or move.y is None:
            yield move
            continue
        x, y = point(move.x, move.y)
        yield replace(
            move,
            x=x,
            y=y,
            centre=None if move.centre is None else point(*move.centre),
        )


def _plunge(pocket: Pocket, above: float, floor: float) -> Iterator[Move]:
    """Down to a floor at the centre: straight, or in a helix that leaves a flat
    floor.
    """
    if pocket.helix is None:
        yield Move(DOWN, z=floor)
        return
    radius, pitch = pocket.helix
    yield Move(PLANE, radius, 0.0)
    yield Move(DOWN, z=above)
    turns = max(1, math.ceil((above - floor) / pitch - 1e-9))
    heights = [above + (floor - above) * k / turns for k in range(1, turns)] + [
        floor,
        floor,
    ]
    for height in heights:
        yield Move(DOWN, radius, 0.0, height, (0.0, 0.0), pocket.turn)
    yield Move(PLANE, 0.0, 0.0)


def _clear(pocket: Pocket, outer: Ring) -> Iterator[Move]:
    """From the centre outwards: along the middle line, then ring by ring."""
    smaller = min(outer.x, outer.y)
    if outer.x > outer.y:
        yield Move(PLANE, outer.y - outer.x, 0.0)
        yield Move(PLANE, outer.x - outer.y, 0.0)
    elif outer.y > outer.x:
        yield Move(PLANE, 0.0, outer.y - outer.x)
        yield Move(PLANE, 0.0, outer.x - outer.y)
        yield Move(PLANE, 0.0, 0.0)
    if smaller <= 0:
        return
    count = max(
        1, math.ceil(smaller / min(pocket.cut, WIDEST * pocket.tool) - 1e-9)
    )
    for k in range(1, count + 1):
        inset = smaller * (count - k) / count
        if pocket.round_infeed:
            middle = outer.x - inset - smaller / count / 2
            yield Move(
                PLANE,
                outer.x - inset,
                0.0,
                centre=(middle, 0.0),
                turn=-pocket.turn,
            )
        yield from _around(
            Ring(
                outer.x - inset, outer.y - inset, max(outer.corner - inset, 0.0)
            ),
            pocket.turn,
        )


def _around(ring: Ring, turn: int) -> Iterator[Move]:
    """Once around from the middle of the right side, back to it."""
    r, t = ring.corner, turn
    yield Move(PLANE, ring.x, 0.0)
    for sx, sy, upright in (
        (1, 1, True),
        (-1, 1, False),
        (-1, -1, True),
        (1, -1, False),
    ):
        corner = (sx * (ring.x - r), sy * (ring.y - r) * t)
        first = (ring.x * sx, corner[1])
        last = (corner[0], ring.y * sy * t)
        if not upright:
            first, last = last, first
        yield Move(PLANE, *first)
        if r > 0:
            yield Move(PLANE, *last, centre=corner, turn=t)
    yield Move(PLANE, ring.x, 0.0)
