"""``optimize``: the offline Path Optimizer (HSM specification 11): points in,
quintic polynomials out.

The program is read by the front end with the given setup; its profiles are
replaced by polynomial profiles, everything around them stays as it is written.
Beside the output stands its own setup file, ``OUT`` with ``.setup`` behind.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..blocks.profile_columns import (
    BLEND,
    PASS,
    POINTS,
    SMOOTH,
    STOP,
    TANGENT,
    ProfileSpec,
)
from ..config import CellConfig
from ..errors import ERRORS, CncError, Place
from ..frontend.osai.front_end import OsaiFrontEnd
from ..frontend.osai.setup import (
    VARIABLE,
    Record,
    Records,
    SetupFile,
    SetupLine,
    Value,
)
from ..frontend.port import OfflinePort, Wait
from ..geometry.profiles import jets, machine_of, tool_directions
from ..geometry.profiles.blend import evaluated
from ..geometry.profiles.curves import Intervals
from ..geometry.profiles.points import PointFilter, Points, automatic_codes
from ..geometry.profiles.tool import NoNormal, Versors
from ..kinematics.machine import Kinematics
from .joints import join_sections
from .section import SectionFitter, Style
from .types import Fit, FitReport, Pace, Tolerances

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BEGIN = re.compile(r"^\s*(?:N\d+\s*)?G61\b")
END = re.compile(r"^\s*(?:N\d+\s*)?G60\b")
SETUP_LINE = re.compile(r"^\s*(?:N\d+\s*)?\(\s*HSM\s*,")
CALL = re.compile(r"^\s*(?:N\d+\s*)?\(\s*CLS\s*,\s*([^)]*?)\s*\)\s*(?:;.*)?$")
POINT = re.compile(
    r"^\s*(?:N\d+\s*)?(?:G0?[01](?!\d)\s*|G9[01]\s*)*[A-Zijkmnopqd]\s*[+-]?[\d.EL]"
)
OTHER_WORD = re.compile(r"[STM]\s*\d")
ENDS = {SMOOTH: 0, TANGENT: 0, BLEND: 0, STOP: 1, PASS: 2}
MODES = {"G63": BLEND, "G66": STOP, "G67": PASS}
EDGE_CODES = {"linear": "C0", "other": "C0X", "versor": "C0V"}
SEVERITY = (BLEND, PASS, STOP)
MEETS = 1e-7
CALLS_MAX = 20
SUFFIXES = ("", ".osai", ".hsm", ".nc", ".txt")
READ_ROWS = 4096
# the next one where the one before is no faster than the input
STYLES: tuple[Style, ...] = ("free", "fine", "keep")
FIRST_SHARE = 0.9  # of the progress when the first curves are made
FASTER = 1.0 - 2e-5
TIMED_POINTS = 200_000  # programs of more points are not planned


@dataclass
class OptimizeResult:
    """The contract's object and what else the report tells."""

    points_in: int = 0
    polynomials: int = 0
    max_deviation_mm: float = 0.0
    points_dropped: int = 0
    polyline_points: int = 0
    edges: int = 0
    groups: int = 0
    joints: int = 0
    profiles: int = 0
    kept: int = 0
    max_path_deviation_mm: float = 0.0
    time_before_s: float | None = None
    time_after_s: float | None = None
    continuity: dict[str, float] = field(default_factory=dict)
    setup: str = ""
    comparison: dict[str, Any] | None = None

    def as_json(self) -> dict[str, Any]:
        out = dict(self.__dict__)
        if self.comparison is None:
            del out["comparison"]
        return out


@dataclass
class _Profile:
    spec: ProfileSpec
    points: Points


def expanded(
    path: Path, folder: Path | None = None, depth: int = 0
) -> list[str]:
    """The lines of a program with those of its subprograms (CLS) in their
    place; missing ones are the reader's.
    """
    folder = folder or path.parent
    out: list[str] = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        called = CALL.match(line)
        names = (
            [folder / (called[1] + suffix) for suffix in SUFFIXES]
            if called
            else []
        )
        found = next((p for p in names if p.is_file()), None)
        if found is None or depth >= CALLS_MAX:
            out.append(line)
        else:
            out += expanded(found, folder, depth + 1)
    return out


