"""Reading a profile, G61 .. G60: columns out of the text (specification 3, 7, 8)."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from cnc_core.blocks.profile_columns import (
    SMOOTH,
    VERSORS,
    ProfileChunk,
    ProfileSpec,
)
from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.source import Source
from cnc_core.frontend.osai import codes
from cnc_core.frontend.osai.columns import ColumnReader, Columns
from cnc_core.frontend.osai.variables import Variables
from cnc_core.frontend.osai.words import VALUE_MAX, Words, parse
from cnc_core.units import FloatArray

IntArray = npt.NDArray[np.int64]
VERSOR_LETTERS = "ijkmnopqd"
FUNCTION = re.compile(r"G\s*([0-9]{1,9})(?![0-9.])")
ALLOWED = (0, 1, 60, 61, 90, 91, *codes.TRANSITIONS)
Warn = Callable[[int, str], None]


@dataclass
class Context:
    """What a profile's reader shares with the front end around it.

    ``unit_mm``: per programmed unit.  ``feed``: F in force, per minute, 0 if
    none.  ``line``: physical lines read.
    """

    spec: ProfileSpec
    variables: Variables
    unit_mm: float
    feed: float
    number: int
    strict: bool
    warn: Warn
    path: str = ""
    line: int = 0


class Profile:
    """Common part of the three input formats.

    ``ended``: G60 has been read.  ``failed``: a line of it was wrong.
    """

    def __init__(self, context: Context) -> None:
        self.context, self.spec = context, context.spec
        self.ended = self.failed = False
        self.names = tuple(axis.name for axis in self.spec.axes)
        self.letters = "".join(self.names) + VERSOR_LETTERS
        self.columns = self.spec.columns
        self.factor = np.array(
            [a.factor for a in self.spec.axes]
            + [1.0] * (len(self.columns) - len(self.names))
        )
        self._ignored: set[str] = set()

    # what the front end calls

    def take_lines(self, source: Source, lines_max: int) -> int:
        """Plain lines read many at a time; 0: the next line goes to ``line``."""
        return 0

    def line(self, text: str) -> None:
        """One line, comments and all."""
        raise NotImplementedError

    def go_on(self) -> None:
        """A line was wrong: what only follows from that is no error of its own."""
        self.failed = True

    @property
    def waiting(self) -> int:
        """Points or polynomials that ``chunk`` would give out."""
        raise NotImplementedError

    def chunk(self) -> ProfileChunk | None:
        """What is final by now."""
        raise NotImplementedError

    # common words

    @property
    def feed_mm_s(self) -> float:
        return self.context.feed * self.context.unit_mm / 60.0

    def words(self, text: str, letters: str) -> Words:
        unset: list[str] = []
        try:
            words = parse(text, self.context.variables, letters, unset)
        except CncError:
            _refuse_codes(text)
            raise
        for name in unset:
            self._unset(name)
        if words.m:
            code = next(iter(words.m))
            raise fail(
                909224,
                f"M{code} cannot stand between G61 and G60",
                words.m[code],
            )
        if words.n is not None:
            self.context.number = words.n
        return words

    def read_variable(self, letter: str, number: int) -> float:
        """Its value; one that was never assigned is 0 and told."""
        variables = self.context.variables
        if not variables.known(letter, number):
            self._unset(f"{letter}{number}")
        return variables(letter, number)

    def _unset(self, name: str) -> None:
        self.context.warn(
            909102, f"variable {name} is read before it was written: 0"
        )

    def take_feed(self, words: Words) -> None:
        if "F" not in words.values:
            return
        if not words.values["F"] > 0:
            raise fail(900006, "F is not positive", words.offsets["F"])
        self.context.feed = words.values["F"]

    def need_feed(self, offset: int) -> None:
        if not self.context.feed > 0:
            raise fail(900006, ERRORS[900006], offset)

    def function(self, words: Words, allowed: tuple[int, ...]) -> int | None:
        """G60 or a transition, which stand alone in their block."""
        single = next(
            (code for code in words.g if code in (60, 61, *codes.TRANSITIONS)),
            None,
        )
        if single is not None and (len(words.g) > 1 or words.values):
            number = 909228 if single in codes.TRANSITIONS else 909220
            raise fail(
                number, f"G{single} stands alone in its block", words.g[single]
            )
        if single == 61:
            raise fail(909221, "G61 inside a profile", words.g[61])
        for code, offset in words.g.items():
            if code not in (*allowed, 60):
                raise fail(
                    909224, f"G{code} cannot stand between G61 and G60", offset
                )
        return single

    def plain_text(self, text: str) -> str:
        """The line without its comment; codes in brackets are refused."""
        plain = text.partition(";")[0]
        if plain.lstrip().startswith("("):
            raise fail(
                909224,
                "a three-letter code cannot stand between G61 and G60",
                plain.index("("),
            )
        if plain.lstrip().startswith("/"):
            raise fail(
                909224,
                "a block with / cannot stand between G61 and G60",
                plain.index("/"),
            )
        if plain.lstrip()[:1] in ("E", "L") and "=" in plain:
            raise fail(
                909224,
                "an assignment cannot stand between G61 and G60",
                plain.index(plain.lstrip()[0]),
            )
        return plain

    def ignore(self, words: Words) -> None:
        """Versor words that nothing uses; ijk of axis location points on five
        axes is an error.
        """
        spec = self.spec
        for group in ("ijk", "mno", "pqd"):
            found = [letter for letter in group if letter in words.values]
            if not found or group in spec.versors:
                continue
            if group == "ijk" and spec.point == "AXI" and spec.five_axes:
                raise fail(909252, ERRORS[909252], words.offsets[found[0]])
            if group not in self._ignored:
                self._ignored.add(group)
                self.context.warn(
                    909270, f"{group} is not used by this profile"
                )

    def versor_groups(self) -> list[tuple[str, slice]]:
        found = [
            (group, self.spec.versor_columns(group))
            for group in self.spec.versors
        ]
        return [
            (group, columns) for group, columns in found if columns is not None
        ]


@dataclass
class Gathered:
    """Finished lines of points, in pieces."""

    values: list[FloatArray] = field(default_factory=list)
    feed: list[FloatArray] = field(default_factory=list)
    rapid: list[npt.NDArray[np.bool_]] = field(default_factory=list)
    after: list[npt.NDArray[np.int64]] = field(default_factory=list)
    line: list[npt.NDArray[np.int64]] = field(default_factory=list)
    number: list[npt.NDArray[np.int64]] = field(default_factory=list)
    count: int = 0


class PointProfile(Profile):
    """Points: ``[N] [G0|G1] [G90|G91] words [F]`` and the transition codes."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.reader = ColumnReader(self.letters + "F")
        self._use = np.array(
            [self.letters.index(name) for name in self.columns]
        )
        self._absolute, self._rapid = True, False
        self._now = np.full(len(self.columns), np.nan)
        self._programmed = False
        self._kept = Gathered()

    # reading

    def take_lines(self, source: Source, lines_max: int) -> int:
        if (
            self._rapid
            or not self._absolute
            or not self._programmed
            or not self.context.feed > 0
        ):
            return 0
        begin = source.offset
        columns = self.reader.take(source, lines_max)
        if columns is None:
            return 0
        special = self._first_special(columns)
        if special is not None:  # the parser says what is wrong with that line
            source.offset = begin
            columns = self.reader.take(source, special) if special else None
        if columns is None:
            return 0
        self._plain(columns)
        self.context.line += len(columns)
        return len(columns)

    def _first_special(self, columns: Columns) -> int | None:
        """The first line that may be wrong, or that is to be warned of."""
        given = columns.values[:, :-1]
        feeds = columns.values[:, -1]
        # NaN, no word, is no such number
        large = np.abs(columns.values) > VALUE_MAX
        wrong = (feeds <= 0) | large.any(axis=1)
        for i, letter in enumerate(self.letters):
            group = next((g for g in VERSORS if letter in g), None)
            if (
                group is not None
                and i >= len(self.names)
                and group not in (*self.spec.versors, *self._ignored)
            ):
                wrong |= ~np.isnan(given[:, i])
        if self.spec.versors:
            values = self._values(given)
            for _, part in self.versor_groups():
                wrong |= ~(np.linalg.norm(values[:, part], axis=1) > 1e-9)
        return int(wrong.argmax()) if wrong.any() else None

    def _values(self, given: FloatArray) -> FloatArray:
        """(lines, columns) what is in force at each line."""
        values = np.vstack([self._now, given[:, self._use]])
        return np.stack(
            [_filled(values[:, i]) for i in range(values.shape[1])], axis=1
        )[1:]

    def _plain(self, columns: Columns) -> None:
        """Absolute G1 points."""
        given = columns.values[:, :-1]
        feeds = columns.values[:, -1]
        lines = self.context.line + 1 + np.arange(len(columns))
        points = np.flatnonzero(~np.isnan(given).all(axis=1))
        feeds = _filled(np.concatenate([[self.context.feed], feeds]))[1:]
        numbers = np.where(columns.number < 0, np.nan, columns.number)
        numbers = _filled(
            np.concatenate([[float(self.context.number)], numbers])
        )[1:]
        self.context.feed = float(feeds[-1])
        self.context.number = int(numbers[-1])
        if not len(points):
            return
        values = self._values(given)
        self._now = values[-1].copy()
        still = np.zeros(len(points), np.bool_)
        self._add(
            values[points],
            feeds[points],
            lines[points],
            numbers[points].astype(np.int64),
            still,
        )

    def line(self, text: str) -> None:
        plain = self.plain_text(text)
        if plain.lstrip().startswith("<"):
            raise fail(
                909224, "polynomials need the format POL", plain.index("<")
            )
        words = self.words(plain, self.letters + "F")
        code = self.function(words, (0, 1, 90, 91, *codes.TRANSITIONS))
        if code == 60:
            self._end(words.g[60])
        elif code is not None:
            self._transition(code, words.g[code])
        else:
            self._point(words)

    def _point(self, words: Words) -> None:
        for pair in ((0, 1), (90, 91)):
            if all(code in words.g for code in pair):
                raise fail(
                    900011,
                    f"G{pair[0]} and G{pair[1]} in one block",
                    words.g[pair[1]],
                )
        self.ignore(words)
        absolute = 90 in words.g or (self._absolute and 91 not in words.g)
        named = [letter for letter in words.values if letter != "F"]
        if named and not self._programmed:
            self._check_first(words, absolute)
        self._absolute = absolute
        self._rapid = 0 in words.g or (self._rapid and 1 not in words.g)
        self.take_feed(words)
        if not named:
            return
        for i, name in enumerate(self.columns):
            if name in words.values:
                relative = not self._absolute and i < len(self.names)
                self._now[i] = words.values[name] + (
                    self._now[i] if relative else 0.0
                )
        self._check_versors(words)
        if not self._rapid:
            self.need_feed(min(words.offsets.values()))
        self._programmed = True
        feed = self.context.feed
        self._add(
            self._now[None, :].copy(),
            np.array([feed]),
            *self._marks(),
            np.array([self._rapid]),
        )

    def _marks(self) -> tuple[IntArray, IntArray]:
        context = self.context
        return np.array([context.line]), np.array([context.number])

    def _check_first(self, words: Words, absolute: bool) -> None:
        offset = min(words.offsets.values())
        if not absolute:
            raise fail(
                909225,
                "the first point of a profile must be absolute",
                words.g.get(91, offset),
            )
        spec = self.spec
        for axis in spec.axes:
            computed = axis.kinematic and "ijk" in spec.versors
            if axis.name not in words.values:
                if not computed:
                    raise fail(
                        909225,
                        f"the first point of a profile must program axis {axis.name}",
                        offset,
                    )
                self._now[self.columns.index(axis.name)] = (
                    spec.start[axis.channel] / axis.factor
                )
        for group in spec.versors:
            missing = next(
                (letter for letter in group if letter not in words.values), None
            )
            if missing:
                raise fail(
                    909251,
                    f"the first point must program the versor {group}: {missing} is missing",
                    offset,
                )

    def _check_versors(self, words: Words) -> None:
        for group, columns in self.versor_groups():
            if not np.linalg.norm(self._now[columns]) > 1e-9:
                letter = next((x for x in group if x in words.offsets), "")
                raise fail(
                    909250,
                    f"the versor {group} has length zero",
                    words.offsets.get(letter, 0),
                )

    def _transition(self, code: int, offset: int) -> None:
        if not self._kept.count and self.failed:
            return
        if not self._kept.count:
            raise fail(909228, f"G{code} without a point before it", offset)
        if self._kept.rapid[-1][-1] and code in (62, 63, 67):
            raise fail(
                909228,
                f"G{code} behind a G00 point, which ends at standstill",
                offset,
            )
        before = int(self._kept.after[-1][-1])
        if before not in (SMOOTH, code):
            raise fail(
                909228,
                f"G{code} behind G{before}: a point has one transition",
                offset,
            )
        self._kept.after[-1][-1] = code

    def go_on(self) -> None:
        super().go_on()
        if not self._programmed:  # as if its first point had been complete
            start = [self.spec.start[a.channel] for a in self.spec.axes] + [
                1.0
            ] * 3 * len(self.spec.versors)
            self._now = np.where(
                np.isnan(self._now), np.array(start) / self.factor, self._now
            )
            self._programmed = True
        if not self.context.feed > 0:
            self.context.feed = 1.0

    def _end(self, offset: int) -> None:
        self.ended = True
        if not self._programmed and not self.failed:
            raise fail(909225, "the profile has no point", offset)

    # giving out

    def _add(
        self,
        values: FloatArray,
        feed: FloatArray,
        line: npt.NDArray[np.int64],
        number: npt.NDArray[np.int64],
        rapid: npt.NDArray[np.bool_],
    ) -> None:
        kept = self._kept
        kept.values.append(values * self.factor)
        kept.feed.append(np.asarray(feed) * self.context.unit_mm / 60.0)
        kept.line.append(line)
        kept.number.append(number)
        kept.rapid.append(rapid)
        kept.after.append(np.zeros(len(values), np.int64))
        kept.count += len(values)

    @property
    def waiting(self) -> int:
        return self._kept.count if self.ended else max(0, self._kept.count - 1)

    def chunk(self) -> ProfileChunk | None:
        """All points but the last, which a transition may follow; every one
        behind G60.
        """
        if not self.waiting:
            return None
        kept, keep = self._kept, 0 if self.ended else 1
        names = ("values", "feed", "rapid", "after", "line", "number")
        whole = {name: np.concatenate(getattr(kept, name)) for name in names}
        cut = kept.count - keep
        self._kept = (
            Gathered(
                **{name: [whole[name][cut:]] for name in names}, count=keep
            )
            if keep
            else Gathered()
        )
        out = {name: whole[name][:cut] for name in names}
        return ProfileChunk(self.spec, **out, last=self.ended)


def _refuse_codes(text: str) -> None:
    """CncError for a function that no profile has: its words are unknown only
    because of it.
    """
    for found in FUNCTION.finditer(text):
        if int(found[1]) not in ALLOWED:
            raise fail(
                909224,
                f"G{int(found[1])} cannot stand between G61 and G60",
                found.start(),
            )


def _filled(values: FloatArray) -> FloatArray:
    """NaN takes the value before it."""
    at = np.where(np.isnan(values), 0, np.arange(len(values)))
    return np.asarray(values[np.maximum.accumulate(at)])
