"""Real-time loops: ``#RT WHILE [[MODULO]]`` .. ``#RT ENDWHILE``.

The interpolator drives the loop while V.RTG.LOOP.ENABLED is TRUE, and leaves it
out where that is FALSE. The PLC sets it by ``bahn_mc_control.rt_loop_enable``;
without the PLC's unit the program does, by writing the variable, which waits
until all earlier blocks are executed and the value is in force.

Only motion blocks, #SPLINE and look-ahead markers may stand inside. The loop
has to end where it begins, and loops do not nest (look-ahead specification,
section 8; public page "Permissible NC commands within a real-time loop").
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cnc_core.blocks import (
    EVENT,
    EVENT_RT_COUNT,
    EVENT_RT_LOOP,
    FLUSH,
    HAS_VALUE,
    MARKER,
    MARKER_CLEAR,
    MODULO,
    POLYNOMIAL,
    RT_LOOP_BEGIN,
    RT_LOOP_END,
    SPLINE,
    STANDSTILL,
    WAIT,
)
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.port import Wait
from cnc_core.units import FloatArray

from .splines import Splines

CLOSED_WITHIN_MM = 1e-6


@dataclass(frozen=True)
class _Open:
    position: FloatArray
    place: Place


class RealTimeLoop:
    """The loop that is open at the present place of the program, if there is one.

    ``place``: where in the file an offset of the present block stands.
    """

    def __init__(
        self,
        modal: Modal,
        place: Callable[[int], Place],
        splines: Splines,
    ) -> None:
        self._modal, self._place, self._splines = modal, place, splines
        self._open: _Open | None = None
        #: V.RTG.LOOP that the present block has written: value by event
        self.written: dict[int, float] = {}
        self.last = False  # ENABLED that was written last

    @property
    def is_open(self) -> bool:
        """The present block stands inside a loop."""
        return self._open is not None

    def enable(self, enabled: bool) -> None:
        """``V.RTG.LOOP.ENABLED = ..``"""
        self.last = enabled
        self.written[EVENT_RT_LOOP] = float(enabled)

    def count(self, passes: float) -> None:
        """``V.RTG.LOOP.COUNT = ..``"""
        self.written[EVENT_RT_COUNT] = passes

    def switched(self) -> list[Row | Wait]:
        """Rows of what has been written."""
        written, self.written = self.written, {}
        n = self._modal.n
        return [
            *(
                self._modal.row(
                    EVENT, n, code=code, value=value, flags=HAS_VALUE
                )
                for code, value in written.items()
            ),
            self._modal.row(FLUSH, n, flags=STANDSTILL | WAIT),
            Wait.DRAINED,
        ]

    def begin(self, modulo: bool, offset: int) -> Row:
        """``#RT WHILE``."""
        self._not_compensated(offset)
        self._no_spline(22128, offset)
        if self._open is not None:
            raise fail(
                22181,
                f"#RT WHILE inside the real-time loop of line {self._open.place.line}",
                offset,
            )
        self._open = _Open(self._modal.position, self._place(offset))
        return self._modal.row(
            RT_LOOP_BEGIN, self._modal.n, flags=MODULO if modulo else 0
        )

    def end(self, offset: int) -> Row:
        """``#RT ENDWHILE``."""
        opened, self._open = self._open, None
        self._not_compensated(offset)
        self._no_spline(22129, offset)
        if opened is None:
            raise fail(22181, ERRORS[22181], offset)
        away = float(np.abs(self._modal.position - opened.position).max())
        if away > CLOSED_WITHIN_MM:
            text = (
                f"the real-time loop of line {opened.place.line} "
                f"ends {away:g} mm from where it begins"
            )
            raise fail(50991, text, offset)
        return self._modal.row(RT_LOOP_END, self._modal.n)

    def check(self, items: Sequence[Row | Wait], ended: bool) -> None:
        """Refuse rows that may not stand inside a loop.

        ``items``: of the block just read.
        """
        opened = self._open
        if opened is None:
            return
        if ended:
            self._open = None
        if ended or any(not _allowed(item) for item in items):
            raise CncError(
                22073, f"{ERRORS[22073]} (loop of line {opened.place.line})"
            )

    def at_end(self) -> CncError | None:
        """The error of a program that ends inside a loop."""
        if self._open is None:
            return None
        opened, self._open = self._open, None
        return CncError(
            22181,
            "the real-time loop is not closed by #RT ENDWHILE",
            opened.place,
        )

    def _no_spline(self, code: int, offset: int) -> None:
        if self._splines.active:
            raise fail(code, ERRORS[code], offset)

    def _not_compensated(self, offset: int) -> None:
        if self._modal.compensated:
            raise fail(22158, ERRORS[22158], offset)


def _allowed(item: Row | Wait) -> bool:
    if isinstance(item, Wait):
        return False
    kind = int(item["type"][0])
    return (
        kind <= POLYNOMIAL
        or kind in (RT_LOOP_BEGIN, SPLINE)
        or (kind == MARKER and int(item["code"][0]) != MARKER_CLEAR)
    )
