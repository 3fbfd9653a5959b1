"""What the Path Optimizer's stages hand to each other (HSM specification 11)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from cnc_core.units import FloatArray

IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Tolerances:
    """Of the linear axes, other axes and versors, and how the optimizer shares
    and uses them (SMT, SMS).

    ``linear``, ``other``, ``versor``: bands.  ``split``: share of the polyline.
    ``reach``: mm from an edge at which a joining piece may begin, at 90
    degrees.  ``condition``: 1 through the end points, 2 with their direction, 3
    with their curvature.  ``longest``: of a polynomial, 0: any.  ``group``:
    points fitted together.
    """

    linear: float
    other: float = 0.01
    versor: float = 0.001
    split: float = 0.5
    split_other: float = 0.5
    split_versor: float = 0.5
    reach: float = 1.0
    reach_other: float = 1.0
    reach_versor: float = 1.0
    condition: int = 2
    condition_other: int = 2
    condition_versor: int = 2
    longest: float = 0.0
    group: int = 1000


@dataclass(frozen=True)
class Pace:
    """What limits the speed along a path: feed, mm/s, and acceleration and jerk
    of the weakest linear axis, mm/s2 and mm/s3 (0: none).
    """

    feed: float = 100.0
    acceleration: float = 3000.0
    jerk: float = 50000.0


@dataclass(frozen=True)
class Demands:
    """What the curve of a section has to hold.

    ``linear``: columns of the linear axes.  ``kinds``: columns by kind (0
    linear axes, 1 others, 2 versors).  ``limits``: (columns,) tolerance of
    each.  ``condition``: of the ends, by kind.
    """

    linear: list[int]
    kinds: list[tuple[int, IntArray]]
    limits: FloatArray
    condition: IntArray
    tolerances: Tolerances
    pace: Pace


@dataclass
class Fit:
    """Polynomials (n, columns, 6) over ``span`` and which points (from, to)
    each covers; transitions at their ends.

    ``kind`` of the edge at the end: linear or versor (``Tolerances``).
    ``feed``: mm/s, in place of the points'. ``points`` (m, columns) of the
    input and ``at`` (m,) their parameter from the first polynomial on.
    """

    coef: FloatArray
    span: FloatArray
    first: IntArray
    after: IntArray
    kind: str = "linear"
    feed: float | None = None
    points: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    at: FloatArray = field(default_factory=lambda: np.empty(0))


@dataclass
class FitReport:
    """Largest deviation, mm: ``deviation`` of a point from the curve, ``band``
    of the curve from the input's path.

    The rest counts what was done on the way.  ``kept``: groups whose curve goes
    through every point of the input.
    """

    deviation: float = 0.0
    band: float = 0.0
    polyline_points: int = 0
    groups: int = 0
    kept: int = 0
    joints: int = 0
    jumps: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
