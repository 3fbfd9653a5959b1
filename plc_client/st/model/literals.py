"""The value and type of every literal form."""

from __future__ import annotations

import datetime
import re

from ..errors import RANGE, SYNTAX, Position, StopHere
from . import types

Constant = int | float | str
_EPOCH = datetime.date(1970, 1, 1).toordinal()
_PARTS = re.compile(r"(\d[\d_]*(?:\.\d+)?)(ms|us|ns|d|h|m|s)", re.I)
_UNIT_NS = {
    "d": 86_400_000_000_000,
    "h": 3_600_000_000_000,
    "m": 60_000_000_000,
    "s": 1_000_000_000,
    "ms": 1_000_000,
    "us": 1_000,
    "ns": 1,
}
_SPECIAL = {"L": "\n", "N": "\n", "P": "\f", "R": "\r", "T": "\t"}
_ESCAPE = re.compile(r"\$([0-9A-F]{4})|\$([0-9A-F]{2})|\$(.)", re.I | re.S)
_DURATION = {"T": "TIME", "TIME": "TIME", "LT": "LTIME", "LTIME": "LTIME"}
_DATES = {
    "D": "DATE",
    "DATE": "DATE",
    "LD": "LDATE",
    "LDATE": "LDATE",
    "DT": "DT",
    "DATE_AND_TIME": "DT",
    "LDT": "LDT",
    "LDATE_AND_TIME": "LDT",
    "TOD": "TOD",
    "TIME_OF_DAY": "TOD",
    "LTOD": "LTOD",
    "LTIME_OF_DAY": "LTOD",
}


def duration_ns(text: str, pos: Position) -> int:
    """``1d2h3.5s`` in ns."""
    sign = -1 if text.startswith("-") else 1
    rest = text.lstrip("-+").replace("_", "")
    total, at = 0.0, 0
    whole = 0
    while at < len(rest):
        match = _PARTS.match(rest, at)
        if match is None:
            raise StopHere(SYNTAX, f"duration {text!r}: use 1h2m3s4ms", pos)
        unit = _UNIT_NS[match[2].lower()]
        if "." in match[1]:
            total += float(match[1]) * unit
        else:
            whole += int(match[1]) * unit
        at = match.end()
    return sign * (whole + round(total))


def _day_ns(text: str, pos: Position) -> int:
    try:
        year, month, day = (int(part) for part in text.split("-")[:3])
        ordinal = datetime.date(year, month, day).toordinal()
    except ValueError:
        raise StopHere(RANGE, f"{text!r} is no date", pos) from None
    return (ordinal - _EPOCH) * _UNIT_NS["d"]


def _clock_ns(text: str, pos: Position) -> int:
    parts = [float(part) for part in text.split(":")]
    parts += [0.0] * (3 - len(parts))
    hour, minute, second = parts
    if hour > 23 or minute > 59 or second >= 60:
        raise StopHere(RANGE, f"{text!r} is no time of day", pos)
    return round((hour * 3600 + minute * 60) * 1e9) + round(second * 1e9)


def _date_ns(kind: str, text: str, pos: Position) -> int:
    if kind.endswith("TOD"):
        return _clock_ns(text, pos)
    if kind.endswith("DATE"):
        return _day_ns(text, pos)
    day, _, clock = text.rpartition("-")
    return _day_ns(day, pos) + _clock_ns(clock, pos)


def timed(prefix: str, text: str, pos: Position) -> tuple[types.Type, int]:
    """Value of a duration or date in counts of its type."""
    name = _DURATION.get(prefix)
    if name:
        ns = duration_ns(text, pos)
    else:
        name = _DATES[prefix]
        ns = _date_ns(name, text, pos)
    type_ = types.ELEMENTARY[name]
    value = ns // type_.unit_ns
    if not 0 <= value <= type_.high:
        raise StopHere(RANGE, f"{prefix}#{text}: {name} cannot hold it", pos)
    return type_, value


def is_timed(prefix: str) -> bool:
    """Whether the prefix of a typed literal is one of a time or date."""
    return prefix in _DURATION or prefix in _DATES


def whole(text: str, pos: Position) -> int:
    """``12``, ``16#FF``, ``-5``."""
    sign = -1 if text.startswith("-") else 1
    digits = text.lstrip("+-").replace("_", "")
    base, hash_, number = digits.rpartition("#")
    try:
        radix = int(base) if hash_ else 10
        if radix not in (2, 8, 10, 16):
            raise ValueError
        return sign * int(number, radix)
    except ValueError:
        text = f"{text!r} is no number; bases are 2, 8, 10 and 16"
        raise StopHere(SYNTAX, text, pos) from None


def text_of(literal: str) -> str:
    """The characters between the quotes; ``$`` sequences are resolved."""
    wide = literal.startswith('"')

    def character(match: re.Match[str]) -> str:
        if match[1] and wide:
            return chr(int(match[1], 16))
        if match[1]:
            return chr(int(match[1][:2], 16)) + match[1][2:]
        if match[2]:
            return chr(int(match[2], 16))
        return _SPECIAL.get(match[3].upper(), match[3])

    return _ESCAPE.sub(character, literal[1:-1])


def whole_type(value: int) -> types.Elementary:
    """The smallest type that holds a number without a type of its own."""
    for type_ in (types.SINT, types.USINT, types.INT, types.UINT):
        if type_.low <= value <= type_.high:
            return type_
    for type_ in (types.DINT, types.UDINT, types.LINT):
        if type_.low <= value <= type_.high:
            return type_
    return types.ULINT
