"""The output: the program with polynomials in place of points, and its setup."""

from __future__ import annotations

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
from ..errors import CncError
from ..frontend.osai.setup import (
    Record,
    Records,
    SetupFile,
    SetupLine,
    Value,
)
from ..frontend.osai.variables import FIELD
from ..geometry.profiles.blend import evaluated
from ..geometry.profiles.points import Points
from .columns import OutputColumns
from .program_text import BEGIN, END, SETUP_LINE, middle
from .reading import Profile
from .smoothing import MEETS, Run
from .types import Fit

ENDS = {SMOOTH: 0, TANGENT: 0, BLEND: 0, STOP: 1, PASS: 2}


def setup_of(out: Path) -> Path:
    return out.with_name(out.name + ".setup")


class Writer:
    """Writes program and setup beside each other."""

    def __init__(self, out: Path, setup: Path, columns: OutputColumns) -> None:
        self.out, self.setup, self._columns = out, setup, columns

    def write(
        self,
        lines: list[str],
        profiles: list[Profile],
        made: list[list[Run]],
    ) -> None:
        setup = setup_of(self.out)
        out: list[str] = []
        k, inside, named = 0, False, False
        if not any(BEGIN.match(line) for line in lines):
            first, last = middle(lines)
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

    def _text(self, profile: Profile, runs: list[Run]) -> list[str]:
        spec = profile.spec
        names = self._columns.names(spec)
        unit = max(spec.axes[spec.linear[0]].factor, 1e-12)
        out: list[str] = []
        end: FloatArray | None = None  # of the polynomials that are open
        for fit, points, straight in runs:
            if straight:
                out += ["G60"] if end is not None else []
                end = None
                factor = self._columns.factors(
                    spec, len(self._columns.axes_out(spec))
                )
                target = points.values[0][self._columns.axes_out(spec)] / factor
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
                fit.coef
                / self._columns.factors(spec, fit.coef.shape[1])[None, :, None]
            )
            rates = self._rates(spec, points, fit)
            for i in range(len(fit.span)):
                begin = coef[i, :, 0]
                if end is None or np.abs(begin - end).max() > MEETS:
                    out += (["G60"] if end is not None else []) + ["G61 P5"]
                end = evaluated(coef[i], float(fit.span[i]))[0]
                feed = fit.feed or rates[i] * float(
                    points.feed[
                        min(
                            int(fit.first[i]) + 1,
                            len(points) - 1,
                        )
                    ]
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
            self._columns.values(spec, points)[:, :3],
            points.values[:, list(spec.linear)],
        )
        tip, axes = (
            np.concatenate(
                [
                    [0.0],
                    np.cumsum(
                        np.linalg.norm(
                            np.diff(w, axis=0),
                            axis=1,
                        )
                    ),
                ]
            )
            for w in ways
        )
        begin = np.minimum(fit.first, len(points) - 2)
        end = np.maximum(
            np.append(
                fit.first[1:],
                len(points) - 1,
            ),
            begin + 1,
        )
        return np.asarray(
            np.maximum(tip[end] - tip[begin], MEETS)
            / np.maximum(axes[end] - axes[begin], MEETS)
        )

    def write_setup(self, records: Records, profiles: list[Profile]) -> None:
        """The same setup for polynomials: CLP instead of AXI where the tip is
        smoothed, every versor programmed.
        """
        tip = bool(profiles) and self._columns.to_tip(profiles[0].spec)
        source = SetupFile(self.setup).lines
        lines = [
            _written(_for_output(r, tip), line)
            for r, line in zip(records.order, source, strict=True)
        ]
        try:
            Path(setup_of(self.out)).write_text(
                "\n".join(lines) + "\n", encoding="utf-8"
            )
        except OSError as error:
            raise CncError(
                901004, f"{setup_of(self.out)}: {error.strerror}"
            ) from None


def _written(record: Record, line: SetupLine) -> str:
    """The record; E and L variables stay what they are, the program assigns them."""
    values: dict[str, Value] = dict(record.values)
    shown = Record(record.code, values, record.place)
    for name, (text, _) in zip(record.values, line.fields, strict=False):
        if FIELD.match(text):
            values[name] = text
    return shown.printed()


def _for_output(record: Record, tip: bool) -> Record:
    values = dict(record.values)
    if record.code == "PNT":
        values["Format"] = "POL"
        if tip:
            values["Type"] = "CLP"
        values["Param"] = values["Type"]
    if record.code == "AXI" and values["Type"] in ("TAN", "TAO"):
        values["Type"] = "OTH"  # its angle is a polynomial
    if record.code == "VER":
        values = dict.fromkeys(values, "PRG")
    return Record(record.code, values, record.place)
