"""#CHANNEL SET [ESA_TIME0=..]: times of the predicted path speed.

The prediction is FCT_CALC_STATE_AT_T.
"""

from __future__ import annotations

import re

from cnc_core.blocks import ESA_TIMES, EVENT, EVENT_ESA_TIME, HAS_VALUE
from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Row

from .base import CommandBase, Items, Run

OURS = re.compile(r"\[\s*ESA_TIME", re.I)


class PredictionCommands(CommandBase):
    """Compiled like all other commands."""

    def _channel_set(self) -> Run:
        """``[ESA_TIME0=0.1 ESA_TIME1=0.5]``, s; other keys are stored."""
        stream, start = self._stream, self._start
        if not OURS.match(stream.text, stream.current.offset):
            self._rest()

            def stored() -> Items:
                self._state.channel.stored_without_effect("#CHANNEL SET", start)
                return []

            return stored
        found: dict[int, Formula] = {}
        opened = self._formulas.open()
        while not stream.is_op("]"):
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            if stream.accept(","):
                continue
            index = self._esa_index()
            found[index] = self._formulas.expression()
        self._formulas.close(opened)

        def run() -> Items:
            return [
                self._esa_row(index, value()) for index, value in found.items()
            ]

        return run

    def _esa_index(self) -> int:
        """``ESA_TIME1 =``"""
        stream, token = self._stream, self._stream.current
        if not stream.accept_name("ESA_TIME"):
            raise fail(
                900010,
                f"#CHANNEL SET: expected ESA_TIME, found {stream.describe()}",
                token.offset,
            )
        number = stream.next().text
        if number not in map(str, range(ESA_TIMES)):
            raise fail(
                900012,
                f"ESA_TIME{number}: 0 to {ESA_TIMES - 1} are told",
                token.offset,
            )
        stream.expect("=", 900010)
        return int(number)

    def _esa_row(self, index: int, value: float | str) -> Row:
        if isinstance(value, str) or not 0.0 <= value <= 1e6:
            raise fail(
                900012,
                f"ESA_TIME{index}: {value} out of range 0..1e6 s",
                self._start,
            )
        return self._modal.row(
            EVENT,
            self._modal.n,
            code=EVENT_ESA_TIME + index,
            value=value,
            flags=HAS_VALUE,
        )
