"""Real-time loops: ``#RT WHILE [[MODULO]]`` .. ``#RT ENDWHILE``.

The interpolator repeats the loop as long as V.RTG.LOOP.ENABLED is TRUE at its end (the PLC sets it by
``bahn_mc_control.rt_loop_enable``); there is always one pass.  Only motion blocks and look-ahead markers may stand
inside, the loop has to end where it begins, loops do not nest (look-ahead specification, section 8).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cnc_core.blocks import MARKER, MARKER_CLEAR, MODULO, POLYNOMIAL, RT_LOOP_BEGIN, RT_LOOP_END
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.frontend.base.lexer import TokenStream, fail
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.port import Wait

CLOSED_WITHIN_MM = 1e-6
BLOCKS_MAX = 8000  # the interpolator holds the whole loop


@dataclass(frozen=True)
class _Open:
    position: npt.NDArray[np.float64]
    place: Place
    line: int


class RealTimeLoop:
    """The loop that is open at the present place of the program, if there is one."""

    def __init__(self, modal: Modal) -> None:
        self._modal = modal
        self._open: _Open | None = None

    def command(self, stream: TokenStream, n: int, place: Place) -> list[Row | Wait]:
        """The row of ``RT WHILE`` or ``RT ENDWHILE``; the stream stands behind ``#`` at ``RT``. CncError if wrong."""
        offset = stream.next().offset
        if self._modal.compensated:
            raise fail(22158, ERRORS[22158], offset)
        if stream.accept_name("WHILE"):
            row = self._begin(stream, n, offset, place)
        elif stream.accept_name("ENDWHILE"):
            row = self._end(n, offset)
        else:
            raise fail(900003, "#RT: only WHILE and ENDWHILE are supported", offset)
        if not stream.at_end:
            raise fail(900010, f"unexpected {stream.current.text!r} behind the command", stream.current.offset)
        return [row]

    def _begin(self, stream: TokenStream, n: int, offset: int, place: Place) -> Row:
        if self._open is not None:
            raise fail(22181, f"#RT WHILE inside the real-time loop of line {self._open.place.line}", offset)
        bracket = stream.accept("[")
        modulo = stream.accept_name("MODULO")
        if bracket:
            if not modulo:
                raise fail(900010, f"#RT WHILE: expected MODULO, found {stream.describe()}", stream.current.offset)
            stream.expect("]", 900010)
        self._open = _Open(self._modal.position, place, self._modal.line)
        return self._modal.row(RT_LOOP_BEGIN, n, flags=MODULO if modulo else 0)

    def _end(self, n: int, offset: int) -> Row:
        opened, self._open = self._open, None
        if opened is None:
            raise fail(22181, ERRORS[22181], offset)
        away = float(np.abs(self._modal.position - opened.position).max())
        if away > CLOSED_WITHIN_MM:
            text = f"the real-time loop of line {opened.place.line} ends {away:g} mm from where it begins"
            raise fail(50991, text, offset)
        if self._modal.line - opened.line > BLOCKS_MAX:
            raise fail(900021, f"{ERRORS[900021]}: more than {BLOCKS_MAX} lines", offset)
        return self._modal.row(RT_LOOP_END, n)

    def check(self, items: Sequence[Row | Wait], ended: bool) -> None:
        """Refuse what may not stand inside a loop; ``items`` are those of the block just read."""
        opened = self._open
        if opened is None:
            return
        if ended:
            self._open = None
        if ended or any(not _allowed(item) for item in items):
            raise CncError(22073, f"{ERRORS[22073]} (loop of line {opened.place.line})")

    def at_end(self) -> CncError | None:
        """The error of a program that ends inside a loop."""
        if self._open is None:
            return None
        opened, self._open = self._open, None
        return CncError(22181, "the real-time loop is not closed by #RT ENDWHILE", opened.place)


def _allowed(item: Row | Wait) -> bool:
    if isinstance(item, Wait):
        return False
    kind = int(item["type"][0])
    return kind <= POLYNOMIAL or kind == RT_LOOP_BEGIN or (kind == MARKER and int(item["code"][0]) != MARKER_CLEAR)
