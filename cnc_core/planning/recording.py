"""A plan as a recording: the same tables as of a run, without a PLC."""

from __future__ import annotations

from pathlib import Path

from ..engine import Engine
from ..engine.recorded import Rows
from ..errors import CncError
from ..program import Program
from ..recording.account import account, as_bytes
from ..recording.parts import Parts
from ..recording.recorder import Recorder, check_columns


class PlanRecording:
    """Records one plan to a file; CncError: it cannot be written there.

    ``only``: tables and columns that are kept; empty: all.
    ``written``: the file, once there is one.
    """

    def __init__(
        self,
        target: Path,
        program: Program,
        config: Path | None,
        only: tuple[str, ...] = (),
    ) -> None:
        check_columns(program.cell, only)
        self.written: Path | None = None
        self._parts = Parts(target)
        self._program, self._only = program, only
        self._about = account(program.path, program.cell, "plan", config)
        self._recorder: Recorder | None = None

    def begin(self, engine: Engine) -> None:
        """The engine that plans."""
        self._recorder = Recorder(
            engine,
            self._parts.cnc,
            self._program.cell,
            as_bytes(self._about),
            self._only,
            follows=False,
        )
        self._recorder.event("start", self._program.path.name)

    def elements(self) -> None:
        """Record the elements that have been pushed."""
        if self._recorder:
            self._recorder.elements()

    def samples(self, rows: Rows) -> None:
        """Record the cycles that were taken from the engine."""
        if self._recorder:
            self._recorder.feed(rows)

    def finish(self, end: str, error: CncError | None) -> None:
        """Write the file, while the engine still stands; ``end``: how the plan
        ended.
        """
        lost: dict[str, int] = {}
        if self._recorder:
            self._recorder.elements()
            if error is not None:
                line = error.place.line if error.place else 0
                self._recorder.event("error", str(error), error.code, line)
            self._recorder.event("end", end)
            self._recorder.close()
            lost = self._recorder.lost
        self._parts.finish(end=end, lost=lost)
        self.written = self._parts.target
