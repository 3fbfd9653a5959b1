"""Compensated contours against an offset built with complex numbers, and
against the distance to the contour.
"""

from __future__ import annotations

import cmath
import itertools
import math
import random
from dataclasses import dataclass

import numpy as np
import pytest
import shapely

from cnc_core.blocks import CIRCULAR, COMPENSATION, LINEAR, NC_BLOCK, BlockBatch
from cnc_core.errors import CncError, Place
from cnc_core.geometry.stages.radius_compensation import RadiusCompensation
from cnc_core.geometry.stages.stage import RefusedRow

pytestmark = pytest.mark.sanitize("stages/compensation")

MAIN = (0, 1, 2)


@dataclass(frozen=True)
class Piece:
    """A line, or an arc of signed curvature ``k``, from ``a`` to ``b``."""

    a: complex
    b: complex
    k: float = 0.0

    @property
    def centre(self) -> complex:
        chord = self.b - self.a
        half = abs(chord) / 2
        height = math.sqrt(max(1 / self.k**2 - half**2, 0.0))
        return (self.a + self.b) / 2 + math.copysign(
            1, self.k
        ) * 1j * chord / abs(chord) * height

    @property
    def sweep(self) -> float:
        return cmath.phase((self.b - self.centre) / (self.a - self.centre))

    def tangent(self, at: complex) -> complex:
        if not self.k:
            return (self.b - self.a) / abs(self.b - self.a)
        radial = at - self.centre
        return math.copysign(1, self.k) * 1j * radial / abs(radial)

    def distance(self, z: complex) -> float:
        """From a point to the piece."""
        if not self.k:
            u = (z - self.a) / (self.b - self.a)
            return abs(
                z - self.a - min(max(u.real, 0.0), 1.0) * (self.b - self.a)
            )
        turn = (
            cmath.phase((z - self.centre) / (self.a - self.centre))
            if z != self.centre
            else 0.0
        )
        inside = 0 <= math.copysign(1, self.k) * turn <= abs(self.sweep)
        return (
            abs(abs(z - self.centre) - 1 / abs(self.k))
            if inside
            else min(abs(z - self.a), abs(z - self.b))
        )


def star(seed: int, arcs: bool = True) -> list[Piece]:
    """A closed counter-clockwise contour with inner and outer corners whose
    pieces survive an offset of 1.
    """
    rng = random.Random(seed)
    n = rng.randint(5, 14)
    angles = [2 * math.pi * (i + rng.uniform(-0.2, 0.2)) / n for i in range(n)]
    points = [cmath.rect(rng.uniform(45, 70), w) for w in angles]
    pieces = []
    for a, b in zip(points, points[1:] + points[:1], strict=True):
        k = (
            rng.choice([-1, 1]) / (abs(b - a) * rng.uniform(0.9, 3.0))
            if arcs and rng.random() < 0.5
            else 0.0
        )
        pieces.append(Piece(a, b, k))
    return pieces


def row_of(piece: Piece, line: int) -> np.ndarray:
    row = np.zeros(1, NC_BLOCK)
    row["end"][0, :2] = piece.b.real, piece.b.imag
    row["line"], row["n"], row["count"], row["feed"] = (
        line,
        10 * line,
        line,
        50.0,
    )
    row["type"], row["length"] = LINEAR, abs(piece.b - piece.a)
    if piece.k:
        row["type"], row["plane"], row["angle"] = CIRCULAR, 17, piece.sweep
        row["center"] = piece.centre.real, piece.centre.imag
        row["radius"] = row["programmed_radius"] = abs(piece.a - piece.centre)
        row["length"] = row["radius"] * abs(piece.sweep)
    return row


def command(
    code: int, radius: float = 0.0, mode: int = 237, corner: int = 26
) -> np.ndarray:
    row = np.zeros(1, NC_BLOCK)
    row["type"], row["code"], row["value"], row["plane"] = (
        COMPENSATION,
        code,
        radius,
        17,
    )
    row["pool"], row["degree"] = mode, corner
    return row


def program(
    pieces: list[Piece], code: int, radius: float, corner: int = 26
) -> tuple[np.ndarray, np.ndarray]:
    """(start, rows): the contour and its first piece again, selected and deselected with G237."""
    rows = [row_of(p, i + 1) for i, p in enumerate([*pieces, pieces[0]])]
    start = np.array([pieces[0].a.real, pieces[0].a.imag, 0.0])
    return start, np.concatenate(
        [command(code, radius, corner=corner), *rows, command(40)]
    )


def stage(start: np.ndarray, **options) -> RadiusCompensation:
    return RadiusCompensation(
        start, MAIN, lambda _, line: Place("p.nc", line, 1), **options
    )


def compensated(
    start: np.ndarray, rows: np.ndarray, size: int = 10**9
) -> np.ndarray:
    s = stage(start)
    parts = [
        s.push(BlockBatch(rows[i : i + size])).rows
        for i in range(0, len(rows), size)
    ]
    return np.concatenate([*parts, s.drain().rows])


