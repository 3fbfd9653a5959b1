"""The Path Optimizer's run over one program: read, smooth, write, compare."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import numpy as np

from ..config import CellConfig
from ..errors import ERRORS, CncError, Place
from .columns import OutputColumns
from .comparison import Planned, planned, program_before, runnable
from .program_text import expanded
from .progress import Progress, Tick
from .reading import Profile, ProgramReader, Settings
from .result import OptimizeResult
from .section import Style
from .smoothing import Run, Smoother
from .writing import Writer, setup_of

# the next one where the one before is no faster than the input
STYLES: tuple[Style, ...] = ("free", "fine", "keep")
FASTER = 1.0 - 2e-5
SAME = 1.0005  # of the input's time: not slower
SAME_TIP = 1.02  # where the feed of the axes has become that of the tip
NEAR = 1.1  # of the input's time: beyond it finer curves do not help
APART = 5.0  # tolerances by which the axes may end elsewhere without a word
TIMED_POINTS = 200_000  # programs of more points are not planned
Made = list[list[Run]]


class Optimizer:
    """Smooths one program.  ``tick``: called with the share done, and N."""

    def __init__(
        self,
        source: Path,
        setup: Path,
        out: Path,
        cell: CellConfig,
        tick: Tick,
    ) -> None:
        self.source, self.setup, self.out = source, setup, out
        self.cell, self._progress = cell, Progress(tick)

    def run(self) -> OptimizeResult:
        """Reads, smooths, writes.

        CncError tells what is wrong with program or setup.
        """
        self._check_paths()
        reader = ProgramReader(self.source, self.setup, self.cell)
        reader.first_look()
        lines = expanded(self.source)
        profiles = reader.profiles(lines, self._progress.reading)
        settings = reader.settings(profiles)
        columns = OutputColumns(self.source, self.cell, settings.tolerances)
        writer = Writer(self.out, self.setup, columns)
        tip = columns.to_tip(profiles[0].spec)
        starts = columns.cells(profiles[0].spec, profiles[0].points)
        before = self._before(starts[0])
        far = NEAR * before.time_s if before else np.inf
        found: list[tuple[OptimizeResult, Made, Planned | None]] = []
        for style in STYLES:
            if style == "fine" and found and _time(found[0][0]) > far:
                continue
            result = OptimizeResult(
                time_before_s=before.time_s if before else None,
                setup=str(setup_of(self.out)),
            )
            smoother = Smoother(
                self.source, self.cell, settings, columns, style, result
            )
            made = self._all_smoothed(smoother, profiles)
            writer.write(lines, profiles, made)
            writer.write_setup(settings.records, profiles)
            after = self._after(result, starts[1])
            result.time_after_s = after.time_s if after else None
            found.append((result, made, after))
            if before is None or after is None:
                break
            if after.time_s < before.time_s * FASTER:
                break
        best, runs, after = min(found, key=lambda one: _time(one[0]))
        if runs is not made:
            writer.write(lines, profiles, runs)
        if before and after:
            self._kept_if_slower(best, lines, SAME_TIP if tip else SAME)
        if before and after and not best.input_kept:
            _compare_ends(best, before, after, settings)
        self._progress.end()
        return best

    def _kept_if_slower(
        self,
        result: OptimizeResult,
        lines: list[str],
        same: float,
    ) -> None:
        """The input in place of an output that takes longer."""
        before, after = result.time_before_s, result.time_after_s
        assert before is not None
        assert after is not None
        if after <= before * same:
            if after > before * SAME:
                result.warnings.append(
                    f"909272: the output takes {after:.4g} s in place of"
                    f" {before:.4g} s: its feed is that of the tip"
                )
            return
        setup = setup_of(self.out)
        text = "\n".join(runnable(lines, setup.name)) + "\n"
        try:
            self.out.write_text(text, encoding="utf-8")
            shutil.copyfile(self.setup, setup)
        except OSError as error:
            raise CncError(901004, f"{self.out}: {error.strerror}") from None
        slower = f"{ERRORS[909272]}: {after:.4g} s in place of {before:.4g} s"
        edges = f"; {result.edges} edges are passed as C0 says"
        result.warnings.append(
            f"909272: {slower}{edges if result.edges else ''}"
        )
        result.input_kept = True
        result.polynomials = result.joints = result.points_dropped = 0
        result.max_deviation_mm = result.max_path_deviation_mm = 0.0
        result.time_after_s = before
        result.continuity = {}

    def _check_paths(self) -> None:
        """The output replaces neither the program nor its setup."""
        read = {self.source.resolve(), self.setup.resolve()}
        if read & {self.out.resolve(), setup_of(self.out).resolve()}:
            text = f"{ERRORS[909271]}: {self.out}"
            raise CncError(909271, text, Place(str(self.out)))

    def _before(self, cell: CellConfig) -> Planned | None:
        with tempfile.TemporaryDirectory() as folder:
            program = program_before(self.source, self.setup, Path(folder))
            return planned(program, cell, self._progress.timing)

    def _after(
        self, result: OptimizeResult, cell: CellConfig
    ) -> Planned | None:
        """The output as it is driven; None where it is not planned."""
        if result.time_before_s is None or result.points_in > TIMED_POINTS:
            return None
        return planned(self.out, cell, self._progress.writing)

    def _all_smoothed(
        self, smoother: Smoother, profiles: list[Profile]
    ) -> Made:
        self._progress.begin_curves(sum(len(p.points) for p in profiles))
        return [
            smoother.smoothed(profile, self._progress.curve)
            for profile in profiles
        ]


def _time(result: OptimizeResult) -> float:
    """Seconds of the output, infinite if they are not known."""
    return result.time_after_s or np.inf


def _compare_ends(
    result: OptimizeResult, before: Planned, after: Planned, settings: Settings
) -> None:
    """Warn if the axes end elsewhere: another tool length, another pose."""
    if len(before.end) == 0 or len(before.end) != len(after.end):
        return
    far = np.abs(after.end - before.end)
    if far.max() > APART * settings.tolerances.linear:
        result.warnings.append(
            f"909273: {ERRORS[909273]}: up to {far.max():.4g} mm or degrees"
            " (TOL OriginLen, tool length, or another pose of the axes)"
        )
