"""A word that nobody knows: told as it is written, with what it may have meant."""

from __future__ import annotations

from collections.abc import Collection

from cnc_core.errors import CncError
from cnc_core.frontend.base.guess import guess
from cnc_core.frontend.base.lexer import Kind, fail, tokenize

from ..base.text import PATTERN

SHORTEST = 3  # letters of a word that is worth a guess
NOT_READ = (900001, 900002, 900004)


def spelt(
    error: CncError,
    text: str,
    known: Collection[str],
    functions: Collection[str],
) -> CncError:
    """The error itself, or one for the whole word in which it lies: ``GOT`` is
    no G function, ``USR_ZERO`` no axis U.

    ``functions``: what a word in front of ``(`` may have meant.
    """
    if error.code not in NOT_READ or error.place.line:
        return error
    at = error.place.column
    word = next(
        (
            token
            for token in tokenize(text, PATTERN)
            if token.offset <= at < token.offset + len(token.text)
        ),
        None,
    )
    if word is None or word.kind is not Kind.NAME or len(word.text) < SHORTEST:
        return error
    called = text[word.offset + len(word.text) :].lstrip().startswith("(")
    name, words = word.text.upper(), sorted(functions if called else known)
    if name in words or name in known:
        return error
    hint = guess(name, words)
    if not hint and "_" not in name and not called:
        return error
    code = 900002 if error.code == 900002 else 900001
    what = "function" if called else "word"
    return fail(code, f"unknown {what} {name}{hint}", word.offset)
