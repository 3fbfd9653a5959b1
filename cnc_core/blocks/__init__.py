"""The narrow waist: canonical rows of a prepared program in one numpy array.

``NC_BLOCK`` is the C struct ``nc_block`` (``c_ext/rows/nc_block.h``).
``cnc_core.engine`` compares the two, offset by offset, when the extension is
imported.

The hot path makes no Python object per block.  Front ends append rows, stages
map batches to batches, and the engine takes the array's pointer.  ``Block`` is
a thin view of one row for tests, dumps and messages.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.units import AnyArray, FloatArray

from .profile_columns import ProfileChunk

NC_AXES = 9

# row["type"]
LINEAR = 1
CIRCULAR = 2
POLYNOMIAL = 3
DWELL = 4
M = 5
H = 6
S = 7
T = 8
MARKER = 9
DISTANCE_RESET = 10
FLUSH = 11
RT_LOOP_BEGIN = 12
RT_LOOP_END = 13
EVENT = 14
COMPENSATION = 15
SMOOTHING = 16
CONTOUR = 17
DYNAMICS = 18
SPLINE = 19
COORDINATES = 20
CORNER = 21
PATH_MODE = 22
FILTER = 23
EXTENSION = 24
SOFT_LIMITS = 25
TYPE_NAMES: dict[int, str] = {
    LINEAR: "linear",
    CIRCULAR: "circular",
    POLYNOMIAL: "polynomial",
    DWELL: "dwell",
    M: "m",
    H: "h",
    S: "s",
    T: "t",
    MARKER: "marker",
    DISTANCE_RESET: "distance_reset",
    FLUSH: "flush",
    RT_LOOP_BEGIN: "rt_loop_begin",
    RT_LOOP_END: "rt_loop_end",
    EVENT: "event",
    COMPENSATION: "compensation",
    SMOOTHING: "smoothing",
    CONTOUR: "contour",
    DYNAMICS: "dynamics",
    SPLINE: "spline",
    COORDINATES: "coordinates",
    CORNER: "corner",
    SOFT_LIMITS: "soft_limits",
    PATH_MODE: "path_mode",
    FILTER: "filter",
    EXTENSION: "extension",
}
# rows for stages and engine only; they are no blocks of the program
SILENT = (COORDINATES, DYNAMICS, SOFT_LIMITS)
# row["flags"]
RAPID = 1
EXACT_STOP = 2
STANDSTILL = 4
HAS_PARAM = 8
WAIT = 16
HAS_VALUE = 32
CONTOUR_FEED = 64
MODULO = 128
ELEMENT = 256  # motion that only the PLC sees
PIECE = 512  # motion that is only executed
# polynomial: the feed is that of its parameter; its pieces: so is their path
BY_PARAMETER = 1024
OF_TIP = 2048  # piece with BY_PARAMETER: covers a path of the tool tip
# coordinates: the axes are programmed, a length is corrected along the tool
LENGTH_ONLY = 2048
BY_LENGTH = 4096  # polynomial over the path length
PTP = 8192  # coordinates: lines of the machine axes
# motion: the feed counts along its length, whatever the path mode says
PATH_FEED = 16384
NO_OVERRIDE = 32768
BENT = 254  # degree of a straight motion: a chord of a curve
BENT_FIRST = 253  # the first one of a curve
TANGENTS = 255  # degree of an element that names its tangents in the pool
# row["code"] of an event
EVENT_EXPL_SYN, EVENT_DIST2GO_END, EVENT_STORAGE_CLEAR = 2, 3, 4
EVENT_COMMAND, EVENT_OVERRIDE, EVENT_RT_LOOP = 5, 6, 7
EVENT_ESA_TIME, ESA_TIMES = 8, 3  # code of the first time, how many there are
EVENT_RT_COUNT = 11
MARKER_ON, MARKER_PARAM, MARKER_OFF, MARKER_CLEAR = 1, 2, 3, 4
# code of a smoothing row: corners are driven as fast as may be, or cut
SMOOTH_ON, SMOOTH_CUT = 1, 2
CHAMFER, EDGE, ROUND = 1, 2, 3  # code of a corner row
MARKER_NAMES = {
    MARKER_ON: "on",
    MARKER_PARAM: "param",
    MARKER_OFF: "off",
    MARKER_CLEAR: "clear",
}
PLANE_NAMES = {17: "XY", 18: "ZX", 19: "YZ"}

NC_BLOCK = np.dtype(
    [
        ("end", np.float64, NC_AXES),
        ("length", np.float64),
        ("feed", np.float64),
        ("center", np.float64, 2),
        ("radius", np.float64),
        ("programmed_radius", np.float64),
        ("angle", np.float64),
        ("value", np.float64),
        ("length_min", np.float64),
        ("code", np.int32),
        ("pool", np.uint32),
        ("n", np.uint32),
        ("line", np.uint32),
        ("count", np.uint32),
        ("file", np.uint16),
        ("flags", np.uint16),
        ("type", np.uint8),
        ("plane", np.uint8),
        ("degree", np.uint8),
        ("fill_1", np.uint8),
        ("end_speed", np.float32),
    ],
    align=True,
)
assert NC_BLOCK.itemsize == 176
NO_ROWS, NO_POOL = np.empty(0, NC_BLOCK), np.empty(0)
# by type: whether a row is a block
COUNTED = ~np.isin(np.arange(256), SILENT)


@dataclass
class BlockBatch:
    """Rows in program order, and the pool of their polynomial coefficients.

    ``rows``: (n,) of ``NC_BLOCK``.
    ``pool``: (m,) float64.  A polynomial row owns ``axes * (degree + 1)``
    values from ``row["pool"]`` on: axis after axis, ascending powers of the
    parameter 0..``row["angle"]``.
    ``profile``: columns of a profile behind the rows.  The stage for profiles
    makes rows of them.
    """

    rows: AnyArray
    pool: FloatArray = field(default_factory=lambda: np.empty(0))
    profile: ProfileChunk | None = None

    @classmethod
    def of_profile(cls, chunk: ProfileChunk) -> BlockBatch:
        return cls(np.empty(0, NC_BLOCK), profile=chunk)

    @classmethod
    def empty(cls) -> BlockBatch:
        return cls(NO_ROWS, NO_POOL)

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def motion(self) -> npt.NDArray[np.bool_]:
        """Mask of the rows that move axes."""
        return np.asarray(self.rows["type"] <= POLYNOMIAL)


def number_of_blocks(batch: BlockBatch) -> int:
    """Rows that are blocks, not said to the stages or the engine alone."""
    return int(np.count_nonzero(COUNTED[batch.rows["type"]]))


def number_of_last(batch: BlockBatch) -> int:
    """N of the last row; 0 where there is none."""
    return int(batch.rows["n"][-1]) if len(batch) else 0


def number_pushed(batch: BlockBatch) -> int:
    """Blocks of a batch on its way to the engine.

    Several pieces of one block count as no block.
    """
    pieces = (batch.rows["flags"] & PIECE != 0) & (
        batch.rows["type"] <= POLYNOMIAL
    )
    return number_of_blocks(batch) - int(pieces.sum())


# places of (first, second, third) axis of a plane among the three main axes
_PLANES = {
    17: (0, 1, 2),
    18: (2, 0, 1),
    19: (1, 2, 0),
}


def motion_planes(plane: int) -> tuple[int, int, int]:
    """Places of (first, second, third) axis among the three main axes.

    G17 XYZ, G18 ZXY, G19 YZX.
    """
    return _PLANES[plane]


class Block:
    """Readable view of one row; ``start`` is the end of the motion before it."""

    def __init__(
        self,
        row: Any,
        start: FloatArray,
        axes: Sequence[str],
        main: Sequence[int],
        pool: FloatArray | None = None,
    ) -> None:
        self.row, self.start = row, start
        self.axes, self.main, self.pool = axes, main, pool

    def _named(self, values: FloatArray) -> dict[str, float]:
        return {name: float(values[i]) for i, name in enumerate(self.axes)}

    def _motion(self) -> dict[str, Any]:
        row = self.row
        rapid = bool(row["flags"] & RAPID)
        return {
            "start": self._named(self.start),
            "end": self._named(row["end"]),
            "length": float(row["length"]),
            "feed": None if rapid else float(row["feed"]),
            "rapid": rapid,
        }

    def _circular(self) -> dict[str, Any]:
        row, plane = self.row, int(self.row["plane"])
        first, second, _ = (
            self.axes[self.main[i]] for i in motion_planes(plane)
        )
        return self._motion() | {
            "plane": PLANE_NAMES[plane],
            "center": {
                first: float(row["center"][0]),
                second: float(row["center"][1]),
            },
            "radius": float(row["radius"]),
            "programmed_radius": float(row["programmed_radius"]),
            "angle": float(row["angle"]),
        }

    def _polynomial(self) -> dict[str, Any]:
        order, first = int(self.row["degree"]) + 1, int(self.row["pool"])
        pool = np.empty(0) if self.pool is None else self.pool
        coef = {
            a: pool[first + i * order : first + (i + 1) * order].tolist()
            for i, a in enumerate(self.axes)
        }
        return self._motion() | {"s": float(self.row["angle"]), "coeff": coef}

    def as_json(self) -> dict[str, Any]:
        """The contract's JSON object of this row."""
        row, kind = self.row, int(self.row["type"])
        out: dict[str, Any] = {
            "type": TYPE_NAMES[kind],
            "line": int(row["line"]),
            "n": int(row["n"]),
            "count": int(row["count"]),
        }
        own = self._OWN.get(kind)
        return out if own is None else out | own(self)

    def _dwell(self) -> dict[str, Any]:
        return {"seconds": float(self.row["value"])}

    def _marker(self) -> dict[str, Any]:
        return {
            "action": MARKER_NAMES[int(self.row["code"])],
            "param": self._value_if(HAS_PARAM),
        }

    def _value_if(self, flag: int) -> float | None:
        row = self.row
        return float(row["value"]) if row["flags"] & flag else None

    def _speed(self) -> dict[str, Any]:
        return {"value": float(self.row["value"])}

    def _function(self) -> dict[str, Any]:
        return {
            "code": int(self.row["code"]),
            "value": self._value_if(HAS_VALUE),
        }

    def _event(self) -> dict[str, Any]:
        if self.row["code"] != EVENT_COMMAND:
            return self._function()
        number = int(self.row["value"])
        return {"code": number, "value": number}

    def _selection(self) -> dict[str, Any]:
        row = self.row
        return {"code": int(row["code"]), "value": float(row["value"])}

    def _contour(self) -> dict[str, Any]:
        return self._selection() | {
            "on": bool(self.row["plane"]),
            "distances": self.row["center"].tolist(),
        }

    def _dynamics(self) -> dict[str, Any]:
        return self._with_limits(max(6, len(self.axes)))

    def _soft_limits(self) -> dict[str, Any]:
        return self._with_limits(len(self.axes))

    def _with_limits(self, count: int) -> dict[str, Any]:
        limits = [float(value) for value in self.row["end"][:count]]
        return self._selection() | {"limits": limits}

    def _flush(self) -> dict[str, Any]:
        return {"wait": bool(self.row["flags"] & WAIT)}

    _OWN: ClassVar[dict[int, Callable[[Block], dict[str, Any]]]] = {
        LINEAR: _motion,
        CIRCULAR: _circular,
        POLYNOMIAL: _polynomial,
        DWELL: _dwell,
        MARKER: _marker,
        S: _speed,
        M: _function,
        H: _function,
        T: _function,
        EVENT: _event,
        CONTOUR: _contour,
        SMOOTHING: _selection,
        SPLINE: _selection,
        CORNER: _selection,
        DYNAMICS: _dynamics,
        SOFT_LIMITS: _soft_limits,
        FLUSH: _flush,
    }


