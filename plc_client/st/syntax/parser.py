"""Parses one unit; after an error it goes on behind the next semicolon."""

from __future__ import annotations

import functools
from contextlib import suppress
from importlib import resources
from typing import Any

from lark import Lark, Token, UnexpectedInput
from lark.exceptions import UnexpectedCharacters, VisitError

from ..errors import SYNTAX, TEXT, Log, Origin, Position, StopHere
from ..source.units import Unit
from .build import Builder
from .keywords import KEYWORDS, Keywords
from .openers import Unclosed, unclosed
from .quick import NotAcceptedError, QuickParser, quick_parser

MAX_ERRORS = 10
"""Errors of one unit before the rest of it is left alone."""
_SPELLED = {
    "SEMI": ";",
    "COLON": ":",
    "COMMA": ",",
    "LPAR": "(",
    "RPAR": ")",
    "LSQB": "[",
    "RSQB": "]",
    "ASSIGN": ":=",
    "NAME": "a name",
    "INT": "a number",
    "DOT": ".",
    "RANGE": "..",
    "CARET": "^",
}
_HINTS = ("SEMI", "RPAR", "RSQB", "THEN", "DO", "OF", "TO", "COLON", "END_VAR")
_CLOSERS = frozenset(w for w in KEYWORDS if w.startswith("END_"))


@functools.cache
def _parser() -> tuple[Lark, Builder, Keywords, QuickParser | None]:
    grammar = resources.files(__package__).joinpath("grammar.lark").read_text()
    builder, keywords = Builder(), Keywords()
    lark = Lark(
        grammar,
        parser="lalr",
        lexer="contextual",
        transformer=builder,
        postlex=keywords,
        maybe_placeholders=False,
        start=["unit", "head", "body", "accessor"],
    )
    return lark, builder, keywords, quick_parser(lark)


def parse(unit: Unit, log: Log) -> Any:
    """The tree of a unit, or None; errors go to the log."""
    lark, builder, keywords, quick = _parser()
    keywords.text = unit.text
    builder.shift(unit.line, unit.column)
    if quick is not None:
        with suppress(NotAcceptedError, VisitError, StopHere):
            return quick.parse(unit.text, unit.kind)
    failed = _Recovery(unit, log, builder)
    try:
        return _run(lark, unit, failed)
    except _GiveUp:
        return None
    except UnexpectedInput as error:
        failed(error)
        return None
    except VisitError as error:
        if not isinstance(error.orig_exc, StopHere):
            raise
        log.error(unit.origin, error.orig_exc)
        return None
    except StopHere as stop:
        log.error(unit.origin, stop)
        return None


def _run(lark: Lark, unit: Unit, failed: _Recovery) -> Any:
    tree = lark.parse(unit.text, start=unit.kind, on_error=failed)
    return None if failed.count else tree


class _GiveUp(Exception):  # noqa: N818
    pass


class _Recovery:
    """Called at every syntax error; pops the parser's stack to where statements go on."""

    def __init__(self, unit: Unit, log: Log, builder: Builder) -> None:
        self._unit, self._log, self._builder = unit, log, builder
        self._origin: Origin = unit.origin
        self.count = 0

    def __call__(self, error: UnexpectedInput) -> bool:
        self.count += 1
        if self.count == 1 and self._tell_unclosed(error):
            raise _GiveUp
        self._log.error(self._origin, self._describe(error))
        interactive = getattr(error, "interactive_parser", None)
        if self.count >= MAX_ERRORS or interactive is None:
            raise _GiveUp
        if isinstance(error, UnexpectedCharacters):
            raise _GiveUp
        self._resume(interactive, error)
        return True

    def _tell_unclosed(self, error: UnexpectedInput) -> bool:
        """Name the keywords that are not closed, if one of them is why."""
        token = getattr(error, "token", None)
        if token is None:
            return False
        text, ended = self._unit.text, token.type == "$END"
        offset = len(text) if ended else token.start_pos
        found = unclosed(text, self._unit.kind == "unit")
        causes = [one for one in found if one.causes(text, offset)]
        if not causes:
            return False
        here = self._last_place() if ended else self._place(token)
        told: dict[Position, list[str]] = {}
        for one in found[found.index(causes[0]) :]:
            own = one.typo or one not in causes
            at_end = one.found == len(text)
            place = self._last_place() if at_end else self._at(one.found)
            told.setdefault(place if own else here, []).append(self._why(one))
        for pos, texts in told.items():
            stop = StopHere(SYNTAX, "; ".join(texts), pos)
            self._log.error(self._origin, stop)
        return True

    def _why(self, one: Unclosed) -> str:
        missing = f"{one.closer} is missing"
        if one.typo:
            missing = f"{one.closer} is expected instead of {one.typo}"
        line = self._at(one.at)[0]
        return f"{missing}: {one.word} in line {line} is not closed"

    def _at(self, offset: int) -> Position:
        """Line and column of an offset of the unit's text."""
        text, unit = self._unit.text, self._unit
        line = unit.line + text.count("\n", 0, offset)
        column = offset - text.rfind("\n", 0, offset)
        return line, column + (unit.column - 1 if line == unit.line else 0)

    def _resume(self, interactive: Any, error: Any) -> None:
        tokens = interactive.lexer_thread.lex(interactive.parser_state)
        token = error.token
        while token.type != "SEMI":
            if token.type in ("$END", "END_VAR") or token.type in _CLOSERS:
                raise _GiveUp
            try:
                token = next(tokens)
            except (StopIteration, UnexpectedInput):
                raise _GiveUp from None
        self._unwind(interactive.parser_state)

    def _unwind(self, state: Any) -> None:
        """Back to a state in which a statement or declaration may begin."""
        table = state.parse_conf.parse_table.states
        while state.state_stack:
            accepted = table[state.state_stack[-1]]
            begins = "SEMI" in accepted and "WHILE" in accepted
            if begins or ("END_VAR" in accepted and "NAME" in accepted):
                return
            state.state_stack.pop()
            if state.value_stack:
                state.value_stack.pop()
        raise _GiveUp

    def _describe(self, error: UnexpectedInput) -> StopHere:
        if isinstance(error, UnexpectedCharacters):
            return self._unknown_character(error)
        token: Token = error.token  # type: ignore[attr-defined]
        accepts: set[str] = set(getattr(error, "accepts", None) or ())
        accepts = accepts or set(getattr(error, "expected", None) or ())
        if token.type == "$END":
            text, pos = "the text ends too early", self._last_place()
        else:
            text, pos = f"{token.value!r} is unexpected", self._place(token)
        return StopHere(SYNTAX, text + _expected(accepts), pos)

    def _unknown_character(self, error: Any) -> StopHere:
        token = Token("NAME", error.char, 0, error.line, error.column)
        text = f"the character {error.char!r} does not belong here"
        return StopHere(TEXT, text, self._place(token))

    def _place(self, token: Token) -> Position:
        return self._builder.place(token)

    def _last_place(self) -> Position:
        return self._at(max(len(self._unit.text.rstrip()) - 1, 0))


def _expected(accepts: set[str]) -> str:
    """What to do: the few tokens worth naming."""
    wanted = [name for name in _HINTS if name in accepts]
    if not wanted and len(accepts) > 4:
        return ""
    names = wanted[:2] or sorted(accepts)[:3]
    spelled = [_SPELLED.get(n, n) for n in names]
    return f"; {' or '.join(spelled)} is expected" if spelled else ""
