"""Common parts of the commands of coordinates: brackets of values, and their
row.
"""

from __future__ import annotations

from collections.abc import Callable

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import fail

from .base import CommandBase, Items, Run

COMPENSATED, NOT_IN_MCS = 20802, 910107
Commands = tuple[tuple[tuple[str, ...], Callable[[], Run]], ...]


class CoordinateBase(CommandBase):
    """One command that changes the coordinates being compiled."""

    def _changing(
        self,
        name: str,
        change: Callable[[], None],
        *,
        in_ptp: int = 0,
        in_mcs: bool = False,
    ) -> Run:
        """A change of coordinates: not during compensation, nor where #PTP
        (error ``in_ptp``) or #MCS forbid it.
        """
        spaces, start = self._state.spaces, self._start

        def run() -> Items:
            self.not_compensated(name, COMPENSATED)
            if in_ptp and spaces.ptp:
                raise fail(in_ptp, ERRORS[in_ptp], start)
            if spaces.mcs and not in_mcs:
                raise fail(NOT_IN_MCS, f"{name}: {ERRORS[NOT_IN_MCS]}", start)
            change()
            return list(spaces.rows(self._modal.n))

        return run

    def not_compensated(self, name: str, number: int) -> None:
        if self._state.channel.compensation.choice.active:
            raise fail(
                number,
                ERRORS[number]
                if number == 21525
                else f"{name}: {ERRORS[number]}",
                self._start,
            )

    def _bracket(self) -> list[Formula | None]:
        """``[a, , b]``: values, None for an empty field."""
        stream, found = self._stream, list[Formula | None]()
        opened = self._formulas.open()
        while True:
            empty = stream.is_op(",") or stream.is_op("]")
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            found.append(None if empty else self._formulas.expression())
            if not stream.accept(","):
                break
        self._formulas.close(opened)
        return found

    def _bracket_expected(self, name: str) -> list[Formula | None]:
        if not self._stream.is_op("["):
            raise fail(900010, f"{name}: values are expected", self._start)
        return self._bracket()
