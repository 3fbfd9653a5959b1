"""Least-squares elements through points: line, plane, circle, sphere, circle in
space.

All fits are geometric: what is minimised is the sum of the squared orthogonal
distances.  Lines and planes follow from the singular value decomposition of the
centred points.  Circles and spheres minimise sum (|p - c| - r)^2 from the
algebraic solution on (Kasa 1976) by Newton steps with Levenberg's damping.  The
variance is the mean of the squared residuals.  Points are (n, d) arrays of any
unit of length; results carry that unit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_core.units import FloatArray

DEGENERATE = 1e-9  # singular values below this share of the largest are 0
# a centre this many times farther away than the points spread: they lie on a
# line or a plane
FARTHEST = 1e7
STEPS_MAX = 500
FAR = (3.0, 30.0, 1000.0)  # further starts, in the spread of the points
STEP_END = 1e-12  # of the scaled problem
# a step this short that brings no gain any more: as good as the numbers allow
CLOSE_ENOUGH = 1e-10
NEWTON_STEPS, NEAR = 3, 1e-6  # behind that; no step is longer


class DegenerateError(ValueError):
    """The points do not determine the element."""


@dataclass(frozen=True)
class Line:
    """``direction``: unit vector from the first point towards the last one.
    ``support``: the centroid.
    """

    direction: FloatArray
    support: FloatArray
    variance: float


@dataclass(frozen=True)
class Plane:
    """``normal``: unit vector whose last component that is not 0 is positive.
    ``support``: the centroid.
    """

    normal: FloatArray
    support: FloatArray


@dataclass(frozen=True)
class Circle:
    """Also a sphere; ``normal`` of a circle in space only."""

    centre: FloatArray
    radius: float
    variance: float
    normal: FloatArray | None = None


def fit_line(points: FloatArray, identical: float = 1e-9) -> Line:
    """(n, 3) points, n >= 2.

    DegenerateError if they lie within ``identical`` of each other.
    """
    centred, support, sizes, axes = _principal(points)
    if sizes[0] <= identical:
        raise DegenerateError("the points are identical")
    across = centred - np.outer(centred @ axes[0], axes[0])
    return Line(
        _along(axes[0], points[-1] - points[0]),
        support,
        float((across**2).sum() / len(points)),
    )


def fit_plane(points: FloatArray) -> Plane:
    """(n, 3) points, n >= 3.  DegenerateError if they lie on a line."""
    _, support, sizes, axes = _principal(points)
    if sizes[1] <= DEGENERATE * sizes[0]:
        raise DegenerateError("the points lie on a line")
    return Plane(upward(axes[2]), support)


def fit_circle(points: FloatArray) -> Circle:
    """(n, 2) points, n >= 3.  DegenerateError if they lie on a line."""
    _, _, sizes, _ = _principal(points)
    if sizes[1] <= DEGENERATE * sizes[0]:
        raise DegenerateError("the points lie on a line")
    return _fit_round(points)


def fit_sphere(points: FloatArray) -> Circle:
    """(n, 3) points, n >= 4.  DegenerateError if they lie in a plane."""
    _, _, sizes, _ = _principal(points)
    if sizes[2] <= DEGENERATE * sizes[0]:
        raise DegenerateError("the points lie in a plane")
    return _fit_round(points)


def fit_plane_circle(points: FloatArray) -> Circle:
    """(n, 3) points, n >= 3: the plane first, then the circle of the
    projections in it.  DegenerateError: on a line.
    """
    plane = fit_plane(points)
    helper = np.eye(3)[np.argmin(np.abs(plane.normal))]
    first = np.cross(plane.normal, helper)
    first /= np.linalg.norm(first)
    base = np.array([first, np.cross(plane.normal, first)])
    flat = fit_circle((points - plane.support) @ base.T)
    return Circle(
        plane.support + flat.centre @ base,
        flat.radius,
        flat.variance,
        plane.normal,
    )


def upward(normal: FloatArray) -> FloatArray:
    """The unit vector or its opposite: nz > 0; with nz = 0 ny > 0; with both 0
    nx > 0.
    """
    for component in reversed(range(len(normal))):
        if abs(normal[component]) >= 1e-9:
            return normal if normal[component] > 0 else -normal
    return normal


def _along(direction: FloatArray, way: FloatArray) -> FloatArray:
    """The direction or its opposite, whichever leads along ``way``; if it is
    orthogonal, its first component counts.
    """
    share = float(direction @ way)
    if abs(share) <= 1e-9 * float(np.linalg.norm(way)):
        share = float(direction[np.argmax(np.abs(direction) >= 1e-9)])
    return direction if share > 0 else -direction


def _principal(
    points: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Centred points, centroid, singular values (one a dimension), principal
    directions as rows.
    """
    support = points.mean(axis=0)
    centred = points - support
    _, sizes, axes = np.linalg.svd(centred, full_matrices=True)
    return (
        centred,
        support,
        np.pad(sizes, (0, points.shape[1] - len(sizes))),
        axes,
    )


