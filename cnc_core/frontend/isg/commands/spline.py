"""Commands of splines: #SPLINE, #AKIMA.

The geometry is ``cnc_core.geometry.stages.spline``.
"""

from __future__ import annotations

from cnc_core.frontend.base.lexer import fail

from ..state.splines import ENDS, KINDS
from .base import CommandBase, Items, Run

OLD_ENDS = {1: "AUTO", 2: "TANGENTIAL", 3: "USER"}  # #SET ASPLINE MODE


class SplineCommands(CommandBase):
    """#SPLINE TYPE, ON, OFF; #AKIMA TRANS, STARTVECTOR, ENDVECTOR, and the old
    names.
    """

    def _spline_type(self) -> Run:
        word = self._stream.accept_name(*KINDS)
        if word is None:
            raise fail(
                900010,
                f"#SPLINE TYPE: expected AKIMA or BSPLINE, found {self._stream.describe()}",
                self._start,
            )
        kind = word.text.upper()

        def run() -> Items:
            splines = self._state.channel.splines
            if splines.active and kind != splines.kind:
                raise fail(
                    900010,
                    "#SPLINE TYPE: the type does not change while a spline is active",
                    self._start,
                )
            splines.kind = kind
            return []

        return run

    def _spline_on(self) -> Run:
        return lambda: [
            *self._state.channel.switch_spline(True, self._modal.n, self._start)
        ]

    def _spline_off(self) -> Run:
        return lambda: [
            *self._state.channel.switch_spline(
                False, self._modal.n, self._start
            )
        ]

    def _akima_trans(self) -> Run:
        """``[START=USER END=AUTO]``."""
        stream, chosen = self._stream, {}
        opened = self._formulas.open()
        while not stream.is_op("]"):
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            if stream.accept(","):
                continue
            key = self._key({"START": True, "END": True})
            stream.accept("=")
            word = stream.accept_name(*ENDS)
            if word is None:
                raise fail(
                    900010,
                    f"#AKIMA TRANS: {key} is {', '.join(ENDS)}",
                    stream.current.offset,
                )
            chosen[key] = word.text.upper()
        self._formulas.close(opened)

        def run() -> Items:
            ends = self._state.channel.splines.ends
            for place, key in enumerate(("START", "END")):
                ends[place] = chosen.get(key, ends[place])
            return []

        return run

    def _old_trans(self) -> Run:
        """``#SET ASPLINE MODE [2, 2]``: 1 AUTO, 2 TANGENTIAL, 3 USER."""
        opened = self._formulas.open()
        start = self._formulas.number("#SET ASPLINE MODE", opened)
        self._stream.expect(",", 900010)
        end = self._formulas.number("#SET ASPLINE MODE", opened)
        self._formulas.close(opened)

        def run() -> Items:
            values = [start(), end()]
            if any(value not in OLD_ENDS for value in values):
                raise fail(
                    900012,
                    "#SET ASPLINE MODE: 1, 2 and 3 are known",
                    self._start,
                )
            self._state.channel.splines.ends[:] = [
                OLD_ENDS[int(value)] for value in values
            ]
            return []

        return run

    def _spline_vector(self, place: int) -> Run:
        """``#AKIMA STARTVECTOR X1 Y1 Z0``: the direction at one end."""
        words = self._axis_words()
        if not words or any(value is None for value in words.values()):
            raise fail(
                900010,
                "#AKIMA: axis words with values are expected",
                self._start,
            )

        def run() -> Items:
            given = {
                axis: value()
                for axis, value in words.items()
                if value is not None
            }
            if not any(given.values()):
                raise fail(
                    900012, "#AKIMA: a vector without length", self._start
                )
            self._state.channel.splines.vectors[place] = given
            return []

        return run
