"""What a member of the HLI can hold: checks of single values, made once for
each member.
"""

from __future__ import annotations

import ctypes
import math
from typing import Any

import numpy as np

from . import layout


def _int_limits(ctype: Any) -> tuple[int, int]:
    bits = 8 * ctypes.sizeof(ctype)
    signed = ctype(-1).value < 0
    return (
        (-(1 << bits - 1), (1 << bits - 1) - 1)
        if signed
        else (0, (1 << bits) - 1)
    )


def checker(name: str, ctype: Any) -> Any:
    """Function value -> value the member can hold; raises TypeError or
    OverflowError that names the member.
    """
    if ctype is layout.BOOL:
        return bool_checker(name)
    if ctype is layout.LREAL:
        return _float_checker(name)
    low, high = _int_limits(ctype)

    def check(value: Any) -> int:
        number = value if type(value) is int else _whole(name, value)
        if not low <= number <= high:
            raise OverflowError(f"{name} = {value}: out of range {low}..{high}")
        return number

    return check


def _float_checker(name: str) -> Any:
    def check(value: Any) -> float:
        if type(value) is float:
            return value
        if isinstance(value, (str, bytes)):  # float() reads texts, too
            raise TypeError(f"{name} = {value!r}: a number is needed")
        try:
            return float(value)
        except TypeError:
            text = f"{name} = {value!r}: a number is needed"
            raise TypeError(text) from None
        except OverflowError:
            raise OverflowError(f"{name}: the number is too large") from None

    return check


def _whole(name: str, value: Any) -> int:
    if isinstance(value, (int, np.integer)):
        return int(value)
    if (
        isinstance(value, (float, np.floating))
        and math.isfinite(value)
        and value == int(value)
    ):
        return int(value)
    raise TypeError(f"{name} = {value!r}: a whole number is needed")


def bool_checker(name: str) -> Any:
    """As ``checker``, for BOOL."""

    def check(value: Any) -> bool:
        if isinstance(value, (bool, np.bool_)) or value in (0, 1):
            return bool(value)
        raise TypeError(f"{name} = {value!r}: TRUE or FALSE is needed")

    return check
