"""Words of one line inside and outside a profile; letters are case-sensitive
inside (specification 3).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.osai.variables import (
    MOVEMENT,
    Variables,
    no_movement,
    variable_number,
)

NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
WORD = re.compile(
    rf"\s*([A-Za-z])\s*(?:({NUMBER})|([+-]?)([EL])([0-9]+)(?![0-9(]))"
)
N_MAX = 2**31 - 1
EXPRESSION_VALUE = re.compile(r"[+-]?\s*(?:[EL]?\s*\(|[EL][0-9]+\s*\()")
EXPRESSION = re.compile(rf"[A-Za-z]\s*({EXPRESSION_VALUE.pattern})")
LOGIC = re.compile(rf"(?:[A-Za-z]\s*)?({MOVEMENT})(?![0-9])")
SHOWN = 24
VALUE_MAX = 1e9  # of a word: beyond that no axis, feed or knot makes sense


@dataclass
class Words:
    """``values`` and ``offsets`` by letter; ``g``: offset by code."""

    n: int | None = None
    g: dict[int, int] = field(default_factory=dict)
    m: dict[int, int] = field(default_factory=dict)
    values: dict[str, float] = field(default_factory=dict)
    offsets: dict[str, int] = field(default_factory=dict)


def parse(
    text: str,
    variables: Variables,
    letters: str,
    warn_unset: list[str] | None = None,
    more: str = "",
) -> Words:
    """Words made of ``letters``, N, G and M; an axis letter that is none of
    them is an unknown word.

    ``more``: letters that are read, too, but that no error proposes.
    """
    words, at = Words(), 0
    while text[at:].strip():
        found = WORD.match(text, at)
        if not found:
            raise _malformed(text, at, letters, more)
        letter, offset = found[1], found.start(1)
        if found[4]:
            index = variable_number(found[5], found[4], found.start(4))
            value = (-1.0 if found[3] == "-" else 1.0) * variables(
                found[4], index
            )
            if warn_unset is not None and not variables.known(found[4], index):
                warn_unset.append(found[4] + found[5])
        else:
            value = float(found[2])
        if not abs(value) <= (N_MAX if letter == "N" else VALUE_MAX):
            raise fail(
                900012,
                f"{letter}: {shortened(found[0].strip()[1:])} is out of range",
                offset,
            )
        if letter not in letters + more + "GMN":
            raise unknown_word(letter, letters, offset)
        _take(words, letter, value, offset)
        at = found.end()
    return words


def shortened(text: str) -> str:
    """A number as an error shows it: not with hundreds of digits."""
    return (
        text
        if len(text) <= SHOWN
        else f"{text[:SHOWN]}.. ({len(text)} characters)"
    )


def _malformed(text: str, at: int, letters: str, more: str) -> Exception:
    offset = at + len(text[at:]) - len(text[at:].lstrip())
    logic = LOGIC.match(text, offset)
    if logic:
        return no_movement(logic.start(1))
    expression = EXPRESSION.match(text, offset)
    if expression:
        return fail(909227, ERRORS[909227], expression.start(1))
    if text[offset] not in letters + more + "NGM":
        return unknown_word(text[offset], letters, offset)
    return fail(900004, f"{text[offset]} without a value", offset)


def unknown_word(letter: str, letters: str, offset: int) -> CncError:
    """Upper and lower case differ: the same letter of the other case is meant."""
    other = letter.swapcase()
    hint = (
        f"; did you mean {other}?"
        if other in letters
        else f"; the words are {' '.join(sorted({*letters, 'G', 'N'}))}"
    )
    return fail(909226, f"unknown word {letter}{hint}", offset)


def _take(words: Words, letter: str, value: float, offset: int) -> None:
    if letter in "GM":
        codes = words.g if letter == "G" else words.m
        if value != int(value) or not 0 <= value < 1000:
            raise fail(
                20131, f"unknown {letter} function {letter}{value:g}", offset
            )
        if int(value) in codes:
            raise fail(900005, f"{letter}{value:g} twice in one block", offset)
        codes[int(value)] = offset
    elif letter == "N":
        if words.n is not None:
            raise fail(900005, "N twice in one block", offset)
        if value != int(value) or not 0 <= value <= N_MAX:
            raise fail(
                900012,
                f"N{value:g}: a whole number 0..{N_MAX} is expected",
                offset,
            )
        words.n = int(value)
    elif letter in words.values:
        raise fail(900005, f"{letter} twice in one block", offset)
    else:
        words.values[letter], words.offsets[letter] = value, offset
