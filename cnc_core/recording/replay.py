"""A PLC program against a recorded CNC: where does it write something else than
the recorded one did?

The CNC cannot react to it any more, so the first difference counts most.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from hli._sync import lib

from hli.errors import HliTimeout
from hli.members import Member, member_at
from hli.structures import HLI_EXT_VAR
from hli.symbol import Symbol, SymbolError
from hli.view import telling_first_use
from plc_client import builtin, stats
from plc_client.client import connect
from plc_client.guard import Guard
from plc_client.inputs import inputs_of
from plc_client.online import check, number_of, parse_force
from plc_client.pace import CyclePacer
from plc_client.program import Program
from plc_client.scan import Scanner
from plc_client.scan_loop import entry_of
from plc_client.sources import load_tasks

from .reading import Recording
from .recorded_answers import Answers
from .recorded_cnc import Difference, RecordedCnc, know, no_scans, seek
from .recorded_scans import Batch, Scan, batches_of, symbols_of
from .source import not_a_recording

NEVER_STILL = "the recorded memory never stands still"


@dataclass
class Deviation:
    """The first member that the new PLC left otherwise: ``old`` is what the
    recorded one wrote, ``line`` the line of the NC program, 0: none.
    """

    scan: int
    cycle: int
    t: float
    line: int
    member: str
    old: Any
    new: Any

    def as_json(self) -> dict[str, Any]:
        """The members."""
        return dict(vars(self))


@dataclass
class Replay:
    """What a replay found.  ``counts``: scans by member at whose end it differed."""

    scans: int = 0
    time_s: float = 0.0
    wall_s: float = 0.0
    first: Deviation | None = None
    counts: dict[str, int] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    @property
    def equal(self) -> bool:
        """Whether the new PLC wrote what the recorded one did."""
        return self.first is None

    def as_json(self) -> dict[str, Any]:
        """The object that the command prints."""
        return {
            "scans": self.scans,
            "realtime_factor": self.time_s / max(self.wall_s, 1e-9),
            "equal": self.equal,
            "first": self.first.as_json() if self.first else None,
            "counts": self.counts,
            "warnings": self.warnings,
        }


def programs_of(
    plc: str, args: dict[str, Any] | None = None, words: Sequence[str] = ()
) -> list[Program]:
    """The tasks of a file (Python, or Structured Text with its options ``words``)
    or of ``builtin:NAME``, which takes ``args``.

    PlcError: the file is wrong.  ValueError: no such built-in program.
    """
    if plc.startswith("builtin:"):
        name = plc.removeprefix("builtin:")
        return [Program.of(builtin.load(name), args or {}, name=name)]
    return [Program.of(cls) for cls in load_tasks(plc, words=words)]


def replay(recording: Recording, programs: Sequence[Program]) -> Replay:
    """Run the programs against the recording, scan by scan, as quickly as they
    go.

    CncError: the recording holds no scans.  PlcError: the user's code fails.
    """
    out = Replay()
    with RecordedCnc(recording) as cnc:
        _Run(recording, cnc, programs, out).all()
    return out


class _Run:
    """One replay on its way."""

    def __init__(
        self,
        recording: Recording,
        cnc: RecordedCnc,
        programs: Sequence[Program],
        out: Replay,
    ) -> None:
        self._recording, self._cnc = recording, cnc
        self._programs, self._out = programs, out
        about = recording.meta.get("plc", {})
        try:
            self._inputs = inputs_of(about.get("inputs"))
            self._forced = [parse_force(one) for one in about.get("force", ())]
        except ValueError as error:
            raise not_a_recording(recording.path, str(error)) from None
        self._answers = Answers(cnc.areas, recording)
        self._members: dict[int, list[Member]] = {}
        self._differing: list[int] = []
        self._known = Difference([], [], [])
        self._paths: list[str] = []  # of the members that differ
        self._symbols: list[tuple[int, str, Symbol]] = []
        self._begun_s = 0.0

    def all(self) -> None:
        """Every scan of the recording."""
        batches = batches_of(self._recording)
        batch = next(batches, None)
        if batch is None:
            raise no_scans(self._recording)
        first = batch.scan(0)
        self._begun_s = first.time_s
        self._out.scans = -1  # setup() is none
        if any(entry_of(program) for program in self._programs):
            self._cnc.compare_external()  # compiled code needs no view
        begun = time.monotonic()
        self._cnc.begin(first)
        guard = Guard()
        with (
            telling_first_use(HLI_EXT_VAR, "value", self._cnc.compare_external),
            stats.unmeasured(),
            connect(self._cnc.name, present=False) as hli,
        ):
            scanner = Scanner(
                hli,
                self._programs,
                CyclePacer(hli),
                guard=guard,
                inputs=self._inputs,
            )
            try:
                self._force(scanner)
                scanner.start()
                self._end(first)
                self._watch(scanner)
                self._batch(scanner, batch, 1)
                for batch in batches:
                    self._batch(scanner, batch, 0)
            finally:
                scanner.close()
                guard.close()
        self._out.wall_s = time.monotonic() - begun
        self._warn(scanner)

    def _batch(self, scanner: Scanner, batch: Batch, at: int) -> None:
        """The scans of a batch from this one on."""
        row = self._cnc.rows(batch)
        while at < len(batch):
            if self._answers.concern(self._differing):
                self._one(scanner, batch, at)
                at += 1
                continue
            seek(row, batch, at)
            know(row, self._known)
            if self._in_c(scanner):
                self._scans_in_c(scanner, batch, row)
            else:
                self._scans_in_python(scanner, batch, row)
            at = int(row.next)
        self._out.scans += len(batch)
        self._out.time_s = float(batch.times[-1]) - self._begun_s

    def _one(self, scanner: Scanner, batch: Batch, at: int) -> None:
        """A scan ahead of which the CNC has to answer."""
        scan = batch.scan(at)
        self._begin(scan)
        if self._when_due(scanner)(scan.cycle):
            scanner.scan()
        self._end(scan)
        self._compare_symbols(batch, at, [self._watched()])

    def _in_c(self, scanner: Scanner) -> bool:
        """Whether nothing of the next scan needs Python."""
        return scanner.in_c and self._cnc.lockstep and not self._symbols

    def _scans_in_c(self, scanner: Scanner, batch: Batch, row: Any) -> None:
        """Scans in C up to the batch's end or the first that leaves something
        otherwise than the one before.
        """

        def loop(scans: Any) -> int:
            row.scans = scans
            result: int = lib.hs_replay_scans(row)
            return result

        result = scanner.scan_by(loop)
        if result == lib.HS_TIMEOUT:
            raise HliTimeout(NEVER_STILL)
        self._found(row)
        if result == lib.HS_ASIDE:
            self._note(batch.scan(row.next - 1))

    def _scans_in_python(
        self, scanner: Scanner, batch: Batch, row: Any
    ) -> None:
        """The same with tasks in Python: C does what is between them."""
        first, cycles = row.next, batch.cycles.tolist()
        begin, end, image = lib.hs_replay_begin, lib.hs_replay_end, scanner.now
        scan = self._scan_when_due(scanner)
        watched, values = bool(self._symbols), []
        result = lib.HS_OK
        for cycle in cycles[first:]:
            if begin(row, image) != lib.HS_OK:
                raise HliTimeout(NEVER_STILL)
            scan(cycle)
            result = end(row)
            if watched:
                values.append(self._watched())
            if result != lib.HS_OK:
                break
        self._found(row)
        aside = result == lib.HS_ASIDE
        self._compare_symbols(batch, first, values[:-1] if aside else values)
        if aside:
            self._note(batch.scan(row.next - 1))
            self._compare_symbols(batch, row.next - 1, values[-1:])

    def _found(self, row: Any) -> None:
        """What scans have left that began and ended in C."""
        self._count(row.same)
        row.same = 0
        self._differing = list(row.found[0 : row.differing])

    def _begin(self, scan: Scan) -> None:
        differing = self._differing
        if differing:
            self._answers.before(differing)
        self._cnc.begin(scan)
        if differing:
            self._answers.after()

    def _when_due(self, scanner: Scanner) -> Callable[[int], bool]:
        """Whether tasks are due in a cycle; where the recorded PLC ran by the
        wall clock, those that are due soon count.
        """
        if self._cnc.lockstep:
            due = scanner.next_due
            return lambda cycle: due() <= cycle

        def soon(cycle: int) -> bool:
            for program in scanner.programs:
                if program.due <= cycle + program.interval_ticks // 2:
                    program.due = min(program.due, cycle)
            return scanner.next_due() <= cycle

        return soon

    def _scan_when_due(self, scanner: Scanner) -> Callable[[int], None]:
        """The scan of a cycle of the image that is latched."""
        is_due, scan = self._when_due(scanner), scanner.scan_latched

        def scan_if_due(cycle: int) -> None:
            if is_due(cycle):
                scan()

        return scan_if_due

    def _end(self, scan: Scan) -> None:
        self._differing = self._cnc.end(scan)
        if self._differing:
            self._note(scan)

    def _note(self, scan: Scan) -> None:
        """Count the members that differ; tell the first of all."""
        found = self._cnc.difference(self._differing)
        if found != self._known:  # most often they stay as they are
            self._known = found
            self._paths = list(self._told(scan))
        self._count(1)

    def _count(self, scans: int) -> None:
        counts = self._out.counts
        for path in self._paths if scans else ():
            counts[path] = counts.get(path, 0) + scans

    def _told(self, scan: Scan) -> Iterator[str]:
        old, new = self._cnc.recorded.data.cast("B"), self._cnc.bytes
        for member in dict.fromkeys(
            member for word in self._differing for member in self._at(word)
        ):
            a, b = member.value(old), member.value(new)
            if not _same(a, b):
                self._tell_first(scan, member.path, a, b)
                yield member.path

    def _tell_first(self, scan: Scan, path: str, old: Any, new: Any) -> None:
        if self._out.first is None:
            line = _line_at(self._recording, scan.cycle)
            self._out.first = Deviation(
                scan.number, scan.cycle, scan.time_s, line, path, old, new
            )

    def _force(self, scanner: Scanner) -> None:
        """What was held from the start of the recorded run."""
        for path, value in self._forced:
            try:
                scanner.forces.hold(path, scanner.symbols[path], value)
            except SymbolError as error:
                self._out.warnings.append(f"not forced: {error}")

    def _watch(self, scanner: Scanner) -> None:
        """The symbols that were watched, as far as the new PLC has them."""
        for i, path in enumerate(symbols_of(self._recording)):
            try:
                symbol = scanner.symbols[path]
                check(symbol)
            except SymbolError as error:
                self._out.warnings.append(f"not compared: {error}")
            else:
                self._symbols.append((i, path, symbol))

    def _watched(self) -> list[float]:
        """The watched symbols now."""
        return [number_of(symbol.value) for _, _, symbol in self._symbols]

    def _compare_symbols(
        self, batch: Batch, first: int, values: list[list[float]]
    ) -> None:
        """The symbols at the ends of scans from this one on."""
        if not self._symbols or not values:
            return
        columns = [i for i, _, _ in self._symbols]
        old = batch.watched[first : first + len(values), columns]
        new = np.array(values)
        differ = (old != new) & ~(np.isnan(old) & np.isnan(new))
        for row, k in np.argwhere(differ)[:1]:
            scan, path = batch.scan(first + int(row)), self._symbols[k][1]
            a, b = float(old[row, k]), float(new[row, k])
            self._tell_first(scan, path, a, b)
        counts = self._out.counts
        for (_, path, _), n in zip(
            self._symbols, differ.sum(axis=0).tolist(), strict=True
        ):
            if n:
                counts[path] = counts.get(path, 0) + n

    def _at(self, word: int) -> list[Member]:
        """The members that a PLC writes in these 8 bytes."""
        if word not in self._members:
            mask = self._cnc.masks[word : word + 1].view(np.uint8)
            places = (word * 8 + int(i) for i in np.flatnonzero(mask))
            members = (member_at(place) for place in places)
            self._members[word] = list(
                dict.fromkeys(member for member in members if member)
            )
        return self._members[word]

    def _warn(self, scanner: Scanner) -> None:
        out = self._out
        out.warnings += [t for p in scanner.programs for t in p.warnings]
        if not self._recording.complete:
            out.warnings.append(
                f"the recording is not complete: {out.scans} scans are replayed"
            )
        missing = self._recording.meta.get("lost", {})
        lost = missing.get("plc", 0) + missing.get("exchange", 0)
        if lost:
            out.warnings.append(
                f"{lost} rows of the PLC were lost when it was recorded: behind"
                " them the replay differs although the PLC does not"
            )
        out.warnings += [
            f"task {p.name}: {p.overruns} scans are left out; the recorded PLC"
            " was not scanned then"
            for p in scanner.programs
            if p.overruns and self._cnc.lockstep
        ]
        if not self._cnc.lockstep:
            out.warnings.append(
                "recorded outside of lockstep: the PLC may have read control"
                " units and semaphores at any time of a scan; what both sides"
                " write is not compared"
            )
        if self._answers.log_requests:
            out.warnings.append(
                f"{self._answers.log_requests} requests of the marked log that"
                " the recorded PLC did not make were answered with nothing"
            )


def _same(a: Any, b: Any) -> bool:
    return bool(a == b or (a != a and b != b))  # noqa: PLR0124 (NaN)


def _line_at(recording: Recording, cycle: int) -> int:
    """The line of the NC program in this cycle."""
    if recording.channels:  # of the first one
        recording = recording.channel(recording.channels[0])
    cycles = recording.cycles
    if "line" not in cycles.columns or not len(cycles):
        return 0
    for chunk in cycles.chunks(["cycle", "line"]):
        known = chunk.column(0).to_numpy()
        if known[-1] >= cycle:
            at = int(np.searchsorted(known, cycle))
            return int(chunk.column(1)[at].as_py())
    return int(chunk.column(1)[-1].as_py())
