"""Versors and tool of a profile: from programmed points to tool tips, tool
directions and axis angles.

Sources: specification 5.2 (versors), 5.3 (compensation), 5.4 (tangential axis),
10.4 (rotary axes from directions)::

    CLP = CCP + r n + (R - r) q - r d        AXI = CLP + L d

Everything is computed with exact derivatives, because what comes out is joined
to quintics (``to_axes``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from cnc_core.blocks.profile_columns import ProfileSpec
from cnc_core.kinematics.machine import Kinematics
from cnc_core.units import FloatArray

from . import jets

PARALLEL = 1e-9
SHORTEST = 1e-9  # versor that has a direction
# share of a direction's change that tells where it goes at a singular pose
NUDGE = 1e-6


class NoVersor(Exception):  # noqa: N818 - a reason, the stage makes the error
    """A programmed versor has no length somewhere.  ``at``: which point."""

    def __init__(self, at: int) -> None:
        super().__init__(str(at))
        self.at = at


class NoNormal(Exception):  # noqa: N818 - a reason, the stage makes the error
    """The path runs along the tool: there is no normal, and none before it.
    ``at``: which point.
    """

    def __init__(self, at: int) -> None:
        super().__init__(str(at))
        self.at = at


def filled(
    values: FloatArray, good: npt.NDArray[np.bool_], before: FloatArray | None
) -> FloatArray:
    """Jets whose bad entries take the value of the good one before them,
    standing still; NoNormal if there is none.
    """
    if good.all():
        return values
    at = np.maximum.accumulate(
        np.where(
            good,
            np.arange(len(good)),
            -1,
        )
    )
    out = values[np.maximum(at, 0)].copy()
    out[~good, 1:] = 0.0
    missing = at < 0
    if missing.any():
        if before is None:
            later = np.flatnonzero(good)
            if not len(later):
                raise NoNormal(0)
            before = values[later[0], 0]
        out[missing, 0] = before
    return out


@dataclass(frozen=True)
class LastVersors:
    """Normal (3,) and heading (1,), degrees, of the point before, if any."""

    normal: FloatArray | None = None
    heading: FloatArray | None = None


class Versors:
    """Directions along a profile, point after point.

    ``kinematics``: of a machine with rotary axes in its chain.
    """

    def __init__(
        self, spec: ProfileSpec, kinematics: Kinematics | None
    ) -> None:
        self.spec, self.kinematics = spec, kinematics
        self._linear = list(spec.linear)
        self.last = LastVersors()

    def columns(
        self, coef: FloatArray, u: FloatArray, group: str
    ) -> FloatArray | None:
        """A programmed versor, normalised where it is evaluated."""
        part = self.spec.versor_columns(group)
        if part is None:
            return None
        found = jets.of_columns(coef[:, part], u)
        short = np.linalg.norm(found[:, 0], axis=1) < SHORTEST
        if short.any():
            raise NoVersor(int(short.argmax()))
        return jets.unit(found)

    def tangent(self, coef: FloatArray, u: FloatArray) -> FloatArray:
        """Unit tangent of the programmed curve; where it stands, along its
        second derivative.
        """
        slope = jets.of_columns(coef[:, self._linear], u, 1)
        rest = np.linalg.norm(slope[:, 0], axis=1) < 1e-12
        if rest.any():
            slope[rest, 0] = slope[rest, 1]
            slope[rest, 1:] = 0.0
            slope[
                rest
                & (
                    np.linalg.norm(
                        slope[:, 0],
                        axis=1,
                    )
                    < 1e-12
                ),
                0,
            ] = (
                1.0,
                0.0,
                0.0,
            )
        return jets.unit(slope)

    def direction(
        self, coef: FloatArray, u: FloatArray, axes: FloatArray | None
    ) -> FloatArray:
        """d: TOD, programmed, or from the rotary axes ``axes`` (n, 3, channel axes)."""
        if not self.spec.five_axes:
            return jets.still(np.array(self.spec.tool.direction), len(u))
        programmed = self.columns(coef, u, "ijk")
        if programmed is not None:
            return self._turned(coef, u, programmed)
        assert self.kinematics is not None
        assert axes is not None
        return np.asarray(self.kinematics.chain.forward_jets(axes, 0.0)[1])

    def _turned(
        self, coef: FloatArray, u: FloatArray, d: FloatArray
    ) -> FloatArray:
        """A tangential axis of the chain: ijk counts along the motion, to its
        left, upwards.
        """
        column = self.spec.tangential
        if column is None or not self.spec.axes[column].kinematic:
            return d
        angle = np.radians(self.following(coef, u, column))
        cos = np.cos(angle[:, 0])
        sin = np.sin(angle[:, 0])
        c = np.stack(
            [
                cos,
                -sin * angle[:, 1],
                -cos * angle[:, 1] ** 2 - sin * angle[:, 2],
            ],
            axis=1,
        )
        s = np.stack(
            [
                sin,
                cos * angle[:, 1],
                -sin * angle[:, 1] ** 2 + cos * angle[:, 2],
            ],
            axis=1,
        )
        dx, dy = d[:, :, 0], d[:, :, 1]
        x = jets.times(c, dx) - jets.times(s, dy)
        y = jets.times(s, dx) + jets.times(c, dy)
        return np.stack([x, y, d[:, :, 2]], axis=2)

    def normal(
        self, coef: FloatArray, u: FloatArray, d: FloatArray
    ) -> FloatArray:
        """n: programmed, or at the contact angle from d, turned about the tangent."""
        programmed = self.columns(coef, u, "mno")
        if programmed is not None:
            return programmed
        t = self.tangent(coef, u)
        dp = d - jets.times(jets.dot(d, t), t)
        square = jets.dot(dp, dp)
        good = square[:, 0] > PARALLEL**2
        square[~good] = (1.0, 0.0, 0.0)
        c = jets.power(square, 0.5)
        e1 = jets.times(jets.power(square, -0.5), dp)
        alpha = np.radians(self.spec.tool.contact_deg)
        cos_beta = np.cos(alpha) * jets.power(c, -1.0)
        clipped = np.abs(cos_beta[:, 0]) >= 1.0 - 1e-12
        cos_beta[clipped] = np.stack(
            [
                np.sign(cos_beta[clipped, 0]),
                0 * u[clipped],
                0 * u[clipped],
            ],
            axis=1,
        )
        sin2 = -jets.times(cos_beta, cos_beta)
        sin2[:, 0] += 1.0
        sin2[clipped] = (1.0, 0.0, 0.0)
        sin_beta = np.sign(alpha) * jets.power(sin2, 0.5)
        sin_beta[clipped] = 0.0
        made = jets.times(cos_beta, e1) + jets.times(
            sin_beta, jets.cross(t, e1)
        )
        out = filled(made, good, self.last.normal)
        self.last = replace(self.last, normal=out[-1, 0].copy())
        return out

    def radius_direction(
        self,
        coef: FloatArray,
        u: FloatArray,
        d: FloatArray,
        n: FloatArray,
        forward: npt.NDArray[np.bool_] | None = None,
    ) -> FloatArray:
        """q: programmed, or in the plane of d and n, across d; nothing where n
        lies along d and stays there.

        Where n only passes d, q is what it is just behind (``forward``) or just
        before that point.
        """
        programmed = self.columns(coef, u, "pqd")
        if programmed is not None:
            return programmed
        across = n - jets.times(jets.dot(n, d), d)
        square = jets.dot(across, across)
        flat = square[:, 0] < 1e-14
        square[flat] = (1.0, 0.0, 0.0)
        out = jets.times(jets.power(square, -0.5), across)
        out[flat] = 0.0
        rate = np.linalg.norm(across[:, 1], axis=1)
        passing = flat & (rate > 1e-9)
        if passing.any():
            sign = np.where(
                np.ones(len(u), np.bool_) if forward is None else forward,
                1.0,
                -1.0,
            )[passing, None]
            first = across[passing, 1] / rate[passing, None]
            bend = 0.5 * across[passing, 2] / rate[passing, None]
            out[passing, 0] = sign * first
            out[passing, 1] = sign * (
                bend - (bend * first).sum(axis=1)[:, None] * first
            )
        return out

    def tip(
        self,
        coef: FloatArray,
        u: FloatArray,
        d: FloatArray,
        forward: npt.NDArray[np.bool_] | None = None,
    ) -> FloatArray:
        """The tool's tip: contact points are compensated, others are the tip
        already.
        """
        point = jets.of_columns(coef[:, self._linear], u)
        if self.spec.point != "CCP":
            return point
        tool = self.spec.tool
        n = self.normal(coef, u, d)
        q = self.radius_direction(coef, u, d, n, forward)
        edge = tool.edge_radius
        down = 0.0 if tool.centre else edge
        return np.asarray(
            point + edge * n + (tool.radius - edge) * q - down * d
        )

    def following(
        self, coef: FloatArray, u: FloatArray, column: int
    ) -> FloatArray:
        """Angle of the tangential axis, degrees, the value continuous but for
        whole turns: (n, 3).
        """
        axis = self.spec.axes[column]
        slope = jets.of_columns(coef[:, self._linear[:2]], u, 1)
        good = np.linalg.norm(
            slope[:, 0],
            axis=1,
        ) > 1e-9 * np.maximum(np.linalg.norm(slope[:, 1], axis=1), 1.0)
        slope[~good] = ((1.0, 0.0), (0.0, 0.0), (0.0, 0.0))
        heading = np.degrees(
            jets.angle(
                slope[:, :, 0],
                slope[:, :, 1],
            )
        )
        if not good.all():
            before = (
                np.zeros(1) if self.last.heading is None else self.last.heading
            )
            heading = filled(heading[:, :, None], good, before)[:, :, 0]
        self.last = replace(self.last, heading=heading[-1, :1].copy())
        offset = jets.of_columns(
            coef[:, column : column + 1],
            u,
        )[:, :, 0]
        return np.asarray(
            offset + heading if axis.role == "TAN" else offset - heading
        )


class Rotaries:
    """Angles of two rotary axes that point the tool into directions, near where
    they stand.
    """

    def __init__(self, kinematics: Kinematics, near: FloatArray) -> None:
        self._chain = kinematics.chain
        self.axes = list(kinematics.chain.rotary)
        self._low = kinematics.low[self.axes]
        self._high = kinematics.high[self.axes]
        self.near = near[self.axes].copy()

    def angles(
        self, d: FloatArray, forward: npt.NDArray[np.bool_]
    ) -> FloatArray:
        """(n, 3, 2) jets of the angles, degrees, of direction jets (n, 3, 3),
        each nearest to the one before.

        ``forward``: where a tool stands along a rotary axis, that axis is
        turned for the way ahead, not the way behind. ValueError with the number
        of the first direction that cannot be reached.
        """
        found, free = self._branches(self._leaned(d, forward))
        value = np.empty((len(d), 2))
        last = self.near
        for i in range(len(d)):
            best = self._nearest(found[i], free[i], last)
            if best is None:
                raise ValueError(i)
            value[i] = last = best
        self.near = last
        return self._with_derivatives(value, d)

    def _leaned(
        self, d: FloatArray, forward: npt.NDArray[np.bool_]
    ) -> FloatArray:
        """Directions; at singular poses a little ahead or behind on their way."""
        _, free = self._branches(d[:, 0])
        out = d[:, 0].copy()
        singular = free.any(axis=1)
        sign = np.where(forward, 1.0, -1.0)[:, None]
        rate = np.linalg.norm(d[:, 1], axis=1)[:, None]
        divisor = np.where(rate > 1e-9, rate, np.inf)
        lean = sign * d[:, 1] / divisor * NUDGE
        out[singular] += lean[singular]
        return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])

    def _branches(
        self, d: FloatArray
    ) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
        """(n, 2 branches, 2) angles, NaN where there is none, and (n, 2) which
        axis may stand anywhere.

        The direction is A Rz(s1 q1) B Rz(s2 q2) c, see
        ``cnc_core.kinematics.inverse``.
        """
        a, b, c, joints = self._chain.orientation_form()
        signs = np.array([sign for _, sign in joints])
        g = d @ a
        p = b[2, 0] * c[0] + b[2, 1] * c[1]
        q = b[2, 1] * c[0] - b[2, 0] * c[1]
        wanted = g[:, 2] - b[2, 2] * c[2]
        reach = float(np.hypot(p, q))
        beyond = np.abs(wanted) > reach * (1.0 + 1e-9) + 1e-9
        half = np.arctan2(
            np.sqrt(np.maximum((reach - wanted) * (reach + wanted), 0.0)),
            wanted,
        )
        middle = np.arctan2(q, p)
        out = np.empty((len(d), 2, 2))
        free = np.zeros((len(d), 2), np.bool_)
        for k, second in enumerate((middle + half, middle - half)):
            cos, sin = np.cos(second), np.sin(second)
            h = (
                np.stack(
                    [
                        c[0] * cos - c[1] * sin,
                        c[0] * sin + c[1] * cos,
                        np.full(len(d), c[2]),
                    ],
                    axis=1,
                )
                @ b.T
            )
            free[:, 0] |= (
                np.hypot(
                    h[:, 0],
                    h[:, 1],
                )
                < PARALLEL
            )
            wanted = np.arctan2(g[:, 1], g[:, 0])
            first = wanted - np.arctan2(h[:, 1], h[:, 0])
            out[:, k, 0] = signs[0] * np.degrees(first)
            out[:, k, 1] = signs[1] * np.degrees(second)
        out[beyond] = np.nan
        return out, free

    def _nearest(
        self, found: FloatArray, free: npt.NDArray[np.bool_], near: FloatArray
    ) -> FloatArray | None:
        best, least = None, np.inf
        for branch in found:
            if np.isnan(branch[0]):
                continue
            angles = branch.copy()
            if free[0]:
                angles[0] = near[0]
            angles += 360.0 * np.round((near - angles) / 360.0)
            angles += 360.0 * np.ceil(
                np.maximum(self._low - 1e-9 - angles, 0.0) / 360.0
            )
            angles -= 360.0 * np.ceil(
                np.maximum(angles - self._high - 1e-9, 0.0) / 360.0
            )
            if (angles < self._low - 1e-9).any() or (
                angles > self._high + 1e-9
            ).any():
                continue
            far = np.abs(angles - near)
            key = float(far.max() + 1e-6 * far.sum())
            if key < least:
                best, least = angles, key
        return best

    def _with_derivatives(self, value: FloatArray, d: FloatArray) -> FloatArray:
        """Implicit differentiation of direction(angles) = d; at singular poses
        the least motion.
        """
        n = len(value)
        count = 1 + max([*self._chain.linear, *self._chain.rotary])
        out = np.zeros((n, 3, 2))
        out[:, 0] = value
        q = np.zeros((n, 3, count))
        q[:, 0, self.axes] = value
        slopes = []
        for axis in self.axes:
            q[:, 1] = 0.0
            q[:, 1, axis] = 1.0
            slopes.append(self._chain.forward_jets(q, 0.0)[1][:, 1])
        inverse = np.linalg.pinv(np.stack(slopes, axis=2), rcond=1e-7)
        out[:, 1] = np.einsum("nij,nj->ni", inverse, d[:, 1])
        q[:, 1] = 0.0
        q[:, 1, self.axes] = out[:, 1]
        bend = self._chain.forward_jets(q, 0.0)[1][:, 2]
        out[:, 2] = np.einsum("nij,nj->ni", inverse, d[:, 2] - bend)
        return out
