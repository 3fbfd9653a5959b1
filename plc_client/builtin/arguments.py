"""Arguments of the built-in programs, checked once."""

from __future__ import annotations

import difflib
from typing import Any

Arguments = dict[str, Any]


def checked(given: Arguments, defaults: Arguments) -> Arguments:
    """`defaults` updated by `given`; ValueError names an unknown argument (with
    the nearest one) or a wrong type.
    """
    if not isinstance(given, dict):
        raise ValueError("--args: a JSON object is needed")
    for name, value in given.items():
        if name not in defaults:
            near = difflib.get_close_matches(name, defaults, n=1)
            hint = (
                f"did you mean {near[0]}?"
                if near
                else f"known: {', '.join(defaults)}"
            )
            raise ValueError(f"argument {name!r}: unknown; {hint}")
        if not _fits(value, defaults[name]):
            raise ValueError(
                f"argument {name} = {value!r}: a {type(defaults[name]).__name__} is needed"
            )
    return {**defaults, **given}


def _fits(value: Any, default: Any) -> bool:
    if isinstance(default, bool) or isinstance(value, bool):
        return isinstance(value, bool) and isinstance(default, bool)
    return isinstance(
        value, (int, float) if isinstance(default, float) else type(default)
    )