Made = list[list[tuple[Fit, Points, bool]]]


def _setup_of(out: Path) -> Path:
    return out.with_name(out.name + ".setup")


class Optimizer:
    """``tick``: called with the share done."""

    def __init__(
        self,
        source: Path,
        setup: Path,
        out: Path,
        cell: CellConfig,
        tick: Callable[[float], None],
    ) -> None:
        self.source, self.setup, self.out, self.cell, self.tick = (
            source,
            setup,
            out,
            cell,
            tick,
        )
        self.result = OptimizeResult()
        self._done, self._shown = 0, 0.0

    def run(self) -> OptimizeResult:
        """Reads, smooths, writes; CncError for what is wrong with program or setup."""
        read, written = (
            (self.source, self.setup),
            (self.out, _setup_of(self.out)),
        )
        if {path.resolve() for path in read} & {
            path.resolve() for path in written
        }:
            raise CncError(
                909271, f"{ERRORS[909271]}: {self.out}", Place(str(self.out))
            )
        self._first_look()
        lines = expanded(self.source)
        profiles = self._profiles(lines)
        records = self._records()
        self.tolerances = _tolerances(records)
        self.codes = {
            kind: MODES[records.general["SMT"].word(name)]
            for kind, name in EDGE_CODES.items()
        }
        self._own_length = records.get("TOL").maybe("Len") is not None
        best: tuple[OptimizeResult, Made] | None = None
        before = planned_time(
            lambda folder: _before(self.source, self.setup, folder), self.cell
        )
        for style in STYLES:
            self.result = OptimizeResult(time_before_s=before)
            made = self._all_smoothed(profiles, style)
            self._write(lines, profiles, made)
            self._write_setup(records, profiles)
            worth = before is not None and self.result.points_in <= TIMED_POINTS
            after = (
                planned_time(lambda folder: self.out, self.cell)
                if worth
                else None
            )
            self.result.time_after_s = after
            if best is None or (after or np.inf) < (
                best[0].time_after_s or np.inf
            ):
                best = self.result, made
            if after is None or before is None or after < before * FASTER:
                break
        assert best is not None
        if best[0] is not self.result:
            self.result, made = best
            self._write(lines, profiles, made)
        self.tick(1.0)
        return self.result

    def _all_smoothed(self, profiles: list[_Profile], style: Style) -> Made:
        total, self._done, self.style = (
            max(1, sum(len(p.points) for p in profiles)),
            0,
            style,
        )
        return [
            self._smoothed(p, lambda n: self._advance(n, total))
            for p in profiles
        ]

    def _advance(self, points: int, total: int) -> None:
        self._done += points
        self._shown = max(
            self._shown, FIRST_SHARE * min(self._done / total, 1.0)
        )
        self.tick(self._shown)

    # reading

    def _first_look(self) -> None:
        """What makes no sense to read a program with."""
        setup = SetupFile(self.setup)
        if setup.errors:
            raise setup.errors[0]
        records, _ = setup.resolve(lambda letter, number: 0.0)
        if "SMT" not in {line.code for line in setup.lines}:
            raise records.missing(
                "the setup lacks SMT: the tolerances of the Path Optimizer"
            )
        if (
            "PNT" in records.general
            and records.general["PNT"].word("Format") != "PNT"
        ):
            raise records.general["PNT"].fail(
                909205, "PNT: the Path Optimizer takes points", "Format"
            )

    def _records(self) -> Records:
        """The setup with the program's variables."""
        records, errors = SetupFile(self.setup).resolve(self._variables)
        if errors:
            raise errors[0]
        smt, sms = records.general["SMT"], records.get("SMS")
        if sms.word("C1") == "ENA":
            raise sms.fail(
                900003,
                "SMS, C1: smoothing at C1-continuous points is not supported",
                "C1",
            )
        if sms.word("Progr") == "DIS":
            raise sms.fail(
                900003,
                "SMS, Progr: the debug output in place of a program is not supported",
                "Progr",
            )
        for name in ("Toll", "TollX", "TollV"):
            if name == "Toll" and not smt.number(name) > 0.0:
                raise smt.fail(
                    909205, "SMT, Toll: the tolerance must be positive", name
                )
        return records

    def _profiles(self, lines: list[str]) -> list[_Profile]:
        """Every profile of the program; a program without G61 is one."""
        # the reader knows of calls that are left
        if any(BEGIN.match(line) or CALL.match(line) for line in lines):
            return self._read(self.source, 0)
        first, last = _middle(lines)
        if first is None:
            raise CncError(
                909225,
                "the program has no point",
                Place(str(self.source), 1, 1),
            )
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / self.source.name
            text = [
                *lines[:first],
                "G61",
                *lines[first:last],
                "G60",
                *lines[last:],
            ]
            path.write_text("\n".join(text) + "\n", encoding="utf-8")
            return self._read(path, first)

    def _read(self, path: Path, inserted: int) -> list[_Profile]:
        machine = self.cell.program_machine()
        reader = OsaiFrontEnd(
            path, machine, OfflinePort(machine.start), setup=self.setup
        )
        self._variables = reader.variables
        found: list[tuple[ProfileSpec, list[Points]]] = []
        try:
            while (item := reader.read(READ_ROWS)) is not None:
                if isinstance(item, Wait) or item.profile is None:
                    continue
                chunk = item.profile
                if not found or found[-1][0] is not chunk.spec:
                    found.append((chunk.spec, []))
                found[-1][1].append(Points.of(chunk))
        except CncError as error:
            if path != self.source and error.place.file == str(path):
                error.place.file = str(self.source)
                error.place.line -= error.place.line > inserted
            raise
        finally:
            reader.close()
        return [_Profile(spec, _joined(parts)) for spec, parts in found]

    # smoothing

    def _smoothed(
        self, profile: _Profile, tick: Callable[[int], None]
    ) -> list[tuple[Fit, Points, bool]]:
        """Runs of the profile: polynomials and their points, or a G00 line of
        the machine's axes (True).
        """
        spec, result = profile.spec, self.result
        result.profiles += 1
        result.points_in += len(profile.points)
        kept = PointFilter(spec).push(profile.points, True)
        self._kinds = self._mark(spec, kept)
        self._angle: float | None = None
        runs: list[tuple[Fit, Points, bool]] = []
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
        directions = tool_directions(spec, self._kinematics(spec))
        versors = None if directions is None else directions(points.values)
        linear, marks = points.values[:, list(spec.linear)], spec.marks
        found = automatic_codes(linear, versors, marks)
        edges = (
            automatic_codes(linear, versors, replace(marks, ratio=0.0))
            != SMOOTH
        )
        of_path = (
            automatic_codes(linear, None, replace(marks, ratio=0.0)) != SMOOTH
        )
        found[edges] = self.codes["versor"]
        found[of_path] = self.codes["linear"]
        # at an edge of the path the axis that follows it jumps
        if spec.tangential is not None:
            found[of_path] = max(
                self.codes["linear"], self.codes["other"], key=SEVERITY.index
            )
        inner = points.after[1:-1]
        free = (inner == SMOOTH) & ~points.rapid[1:-1] & ~points.rapid[2:]
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
        tick: Callable[[int], None],
    ) -> Fit:
        """Stages 2 to 6 of the points between two G00 lines; ``at``: number of
        the first one.
        """
        report, parts = FitReport(), list[Fit]()
        linear, versor = self._shape(spec, len(self._names(spec)))
        cuts = [
            0,
            *(np.flatnonzero(points.after[1:-1] != SMOOTH) + 1).tolist(),
            len(points) - 1,
        ]
        for a, b in pairwise(cuts):
            begin = None
            if parts and parts[-1].after[-1] == TANGENT:
                begin = evaluated(
                    parts[-1].coef[-1], float(parts[-1].span[-1])
                )[:2]
                begin[1] /= np.linalg.norm(begin[1, linear])
            section = self._followed(spec, points[a : b + 1], begin)
            columns = self._columns(spec, section)
            fitter = SectionFitter(
                columns,
                linear,
                versor,
                self.tolerances,
                spec.degree,
                begin,
                self._pace(spec, section),
                self.style,
            )
            coef, span, first = fitter.fit(report, tick)
            after = np.full(len(span), SMOOTH, np.int64)
            after[-1] = STOP if b == len(points) - 1 else int(points.after[b])
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
        fit = join_sections(parts, linear, versor, self.tolerances, report)
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
        self._measure(fit, linear)
        return fit

    def _pace(self, spec: ProfileSpec, points: Points) -> Pace:
        """What limits the speed of these points: their feed and the weakest
        linear axis.
        """
        channels = [spec.axes[i].channel for i in spec.linear]
        weakest = [
            float(np.min(self.cell.axis_values(f"{name}")[channels]))
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

    def _single(
        self, point: Points, spec: ProfileSpec
    ) -> tuple[Fit, Points, bool]:
        """A profile of one point is a line to it."""
        if (
            spec.five_axes
            or spec.point == "CCP"
            or spec.tangential is not None
            or self._own_length
        ):
            text = "a profile of one point: there is nothing to smooth"
            raise CncError(
                900003, text, Place(str(self.source), int(point.line[0]), 1)
            )
        return _nothing(len(self._names(spec))), point, True

    def _straight(
        self, ends: Points, spec: ProfileSpec
    ) -> tuple[Fit, Points, bool]:
        """A G00 line: of the machine's axes if those are programmed, else a
        polynomial at the axes' speed.
        """
        if (
            not spec.five_axes
            and spec.point != "CCP"
            and spec.tangential is None
            and not self._own_length
        ):
            return _nothing(len(self._names(spec))), ends[1:], True
        values = self._columns(spec, self._followed(spec, ends, None))
        moved = values[1] - values[0]
        far = float(np.linalg.norm(moved[:3]))
        far = far if far > MEETS else float(np.linalg.norm(moved)) or 1.0
        coef = np.zeros((1, len(moved), 6))
        coef[0, :, 0], coef[0, :, 1] = values[0], moved / far
        feed = min(
            float(self.cell.axis_values("v_max_mm_s")[spec.axes[i].channel])
            for i in spec.linear
        )
        one = np.zeros(1, np.int64)
        self.result.polynomials += 1
        return (
            Fit(coef, np.array([far]), one, np.array([STOP]), feed=feed),
            ends,
            False,
        )

    def _slopes(
        self, spec: ProfileSpec, points: Points, begin: FloatArray | None
    ) -> FloatArray:
        """(n, 3) direction of the smoothed path at each point: chords of noisy
        points tell little of it.
        """
        xyz, given = (
            points.values[:, list(spec.linear)],
            None if begin is None else begin[:, :3],
        )
        fitter = SectionFitter(
            xyz, [0, 1, 2], [], self.tolerances, spec.degree, given
        )
        coef, span, _ = fitter.fit(FitReport(), lambda n: None)
        breaks = np.concatenate([[0.0], np.cumsum(span)])
        k = np.clip(
            np.searchsorted(breaks, fitter.at, side="right") - 1,
            0,
            len(span) - 1,
        )
        return jets.of_columns(coef[k], fitter.at - breaks[k], 1)[:, 0]

    # the tangential axis

    def _followed(
        self, spec: ProfileSpec, points: Points, begin: FloatArray | None
    ) -> Points:
        """Points of one section with the angle of the tangential axis where its
        offset was programmed.
        """
        column = spec.tangential
        if column is None:
            return points
        slope = self._slopes(spec, points, begin)
        heading = np.degrees(np.arctan2(slope[:, 1], slope[:, 0]))
        stands = np.hypot(slope[:, 0], slope[:, 1]) < 1e-6
        last = 0.0 if self._angle is None else self._angle
        for i in np.flatnonzero(stands):
            heading[i] = heading[i - 1] if i else last
        heading = np.unwrap(np.concatenate([[last], heading]), period=360.0)[1:]
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

    # columns of the output

    def _shape(
        self, spec: ProfileSpec, columns: int
    ) -> tuple[list[int], list[int]]:
        axes = len(self._axes_out(spec))
        return list(range(3)), list(range(axes, columns))

    def _axes_out(self, spec: ProfileSpec) -> list[int]:
        """Axis columns that the output programs: linear ones first; rotary ones
        of a chain become ijk.
        """
        others = [
            i
            for i, axis in enumerate(spec.axes)
            if not axis.linear and not axis.kinematic
        ]
        return [*spec.linear, *others]

    def _kinematics(self, spec: ProfileSpec) -> Kinematics | None:
        limits = (
            self.cell.axis_values("min_mm"),
            self.cell.axis_values("max_mm"),
        )
        return machine_of(spec, 1, limits) if spec.five_axes else None

    def _columns(self, spec: ProfileSpec, points: Points) -> FloatArray:
        """(n, columns) what the output programs: axes, then ijk, then mno and
        pqd of contact points.
        """
        values = points.values
        kinematics = self._kinematics(spec)
        parts = [values[:, self._axes_out(spec)].copy()]
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
            slope[:, list(spec.linear)] = self._slopes(spec, points, None)
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
                Place(str(self.source)),
            ) from None
        radius = versors.radius_direction(coef, u, direction, normal)
        return [normal[:, 0], radius[:, 0]]

    # writing

    def _names(self, spec: ProfileSpec) -> list[str]:
        names = [spec.axes[i].name for i in self._axes_out(spec)]
        names += list("ijk") if spec.five_axes else []
        return names + (list("mnopqd") if spec.point == "CCP" else [])

    def _factors(self, spec: ProfileSpec, count: int) -> FloatArray:
        """Driven mm per programmed unit; the output is programmed as the input
        was, Scale and diameters included.
        """
        axes = [spec.axes[i].factor for i in self._axes_out(spec)]
        return np.array(axes + [1.0] * (count - len(axes)))

    def _write(
        self,
        lines: list[str],
        profiles: list[_Profile],
        made: list[list[tuple[Fit, Points, bool]]],
    ) -> None:
        setup = _setup_of(self.out)
        self.result.setup = str(setup)
        out: list[str] = []
        k, inside, named = 0, False, False
        if not any(BEGIN.match(line) for line in lines):
            first, last = _middle(lines)
            assert first is not None
            out = [
                *lines[:first],
                f"(HSM,{setup.name})",
                *self._text(profiles[0], made[0]),
                *lines[last:],
            ]
        else:
            for line in lines:
                if inside:
                    inside = not END.match(line)
                    continue
                if SETUP_LINE.match(line):
                    named = True
                    out.append(f"(HSM,{setup.name})")
                elif BEGIN.match(line):
                    inside = True
                    out += [] if named else [f"(HSM,{setup.name})"]
                    named = True
                    if k < len(made):
                        out += self._text(profiles[k], made[k])
                    k += 1
                else:
                    out.append(line)
        try:
            self.out.write_text("\n".join(out) + "\n", encoding="utf-8")
        except OSError as error:
            raise CncError(901004, f"{self.out}: {error.strerror}") from None

    def _text(
        self, profile: _Profile, runs: list[tuple[Fit, Points, bool]]
    ) -> list[str]:
        spec = profile.spec
        names, unit = (
            self._names(spec),
            max(spec.axes[spec.linear[0]].factor, 1e-12),
        )
        out: list[str] = []
        end: FloatArray | None = None  # of the polynomials that are open
        for fit, points, straight in runs:
            if straight:
                out += ["G60"] if end is not None else []
                end = None
                factor = self._factors(spec, len(self._axes_out(spec)))
                target = points.values[0][self._axes_out(spec)] / factor
                words = " ".join(
                    f"{n}{v:.9g}" for n, v in zip(names, target, strict=False)
                )
                feed = (
                    60.0
                    * float(points.feed[0])
                    / (unit if unit == 25.4 else 1.0)
                )
                out.append(
                    f"G0 {words}"
                    if points.rapid[0]
                    else f"G1 {words} F{feed:.9g}"
                )
                continue
            coef = (
                fit.coef / self._factors(spec, fit.coef.shape[1])[None, :, None]
            )
            rates = self._rates(spec, points, fit)
            for i in range(len(fit.span)):
                if end is None or np.abs(coef[i, :, 0] - end).max() > MEETS:
                    out += (["G60"] if end is not None else []) + ["G61 P5"]
                end = evaluated(coef[i], float(fit.span[i]))[0]
                feed = fit.feed or rates[i] * float(
                    points.feed[min(int(fit.first[i]) + 1, len(points) - 1)]
                )
                feed = 60.0 * feed / (unit if unit == 25.4 else 1.0)
                number = int(
                    points.number[min(int(fit.first[i]), len(points) - 1)]
                )
                out.append(
                    f"<*,{fit.span[i]:.17g},{number},{feed:.9g},{ENDS[int(fit.after[i])]}"
                )
                out += [
                    f"<{n}," + ",".join(f"{c:.17g}" for c in coef[i, j])
                    for j, n in enumerate(names)
                ]
        return out + (["G60"] if end is not None else [])

    def _rates(self, spec: ProfileSpec, points: Points, fit: Fit) -> FloatArray:
        """(polynomials,) length of the tip's way over that of the axes, where
        the input's feed is along the axes.
        """
        if (
            not (
                spec.five_axes and spec.point == "AXI" and spec.feed_on == "AXI"
            )
            or len(points) < 2
        ):
            return np.ones(len(fit.span))
        ways = (
            self._columns(spec, points)[:, :3],
            points.values[:, list(spec.linear)],
        )
        tip, axes = (
            np.concatenate(
                [[0.0], np.cumsum(np.linalg.norm(np.diff(w, axis=0), axis=1))]
            )
            for w in ways
        )
        begin = np.minimum(fit.first, len(points) - 2)
        end = np.maximum(np.append(fit.first[1:], len(points) - 1), begin + 1)
        return np.asarray(
            np.maximum(tip[end] - tip[begin], MEETS)
            / np.maximum(axes[end] - axes[begin], MEETS)
        )

    def _write_setup(self, records: Records, profiles: list[_Profile]) -> None:
        """The same setup for polynomials: CLP instead of AXI on five axes,
        every versor programmed.
        """
        five = bool(profiles) and profiles[0].spec.five_axes
        source = SetupFile(self.setup).lines
        lines = [
            _written(_for_output(r, five), line)
            for r, line in zip(records.order, source, strict=True)
        ]
        try:
            Path(self.result.setup).write_text(
                "\n".join(lines) + "\n", encoding="utf-8"
            )
        except OSError as error:
            raise CncError(
                901004, f"{self.result.setup}: {error.strerror}"
            ) from None


