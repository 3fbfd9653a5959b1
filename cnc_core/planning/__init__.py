"""``plan``: drive a whole program through the engine, without a PLC, and
measure what comes out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..blocks import BlockBatch, number_of_last, number_pushed
from ..config import CellConfig
from ..engine import Engine, Event, Samples
from ..engine.causes import planner_pace, time_by_cause
from ..engine.recorded import Recorded, Rows
from ..errors import ERRORS, CncError
from ..frontend.port import Wait
from ..program import Program
from .measure import TrajectoryCheck

if TYPE_CHECKING:
    from .recording import PlanRecording

RECORD_ROWS = 16384


@dataclass
class PlanResult:
    """Figures of one planned program (the contract's plan object), and the
    samples if they were asked for.
    """

    blocks: int = 0
    motion_time_s: float = 0.0
    plan_cpu_s: float = 0.0
    planner_us_per_ms: dict[str, float] = field(default_factory=dict)
    cycle_s: float = 0.001
    max_ratio: dict[str, float | None] = field(default_factory=dict)
    path_deviation_mm: float = 0.0
    lookahead: int = 0
    infeasible: int = 0
    time_by_cause: dict[str, float] = field(default_factory=dict)
    filters: list[dict[str, Any]] = field(default_factory=list)
    filtered: dict[str, float] = field(default_factory=dict)
    jerk_limited: bool = False
    samples: dict[str, Any] | None = None

    def as_json(self) -> dict[str, Any]:
        return {
            "blocks": self.blocks,
            "motion_time_s": self.motion_time_s,
            "plan_cpu_s": self.plan_cpu_s,
            "planner_us_per_ms": self.planner_us_per_ms,
            "blocks_per_s": self.blocks / self.plan_cpu_s
            if self.plan_cpu_s > 0
            else 0.0,
            "cycle_s": self.cycle_s,
            "max_ratio": self.max_ratio,
            "path_deviation_mm": self.path_deviation_mm,
            "time_by_cause": self.time_by_cause,
            "lookahead": self.lookahead,
            "planner": "jerk-limited"
            if self.jerk_limited
            else "acceleration-limited",
            "filters": self.filters,
            "filtered": self.filtered,
        }


Look = Callable[["Feeder"], None]
NO_ROWS: Rows = np.empty(0)


class Feeder:
    """Pushes a program's rows into an engine; what the ring does not take waits
    for the next call, and so does a program that waits for standstill.

    ``motions``: rows with motion so far.  ``n``: N of the last row.
    """

    def __init__(
        self,
        program: Program,
        engine: Engine,
        seen: Callable[[BlockBatch], None],
        look: Look | None = None,
    ) -> None:
        self.program, self.engine, self.seen = program, engine, seen
        self._look = look
        self.batch, self.first, self.rows = BlockBatch.empty(), 0, 0
        self.motions = self.n = 0
        self.done = self.waiting = False

    def fill(self) -> None:
        """Push until the ring is full, the program waits, or it ends."""
        while not (self.done or self.waiting):
            if self.first < len(self.batch):
                self.first += self.engine.push(self.batch, self.first)
                if self.first < len(self.batch):
                    return
                continue
            item = self.program.read()
            if isinstance(item, BlockBatch):
                self.batch, self.first = item, 0
                self.rows += number_pushed(item)
                self.motions += int(item.motion.sum())
                self.n = number_of_last(item) or self.n
                self.seen(item)
                self.look()
            elif item is None:
                self.engine.finish()
                self.done = True
            elif item is Wait.DRAINED:
                self.waiting = True
                self.engine.expect_drain()
            elif item is Wait.CYCLE:
                self.engine.expect_cycle()
                return
            elif item is Wait.AXES:
                raise CncError(
                    900003,
                    "axis exchange: one channel is planned, and nobody else"
                    " moves the axes; plan all channels of the cell, or run it",
                    self.program.reader.place_now,
                )

    def look(self) -> None:
        """Show somebody how far it is."""
        if self._look:
            self._look(self)

    def drained(self) -> None:
        """The axes stand behind all rows so far: the program goes on."""
        self.waiting = False
        self.fill()


def plan_program(
    program: Program,
    *,
    window: int | None = None,
    jerk: bool = True,
    keep_samples: bool = False,
    live: tuple[int, Callable[[Engine], None]] | None = None,
    look: Look | None = None,
    recording: PlanRecording | None = None,
) -> PlanResult:
    """Plan and interpolate to the end; CncError if the program is wrong.

    ``live``: after so many cycles each the function is called with the engine
    (override steps, feed holds).  ``look`` is called after each piece of work
    and may raise.  ``recording`` is written whatever ends the plan.
    """
    cycles, change = live or (RECORD_ROWS, None)
    cell = program.cell
    jerk = jerk and bool(cell.axis_values("j_max_mm_s3").any())
    engine = Engine(cell, window=window, record_rows=RECORD_ROWS, jerk=jerk)
    check, kept = TrajectoryCheck(cell), []
    feeder = Feeder(
        program,
        engine,
        lambda batch: check.table.add(batch.rows, batch.pool),
        look,
    )
    end, failed = "interrupted", None
    try:
        if recording:
            recording.begin(engine)
        for event, rows in _driven(engine, feeder, cycles):
            if recording:
                recording.elements()
                recording.samples(rows)
            if event is Event.NEED_BLOCKS:
                continue
            samples = Samples.of(rows)
            check.add(samples)
            feeder.look()
            if keep_samples:
                kept.append(samples)
            if change and event is Event.DONE:
                change(engine)
        check.finish()
        out = _result(
            cell,
            engine,
            feeder,
            check,
            window or cell.channel.window,
            jerk,
            kept if keep_samples else None,
            _carried_deviation(program),
        )
        out.filters = [asdict(report) for report in program.filter_reports]
        out.filtered = {
            "deviation_mm": program.filtered.deviation_mm,
            "cut_mm": program.filtered.cut_mm,
        }
        end = "completed"
        return out
    except CncError as error:
        end, failed = "error", error
        raise
    finally:
        if recording:
            recording.finish(end, failed)
        engine.close()
        program.reader.close()


def _driven(
    engine: Engine, feeder: Feeder, cycles: int
) -> Iterator[tuple[Event, Rows]]:
    """Events up to the program's end, each with the cycles since the last one.

    Raises CncError: the engine has a fault.
    """
    event = Event.NEED_BLOCKS
    while event is not Event.PROGRAM_END:
        event = engine.run(cycles)
        if event is Event.NEED_BLOCKS:
            feeder.fill()
            yield event, NO_ROWS
            continue
        if event is Event.DRAINED:
            feeder.drained()
        rows = engine.take(Recorded.SAMPLES)
        if event is Event.FAULT:
            number = abs(int(engine.state.fault))
            raise CncError(number, ERRORS[number])
        yield event, rows


def _carried_deviation(program: Program) -> float:
    """Deviation, mm, that arises before the axis coordinates.

    Samples are compared with the path in axis coordinates alone.
    """
    carried = program.frames.deviation
    if program.kinematics.used:
        # of a frame: circles that were not smoothed
        carried = max(carried, program.smoothing.report.deviation)
    return carried + program.kinematics.deviation


def _result(
    cell: CellConfig,
    engine: Engine,
    feeder: Feeder,
    check: TrajectoryCheck,
    window: int,
    jerk: bool,
    kept: list[Samples] | None,
    carried: float,
) -> PlanResult:
    state = engine.state
    ratio: dict[str, float | None] = dict(check.ratio)
    if not jerk:
        ratio["jerk"] = None
    return PlanResult(
        blocks=feeder.rows,
        motion_time_s=float(state.motion_time_s),
        plan_cpu_s=float(state.plan_cpu_s),
        planner_us_per_ms=planner_pace(state),
        cycle_s=cell.cycle_s,
        max_ratio=ratio,
        path_deviation_mm=max(
            check.deviation, carried, feeder.program.contouring.report.deviation
        ),
        lookahead=window,
        infeasible=int(state.infeasible),
        time_by_cause=time_by_cause(state),
        jerk_limited=jerk,
        samples=_arrays(cell, kept) if kept is not None else None,
    )


def _arrays(cell: CellConfig, kept: list[Samples]) -> dict[str, Any]:
    """The contract's sample arrays: the first sample is the start at t = 0."""
    start = cell.axis_values("start_mm")[None, :]
    pos = np.vstack([start, *[s.pos for s in kept]])
    zero = np.zeros(1)
    return {
        "t": np.arange(len(pos)) * cell.cycle_s,
        "pos": pos,
        "axes": np.array(cell.axis_names),
        "s": np.concatenate([zero, *[s.path for s in kept]]),
        "v": np.concatenate([zero, *[s.speed for s in kept]]),
        "block": np.concatenate(
            [zero, *[s.element.astype(np.float64) for s in kept]]
        ),
    }


SAMPLE_SUFFIXES = (".npz", ".csv")


def check_samples_target(path: Path) -> None:
    """CncError if samples cannot be written as this kind of file."""
    if path.suffix.lower() not in SAMPLE_SUFFIXES:
        raise CncError(
            902001,
            f"samples {path}: the name must end in"
            f" {' or '.join(SAMPLE_SUFFIXES)}",
        )


def save_samples(path: str | Path, samples: dict[str, Any]) -> None:
    """Write the arrays to a file of exactly this name.

    ``.csv``: a row for each sample with the columns t, an axis each, s, v,
    block; the numbers read back are the same.  Else ``.npz``.
    """
    if Path(path).suffix.lower() == ".csv":
        _save_csv(Path(path), samples)
        return
    with Path(path).open("wb") as file:
        np.savez(file, **samples)


def _save_csv(path: Path, samples: dict[str, Any]) -> None:
    names = ["t", *map(str, samples["axes"]), "s", "v", "block"]
    columns = [samples[n] for n in ("t", "pos", "s", "v", "block")]
    np.savetxt(
        path,
        np.column_stack(columns),
        fmt="%.17g",
        delimiter=",",
        header=",".join(names),
        comments="",
    )
