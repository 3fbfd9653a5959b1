"""Programs that go round for ever: the same place reached again with everything
as it was, or too often to be checked.

Brent's way: the state at the 1st, 2nd, 4th, 8th .. jump back is kept, every
later jump is compared with it.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from cnc_core._engine import ffi
from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.flow import Mark
from cnc_core.frontend.base.lexer import fail

from .program import Program

FIRST_KEPT = 2
# jumps back of GOTO that ``check`` follows, blocks if they are many
PASSES_CHECKED, BLOCKS_CHECKED = 10_000, 40_000
MANY = 1000
DEPTH = 4
PACKAGE = "cnc_core.frontend.isons"


def told(value: Any, depth: int = DEPTH) -> Any:
    """What can be compared of a value of the dialect's own state."""
    if isinstance(value, np.ndarray):
        return None if value.dtype.names else value.tobytes()
    if isinstance(value, dict):
        return tuple(
            (key, told(item, depth - 1)) for key, item in value.items()
        )
    if isinstance(value, (list, tuple)):
        return tuple(told(item, depth - 1) for item in value)
    if isinstance(value, (set, frozenset)):
        return frozenset(value)
    if dataclasses.is_dataclass(value) or (
        depth > 0 and type(value).__module__.startswith(PACKAGE)
    ):
        return (
            tuple(
                (key, told(item, depth - 1))
                for key, item in vars(value).items()
            )
            if depth > 0
            else None
        )
    return value if isinstance(value, (int, float, str, bytes, bool)) else None


class Endless:
    """Watches the jumps back of one program.

    ``came_back`` tells whether nothing has changed since an earlier one.
    """

    def __init__(self, program: Program) -> None:
        self._program = program
        self._jumps, self._keep_at = 0, FIRST_KEPT
        self._near: tuple[Any, ...] = ()
        self._words = b""
        self._far: tuple[Any, ...] = ()
        self.rows = self.motions = 0  # put out so far
        self._kept = (0, 0, 0)

    @property
    def moved(self) -> bool:
        """Axes have moved since the state that was met again."""
        return self.motions > self._kept[1]

    @property
    def passes(self) -> int:
        return self._jumps

    def tired(self, blocks: int) -> bool:
        """A check has seen enough; ``blocks`` have been executed."""
        return self._jumps > PASSES_CHECKED or (
            self._jumps > MANY and blocks > BLOCKS_CHECKED
        )

    def came_back(self) -> bool:
        self._jumps += 1
        program = self._program
        if self._jumps == self._keep_at:
            self._keep_at *= 2
            self._near = self._state()
            self._words, self._far = self._modal(), self._rest()
            self._kept = (self.rows, self.motions, program.waits_passed)
            return False
        live = program.answers and (
            self.rows > self._kept[0] or program.waits_passed > self._kept[2]
        )
        if not self._near or live or program.asks or not program.system.rests:
            return False
        return (
            self._state() == self._near
            and self._modal() == self._words
            and self._rest() == self._far
        )

    def jumped_back(self, offset: int, jump: bool) -> bool:
        """The program goes back: False if it does not get anywhere so."""
        program = self._program
        program.forms.poll(offset)
        if not jump:
            return True
        checked = program.collecting
        again, most = self.came_back(), program.channel.cell.passes_max
        many = (
            bool(most)
            and self.passes >= most
            and program.place_found
            and not program.answers
        )
        if (
            not again
            and not many
            and not (checked and self.tired(program.steps))
        ):
            return True
        what = (
            "comes back with everything as it was"
            if again
            else f"has come back {self.passes} times"
        )
        what += (
            " (isons.passes_max of the cell file)"
            if many and not checked
            else ""
        )
        if not (checked and self.moved):
            raise self._does_not_end(
                fail(907001, f"the program does not end: it {what}", offset)
            )
        program.warn(909173, f"{ERRORS[909173]}: it {what}", offset)
        self._leave_out()
        return False

    def _does_not_end(self, error: CncError) -> CncError:
        program = self._program
        if program.collecting:
            self._leave_out()
        return error

    def _leave_out(self) -> None:
        """The rest of the file is compiled, the program ends."""
        program = self._program
        source = program.flow.file.source
        program.visit(
            Mark(source.position, program.modal.line),
            Mark(program.flow.file.path.stat().st_size, 0),
        )
        program.end_program()

    def _state(self) -> tuple[Any, ...]:
        """Place, open loops, variables."""
        program = self._program
        levels = tuple(
            (
                level.file.number,
                tuple((loop.position, loop.left) for loop in level.nest),
            )
            for level in program.flow.levels
        )
        store = program.store
        scopes = [
            (
                dict(s.values),
                {k: list(v) for k, v in s.arrays.items()},
            )
            for s in (store.scope, store.common)
        ]
        return program.modal.line, levels, scopes, list(store.list)

    def _modal(self) -> bytes:
        """Modal state, position included: most loops change it."""
        copy = ffi.new("nc_modal *", self._program.modal._modal[0])
        copy.line = copy.count = copy.n = copy.programmed = 0
        return bytes(ffi.buffer(copy))

    def _rest(self) -> tuple[Any, ...]:
        """Frames, modes, what was written."""
        program, channel = self._program, self._program.channel
        shared = program.system.shared
        written = {} if program.port.answers else dict(shared.written)
        parts = (
            channel.frame,
            channel.transform,
            channel.output,
            channel.modes,
            channel.rotary_modes,
        )
        more = (
            channel.tables,
            channel.tool,
            channel.diameter,
            channel.spindle,
            program.parameters,
            program.system.state,
        )
        return (
            written,
            *(told(part) for part in (*parts, *more)),
        )
