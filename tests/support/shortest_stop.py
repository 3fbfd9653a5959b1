"""The shortest stop on a path, by linear programs in time: an oracle for holds."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_matrix

from .drive import FloatArray


class Path(Protocol):
    """Positions and derivatives of the axes by the way s (n,), mm."""

    def at(self, s: FloatArray) -> FloatArray:
        """Positions (n, axes)."""
        ...

    def derivatives(
        self, s: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The first, second and third ones (n, axes)."""
        ...


def differences(n: int, order: int) -> csr_matrix:
    """Finite differences (n - order, n)."""
    return csr_matrix(np.diff(np.eye(n), order, axis=0))


def shortest_by_programs(
    path: Path, s: FloatArray, dt: float, acc: FloatArray, jerk: FloatArray
) -> float:
    """Where the shortest legal stop ends that successive linear programs find
    from the driven samples s.

    The first three are given, the last three stand; differences keep to the
    limits of the axes (acceleration, jerk).  Axes without a limit are left out.
    """
    n, s, best = len(s), s.copy(), np.inf
    step, stand = differences(n, 1), differences(n, 1)[-2:]
    for k in range(14):
        q, d1 = path.at(s), path.derivatives(s)[0]
        rows, bounds = [-step], [np.diff(s)]
        for i in range(len(acc)):
            for order, limit in ((2, acc[i]), (3, jerk[i])):
                d = differences(n, order)[3 - order :] / (
                    1.006 * limit * dt**order
                )
                slope, value = (
                    d @ csr_matrix((d1[:, i], (range(n), range(n)))),
                    d @ q[:, i],
                )
                rows += [slope, -slope]
                bounds += [1.0 - value, 1.0 + value]
        fixed = [(0.0, 0.0)] * 3 + [(-2.0 * 0.6**k, 2.0 * 0.6**k)] * (n - 3)
        found = linprog(
            np.eye(n)[-1],
            A_ub=csr_matrix(np.vstack([r.toarray() for r in rows])),
            b_ub=np.concatenate(bounds),
            A_eq=stand,
            b_eq=-np.diff(s)[-2:],
            bounds=fixed,
        )
        if found.status != 0:
            break
        s = s + found.x
        q = path.at(s)
        most_acc = np.abs(np.diff(q, n=2, axis=0)[1:] / (acc * dt**2)).max()
        most_jerk = np.abs(np.diff(q, n=3, axis=0) / (jerk * dt**3)).max()
        if max(most_acc, most_jerk) < 1.012:
            best = min(best, float(s[-1]))
    return best
