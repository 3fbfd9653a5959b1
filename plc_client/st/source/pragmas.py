"""Conditional compilation: ``{IF defined (X)}``, ``{ELSIF}``, ``{ELSE}``, ``{END_IF}``."""

from __future__ import annotations

import re

from ..errors import TEXT, Position, StopHere

_CONDITION = re.compile(r"(IF|ELSIF)\b(.*)", re.I | re.S)
_DEFINE = re.compile(r"(define|undefine)\s+(\w+)", re.I)
_TOKEN = re.compile(
    r"\s*(\(|\)|NOT\b|AND\b|OR\b"
    r"|(?:defined|hasattribute|hastype|hasvalue|hasconstantvalue|project_defined)"
    r"\s*\([^()]*\))",
    re.I,
)


class Conditions:
    """The stack of open ``{IF}``: whether text counts."""

    def __init__(self, defines: set[str], declared: frozenset[str]) -> None:
        self._defines, self._declared = defines, declared
        self._stack: list[tuple[bool, bool]] = []
        self.active = True

    @property
    def depth(self) -> int:
        """How many are open."""
        return len(self._stack)

    def take(self, text: str, place: Position) -> bool:
        """Whether the pragma belongs to conditional compilation."""
        word = text.split("(", maxsplit=1)[0].strip().upper()
        match = _CONDITION.match(text)
        if match:
            self._condition(match[1].upper(), match[2], place)
        elif word == "ELSE":
            self._other(True, place)
        elif word == "END_IF":
            self._pop(place)
        elif defined := _DEFINE.match(text):
            self._define(defined[1].lower(), defined[2].upper())
        else:
            return False
        self.active = all(now for now, _ in self._stack)
        return True

    def _condition(self, word: str, text: str, place: Position) -> None:
        value = _Expression(text, place, self._atom).value()
        if word == "IF":
            self._stack.append((value, value))
        else:
            self._other(value, place)

    def _other(self, value: bool, place: Position) -> None:
        self._check(place)
        _, before = self._stack.pop()
        self._stack.append((value and not before, value or before))

    def _pop(self, place: Position) -> None:
        self._check(place)
        self._stack.pop()

    def _check(self, place: Position) -> None:
        if not self._stack:
            raise StopHere(TEXT, "there is no {IF} before it", place)

    def _define(self, word: str, name: str) -> None:
        if not self.active:
            return
        if word == "define":
            self._defines.add(name)
        else:
            self._defines.discard(name)

    def _atom(self, text: str) -> bool:
        function, _, inside = text.partition("(")
        kind, colon, name = inside.rstrip(")").strip().rpartition(":")
        if "defined" not in function.lower():
            return False
        name = name.strip().upper()
        if colon and kind.strip().lower() != "variable":
            return name in self._declared
        return name in self._defines


class _Expression:
    """``NOT defined (A) AND (defined (B) OR defined (C))``."""

    def __init__(self, text: str, place: Position, atom: object) -> None:
        self._place, self._atom = place, atom
        self._tokens: list[str] = []
        at = 0
        while at < len(text.rstrip()):
            match = _TOKEN.match(text, at)
            if match is None:
                raise self._wrong(text.strip())
            self._tokens.append(match[1])
            at = match.end()

    def _wrong(self, text: str) -> StopHere:
        return StopHere(
            TEXT, f"condition {text!r}: use defined (NAME)", self._place
        )

    def value(self) -> bool:
        value = self._or()
        if self._tokens:
            raise self._wrong(self._tokens[0])
        return value

    def _or(self) -> bool:
        value = self._and()
        while self._next_is("OR"):
            value = self._and() or value
        return value

    def _and(self) -> bool:
        value = self._not()
        while self._next_is("AND"):
            value = self._not() and value
        return value

    def _not(self) -> bool:
        if self._next_is("NOT"):
            return not self._not()
        if self._next_is("("):
            value = self._or()
            if not self._next_is(")"):
                raise self._wrong("( is not closed")
            return value
        if not self._tokens:
            raise self._wrong("the end")
        return bool(self._atom(self._tokens.pop(0)))  # type: ignore[operator]

    def _next_is(self, token: str) -> bool:
        if self._tokens and self._tokens[0].upper() == token:
            self._tokens.pop(0)
            return True
        return False
