"""The distance of positions from polynomials, beside the nearest of many points."""

from __future__ import annotations

import numpy as np
import pytest

from cnc_core.geometry.shapes.polynomial import distance, points
from cnc_core.units import FloatArray


def nearest(coef: FloatArray, at: FloatArray) -> float:
    """Grids around the nearest points, each 30 times as fine as the one before."""
    first = np.linspace(0.0, 1.0, 4001)
    far = np.linalg.norm(points(coef, first) - at, axis=1)
    best = float(far.min())
    for k in far.argsort()[:6]:
        low, high = first[max(k - 1, 0)], first[min(k + 1, 4000)]
        for _ in range(6):
            w = np.linspace(low, high, 61)
            off = np.linalg.norm(points(coef, w) - at, axis=1)
            j = int(off.argmin())
            low, high = w[max(j - 1, 0)], w[min(j + 1, 60)]
            best = min(best, float(off.min()))
    return best


def there_and_back(rng: np.random.Generator) -> tuple[FloatArray, float]:
    """A cubic (3, 4) that all but stops and turns, and where it does."""
    a, b, slow = rng.normal(size=(3, 3))
    slow *= 10.0 ** rng.uniform(-4.0, -1.0)
    turn = rng.uniform(0.1, 0.9)
    from_turn = 10.0 * np.column_stack([0.0 * a, slow / 10.0, a, b])
    shift = [
        [1.0, 0.0, 0.0, 0.0],
        [-turn, 1.0, 0.0, 0.0],
        [turn**2, -2.0 * turn, 1.0, 0.0],
        [-(turn**3), 3.0 * turn**2, -3.0 * turn, 1.0],
    ]
    return from_turn @ np.array(shift), turn


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("order", [4, 6])
def test_of_any_curve(order: int, seed: int) -> None:
    """Positions up to a hundredth beside it."""
    rng = np.random.default_rng(seed)
    coef = rng.normal(size=(3, order)) * 10.0 ** rng.uniform(-1.0, 1.0, order)
    beside = rng.normal(size=(60, 3)) * 10.0 ** rng.uniform(-7.0, -2.0, (60, 1))
    at = points(coef, rng.uniform(0.0, 1.0, 60)) + beside
    found = distance(np.broadcast_to(coef, (60, 3, order)), at)
    assert found == pytest.approx([nearest(coef, p) for p in at], abs=1e-8)


@pytest.mark.parametrize("seed", range(12))
def test_of_a_curve_that_turns_back(seed: int) -> None:
    """Around the place the ways there and back lie side by side: the nearer one,
    to a nanometre.
    """
    rng = np.random.default_rng(seed)
    coef, turn = there_and_back(rng)
    beside = rng.normal(size=(60, 3)) * 10.0 ** rng.uniform(-7.0, -3.0, (60, 1))
    w = np.clip(turn + 0.01 * rng.normal(size=60), 0.0, 1.0)
    at = points(coef, w) + beside
    found = distance(np.broadcast_to(coef, (60, 3, 4)), at)
    assert found == pytest.approx([nearest(coef, p) for p in at], abs=1e-6)