def path(start: np.ndarray, rows: np.ndarray) -> list[Piece]:
    """Rows as pieces (arcs up to half a turn)."""
    at, out = complex(start[0], start[1]), []
    for row in rows[rows["type"] <= CIRCULAR]:
        end = complex(*row["end"][:2])
        k = (
            math.copysign(1 / row["radius"], row["angle"])
            if row["type"] == CIRCULAR
            else 0.0
        )
        out.append(Piece(at, end, k))
        at = end
    return out


def joint(first: Piece, second: Piece, d: float) -> complex | None:
    """Where the offset curves of two neighbours meet nearest to their common
    point; None: they do not.

    The curves are followed numerically (Newton on both parameters), nothing is
    shared with the implementation.
    """

    def at(piece: Piece, near: complex, s: float) -> tuple[complex, complex]:
        t = piece.tangent(near)
        if not piece.k:
            return near + 1j * d * t + s * t, t
        r = 1 / piece.k - d
        turn = cmath.exp(1j * s / r)
        return near + 1j * t / piece.k - 1j * r * t * turn, t * turn

    corner, u, v = first.b, 0.0, 0.0
    for _ in range(60):
        p, tp = at(first, corner, u)
        q, tq = at(second, corner, v)
        gap, area = q - p, (tp.conjugate() * tq).imag
        if abs(gap) < 1e-12:
            return p
        if abs(area) < 1e-15:
            return None
        u += (gap.conjugate() * tq).imag / area
        v += (gap.conjugate() * tp).imag / area
        if max(abs(u), abs(v)) > 1e4:
            return None
    return None


@pytest.mark.parametrize("code", [41, 42])
@pytest.mark.parametrize("seed", range(40))
def test_round_corners_equal_the_analytic_offset(seed: int, code: int) -> None:
    """Inner corners are the intersections of the offset curves, outer ones arcs
    about the corner, to 1e-9 mm.
    """
    pieces, radius = star(seed), 1.0
    d = radius if code == 41 else -radius
    start, rows = program(pieces, code, radius)
    got = path(start, compensated(start, rows))[
        1:-1
    ]  # without the perpendicular lines
    around = [*pieces, pieces[0]]
    expected = [pieces[0].a + 1j * d * pieces[0].tangent(pieces[0].a)]
    for first, second in itertools.pairwise(around):
        t1, t2 = first.tangent(first.b), second.tangent(second.a)
        if d * cmath.phase(t2 / t1) < 0:
            expected += [first.b + 1j * d * t1, first.b + 1j * d * t2]
        else:
            meeting = joint(first, second, d)
            assert meeting is not None
            expected.append(meeting)
    expected.append(around[-1].b + 1j * d * around[-1].tangent(around[-1].b))
    ends = [got[0].a, *(p.b for p in got)]
    assert len(ends) == len(expected)
    assert max(abs(a - b) for a, b in zip(ends, expected, strict=True)) < 1e-9


@pytest.mark.parametrize("code", [41, 42])
@pytest.mark.parametrize("corner", [25, 26])
@pytest.mark.parametrize("seed", range(15))
def test_tool_never_cuts_into_the_contour(
    seed: int, corner: int, code: int
) -> None:
    """Every point of the path is at least R away from the contour; with G26 it
    is exactly R away.
    """
    pieces, radius = star(100 + seed), 1.5
    start, rows = program(pieces, code, radius, corner)
    out = compensated(start, rows)
    whole = (out["line"] > 1) & (
        out["line"] <= len(pieces)
    )  # not the piece that is cut by selection and deselection
    for piece, inside in zip(path(start, out), whole, strict=True):
        if not inside:
            continue
        for f in np.linspace(0, 1, 9):
            nearest = min(p.distance(along(piece, f)) for p in pieces)
            assert nearest >= radius - 1e-9
            if corner == 26:
                assert nearest == pytest.approx(radius, abs=1e-9)


@pytest.mark.parametrize("seed", range(12))
def test_outer_offset_of_polygons_agrees_with_shapely(seed: int) -> None:
    """With round corners the path of a polygon of lines lies on the boundary of
    shapely's buffer.
    """
    pieces = star(200 + seed, arcs=False)
    start, rows = program(pieces, 42, 2.0)
    out = compensated(start, rows)
    ring = (
        shapely.Polygon([(p.a.real, p.a.imag) for p in pieces])
        .buffer(2.0, quad_segs=512)
        .exterior
    )
    whole = (out["line"] > 1) & (out["line"] <= len(pieces))
    inner = [
        p for p, inside in zip(path(start, out), whole, strict=True) if inside
    ]
    assert (
        max(
            ring.distance(shapely.Point(z.real, z.imag)) for z in sampled(inner)
        )
        < 1e-5
    )


def along(p: Piece, f: float) -> complex:
    """The point at a share of the piece's length."""
    return (
        p.centre + (p.a - p.centre) * cmath.exp(1j * p.sweep * f)
        if p.k
        else p.a + f * (p.b - p.a)
    )