def _written(record: Record, line: SetupLine) -> str:
    """The record; E and L variables stay what they are, the program assigns them."""
    values: dict[str, Value] = dict(record.values)
    shown = Record(record.code, values, record.place)
    for name, (text, _) in zip(record.values, line.fields, strict=False):
        if VARIABLE.match(text):
            values[name] = text
    return shown.printed()


def _for_output(record: Record, five: bool) -> Record:
    values = dict(record.values)
    if record.code == "PNT":
        values["Format"] = "POL"
        if five and values["Type"] == "AXI":
            values["Type"] = values["Param"] = "CLP"
        values["Param"] = values["Type"]
    if record.code == "AXI" and values["Type"] in ("TAN", "TAO"):
        values["Type"] = "OTH"  # its angle is a polynomial
    if record.code == "VER":
        values = dict.fromkeys(values, "PRG")
    return Record(record.code, values, record.place)


def _tolerances(records: Records) -> Tolerances:
    smt, sms = records.general["SMT"], records.get("SMS")
    longest = sms.maybe("Len")
    return Tolerances(
        linear=smt.number("Toll"),
        other=smt.number("TollX") or smt.number("Toll"),
        versor=smt.number("TollV") or 0.1 * smt.number("Toll"),
        split=sms.number("Split"),
        split_other=sms.number("SplitX"),
        split_versor=sms.number("SplitV"),
        reach=smt.number("Racc"),
        reach_other=smt.number("RaccX"),
        reach_versor=smt.number("RaccV"),
        condition=int(sms.number("Cond")),
        condition_other=int(sms.number("CondX")),
        condition_versor=int(sms.number("CondV")),
        longest=0.0 if longest is None else longest,
        group=int(sms.number("Pnt")),
    )


