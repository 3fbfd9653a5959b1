"""Words of one block, compiled: what is programmed, with values that are
computed when the block is executed.
"""

from __future__ import annotations

from cnc_core.errors import CncError
from cnc_core.frontend.base.lexer import Kind, TokenStream, digits, fail

from ..base import codes
from ..base.text import AXIS_LETTERS
from ..base.words import Number, WordBlock
from .formulas import Formulas

M_MAX = 65535
N_MAX = 2**32 - 1
VALUES = ("USER_ZERO", "USER_OFFSET", "PAUSE_MODE")
INDEXED = (49, 54, 106)  # G54 [n], G106 [axis], G49 0
SINGLE_LETTERS = "FSDIJKRTHPL"


class WordParser:
    """Reads the words of one block."""

    def __init__(
        self, stream: TokenStream, formulas: Formulas, axes: dict[str, int]
    ) -> None:
        self._stream, self._formulas, self._axes = stream, formulas, axes
        self.block = WordBlock()

    def n_number(self) -> None:
        """``N10`` at the beginning."""
        stream = self._stream
        token = stream.current
        if (
            token.kind is not Kind.NAME
            or token.text[0] not in "nN"
            or len(token.text) > 1
        ):
            return
        if stream.following.kind is not Kind.NUMBER:
            return
        stream.next()
        number = stream.next()
        if not digits(number.text) or int(number.text) > N_MAX:
            raise fail(
                900012,
                f"N{number.text}: a whole number 0..{N_MAX} is expected",
                number.offset,
            )
        self.block.n = int(number.text)

    def parse(self) -> WordBlock:
        while not self._stream.at_end:
            self._word()
        return self.block

    def _word(self) -> None:
        stream, token = self._stream, self._stream.current
        if token.kind is Kind.VARIABLE:
            self._assignment()
            return
        if token.kind is not Kind.NAME:
            raise _unknown(token.text, token.offset)
        name = token.text.upper()
        if name in VALUES:
            stream.next()
            stream.accept("=")
            self._put(name, self._formulas.argument(name), token.offset)
        elif name.startswith("HM"):
            self._macro_call(token.offset)
        elif name[0] == "G":
            stream.take_letters(1)
            self._g(token.offset)
        elif name[0] == "M":
            stream.take_letters(1)
            self._m(token.offset)
        else:
            self._value_word(name, token.offset)

    def _assignment(self) -> None:
        """``$VAR=expr``."""
        target = self._formulas.target()
        self._stream.expect("=", 900004)
        if not self.block.empty:
            raise fail(
                909111,
                "an assignment stands in front of the words of its block",
                self._stream.current.offset,
            )
        self.block.assignments.append(
            (target, self._formulas.full("assignment"))
        )

    def _value_word(self, name: str, offset: int) -> None:
        for prefix in ("DO", "D", "O", ""):
            letter = name[len(prefix) : len(prefix) + 1]
            if name.startswith(prefix) and letter and letter in AXIS_LETTERS:
                self._stream.take_letters(len(prefix) + 1)
                self._axis_word(prefix, letter, offset)
                return
        if (
            name[:2] == "DP"
            and self._stream.following.text == "["
            and len(name) == 2
        ):
            self._stream.next()
            self._positioner("DP", offset)
            return
        letter = name[0]
        if letter not in SINGLE_LETTERS or len(name) > 1:
            raise _unknown(name, offset)
        self._stream.take_letters(1)
        if letter == "P" and self._stream.is_op("["):
            self._positioner("P", offset)
        elif letter in "TH":
            self._put(letter, self._formulas.argument(letter), offset)
        else:
            self._put(letter, self._formulas.value(letter), offset)

    def _positioner(self, name: str, offset: int) -> None:
        """``P[n]v``, ``DP[n]v`` of G93; ``P[expr]`` alone is the ratio of G1051."""
        number, _ = self._formulas.pair()
        stream = self._stream
        if stream.current.kind is Kind.NUMBER or stream.is_op("-", "+", "["):
            self.block.indexed[name] = (
                number,
                self._formulas.value(name),
                offset,
            )
            self.block.offsets.setdefault(name, offset)
        else:
            self._put(name, number, offset)

    def _axis_word(self, prefix: str, letter: str, offset: int) -> None:
        stream = self._stream
        after = stream.current
        valued = after.kind in (Kind.NUMBER, Kind.VARIABLE) or stream.is_op("[")
        signed = stream.is_op("+", "-")
        if signed and not (
            stream.following.kind is Kind.NUMBER or stream.following.text == "["
        ):
            if prefix:
                raise fail(900004, f"{prefix}{letter} without a value", offset)
            self.block.signs[letter] = (
                1.0 if stream.next().text == "+" else -1.0
            )
            self.block.offsets.setdefault(letter, offset)
            return
        if not valued and not signed:
            if prefix:
                raise fail(900004, f"{prefix}{letter} without a value", offset)
            if letter in self.block.named:
                raise fail(900005, f"{letter} twice in one block", offset)
            self.block.named[letter] = offset
            return
        self._put(
            prefix + letter, self._formulas.value(prefix + letter), offset
        )

    def _put(self, name: str, value: Number, offset: int) -> None:
        if name in self.block.values:
            raise fail(900005, f"{name} twice in one block", offset)
        self.block.values[name] = value
        self.block.offsets[name] = offset

    def _whole(self, letter: str, offset: int, highest: int) -> int:
        token = self._stream.current
        if token.kind is not Kind.NUMBER:
            raise fail(
                900004,
                f"{letter}: a number is expected, found {self._stream.describe()}",
                offset,
            )
        self._stream.next()
        if not digits(token.text) or int(token.text) > highest:
            raise fail(
                909105,
                f"{letter}{token.text}: a whole number 0..{highest} is expected",
                token.offset,
            )
        return int(token.text)

    def _g(self, offset: int) -> None:
        code = self._whole("G", offset, 9999)
        if code not in codes.KNOWN:
            raise fail(20131, f"unknown G function G{code}", offset)
        group = codes.GROUP_OF.get(code, (code,))
        other = next(
            (
                c
                for c, _, _ in self.block.g
                if codes.GROUP_OF.get(c, (c,)) == group
            ),
            None,
        )
        if other is not None:
            raise fail(
                900011, f"G{code} and G{other}, both of one group", offset
            )
        taker = next(
            (c for c, _, _ in self.block.g if c in codes.TAKERS),
            None,
        )
        if code in codes.TAKERS and taker is not None:
            raise fail(
                908005, f"G{code} and G{taker} use the same words", offset
            )
        index = None
        if code in INDEXED and (
            self._stream.is_op("[")
            or (code == 49 and self._stream.current.kind is Kind.NUMBER)
        ):
            index = self._formulas.value(f"G{code}")
        self.block.g.append((code, offset, index))

    def _m(self, offset: int) -> None:
        number = self._whole("M", offset, M_MAX)
        behind = any(
            name.lstrip("DO") in AXIS_LETTERS for name in self.block.values
        )
        self.block.m.append((number, offset, behind))

    def _macro_call(self, offset: int) -> None:
        """``HM10 10 20 [$A] $B+1``: arguments, parted by blanks, up to the end
        of the block.
        """
        stream = self._stream
        stream.take_letters(2)
        number, arguments = self._whole("HM", offset, M_MAX), []
        while not stream.at_end:
            if not stream.accept(","):
                arguments.append(self._formulas.joined("HM"))
        self.block.hm = (number, offset, arguments)


def _unknown(text: str, offset: int) -> CncError:
    why = ""
    if text[0].isdigit() or text[0] == ".":
        why = ": no letter stands in front of the number"
    elif len(text) == 1 and text.isalpha():
        why = ": no function has this letter"
    return fail(900001, f"unknown word {text}{why}", offset)
