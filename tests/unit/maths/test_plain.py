"""Functions of angles and powers that no library or processor decides."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import pytest
from cnc_core._engine import lib

from cnc_core import plain
from cnc_core.units import FloatArray
from determinism import PROCESSORS, hashes
from support.paths import ROOT

pytestmark = pytest.mark.sanitize("maths")

ULP = 0.51
COUNT = 4000
RNG = np.random.default_rng(5)
ANGLES = np.concatenate(
    [
        RNG.uniform(-10.0, 10.0, COUNT),
        RNG.uniform(-1e5, 1e5, COUNT),
        np.pi / 4 * np.arange(-40, 41),
        10.0 ** RNG.uniform(-30.0, -3.0, COUNT),
    ]
)
SHARES = np.concatenate(
    [
        RNG.uniform(-1.0, 1.0, COUNT),
        1.0 - 10.0 ** RNG.uniform(-16.0, -3.0, COUNT),
        [0.0, 1.0, -1.0],
    ]
)


def off(found: Any, wanted: Any) -> float:
    """The largest error in units of the last place."""
    near = np.asarray(wanted, np.float64)
    one = np.spacing(np.maximum(np.abs(near), 1e-300))
    return float((np.abs(np.longdouble(found) - wanted) / one).max())


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("sin", ANGLES),
        ("cos", ANGLES),
        ("tan", ANGLES),
        ("atan", ANGLES),
        ("asin", SHARES),
        ("acos", SHARES),
        ("exp", RNG.uniform(-40.0, 40.0, COUNT)),
        ("log", 10.0 ** RNG.uniform(-20.0, 20.0, COUNT)),
        ("log", RNG.uniform(0.9, 1.1, COUNT)),
    ],
)
def test_a_function_is_right_to_the_last_places(
    name: str, values: FloatArray
) -> None:
    """Against numbers of more digits; also beside zero and whole quarters."""
    longer = {"atan": "arctan", "asin": "arcsin", "acos": "arccos"}
    wanted = getattr(np, longer.get(name, name))(np.longdouble(values))
    call = getattr(lib, f"plain_{name}")
    assert off([call(float(value)) for value in values], wanted) < ULP


def test_directions_are_right_in_all_quarters() -> None:
    """Small and large sides too; on an axis whole quarters with the sign of y."""
    sides = RNG.uniform(-1.0, 1.0, (2, COUNT)) * 10.0 ** RNG.uniform(
        -300.0, 300.0, COUNT
    )
    wanted = np.arctan2(np.longdouble(sides[0]), np.longdouble(sides[1]))
    assert off(plain.directions(*sides), wanted) < ULP
    for y in (0.0, -0.0, 2.0, -2.0):
        for x in (0.0, -0.0, 2.0, -2.0):
            if not (x and y):
                found, right = plain.atan2(y, x), math.atan2(y, x)
                assert (found, math.copysign(1, found)) == (
                    right,
                    math.copysign(1, right),
                )


def test_what_has_no_value_is_told() -> None:
    """As ``math`` does; arrays say nan."""
    for call in (plain.asin, plain.acos):
        with pytest.raises(ValueError, match="domain"):
            call(1.5)
    assert np.isnan(plain.arc_cosines([1.5, math.nan])).all()
    assert math.isnan(plain.sin(math.inf))


def test_arrays_are_taken_in_any_shape() -> None:
    """Numbers, broadcast pairs, slices; each element as alone."""
    grid = RNG.uniform(-3.0, 3.0, (4, 6))[:, ::2]
    assert plain.sines(0.5).shape == ()
    alone = [[plain.sin(float(v)) for v in row] for row in grid]
    assert (plain.sines(grid) == alone).all()
    assert plain.directions(grid, grid[:1]).shape == grid.shape


@pytest.mark.parametrize(
    ("how", "shapes"),
    [
        ("nak,nk->na", ((5, 3, 6), (5, 6))),
        ("nak,kg->nga", ((5, 3, 6), (6, 4))),
        ("ki,mci->mck", ((4, 4), (5, 3, 4))),
        ("nak,k->na", ((5, 3, 6), (6,))),
    ],
)
def test_sums_of_products_are_those_of_einsum(how: str, shapes: Any) -> None:
    """To rounding."""
    a, b = (RNG.uniform(-1.0, 1.0, shape) for shape in shapes)
    assert np.allclose(
        plain.summed(how, a, b), np.einsum(how, a, b), atol=1e-14
    )


def test_linear_algebra_is_that_of_numpy() -> None:
    """Products of vectors, matrices and stacks; systems with a zero on the
    diagonal; a singular one is refused.
    """
    m = RNG.uniform(-1.0, 1.0, (5, 3, 3))
    v = RNG.uniform(-1.0, 1.0, (5, 3, 2))
    m[0, 0, 0] = 0.0
    assert np.allclose(plain.product(m, v), m @ v, atol=1e-14)
    assert np.allclose(plain.product(m[0], v[0, :, 0]), m[0] @ v[0, :, 0])
    assert np.allclose(plain.product(v[0, :, 0], m[0]), v[0, :, 0] @ m[0])
    assert np.allclose(plain.product(v[0, :, 0], m), v[0, :, 0] @ m)
    assert plain.dot([1.0, 2.0], [3.0, 4.0]) == 11.0
    assert plain.length([3.0, 4.0]) == 5.0
    assert np.allclose(plain.solve(m, v), np.linalg.solve(m, v))
    with pytest.raises(np.linalg.LinAlgError):
        plain.solve(np.zeros((1, 2, 2)), np.ones((1, 2, 1)))


def test_powers_begin_with_one() -> None:
    """Of zero too."""
    assert plain.powers(2.0, np.arange(4)).tolist() == [1, 2, 4, 8]
    table = plain.powers(np.array([0.0, 3.0])[:, None], np.arange(3))
    assert table.tolist() == [[1, 0, 0], [1, 3, 9]]


@pytest.mark.ci
@pytest.mark.parametrize("processor", PROCESSORS)
def test_other_processors_drive_the_same_bits(processor: str) -> None:
    """Libraries that are told of an older processor, against those that are not."""
    told = PROCESSORS[processor]
    assert hashes(sys.executable, ROOT) == hashes(sys.executable, ROOT, **told)