def _about_vertical(d: FloatArray, angle: FloatArray) -> FloatArray:
    """Directions (n, 3) turned about the third axis by (n,) degrees."""
    cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return np.column_stack(
        [cos * d[:, 0] - sin * d[:, 1], sin * d[:, 0] + cos * d[:, 1], d[:, 2]]
    )


def _joined(parts: list[Points]) -> Points:
    names = ("values", "feed", "after", "rapid", "line", "number")
    return Points(
        *(np.concatenate([getattr(p, name) for p in parts]) for name in names)
    )


def _nothing(columns: int) -> Fit:
    whole = np.empty(0, np.int64)
    return Fit(Intervals.none(columns).coef, np.empty(0), whole, whole)


def _middle(lines: list[str]) -> tuple[int | None, int]:
    """First line of points, and the first line behind the last one."""
    found = [
        i
        for i, line in enumerate(lines)
        if POINT.match(line.partition(";")[0])
        and not OTHER_WORD.search(line.partition(";")[0])
        and not line.lstrip().startswith("F")
    ]
    return (found[0], found[-1] + 1) if found else (None, 0)


def _place(j: FloatArray) -> FloatArray:
    return j[:, 0]


def _tangent(j: FloatArray) -> FloatArray:
    return np.asarray(j[:, 1] / np.linalg.norm(j[:, 1], axis=1)[:, None])


