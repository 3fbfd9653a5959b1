"""Units, stated once, and the types of arrays.

Inside: mm, degrees for rotary axes, mm/s, s, rad for circle angles.  Name
suffixes carry other units: ``_tenth_um`` 0.1 um, ``_um_s`` 1 um/s, ``_us``,
``_ns``.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

MM_PER_INCH = 25.4
SECONDS_PER_MINUTE = 60.0

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
AnyArray: TypeAlias = Any
"""A numpy array whose type of elements the running program alone knows: a
column, or rows with named fields.

A checker would try every overload of each operation with it.
"""
