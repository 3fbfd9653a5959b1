"""Names become keywords where they stand as such; the case of letters does not matter."""

from __future__ import annotations

import re
from collections.abc import Iterator

from lark import Token

_WORDS = """
PROGRAM END_PROGRAM FUNCTION END_FUNCTION FUNCTION_BLOCK END_FUNCTION_BLOCK
INTERFACE END_INTERFACE METHOD END_METHOD PROPERTY END_PROPERTY ACTION
END_ACTION END_GET END_SET EXTENDS IMPLEMENTS END_VAR TYPE END_TYPE STRUCT
END_STRUCT UNION END_UNION ARRAY OF POINTER REFERENCE REF_TO TO AT CONFIGURATION
END_CONFIGURATION RESOURCE END_RESOURCE WITH IF THEN ELSIF ELSE END_IF CASE
END_CASE FOR BY DO END_FOR WHILE END_WHILE REPEAT UNTIL END_REPEAT EXIT
CONTINUE RETURN JMP AND OR XOR NOT MOD AND_THEN OR_ELSE THIS SUPER
"""
KEYWORDS = {word: word for word in _WORDS.split()}
_KINDS = """
VAR VAR_INPUT VAR_OUTPUT VAR_IN_OUT VAR_TEMP VAR_INST VAR_STAT VAR_GLOBAL
VAR_EXTERNAL VAR_CONFIG
"""
KEYWORDS["__TRY"] = "TRY"
KEYWORDS |= dict.fromkeys(_KINDS.split(), "VAR_KIND")
QUALIFIERS = frozenset(
    [
        "CONSTANT",
        "RETAIN",
        "PERSISTENT",
        "NON_RETAIN",
        "PUBLIC",
        "PRIVATE",
        "PROTECTED",
        "INTERNAL",
    ]
)
_MODIFIERS = """PUBLIC PRIVATE PROTECTED INTERNAL ABSTRACT FINAL OVERRIDE"""
MODIFIERS = frozenset(_MODIFIERS.split())
_HEADS = frozenset(
    [
        "PROGRAM",
        "FUNCTION",
        "FUNCTION_BLOCK",
        "METHOD",
        "PROPERTY",
        "INTERFACE",
        "TYPE",
        "MODIFIER",
    ]
)
_JMP = re.compile(r"\bJMP\b", re.I)
_COLON = re.compile(r"\s*:(?!=)")
_SECTION = re.compile(r"\s*(VAR\b|$)", re.I)
_NEXT_WORD = re.compile(r"\s*([A-Za-z_]\w*)")
_CONFIGURATION = frozenset({"TASK", "ON"})
_NOT_IN_EXPRESSIONS = frozenset(
    {"ACTION", "METHOD", "PROPERTY", "TYPE", "WITH", "RESOURCE"}
)


_DECLARING = {
    "VAR_KIND": True, "TYPE": True, "CONFIGURATION": True,
    "END_VAR": False, "END_TYPE": False, "END_CONFIGURATION": False,
}  # fmt: skip


_NAMING = frozenset({"METHOD", "PROPERTY", "FUNCTION", "MODIFIER", "ACTION"})
"""Behind these a name ahead of a colon is no label."""


class _Marks:
    """Finds the labels of JMP: a name ahead of a colon, neither in a declaration
    nor in CASE.  A text without JMP has none.
    """

    def __init__(self, text: str) -> None:
        self._text = text if _JMP.search(text) else ""
        self._declaring, self._cases = False, 0

    def see(self, kind: str) -> None:
        """One more token."""
        self._declaring = _DECLARING.get(kind, self._declaring)
        self._cases += (kind == "CASE") - (kind == "END_CASE")

    def is_one(self, token: Token, before: str) -> bool:
        """Whether a name is a label."""
        if not self._text or self._declaring or self._cases:
            return False
        if before in _NAMING:
            return False
        return _COLON.match(self._text, token.end_pos or 0) is not None


class Keywords:
    """Lark's filter behind the lexer; names are accepted in every state.
    ``text``: what is parsed.
    """

    always_accept = ("NAME",)
    text = ""

    def process(self, stream: Iterator[Token]) -> Iterator[Token]:
        """Set the type of every name that is a keyword."""
        before, accessors, configuration = "", False, False
        marks = _Marks(self.text)
        for token in stream:
            kind = token.type
            if kind == "NAME" and before != "DOT":
                word = token.value.upper()
                kind = KEYWORDS.get(word) or _soft(
                    word, before, accessors, configuration
                )
                if kind == "MODIFIER" and not self._modifies(token, word):
                    kind = "NAME"
                if kind == "NAME" and marks.is_one(token, before):
                    kind = "LABEL"
                if not before and self._of_accessor(token, word):
                    kind = "MODIFIER"
                if kind != "NAME":
                    token.type = kind
                if kind == "PROPERTY":
                    accessors = True
                elif kind == "END_PROPERTY":
                    accessors = False
                elif kind == "CONFIGURATION":
                    configuration = True
            before = kind
            marks.see(kind)
            yield token

    def _of_accessor(self, token: Token, word: str) -> bool:
        """``PROTECTED`` ahead of all else in the declaration of a GET or SET."""
        behind = token.end_pos or 0
        return word in MODIFIERS and bool(_SECTION.match(self.text, behind))

    def _modifies(self, token: Token, word: str) -> bool:
        """Whether a name follows; else the word itself is the name."""
        found = _NEXT_WORD.match(self.text, token.end_pos or 0)
        if found is None:
            return False
        follows = found[1].upper()
        return follows != word and follows not in KEYWORDS


def _soft(word: str, before: str, accessors: bool, configuration: bool) -> str:
    """Words that are keywords in a few places only."""
    if before in ("VAR_KIND", "QUALIFIER") and word in QUALIFIERS:
        return "QUALIFIER"
    if before in _HEADS and word in MODIFIERS:
        return "MODIFIER"
    if accessors and word in ("GET", "SET") and before != "COLON":
        return word
    if configuration and word in _CONFIGURATION:
        return word
    return "NAME"
