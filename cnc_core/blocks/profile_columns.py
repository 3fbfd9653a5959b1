"""The waist's columns for profiles: curves as points, polynomials or B-splines.

A profile is one block of the program (G61..G60 of a 10-Series program). Its
front end hands out ``ProfileChunk`` columns: no row and no object per point.
The stage ``cnc_core.geometry.profiles`` makes rows of them.

The columns know no dialect. A ``ProfileSpec`` says in plain terms how the
profile is to be machined.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..units import FloatArray, IntArray

# What happens at the end of a point's curve, or at the end of a polynomial.
SMOOTH, TANGENT, BLEND, STOP, PASS = 0, 62, 63, 66, 67
# behind a piece that passes an edge of PASS; code of its row
PASSED = 68
POINTS, POLYNOMIALS, CONTROL_POINTS = "points", "polynomials", "control points"
# tool direction, surface normal, radius application direction
VERSORS = ("ijk", "mno", "pqd")

PointType = Literal["CCP", "CLP", "AXI"]
AxisRole = Literal["ABS", "ORD", "VRT", "TAN", "TAO", "OTH"]
AxisPlace = Literal["LI1", "LI2", "LI3", "WRK", "TOL", "OTH"]
JerkMode = Literal["profile", "none", "axes"]


@dataclass(frozen=True)
class Dynamics:
    """Limits of one axis, mm/s, mm/s2, mm/s3, or degrees for rotary axes.

    None: the machine's own limit.
    """

    velocity: float | None = None
    acceleration: float | None = None
    jerk: float | None = None


@dataclass(frozen=True)
class ProfileAxis:
    """One axis of a profile.

    ``channel``: index of the channel axis.  ``factor``: driven mm per
    programmed unit.
    """

    name: str
    channel: int
    role: AxisRole
    place: AxisPlace
    rotary: bool = False
    factor: float = 1.0
    null_move: float = 0.0
    pitch: float | None = None
    low: float | None = None
    high: float | None = None
    cutting: Dynamics = Dynamics()
    rapid: Dynamics = Dynamics()

    @property
    def linear(self) -> bool:
        return self.role in ("ABS", "ORD", "VRT")

    @property
    def tangential(self) -> bool:
        return self.role in ("TAN", "TAO")

    @property
    def kinematic(self) -> bool:
        """A rotary axis of the machine's chain."""
        return self.place in ("WRK", "TOL")


@dataclass(frozen=True)
class ToolShape:
    """Lengths in mm.

    ``edge_radius`` 0: cylindrical, the radius: ball, between: toroidal.
    ``contact_deg``: angle.
    """

    length: float = 0.0
    radius: float = 0.0
    edge_radius: float = 0.0
    contact_deg: float = -90.0
    origin_length: float = 0.0
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)
    # location points are the centre of the edge radius, not the tip
    centre: bool = False


@dataclass(frozen=True)
class Marks:
    """Automatic edges and changes of curvature.

    An angle or a length of 0 switches its test off.
    """

    edge_deg: float = 0.0
    versor_deg: float = 0.0
    edge_code: int = STOP
    edge_share: float = 1.0
    long_mm: float = 0.0
    ratio: float = 0.0
    ratio_code: int = BLEND


@dataclass(frozen=True)
class Smoothness:
    """How the speed is smoothed.

    ``jerk``: of the profile, none, or of each axis.
    Times are in seconds.  0: off.
    """

    jerk: JerkMode = "profile"
    scale: float | None = None
    entities: int = 0
    window_s: float = 0.0
    merge_s: float = 0.0
    constant_s: float = 0.0


@dataclass(frozen=True)
class ChainStep:
    """Step from the frame before to the frame of ``name``: offset mm, then
    rotations about X, Y, Z in degrees.
    """

    name: str
    offset: tuple[float, float, float]
    rotation: tuple[float, float, float]


@dataclass(frozen=True)
class Chain:
    """Kinematic chain: type and bed by their names (specification 9.3), and its
    steps by name, ``t`` and ``w`` too.
    """

    kind: str
    bed: str
    steps: tuple[ChainStep, ...]


@dataclass(frozen=True)
class ProfileSpec:
    """Everything that holds from a profile's beginning to its end.

    ``start``: (channel axes,) position when it begins.  ``versors``: groups
    that are columns of the chunks. ``degree``: of the curves made from points
    (3 or 5), or of the programmed polynomials and B-splines (3 to 5).
    ``tolerance``, ``versor_tolerance``, ``null_move``, ``chord``: mm (versors:
    dimensionless).
    """

    kind: str
    axes: tuple[ProfileAxis, ...]
    point: PointType
    feed_on: PointType
    degree: int
    start: FloatArray
    count: int
    file: int = 0
    versors: tuple[str, ...] = ()
    tolerance: float = 0.01
    versor_tolerance: float = 0.0
    null_move: float = 0.0
    chord: float = 0.01
    tool: ToolShape = ToolShape()
    marks: Marks = Marks()
    smoothness: Smoothness = Smoothness()
    chain: Chain | None = None
    # polynomials and B-splines: feed along the arc, not in their parameter
    feed_by_length: bool = False

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns: axes, then versor components."""
        return (*(axis.name for axis in self.axes), *"".join(self.versors))

    @property
    def linear(self) -> tuple[int, int, int]:
        """Columns of abscissa, ordinate, vertical."""
        roles = [axis.role for axis in self.axes]
        return roles.index("ABS"), roles.index("ORD"), roles.index("VRT")

    @property
    def tangential(self) -> int | None:
        """Column of the tangential axis."""
        return next(
            (i for i, axis in enumerate(self.axes) if axis.tangential), None
        )

    @property
    def five_axes(self) -> bool:
        return any(axis.kinematic for axis in self.axes)

    def versor_columns(self, letters: str) -> slice | None:
        """Columns of a versor group, None if it is not programmed."""
        if letters not in self.versors:
            return None
        first = len(self.axes) + 3 * self.versors.index(letters)
        return slice(first, first + 3)


@dataclass
class ProfileChunk:
    """A stretch of a profile of n points or polynomials.

    ``feed``: mm/s.  ``after``: transition behind each point or polynomial.
    ``values``: (n, columns) of points and control points.
    ``rapid``: the point is reached in a straight line.
    ``coef``: (n, columns, degree + 1) of polynomials, ascending over
    0..``span`` (n,).
    ``knots``: (n + degree + 1,).  One chunk is one whole B-spline.
    ``last``: the profile ends with this chunk.
    """

    spec: ProfileSpec
    line: IntArray
    number: IntArray
    feed: FloatArray
    after: IntArray
    values: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    rapid: npt.NDArray[np.bool_] = field(
        default_factory=lambda: np.empty(0, np.bool_)
    )
    coef: FloatArray = field(default_factory=lambda: np.empty((0, 0, 0)))
    span: FloatArray = field(default_factory=lambda: np.empty(0))
    knots: FloatArray = field(default_factory=lambda: np.empty(0))
    last: bool = False

    def __len__(self) -> int:
        return len(self.line)
