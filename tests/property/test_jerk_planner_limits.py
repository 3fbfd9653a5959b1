"""Seeded properties of the planners by path: sampled limits, ends, holds,
overrides, tails, determinism.

Whatever is driven is judged from outside: positions at the cycle, their finite
differences, the path from its formula.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from cnc_core.benchmarks.jerk_paths import (
    Chain,
    Knots,
    random_chain,
    random_waves,
)
from cnc_core.engine.jerk_planner import (
    STAND,
    FloatArray,
    JerkPlanner,
    Limits,
    Topp2,
    sample,
)
from support.seeds import few

pytestmark = pytest.mark.sanitize("jerk")

DT = 0.001
Rows = npt.NDArray[Any]


class Case:
    """A random path with random limits, window and feed, all from one seed."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.window = int(self.rng.choice([30, 60, 120, 190]))
        self.feed, axes = float(self.rng.uniform(5, 300)), 3
        self.path: Knots | Chain
        if seed % 3 == 0:
            axes = int(self.rng.choice([2, 3, 6]))
            self.path = random_waves(
                self.rng, axes, float(self.rng.uniform(0.05, 0.4))
            )
            self.rows = self.path.intervals(self.feed)
        else:
            self.path = random_chain(self.rng, self.feed, seed % 3 == 1)
            self.rows = self.path.intervals()
        a = self.rng.uniform(500, 6000, axes)
        limits = (
            self.rng.uniform(50, 500, axes),
            a,
            a * self.rng.uniform(8, 60),
        )
        self.limits = Limits(*(x.tolist() for x in limits))

    def planner(self) -> JerkPlanner:
        return JerkPlanner(self.limits, window=self.window)

    def ratios(self, laws: Rows) -> FloatArray:
        """Largest sampled velocity, acceleration and jerk over their limits,
        the axes at rest before and after.
        """
        s = sample(laws, DT)[:, 0]
        q = self.path.at(np.append(s, self.path.length))
        q = np.vstack([q[:1]] * 3 + [q] + [q[-1:]] * 3)
        limits = (self.limits.v, self.limits.a, self.limits.j)
        return np.array(
            [
                (np.abs(np.diff(q, n=n, axis=0)) / DT**n / np.array(x)).max()
                for n, x in enumerate(limits, 1)
            ]
        )


class Operator:
    """Feeds the path in random portions and disturbs: override steps, holds,
    the planner late (tail driven).
    """

    def __init__(self, case: Case, planner: JerkPlanner | Topp2) -> None:
        self.case, self.planner, self.rng = case, planner, case.rng
        self.done, self.held, self.laws = 0, False, list[Rows]()

    def feed(self) -> None:
        rows = self.case.rows
        if self.done < len(rows):
            self.done += self.planner.push(
                rows[self.done : self.done + int(self.rng.integers(1, 60))]
            )
            if self.done == len(rows) and isinstance(self.planner, JerkPlanner):
                self.planner.finish()

    def disturb(self) -> None:
        what = self.rng.random()
        if what < 0.4:
            self.planner.override(
                float(self.rng.choice([0, 0.1, 0.3, 0.5, 0.8, 1.0, 1.5, 2.0]))
            )
        elif what < 0.8 or isinstance(self.planner, Topp2):
            self.held = not self.held
            self.planner.hold(self.held)
        else:
            self.laws.append(self.planner.tail())
            self.planner.tail_driven()

    def drive(self, disturbed: bool) -> Rows:
        idle = 0
        while idle < 8:
            self.feed()
            if disturbed and self.rng.random() < 0.02:
                self.disturb()
            got = self.planner.take(float(self.rng.uniform(0.001, 0.03)))
            self.laws.append(got)
            idle = 0 if len(got) else idle + (self.done == len(self.case.rows))
            if idle == 4:  # nothing moves any more: let go
                disturbed = False
                self.planner.override(1.0)
                self.planner.hold(False)
        return np.concatenate(self.laws)


@pytest.mark.parametrize("seed", few(range(36), 18))
def test_limits_hold_whatever_the_operator_does(seed: int) -> None:
    """Sampled v, a, j stay within 1.02 of the limits, the path is driven to its
    very end, no time is unbounded.
    """
    case = Case(seed)
    laws = Operator(case, case.planner()).drive(disturbed=seed % 5 > 1)
    assert np.isfinite(laws["time"]).all()
    assert (laws["time"] > 0).all()
    assert laws["length"].sum() == pytest.approx(case.path.length, abs=1e-6)
    assert case.ratios(laws).max() <= 1.02


@pytest.mark.ci
@pytest.mark.parametrize("seed", range(0, 36, 4))
def test_laws_join(seed: int) -> None:
    """Speed and acceleration are continuous from law to law: nothing but the jerk steps."""
    case = Case(seed)
    laws = Operator(case, case.planner()).drive(disturbed=True)
    end = sample_ends(laws)
    at_rest = (laws["flags"][:-1] & STAND) > 0
    assert np.abs(end[:-1, 1] - laws["v0"][1:]).max() <= 1e-6 * max(
        1.0, laws["v0"].max()
    )
    assert np.abs(end[:-1, 2] - laws["a0"][1:])[~at_rest].max(
        initial=0.0
    ) <= 1e-5 * max(1.0, np.abs(laws["a0"]).max())
    assert np.abs(end[:, 0] - laws["s0"] - laws["length"]).max() <= 1e-9 * max(
        1.0, case.path.length
    )


def sample_ends(laws: Rows) -> FloatArray:
    """(s, v, a) at the end of each law, (n, 3), as numpy evaluates its
    polynomial, apart from the C evaluation.
    """
    out = np.zeros((len(laws), 3))
    for i, law in enumerate(laws):
        derivatives = [
            law[name]
            for name in ("s0", "v0", "a0", "jerk", "snap", "crackle", "pop")
        ]
        s = np.polynomial.Polynomial(
            np.array(derivatives) / [1, 1, 2, 6, 24, 120, 720]
        )
        out[i] = [
            s.deriv(k)(law["time"]) if k else s(law["time"]) for k in range(3)
        ]
    return out


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_same_bits(seed: int) -> None:
    """The same input gives the same laws, bit for bit."""
    first, second = (
        Operator(case, case.planner()).drive(disturbed=True)
        for case in (Case(seed), Case(seed))
    )
    assert first.tobytes() == second.tobytes()


@pytest.mark.parametrize("seed", few(range(24), 12))
def test_acceleration_limited(seed: int) -> None:
    """The acceleration-limited sibling keeps v and a within 1.02 through holds
    and overrides, and drives to the end.
    """
    case = Case(seed)
    case.rows["flags"][-1] |= STAND
    laws = Operator(
        case, Topp2(case.limits, window=case.window, capacity=8192)
    ).drive(disturbed=seed % 4 > 0)
    assert laws["length"].sum() == pytest.approx(case.path.length, abs=1e-6)
    assert case.ratios(laws)[:2].max() <= 1.02
    end = laws["v0"] + laws["a0"] * laws["time"]
    assert np.abs(end[:-1] - laws["v0"][1:]).max(initial=0.0) <= 1e-6 * 300
