"""The loop of an LALR parser over lark's tables, for texts without errors.

Lark builds the tables and the lexers; its own loop is made for every kind of
parser and takes three times as long.  A text that this loop does not accept is
parsed by lark, which finds and tells the errors.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from lark import Lark, Token
from lark.parsers.lalr_analysis import Shift

_LINE_END = re.compile("\n")
_END = "$END"


class NotAcceptedError(Exception):
    """The text has an error."""


class QuickParser:
    """Parses with the tables of a ``Lark`` (LALR, contextual lexer)."""

    def __init__(self, lark: Lark) -> None:
        inner: Any = lark.parser
        parser = inner.parser.parser
        self._table = parser.parse_table
        self._keywords: Any = lark.options.postlex
        callbacks = parser.callbacks
        self._actions = {
            state: {
                name: argument
                if action is Shift
                else (
                    len(argument.expansion),
                    callbacks[argument],
                    argument.origin.name,
                )
                for name, (action, argument) in row.items()
            }
            for state, row in self._table.states.items()
        }
        self._patterns = _patterns(inner.lexer.lexer)

    def parse(self, text: str, start: str) -> Any:
        """The tree.  NotAcceptedError: the text has an error."""
        states = [self._table.start_states[start]]
        end_state = self._table.end_states[start]
        values: list[Any] = []
        actions = self._actions
        tokens = self._keywords.process(self._tokens(text, states))
        for token in tokens:
            kind = token.type
            self._reduce(states, values, kind, end_state)
            states.append(actions[states[-1]][kind])
            values.append(token)
        return self._reduce(states, values, _END, end_state)

    def _reduce(
        self, states: list[Any], values: list[Any], kind: str, end_state: Any
    ) -> Any:
        """All reductions until a token of this kind can be shifted."""
        actions = self._actions
        while True:
            action = actions[states[-1]].get(kind)
            if action is None:
                raise NotAcceptedError
            if type(action) is not tuple:
                return None
            size, callback, name = action
            if size:
                found = callback(values[-size:])
                del states[-size:], values[-size:]
            else:
                found = callback([])
            state = actions[states[-1]][name]
            if kind is _END and state == end_state:
                return found
            states.append(state)
            values.append(found)

    def _tokens(self, text: str, states: list[Any]) -> Iterator[Token]:
        """Tokens as the parser's state at that moment knows them."""
        patterns, make = self._patterns, str.__new__
        line_ends = [match.start() for match in _LINE_END.finditer(text)]
        line_ends.append(len(text) + 1)
        at, line, begin, length = 0, 0, -1, len(text.rstrip())
        while at < length:
            match = patterns[states[-1]](text, at)
            if match is None:
                raise NotAcceptedError
            kind = match.lastgroup
            start, at = match.span(kind)
            while line_ends[line] < start:
                begin = line_ends[line]
                line += 1
            value = text[start:at]
            token: Any = make(Token, value)
            token.type, token.value = kind, value
            token.line, token.column = line + 1, start - begin
            token.start_pos, token.end_pos = start, at
            yield token


def quick_parser(lark: Lark) -> QuickParser | None:
    """None: this version of lark is built otherwise inside, and parses itself."""
    try:
        return QuickParser(lark)
    except (AttributeError, TypeError, ValueError):
        return None


def _patterns(contextual: Any) -> dict[Any, Any]:
    """One function for every state: the next token behind blanks."""
    found, made = {}, {}
    for state, lexer in contextual.lexers.items():
        scanner = lexer.scanner
        (pattern,) = scanner._mres
        if id(pattern) not in made:
            text = rf"\s*(?:{pattern.pattern})"
            made[id(pattern)] = re.compile(text, pattern.flags).match
        found[state] = made[id(pattern)]
    return found
