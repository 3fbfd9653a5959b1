"""Columns of the output: axes, tool directions, normals."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cnc_core.units import FloatArray

from ..blocks.profile_columns import ProfileSpec
from ..config import CellConfig
from ..errors import CncError, Place
from ..geometry.profiles import jets
from ..geometry.profiles.machine import machine_of
from ..geometry.profiles.points import Points
from ..geometry.profiles.tool import NoNormal, Versors
from ..kinematics.machine import Kinematics
from .section import SectionFitter
from .types import FitReport, Tolerances


class OutputColumns:
    """Names and values of what the output programs."""

    def __init__(
        self, source: Path, cell: CellConfig, tolerances: Tolerances
    ) -> None:
        self._source, self._cell = source, cell
        self._tolerances = tolerances

    def names(self, spec: ProfileSpec) -> list[str]:
        names = [spec.axes[i].name for i in self.axes_out(spec)]
        names += list("ijk") if spec.five_axes else []
        return names + (list("mnopqd") if spec.point == "CCP" else [])

    def factors(self, spec: ProfileSpec, count: int) -> FloatArray:
        """Driven mm per programmed unit; the output is programmed as the input
        was, Scale and diameters included.
        """
        axes = [spec.axes[i].factor for i in self.axes_out(spec)]
        return np.array(axes + [1.0] * (count - len(axes)))

    def shape(
        self, spec: ProfileSpec, columns: int
    ) -> tuple[list[int], list[int]]:
        axes = len(self.axes_out(spec))
        return list(range(3)), list(range(axes, columns))

    def axes_out(self, spec: ProfileSpec) -> list[int]:
        """Axis columns that the output programs: linear ones first; rotary ones
        of a chain become ijk.
        """
        others = [
            i
            for i, axis in enumerate(spec.axes)
            if not axis.linear and not axis.kinematic
        ]
        return [*spec.linear, *others]

    @staticmethod
    def to_tip(spec: ProfileSpec) -> bool:
        """AXI points become CLP: on five axes, and on three where the feed is
        that of the tip.
        """
        return spec.point == "AXI" and (spec.five_axes or spec.feed_on == "CLP")

    def cells(
        self, spec: ProfileSpec, points: Points
    ) -> tuple[CellConfig, CellConfig]:
        """The cells on which input and output are planned.

        Where points of the axes become points of the tip, the axes stand where
        the profile begins: the way to it is another one along the axes than
        along the tip, and with another tool than that of OriginLen.
        """
        if not self.to_tip(spec) or not len(points):
            return self._cell, self._cell
        q = np.array(spec.start, dtype=np.float64)
        for i, axis in enumerate(spec.axes):
            q[axis.channel] = points.values[0, i]
        longer = spec.tool.length - spec.tool.origin_length
        linear = [spec.axes[i].channel for i in spec.linear]
        moved = q.copy()
        kinematics = self.kinematics(spec)
        if kinematics is None:
            moved[linear] += longer * np.array(spec.tool.direction)
        else:
            # the tip is affine in the linear axes
            probes = np.tile(q, (4, 1))
            probes[range(1, 4), linear] += 1.0
            tip = kinematics.forward(probes, spec.tool.length).tip
            wanted = kinematics.forward(q[None], spec.tool.origin_length).tip
            slope = (tip[1:] - tip[0]).T
            moved[linear] += np.linalg.solve(slope, wanted[0] - tip[0])
        return _standing(self._cell, q), _standing(self._cell, moved)

    def kinematics(self, spec: ProfileSpec) -> Kinematics | None:
        limits = (
            self._cell.axis_values("min_mm"),
            self._cell.axis_values("max_mm"),
        )
        return machine_of(spec, 1, limits) if spec.five_axes else None

    def values(self, spec: ProfileSpec, points: Points) -> FloatArray:
        """(n, columns) what the output programs: axes, then ijk, then mno and
        pqd of contact points.
        """
        values = points.values
        kinematics = self.kinematics(spec)
        parts = [values[:, self.axes_out(spec)].copy()]
        if kinematics is not None and (
            spec.point == "AXI" or spec.versor_columns("ijk") is None
        ):
            q = np.tile(spec.start, (len(values), 1))
            for i, axis in enumerate(spec.axes):
                q[:, axis.channel] = values[:, i]
            pose = kinematics.forward(
                q, spec.tool.origin_length if spec.point == "AXI" else 0.0
            )
            if spec.point == "AXI":
                parts[0][:, :3] = pose.tip
            parts.append(pose.direction)
        elif kinematics is None and self.to_tip(spec):
            tool = spec.tool
            parts[0][:, :3] -= tool.origin_length * np.array(tool.direction)
        elif kinematics is not None:
            parts.append(
                _about_vertical(
                    values[:, spec.versor_columns("ijk")],
                    self._turn(spec, values),
                )
            )
        if spec.point == "CCP":
            parts += self._contact(
                spec,
                points,
                kinematics,
                parts[1] if kinematics is not None else None,
            )
        return np.concatenate(parts, axis=1)

    def _turn(self, spec: ProfileSpec, values: FloatArray) -> FloatArray:
        """(n,) degrees by which programmed directions count from the motion: a
        tangential axis of the chain.
        """
        column = spec.tangential
        return (
            values[:, column]
            if column is not None and spec.axes[column].kinematic
            else np.zeros(len(values))
        )

    def _contact(
        self,
        spec: ProfileSpec,
        points: Points,
        kinematics: Kinematics | None,
        d: FloatArray | None,
    ) -> list[FloatArray]:
        """n and q of every point, programmed or automatic (tangents of the
        smoothed path).
        """
        versors, n = Versors(spec, kinematics), len(points)
        slope = np.zeros_like(points.values)
        if spec.versor_columns("mno") is None:
            slope[:, list(spec.linear)] = self.slopes(spec, points, None)
        coef = np.stack([points.values, slope], axis=2)
        u = np.zeros(n)
        direction = jets.still(np.array(spec.tool.direction), n)
        if d is not None:
            direction[:, 0] = d
        try:
            normal = versors.normal(coef, u, direction)
        except NoNormal:
            raise CncError(
                909253,
                "the surface normal cannot be computed",
                Place(str(self._source)),
            ) from None
        radius = versors.radius_direction(coef, u, direction, normal)
        return [normal[:, 0], radius[:, 0]]

    def slopes(
        self, spec: ProfileSpec, points: Points, begin: FloatArray | None
    ) -> FloatArray:
        """(n, 3) direction of the smoothed path at each point: chords of noisy
        points tell little of it.
        """
        xyz = points.values[:, list(spec.linear)]
        given = None if begin is None else begin[:, :3]
        fitter = SectionFitter(
            xyz, [0, 1, 2], [], self._tolerances, spec.degree, given
        )
        coef, span, _ = fitter.fit(FitReport(), lambda n: None)
        breaks = np.concatenate([[0.0], np.cumsum(span)])
        k = np.clip(
            np.searchsorted(breaks, fitter.at, side="right") - 1,
            0,
            len(span) - 1,
        )
        return jets.of_columns(
            coef[k],
            fitter.at - breaks[k],
            1,
        )[:, 0]


def _about_vertical(d: FloatArray, angle: FloatArray) -> FloatArray:
    """Directions (n, 3) turned about the third axis by (n,) degrees."""
    cos = np.cos(np.radians(angle))
    sin = np.sin(np.radians(angle))
    return np.column_stack(
        [
            cos * d[:, 0] - sin * d[:, 1],
            sin * d[:, 0] + cos * d[:, 1],
            d[:, 2],
        ]
    )


def _standing(cell: CellConfig, at: FloatArray) -> CellConfig:
    """The cell with its axes at (axes,) mm and degrees."""
    axes = {
        name: axis.model_copy(update={"start_mm": float(place)})
        for (name, axis), place in zip(cell.axes.items(), at, strict=True)
    }
    return cell.model_copy(update={"axes": axes})
