"""A program on its way from text to final rows: front end, geometry stages, kinematics.

``Program`` is what every command uses; it knows no dialect and no engine.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cnc_core.blocks.pool import joined

from .. import frontend
from ..blocks import FILTER, NC_BLOCK, BlockBatch
from ..config import CellConfig
from ..errors import ERRORS, CncError, Place
from ..frontend.axes import ChannelAxes
from ..frontend.front_end import FrontEnd, Restartable
from ..frontend.machine import ProgramMachine
from ..frontend.operator import Operator, read_answers
from ..frontend.port import ChannelPort, OfflinePort, Wait
from ..frontend.signals import ChannelSignals
from ..geometry.filters.run_filter import FilterReport
from ..geometry.profiles.limits import AxisDynamics
from ..geometry.profiles.time_filter import ProfileFilter
from ..geometry.stages.asleep import Asleep
from ..geometry.stages.axis_limits import AxisLimits
from ..geometry.stages.contouring import (
    Contouring,
)
from ..geometry.stages.corner import Corners
from ..geometry.stages.deviation import Driven, Tap
from ..geometry.stages.frames import Frames
from ..geometry.stages.kinematics import TOLERANCE as CARRY_TOLERANCE
from ..geometry.stages.kinematics import KinematicsStage, ProgrammedView
from ..geometry.stages.orbit import Orbit
from ..geometry.stages.parameter_feed import ParameterFeed
from ..geometry.stages.path_mode import NoPathMode, PathMode
from ..geometry.stages.profiles import Profiles
from ..geometry.stages.radius_compensation import RadiusCompensation
from ..geometry.stages.rotary_lines import RotaryLines
from ..geometry.stages.smoothing import Smoothing
from ..geometry.stages.spline import Spline
from ..geometry.stages.stage import DropZeroLength, Pipeline, RefusedRow, Stage
from .exchange import Exchange, alone
from .gathered import Gathered
from .places import source_place, whole_blocks
from .restart import Passed, Restart, SearchingPort, way_to
from .stages import FILTERS, contour_machine, smoothing_machine

BATCH_ROWS = 4096
OWN_N = re.compile(r"\s*[nN](\d+)")
# behind what the stages hold; WAIT.CYCLE is one of them too, where it may
PLAIN_WAITS = (Wait.DRAINED, Wait.STOPPED, Wait.SIGNAL, Wait.CONDITION)


@dataclass
class Approach:
    """On the way to the place of a restart: a macro, the place, the path from
    there on.
    """

    macro: Program
    place: npt.NDArray[np.float64]
    rest: BlockBatch


class Program:
    """Rows of one program file, after all stages.

    ``start``: (axes,) where the axes stand, if not at the cell's ``start_mm``.
    ``collect``: go on behind errors and keep them in ``errors`` (the command
    ``check``).  ``lenient``: what a dialect calls so; for ISG unknown #
    commands and undefined M functions are warnings. ``programmed``: rows as
    they are ahead of the kinematics, which is followed for its errors only.
    ``answers``: file with answers to the program's dialogs, if no ``port`` is
    given. ``signals``: of the other channels, ``axes`` of the cell, ``channel``:
    its number, likewise.
    ``reader``: makes the front end, in place of that of the dialect.
    ``restart``: where to take the program up; everything before is executed
    without motion, where the dialect can be taken up. ``tolerance``: mm by which the path may leave
    the contour where the program says nothing about it.
    """

    def __init__(
        self,
        path: str | Path,
        cell: CellConfig,
        dialect: str | None = None,
        port: ChannelPort | None = None,
        *,
        collect: bool = False,
        lenient: bool = False,
        start: npt.NDArray[np.float64] | None = None,
        tolerance: float | None = None,
        programmed: bool = False,
        answers: Path | None = None,
        restart: Restart | None = None,
        reader: Callable[[ProgramMachine], FrontEnd] | None = None,
        signals: ChannelSignals | None = None,
        axes: ChannelAxes | None = None,
        channel: int = 1,
    ) -> None:
        self.path, self.cell, self.collect = Path(path), cell, collect
        machine = cell.program_machine(start)
        operator = Operator(read_answers(answers)) if answers else None
        self.port = port or OfflinePort(
            machine.start,
            cell.skip_mask,
            operator,
            signals,
            axes or alone(cell),
            channel,
        )
        self.dialect = dialect or frontend.detect(self.path)
        self._start, self._restart = machine.start, restart
        if restart is not None:
            self.port = self._searching = SearchingPort(self.port)
        self.reader: FrontEnd = (
            reader(machine)
            if reader
            else frontend.create(
                self.dialect,
                self.path,
                machine,
                self.port,
                collect=collect,
                lenient=lenient,
            )
        )
        if restart is not None and self.reader.restartable is None:
            raise CncError(
                900003,
                f"restart is not supported in the dialect {self.dialect}",
                Place(str(path)),
            )
        self._next: Wait | CncError | None = None
        self._gathered: Gathered | None = None  # where nobody drives
        # of a restart: rows ahead of the place are left out
        self._passed: Passed | None = None
        # of a restart: a macro on the way to the place
        self._approach: Approach | None = None
        self._again = (
            BlockBatch.empty()
        )  # functions that a restart puts out again
        if tolerance is None:
            tolerance = cell.channel.tolerance_mm
        contour = self._contour_stages(machine, tolerance, programmed)
        self.frames = Frames(
            Pipeline(contour), machine.start, machine.main, self.smoothing.turn
        )
        stages = self._axis_stages(machine, programmed)
        self._exchange = Exchange(cell, self.port, self.limits)
        self.pipeline = Pipeline(
            [
                self.profiles,
                self.frames,
                ProgrammedView(stages) if programmed else stages,
            ]
        )

    def _contour_stages(
        self, machine: ProgramMachine, tolerance: float, programmed: bool
    ) -> list[Stage]:
        """Stages of the path of the tip, in programmed coordinates."""
        cell, start, main = self.cell, machine.start, machine.main
        self.compensation = RadiusCompensation(
            start,
            main,
            self._place,
            self._warn,
            self.reader.collect_once if self.collect else None,
        )
        carried = CARRY_TOLERANCE if cell.kinematic_machines else 0.0
        self.smoothing = Smoothing(
            start,
            smoothing_machine(cell),
            tolerance,
            described=programmed,
            carried=carried,
        )
        self.filters = [kind(start, main) for kind in FILTERS]
        self._taps = [Tap(start, main, stage.code) for stage in self.filters]
        self.filtered = Tap(start, main)  # deviations of all filters together
        self.contouring = Contouring(
            start, contour_machine(cell), self._place, self._warn
        )
        # a check asks neither for feeds nor for deviations
        checked = self.collect and programmed
        return [
            Corners(start, main, self._place),
            self.compensation,
            DropZeroLength(),
            Orbit(start, main, self._place),
            Spline(start, main, self._place),
            Asleep(self._filter_stages(checked), FILTER, start),
            DropZeroLength(),
            NoPathMode() if checked else PathMode(start, main),
            self.contouring,
            self.smoothing,
            *([] if checked else [self._driven(start, main)]),
        ]

    def _filter_stages(self, checked: bool) -> list[Stage]:
        if checked:
            return list(self.filters)
        return [
            self.filtered,
            *(
                stage
                for pair in zip(self._taps, self.filters, strict=True)
                for stage in pair
            ),
        ]

    def _driven(
        self, start: npt.NDArray[np.float64], main: tuple[int, int, int]
    ) -> Driven:
        return Driven(start, main, [self.filtered, *self._taps])

    def _axis_stages(self, machine: ProgramMachine, programmed: bool) -> Stage:
        """Profiles, which come first, and the stages from the path of the tip
        to that of the axes.
        """
        cell, smoothing = self.cell, self.smoothing
        machines = dict(cell.kinematic_machines)  # profiles add their own
        self.profiles = Profiles(
            machine.main,
            self._place,
            machines,
            (cell.axis_values("min_mm"), cell.axis_values("max_mm")),
            AxisDynamics(
                *(
                    cell.axis_values(name)
                    for name in ("v_max_mm_s", "a_max_mm_s2", "j_max_mm_s3")
                )
            ),
            cell.cycle_s,
            described=programmed,
        )
        self.kinematics = KinematicsStage(
            machines,
            machine.start,
            machine.main,
            self._place,
            lambda: smoothing.carried or CARRY_TOLERANCE,
        )
        self.limits = AxisLimits(
            cell.axis_names,
            cell.main_axes,
            (cell.axis_values("min_mm"), cell.axis_values("max_mm")),
            cell.axis_values("start_mm"),
            self._place,
        )
        parameter = ParameterFeed(len(machine.axes), machine.main)
        return Pipeline(
            [
                self.kinematics,
                parameter,
                RotaryLines(machine.start, machine.main),
                ProfileFilter(self.profiles.filters),
                self.limits,
            ]
        )

    @property
    def filter_reports(self) -> list[FilterReport]:
        """Of the filters that have been used; deviations of what is driven from
        what came into each.
        """
        used = [
            pair
            for pair in zip(self._taps, self.filters, strict=True)
            if pair[1].report.blocks_in
        ]
        return [
            replace(
                stage.report, deviation_mm=tap.deviation_mm, cut_mm=tap.cut_mm
            )
            for tap, stage in used
        ]

    @property
    def filter_texts(self) -> list[str]:
        """What the filters have done, for the operator; of several together a
        line behind their own.
        """
        reports, whole = self.filter_reports, self.filtered
        texts = [str(report) for report in reports]
        if len(reports) > 1:
            texts.append(
                f"filters: deviation {whole.deviation_mm:.6f} mm, cut off {whole.cut_mm:.6f} mm"
            )
        return texts

    @property
    def errors(self) -> list[CncError]:
        """All errors found so far, in order of their lines."""
        order = {str(path): i for i, path in enumerate(self.reader.files)}
        return sorted(
            self.reader.errors,
            key=lambda e: (order.get(e.place.file, len(order)), e.place.line),
        )

    @property
    def bytes_read(self) -> int:
        """Bytes of the program's file that have been read."""
        return self.reader.bytes_read

    @property
    def number_now(self) -> int:
        """N of the block that is being read, 0 where it has none."""
        number = OWN_N.match(self.reader.place_now.source)
        return int(number[1]) if number else 0

    def read(self, rows: int = BATCH_ROWS) -> BlockBatch | Wait | None:
        """The next final rows, a wait, or None at the end.

        CncError for the first wrong block, behind all rows before it.
        """
        if self._approach is not None:
            return self._approaching(self._approach, rows)
        item = self._read(rows)
        return (
            item
            if self._passed is None or isinstance(item, Wait)
            else self._behind_place(item)
        )

    def _read(self, rows: int) -> BlockBatch | Wait | None:
        if self._next is not None:
            return self._deferred()
        if self._restart is not None:
            self._take_up(self._restart)
        try:
            item = self.reader.read(rows)
        except CncError as error:
            return self._behind_held(error)
        if isinstance(item, BlockBatch):
            if not len(item) and item.profile is None:
                return item  # the program computes
            return self._pushed(item)
        return self._behind_held(item) if item is None else self._wait(item)

    def _pushed(self, batch: BlockBatch) -> BlockBatch:
        """Rows of the front end through the stages, or gathered."""
        gathered = self._gathered
        if gathered is None:
            return self._staged(lambda: self.pipeline.push(batch), batch)
        if gathered.takes(batch):
            return self._put_through() if gathered.full else BlockBatch.empty()
        ahead = self._put_through()
        if self._next is not None:  # a row of them is refused
            return ahead
        out = self._staged(lambda: self.pipeline.push(batch), batch)
        return joined([ahead, out]) if len(ahead) else out

    def _put_through(self) -> BlockBatch:
        """What is gathered, through the stages."""
        if not self._gathered:
            return BlockBatch.empty()
        return self._gathered.put_through(
            self.limits.last, self._staged, lambda: self._next is not None
        )

    def _take_up(self, restart: Restart) -> None:
        """Everything up to the place, without motion; then the way there."""
        self._restart = None
        try:
            self._search(restart, self._restartable)
        except RefusedRow as refused:
            self.reader.close()
            raise refused.error from None
        except CncError:
            self.reader.close()
            raise

    @property
    def _restartable(self) -> Restartable:
        """The reader of a dialect with macros for restarts."""
        reader = self.reader.restartable
        assert reader is not None
        return reader

    def _search(self, restart: Restart, reader: Restartable) -> None:
        search = reader.search
        search.search(
            restart.line, restart.passes, restart.marker, restart.value
        )
        passed = Passed(self._start)
        while not search.found:
            item = reader.read(BATCH_ROWS)
            if item is None:
                raise CncError(
                    909170,
                    f"{ERRORS[909170]}: {restart}",
                    Place(str(self.path)),
                )
            if isinstance(item, BlockBatch):
                search.note(item)
                passed.rest(self.pipeline.push(item))
            elif item is not Wait.CYCLE or not self._compensated:
                passed.rest(self.pipeline.drain())
        if search.path_reaches_back:
            self._go_on_in_path(reader, passed, restart)
            return
        self.pipeline.drain()
        self.pipeline.resync(self._start)
        self._searching.found()
        search.take_up(self._start)

    def _go_on_in_path(
        self, reader: Restartable, passed: Passed, restart: Restart
    ) -> None:
        """The path behind the place depends on blocks before it: the stages
        keep what they hold.
        """
        passed.count = reader.block_count
        self._passed = passed
        self._searching.found()
        self._again = reader.search.go_on()

    def _behind_place(
        self, item: BlockBatch | None
    ) -> BlockBatch | Wait | None:
        """Rows behind the place of a restart; the first ones behind functions
        and the way there.
        """
        passed = self._passed
        assert passed is not None
        rest = BlockBatch.empty() if item is None else passed.rest(item)
        if item is not None and not len(rest):
            return rest
        self._passed = None
        reader, place = self._restartable, passed.place
        macro = reader.search.go_block_macro
        if macro is None:
            begin = self._from(self._start, passed.place, rest, self._again)
            return begin if len(begin) else item

        def macro_reader(machine: ProgramMachine) -> FrontEnd:
            return reader.macro_reader(
                macro, machine, place, run_type=reader.SEARCHING
            )

        before = Program(
            macro,
            self.cell,
            self.dialect,
            self.port,
            start=self._start,
            reader=macro_reader,
        )
        self._approach = Approach(before, place, rest)
        return self._again if len(self._again) else self.read()

    def _approaching(
        self, approach: Approach, rows: int
    ) -> BlockBatch | Wait | None:
        """Rows of the macro, then from its end to the place, then what was
        found there.
        """
        item = approach.macro.read(rows)
        if item is not None:
            return item
        self._approach = None
        begin = self._from(
            approach.macro.limits.last,
            approach.place,
            approach.rest,
            BlockBatch.empty(),
        )
        return begin if len(begin) else self.read(rows)

    def _from(
        self,
        here: npt.NDArray[np.float64],
        place: npt.NDArray[np.float64],
        rest: BlockBatch,
        ahead: BlockBatch,
    ) -> BlockBatch:
        """``ahead``, the way from ``here`` to the place, the rest of the path."""
        like = rest.rows[0] if len(rest) else np.zeros(1, NC_BLOCK)[0]
        speed = self._restartable.return_speed()
        return joined(
            [
                part
                for part in (ahead, way_to(place, here, speed, like), rest)
                if len(part)
            ]
        )

    def _wait(self, item: Wait) -> BlockBatch | Wait | None:
        """A wait, behind what the stages hold as far as it asks for that."""
        if item is Wait.AXES:
            return self._behind_held(item)
        if item is Wait.STOPPED and self.port.answers:
            self.pipeline.drain()  # it will not be driven
        elif item in PLAIN_WAITS or (
            item is Wait.CYCLE and not self._compensated
        ):
            if not self._gathered:
                return self._behind_held(item)
            self._gathered.drained = True
            self.port.moved(self._gathered.end(self.limits.last))
        return item

    @property
    def _compensated(self) -> bool:
        reader = self.reader.restartable
        return reader is not None and reader.compensated

    def _place(self, file: int, line: int) -> Place:
        return source_place(self.reader.files[file], line)

    def _warn(self, warning: CncError) -> None:
        self.reader.warnings.append(warning)
        self.port.message(str(warning))

    def _deferred(self) -> Wait:
        """What stands behind the rows handed out last.

        An error stays: nothing comes behind it.
        """
        item = self._next
        if isinstance(item, CncError):
            raise item
        assert item is not None
        self._next = None
        self.port.moved(self.limits.last)
        if item is Wait.AXES and not self.port.answers:
            self.axes_exchanged()
        return item

    def axes_exchanged(self) -> None:
        """Other axes stand at the channel's places: the path goes on from
        where they stand, within their limits.
        """
        position = self._exchange.limit(self.limits.last)
        self.port.moved(position)
        self.pipeline.resync(position)

    def begin_stop(self, position: npt.NDArray[np.float64]) -> None:
        """The axes have been stopped at ``position``: what the program has for
        that comes next, then its end.
        """
        self._next = None
        self.pipeline.drain()
        self.pipeline.resync(position)
        self._restartable.begin_stop(position)

    def resync(self, position: npt.NDArray[np.float64]) -> None:
        """The path goes on from ``position`` (axes,)."""
        self.pipeline.resync(position)

    def _behind_held(
        self, item: Wait | CncError | None
    ) -> BlockBatch | Wait | None:
        """What the stages hold comes first, then ``item``."""
        self._next = item
        ahead = self._put_through()
        if self._next is not item:  # a row of them is refused
            return ahead
        held = self._staged(self.pipeline.drain, BlockBatch.empty())
        held = joined([ahead, held]) if len(ahead) else held
        if len(held):
            return held
        return None if self._next is None else self._deferred()

    def _staged(
        self, step: Callable[[], BlockBatch], unstaged: BlockBatch
    ) -> BlockBatch:
        """The rows of one step; if a stage refuses one, those ahead of it, and
        the error comes next.
        """
        try:
            return step()
        except RefusedRow as refused:
            if self.collect:
                self.reader.collect_once(refused.error)
                return unstaged
            self._next = refused.error
            return whole_blocks(refused)

    def batches(self) -> Iterator[BlockBatch]:
        """All rows of a program that nobody drives: stops, M functions and
        waits are acknowledged at once.
        """
        if not self.port.answers and self._restart is None:
            self._gathered = Gathered(self.pipeline)
        while (item := self.read()) is not None:
            if isinstance(item, BlockBatch):
                yield item