def sampled(pieces: list[Piece]) -> list[complex]:
    return [
        along(p, f)
        for p in pieces
        for f in np.linspace(0, 1, 257 if p.k else 2)
    ]


@pytest.mark.parametrize("corner", [25, 26])
@pytest.mark.parametrize("seed", range(6))
def test_streaming_does_not_matter(seed: int, corner: int) -> None:
    """One row at a time, sevens and everything at once give the same bytes."""
    start, rows = program(star(300 + seed), 42, 1.0, corner)
    whole = compensated(start, rows)
    assert compensated(start, rows, 1).tobytes() == whole.tobytes()
    assert compensated(start, rows, 7).tobytes() == whole.tobytes()


@pytest.mark.parametrize("seed", range(60))
def test_wild_contours_are_right_or_refused(seed: int) -> None:
    """Random walks of lines and arcs: finite rows whose ends join and whose
    lines keep their direction, or an error.
    """
    rng = random.Random(seed)
    at, pieces = 0j, []
    for _ in range(40):
        b = at + cmath.rect(
            rng.uniform(0.5, 20), rng.uniform(-math.pi, math.pi)
        )
        k = (
            rng.choice([-1, 1]) / (abs(b - at) * rng.uniform(0.5001, 4))
            if rng.random() < 0.5
            else 0.0
        )
        pieces.append(Piece(at, b, k))
        at = b
    start, rows = program(
        pieces[:1] + pieces[1:],
        rng.choice([41, 42]),
        rng.choice([0.01, 0.3, -0.3, 1.0]),
    )
    errors: list[CncError] = []
    s = stage(start, collect=errors.append)
    out = np.concatenate([s.push(BlockBatch(rows[:-2])).rows, s.drain().rows])
    assert {e.code for e in errors} <= {906001, 90017, 90031}
    assert all(1 <= e.place.line <= 40 for e in errors)
    moving = out[out["type"] <= CIRCULAR]
    assert np.isfinite(moving["end"]).all()
    assert np.isfinite(moving["length"]).all()
    arcs = moving[moving["type"] == CIRCULAR]
    assert (arcs["radius"] > 0).all()
    if errors:
        with pytest.raises(RefusedRow):
            compensated(start, rows)


def check_joined(start: np.ndarray, rows: np.ndarray) -> None:
    """Every row is finite and starts where the one before it ends; arcs run about their centre."""
    at = start.copy()
    for row in rows[rows["type"] <= CIRCULAR]:
        end = row["end"][:3]
        assert np.isfinite(
            [*end, row["length"], row["angle"], row["radius"]]
        ).all()
        if row["type"] == CIRCULAR:
            centre = complex(*row["center"])
            first, last = complex(*at[:2]) - centre, complex(*end[:2]) - centre
            assert abs(first) == pytest.approx(row["radius"], abs=1e-6)
            assert abs(last) == pytest.approx(row["radius"], abs=1e-6)
            assert abs(first * cmath.exp(1j * row["angle"]) - last) < 1e-6
        else:
            assert row["length"] == pytest.approx(math.dist(at, end), abs=1e-9)
        at = end


@pytest.mark.parametrize("seed", range(300))
def test_any_sequence_of_commands_gives_a_joined_path_or_an_error(
    seed: int,
) -> None:
    """Selections, corners, sides, radii and deselections in any order between
    lines, arcs and moves of Z.
    """
    rng = random.Random(1000 + seed)
    at, z, parts = 0j, 0.0, []
    for line in range(1, 80):
        roll = rng.random()
        if roll < 0.2:
            mode, corner = (
                rng.choice([5, 138, 139, 237, 239]),
                rng.choice([25, 26]),
            )
            parts.append(
                command(
                    rng.choice([40, 41, 41, 42]),
                    rng.choice([0.0, 0.1, 0.4, -0.2]),
                    mode,
                    corner,
                )
            )
            continue
        b = at + cmath.rect(rng.uniform(3, 20), rng.uniform(-math.pi, math.pi))
        k = (
            rng.choice([-1, 1]) / (abs(b - at) * rng.uniform(0.5001, 4))
            if roll < 0.4
            else 0.0
        )
        rise = rng.choice([0.0, 0.0, 1.0])
        z += rise
        row = row_of(Piece(at, at if roll > 0.9 else b, k), line)
        row["end"][0, 2], row["length"] = z, np.hypot(row["length"], rise)
        parts.append(row)
        at = at if roll > 0.9 else b
    rows, start = np.concatenate(parts), np.zeros(3)
    error = None
    try:
        out = compensated(start, rows, 9)
    except RefusedRow as refused:
        error, out = refused.error, refused.ahead.rows
    if error:
        assert error.code in {
            906001,
            906002,
            906004,
            90008,
            90017,
            90031,
            90047,
        }
        start = (
            out["end"][0, :3].copy() if len(out) else start
        )  # the first row of the last batch
        out = out[1:]
    check_joined(start, out)
