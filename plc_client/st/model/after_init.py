"""``{attribute 'call_after_init'}``: methods that run when an instance has its values."""

from __future__ import annotations

from ..syntax import tree
from .classes import Class, Routine

ATTRIBUTE = "call_after_init"


def methods(cls: Class) -> list[Routine]:
    """The marked methods of a block that is marked itself, those of bases first."""
    bases = cls.ancestors()[::-1]
    if not any(_is_marked(base.pou) for base in bases):
        return []
    names = dict.fromkeys(n for base in bases for n in _names(base.pou))
    found = [cls.method(name) for name in names]
    return [method for method in found if method is not None]


def _is_marked(pou: tree.Pou) -> bool:
    """The attribute stands ahead of the block's name."""
    return any(
        a.name == ATTRIBUTE and a.line <= pou.pos[0] for a in pou.attributes
    )


def _names(pou: tree.Pou) -> list[str]:
    """Names in capitals of the methods behind an attribute, or with one of their own."""
    own = [c for c in pou.children if c.kind == "method"]
    found = [c.name.upper() for c in own if c.has(ATTRIBUTE)]
    for attribute in pou.attributes:
        if attribute.name != ATTRIBUTE or attribute.line <= pou.pos[0]:
            continue
        behind = [c for c in own if c.pos[0] >= attribute.line]
        if behind:
            found.append(min(behind, key=lambda c: c.pos).name.upper())
    return found
