"""Stage 5 and 6 of the Path Optimizer: sections of a path joined, at edges by a
piece that rounds the corner.

HSM specification 11: neighbours without a transition are one curve already.
At G63 both curves are cut.  A quintic leads from one to the other, C2, within
the tolerances.  At G66 and G67 the curves meet in their corner.
"""

from __future__ import annotations

import numpy as np

from cnc_core.units import FloatArray

from ..blocks.profile_columns import BLEND, SMOOTH, STOP
from ..geometry.profiles import spline
from ..geometry.profiles.blend import evaluated, shifted
from .types import Fit, FitReport, Tolerances

USED = 0.97  # share of the tolerance that a piece uses
SHARP = np.radians(0.5)
JOIN_TRIES = 24
JUMP = 1e-7
MOST = 0.45  # of a section that a piece may take
SAMPLES = 65
# length of a piece over its reach: found by planning corners of 35 to 150 degrees
HANDLE = 2.2


def join_sections(
    parts: list[Fit],
    linear: list[int],
    versor: list[int],
    tolerances: Tolerances,
    report: FitReport,
) -> Fit:
    """One row of polynomials; where a section ends in 63 a joining piece rounds
    its corner.
    """
    out: list[Fit] = []
    for part in parts:
        if out and out[-1].after[-1] == BLEND:
            _round(out, part, linear, versor, tolerances, report)
        out.append(part)
    coef = np.concatenate([p.coef for p in out])
    span = np.concatenate([p.span for p in out])
    return Fit(
        coef,
        span,
        np.concatenate([p.first for p in out]),
        np.concatenate([p.after for p in out]),
    )


def _round(
    out: list[Fit],
    behind: Fit,
    linear: list[int],
    versor: list[int],
    tolerances: Tolerances,
    report: FitReport,
) -> None:
    """Cut both curves at Racc |sin| of the turn, or nearer so that no point is
    left by more than the tolerances.
    """
    ahead = out[-1]
    end = float(ahead.span.sum())
    before = evaluated(ahead.coef[-1], float(ahead.span[-1]))
    after = evaluated(behind.coef[0], 0.0)
    turn = _angle(before[1][linear], after[1][linear])
    ahead.after[-1] = SMOOTH
    if turn > np.radians(179.0):
        ahead.after[-1] = STOP
        return
    jump = np.abs(before[1] - after[1])
    if turn < SHARP and jump.max() < SHARP:
        return
    reach = _reach(
        before[1], after[1], turn, ahead.kind, versor, linear, tolerances
    )
    reach = min(reach, _farthest(max(turn, SHARP), USED * tolerances.linear))
    reach = min(reach, MOST * end, MOST * float(behind.span.sum()))
    limits = np.full(ahead.coef.shape[1], tolerances.other)
    limits[versor], limits[linear] = tolerances.versor, tolerances.linear
    limits[np.abs(before[0] - after[0]) > JUMP] = (
        np.inf
    )  # an axis that jumps there
    for _ in range(JOIN_TRIES):
        left = _polynomial(ahead, end - reach)
        right = _polynomial(behind, reach)
        states = (
            evaluated(ahead.coef[left[0]], left[1]),
            evaluated(behind.coef[right[0]], right[1]),
        )
        coef, size = _joining(*states, linear, HANDLE * reach)
        points = np.vstack(
            [
                ahead.points[ahead.at > end - reach],
                behind.points[behind.at < reach],
            ]
        )
        deviation, others = _miss(coef, points, linear, limits)
        if deviation <= tolerances.linear and others <= 1.0:
            break
        reach *= 0.8
    _cut_end(ahead, *left)
    _cut_begin(behind, *right)
    scaled = coef / size ** np.arange(6)
    report.deviation = max(report.deviation, deviation)
    report.joints += 1
    out.append(
        Fit(
            scaled[None],
            np.array([size]),
            behind.first[:1],
            np.array([SMOOTH]),
        )
    )


def _farthest(turn: float, deviation: float) -> float:
    """Distance from the corner at which the piece begins on straight lines: its
    middle is ``deviation`` off.
    """
    return float(
        16.0 * deviation / ((16.0 - 5.0 * HANDLE) * np.sin(turn / 2.0))
    )


