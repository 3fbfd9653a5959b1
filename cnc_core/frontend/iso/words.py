"""Words of one line: tokens to values.  Nothing is executed here."""

from __future__ import annotations

from dataclasses import dataclass, field

from cnc_core.frontend.base.expression import round_half_away
from cnc_core.frontend.base.lexer import NO_AXIS, Kind, TokenStream, fail
from cnc_core.frontend.iso import codes
from cnc_core.frontend.iso.expressions import Expressions
from cnc_core.frontend.iso.parameters import Key, Parameters

M_MAX = 65535
NUMBER_MAX = 2**31 - 1
WHOLE = {"D": NUMBER_MAX, "H": NUMBER_MAX, "L": NUMBER_MAX, "T": NUMBER_MAX}
REFUSED = {
    "O": "O word (subprogram, flow control, second program number)",
    "E": "word E",
    "@": "polar coordinate @",
}
REFUSED |= {
    "^": "polar coordinate ^",
    "*": "checksum *",
    "/": "block delete behind the first word",
    "%": "% in a line",
}


@dataclass
class Words:
    """Everything one line says.

    ``g``, ``m``: offset by code, G in tenths.  ``values``: value by letter.
    """

    n: int = 0
    g: dict[int, int] = field(default_factory=dict)
    m: dict[int, int] = field(default_factory=dict)
    values: dict[str, float] = field(default_factory=dict)
    offsets: dict[str, int] = field(default_factory=dict)
    assignments: list[tuple[Key, float]] = field(default_factory=list)

    def one_of(self, group: tuple[int, ...]) -> int | None:
        """The G function of a group that stands in the line."""
        return next((code for code in group if code in self.g), None)

    @property
    def axes(self) -> dict[str, float]:
        return {
            letter: value
            for letter, value in self.values.items()
            if letter in codes.AXIS_LETTERS
        }

    @property
    def centre(self) -> dict[str, float]:
        return {
            letter: value
            for letter, value in self.values.items()
            if letter in "IJK"
        }

    def first(self, letters: str) -> int:
        """Offset of the first of these words, 0 if there is none."""
        return min(
            (
                self.offsets[letter]
                for letter in letters
                if letter in self.offsets
            ),
            default=0,
        )


class WordParser:
    """Reads the words of one line from a token stream."""

    def __init__(
        self, stream: TokenStream, axes: dict[str, int], parameters: Parameters
    ) -> None:
        self.words = Words()
        self._stream = stream
        self._axes = axes
        self._parameters = parameters
        self._expressions = Expressions(stream, parameters)

    def parse(self) -> Words:
        while not self._stream.at_end:
            self._word()
        return self.words

    def _word(self) -> None:
        token = self._stream.current
        if self._stream.is_op("#"):
            self._assignment()
            return
        letter = token.text[:1].upper()
        if letter in REFUSED:
            raise fail(
                900003, f"{REFUSED[letter]} is not supported", token.offset
            )
        if token.kind is not Kind.NAME:
            raise fail(900001, f"unknown word {token.text}", token.offset)
        self._stream.take_letters(1)
        if letter in "GMN":
            {"G": self._g, "M": self._m, "N": self._n}[letter](token.offset)
        elif letter in codes.AXIS_LETTERS or letter in codes.VALUE_LETTERS:
            self._value(letter, token.offset)
        else:
            raise fail(900001, f"unknown word {letter}", token.offset)

    def _assignment(self) -> None:
        offset = self._stream.current.offset
        key = self._expressions.key()
        self._stream.expect("=", 900004)
        self._parameters.check_assignable(key, offset)
        self.words.assignments.append(
            (key, self._expressions.value("parameter"))
        )

    def _whole(
        self, letter: str, value: float, highest: int, offset: int
    ) -> int:
        if (
            abs(value - round_half_away(value)) > 1e-4
            or not 0 <= round_half_away(value) <= highest
        ):
            raise fail(
                900012,
                f"{letter}{value:g}: a whole number 0..{highest} is expected",
                offset,
            )
        return round_half_away(value)

    def _once(self, letter: str, offset: int) -> None:
        if letter in self.words.offsets:
            raise fail(900005, f"{letter} twice in one block", offset)
        self.words.offsets[letter] = offset

    def _n(self, offset: int) -> None:
        self._once("N", offset)
        self.words.n = self._whole(
            "N", self._expressions.value("N"), 2**32 - 1, offset
        )

    def _value(self, letter: str, offset: int) -> None:
        if letter in codes.AXIS_LETTERS and letter not in self._axes:
            raise fail(
                900001,
                f"unknown word {letter}: {letter}{NO_AXIS}",
                offset,
            )
        self._once(letter, offset)
        value = self._expressions.value(letter)
        if letter in WHOLE:
            value = self._whole(letter, value, WHOLE[letter], offset)
        if letter in "PQS" and value < 0:
            raise fail(900012, f"{letter}{value:g} is negative", offset)
        self.words.values[letter] = value

    def _g(self, offset: int) -> None:
        tenths = self._expressions.value("G") * 10.0
        code = round_half_away(tenths)
        if abs(tenths - code) > 1e-3 or not 0 <= code < 10000:
            raise fail(20131, f"unknown G function G{tenths / 10:g}", offset)
        if code not in codes.KNOWN:
            raise fail(20131, f"unknown G function {codes.name(code)}", offset)
        if code not in codes.SUPPORTED:
            raise fail(900003, f"{codes.name(code)} is not supported", offset)
        group = codes.GROUP_OF[code]
        other = next(
            (g for g in self.words.g if codes.GROUP_OF[g] == group), None
        )
        if other is not None:
            raise fail(
                900011,
                f"{codes.name(code)} and {codes.name(other)}, both of the group {group}",
                offset,
            )
        self.words.g[code] = offset

    def _m(self, offset: int) -> None:
        code = self._whole("M", self._expressions.value("M"), M_MAX, offset)
        group = codes.M_GROUP_OF.get(code, f"M{code}")
        other = next(
            (
                m
                for m in self.words.m
                if codes.M_GROUP_OF.get(m, f"M{m}") == group
            ),
            None,
        )
        if other is not None:
            raise fail(
                900011,
                f"M{code} and M{other}, both of the group {group}",
                offset,
            )
        self.words.m[code] = offset
