"""A cell of the soak in this process: engine, segment, PLC, and the judge.

Cycles run in batches inside of the engine.  Between two batches the PLC has its
scan.  Each sample is looked at: does the path stand, and does it have an order to?
"""

from __future__ import annotations

import math
import os
import random
import secrets
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from cnc_core._engine import lib

from cnc_core.config import parse_config
from cnc_core.engine import Engine, Event
from cnc_core.engine.recorded import Recorded
from cnc_core.process.identity import fill_identity
from cnc_core.process.preparation import Preparation
from hli import layout, segment
from hli.areas import Areas
from plc_client import AcknowledgeAll
from soak_programs import FIRST_FUNCTION, FUNCTIONS, Part, Point, part

CELL = (
    '[channel]\ninterpolator_function = "FCT_IPO_DEFAULT | FCT_CONTOUR_LAH"\n'
    "[channel.m_synch]\n"
    + "".join(
        f'{FIRST_FUNCTION + k} = "MVS_{"SVS" if k % 3 else "SNS"}"\n'
        for k in range(FUNCTIONS)
    )
)
NM = 1e-6
NM_A_M = 1e-9
TENTH_UM = 1e4
RING = 32_768
LONGEST_BATCH = 600  # cycles
STANDS_MM_S = 1e-6
NO_BLOCKS = lib.ENGINE_STOP_NO_BLOCKS
EXACT_STOP = 3
"""Cycles in which a path may touch zero without an order: it turns round at an
exact stop, and its start and end lie in a cycle of their own."""


@dataclass
class Sums:
    """What a soak has done so far."""

    cycles: int = 0
    programs: int = 0
    cells: int = 0
    motions: int = 0
    requests: int = 0
    functions: int = 0
    unseen: int = 0
    holds: int = 0
    overrides: int = 0
    plc_left: int = 0
    way_m: float = 0.0
    ordered_cycles: int = 0
    waits_cycles: int = 0
    no_blocks_cycles: int = 0
    unexplained_cycles: int = 0
    unexplained_longest: int = 0
    worst_end_nm: float = 0.0
    worst_way_nm_a_m: float = 0.0
    worst_distance_nm_a_m: float = 0.0
    wrong: list[str] = field(default_factory=list)

    def add(self, other: Sums) -> None:
        """Sums and the worst of both."""
        for member in fields(self):
            name = member.name
            mine, more = getattr(self, name), getattr(other, name)
            largest = name.startswith("worst") or name.endswith("longest")
            setattr(self, name, max(mine, more) if largest else mine + more)


class Stands:
    """Cycles in which the path stands, by cause, over the samples of a cell.

    Ordered: hold, override 0, the mode.  Waits: functions, dwells and stops of the
    program.
    """

    ORDERED = (
        lib.ENGINE_STOP_FEEDHOLD
        | lib.ENGINE_STOP_AXIS_HOLD
        | lib.ENGINE_STOP_OVERRIDE
        | lib.ENGINE_STOP_MODE
        | lib.ENGINE_STOP_RELEASE
    )

    def __init__(self, sums: Sums) -> None:
        self._sums = sums
        self._lasts = 0

    def look(self, samples: Any) -> None:
        """``samples``: rows of the engine's record, cycle by cycle."""
        stands = samples["speed"] <= STANDS_MM_S
        if not stands.any():
            self._lasts = 0
            return
        stops = samples["stops"]
        ordered = stands & ((stops & self.ORDERED) != 0)
        starved = stands & (stops == NO_BLOCKS)
        unexplained = stands & (stops == 0)
        sums = self._sums
        sums.ordered_cycles += int(ordered.sum())
        sums.no_blocks_cycles += int(starved.sum())
        sums.unexplained_cycles += int(unexplained.sum())
        counted = ordered | starved | unexplained
        sums.waits_cycles += int((stands & ~counted).sum())
        self._longest(unexplained)

    def _longest(self, unexplained: Any) -> None:
        """The longest stretch, over the border of two takes too."""
        sums = self._sums
        for is_one in unexplained.tolist() if unexplained.any() else ():
            self._lasts = self._lasts + 1 if is_one else 0
            longest = max(sums.unexplained_longest, self._lasts)
            sums.unexplained_longest = longest
        if not unexplained[-1]:
            self._lasts = 0