def _joining(
    start: FloatArray, end: FloatArray, linear: list[int], length: float
) -> tuple[FloatArray, float]:
    """(columns, 6) quintic over 0..1 and the parameter's length: C2 in the
    parameter, in which the polynomials are driven.  A jump of |P'| would be a
    stop.
    """
    rate = 0.5 * sum(
        float(np.linalg.norm(state[1][linear])) for state in (start, end)
    )
    size = length / max(rate, 1e-300)
    coef = spline.quintic(
        start[:1],
        end[:1],
        start[None, 1:],
        end[None, 1:],
        np.array([size]),
    )[0]
    return np.asarray(coef * size ** np.arange(6)), size


def _reach(
    a: FloatArray,
    b: FloatArray,
    turn: float,
    kind: str,
    versor: list[int],
    linear: list[int],
    tolerances: Tolerances,
) -> float:
    """How far from the edge the piece may begin: Racc, and RaccX, RaccV where
    what they are of has an edge as well.

    At an edge of directions alone their turn is not that of the path: all of
    RaccV may be used.
    """
    if kind == "versor":
        return tolerances.reach_versor
    found = [tolerances.reach]
    jumps = np.abs(a - b) > SHARP
    others = [i for i in range(len(a)) if i not in linear and i not in versor]
    found += [tolerances.reach_other] if jumps[others].any() else []
    found += [tolerances.reach_versor] if jumps[versor].any() else []
    return min(found) * float(np.sin(turn))


def _polynomial(fit: Fit, at: float) -> tuple[int, float]:
    """Number of the polynomial at a parameter of the whole row, and the
    parameter in it.
    """
    begins = np.concatenate(
        [
            [0.0],
            np.cumsum(fit.span)[:-1],
        ]
    )
    k = int(
        np.clip(
            np.searchsorted(begins, at, side="right") - 1, 0, len(begins) - 1
        )
    )
    return k, float(
        np.clip(
            at - begins[k],
            0.0,
            fit.span[k],
        )
    )


def _cut_end(fit: Fit, k: int, u: float) -> None:
    """The row ends in polynomial ``k`` at ``u``."""
    last = fit.after[-1]
    fit.coef = fit.coef[: k + 1]
    fit.span = fit.span[: k + 1]
    fit.first = fit.first[: k + 1]
    fit.after = fit.after[: k + 1]
    fit.span[-1] = u
    fit.after[-1] = last


def _cut_begin(fit: Fit, k: int, u: float) -> None:
    """The row begins in polynomial ``k`` at ``u``."""
    gone = float(fit.span[:k].sum()) + u
    fit.coef = fit.coef[k:]
    fit.span = fit.span[k:]
    fit.first = fit.first[k:]
    fit.after = fit.after[k:]
    fit.coef[0] = shifted(fit.coef[0], u)
    fit.span[0] = fit.span[0] - u
    fit.at = fit.at - gone


def _angle(x: FloatArray, y: FloatArray) -> float:
    return float(
        np.arctan2(
            np.linalg.norm(np.cross(x, y)),
            x @ y,
        )
    )


def _miss(
    coef: FloatArray, points: FloatArray, linear: list[int], limits: FloatArray
) -> tuple[float, float]:
    """How far the piece passes the points that it replaces: mm, and other
    columns in their limits.
    """
    made = np.einsum(
        "ck,kg->gc",
        coef,
        np.linspace(0.0, 1.0, SAMPLES) ** np.arange(6)[:, None],
    )
    chord = np.diff(made[:, linear], axis=0)
    away = points[:, None, linear] - made[None, :-1, linear]
    along = (away * chord).sum(axis=2) / np.maximum(
        (chord * chord).sum(axis=1), 1e-300
    )
    far = np.linalg.norm(
        away - np.clip(along, 0.0, 1.0)[:, :, None] * chord, axis=2
    ).min(axis=1)
    others = [i for i in range(points.shape[1]) if i not in linear]
    share = np.abs(
        points[:, None, others] - made[None, :, others],
    ).min(axis=1) / np.maximum(limits[others], 1e-12)
    return float(far.max(initial=0.0)), float(share.max(initial=0.0))
