"""Profiles of points to runs of polynomials (HSM specification 11)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from cnc_core.units import FloatArray

from ..blocks.profile_columns import (
    BLEND,
    PASS,
    SMOOTH,
    STOP,
    TANGENT,
    ProfileSpec,
)
from ..config import CellConfig
from ..errors import CncError, Place
from ..geometry.profiles import jets
from ..geometry.profiles.blend import evaluated
from ..geometry.profiles.curves import Intervals
from ..geometry.profiles.machine import tool_directions
from ..geometry.profiles.points import PointFilter, Points, automatic_codes
from .columns import OutputColumns
from .joints import join_sections
from .reading import Profile, Settings
from .result import OptimizeResult
from .section import SectionFitter, Style
from .types import Fit, FitReport, Pace

SEVERITY = (BLEND, PASS, STOP)
MEETS = 1e-7
# polynomials and their points, or a line of the machine's axes (True)
Run = tuple[Fit, Points, bool]


class Smoother:
    """Smooths the profiles of one program in one style."""

    def __init__(
        self,
        source: Path,
        cell: CellConfig,
        settings: Settings,
        columns: OutputColumns,
        style: Style,
        result: OptimizeResult,
    ) -> None:
        self._source, self._cell, self._settings = source, cell, settings
        self._columns, self._style, self.result = columns, style, result

    def smoothed(
        self, profile: Profile, tick: Callable[[int, int], None]
    ) -> list[Run]:
        """Runs of the profile: polynomials and their points, or a G00 line of
        the machine's axes (True).  ``tick``: points of a curve, and its last N.
        """
        spec, result = profile.spec, self.result
        result.profiles += 1
        result.points_in += len(profile.points)
        kept = PointFilter(spec).push(profile.points, True)
        self._kinds = self._mark(spec, kept)
        self._angle: float | None = None
        runs: list[Run] = []
        if len(kept) == 1:
            return [self._single(kept, spec)]
        first = 0
        for i in range(1, len(kept) + 1):
            straight = i < len(kept) and bool(kept.rapid[i])
            if (
                i < len(kept)
                and not straight
                and not (i - 1 > first and kept.rapid[i - 1])
            ):
                continue
            if i - 1 > first:
                runs.append(
                    (
                        self._run(kept[first:i], first, spec, tick),
                        kept[first:i],
                        False,
                    )
                )
            if straight:
                runs.append(self._straight(kept[i - 1 : i + 1], spec))
            first = i if straight else i - 1
        return runs

    def _mark(self, spec: ProfileSpec, points: Points) -> list[str]:
        """Stage 1: edges and changes of curvature, as when the points are run;
        edges are treated as C0.. say.

        What kind of edge each point is.
        """
        kinds = ["linear"] * len(points)
        if len(points) < 3:
            return kinds
        directions = tool_directions(spec, self._columns.kinematics(spec))
        versors = None if directions is None else directions(points.values)
        linear = points.values[:, list(spec.linear)]
        marks = spec.marks
        found = automatic_codes(linear, versors, marks)
        edges = (
            automatic_codes(linear, versors, replace(marks, ratio=0.0))
            != SMOOTH
        )
        of_path = (
            automatic_codes(linear, None, replace(marks, ratio=0.0)) != SMOOTH
        )
        found[edges] = self._settings.codes["versor"]
        found[of_path] = self._settings.codes["linear"]
        # at an edge of the path the axis that follows it jumps
        if spec.tangential is not None:
            found[of_path] = max(
                self._settings.codes["linear"],
                self._settings.codes["other"],
                key=SEVERITY.index,
            )
        inner = points.after[1:-1]
        driven = ~points.rapid[1:-1] & ~points.rapid[2:]
        free = (inner == SMOOTH) & driven
        self.result.edges += int((free & edges).sum())
        points.after[1:-1] = np.where(free, found, inner)
        for i in np.flatnonzero(edges & ~of_path):
            kinds[int(i) + 1] = "versor"
        return kinds

    def _run(
        self,
        points: Points,
        at: int,
        spec: ProfileSpec,
        tick: Callable[[int, int], None],
    ) -> Fit:
        """Stages 2 to 6 of the points between two G00 lines; ``at``: number of
        the first one.
        """
        report, parts = FitReport(), list[Fit]()
        linear, versor = self._columns.shape(
            spec, len(self._columns.names(spec))
        )
        cuts = [
            0,
            *(np.flatnonzero(points.after[1:-1] != SMOOTH) + 1).tolist(),
            len(points) - 1,
        ]
        for a, b in pairwise(cuts):
            begin = _tangent_end(parts[-1], linear) if parts else None
            section = self._followed(spec, points[a : b + 1], begin)
            columns = self._columns.values(spec, section)
            fitter = SectionFitter(
                columns,
                linear,
                versor,
                self._settings.tolerances,
                spec.degree,
                begin,
                self._pace(spec, section),
                self._style,
            )
            told = _with_number(points[a : b + 1], tick)
            coef, span, first = fitter.fit(report, told)
            after = np.full(len(span), SMOOTH, np.int64)
            ended = b == len(points) - 1
            after[-1] = STOP if ended else int(points.after[b])
            kind = self._kinds[at + b]
            parts.append(
                Fit(
                    coef,
                    span,
                    first + a,
                    after,
                    kind,
                    points=columns,
                    at=fitter.at,
                )
            )
        fit = join_sections(
            parts, linear, versor, self._settings.tolerances, report
        )
        self._count(points, fit, report)
        self._measure(fit, linear)
        return fit

    def _count(self, points: Points, fit: Fit, report: FitReport) -> None:
        """Add a run to the figures of the result."""
        result = self.result
        result.polynomials += len(fit.span)
        result.max_deviation_mm = max(result.max_deviation_mm, report.deviation)
        result.polyline_points += report.polyline_points
        result.points_dropped += max(0, len(points) - report.polyline_points)
        result.max_path_deviation_mm = max(
            result.max_path_deviation_mm, report.band
        )
        result.groups += report.groups
        result.kept += report.kept
        result.joints += report.joints

    def _pace(self, spec: ProfileSpec, points: Points) -> Pace:
        """What limits the speed of these points: their feed and the weakest
        linear axis.
        """
        channels = [spec.axes[i].channel for i in spec.linear]
        weakest = [
            float(np.min(self._cell.axis_values(f"{name}")[channels]))
            for name in ("a_max_mm_s2", "j_max_mm_s3")
        ]
        own = [
            [d for i in spec.linear if (d := getattr(spec.axes[i].cutting, n))]
            for n in ("acceleration", "jerk")
        ]
        acceleration, jerk = (
            min([w, *o]) if w > 0.0 else w
            for w, o in zip(weakest, own, strict=True)
        )
        return Pace(float(points.feed[1:].max()), acceleration, jerk)

    def _single(self, point: Points, spec: ProfileSpec) -> Run:
        """A profile of one point is a line to it."""
        if (
            spec.five_axes
            or spec.point == "CCP"
            or spec.tangential is not None
            or self._settings.own_length
            or self._columns.to_tip(spec)
        ):
            text = "a profile of one point: there is nothing to smooth"
            raise CncError(
                900003, text, Place(str(self._source), int(point.line[0]), 1)
            )
        return _nothing(len(self._columns.names(spec))), point, True

    def _straight(self, ends: Points, spec: ProfileSpec) -> Run:
        """A G00 line: of the machine's axes if those are programmed, else a
        polynomial at the axes' speed.
        """
        if (
            not spec.five_axes
            and spec.point != "CCP"
            and spec.tangential is None
            and not self._settings.own_length
            and not self._columns.to_tip(spec)
        ):
            return _nothing(len(self._columns.names(spec))), ends[1:], True
        values = self._columns.values(spec, self._followed(spec, ends, None))
        moved = values[1] - values[0]
        far = float(np.linalg.norm(moved[:3]))
        far = far if far > MEETS else float(np.linalg.norm(moved)) or 1.0
        coef = np.zeros((1, len(moved), 6))
        coef[0, :, 0] = values[0]
        coef[0, :, 1] = moved / far
        feed = min(
            float(self._cell.axis_values("v_max_mm_s")[spec.axes[i].channel])
            for i in spec.linear
        )
        one = np.zeros(1, np.int64)
        self.result.polynomials += 1
        return (
            Fit(
                coef,
                np.array([far]),
                one,
                np.array([STOP]),
                feed=feed,
            ),
            ends,
            False,
        )

    def _followed(
        self, spec: ProfileSpec, points: Points, begin: FloatArray | None
    ) -> Points:
        """Points of one section with the angle of the tangential axis where its
        offset was programmed.
        """
        column = spec.tangential
        if column is None:
            return points
        slope = self._columns.slopes(spec, points, begin)
        heading = np.degrees(np.arctan2(slope[:, 1], slope[:, 0]))
        stands = np.hypot(slope[:, 0], slope[:, 1]) < 1e-6
        last = 0.0 if self._angle is None else self._angle
        for i in np.flatnonzero(stands):
            heading[i] = heading[i - 1] if i else last
        heading = np.unwrap(
            np.concatenate([[last], heading]),
            period=360.0,
        )[1:]
        self._angle = float(heading[-1])
        out = points[:]
        out.values = points.values.copy()
        out.values[:, column] += (
            heading if spec.axes[column].role == "TAN" else -heading
        )
        return out

    def _measure(self, fit: Fit, linear: list[int]) -> None:
        """Largest jumps of position, direction and curvature where neither G66
        nor G67 stands.
        """
        if len(fit.span) < 2:
            return
        measures = (
            ("position_mm", _place),
            ("tangent_rad", _tangent),
            ("curvature_1_mm", _curvature),
        )
        worst = self.result.continuity
        for after, count in ((SMOOTH, 3), (TANGENT, 2)):
            at = np.flatnonzero(fit.after[:-1] == after)
            ends = jets.of_columns(fit.coef[at][:, linear], fit.span[at])
            begins = jets.of_columns(
                fit.coef[at + 1][:, linear], np.zeros(len(at))
            )
            for name, measure in measures[:count]:
                jump = float(
                    np.linalg.norm(measure(ends) - measure(begins), axis=1).max(
                        initial=0.0
                    )
                )
                worst[name] = max(worst.get(name, 0.0), jump)


def _nothing(columns: int) -> Fit:
    whole = np.empty(0, np.int64)
    return Fit(Intervals.none(columns).coef, np.empty(0), whole, whole)


def _place(j: FloatArray) -> FloatArray:
    return j[:, 0]


def _tangent(j: FloatArray) -> FloatArray:
    speed = np.linalg.norm(j[:, 1], axis=1)
    return np.asarray(j[:, 1] / speed[:, None])


def _curvature(j: FloatArray) -> FloatArray:
    speed = np.linalg.norm(j[:, 1], axis=1)[:, None]
    t = j[:, 1] / speed
    second = j[:, 2]
    across = second - (second * t).sum(axis=1)[:, None] * t
    return np.asarray(across / speed**2)


def _tangent_end(fit: Fit, linear: list[int]) -> FloatArray | None:
    """Position and direction at the end of a fit that the next one goes on from
    without a corner; None where it need not.
    """
    if fit.after[-1] != TANGENT:
        return None
    end: FloatArray = evaluated(fit.coef[-1], float(fit.span[-1]))[:2]
    end[1] /= np.linalg.norm(end[1, linear])
    return end


def _with_number(
    points: Points, tick: Callable[[int, int], None]
) -> Callable[[int], None]:
    """Tells N beside a count of points of this section."""
    done = 0

    def told(count: int) -> None:
        nonlocal done
        done += count
        tick(count, int(points.number[min(done, len(points) - 1)]))

    return told