class Plc:
    """What the other side of the memory does between two batches."""

    def __init__(self, cell: Cell, rng: random.Random, sums: Sums) -> None:
        self._cell, self._rng, self._sums = cell, rng, sums
        self._channel = cell.segment.root.channel[0]
        self._clah = self._channel.contour_lookahead
        self._bahn = self._channel.bahn_mc_control
        self._fetch = AcknowledgeAll(Areas(cell.segment))
        self._asked: float | None = None
        self._asked_in = 0  # the cycle
        self._held, self._away = 0, 0
        self.seen: list[int] = []
        self._channel.head.plc_present_w = True

    def scan(self, one: Part) -> None:
        """Read the answer, ask again, acknowledge, hold or let go, leave or come."""
        if self._away:
            self._away -= 1
            if not self._away:
                self._channel.head.plc_present_w = True
            return
        self._read(one)
        self.seen += [function.number for function in self._fetch()]
        self._command()
        if self._rng.random() < 0.0005:
            self._leave()
        else:
            self._ask(one)

    def begin(self) -> None:
        """Another program: the answer to a request of the last one is left."""
        self._asked, self.seen = None, []

    def _ask(self, one: Part) -> None:
        clah, rng = self._clah, self._rng
        here = float(self._channel.bahn_state.dist_prog_start)
        ahead = rng.uniform(0.0, one.way * TENTH_UM / 20)
        self._asked = min(here + ahead, one.way * TENTH_UM)
        clah.request.start_position = self._asked
        clah.request.length = 5e4
        clah.semaphor_rw = True
        self._asked_in = int(self._cell.engine.state.cycle)

    def _read(self, one: Part) -> None:
        """The answer has come, and its first block is the one at the place."""
        asked = self._asked
        if asked is None or self._cell.engine.state.cycle == self._asked_in:
            return  # a batch without a cycle: the program has just ended
        self._sums.requests += 1
        if self._clah.semaphor_rw:
            self._sums.wrong.append("a request was not answered")
            return
        block = self._clah.response.block[0]
        if block.block_type == 0:
            return  # not prepared yet, or behind the end
        start, length = block.start_position, block.length
        k = bisect_right(one.starts, (start + 0.5) / TENTH_UM) - 1
        off = max(
            abs(start - one.starts[k] * TENTH_UM),
            abs(length - one.lengths[k] * TENTH_UM),
        )
        if not (start - 1 <= asked <= start + length + 1) or off > 1e-2:
            self._sums.wrong.append(f"asked for {asked}: {start}, {length}")

    def _command(self) -> None:
        rng, bahn = self._rng, self._bahn
        if self._held:
            self._held -= 1
        elif rng.random() < 0.01:
            self._held = rng.randrange(1, 4)
            self._sums.holds += 1
        self._level(bahn.feedhold, self._held > 0)
        if rng.random() < 0.02:
            self._sums.overrides += 1
            self._level(bahn.override_valid, True)
            self._level(bahn.override, rng.choice((1000, 1000, 700, 300)))

    def _leave(self) -> None:
        """It is gone for a while: its functions count as acknowledged."""
        self._level(self._bahn.feedhold, False)
        self._channel.head.plc_present_w = False
        self._asked, self._held = None, 0
        self._away = self._rng.randrange(1, 100)
        self._sums.plc_left += 1

    @staticmethod
    def _level(unit: Any, value: Any) -> None:
        unit.command_w = value
        unit.enable_w = True


