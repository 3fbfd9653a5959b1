"""Programs that go round for ever: the same place reached again with everything
as it was, or too often to be checked.

Brent's way: the state at the 1st, 2nd, 4th, 8th .. jump back is kept, every
later jump is compared with it.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from cnc_core._engine import ffi
from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.flow import Mark
from cnc_core.frontend.base.lexer import fail

if TYPE_CHECKING:
    from ..front_end import IsonsFrontEnd

FIRST_KEPT = 2
# jumps back of GOTO that ``check`` follows, blocks if they are many
PASSES_CHECKED, BLOCKS_CHECKED = 20_000, 200_000
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

    def __init__(self, reader: IsonsFrontEnd) -> None:
        self._reader = reader
        self._jumps, self._keep_at = 0, FIRST_KEPT
        self._near: tuple[Any, ...] = ()
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
        reader = self._reader
        if self._jumps == self._keep_at:
            self._keep_at *= 2
            self._near, self._far = self._state(), self._rest()
            self._kept = (self.rows, self.motions, reader.waits_passed)
            return False
        live = reader.answers and (
            self.rows > self._kept[0] or reader.waits_passed > self._kept[2]
        )
        if not self._near or live or reader.asks or not reader.system.rests:
            return False
        return self._state() == self._near and self._rest() == self._far

    def jumped_back(self, offset: int, jump: bool) -> bool:
        """The program goes back: False if it does not get anywhere so."""
        reader = self._reader
        reader.forms.poll(offset)
        if not jump:
            return True
        checked = reader._collect
        again, most = self.came_back(), reader.executor.cell.passes_max
        many = (
            bool(most)
            and self.passes >= most
            and reader.search.found
            and not reader.answers
        )
        if (
            not again
            and not many
            and not (checked and self.tired(reader.steps))
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
        reader.warn(909173, f"{ERRORS[909173]}: it {what}", offset)
        self._leave_out()
        return False

    def _does_not_end(self, error: CncError) -> CncError:
        reader = self._reader
        if reader._collect:
            self._leave_out()
        return error

    def _leave_out(self) -> None:
        """The rest of the file is compiled, the program ends."""
        reader = self._reader
        source = reader.flow.file.source
        reader._visit(
            Mark(source.position, reader.modal.line),
            Mark(reader.flow.file.path.stat().st_size, 0),
        )
        reader._finish()

    def _state(self) -> tuple[Any, ...]:
        """Place, open loops, variables."""
        reader = self._reader
        levels = tuple(
            (
                level.file.number,
                tuple((loop.position, loop.left) for loop in level.nest),
            )
            for level in reader.flow.levels
        )
        store = reader.store
        scopes = [
            (dict(s.values), {k: list(v) for k, v in s.arrays.items()})
            for s in (store.scope, store.common)
        ]
        return reader.modal.line, levels, scopes, list(store.list)

    def _rest(self) -> tuple[Any, ...]:
        """Modal state, frames, modes, what was written."""
        reader, executor = self._reader, self._reader.executor
        modal = reader.modal._modal
        copy = ffi.new("nc_modal *", modal[0])
        copy.line = copy.count = copy.n = copy.programmed = 0
        port = reader.port
        external = port.written_externals() if not port.answers else {}
        parts = (
            executor.frame,
            executor.transform,
            executor.output,
            executor.modes,
            executor.rotary_modes,
        )
        more = (
            executor.tables,
            executor.tool,
            executor.diameter,
            executor.spindle,
            reader.parameters,
            reader.system.state,
        )
        return (
            bytes(ffi.buffer(copy)),
            external,
            *(told(part) for part in (*parts, *more)),
        )