def _curvature(j: FloatArray) -> FloatArray:
    speed = np.linalg.norm(j[:, 1], axis=1)[:, None]
    t = j[:, 1] / speed
    return np.asarray(
        (j[:, 2] - (j[:, 2] * t).sum(axis=1)[:, None] * t) / speed**2
    )


def _before(source: Path, setup: Path, folder: Path) -> Path:
    """The input with this setup as a program that runs."""
    before = folder / "before.osai"
    lines = expanded(source)
    (folder / "setup").write_text(
        setup.read_text(encoding="utf-8"), encoding="utf-8"
    )
    if any(BEGIN.match(line) for line in lines):
        lines = [
            "(HSM,setup)",
            *(line for line in lines if not SETUP_LINE.match(line)),
        ]
    else:
        first, last = _middle(lines)
        lines = [
            *lines[: first or 0],
            "(HSM,setup)",
            "G61",
            *lines[first or 0 : last],
            "G60",
            *lines[last:],
        ]
    before.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return before


def planned_time(
    program: Callable[[Path], Path], cell: CellConfig
) -> float | None:
    """Machining time, s, of the program that ``program`` puts into a folder;
    None where it cannot be planned.
    """
    from ..planning import plan_program  # noqa: PLC0415
    from ..program import Program  # noqa: PLC0415

    with tempfile.TemporaryDirectory() as folder:
        try:
            return plan_program(
                Program(program(Path(folder)), cell, "osai")
            ).motion_time_s
        except CncError:
            return None


