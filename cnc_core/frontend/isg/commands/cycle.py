"""# commands about cycles: #PATTERN, #AT, #DISABLE MODAL CYCLE."""

from __future__ import annotations

from collections.abc import Callable

from cnc_core.frontend.base.formula import Constant, Formula, number_of
from cnc_core.frontend.base.lexer import fail

from ..state.patterns import ID_MAX, SYNTAX
from .base import CommandBase, Items, Run


class CycleCommands(CommandBase):
    """Compiled like all other commands."""

    def _pattern(self) -> Run:
        """``BEGIN [ID=1]``, ``END``, ``DELETE [ID=1]``, ``DELETE ALL``; the
        ``=`` may be missing.
        """
        stream, start, patterns = (
            self._stream,
            self._start,
            self._state.patterns,
        )
        word = stream.accept_name("BEGIN", "END", "DELETE")
        if not word:
            raise fail(
                SYNTAX,
                f"PAT_SYNTAX: expected BEGIN, END or DELETE, found {stream.describe()}",
                start,
            )
        kind = word.text.upper()
        identity: Callable[[], int] | None = None
        if kind != "END" and not (
            kind == "DELETE" and stream.accept_name("ALL")
        ):
            identity = self._pattern_id()
        if not stream.at_end:
            raise fail(
                SYNTAX,
                f"PAT_SYNTAX: unexpected {stream.describe()}",
                stream.current.offset,
            )

        def run() -> Items:
            if kind == "BEGIN":
                assert identity is not None
                patterns.begin(identity(), self._state.place(start), start)
            elif kind == "END":
                patterns.end(start)
            else:
                patterns.delete(None if identity is None else identity(), start)
            return []

        return run

    def _pattern_id(self) -> Callable[[], int]:
        stream, formulas = self._stream, self._formulas
        if not stream.is_op("["):
            raise fail(
                SYNTAX, "PAT_SYNTAX: #PATTERN without [ID=..]", self._start
            )
        opened = formulas.open()
        if not stream.accept_name("ID"):
            raise fail(
                SYNTAX,
                f"PAT_SYNTAX: expected ID, found {stream.describe()}",
                stream.current.offset,
            )
        stream.accept("=")
        if not formulas.starts_here():
            raise fail(
                SYNTAX, "PAT_SYNTAX: ID without a value", stream.current.offset
            )
        value = formulas.expression()
        formulas.close(opened)
        return self._whole(value, "ID", 0, ID_MAX)

    def _at(self) -> Run:
        """``[x, y, z, a, b, c]``; an empty field is 0."""
        stream, start = self._stream, self._start
        if not stream.is_op("["):
            raise fail(SYNTAX, "PAT_SYNTAX: #AT without [x, y, z]", start)
        values = [number_of(value, "#AT", start) for value in self._fields()]
        if not stream.at_end:
            raise fail(
                SYNTAX,
                f"PAT_SYNTAX: unexpected {stream.describe()}",
                stream.current.offset,
            )

        def run() -> Items:
            self._state.patterns.at(
                [value() for value in values], self._modal.unit_mm, start
            )
            return []

        return run

    def _fields(self) -> list[Formula]:
        stream, formulas, found = self._stream, self._formulas, []
        opened = formulas.open()
        while True:
            found.append(
                Constant(0.0)
                if stream.is_op(",", "]")
                else formulas.expression()
            )
            if not stream.accept(","):
                break
        formulas.close(opened)
        return found

    def _disable_modal(self) -> Run:
        def run() -> Items:
            self._state.modal_cycle.deselect()
            return []

        return run
