"""Texts with values: #MSG, #MSG SAVE, #ERROR."""

from __future__ import annotations

import re
from collections.abc import Sequence

from cnc_core.frontend.base.expression import round_half_away
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.variables import Value

FORMAT = re.compile(r"%(%|(?:[0-9]*(?:\.[0-9]+)?)[dDfFsS])")
WIDTH_MAX = 200


def formatted(text: str, values: Sequence[Value], offset: int) -> str:
    """Fill ``%d``, ``%f`` (6 decimals unless given), ``%s`` and ``%%``.

    Error 20726: a value is missing.
    """
    rest = list(values)

    def value(found: re.Match[str]) -> str:
        form = found[1]
        if form == "%":
            return "%"
        if not rest:
            raise fail(20726, f"message: no value for %{form}", offset)
        return _one(form, rest.pop(0), offset)

    out = FORMAT.sub(value, text)
    if rest:
        raise fail(
            907051,
            f"message: {len(rest)} values more than the text has places for",
            offset,
        )
    return out


def _one(form: str, value: Value, offset: int) -> str:
    kind, shape = form[-1].lower(), form[:-1]
    width, _, digits = shape.partition(".")
    if max(int(width or 0), int(digits or 0)) > WIDTH_MAX:
        raise fail(
            907051, f"message: %{form} is wider than {WIDTH_MAX}", offset
        )
    if kind == "s":
        return f"{value if isinstance(value, str) else f'{value:g}':>{int(width or 0)}}"
    if isinstance(value, str):
        raise fail(
            907051, f"message: %{form} takes a number, not a text", offset
        )
    if kind == "d":
        return f"{round_half_away(value):>{int(width or 0)}d}"
    shown = f"{value:.{int(digits or 6)}f}"
    if not shown.strip("-0."):
        shown = shown.lstrip("-")
    return f"{shown:>{int(width or 0)}}"
