"""What a word that nobody knows may have meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

NEAR = 0.66  # two of three letters


def guess(word: str, known: Iterable[str]) -> str:
    """``; did you mean X?`` for the nearest known word, or nothing."""
    found = difflib.get_close_matches(
        word.upper(), sorted(known), n=1, cutoff=NEAR
    )
    return f"; did you mean {found[0]}?" if found else ""
