"""Functions of the dialect's expressions beyond the numeric ones: texts and
conversions.

Positions in texts count from 1.  ``MID[s, count, pos]`` and ``DELETE[s, count,
pos]`` take the count first.
"""

from __future__ import annotations

import math

from cnc_core.errors import CncError
from cnc_core.frontend.base.expression import round_half_away
from cnc_core.frontend.base.formula import FormulaParser, Function
from cnc_core.frontend.base.variables import TEXT_MAX

RANGE = 907018


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


def _whole(value: object) -> int:
    if not isinstance(value, float):
        raise TypeError
    return round_half_away(value)


def _limited(text: str) -> str:
    if len(text) > TEXT_MAX:
        raise CncError(RANGE, f"text longer than {TEXT_MAX} characters")
    return text


def _count(value: object) -> int:
    count = _whole(value)
    if count < 0:
        raise CncError(RANGE, f"negative number of characters {count}")
    return count


def _place(text: str, pos: object, code: int = RANGE) -> int:
    place = _whole(pos)
    if not 1 <= place <= len(text):
        raise CncError(code, f"position {place} out of range 1..{len(text)}")
    return place - 1


def _left(text: object, count: object) -> str:
    return _text(text)[: _count(count)]


def _right(text: object, count: object) -> str:
    whole, wanted = _text(text), _count(count)
    return whole[max(0, len(whole) - wanted) :]


def _mid(text: object, count: object, pos: object) -> str:
    place = _place(_text(text), pos)
    return _text(text)[place : place + _count(count)]


def _ord(text: object, pos: object) -> float:
    return float(ord(_text(text)[_place(_text(text), pos)]))


def _find(text: object, wanted: object) -> float:
    return float(_text(text).find(_text(wanted)) + 1)


def _delete(text: object, count: object, pos: object) -> str:
    place = _place(_text(text), pos, 21545)
    return _text(text)[:place] + _text(text)[place + _count(count) :]


def _insert(text: object, other: object, pos: object) -> str:
    """``other`` behind the character at ``pos``; 0 is in front of all."""
    place = _whole(pos)
    if not 0 <= place <= len(_text(text)):
        raise CncError(
            RANGE, f"position {place} out of range 0..{len(_text(text))}"
        )
    whole = _text(text)
    return _limited(whole[:place] + _text(other) + whole[place:])


def _replace(text: object, other: object, count: object, pos: object) -> str:
    place = _place(_text(text), pos)
    return _limited(
        _text(text)[:place]
        + _text(other)
        + _text(text)[place + _count(count) :]
    )


def _integer_text(value: object) -> str:
    return str(_whole(value))


def _real_text(value: object) -> str:
    if not isinstance(value, float):
        raise TypeError
    return f"{value:.6f}"


def _real_of(text: object) -> float:
    value = float(_text(text))
    if not math.isfinite(value):
        raise ValueError
    return value


def _integer_of(text: object) -> float:
    return float(int(_text(text)))


TEXT_FUNCTIONS = {
    "LEFT": Function(_left, 2, 2),
    "RIGHT": Function(_right, 2, 2),
    "MID": Function(_mid, 3, 3),
    "LEN": Function(lambda text: float(len(_text(text))), 1, 1),
    "ORD": Function(_ord, 2, 2),
    "FIND": Function(_find, 2, 2),
    "DELETE": Function(_delete, 3, 3),
    "INSERT": Function(_insert, 3, 3),
    "REPLACE": Function(_replace, 4, 4),
}
for _names, _function in (
    (("INT_STR", "INT_TO_STRING"), _integer_text),
    (("REAL_STR", "REAL_TO_STRING"), _real_text),
    (("STR_INT", "STRING_TO_INT"), _integer_of),
    (("STR_REAL", "STRING_TO_REAL"), _real_of),
):
    for _name in _names:
        TEXT_FUNCTIONS[_name] = Function(_function, 1, 1)

STRICT = FormulaParser.functions | TEXT_FUNCTIONS


def _whole_quotient(dividend: float, divisor: float) -> float:
    return float(math.trunc(dividend / divisor))


# names that no source documents; lenient mode only
LENIENT = STRICT | {
    "DEG": Function(math.degrees, 1, 1),
    "RAD": Function(math.radians, 1, 1),
    "TRUNC": Function(lambda x: float(math.trunc(x)), 1, 1),
    "DIV": Function(_whole_quotient, 2, 2),
}
