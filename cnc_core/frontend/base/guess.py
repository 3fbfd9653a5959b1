"""What a word that nobody knows may have meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from functools import lru_cache

NEAR = 0.66  # two of three letters


def guess(
    word: str, known: Iterable[str], near: float = NEAR, mark: str = ""
) -> str:
    """``; did you mean X?`` for the nearest known word, or nothing.

    ``near``: the share of letters that must agree; ``mark``: written ahead of X.
    """
    found = _nearest(word.upper(), tuple(sorted(known)), near)
    return f"; did you mean {mark}{found}?" if found else ""


@lru_cache(maxsize=256)  # a wrong line of a loop comes again and again
def _nearest(word: str, known: tuple[str, ...], near: float) -> str:
    found = difflib.get_close_matches(word, known, n=1, cutoff=near)
    return found[0] if found else ""
