"""Arrays on their way to C: the only door for rows and numbers.

A pointer keeps its array alive and knows its size.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cnc_core._engine import ffi
from cnc_core.units import AnyArray

from . import NC_BLOCK

OUTSIDE = "coefficients outside the pool, or a plane that the channel lacks"
"""What a stage says of rows that it refuses (-2)."""


def row_pointer(rows: AnyArray, writable: bool = False) -> Any:
    """``nc_block[]`` of rows.

    Raises TypeError for another type of elements, ValueError for rows that do
    not lie side by side.
    """
    if rows.dtype is not NC_BLOCK and rows.dtype != NC_BLOCK:
        raise TypeError(f"rows of {rows.dtype}: NC_BLOCK is needed")
    return ffi.from_buffer("nc_block[]", rows, require_writable=writable)


def pool_pointer(numbers: AnyArray) -> Any:
    """``double[]`` of numbers; NULL of none.  Errors as ``row_pointer``."""
    if numbers.dtype != np.float64:
        raise TypeError(f"numbers of {numbers.dtype}: float64 is needed")
    return ffi.from_buffer("double[]", numbers) if numbers.size else ffi.NULL
