"""Macros: ``"NAME" = "nc text"``, later ``"NAME"`` in a block."""

from __future__ import annotations

import re
from dataclasses import dataclass

from cnc_core.errors import Place
from cnc_core.frontend.base.block_text import BLOCK_CHARACTERS, BlockText
from cnc_core.frontend.base.lexer import fail

DEFINITION = re.compile(
    r'\s*(?:[nN]\s*[0-9]+)?\s*("(?:\\"|[^"])*")\s*=\s*("(?:\\"|[^"])*")\s*$'
)
QUOTED = re.compile(r'"((?:\\"|[^"])*)"')
DEPTH_MAX = 20


@dataclass
class ExpandedBlock(BlockText):
    """A block with its macros expanded; every character knows the offset it
    comes from.
    """

    origin: tuple[int, ...] = ()

    def place(self, offset: int) -> Place:
        last = self.origin[-1] if self.origin else 0
        return super().place(
            self.origin[offset] if offset < len(self.origin) else last
        )


def definition(text: str) -> tuple[str, str] | None:
    """Name and text if the block defines a macro."""
    found = DEFINITION.match(text)
    if not found:
        return None
    name, text = found[1][1:-1], found[2][1:-1]
    return name, text.replace('\\"', '"')


def expand(text: str, macros: dict[str, str]) -> tuple[str, list[int]]:
    """``text`` with all known macros expanded.

    The list: for each character its offset in ``text``.
    """
    origin = list(range(len(text)))
    for _ in range(DEPTH_MAX):
        found = (m for m in QUOTED.finditer(text) if m[1] in macros)
        if next(found, None) is None:
            return text, origin
        text, origin = _replaced(text, origin, macros)
        if len(text) > BLOCK_CHARACTERS:
            raise fail(
                20301,
                f"block longer than {BLOCK_CHARACTERS} characters after its macros",
                origin[0],
            )
    raise fail(20301, f"macros more than {DEPTH_MAX} deep in each other", 0)


def _replaced(
    text: str, origin: list[int], macros: dict[str, str]
) -> tuple[str, list[int]]:
    parts, places, last = [], [], 0
    for m in QUOTED.finditer(text):
        if m[1] not in macros:
            continue
        inner = macros[m[1]]
        parts += [text[last : m.start()], inner]
        places += origin[last : m.start()]
        places += [origin[m.start()]] * len(inner)
        last = m.end()
    return "".join([*parts, text[last:]]), places + origin[last:]
