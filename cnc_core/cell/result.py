"""Outcome of one co-simulation."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..errors import CncError, Place
from ..recording.reading import Recording
from .columns import Columns

# members of the CNC's report that the result takes over
FROM_CNC = (
    "planner_late",
    "planner_late_cycles",
    "planner_away_s",
    "planner_us_per_ms",
    "cycles",
    "sim_time_s",
    "wall_time_s",
    "requests",
    "end",
    "messages",
    "errors",
    "waiting",
    "time_by_cause",
    "warnings",
    "blocks",
    "dialect",
    "peak_mb",
    "channels",
)


@dataclass
class RunResult:
    """Outcome of one co-simulation (the contract's run object).

    ``unwritten``: there is no file of the recording, ``errors`` tell why.
    """

    cycles: int = 0
    sim_time_s: float = 0.0
    wall_time_s: float = 0.0
    requests: dict[str, int] = field(
        default_factory=lambda: {"mode1": 0, "mode2": 0}
    )
    handshake_us: dict[str, float | None] = field(default_factory=dict)
    overruns: int = 0
    planner_late: int = 0
    planner_late_cycles: int = 0
    planner_away_s: float = 0.0
    planner_us_per_ms: dict[str, float] = field(default_factory=dict)
    end: str = "aborted"
    messages: list[str] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    errors: list[dict[str, Any]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    waiting: list[dict[str, Any]] = field(default_factory=list)
    time_by_cause: dict[str, float] = field(default_factory=dict)
    plc: dict[str, Any] = field(default_factory=dict)
    blocks: int = 0
    recorded: int = 0
    record_lost: int = 0
    unwritten: bool = False
    error_text: str = ""
    dialect: str | None = None
    peak_mb: float = 0.0
    name: str = ""
    channels: list[dict[str, Any]] = field(default_factory=list)
    recording: Recording | None = None

    @property
    def realtime_factor(self) -> float:
        return (
            self.sim_time_s / self.wall_time_s if self.wall_time_s > 0 else 0.0
        )

    @classmethod
    def from_reports(
        cls, cnc: dict[str, Any], plc: dict[str, Any], wall_time_s: float
    ) -> RunResult:
        """The figures of both reports; ``wall_time_s`` where the CNC has none."""
        result = cls(wall_time_s=wall_time_s, plc=plc)
        for key in FROM_CNC:
            if key in cnc:
                setattr(result, key, cnc[key])
        result.warnings = [*result.warnings, *plc.get("warnings", [])]
        overruns = (side.get("overruns", 0) for side in (cnc, plc))
        result.overruns = sum(map(int, overruns))
        result.handshake_us = handshake_us(plc)
        return result

    @property
    def failed(self) -> bool:
        """Whether it did not complete, or its recording could not be written."""
        return self.end != "completed" or self.unwritten

    @property
    def columns(self) -> Columns:
        """Arrays by name: with ``record=`` a row a cycle, ``t`` (s), axes (mm),
        ``s``, ``v`` and the other columns of ``cycles``, and the watched symbols.

        Without it the watched symbols and ``t``, a row a scan.
        KeyError names the columns that there are.
        """
        return Columns(self.plc.get("watch") or {}, self.recording)

    def check(self) -> RunResult:
        """This result; CncError with the reason of a run that has failed."""
        if not self.failed:
            return self
        found = [
            CncError(
                e["code"],
                e["text"],
                Place(e["file"] or "", e["line"] or 0, e["column"] or 0),
            )
            for e in self.errors
        ] or [CncError(905001, f"the run ended {self.end}")]
        first, *first.also = found
        if first.place.line:
            first.place.source = self.error_text
        raise first

    def __str__(self) -> str:
        """One line for people; ``as_json()`` has everything."""
        found = f"{self.end}: {self.sim_time_s:.6g} s of cell time"
        found += f", {self.blocks} blocks"
        reasons = [e["text"] for e in self.errors] + self.warnings
        return "; ".join([found, *reasons])

    def as_json(self) -> dict[str, Any]:
        return {
            "cycles": self.cycles,
            "sim_time_s": self.sim_time_s,
            "wall_time_s": self.wall_time_s,
            "realtime_factor": self.realtime_factor,
            "requests": self.requests,
            "handshake_us": self.handshake_us,
            "overruns": self.overruns,
            "planner_late": self.planner_late,
            "planner_late_cycles": self.planner_late_cycles,
            "planner_away_s": self.planner_away_s,
            "planner_us_per_ms": self.planner_us_per_ms,
            "end": self.end,
            "messages": self.messages,
            "files": self.files,
            "errors": self.errors,
            "waiting": self.waiting,
            "time_by_cause": self.time_by_cause,
            "warnings": self.warnings,
            "blocks": self.blocks,
            "recorded": self.recorded,
            "record_lost": self.record_lost,
            "dialect": self.dialect,
            "name": self.name,
            "channels": self.channels,
            "plc": self.plc,
        }


class RunInterrupted(KeyboardInterrupt):
    """Ctrl-C has ended a run; ``result`` holds what there is of it."""

    def __init__(self, result: RunResult, record: Path | None = None) -> None:
        self.result = result
        where = [
            f"waits for {w['what']} at {Path(w['file']).name}:{w['line']}"
            if w["line"]
            else f"waits for {w['what']}"
            for w in result.waiting
        ]
        kept = result.recorded or result.recording is not None
        recorded = [str(record)] if record and kept else []
        written = [*result.files, *recorded]
        parts = [
            f"interrupted after {result.sim_time_s:.3f} s of cell time",
            *where,
            f"written: {', '.join(written) or 'nothing'}",
        ]
        super().__init__("; ".join(parts))


def handshake_us(plc: dict[str, Any]) -> dict[str, float | None]:
    ns = plc.get("handshake_ns") or {}
    return {
        k: ns[k] / 1000.0 if ns.get(k) is not None and ns.get("n") else None
        for k in ("p50", "p99", "p999", "max")
    }
