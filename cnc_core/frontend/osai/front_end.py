"""Front end of 10-Series programs: the main program line by line, profiles (G61
.. G60) as columns.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from cnc_core import plain
from cnc_core.blocks import STANDSTILL, BlockBatch, M, S, T
from cnc_core.blocks.profile_columns import (
    CONTROL_POINTS,
    POINTS,
    POLYNOMIALS,
    ProfileChunk,
)
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.files import Folders
from cnc_core.frontend.base.block_text import (
    BlockText,
    PhysicalLine,
    check_length,
    read_line,
)
from cnc_core.frontend.base.flow import START, Level
from cnc_core.frontend.base.guess import guess
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.reader import BlockReader
from cnc_core.frontend.base.scanner import Modal, MotionWords, Row, Rules
from cnc_core.frontend.machine import ProgramMachine, Tool
from cnc_core.frontend.osai import codes
from cnc_core.frontend.osai.bsplines import BsplineProfile
from cnc_core.frontend.osai.polynomials import PolynomialProfile
from cnc_core.frontend.osai.profile import Context, PointProfile, Profile
from cnc_core.frontend.osai.setup import Records, SetupFile
from cnc_core.frontend.osai.spec import Active, build, check, unused
from cnc_core.frontend.osai.variables import Variables, assignment
from cnc_core.frontend.osai.words import Words, parse, unknown_word
from cnc_core.units import FloatArray

from ..port import ChannelPort, Wait

PROFILES: dict[str, type[Profile]] = {
    POINTS: PointProfile,
    POLYNOMIALS: PolynomialProfile,
    CONTROL_POINTS: BsplineProfile,
}
CODE = re.compile(
    r"\s*\(\s*([A-Za-z][A-Za-z0-9_]{2})\s*(?:,\s*([^)]*?)\s*)?\)\s*$"
)
MEANT_SETUP = re.compile(r"[^(]*\(\s*H[A-Z]*", re.I)
ASSIGNMENT = re.compile(r"\s*(?:N[0-9]+\s*)?([EL][0-9]+|JRS)\s*=")
NUMBERED = re.compile(r"\s*N[0-9]+\s*(?=\()")
END_OR_BEGIN = re.compile(rb"^[ \t]*(?:N[0-9]+[ \t]*)?G6[01]\b", re.M)
BEGIN = re.compile(r"[ \t]*(?:N[0-9]+[ \t]*)?G61\b")
DEGREES = (3, 4, 5)
SUPPORTED_G = {0, 1, 60, 61, 70, 71, 90, 91}
ARCS = (2, 3)
NO_MAIN = "PIJKR"  # words of G61 and of arcs
STANDARD_M = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 30}
GROUPS = ((0, 1), (70, 71), (90, 91))


class OsaiFrontEnd(BlockReader):
    """Resumable reader of one program.

    ``setups``: what ``check`` prints of every setup that was activated.

    ``lenient``: a gap between polynomials is a warning.  ``setup``: holds in
    place of what (HSM,..) names.
    """

    def __init__(
        self,
        path: Path,
        machine: ProgramMachine,
        port: ChannelPort,
        *,
        collect: bool = False,
        lenient: bool = False,
        setup: Path | None = None,
    ) -> None:
        super().__init__(
            path, Modal(machine, Rules()), port, collect=collect, scan=False
        )
        self._machine, self._strict = machine, not lenient
        self._axes = {
            name: i for i, name in enumerate(machine.axes) if len(name) == 1
        }
        self._letters = "".join(self._axes) + "FST"
        self._variables = Variables()
        self._given = setup
        self._found: dict[str, Path] = {}  # called files by name
        self._setup = SetupFile(setup) if setup else None
        self._profile: Profile | None = None
        self._spec_ok, self._no_setup = True, False
        self._virtual: frozenset[str] = frozenset()
        self._saved: tuple[object, ...] = ()
        self._tool, self._active = 0, Tool()
        # where the axes stand is known when the wait behind a profile is over
        self._awaited = self._resync = False

    @property
    def variables(self) -> Variables:
        """Values of the E and L variables as they are now."""
        return self._variables

    # BlockReader

    def _take_block(self) -> BlockText | None:
        return read_line(self._source, self.modal.line)

    def read(self, rows: int) -> BlockBatch | Wait | None:
        """Rows, or the columns of a profile; see ``BlockReader.read``."""
        if self._resync:
            self._resync = False
            self.modal.set_position(self._port.position())
        item = (
            super().read(rows)
            if self._profile is None or self._queue
            else self._profile_batch(rows)
        )
        if isinstance(item, Wait):  # it comes true before the next call
            self._resync, self._awaited = self._awaited, False
        if self._ended:
            self.flow.close()
        return item

    def _advance(self, out: Row) -> int:
        if self._profile is not None:
            self._breath = 1 << 60  # the profile goes on in ``read``
            return 0
        return super()._advance(out)

    def _level_ended(self) -> None:
        if self._profile is not None:
            self._profile = None
            text = self._source.path.name
            error = CncError(
                909222, f"{ERRORS[909222]}: {text} ends", self._here()
            )
            self._collect_all([error])
            if not self._collect:
                self._queue.append(error)
                self._ended = True
                return
        super()._level_ended()

    # the main program

    def _execute(self, block: BlockText) -> list[Row | Wait]:
        check_length(block)
        text = block.text.partition(";")[0]
        if text.lstrip().startswith("/"):
            if self._port.skip_levels() & 1:
                return []
            text = text.replace("/", " ", 1)
        numbered = NUMBERED.match(text)
        body = (
            " " * numbered.end() + text[numbered.end() :] if numbered else text
        )
        if body.lstrip().startswith("("):
            self._code(body, block)
            return []
        if found := ASSIGNMENT.match(text):
            assignment(text, self._variables, found.start(1))
            return []
        if text.lstrip().startswith("<"):
            raise fail(
                909221, "a polynomial outside G61 .. G60", text.index("<")
            )
        return self._words(
            parse(text, self._variables, self._letters, more=NO_MAIN), text
        )

    def _code(self, text: str, block: BlockText) -> None:
        """A three-letter code."""
        begin = text.index("(")
        found = CODE.match(text)
        # a setup is meant: that none is open needs no error of its own
        self._no_setup |= bool(MEANT_SETUP.match(text))
        if not found:
            raise fail(
                900010, "a three-letter code has the form (CODE,...)", begin
            )
        code = found[1]
        argument = (found[2] or "").strip()
        if code == "HSM":
            self._open_setup(argument, begin)
        elif code == "CLS":
            self._call(argument, begin)
        elif code in codes.VIRTUALISATIONS:
            active = bool(argument) and argument != "0"
            self._virtual = (
                (self._virtual | {code}) if active else (self._virtual - {code})
            )
        else:
            raise fail(
                900003 if code.isupper() else 900002,
                f"({code}) is not supported"
                + guess(code, ("HSM", "CLS", *codes.VIRTUALISATIONS)),
                begin,
            )

    def _open_setup(self, name: str, offset: int) -> None:
        if not name:
            raise fail(909201, "(HSM,file) names no setup file", offset)
        path = self._given or self._beside(name, offset)
        if path is None:
            self._setup = None
            raise fail(909201, f"setup file {name} not found", offset)
        self._setup = SetupFile(path, self._reach(path))
        records, errors = self._setup.resolve(self._variables)
        errors += [] if errors else check(records, self._machine)
        self._spec_ok = not errors
        if not errors:
            self.setups.append(records.as_json())
        for error in unused(records):
            self._warn(error.code, error.text, error.place)
        self._report(errors)

    def _report(self, errors: list[CncError]) -> None:
        """Errors in a setup: each with its own place there."""
        if not errors:
            return
        for error in errors:
            if path := error.place.file:
                self.flow.file_of(Path(path))
        if self._collect:
            self._collect_all(errors)
            return
        self._collect_all(errors[:1])
        self._queue.append(errors[0])
        self._ended = True

    def _reach(self, path: Path) -> Folders | None:
        """Where a setup may lie; None for the one that the user has given."""
        return None if path == self._given else self.flow.folders

    def _beside(self, name: str, offset: int) -> Path | None:
        folders = self.flow.folders
        names = [
            name,
            *(name + suffix for suffix in (".osai", ".hsm", ".nc", ".txt")),
        ]
        try:
            places = [folders.place(n, folders.own) for n in names]
            return next((path for path in places if folders.has(path)), None)
        except CncError as error:
            raise fail(error.code, error.text, offset) from None

    def _call(self, name: str, offset: int) -> None:
        path = self._found.get(name)
        if path is None and name:
            path = self._beside(name, offset)
        if path is None:
            raise fail(
                907030, f"subprogram {name or '(no name)'} not found", offset
            )
        self._found[name] = path
        self.flow.call(Level(self.flow.file_of(path), START, name))

    def _words(self, words: Words, text: str) -> list[Row | Wait]:
        for code, offset in words.g.items():
            if code in ARCS:
                raise fail(
                    900003,
                    f"G{code:02d} is not supported: lines and profiles only",
                    offset,
                )
            if code in codes.TRANSITIONS:
                raise fail(909221, f"G{code} outside G61 .. G60", offset)
            if code not in SUPPORTED_G:
                raise fail(900003, f"G{code} is not supported", offset)
        for group in GROUPS:
            if all(code in words.g for code in group):
                raise fail(
                    900011,
                    f"G{group[0]} and G{group[1]} in one block",
                    words.g[group[1]],
                )
        if words.n is not None:
            self.modal.n = words.n
        if 61 in words.g:
            try:
                self._begin_profile(words)
            except CncError:
                if self._collect:
                    self._skip_profile()
                raise
            return []
        if 60 in words.g:
            raise fail(909221, "G60 without G61", words.g[60])
        unknown = next(
            (letter for letter in NO_MAIN if letter in words.values), None
        )
        if unknown:
            raise unknown_word(unknown, self._letters, words.offsets[unknown])
        return self._functions(words) + self._motion(words) + self._stops(words)

    def _functions(self, words: Words) -> list[Row | Wait]:
        n, rows = self.modal.n, []
        for code, offset in words.m.items():
            if code not in STANDARD_M and code not in self._machine.m_functions:
                raise fail(
                    900009,
                    f"M{code} is not defined: give its synchronisation (m_synch)",
                    offset,
                )
        if "S" in words.values:
            rows.append(self.modal.row(S, n, value=words.values["S"]))
        if "T" in words.values:
            self._tool = int(words.values["T"])
            rows.append(self.modal.row(T, n, code=self._tool))
        if 6 in words.m:
            self._change_tool(words.m[6])
        rows += [
            self.modal.row(M, n, code=code)
            for code in words.m
            if code not in (0, 1, 2, 30)
        ]
        return [*rows]

    def _change_tool(self, offset: int) -> None:
        """M6: the offset of the tool is active."""
        if self._tool and self._tool not in self._machine.tools:
            raise fail(900014, f"the machine has no tool {self._tool}", offset)
        self._active = self._machine.tools.get(self._tool, Tool())
        if not self._five_axes:
            self.modal.set_tool_length(self._active.length_mm)

    @property
    def _five_axes(self) -> bool:
        return sum(self._machine.rotary) >= 2

    def _motion(self, words: Words) -> list[Row | Wait]:
        motion = MotionWords(
            axis={
                self._axes[a]: v
                for a, v in words.values.items()
                if a in self._axes
            }
        )
        if self._virtual and motion.axis:
            raise fail(
                900003,
                f"motion while ({min(self._virtual)}) is active is not supported",
                0,
            )
        motion.motion = next(
            (code for code in (0, 1) if code in words.g),
            None,
        )
        motion.f = words.values.get("F")
        motion.n = self.modal.n
        motion.absolute = None if not {90, 91} & set(words.g) else 90 in words.g
        motion.inch = None if not {70, 71} & set(words.g) else 70 in words.g
        error, row = self.modal.apply(motion)
        if error:
            raise fail(
                error, ERRORS[error], min(words.offsets.values(), default=0)
            )
        return [] if row is None else [row]

    def _stops(self, words: Words) -> list[Row | Wait]:
        stops = [m for m in (0, 1, 2, 30) if m in words.m]
        self._ended = self._ended or any(m in (2, 30) for m in stops)
        return [
            self.modal.row(M, self.modal.n, code=m, flags=STANDSTILL)
            for m in stops
        ]

    # profiles

    def _begin_profile(self, words: Words) -> None:
        offset = words.g[61]
        if (
            len(words.g) > 1
            or words.m
            or any(letter != "P" for letter in words.values)
        ):
            raise fail(909220, "G61 stands alone in its block", offset)
        if self._port.manual_data:
            raise fail(909219, ERRORS[909219], offset)
        degree = words.values.get("P", 5.0)
        if degree not in DEGREES:
            raise fail(
                909229,
                f"P{degree:g}: the degree is 3, 4 or 5",
                words.offsets["P"],
            )
        # that has been said
        if self._setup is None and self._no_setup and self._collect:
            self._skip_profile()
            return
        if self._setup is None:
            raise fail(
                909201,
                "G61 without a setup: (HSM,file) must come before it",
                offset,
            )
        if self._virtual:
            raise fail(
                909223, f"G61 while ({min(self._virtual)}) is active", offset
            )
        records, errors = self._setup.resolve(self._variables)
        errors += [] if errors else check(records, self._machine)
        if errors and self._spec_ok:
            self._report(errors)
        if errors:
            self._spec_ok = False
            self._skip_profile()
            return
        for letter, number, place in self._setup.variables():
            if not self._variables.known(letter, number):
                self._warn(
                    909102,
                    f"the setup reads {letter}{number}, which was never assigned: 0",
                    place,
                )
        self._enter(records, int(degree))

    def _skip_profile(self) -> None:
        """A profile whose setup or beginning is wrong cannot be read: go behind
        its G60, if it has one.
        """
        source = self._source
        before = source.position
        lines = source.hop(END_OR_BEGIN)
        if source.exhausted:
            source.seek(before)
            return
        self.modal.count_lines(lines)
        before = source.position
        if BEGIN.match(source.line() or ""):
            source.seek(before)
        else:
            self.modal.count_lines(1)

    def _enter(self, records: Records, degree: int) -> None:
        modal = self.modal
        active = Active(
            modal.position,
            self._active,
            modal.unit_mm,
            degree,
            modal.count,
            self.flow.file.number,
            self._variables.jerk_scale,
        )
        spec = build(records, self._machine, active)
        path = str(self.flow.file.path)
        context = Context(
            spec,
            self._variables,
            modal.unit_mm,
            modal.feed,
            modal.n,
            self._strict,
            self._warn_line,
            path,
        )
        self._saved = modal.saved()
        self._profile = PROFILES[spec.kind](context)
        self._text = BlockText("")

    def _warn_line(self, code: int, text: str) -> None:
        line = self.modal.line
        source = self._text.text if self._text else ""
        self._warn(
            code,
            text,
            Place(
                str(self.flow.file.path),
                max(line, 1),
                1,
                source,
            ),
        )

    def _profile_batch(self, rows: int) -> BlockBatch | Wait | None:
        profile = self._profile
        assert profile is not None
        while (
            profile.waiting < rows
            and not profile.ended
            and self._profile is profile
            and not self._queue
        ):
            self._profile_lines(profile, rows)
        if self._ended:
            self.flow.close()
        if self._queue:
            return super().read(rows)
        if self._profile is None:
            return BlockBatch.empty()
        chunk = profile.chunk()
        if profile.ended and not profile.waiting:
            self._leave(profile, chunk)
        return (
            BlockBatch.of_profile(chunk)
            if chunk is not None
            else BlockBatch.empty()
        )

    def _profile_lines(self, profile: Profile, rows: int) -> None:
        """Plain lines together, or one line of another kind."""
        source, modal = self._source, self.modal
        profile.context.line = modal.line
        if source.offset >= len(source.buffer) and not source.final:
            source.refill()
        taken = profile.take_lines(source, rows)
        if taken:
            modal.count_lines(taken)
            return
        text = source.line()
        if text is None:
            self._level_ended()
            return
        modal.count_lines(1)
        profile.context.line = modal.line
        self._text = BlockText(
            str(source.path), text, [PhysicalLine(0, modal.line, text)], 1
        )
        try:
            check_length(self._text)
            profile.line(text)
        except CncError as error:
            profile.go_on()
            self._error(error, self._text)

    def _leave(self, profile: Profile, chunk: ProfileChunk | None) -> None:
        """G60: the G functions that were active at G61 hold again."""
        modal, spec = self.modal, profile.spec
        self._profile = None
        position = spec.start.copy()
        if chunk is not None:
            position = self._final(chunk, position)
        modal.set_position(position)
        feed = profile.context.feed
        modal.restore(self._saved)
        modal.feed, modal.n = feed, profile.context.number
        rolling = any(axis.pitch for axis in spec.axes)
        # only the machine knows where its axes stand
        if spec.point != "AXI" or spec.tangential is not None or rolling:
            self._queue.append(Wait.DRAINED)
            self._awaited = True

    def _final(self, chunk: ProfileChunk, position: FloatArray) -> FloatArray:
        spec = chunk.spec
        last = (
            chunk.values[-1]
            if len(chunk.values)
            else plain.product(
                chunk.coef[-1],
                plain.powers(chunk.span[-1], np.arange(chunk.coef.shape[2])),
            )
        )
        for i, axis in enumerate(spec.axes):
            position[axis.channel] = last[i]
        return position
