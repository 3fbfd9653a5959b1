"""Texts beside the code, and Markdown tables of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any


class DescriptionError(ValueError):
    """A text describes what the code does not have, or leaves something out."""


def entries(text: str) -> Iterator[tuple[str, str]]:
    """(names, description): lines at the margin, the indented lines below."""
    names: list[str] = []
    said: list[str] = []
    for line in text.splitlines():
        if line.startswith(" "):
            said.append(line.strip())
        elif line:
            if said:
                yield " ".join(names), " ".join(said)
                names, said = [], []
            names.append(line)
    yield " ".join(names), " ".join(said)


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table."""
    lines = [list(head), ["---"] * len(list(head)), *map(list, rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def same(described: list[Any], known: Iterable[Any], subject: str) -> None:
    """DescriptionError unless each known one is described exactly once."""
    wanted = set(known)
    twice = {str(one) for one in described if described.count(one) > 1}
    wrong = {str(one) for one in wanted ^ set(described)}
    if twice or wrong:
        raise DescriptionError(f"{subject}: {sorted(twice | wrong)}")


def plain(number: float) -> str:
    """Digits without an exponent."""
    return f"{number:.10f}".rstrip("0").rstrip(".")


def bounds(low: float, high: float, none: float = 1e12) -> str:
    """``0 to 100``, ``>= 0``; empty without bounds."""
    has_low, has_high = low > -none, high < none
    if has_low and has_high:
        return f"{plain(low)} to {plain(high)}"
    return (
        f">= {plain(low)}"
        if has_low
        else f"<= {plain(high)}"
        if has_high
        else ""
    )
