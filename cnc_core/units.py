"""Units, stated once.

Inside: mm, degrees for rotary axes, mm/s, s, rad for circle angles.  Name
suffixes carry other units: ``_tenth_um`` 0.1 um, ``_um_s`` 1 um/s, ``_us``,
``_ns``.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

MM_PER_INCH = 25.4
TENTH_UM_PER_MM = 10_000.0  # HLI positions and distances
UM_S_PER_MM_S = 1000.0  # HLI speeds
OVERRIDE_FULL = 1000  # HLI override, 0.1 %
OVERRIDE_MAX = 2000
MM_MIN_PER_MM_S = 60.0
