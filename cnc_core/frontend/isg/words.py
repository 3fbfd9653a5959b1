"""DIN words of one block: tokens to values.  Nothing is executed here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from cnc_core.frontend.base.expression import ExpressionParser, VariableSource, round_half_away, variable_name
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.base.scanner import MotionWords
from cnc_core.frontend.isg import gcodes

FUNCTION_MAX = 65535
NUMBER_MAX = 2**31 - 1
N_MAX = 2**32 - 1
# M functions that carry no value
WITHOUT_VALUE = frozenset({0, 1, 2, 3, 4, 5, 17, 19, 29, 30, *range(40, 46)})
AXIS_BRACKETS = frozenset(
    {"OSC", "COMP", "DIST_CTRL", "OVERRIDE", "DYNAMIC", "LIFT", "SYNC", "POLY", "INDP", "INDP_SYN", "INDP_ASYN"}
)
REFUSED_SIGNS = {
    "$": "control statement",
    "@": "cycle parameter",
    '"': "macro",
    "/": "block skip",
    "[": "label",
    ":": "label",
}


@dataclass(frozen=True)
class Function:
    """One M or H function; ``offset`` of its letter."""

    number: int
    value: float | None
    offset: int


@dataclass
class Words:
    """Everything one block says.  ``offsets``: where a word stands, by its letter or ``G`` group."""

    motion: MotionWords = field(default_factory=MotionWords)
    functions: dict[str, list[Function]] = field(default_factory=lambda: {"M": [], "H": []})
    spindle: float | None = None
    tool: int | None = None
    data: int | None = None
    is_dwell: bool = False
    dwell: float | None = None
    offsets: dict[str, int] = field(default_factory=dict)
    codes: dict[str, int] = field(default_factory=dict)


class WordParser:
    """Reads the words of one block from a token stream."""

    def __init__(self, stream: TokenStream, axes: dict[str, int], variables: VariableSource) -> None:
        self.words = Words()
        self._stream = stream
        self._axes = axes  # name in capitals -> channel index, longest name first
        self._expressions = ExpressionParser(stream, variables)
        self._letters: dict[str, Callable[[int], None]] = {
            "N": self._n,
            "G": self._g,
            "M": self._function,
            "H": self._function,
            "F": self._f,
            "S": self._s,
            "T": self._t,
            "D": self._d,
            "R": self._r,
            "I": self._centre,
            "J": self._centre,
            "K": self._centre,
        }

    def parse(self) -> Words:
        while not self._stream.at_end:
            self.word()
        return self.words

    def word(self) -> None:
        """One word, whatever it is."""
        stream, token = self._stream, self._stream.current
        if token.kind is not Kind.NAME:
            raise self._refused_sign()
        if self._long_axis():
            return
        self._refuse_names()
        letter = token.text[0].upper()
        self._letter = letter
        if letter in self._axes:
            stream.take_letters(1)
            self._axis(letter, token.offset)
        elif letter in self._letters:
            stream.take_letters(1)
            self._letters[letter](token.offset)
        else:
            raise fail(900001, f"unknown word {token.text}", token.offset)

    def n_number(self) -> None:
        """The N word in front of a block, if there is one."""
        if self._stream.current.kind is Kind.NAME and self._stream.current.text[0] in "nN":
            self.word()

    # refusals

    def _refused_sign(self) -> Exception:
        token = self._stream.current
        name = REFUSED_SIGNS.get(token.text[:1])
        if token.text == "#":
            return fail(900010, "a # command stands alone in its block", token.offset)
        if name:
            return fail(900003, f"{name} {token.text} is not supported", token.offset)
        return fail(900001, f"unknown word {token.text}", token.offset)

    def _refuse_names(self) -> None:
        """Statements that begin with letters and are no DIN words."""
        token, after = self._stream.current, self._stream.following
        letters = token.text.upper()
        parameter = after.kind is Kind.NUMBER or after.text == "["
        if (letters == "V" and after.text == ".") or (set(letters) == {"P"} and parameter):
            raise fail(900003, f"{variable_name(self._stream)} is not supported", token.offset)
        if letters.startswith("MC_"):
            raise fail(900003, f"{letters} is not supported", token.offset)
        if letters.startswith("L"):
            raise fail(900003, "subprogram call is not supported", token.offset)
        if letters.startswith("E"):
            raise fail(900003, "word E is not supported", token.offset)

    # values

    def _value(self, name: str, offset: int, assign: bool = True) -> float:
        """``=`` if allowed, and an expression."""
        if assign:
            self._stream.accept("=")
        if not self._expressions.starts_here():
            raise fail(900004, f"{name} without a value", offset)
        value = self._expressions.expression()
        if self._stream.is_op("="):
            raise fail(900003, f"{name}..= is not supported", offset)
        return value

    def _once(self, name: str, offset: int) -> None:
        if name in self.words.offsets:
            raise fail(900005, f"{name} twice in one block", offset)
        self.words.offsets[name] = offset

    def _integer(self, value: float, highest: int, name: str, offset: int) -> int:
        if not 0 <= round_half_away(value) <= highest:
            raise fail(900012, f"{name}{value:g} out of range 0..{highest}", offset)
        return round_half_away(value)

    def _motion_word(self, offset: int) -> None:
        if self.words.motion.offset is None:
            self.words.motion.offset = offset

    # words

    def _long_axis(self) -> bool:
        """An axis word whose name has several characters: it needs ``=``."""
        stream, offset = self._stream, self._stream.current.offset
        rest = stream.text[offset:].upper()
        for name in self._axes:
            if len(name) > 1 and rest.startswith(name) and rest[len(name) :].lstrip().startswith("="):
                stream.skip_to(offset + len(name))
                self._axis(name, offset)
                return True
        return False

    def _axis(self, name: str, offset: int) -> None:
        self._refuse_bracket(name, offset)
        self._once(name, offset)
        self._motion_word(offset)
        self.words.motion.axis[self._axes[name]] = self._value(name, offset)

    def _refuse_bracket(self, name: str, offset: int) -> None:
        """``X[POLY ..]`` and the like."""
        stream, after = self._stream, self._stream.following
        if stream.is_op("[") and after.text.upper() in AXIS_BRACKETS:
            raise fail(900003, f"{name}[{after.text.upper()} ..] is not supported", offset)

    def _n(self, offset: int) -> None:
        self._once("N", offset)
        self.words.motion.n = self._integer(self._value("N", offset), N_MAX, "N", offset)

    def _f(self, offset: int) -> None:
        self._once("F", offset)
        self.words.motion.f = self._value("F", offset)

    def _r(self, offset: int) -> None:
        self._once("R", offset)
        self._motion_word(offset)
        self.words.motion.r = self._value("R", offset)

    def _centre(self, offset: int) -> None:
        self._once(self._letter, offset)
        self._motion_word(offset)
        self.words.motion.centre[self._letter] = self._value(self._letter, offset)

    def _s(self, offset: int) -> None:
        if self._stream.is_op("[") and self._stream.following.text.upper() in ("M", "REV", "POS"):
            raise fail(900003, "S[..] is not supported", offset)
        self._once("S", offset)
        self.words.spindle = self._value("S", offset)
        if self.words.spindle < 0:
            raise fail(900012, f"S{self.words.spindle:g} is negative", offset)

    def _t(self, offset: int) -> None:
        self._once("T", offset)
        self.words.tool = self._integer(self._value("T", offset), NUMBER_MAX, "T", offset)

    def _d(self, offset: int) -> None:
        self._once("D", offset)
        self.words.data = self._integer(self._value("D", offset), NUMBER_MAX, "D", offset)

    def _function(self, offset: int) -> None:
        letter, stream = self._letter, self._stream
        if not self._expressions.starts_here():
            raise fail(900004, f"{letter} without a number", offset)
        number = self._integer(self._expressions.primary(), FUNCTION_MAX, letter, offset)
        self._once(f"{letter}{number}", offset)
        value = None
        if stream.accept("="):
            if letter == "M" and number in WITHOUT_VALUE:
                raise fail(900004, f"M{number} takes no value", offset)
            value = float(round_half_away(self._value(f"{letter}{number}", offset, assign=False)))
        self.words.functions[letter].append(Function(number, value, offset))

    def _g(self, offset: int) -> None:
        token = self._stream.current
        if token.kind is not Kind.NUMBER or not token.text.isdigit():
            raise fail(900004, "G without a whole number", offset)
        code = int(self._stream.next().text)
        self._check_group(code, offset)
        self.words.codes[f"G{code}"] = offset
        if code == 4:
            self._dwell(offset)
        elif code in gcodes.EFFECTS:
            gcodes.EFFECTS[code](self.words.motion)
        elif code in gcodes.REFUSED:
            raise fail(900003, f"G{code:02d} is not supported", offset)
        elif code not in gcodes.INITIAL | gcodes.COMPENSATION:
            note = ": no subprogram is assigned to it" if code in gcodes.USER_CODES else ""
            raise fail(20131, f"unknown G function G{code:02d}{note}", offset)

    def _check_group(self, code: int, offset: int) -> None:
        group, error = gcodes.GROUP_OF.get(code, (f"G{code:02d}", 900011))
        if "G " + group in self.words.offsets:
            raise fail(error, f"G{code:02d}: second function of its group ({group}) in the block", offset)
        self.words.offsets["G " + group] = offset

    def _dwell(self, offset: int) -> None:
        """G04, with a bare time behind it or not (``G04 X..``, ``G04 S..``)."""
        self.words.is_dwell = True
        if not self._long_axis_follows() and self._expressions.starts_here():
            self.words.dwell = self._value("G04", offset, assign=False)

    def _long_axis_follows(self) -> bool:
        stream = self._stream
        rest = stream.text[stream.current.offset :].upper()
        return any(rest.startswith(n) and rest[len(n) :].lstrip().startswith("=") for n in self._axes if len(n) > 1)
