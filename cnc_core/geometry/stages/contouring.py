"""Contouring (G61, G261): corners become two polynomials, their neighbours
shorter; ``c_ext/contour*.c`` does it.

Off until a ``CONTOUR`` row says otherwise.  One motion is held until the next
one is known, and the rows between them with it.  How it is done is told in
docs/explanation/contouring.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cnc_core._engine import ffi, lib
from cnc_core.blocks import (
    CONTOUR,
    NC_BLOCK,
    POLYNOMIAL,
    BlockBatch,
    H,
    M,
    S,
    T,
)
from cnc_core.blocks.to_c import OUTSIDE, pool_pointer, row_pointer
from cnc_core.errors import CncError, Place
from cnc_core.units import AnyArray, FloatArray

# where a function makes the channel stand: ahead of its block's motion, or
# behind it
AHEAD, BEHIND = 1, 2
KINDS = {"M": M, "H": H, "T": T, "S": S}
SHORT_MAX = 20  # messages about short blocks


@dataclass(frozen=True)
class ContourMachine:
    """What the stage has to know: main axes by channel index, mm/s2, mm/s, the
    functions that wait, and mm/s3, 0 without a limit.

    ``waits``: (kind letter, number) -> AHEAD or BEHIND.
    """

    main: tuple[int, int, int]
    accel: float
    rapid: float
    waits: Mapping[tuple[str, int], int]
    jerk: float = 0.0


@dataclass(frozen=True)
class ContourReport:
    """What was done so far; ``deviation``: mm, the largest of a curve from the
    programmed contour.

    ``skipped``: short blocks that were passed over.  ``irregular``: corners
    without a regular curve, driven exactly.
    """

    corners: int
    skipped: int
    irregular: int
    deviation: float


class Contouring:
    """Rows of the programmed contour in, rows with rounded corners out.

    ``place`` and ``warn``: where a row comes from, and who hears that a block
    is too short (120216).
    """

    def __init__(
        self,
        start: FloatArray,
        machine: ContourMachine,
        place: Callable[[int, int], Place],
        warn: Callable[[CncError], None],
    ) -> None:
        config = ffi.new("nc_contour_config *")
        config.axes = len(start)
        config.main_axis = list(machine.main)
        config.accel, config.rapid = machine.accel, machine.rapid
        config.jerk = machine.jerk
        handle = lib.nc_contour_new(config, _full(start))
        if handle == ffi.NULL:
            raise MemoryError("contouring")
        self._state: Any = ffi.gc(handle, lib.nc_contour_free)
        for (kind, number), how in machine.waits.items():
            lib.nc_contour_set_wait(handle, KINDS[kind], number, how)
        self._place, self._warn = place, warn
        self._short: set[tuple[int, int]] = set()

    @property
    def idle(self) -> bool:
        return bool(lib.nc_contour_idle(self._state))

    def push(self, batch: BlockBatch) -> BlockBatch:
        """Rows that are final now."""
        if (
            lib.nc_contour_idle(self._state)
            and not (batch.rows["type"] == CONTOUR).any()
        ):
            self._follow(batch.rows)
            return batch
        rows = np.ascontiguousarray(batch.rows)
        pool = np.ascontiguousarray(batch.pool)
        pointer = pool_pointer(pool)
        first = row_pointer(rows)
        failed = lib.nc_contour_push(
            self._state, first, len(rows), pointer, len(pool)
        )
        if failed == -2:
            raise ValueError(f"contouring: {OUTSIDE}")
        if failed < 0:
            raise MemoryError("contouring")
        self._messages()
        return self._taken()

    def drain(self) -> BlockBatch:
        """The block held is not rounded at its end."""
        if lib.nc_contour_drain(self._state) < 0:
            raise MemoryError("contouring")
        return self._taken()

    def resync(self, position: FloatArray) -> None:
        lib.nc_contour_resync(self._state, _full(position))

    @property
    def report(self) -> ContourReport:
        """Counts and the largest deviation."""
        out = ffi.new("nc_contour_stats *")
        lib.nc_contour_get_stats(self._state, out)
        return ContourReport(
            **{
                name: getattr(out, name)
                for name in ContourReport.__dataclass_fields__
            }
        )

    def _follow(self, rows: AnyArray) -> None:
        moving = np.flatnonzero(rows["type"] <= POLYNOMIAL)
        if len(moving):
            self.resync(rows["end"][moving[-1]])

    def _messages(self) -> None:
        """Each line that is too short is said once."""
        out = ffi.new("nc_contour_short[]", lib.NC_CONTOUR_SHORT)
        for i in range(lib.nc_contour_take_short(self._state, out)):
            key = (int(out[i].file), int(out[i].line))
            if key in self._short or len(self._short) == SHORT_MAX:
                continue
            self._short.add(key)
            text = f"block of {out[i].length:.6g} mm is too short to be rounded: its corners stay"
            self._warn(CncError(120216, text, self._place(*key)))

    def _taken(self) -> BlockBatch:
        rows = np.empty(lib.nc_contour_rows(self._state), NC_BLOCK)
        pool = np.empty(lib.nc_contour_coefficients(self._state))
        lib.nc_contour_take(
            self._state,
            row_pointer(rows),
            pool_pointer(pool),
        )
        return BlockBatch(rows, pool)


def _full(position: FloatArray) -> Any:
    full = ffi.new("double[]", lib.NC_AXES)
    full[0 : len(position)] = [float(v) for v in position]
    return full
