"""The recording of a CNC process."""

from __future__ import annotations

import json
import shutil
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..config import CellConfig, ChannelSetup, load_config, setups_of
from ..engine import Engine
from ..recording.account import account, as_bytes
from ..recording.parts import Parts, part_of_channel
from ..recording.recorder import Recorder, check_columns
from .identity import scratch_folder
from .options import CncOptions


def recorder_for(
    engine: Engine,
    setup: ChannelSetup,
    options: CncOptions,
    file: Path | None,
    axes: Collection[str],
) -> Recorder | None:
    """Who records this channel, if anything is to be recorded.

    ``file``: its program.  ``axes``: those of all channels.
    """
    if options.samples is None:
        return None
    cell, place = setup.cell, setup.place
    about = account(file, cell, options.run.clock, options.config, place)
    return Recorder(
        engine,
        part_of_channel(options.samples, place.index),
        cell,
        as_bytes(about),
        columns_of_channel(options.run.record_only, cell, axes),
    )


def columns_of_channel(
    only: tuple[str, ...], cell: CellConfig, axes: Collection[str]
) -> tuple[str, ...]:
    """What is recorded of a channel: axes of others are not meant for it."""
    foreign = set(axes) - set(cell.axis_names)
    own = len(cell.axes) - cell.guests
    guests: tuple[str, ...] = ()
    if any(name.rpartition(".")[2] in axes for name in only):
        guests = cell.axis_names[own:]  # any axis may come
    left = guests + tuple(
        name for name in only if name.rpartition(".")[2] not in foreign
    )
    return left or (("cycle",) if only else ())


def check_record_only(config: CellConfig, only: tuple[str, ...]) -> None:
    """CncError 902001 for a name that is no table and no column of a channel."""
    setups = setups_of(config)
    axes = axes_of(setups)
    for setup in setups:
        check_columns(setup.cell, columns_of_channel(only, setup.cell, axes))


def axes_of(setups: Iterable[ChannelSetup]) -> set[str]:
    """The names of the axes of all channels."""
    return {name for setup in setups for name in setup.cell.axis_names}


def missing_rows(recorder: Recorder | None) -> dict[str, Any]:
    """What is missing in the recording, and why."""
    if recorder is None:
        return {}
    return {"lost": recorder.lost, "problem": recorder.problem}


@dataclass
class Missing:
    """What is missing in a recording.

    ``lost``: rows by table; ``problem``: why, empty if the writer was too slow.
    """

    lost: dict[str, int]
    problem: str

    @classmethod
    def of(cls, *reports: dict[str, Any], start: str = "") -> Missing:
        """What the reports of the processes tell; ``start``: what was wrong
        ahead of the first row.
        """
        said = [report.get("recording", {}) for report in reports]
        lost = {
            table: count
            for one in said
            for table, count in one.get("lost", {}).items()
        }
        problems = [start, *(one.get("problem", "") for one in said)]
        return cls(lost, next(filter(None, problems), ""))

    def told(self) -> list[str]:
        """For people; nothing if nothing is missing."""
        if not self.lost:
            return []
        why = self.problem or "the writer was too slow"
        counts = ", ".join(f"{n} of {table}" for table, n in self.lost.items())
        return [f"recording: rows are missing: {counts}: {why}"]


class SoleRecording:
    """The recording of a CNC process that nobody has launched.

    A context manager: behind it the file is written, whatever ended the process;
    a process that did not start leaves the file as it was.
    ``told``: what somebody should know at the end.  CncError behind the process:
    the file could not be written.
    """

    def __init__(
        self, target: Path, config: Path | None, only: tuple[str, ...]
    ) -> None:
        check_record_only(load_config(config), only)
        self._parts = Parts(target)
        self._folder = scratch_folder()
        self._report = self._folder / "cnc.json"
        self.told: list[str] = []
        if self._parts.recovered:
            self.told.append(
                f"recording: what a dead run left is now {self._parts.recovered}"
            )

    def options(self, options: CncOptions) -> CncOptions:
        """The options of the process, which records its part."""
        return replace(options, samples=self._parts.cnc, report=self._report)

    def __enter__(self) -> SoleRecording:
        return self

    def __exit__(self, *_: object) -> None:
        try:
            report = json.loads(self._report.read_text())
        except (OSError, ValueError):
            report = {}
        shutil.rmtree(self._folder, ignore_errors=True)
        if not report and not self._parts.cnc.exists():
            self._parts.drop()  # the process did not start
            return
        missing = Missing.of(report, start=self._parts.problem)
        self.told += missing.told()
        self._parts.finish(end=report.get("end", "error"), lost=missing.lost)