def blocks(
    batch: BlockBatch,
    start: FloatArray,
    axes: Sequence[str],
    main: Sequence[int],
) -> Iterator[Block]:
    """One ``Block`` for each row that is executed.

    ``start``: (axes,) position before the batch.  The function advances it in
    place.
    """
    batch = whole_polynomials(batch, len(axes), main)
    for row in batch.rows:
        if row["type"] == COORDINATES:
            start[:] = row["end"][: len(start)]
            continue
        if row["flags"] & ELEMENT and row["type"] <= POLYNOMIAL:
            continue
        yield Block(row, start.copy(), axes, main, batch.pool)
        if row["type"] <= POLYNOMIAL and not row["flags"] & ELEMENT:
            start[:] = row["end"][: len(start)]


def whole_polynomials(
    batch: BlockBatch, axes: int, main: Sequence[int]
) -> BlockBatch:
    """Joins the parts of each programmed polynomial; ``code`` numbers it.

    The main axes are exact: the first part has their coefficients.  The other
    axes follow from directions.  Their polynomial has degree 5 and meets their
    values and two derivatives at both ends.
    """
    rows = batch.rows
    part = (
        (rows["type"] == POLYNOMIAL)
        & (rows["flags"] & (BY_PARAMETER | PIECE) == BY_PARAMETER)
        & (rows["code"] > 0)
    )
    same_code = rows["code"][1:] == rows["code"][:-1]
    again = np.append(False, part[1:] & part[:-1] & same_code)
    if not again.any():
        return batch
    out, pool = rows.copy(), [batch.pool]
    size = len(batch.pool)
    for first in np.flatnonzero(~again & np.append(again[1:], False)):
        last = int(first)
        while last + 1 < len(rows) and again[last + 1]:
            last += 1
        span = float(rows["angle"][first : last + 1].sum())
        coef = _whole(rows, batch.pool, (int(first), last), span, axes, main)
        out["angle"][first], out["degree"][first], out["pool"][first] = (
            span,
            coef.shape[1] - 1,
            size,
        )
        out["length"][first] = rows["length"][first : last + 1].sum()
        out["end"][first] = rows["end"][last]
        pool.append(coef.ravel())
        size += coef.size
    return BlockBatch(out[~again], np.concatenate(pool))


