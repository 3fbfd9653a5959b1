"""What a word that nobody knows may have meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from functools import lru_cache

NEAR = 0.66  # two of three letters


def guess(word: str, known: Iterable[str]) -> str:
    """``; did you mean X?`` for the nearest known word, or nothing."""
    return _guess(word.upper(), tuple(sorted(known)))


@lru_cache(maxsize=256)  # a wrong line of a loop comes again and again
def _guess(word: str, known: tuple[str, ...]) -> str:
    found = difflib.get_close_matches(word, known, n=1, cutoff=NEAR)
    return f"; did you mean {found[0]}?" if found else ""
