"""Real-time cycles of a channel: the one that is being defined, and which
there are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.port import (
    RT_CYCLES,
    RT_DELETED,
    RT_DEPTH,
    RT_HELD,
    RT_OPS,
    RT_RUNNING,
    RT_STARTED,
    ChannelPort,
    RtOp,
)

RETAINED = "isg real-time cycles"
PUTS, TAKES = (
    range(5),
    (5, 6, 8, 10, 14),
)  # instructions: one value more, or less


@dataclass
class Branch:
    """``$IF`` .. ``$ENDIF``.

    ``skip``: the jump over the present branch, if that has a condition.
    ``ends``: jumps from the ends of branches. ``alone``: it has a frequency and
    therefore one branch only. ``last``: $ELSE has been passed.
    """

    place: Place
    skip: int | None
    alone: bool
    ends: list[int] = field(default_factory=list)
    last: bool = False


@dataclass
class OpenCycle:
    """The cycle that is being defined.

    ``number``: its ID, None without one.  ``scope``: BLOCK, PROG or GLOBAL.
    """

    number: int | None
    scope: str
    starts: bool
    place: Place
    ops: list[Callable[[], RtOp]] = field(default_factory=list)
    targets: dict[int, int] = field(default_factory=dict)
    branches: list[Branch] = field(default_factory=list)

    def jump(self, code: int) -> int:
        """A jump whose target is not known yet."""
        at = len(self.ops)
        self.ops.append(lambda: RtOp(code, at=self.targets[at]))
        return at

    def lands(self, jump: int | None) -> None:
        """A jump goes here."""
        if jump is not None:
            self.targets[jump] = len(self.ops)


class RealTimeCycles:
    """``port``: where they go. ``place``: of an offset in the present block."""

    def __init__(
        self, port: ChannelPort, place: Callable[[int], Place]
    ) -> None:
        self._port, self._place = port, place
        self.opened: OpenCycle | None = None
        self.refused = False  # its first line, so that its end is no error
        self._slots: dict[int, int] = {}  # of this program, by ID
        self._unnamed = 0
        # slots of SCOPE = BLOCK, and which of them act on the next block
        self._of_block: set[int] = set()
        self._pending: set[int] = set()
        self._over = False  # that block has been executed

    @property
    def pending(self) -> bool:
        """A cycle acts on the next block alone."""
        return bool(self._pending)

    def block_over(self) -> None:
        """The next block begins when that block has been executed."""
        self._over = True

    def expire(self) -> None:
        """Ahead of a block: cycles of the block before are over."""
        if not self._over:
            return
        for slot in sorted(self._pending):
            self._port.rt_cycle(slot, RT_HELD, True, ())
        # without an ID nobody can start it again
        self._slots = {
            number: slot
            for number, slot in self._slots.items()
            if number >= 0 or slot not in self._pending
        }
        self._pending.clear()
        self._over = False

    def begin(
        self, number: int | None, *, scope: str, starts: bool, offset: int
    ) -> None:
        """``#RT CYCLE [DEF] [..]``."""
        if self.opened is not None:
            raise fail(22004, "#RT CYCLE inside a real-time cycle", offset)
        if number is None and (scope == "GLOBAL" or not starts):
            self.refused = True
            raise fail(22003, ERRORS[22003], offset)
        self.opened = OpenCycle(number, scope, starts, self._place(offset))

    def end(self, offset: int) -> None:
        """``#RT CYCLE END``: everything before it has been executed."""
        opened, self.opened = self.opened, None
        refused, self.refused = self.refused, False
        if opened is None and refused:
            return
        if opened is None:
            raise fail(907020, "#RT CYCLE END without its beginning", offset)
        if opened.branches:
            raise CncError(
                907021, "$IF is not closed", opened.branches[-1].place
            )
        ops = [make() for make in opened.ops]
        if len(ops) > RT_OPS or _depth(ops) > RT_DEPTH:
            raise fail(904010, ERRORS[904010], offset)
        slot = self._slot(opened, offset)
        state = RT_STARTED if opened.starts else RT_HELD
        self._port.rt_cycle(slot, state, opened.scope != "GLOBAL", ops)
        self._of_block.discard(slot)
        self._pending.discard(slot)
        if opened.scope == "BLOCK":
            self._of_block.add(slot)
            self._acts(slot, state)

    def manage(self, number: int, state: int, word: str, offset: int) -> None:
        """START, HOLD, CONTINUE, DELETE; only DELETE of none is right."""
        slots = next((s for s in self._all() if number in s), None)
        if slots is None:
            if state != RT_DELETED:
                raise fail(
                    907010,
                    f"#RT CYCLE {word}: no cycle has ID {number}",
                    offset,
                )
            return
        self._port.rt_cycle(slots[number], state, False, ())
        self._acts(slots[number], state)
        if state == RT_DELETED:
            del slots[number]

    def _acts(self, slot: int, state: int) -> None:
        if slot in self._of_block and state in (RT_STARTED, RT_RUNNING):
            self._pending.add(slot)
        else:
            self._pending.discard(slot)

    def at_end(self) -> CncError | None:
        """The error of a program that ends inside a definition."""
        opened, self.opened = self.opened, None
        if opened is None:
            return None
        return CncError(
            907021, "#RT CYCLE is not closed by #RT CYCLE END", opened.place
        )

    def _all(self) -> tuple[dict[int, int], dict[int, int]]:
        return self._slots, self._port.retained.setdefault(RETAINED, {})

    def _slot(self, opened: OpenCycle, offset: int) -> int:
        """The place in the engine; a cycle of the same ID is replaced."""
        mine, lasting = self._all()
        number = opened.number
        if number is None:
            self._unnamed -= 1
            number = self._unnamed
        old = mine.pop(number, None)
        old = lasting.pop(number, old)
        used = {*mine.values(), *lasting.values()}
        free = [s for s in range(RT_CYCLES) if s not in used]
        if not free:
            raise fail(904010, ERRORS[904010], offset)
        slot = free[0] if old is None else old
        (lasting if opened.scope == "GLOBAL" else mine)[number] = slot
        return slot


def _depth(ops: list[RtOp]) -> int:
    """How many values the instructions hold at most."""
    depth = most = 0
    for op in ops:
        depth += (op.code in PUTS) - (op.code in TAKES)
        most = max(most, depth)
    return most