def _state(
    coef: FloatArray, s: float, span: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Value and two derivatives at ``s``, each (axes,), over a unit ``span``."""
    powers = plain.powers(s, np.arange(6))
    first = coef[:, 1:] * np.arange(1, 6)
    second = coef[:, 2:] * np.arange(2, 6)
    second = second * np.arange(1, 5)
    return (
        plain.product(coef, powers),
        plain.product(first, powers[:5]) * span,
        plain.product(second, powers[:4]) * span**2,
    )


def _whole(
    rows: Any,
    pool: FloatArray,
    ends: tuple[int, int],
    span: float,
    axes: int,
    main: Sequence[int],
) -> FloatArray:
    """(axes, 6) coefficients over 0..``span`` of the parts from ``ends[0]`` to
    ``ends[1]``.
    """
    parts = []
    for k in ends:
        order = int(rows["degree"][k]) + 1
        at = int(rows["pool"][k])
        own = pool[at : at + axes * order]
        parts.append(np.zeros((axes, 6)))
        parts[-1][:, :order] = own.reshape(axes, order)
    p0, v0, a0 = _state(parts[0], 0.0, span)
    end = float(rows["angle"][ends[1]])
    p1, v1, a1 = _state(parts[1], end, span)
    moved = p1 - p0
    out = np.stack([
        p0, v0, 0.5 * a0,
        10 * moved - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1,
        -15 * moved + 8 * v0 + 7 * v1 + 1.5 * a0 - a1,
        6 * moved - 3 * (v0 + v1) - 0.5 * (a0 - a1),
    ], axis=1) / plain.powers(span, np.arange(6))  # fmt: skip
    exact = [i for i in main if i >= 0]
    out[exact] = parts[0][exact]
    return np.asarray(out)