class Cell:
    """An engine on a segment that drives programs one behind the other."""

    def __init__(self, folder: Path, rng: random.Random, sums: Sums) -> None:
        self._folder, self._rng, self._sums = folder, rng, sums
        self._config = parse_config(CELL)
        name = f"t{os.getpid()}-{secrets.token_hex(4)}"
        axes = len(self._config.axes)
        self.segment = segment.create(name, 1, axes, ready=False)
        root = self.segment.root
        fill_identity(root, self._config, "freerun", "cyclic", "soak")
        self.engine = Engine(
            self._config,
            segment=self.segment,
            clock=layout.HLI_CLOCK_FREERUN,
            record_rows=RING,
        )
        self.engine.stay(True)
        self._state = root.channel[0].bahn_state
        self._stands = Stands(sums)
        self._plc = Plc(self, rng, sums)
        sums.cells += 1

    def close(self) -> None:
        """It is gone, with its segment."""
        self._sums.cycles += int(self.engine.state.cycle)
        self.engine.close()
        self.segment.unlink()

    def drive(self, dialect: str, motions: int) -> None:
        """One program from where the axes stand to its end."""
        start = self._place()
        one = part(self._rng, dialect, start, motions)
        path = self._folder / "soak.nc"
        path.write_text(one.text)
        self._plc.begin()
        before = self.engine.state
        self.engine.begin_program()
        self._preparation = Preparation(
            path, self._config, dialect, self.engine
        )
        self._preparation.pump()
        ended = False
        while not ended:
            self._plc.scan(one)
            ended = self._batch(self._cycles())
        self._plc.scan(one)
        self._take()
        if self._preparation.error:
            self._sums.wrong.append(f"{dialect}: {self._preparation.error}")
        self._judge(one, int(before.techno_unseen))

    def _cycles(self) -> int:
        """Of the next batch: mostly long ones, each tenth a PLC's own scan."""
        rng = self._rng
        return rng.randrange(1, 9 if rng.random() < 0.1 else LONGEST_BATCH)

    def _batch(self, cycles: int) -> bool:
        """Whether the program has ended."""
        engine, events = self.engine, self._events
        left, at = cycles, int(engine.state.cycle)
        while left > 0:
            event = engine.run(left)
            if event is Event.DONE:
                return False
            if event is Event.PROGRAM_END:
                return True
            if event not in events:
                raise AssertionError(f"event {event.name}")
            events[event](self)
            left = cycles - (int(engine.state.cycle) - at)
        return False

    def _pump(self) -> None:
        self._preparation.pump()

    def _drained(self) -> None:
        self._preparation.drained()
        self._preparation.pump()

    def _take(self) -> None:
        samples = self.engine.take(Recorded.SAMPLES)
        self.engine.take(Recorded.FUNCTIONS)
        self.engine.take(Recorded.REQUESTS)
        if len(samples):
            self._stands.look(samples)

    _events: dict[Event, Callable[[Cell], None]] = {
        Event.NEED_BLOCKS: _pump,
        Event.DRAINED: _drained,
        Event.RECORD_FULL: _take,
    }

    def _place(self) -> Point:
        x, y, z, *_ = self.engine.state.position
        return float(x), float(y), float(z)

    def _judge(self, one: Part, unseen_before: int) -> None:
        """Add what the program came to."""
        sums, state = self._sums, self.engine.state
        sums.programs += 1
        sums.motions += len(one.starts)
        sums.way_m += one.way / 1000.0
        sums.functions += len(one.functions)
        unseen = int(state.techno_unseen) - unseen_before
        sums.unseen += unseen
        off = math.dist(self._place(), one.at) / NM
        way = abs(float(state.path) - one.way) / one.way / NM_A_M
        shown = float(self._state.dist_prog_start) / TENTH_UM
        distance = abs(shown - one.way) / one.way / NM_A_M
        sums.worst_end_nm = max(sums.worst_end_nm, off)
        sums.worst_way_nm_a_m = max(sums.worst_way_nm_a_m, way)
        sums.worst_distance_nm_a_m = max(sums.worst_distance_nm_a_m, distance)
        if max(off, way, distance) > 1.0:
            sums.wrong.append(
                f"{one.dialect}: ends {off:.3g} nm beside, way off by {way:.3g}"
                f" and {distance:.3g} nm a metre"
            )
        self._judge_functions(one, unseen)

    def _judge_functions(self, one: Part, unseen: int) -> None:
        """Each once and in order, but for those that no PLC was there for."""
        rest = iter(one.functions)
        in_order = all(number in rest for number in self._plc.seen)
        if not in_order or len(self._plc.seen) + unseen != len(one.functions):
            self._sums.wrong.append(
                f"{one.dialect}: functions {self._plc.seen} and {unseen} unseen"
                f" of {one.functions}"
            )