def compare(
    source: Path, out: Path, setup: Path, cell: CellConfig
) -> dict[str, Any]:
    """Machining time, s, and root mean square of the jerk of both programs on a
    cell.
    """
    from ..planning import plan_program  # noqa: PLC0415
    from ..program import Program  # noqa: PLC0415

    found = {}
    with tempfile.TemporaryDirectory() as folder:
        before = _before(source, setup, Path(folder))
        for name, path in (("before", before), ("after", out)):
            result = plan_program(
                Program(path, cell, "osai"), keep_samples=True
            )
            assert result.samples is not None
            jerk = np.diff(result.samples["pos"], n=3, axis=0) / cell.cycle_s**3
            rms = (
                float(np.sqrt((jerk**2).sum(axis=1).mean()))
                if len(jerk)
                else 0.0
            )
            found[name] = {"time_s": result.motion_time_s, "jerk_rms": rms}
    return found


def optimize(
    source: Path,
    setup: Path,
    out: Path,
    cell: CellConfig,
    tick: Callable[[float], None] = lambda share: None,
    *,
    compared: bool = False,
) -> OptimizeResult:
    """Smooth a program of points; ``compared``: plan it before and after."""
    result = Optimizer(source, setup, out, cell, tick).run()
    if compared:
        result.comparison = compare(source, out, setup, cell)
    return result


__all__ = ["POINTS", "OptimizeResult", "optimize"]
