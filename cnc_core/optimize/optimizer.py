"""The Path Optimizer's run over one program: read, smooth, write, compare."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..config import CellConfig
from ..errors import ERRORS, CncError, Place
from .columns import OutputColumns
from .comparison import planned_time, program_before
from .program_text import expanded
from .reading import Profile, ProgramReader
from .result import OptimizeResult
from .section import Style
from .smoothing import Run, Smoother
from .writing import Writer, setup_of

# the next one where the one before is no faster than the input
STYLES: tuple[Style, ...] = ("free", "fine", "keep")
FIRST_SHARE = 0.9  # of the progress when the first curves are made
FASTER = 1.0 - 2e-5
TIMED_POINTS = 200_000  # programs of more points are not planned
Made = list[list[Run]]


class Optimizer:
    """Smooths one program.  ``tick``: called with the share done."""

    def __init__(
        self,
        source: Path,
        setup: Path,
        out: Path,
        cell: CellConfig,
        tick: Callable[[float], None],
    ) -> None:
        self.source, self.setup, self.out = source, setup, out
        self.cell, self.tick = cell, tick
        self._done, self._shown = 0, 0.0

    def run(self) -> OptimizeResult:
        """Reads, smooths, writes.

        CncError tells what is wrong with program or setup.
        """
        self._check_paths()
        reader = ProgramReader(self.source, self.setup, self.cell)
        reader.first_look()
        lines = expanded(self.source)
        profiles = reader.profiles(lines)
        settings = reader.settings()
        columns = OutputColumns(self.source, self.cell, settings.tolerances)
        writer = Writer(self.out, self.setup, columns)
        before = planned_time(
            lambda folder: program_before(self.source, self.setup, folder),
            self.cell,
        )
        best: tuple[OptimizeResult, Made] | None = None
        for style in STYLES:
            result = OptimizeResult(
                time_before_s=before, setup=str(setup_of(self.out))
            )
            smoother = Smoother(
                self.source, self.cell, settings, columns, style, result
            )
            made = self._all_smoothed(smoother, profiles)
            writer.write(lines, profiles, made)
            writer.write_setup(settings.records, profiles)
            result.time_after_s = after = self._time_after(result)
            if best is None or _time(result) < _time(best[0]):
                best = result, made
            if after is None or before is None or after < before * FASTER:
                break
        assert best is not None
        if best[0] is not result:
            writer.write(lines, profiles, best[1])
        self.tick(1.0)
        return best[0]

    def _check_paths(self) -> None:
        """The output replaces neither the program nor its setup."""
        read = {self.source.resolve(), self.setup.resolve()}
        if read & {self.out.resolve(), setup_of(self.out).resolve()}:
            text = f"{ERRORS[909271]}: {self.out}"
            raise CncError(909271, text, Place(str(self.out)))

    def _time_after(self, result: OptimizeResult) -> float | None:
        """Machining time of the output, s; None where it is not planned."""
        if result.time_before_s is None or result.points_in > TIMED_POINTS:
            return None
        return planned_time(lambda folder: self.out, self.cell)

    def _all_smoothed(
        self, smoother: Smoother, profiles: list[Profile]
    ) -> Made:
        self._done = 0
        total = max(1, sum(len(profile.points) for profile in profiles))
        return [
            smoother.smoothed(profile, lambda n: self._advance(n, total))
            for profile in profiles
        ]

    def _advance(self, points: int, total: int) -> None:
        self._done += points
        share = FIRST_SHARE * min(self._done / total, 1.0)
        self._shown = max(self._shown, share)
        self.tick(self._shown)


def _time(result: OptimizeResult) -> float:
    """Seconds of the output, infinite if they are not known."""
    return result.time_after_s or np.inf
