"""The C scanner and the modal state it shares with the parsers: the only door
of the front ends to the extension.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from cnc_core._engine import ffi, lib
from cnc_core.blocks import NC_AXES, NC_BLOCK
from cnc_core.blocks.to_c import row_pointer
from cnc_core.frontend.base.source import Source
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.units import AnyArray, FloatArray

MORE, FULL, OTHER, ERROR = (
    lib.NC_SCAN_MORE,
    lib.NC_SCAN_FULL,
    lib.NC_SCAN_OTHER,
    lib.NC_SCAN_ERROR,
)
AXIS_LETTERS = "XYZUVWQABC"
CENTRE_BITS = {"I": lib.NC_WORD_I, "J": lib.NC_WORD_J, "K": lib.NC_WORD_K}

RADIUS_ONCE, NO_PITCH, KEEP_CENTRE = (
    lib.NC_RULE_RADIUS_ONCE,
    lib.NC_RULE_NO_PITCH,
    lib.NC_RULE_KEEP_CENTRE,
)
NO_CORRECTION = lib.NC_RULE_NO_CORRECTION
NO_EQUALS, MESSAGES = lib.NC_RULE_NO_EQUALS, lib.NC_RULE_MESSAGES
PLANE_CENTRE, CENTRE_DISTANCE = (
    lib.NC_RULE_PLANE_CENTRE,
    lib.NC_RULE_CENTRE_DISTANCE,
)
NO_BRACKETS, NO_PLANES = lib.NC_RULE_NO_BRACKETS, lib.NC_RULE_NO_PLANES
FEED_POSITIVE = lib.NC_RULE_FEED_POSITIVE

MODAL_NAMES = (
    *("motion", "plane", "absolute", "centre_absolute", "exact_stop", "unit"),
    *("feed", "feed_unit", "radius", "has_radius"),
)
Row = AnyArray  # (1,) of NC_BLOCK


@dataclass
class MotionWords:
    """The words of one block that the shared geometry understands.

    None: not programmed.
    ``axis``: value by channel index.  ``centre``: value by I, J, K.
    ``offset``: of the first motion word in the text.
    """

    axis: dict[int, float] = field(default_factory=dict)
    centre: dict[str, float] = field(default_factory=dict)
    r: float | None = None
    f: float | None = None
    n: int = 0
    offset: int | None = None
    motion: int | None = None
    plane: int | None = None
    absolute: bool | None = None
    inch: bool | None = None
    centre_absolute: bool | None = None
    exact_stop: bool | None = None
    block_stop: bool = False

    @property
    def moves(self) -> bool:
        return bool(self.axis or self.centre)


class Scan(NamedTuple):
    """Rows written, and why the scanner stopped (MORE, FULL, OTHER, ERROR)."""

    rows: int
    stop: int


@dataclass(frozen=True)
class Rules:
    """A dialect's rules for plain lines and circles; the defaults are the ISG
    kernel's.

    ``bits``: the rules above, joined.
    An arc's end is wrong if its radius deviates by more than
    ``centre_limit_mm`` and by more than ``centre_ratio`` of the radius.
    """

    bits: int = 0
    centre_limit_mm: float = 2.0
    centre_ratio: float = 0.05


class Modal:
    """Owner of one ``nc_modal``."""

    def __init__(self, machine: ProgramMachine, rules: Rules = Rules()) -> None:
        if len(machine.axes) > NC_AXES:
            raise ValueError(f"{len(machine.axes)} axes, at most {NC_AXES}")
        self.machine = machine
        self._result = ffi.new("nc_scan_result *")
        self._words = ffi.new("nc_words *")
        self._modal = m = ffi.new("nc_modal *")
        lib.nc_modal_init(m)
        m.rules, m.centre_limit, m.centre_ratio = (
            rules.bits,
            rules.centre_limit_mm,
            rules.centre_ratio,
        )
        m.axes = len(machine.axes)
        for i in range(m.axes):
            m.rotary[i] = machine.rotary[i]
            m.pos[i] = float(machine.start[i])
        self.name_axes(machine.axes)
        for i, axis in enumerate(machine.main):
            m.main_axis[i] = axis

    def name_axes(self, names: Sequence[str]) -> None:
        """What the axes are called from here on; empty: it has no name."""
        for place in range(len(self._modal.letter_axis)):
            self._modal.letter_axis[place] = -1
        for i, name in enumerate(names):
            if len(name) == 1 and name.upper() in AXIS_LETTERS:
                self._modal.letter_axis[ord(name.upper()) - ord("A")] = i

    @property
    def line(self) -> int:
        """Physical lines read."""
        return int(self._modal.line)

    @property
    def count(self) -> int:
        """The decoder's block_count."""
        return int(self._modal.count)

    @property
    def n(self) -> int:
        """N number programmed last."""
        return int(self._modal.n)

    @n.setter
    def n(self, n: int) -> None:
        self._modal.n = n

    @property
    def programmed(self) -> int:
        """Plain lines read that held a word."""
        return int(self._modal.programmed)

    @property
    def position(self) -> FloatArray:
        """Programmed position of all channel axes, machine coordinates."""
        return np.array(
            list(self._modal.pos)[: self._modal.axes], dtype=np.float64
        )

    def set_position(self, position: FloatArray) -> None:
        """(axes,) where the axes stand, machine coordinates."""
        for i, value in enumerate(position):
            self._modal.pos[i] = float(value)

    def go_to(self, file: int, line: int, read: int = 0) -> None:
        """The next text stands behind ``line`` lines of ``file``.

        ``read``: lines that count as read on the way.
        """
        self._modal.file = file
        self._modal.line = line
        self._modal.count += read

    def count_lines(self, lines: int) -> None:
        """Physical lines that a parser has read."""
        self._modal.line += lines
        self._modal.count += lines

    def set_offset(self, offset: FloatArray) -> None:
        """(axes,) machine minus programmed coordinates, mm or degrees.

        The offset acts at once and moves nothing.
        """
        for i, value in enumerate(offset):
            self._modal.zero[i] = self._modal.offset[i] = float(value)
        lib.nc_modal_offsets(self._modal)

    def set_next_offset(self, offset: FloatArray) -> None:
        """As ``set_offset``, but acts on each axis from its next absolute word on."""
        for i, value in enumerate(offset):
            self._modal.zero[i] = float(value)
        lib.nc_modal_offsets(self._modal)

    def set_offset_of(self, axis: int) -> None:
        """The next offset of one axis acts at once."""
        self._modal.offset[axis] = self._modal.offset_next[axis]

    def set_mirror(self, mirror: FloatArray, share: FloatArray) -> None:
        """Sign and share of axis words, from the next word on, each (axes,).

        The sign is 1 or -1.  The share is the driven part of a word: 0.5 for
        diameters.
        """
        for i, (sign, part) in enumerate(zip(mirror, share, strict=True)):
            self._modal.mirror[i], self._modal.share[i] = (
                float(sign),
                float(part),
            )

    def set_arc_scale(self, scale: list[float]) -> None:
        """Factors of centre words and pitch of the main axes.  Circles are refused
        in planes of different ones.
        """
        self._modal.arc_scale = scale

    @property
    def offset_in_force(self) -> FloatArray:
        """(axes,) machine minus programmed coordinates as they are now, tool
        length included.
        """
        return np.array(
            list(self._modal.offset)[: self._modal.axes], dtype=np.float64
        )

    @property
    def offset_next(self) -> FloatArray:
        """(axes,) offsets of each axis from its next absolute word on.

        The tool length is included.
        """
        return np.array(
            list(self._modal.offset_next)[: self._modal.axes], dtype=np.float64
        )

    @property
    def centre_words(self) -> tuple[float, float, float]:
        """I, J, K as last programmed."""
        i, j, k = self._modal.centre_word
        return float(i), float(j), float(k)

    @property
    def radius_word(self) -> float:
        """R as last programmed."""
        return float(self._modal.radius / self._modal.unit)

    @property
    def feed(self) -> float:
        """F as programmed, per minute; 0: none yet."""
        return float(self._modal.feed)

    @feed.setter
    def feed(self, feed: float) -> None:
        self._modal.feed = feed

    @property
    def feed_unit(self) -> float:
        """mm per unit of length that F was programmed in."""
        return float(self._modal.feed_unit)

    def set_rule(self, bit: int, on: bool) -> None:
        """Switch one of the dialect's rules."""
        self._modal.rules = (
            self._modal.rules | bit if on else self._modal.rules & ~bit
        )

    def has_rule(self, bit: int) -> bool:
        """Whether one of the dialect's rules is on."""
        return bool(self._modal.rules & bit)

    def set_feed_factor(self, factor: float) -> None:
        """Programmed override of the feed, 1 for 100 %."""
        self._modal.feed_factor = factor

    def set_centre_limit(self, limit_mm: float) -> None:
        """Largest deviation of a programmed arc centre, mm."""
        self._modal.centre_limit = limit_mm

    def set_feed_limit(self, limit_mm_s: float) -> None:
        """Largest path feed of the rows that follow, mm/s; 0: none."""
        self._modal.feed_limit = limit_mm_s

    def saved(self) -> tuple[Any, ...]:
        """The modal functions and the words that a cycle gives back to its caller."""
        return tuple(getattr(self._modal, name) for name in MODAL_NAMES)

    def restore(self, saved: tuple[Any, ...]) -> None:
        """Restore the values of ``saved``."""
        for name, value in zip(MODAL_NAMES, saved, strict=True):
            setattr(self._modal, name, value)
        lib.nc_modal_offsets(self._modal)

    @property
    def offset(self) -> FloatArray:
        """(axes,) the offset of ``set_offset``."""
        return np.array(
            list(self._modal.zero)[: self._modal.axes], dtype=np.float64
        )

    @property
    def unit_mm(self) -> float:
        """mm per programmed unit of length."""
        return float(self._modal.unit)

    @property
    def absolute(self) -> bool:
        """Axis words are coordinates, not distances."""
        return bool(self._modal.absolute)

    def set_absolute(self, absolute: bool) -> None:
        """As G90 and G91 do."""
        self._modal.absolute = absolute

    @property
    def exact_stop(self) -> bool:
        """Every motion ends at standstill."""
        return bool(self._modal.exact_stop)

    @property
    def motion(self) -> int:
        """0..3, G00..G03."""
        return int(self._modal.motion)

    def forget_feed(self) -> None:
        """A feed has to be programmed again."""
        self._modal.feed = 0.0

    def set_tool_length(self, length_mm: float) -> None:
        """Acts on the third axis of the plane, from that axis's next absolute
        word on.
        """
        self._modal.tool_length = length_mm
        lib.nc_modal_offsets(self._modal)

    @property
    def plane(self) -> int:
        """17, 18, 19."""
        return int(self._modal.plane)

    @property
    def compensated(self) -> bool:
        """Tool radius compensation is selected."""
        return bool(self._modal.compensated)

    def set_compensated(self, active: bool) -> None:
        """While it is selected a change of the plane is an error."""
        self._modal.compensated = active

    def assume_feed(self) -> None:
        """Go on as if a feed had been programmed."""
        self._modal.feed = 1.0

    def scan(self, source: Source, out: AnyArray) -> Scan:
        """Read plain lines into ``out`` until something else stands there."""
        text = ffi.from_buffer(source.buffer)
        rows = row_pointer(out, writable=True)
        size = len(source.buffer) - source.offset
        lib.nc_scan(
            self._modal,
            text + source.offset,
            size,
            source.final,
            rows,
            len(out),
            self._result,
        )
        source.offset += self._result.consumed
        return Scan(self._result.rows, self._result.stop)

    def apply(self, words: MotionWords) -> tuple[int, Row | None]:
        """Update the state with one block's words: error number or 0, and the
        motion's row if it moves.
        """
        row = np.zeros(1, NC_BLOCK)
        emitted = ffi.new("int *")
        target = row_pointer(row, writable=True)
        error = int(
            lib.nc_block_from_words(
                self._modal, _fill_in(self._words, words), target, emitted
            )
        )
        return error, row if emitted[0] else None

    def row(
        self,
        kind: int,
        n: int,
        code: int = 0,
        value: float = 0.0,
        flags: int = 0,
    ) -> Row:
        """A row that is not a motion, of the line being read."""
        row = np.zeros(1, NC_BLOCK)
        row["type"], row["n"] = kind, n
        row["code"], row["value"], row["flags"] = code, value, flags
        row["line"], row["count"] = self.line, self.count
        row["file"] = self._modal.file
        return row


def _fill_in(w: Any, words: MotionWords) -> Any:
    """``w``: nc_words of C."""
    lib.nc_words_init(w)
    for axis, value in words.axis.items():
        w.axis[axis] = value
        w.axis_set |= 1 << axis
    for letter, value in words.centre.items():
        w.centre["IJK".index(letter)] = value
        w.set |= CENTRE_BITS[letter]
    if words.r is not None:
        w.r, w.set = words.r, w.set | lib.NC_WORD_R
    if words.f is not None:
        w.f, w.set = words.f, w.set | lib.NC_WORD_F
    w.n, w.block_stop = words.n, words.block_stop
    for name in (
        "motion",
        "plane",
        "absolute",
        "inch",
        "centre_absolute",
        "exact_stop",
    ):
        code = getattr(words, name)
        if code is not None:
            setattr(w, name, code)
    return w