def _fit_round(points: FloatArray) -> Circle:
    """Circle in 2, sphere in 3 dimensions."""
    middle = points.mean(axis=0)
    scale = float(
        np.sqrt(
            ((points - middle) ** 2).sum(axis=1).mean(),
        )
    )
    scaled = (points - middle) / scale
    centre = _minimise(scaled, _kasa(scaled))
    if centre is None:
        centre = _from_far_away(scaled)
    away = np.linalg.norm(scaled - centre, axis=1)
    radius = float(away.mean())
    variance = float(((away - radius) ** 2).mean())
    return Circle(middle + centre * scale, radius * scale, variance * scale**2)


def _from_far_away(points: FloatArray) -> FloatArray:
    """From the algebraic start the centre runs away to infinity: the best one
    lies on the other side of the points.
    """
    flat = np.linalg.svd(points)[2][-1]
    found = [
        c
        for side in (1, -1)
        for way in FAR
        if (c := _minimise(points, side * way * flat)) is not None
    ]
    if not found:
        raise DegenerateError(
            "no finite radius fits the points better than an infinite one"
        )
    return min(found, key=lambda centre: _cost(points, centre))


def _kasa(points: FloatArray) -> FloatArray:
    """Centre of the algebraic fit: linear least squares of x^2 + y^2 + .. = 2 c
    p + const.
    """
    system = np.hstack(
        [
            2.0 * points,
            np.ones((len(points), 1)),
        ]
    )
    solution = np.linalg.lstsq(
        system,
        (points**2).sum(axis=1),
        rcond=None,
    )[0]
    return np.asarray(solution[:-1])


def _minimise(points: FloatArray, centre: FloatArray) -> FloatArray | None:
    """Minimise the variance of the distances over the centre; the best radius
    is their mean.  None: no end is found.
    """
    damping, cost = 1e-3, _cost(points, centre)
    for _ in range(STEPS_MAX):
        gradient, exact, approximate = _derivatives(points, centre)
        step = _step(gradient, exact, approximate, damping)
        reached = centre + step
        new_cost = _cost(points, reached)
        length = float(np.linalg.norm(step)) / (
            1.0 + float(np.linalg.norm(centre))
        )
        if new_cost <= cost:
            centre = reached
            cost = new_cost
            damping = max(damping / 10.0, 1e-15)
            if length < STEP_END:
                return _settled(points, centre)
        elif length < CLOSE_ENOUGH:
            return _settled(points, centre)
        else:
            damping *= 10.0
        if float(np.linalg.norm(centre)) > FARTHEST:
            return None
    return centre


def _settled(points: FloatArray, centre: FloatArray) -> FloatArray:
    """Newton's steps to where the slope is 0.  The cost is flat there: it tells
    a centre by 1e-8 only, and rounding would decide on the rest.
    """
    for _ in range(NEWTON_STEPS):
        gradient, exact, _ = _derivatives(points, centre)
        step = _step(gradient, exact, exact, 0.0)
        if float(np.linalg.norm(step)) > NEAR * (1.0 + np.linalg.norm(centre)):
            break  # no minimum is so near: the second derivatives vanish there
        centre = centre + step
    return centre


def _cost(points: FloatArray, centre: FloatArray) -> float:
    away = np.linalg.norm(points - centre, axis=1)
    return float(((away - away.mean()) ** 2).sum())


def _derivatives(
    points: FloatArray, centre: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Gradient, second derivatives and their Gauss-Newton part of half the
    cost; the radius is eliminated.
    """
    way = centre - points
    away = np.linalg.norm(way, axis=1)
    safe = np.where(away > 0, away, 1.0)
    unit = way / safe[:, None]
    residual = away - away.mean()
    slope = unit - unit.mean(axis=0)
    approximate = slope.T @ slope
    bend = (residual / safe)[:, None, None] * (
        np.eye(points.shape[1]) - unit[:, :, None] * unit[:, None, :]
    )
    return slope.T @ residual, approximate + bend.sum(axis=0), approximate


def _step(
    gradient: FloatArray,
    exact: FloatArray,
    approximate: FloatArray,
    damping: float,
) -> FloatArray:
    """Newton's step where the second derivatives are positive, else
    Gauss-Newton's; both damped.
    """
    for matrix in (exact, approximate):
        damped = matrix + damping * np.diag(np.diag(approximate) + 1e-30)
        try:
            np.linalg.cholesky(damped)
        except np.linalg.LinAlgError:
            continue
        return np.asarray(-np.linalg.solve(damped, gradient))
    return -gradient
