"""Numbers that are the same to the last bit on every processor.

numpy and its linear algebra choose their code by the processor: sums of products
may be fused or grouped in another way, and sine and power may be other functions.
Where a path follows from numbers, these functions take their place: sums in one
order, and sine and its like of ``c_ext/maths``.  Angles in rad.
``docs/explanation/reliability.md`` tells what this holds for.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cnc_core._engine import ffi, lib

from .units import FloatArray

SINGULAR = 1e-300


def sin(angle: float) -> float:
    """Of one angle."""
    return float(lib.plain_sin(angle))


def cos(angle: float) -> float:
    """Of one angle."""
    return float(lib.plain_cos(angle))


def tan(angle: float) -> float:
    """Of one angle."""
    return float(lib.plain_tan(angle))


def atan(slope: float) -> float:
    """-pi/2 to pi/2."""
    return float(lib.plain_atan(slope))


def atan2(y: float, x: float) -> float:
    """-pi to pi."""
    return float(lib.plain_atan2(y, x))


def asin(sine: float) -> float:
    """ValueError outside of -1 to 1, as ``math.asin``."""
    return float(lib.plain_asin(_share(sine)))


def acos(cosine: float) -> float:
    """ValueError outside of -1 to 1, as ``math.acos``."""
    return float(lib.plain_acos(_share(cosine)))


def _share(value: float) -> float:
    if abs(value) > 1.0:
        raise ValueError("math domain error")
    return value


def _each(call: Any, *given: Any) -> FloatArray:
    """A function of C over arrays that fit each other."""
    arrays = np.broadcast_arrays(*(np.asarray(g, np.float64) for g in given))
    out = np.empty(arrays[0].size)
    pointers = [ffi.from_buffer("double[]", a.ravel()) for a in arrays]
    call(*pointers, ffi.from_buffer("double[]", out), out.size)
    return out.reshape(arrays[0].shape)


def sines(angle: Any) -> FloatArray:
    """Of an array of any shape."""
    return _each(lib.plain_sin_all, angle)


def cosines(angle: Any) -> FloatArray:
    """Of an array of any shape."""
    return _each(lib.plain_cos_all, angle)


def arc_cosines(cosine: Any) -> FloatArray:
    """Of an array of any shape; nan outside of -1 to 1."""
    return _each(lib.plain_acos_all, cosine)


def cube_roots(value: Any) -> FloatArray:
    """Of an array of any shape."""
    return _each(lib.plain_cbrt_all, value)


def directions(y: Any, x: Any) -> FloatArray:
    """``atan2`` of arrays that fit each other."""
    return _each(lib.plain_atan2_all, y, x)


def powers(base: Any, exponents: Any) -> FloatArray:
    """``base ** exponents`` of exponents 0, 1, 2 .. by multiplication."""
    exponents = np.asarray(exponents)
    shape = np.broadcast_shapes(np.shape(base), exponents.shape)
    out = np.ones(shape)
    for k in range(1, int(exponents.max(initial=0)) + 1):
        out = np.where(exponents >= k, out * base, out)
    return out


def summed(how: str, a: Any, b: Any) -> FloatArray:
    """``numpy.einsum`` of two arrays, terms added in the order of their index.

    ``how``: as "nak,nk->na".
    """
    given, kept = how.split("->")
    letters = sorted(set(given) - set(kept) - {","}) + list(kept)
    parts = []
    for names, array in zip(given.split(","), (a, b), strict=True):
        there = [name for name in letters if name in names]
        part = np.transpose(array, [names.index(name) for name in there])
        sizes = iter(part.shape)
        parts.append(
            part.reshape([next(sizes) if n in names else 1 for n in letters])
        )
    out = parts[0] * parts[1]
    for _ in range(len(letters) - len(kept)):
        out = _in_order(out)
    return np.asarray(out)


def _in_order(terms: FloatArray) -> FloatArray:
    """The sum over the first axis."""
    out = np.zeros(terms.shape[1:])
    for term in terms:
        out = out + term
    return out


def product(a: Any, b: Any) -> FloatArray:
    """``a @ b`` of vectors, matrices and stacks of matrices."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    if b.ndim == 1:
        return np.asarray(_in_order(np.moveaxis(a * b, -1, 0)))
    if a.ndim == 1:
        return np.asarray(product(a[None], b)[..., 0, :])
    a = a.reshape((1,) * (b.ndim - a.ndim) + a.shape)
    b = b.reshape((1,) * (a.ndim - b.ndim) + b.shape)
    left = np.moveaxis(a[..., None], -2, 0)
    right = np.moveaxis(b[..., None, :], -3, 0)
    return _in_order(left * right)


def dot(a: Any, b: Any) -> float:
    """Of two vectors."""
    return float(product(a, b))


def length(vector: Any) -> float:
    """Of a vector."""
    return float(np.sqrt(dot(vector, vector)))


def solve(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """x of ``matrix @ x = right`` for stacks (n, size, size), (n, size, columns).

    Elimination with the largest pivot of the column.  LinAlgError: singular.
    """
    left, out = np.array(matrix), np.array(right)
    each, size = np.arange(len(left)), left.shape[-1]
    for k in range(size):
        pivot = k + np.abs(left[:, k:, k]).argmax(axis=1)
        for array in (left, out):
            row = array[each, pivot].copy()
            array[each, pivot] = array[:, k]
            array[:, k] = row
        if (np.abs(left[:, k, k]) < SINGULAR).any():
            raise np.linalg.LinAlgError("Singular matrix")
        factor = left[:, k + 1 :, k] / left[:, k, k, None]
        left[:, k + 1 :] -= factor[..., None] * left[:, None, k]
        out[:, k + 1 :] -= factor[..., None] * out[:, None, k]
    for k in range(size - 1, -1, -1):
        out[:, k] /= left[:, k, k, None]
        out[:, :k] -= left[:, :k, k, None] * out[:, None, k]
    return out
