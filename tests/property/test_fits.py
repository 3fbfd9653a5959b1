"""Geometric least squares against scipy's minimiser and, where there is one, an exact answer."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from cnc_core.geometry.shapes.fits import (
    DegenerateError,
    fit_circle,
    fit_line,
    fit_plane,
    fit_plane_circle,
    fit_sphere,
)

CASES = 24


def noisy(seed, dimensions, noise):
    """Points spread over a circle or sphere, moved at random."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(dimensions + 1, 11))
    centre, radius = rng.uniform(-100, 100, dimensions), rng.uniform(5, 50)
    unit = rng.normal(size=(count, dimensions))
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    return (
        centre
        + radius * unit
        + rng.normal(size=(count, dimensions)) * noise * radius
    )


def reference(points, start):
    """Centre and radius that scipy finds."""
    d = points.shape[1]
    found = least_squares(
        lambda q: np.linalg.norm(points - q[:d], axis=1) - q[d],
        start,
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
        method="lm",
    )
    return found.x, 2 * found.cost


@pytest.mark.parametrize(
    "fit", [fit_circle, fit_sphere], ids=["circle", "sphere"]
)
@pytest.mark.parametrize("seed", range(CASES))
def test_circles_and_spheres_agree_with_scipy(fit, seed):
    """Radius, centre and cost to 1e-9 of the radius; the cost is never worse."""
    dimensions = 2 if fit is fit_circle else 3
    points = noisy(seed, dimensions, [1e-4, 1e-3, 1e-2][seed % 3])
    found = fit(points)
    start = [*(found.centre + 1e-3), found.radius * 1.001]
    best, cost = reference(points, start)
    own = found.variance * len(points)
    assert own <= cost * (1 + 1e-9) + 1e-18
    if abs(own - cost) <= 1e-12 * cost:
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if (
            spread[-1] > 0.2 * spread[0]
        ):  # else scipy's own end is farther from the minimum than this
            assert np.abs(
                np.array([*found.centre, found.radius]) - best
            ).max() <= 1e-9 * (found.radius + 200)


@pytest.mark.parametrize("seed", range(CASES))
def test_the_gradient_vanishes(seed):
    """At the minimum the residuals are orthogonal to every change of the centre."""
    points = noisy(seed, 2 + seed % 2, 0.02)
    found = (fit_circle if points.shape[1] == 2 else fit_sphere)(points)
    way = points - found.centre
    away = np.linalg.norm(way, axis=1)
    residual = away - found.radius
    assert abs(residual.sum()) <= 1e-9 * found.radius
    assert (
        np.abs((way / away[:, None]).T @ residual).max() <= 1e-9 * found.radius
    )


@pytest.mark.parametrize("seed", range(CASES))
def test_lines_and_planes_agree_with_scipy(seed):
    """No direction through any point is better than the one found."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(int(rng.integers(4, 11)), 3)) * rng.uniform(
        0.1, 30, 3
    ) + rng.uniform(-50, 50, 3)
    line, plane = fit_line(points), fit_plane(points)

    def across(q):
        direction = q[3:] / np.linalg.norm(q[3:])
        way = points - q[:3]
        return (way - np.outer(way @ direction, direction)).ravel()

    def above(q):
        return (points - q[:3]) @ (q[3:] / np.linalg.norm(q[3:]))

    noise = rng.normal(size=6) * 0.05
    for residuals, found, own in (
        (across, [*line.support, *line.direction], line.variance * len(points)),
        (
            above,
            [*plane.support, *plane.normal],
            float((((points - plane.support) @ plane.normal) ** 2).sum()),
        ),
    ):
        best = least_squares(
            residuals,
            np.array(found) + noise,
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
        )
        assert own <= 2 * best.cost * (1 + 1e-9) + 1e-18
    assert plane.normal[2] > 0
    assert line.direction @ (points[-1] - points[0]) > 0


@pytest.mark.parametrize("seed", range(CASES))
def test_circle_in_space_is_the_circle_in_the_fitted_plane(seed):
    """Turned into any plane, the flat fit is found again."""
    rng = np.random.default_rng(seed)
    flat = noisy(seed, 2, 1e-3)
    base = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    shift = rng.uniform(-30, 30, 3)
    found, plain = fit_plane_circle(flat @ base[:2] + shift), fit_circle(flat)
    assert found.radius == pytest.approx(plain.radius, rel=1e-9)
    assert found.centre == pytest.approx(
        plain.centre @ base[:2] + shift, abs=1e-9 * plain.radius + 1e-10
    )
    assert abs(found.normal @ base[2]) == pytest.approx(1.0, abs=1e-12)
    assert found.variance == pytest.approx(plain.variance, rel=1e-7, abs=1e-18)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize(
    ("fit", "points"),
    [
        (fit_line, [(1, 2, 3), (1, 2, 3)]),
        (fit_plane, [(0, 0, 0), (1, 1, 1), (2, 2, 2), (5, 5, 5)]),
        (fit_circle, [(0, 0), (1, 1), (2, 2)]),
        (fit_circle, [(3, 3), (3, 3), (3, 3)]),
        (fit_circle, [(0, 0), (1, 0), (1, 0)]),
        (fit_sphere, [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)]),
        (fit_sphere, [(1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 0, 0)]),
        (fit_plane_circle, [(0, 0, 0), (1, 2, 3), (2, 4, 6)]),
    ],
)
def test_degenerate_sets_are_refused_at_every_scale(fit, points, scale):
    """Identical, collinear, coplanar points."""
    with pytest.raises(DegenerateError):
        fit(np.array(points, dtype=float) * scale)


def test_signs():
    """Normals upwards, in a vertical plane along Y, else X; directions from the
    first point to the last one.
    """
    up = fit_plane(np.array([(1.0, 0, 0), (0, 1, 0), (1, 1, 0)])).normal
    assert up == pytest.approx([0, 0, 1])
    assert fit_plane(
        np.array([(0.0, 0, 0), (1, 0, 0), (0, 0, 1)])
    ).normal == pytest.approx([0, 1, 0])
    assert fit_plane(
        np.array([(0.0, 0, 0), (0, 1, 0), (0, 0, 1)])
    ).normal == pytest.approx([1, 0, 0])
    there = np.array([(0.0, 0, 0), (1, 0.1, 0), (2, 0, 0)])
    assert fit_line(there).direction[0] > 0
    assert fit_line(there[::-1]).direction[0] < 0
    closed = np.array([(0.0, 1, 0), (5, 0, 0), (-5, 0, 0), (0, -1, 0)])
    assert fit_line(closed).direction[0] == pytest.approx(1.0)


@pytest.mark.parametrize("noise", [0.01, 0.1, 0.3])
@pytest.mark.parametrize("seed", range(CASES))
def test_the_order_of_the_points_does_not_matter(seed, noise):
    """To 1e-11 of the radius: rounding decides on nothing that a program sees."""
    points = noisy(seed, 2 + seed % 2, noise)
    fit = fit_circle if points.shape[1] == 2 else fit_sphere
    order = np.random.default_rng(seed).permutation(len(points))
    try:
        found, again = fit(points), fit(points[order])
    except DegenerateError:
        return
    assert np.allclose(found.centre, again.centre, 0, 1e-11 * found.radius)
