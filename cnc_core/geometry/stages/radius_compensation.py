"""Tool radius compensation as a streaming stage: G40, G41, G42 with corners
G25, G26.

The geometry is in C (``c_ext/stages/compensation/offset.c``).  The stage takes
``COMPENSATION`` rows out of the stream and holds back one motion in the plane,
with the rows behind it, until the next one is known: memory is bounded by
``NC_OFFSET_HELD`` rows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cnc_core._engine import ffi, lib
from cnc_core.blocks import (
    COMPENSATION,
    NC_AXES,
    NC_BLOCK,
    POLYNOMIAL,
    BlockBatch,
)
from cnc_core.blocks.to_c import row_pointer
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.units import AnyArray, FloatArray

from .stage import RefusedRow

Rows = AnyArray
Report = Callable[[CncError], None]


def _ignore(_: CncError) -> None:
    pass


class RadiusCompensation:
    """Rows of the programmed contour in, rows of the tool centre out.

    ``start``: (axes,) position before the first row.  ``main``: channel index
    of X, Y, Z, -1 where absent.  ``place``: place of (file index, line).
    ``warn`` gets warnings.  ``collect`` gets the errors; the stage then goes on
    behind them with compensation off.  Without it an error ends the stream.
    """

    def __init__(
        self,
        start: FloatArray,
        main: tuple[int, int, int],
        place: Callable[[int, int], Place],
        warn: Report = _ignore,
        collect: Report | None = None,
    ) -> None:
        self._place, self._warn, self._collect = place, warn, collect
        self._axes = len(start)
        self._state = ffi.new("nc_offset *")
        lib.nc_offset_init(self._state)
        self._state.axes = self._axes
        self._state.main_axis = list(main)
        self.resync(start)

    @property
    def held(self) -> int:
        """Rows held back."""
        return int(self._state.held) + int(self._state.has_prev)

    @property
    def idle(self) -> bool:
        return bool(lib.nc_offset_idle(self._state)) and not self.held

    def push(self, batch: BlockBatch) -> BlockBatch:
        rows = batch.rows
        if (
            lib.nc_offset_idle(self._state)
            and not (rows["type"] == COMPENSATION).any()
        ):
            self._follow(rows)
            return batch
        return BlockBatch(
            self._compensate(np.ascontiguousarray(rows), batch.pool), batch.pool
        )

    def drain(self) -> BlockBatch:
        """What is held back; it ends beside its programmed end.  Nothing in the
        plane may follow under compensation.
        """
        out = np.empty(self.held + lib.NC_OFFSET_GROWTH, NC_BLOCK)
        made = ffi.new("size_t *")
        error = lib.nc_offset_drain(
            self._state, row_pointer(out, writable=True), len(out), made
        )
        done = out[: made[0]]
        if error:
            self._refuse(error, [done], np.empty(0))
        return BlockBatch(done)

    def resync(self, position: FloatArray) -> None:
        full = ffi.new("double[]", NC_AXES)
        full[0 : self._axes] = [float(v) for v in position[: self._axes]]
        lib.nc_offset_resync(self._state, full)

    def _follow(self, rows: Rows) -> None:
        """Compensation is off: only the position changes."""
        moving = np.flatnonzero(rows["type"] <= POLYNOMIAL)
        if len(moving):
            self.resync(rows["end"][moving[-1]])

    def _compensate(self, rows: Rows, pool: FloatArray) -> Rows:
        parts: list[Rows] = []
        taken, made = ffi.new("size_t *"), ffi.new("size_t *")
        while len(rows):
            out = np.empty(
                lib.NC_OFFSET_GROWTH * len(rows)
                + self.held
                + lib.NC_OFFSET_GROWTH,
                NC_BLOCK,
            )
            error = lib.nc_offset_push(
                self._state,
                row_pointer(rows),
                len(rows),
                taken,
                row_pointer(out, writable=True),
                len(out),
                made,
            )
            parts.append(out[: made[0]].copy())
            rows = rows[taken[0] :]
            if error:
                self._refuse(error, parts, pool)
            elif self._state.warning:
                self._warn(self._error(self._state.warning))
        return np.concatenate(parts) if parts else np.empty(0, NC_BLOCK)

    def _error(self, number: int) -> CncError:
        row, text = self._state.place, ERRORS[number]
        if number == lib.NC_ERROR_INNER_RADIUS:
            text += f": contour {self._state.detail[0]:g} mm, tool {self._state.detail[1]:g} mm"
        return CncError(
            number,
            text,
            self._place(
                int(row.file),
                int(row.line),
            ),
        )

    def _refuse(self, number: int, parts: list[Rows], pool: FloatArray) -> None:
        """Report and go on without compensation, or stop the stream behind the
        rows in ``parts``.
        """
        error = self._error(number)
        count = int(self._state.place.count)
        lib.nc_offset_forget(self._state)
        if self._collect is None:
            raise RefusedRow(
                error, BlockBatch(np.concatenate(parts), pool), count
            )
        self._collect(error)
