"""Rotary axes that point the tool into a direction: both branches, their turns,
the nearest of them within the limits.

The direction of a chain with two rotary axes is A Rz(s1 q1) B Rz(s2 q2) c.
With g = transpose(A) d the third component of ``B Rz(t2) c`` must be g_z: P cos
t2 + Q sin t2 = w, two solutions; then t1 turns ``B Rz(t2) c`` onto g about Z.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cnc_core.units import FloatArray

from ..errors import ERRORS, CncError
from .chain import Chain

UNREACHABLE, BEYOND_LIMITS = 910101, 910102
# sine of the angle below which a tool lies on a rotary axis: that axis may
# stand anywhere
PARALLEL = 1e-9
# by which a direction may lie outside the reachable ones before it is refused
GRAZING = 1e-9


@dataclass(frozen=True)
class Branch:
    """Angles (degrees) of the rotary axes in the chain's order; ``free``: those
    that may stand anywhere (singular).
    """

    angles: tuple[float, ...]
    free: tuple[bool, ...]


def branches(
    chain: Chain, direction: Sequence[float] | FloatArray
) -> list[Branch]:
    """All ways to point the tool into ``direction`` (part frame, tip to
    spindle), each modulo 360 degrees.

    CncError 910101 if there is none, or the direction has no length.
    """
    d = np.asarray(direction, dtype=np.float64)
    norm = float(np.linalg.norm(d))
    if not (np.isfinite(norm) and norm > 1e-12):
        raise CncError(
            UNREACHABLE, f"{ERRORS[UNREACHABLE]}: the direction has no length"
        )
    a, b, c, joints = chain.orientation_form()
    g = a.T @ (d / norm)
    if not joints:
        return (
            [Branch((), ())]
            if float(np.linalg.norm(g - c)) < GRAZING * 10
            else _none(d)
        )
    if len(joints) == 1:
        return _one(g, c, joints[0][1], d)
    return _two(
        g,
        b,
        c,
        (
            joints[0][1],
            joints[1][1],
        ),
        d,
    )


def _none(d: FloatArray) -> list[Branch]:
    text = ", ".join(f"{float(v):g}" for v in d)
    raise CncError(UNREACHABLE, f"{ERRORS[UNREACHABLE]}: ({text})")


def _one(
    g: FloatArray, c: FloatArray, sign: float, d: FloatArray
) -> list[Branch]:
    if abs(float(g[2] - c[2])) > 1e-8:
        return _none(d)
    if float(np.hypot(c[0], c[1])) < PARALLEL:
        return [Branch((0.0,), (True,))]
    return [
        Branch(
            (sign * float(np.degrees(_angle(g) - _angle(c))),),
            (False,),
        )
    ]


def _two(
    g: FloatArray,
    b: FloatArray,
    c: FloatArray,
    signs: tuple[float, float],
    d: FloatArray,
) -> list[Branch]:
    p = b[2, 0] * c[0] + b[2, 1] * c[1]
    q = b[2, 1] * c[0] - b[2, 0] * c[1]
    wanted = float(g[2] - b[2, 2] * c[2])
    reach = float(np.hypot(p, q))
    if reach < PARALLEL:  # the second axis does not tilt the tool
        if abs(wanted) > 1e-8:
            return _none(d)
        seconds, free2 = [0.0], True
    else:
        if abs(wanted) > reach * (1.0 + GRAZING) + GRAZING:
            return _none(d)
        middle = float(np.arctan2(q, p))
        # exact where the two solutions meet: the sine from the rest, not from
        # the cosine alone
        half = float(
            np.arctan2(
                np.sqrt(max((reach - wanted) * (reach + wanted), 0.0)), wanted
            )
        )
        seconds = [middle + half, middle - half] if half > 0.0 else [middle]
        free2 = False
    found = []
    for second in seconds:
        cos, sin = np.cos(second), np.sin(second)
        h = b @ np.array(
            [
                c[0] * cos - c[1] * sin,
                c[0] * sin + c[1] * cos,
                c[2],
            ]
        )
        free1 = float(np.hypot(h[0], h[1])) < PARALLEL
        first = 0.0 if free1 else float(_angle(g) - _angle(h))
        angles = (
            signs[0] * float(np.degrees(first)),
            signs[1] * float(np.degrees(second)),
        )
        found.append(Branch(angles, (free1, free2)))
    return found


def nearest_turn(
    angle: float, near: float, low: float, high: float, turns: bool = True
) -> float | None:
    """Of ``angle`` + k 360 the one within low..high that is nearest to
    ``near``; None if there is none.
    """
    tolerance = 1e-9
    if not turns:
        return angle if low - tolerance <= angle <= high + tolerance else None
    best = angle + 360.0 * round((near - angle) / 360.0)
    if best < low - tolerance:
        best += 360.0 * np.ceil((low - tolerance - best) / 360.0)
    elif best > high + tolerance:
        best -= 360.0 * np.ceil((best - high - tolerance) / 360.0)
    best = float(best)
    return best if low - tolerance <= best <= high + tolerance else None


def nearest(
    chain: Chain,
    direction: Sequence[float] | FloatArray,
    near: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """(axes,) ``near`` with the rotary axes set to the nearest branch and turn
    within low..high, (axes,) each.

    Nearest: least largest motion of a rotary axis, then the least sum.  An axis
    that may stand anywhere stays. CncError 910101, 910102.
    """
    best: tuple[tuple[float, float], list[float]] | None = None
    for branch in branches(chain, direction):
        turned = []
        for axis, angle, free in zip(
            chain.rotary, branch.angles, branch.free, strict=True
        ):
            wanted = float(near[axis]) if free else angle
            found = nearest_turn(
                wanted,
                float(near[axis]),
                float(low[axis]),
                float(high[axis]),
                turns=not free,
            )
            turned.append(found)
        if any(t is None for t in turned):
            continue
        angles = [float(t) for t in turned if t is not None]
        moved = [
            abs(t - float(near[axis]))
            for t, axis in zip(angles, chain.rotary, strict=True)
        ]
        key = (round(max(moved, default=0.0), 9), sum(moved))
        if best is None or key < best[0]:
            best = (key, angles)
    if best is None:
        raise CncError(BEYOND_LIMITS, ERRORS[BEYOND_LIMITS])
    out = near.copy()
    out[list(chain.rotary)] = best[1]
    return out


def _angle(direction: FloatArray) -> float:
    """About the third axis, rad."""
    return float(np.arctan2(direction[1], direction[0]))
