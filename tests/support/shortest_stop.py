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


def begin_of_stop(q: FloatArray, dt: float, jerk: FloatArray) -> FloatArray:
    """What the motion before the stop adds to the first two third differences
    of its samples, over the limits (2, axes).

    The third differences see the jerk of three intervals, by 1/6, 2/3 and 1/6:
    the stop has only the last one of the first, and the last two of the second.
    The jerk of those is taken to be that of the third difference behind them.
    ``q``: the motion that goes on, from the same first sample (6 or more, axes).
    """
    on = np.diff(q, n=3, axis=0) / (jerk * dt**3)
    return np.stack([on[0] - on[2] / 6, on[1] - on[2] * 5 / 6])


def shortest_by_programs(
    path: Path,
    s: FloatArray,
    dt: float,
    acc: FloatArray,
    jerk: FloatArray,
    goes_on: FloatArray | None = None,
) -> float:
    """Where the shortest legal stop ends that successive linear programs find
    from the driven samples s.

    The first three are given, the last three stand; differences keep to the
    limits of the axes (acceleration, jerk).  Axes without a limit are left out.
    ``goes_on``: samples without a stop, from the same first one; with them the
    stop begins at the third sample, else it may begin 1.5 dt before it.
    """
    n, s, best = len(s), s.copy(), np.inf
    step, stand = differences(n, 1), differences(n, 1)[-2:]
    middle, room = np.zeros((n - 3, len(acc))), np.ones(n - 3)
    if goes_on is not None:
        middle[:2] = begin_of_stop(path.at(goes_on), dt, jerk)
        room[:2] = 1 / 6, 5 / 6
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
                if order == 3:
                    value = value - middle[:, i]
                most = room if order == 3 else 1.0
                rows += [slope, -slope]
                bounds += [most - value, most + value]
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
        third = np.diff(q, n=3, axis=0) / (jerk * dt**3)
        most_jerk = (np.abs(third - 1.006 * middle) / room[:, None]).max()
        if max(most_acc, most_jerk) < 1.012:
            best = min(best, float(s[-1]))
    return best
