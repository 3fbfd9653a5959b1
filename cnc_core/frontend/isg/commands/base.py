"""Common parts of all # commands: brackets, keys, axis words."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from cnc_core.frontend.base.expression import round_half_away
from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.base.scanner import Row
from cnc_core.frontend.port import Wait

from ..language.formulas import Formulas
from ..state.state import ProgramState

Items = list[Row | Wait]
Run = Callable[[], Items]


class CommandBase:
    """One # command being compiled; the stream stands behind ``#``.

    ``_drain``: everything before it has to be executed first.
    ``_behind``: the action behind its block.
    ``_last``: it comes behind the words of its block.
    """

    def __init__(
        self,
        stream: TokenStream,
        formulas: Formulas,
        state: ProgramState,
        axes: dict[str, int],
    ) -> None:
        self._stream, self._formulas, self._state, self._axes = (
            stream,
            formulas,
            state,
            axes,
        )
        self._modal = state.modal
        self._start = stream.current.offset
        self._drain = self._last = False
        self._behind: Callable[[], None] | None = None

    def _words(self, count: int) -> list[str]:
        """The next words in capitals, up to ``count``; the stream stays."""
        stream, place = self._stream, self._stream.place
        found: list[str] = []
        while len(found) < count and stream.current.kind is Kind.NAME:
            found.append(stream.next().text.upper())
        stream.go_to(place)
        return found

    def _rest(self) -> None:
        """Keys and brackets of a command that is not executed: checked for
        brackets only.
        """
        stream, depth, opened = self._stream, 0, 0
        while not stream.at_end:
            token = stream.next()
            if token.text == "[":
                opened, depth = token.offset if not depth else opened, depth + 1
            depth -= token.text == "]"
            if depth < 0:
                raise fail(900010, "] without [", token.offset)
        if depth:
            raise fail(900013, "bracket is not closed", opened)

    def _keys(
        self, known: Mapping[str, bool | None]
    ) -> dict[str, Formula | None]:
        """``[KEY KEY=value KEY value]``.

        ``known``: whether a key has a value.  None: it may have one.
        """
        stream, found = self._stream, {}
        opened = self._formulas.open()
        while not stream.is_op("]"):
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            if stream.accept(","):
                continue
            key, offset = self._key(known), self._start
            if key in found:
                raise fail(900005, f"{key} twice in one command", offset)
            has_value = stream.is_op("=") if known[key] is None else known[key]
            found[key] = self._key_value(key) if has_value else None
        self._formulas.close(opened)
        return found

    def _key(self, known: Mapping[str, bool | None]) -> str:
        stream, token = self._stream, self._stream.current
        names = sorted(known, key=len, reverse=True)
        rest = stream.text[token.offset :].upper()
        name = next((k for k in names if rest.startswith(k)), None)
        if name is None or token.kind is not Kind.NAME:
            raise fail(
                900010,
                f"expected {', '.join(known)}, found {stream.describe()}",
                token.offset,
            )
        stream.skip_to(token.offset + len(name))
        return name

    def _key_value(self, key: str) -> Formula:
        stream, offset = self._stream, self._stream.current.offset
        if not stream.accept("=") and len(key) > 1:  # axis words need none
            self._state.warn(
                907040, f"{key} without = before its value", offset
            )
        if not self._formulas.starts_here():
            raise fail(900004, f"{key} without a value", offset)
        return self._formulas.expression()

    def _whole(
        self,
        value: Formula,
        name: str,
        lowest: int,
        highest: int,
        code: int = 900012,
    ) -> Callable[[], int]:
        offset = self._start

        def whole() -> int:
            found = value()
            if (
                isinstance(found, str)
                or not lowest - 0.5 < found < highest + 0.5
            ):
                raise fail(
                    code,
                    f"{name}: a number {lowest}..{highest} is expected, not {found}",
                    offset,
                )
            return round_half_away(found)

        return whole

    def _axis_words(self) -> dict[int, Callable[[], float] | None]:
        """Axis names with or without values, to the end of the block."""
        stream, found = self._stream, {}
        while not stream.at_end:
            token = stream.current
            if stream.accept(","):
                continue
            name = self._axis_name()
            if name is None:
                break
            has_value = stream.is_op("=") or self._formulas.starts_here()
            stream.accept("=")
            axis = self._axes[name]
            if axis in found:
                raise fail(900005, f"{name} twice in one block", token.offset)
            found[axis] = (
                self._formulas.number(name, token.offset) if has_value else None
            )
        return found

    def _axis_name(self) -> str | None:
        stream, token = self._stream, self._stream.current
        if token.kind is not Kind.NAME:
            return None
        rest = stream.text[token.offset :].upper()
        for name in self._axes:
            if (
                len(name) > 1
                and rest.startswith(name)
                and rest[len(name) :].lstrip().startswith("=")
            ):
                stream.skip_to(token.offset + len(name))
                return name
        letter = token.text[0].upper()
        if letter in self._axes:
            stream.take_letters(1)
            return letter
        return None

    def _not_compensated(self, name: str) -> None:
        if self._modal.compensated:
            raise fail(
                20651,
                f"{name} during tool radius compensation: deselect it with G40",
                self._start,
            )
