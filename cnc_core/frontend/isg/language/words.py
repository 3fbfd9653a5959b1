"""DIN words of one block, compiled: parsed once, evaluated each time the block
is executed.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

from cnc_core.blocks import motion_planes
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.expression import round_half_away
from cnc_core.frontend.base.formula import Constant, number_of
from cnc_core.frontend.base.lexer import (
    NO_AXIS,
    Kind,
    TokenStream,
    digits,
    fail,
)

from ..state.state import ProgramState
from . import gcodes
from .calls import CallParser
from .formulas import Formulas
from .word_block import Function, Step, WordBlock, Words

FUNCTION_MAX = 65535
NUMBER_MAX = 2**31 - 1
N_MAX = 2**32 - 1
# M functions that carry no value
WITHOUT_VALUE = frozenset({*range(6), 17, 19, 29, 30, *range(40, 46)})
AXIS_BRACKETS = frozenset(
    {
        "OSC",
        "COMP",
        "DIST_CTRL",
        "OVERRIDE",
        "DYNAMIC",
        "LIFT",
        "SYNC",
        "POLY",
        "INDP",
        "INDP_SYN",
        "INDP_ASYN",
        "M",
    }
)
CYCLE_WORDS = tuple("XYZIJKS")
CALL = re.compile(r"[lL]{1,2}(?=[\s\"]|[vV]\.)|[lL]+(?=[0-9])")
AXES = tuple("ABCUVWXYZ")
LONG_NAME = re.compile(r"\s*=(?!=)")


class WordParser:
    """Compiles the words of one block from a token stream."""

    def __init__(
        self,
        stream: TokenStream,
        axes: dict[str, int],
        formulas: Formulas,
        state: ProgramState,
    ) -> None:
        self.block = WordBlock()
        self._stream = stream
        self._axes = (
            axes  # name in capitals -> channel index, longest name first
        )
        self._formulas = formulas
        self._state = state
        self._letter = ""
        self._letters: dict[str, Callable[[int], None]] = {
            "N": self._n,
            "G": self._g,
            "M": self._function,
            "H": self._function,
            "F": self._f,
            "E": self._e,
            "S": self._s,
            "T": self._t,
            "D": self._d,
            "R": self._r,
            "I": self._centre,
            "J": self._centre,
            "K": self._centre,
        }

    def word(self) -> None:
        """One word or assignment, whatever it is."""
        token = self._stream.current
        if token.kind is Kind.NAME:
            self._named(token.offset, token.text)
        elif (
            token.text == "@"
            and self._stream.following.text[:1].upper() in CYCLE_WORDS
        ):
            self._cycle_word(self._stream.next().offset)
        elif self._formulas.is_variable():
            self._assignment()
        else:
            raise self._refused_sign()

    def _cycle_word(self, offset: int) -> None:
        """Words of cycles, in the plane in force.

        ``@X @Y @Z`` axes, ``@I @J @K`` centre words, ``@S``.
        """
        letter = self._stream.take_letters(1).text
        self.block.words = True
        if letter == "S":
            self._letters["S"](offset)
            return
        name, place = f"@{letter}", "XYZIJK".index(letter)
        self._once(name, offset)
        self._motion_word(offset)
        value, state = self._value(name, offset), self._state

        def step(words: Words) -> None:
            state.store.needs_cycle(name, offset)
            main = motion_planes(words.motion.plane or state.modal.plane)[
                place % 3
            ]
            if place > 2:
                words.motion.centre["IJK"[main]] = value()
                return
            axis = state.machine.main[main]
            if axis < 0:
                raise fail(900016, f"{name}: {ERRORS[900016]}", offset)
            words.motion.axis[axis] = value()

        self._step(step, simple=True)

    def _named(self, offset: int, text: str) -> None:
        stream = self._stream
        if self._formulas.is_variable():
            self._assignment()
            return
        self.block.words = True
        if self._long_axis():
            return
        call = CALL.match(stream.text, offset)
        if call:
            self._call(offset, call[0].upper())
            return
        if text.upper().startswith("MC_"):
            raise fail(900003, f"{text.upper()} is not supported", offset)
        letter = self._letter = text[0].upper()
        if letter in self._axes:
            stream.take_letters(1)
            self._axis(letter, offset)
        elif letter in self._letters:
            stream.take_letters(1)
            self._letters[letter](offset)
        else:
            why = f": {letter}{NO_AXIS}" if text.upper() in AXES else ""
            raise fail(900001, f"unknown word {text}{why}", offset)

    def n_number(self) -> bool:
        """The N word in front of a block, if there is one."""
        token = self._stream.current
        if token.kind is not Kind.NAME or token.text[0] not in "nN":
            return False
        self._stream.take_letters(1)
        self._n(token.offset)
        return True

    # refusals

    def _refused_sign(self) -> Exception:
        token = self._stream.current
        if token.kind is Kind.STRING:
            return fail(
                900001, f"macro {token.text} is not defined", token.offset
            )
        if token.text == "/":
            return fail(
                900001,
                "/ stands at the beginning of a block only",
                token.offset,
            )
        return fail(900001, f"unknown word {token.text}", token.offset)

    # values

    def _value(
        self, name: str, offset: int, assign: bool = True
    ) -> Callable[[], float]:
        """``=`` if allowed, and an expression."""
        if assign:
            self._stream.accept("=")
        if not self._formulas.starts_here():
            raise fail(900004, f"{name} without a value", offset)
        return self._formulas.number(name, offset)

    def _assignment(self) -> None:
        stream, offset = self._stream, self._stream.current.offset
        target = self._formulas.reference()
        if not stream.is_op("="):
            raise fail(900010, f"{target.name} without =", offset)
        stream.next()
        value, store = self._formulas.expression(), target.store
        assert store is not None
        if isinstance(value, Constant):
            constant = value.value
            self.block.steps.append(lambda words: store(constant))
        else:
            self.block.steps.append(lambda words: store(value()))

    def _once(self, name: str, offset: int) -> None:
        if name in self.block.offsets:
            raise fail(900005, f"{name} twice in one block", offset)
        self.block.offsets[name] = offset

    def _motion_word(self, offset: int) -> None:
        if self.block.template.offset is None:
            self.block.template.offset = offset

    def _step(self, step: Step, simple: bool = False) -> None:
        self.block.steps.append(step)
        self.block.simple = self.block.simple and simple

    # words

    def _long_axis(self) -> bool:
        """An axis word whose name has several characters: it needs ``=``."""
        stream, offset = self._stream, self._stream.current.offset
        rest = stream.text[offset:].upper()
        for name in self._axes:
            if (
                len(name) > 1
                and rest.startswith(name)
                and LONG_NAME.match(rest, len(name))
            ):
                stream.skip_to(offset + len(name))
                self._axis(name, offset)
                return True
        return False

    def _axis(self, name: str, offset: int) -> None:
        stream, after = self._stream, self._stream.following
        if stream.is_op("[") and after.text.upper() in AXIS_BRACKETS:
            raise fail(
                900003,
                f"{name}[{after.text.upper()} ..] is not supported",
                offset,
            )
        self._once(name, offset)
        self._motion_word(offset)
        axis, value = self._axes[name], self._value(name, offset)

        def step(words: Words) -> None:
            words.motion.axis[axis] = value()

        self._step(step, simple=True)

    def _n(self, offset: int) -> None:
        self._once("N", offset)
        value = self._value("N", offset)

        def step(words: Words) -> None:
            words.motion.n = integer(value(), N_MAX, "N", offset)

        self._step(step, simple=True)

    def _f(self, offset: int) -> None:
        self._once("F", offset)
        value = self._value("F", offset)

        def step(words: Words) -> None:
            words.motion.f = value()

        self._step(step, simple=True)

    def _e(self, offset: int) -> None:
        """Feed at the block's end: checked, without effect."""
        self._once("E", offset)
        value = self._value("E", offset)

        def step(words: Words) -> None:
            if value() <= 0:
                raise fail(
                    900012,
                    "E: the feed at the block's end must be positive",
                    offset,
                )
            self._state.channel.stored_without_effect("word E", offset)

        self._step(step)

    def _r(self, offset: int) -> None:
        self._once("R", offset)
        self._motion_word(offset)
        value = self._value("R", offset)

        def step(words: Words) -> None:
            words.motion.r = value()

        self._step(step, simple=True)

    def _centre(self, offset: int) -> None:
        letter = self._letter
        self._once(letter, offset)
        self._motion_word(offset)
        value = self._value(letter, offset)

        def step(words: Words) -> None:
            words.motion.centre[letter] = value()

        self._step(step, simple=True)

    def _s(self, offset: int) -> None:
        stream = self._stream
        if stream.is_op("[") and stream.following.text.upper() in (
            "M",
            "REV",
            "POS",
        ):
            self._spindle_bracket(offset)
            return
        if stream.is_op("."):
            self._spindle_position(offset)
            return
        if stream.current.kind is Kind.NUMBER and LONG_NAME.match(
            stream.text, stream.following.offset
        ):
            number = stream.next().text
            if number != "1":
                raise fail(
                    900003,
                    f"S{number}= is not supported: the channel has one spindle",
                    offset,
                )
        self._once("S", offset)
        self._speed(self._value("S", offset), offset)

    def _speed(self, value: Callable[[], float], offset: int) -> None:
        def step(words: Words) -> None:
            words.spindle = value()
            if words.spindle < 0:
                raise fail(900012, f"S{words.spindle:g} is negative", offset)

        self._step(step)

    def _spindle_bracket(self, offset: int) -> None:
        """``S[M3 REV1000 POS45]``."""
        stream, opened = self._stream, self._formulas.open()
        while not stream.at_end and not stream.is_op("]"):
            token = stream.current
            if stream.accept_name("M"):
                self._letter = "M"
                self._function(token.offset)
            elif stream.accept_name("REV"):
                self._once("S", token.offset)
                self._speed(self._value("REV", token.offset), token.offset)
            elif stream.accept_name("POS"):
                self._position(self._value("POS", token.offset))
            else:
                raise fail(
                    900003,
                    f"S[{stream.current.text.upper()} ..] is not supported",
                    token.offset,
                )
        self._formulas.close(opened)

    def _spindle_position(self, offset: int) -> None:
        """``S.POS=180``."""
        self._stream.next()
        name = self._stream.next().text.upper()
        if name != "POS":
            raise fail(900003, f"S.{name} is not supported", offset)
        self._position(self._value("S.POS", offset))

    def _position(self, value: Callable[[], float]) -> None:
        def step(words: Words) -> None:
            words.position = value()

        self._step(step)

    def _t(self, offset: int) -> None:
        self._once("T", offset)
        value = self._value("T", offset)

        def step(words: Words) -> None:
            words.tool = integer(value(), NUMBER_MAX, "T", offset)

        self._step(step)

    def _d(self, offset: int) -> None:
        self._once("D", offset)
        value = self._value("D", offset)

        def step(words: Words) -> None:
            words.data = integer(value(), NUMBER_MAX, "D", offset)

        self._step(step)

    def _function(self, offset: int) -> None:
        letter, stream = self._letter, self._stream
        if not self._formulas.starts_here():
            raise fail(900004, f"{letter} without a number", offset)
        number = number_of(self._formulas.primary(), letter, offset)
        value: Callable[[], float] | None = None
        if stream.is_op("="):
            stream.next()
            value = self._value(letter, offset, assign=False)

        def step(words: Words) -> None:
            code = integer(number(), FUNCTION_MAX, letter, offset)
            if value is not None and letter == "M" and code in WITHOUT_VALUE:
                raise fail(900004, f"M{code} takes no value", offset)
            if any(f.number == code for f in words.functions[letter]):
                raise fail(900005, f"{letter}{code} twice in one block", offset)
            given = None if value is None else float(round_half_away(value()))
            words.functions[letter].append(Function(code, given, offset))

        self._step(step)

    def _call(self, offset: int, letters: str) -> None:
        """``L name``, ``LL name``, ``L CYCLE [..]``: executed at the end of the
        block.
        """
        self._once("L", offset)
        made = CallParser(self._stream, self._formulas, self._state).parse(
            offset, letters
        )

        def step(words: Words) -> None:
            words.call = made()

        self._step(step)

    # G functions

    def _g(self, offset: int) -> None:
        token = self._stream.current
        if token.kind is not Kind.NUMBER or not digits(token.text):
            raise fail(900004, "G without a whole number", offset)
        code = int(self._stream.next().text)
        self._check_group(code, offset)
        self.block.codes[f"G{code}"] = offset
        if code == 4:
            self._dwell(offset)
        elif code in gcodes.EFFECTS:
            gcodes.EFFECTS[code](self.block.template)
            self.block.simple = self.block.simple and code in gcodes.PLAIN
        elif code in gcodes.VALUED:
            self._valued(code, offset)
        elif code in gcodes.USER_CODES:
            self._user(code, offset)
        elif code in gcodes.REFUSED:
            raise fail(900003, f"G{code:02d} is not supported", offset)
        elif code not in gcodes.ACCEPTED:
            raise fail(20131, f"unknown G function G{code:02d}", offset)
        else:
            self.block.simple = False

    def _check_group(self, code: int, offset: int) -> None:
        group, error = gcodes.GROUP_OF.get(code, (f"G{code:02d}", 900011))
        if "G " + group in self.block.offsets:
            raise fail(
                error,
                f"G{code:02d}: second function of its group ({group}) in the block",
                offset,
            )
        self.block.offsets["G " + group] = offset

    def _dwell(self, offset: int) -> None:
        """G04, with a bare time behind it or not (``G04 X..``, ``G04 S..``)."""
        self.block.is_dwell, self.block.simple = True, False
        if not self._long_axis_follows() and self._formulas.starts_here():
            value = self._value("G04", offset, assign=False)

            def step(words: Words) -> None:
                words.dwell = value()

            self._step(step)

    def _long_axis_follows(self) -> bool:
        stream = self._stream
        rest = stream.text[stream.current.offset :].upper()
        return any(
            rest.startswith(n) and LONG_NAME.match(rest, len(n))
            for n in self._axes
            if len(n) > 1
        )

    def _valued(self, code: int, offset: int) -> None:
        """``G133 = 100``; ``G133 100`` is accepted with a warning."""
        self.block.simple = False
        stream = self._stream
        if not stream.is_op("="):
            if stream.current.kind is not Kind.NUMBER:
                if code not in gcodes.VALUE_OPTIONAL:
                    raise fail(900004, f"G{code} without a value", offset)
                return
            self._state.warn(
                907040, f"G{code} without = before its value", offset
            )
        value = self._value(f"G{code}", offset)

        def step(words: Words) -> None:
            words.values[code] = value()

        self._step(step)

    def _user(self, code: int, offset: int) -> None:
        """G80 [1, , 3]: positional values."""
        self.block.simple = False
        if not self._stream.is_op("["):
            return
        formulas, opened = self._formulas, self._formulas.open()
        found: list[Callable[[], float] | None] = []
        while not self._stream.is_op("]"):
            if self._stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            empty = self._stream.is_op(",")
            found.append(None if empty else formulas.number(f"G{code}", offset))
            if not self._stream.accept(",") and not self._stream.is_op("]"):
                raise fail(
                    900004,
                    f"G{code}: expected , or ], found {self._stream.describe()}",
                    offset,
                )
        formulas.close(opened)
        if len(found) > gcodes.USER_VALUES:
            raise fail(
                900012,
                f"G{code}: more than {gcodes.USER_VALUES} values",
                offset,
            )

        def step(words: Words) -> None:
            words.arguments = [
                None if value is None else value() for value in found
            ]

        self._step(step)


def integer(value: float, highest: int, name: str, offset: int) -> int:
    """A whole number from 0 to ``highest``."""
    if not -0.5 < value < highest + 0.5:
        raise fail(900012, f"{name}{value:g} out of range 0..{highest}", offset)
    return abs(round_half_away(value))


def unmoved(words: Words) -> Words:
    """The same words without their axis words, which belong to a function that
    moves nothing.
    """
    return replace(words, motion=replace(words.motion, axis={}))
