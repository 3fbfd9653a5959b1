"""What the library's blocks on the HLI need of the memory ordering; no program
of a user may call it.
"""

from __future__ import annotations

from functools import partial

from ..errors import NAME, Position, StopHere
from ..model import types
from ..syntax import tree
from .builtin_arguments import Rule, count
from .builtin_memory import address, whole
from .context import Context
from .value import Value

_SHAPES = {
    "__CLAH_RING": ("st_ring", "", types.VOID),
    "__SNAPSHOT": ("st_snapshot", "aaan", types.BOOL),
    "__AHEAD_CLAIM": ("st_ahead_claim", "a", types.DINT),
    "__AHEAD_ASK": ("st_ahead_ask", "an", types.VOID),
    "__AHEAD_TAKE": ("st_ahead_take", "anaaa", types.DINT),
    "__REFUSE": ("st_refuse", "a", types.VOID),
    "__TECHNO_AGAIN": ("st_techno_again", "n", types.ULINT),
}
"""Name in ST: function of the run time, a for an address and n for a number, result."""


def _service(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    function, shape, result = _SHAPES[name]
    if not context.origin.file.startswith("<library>"):
        raise StopHere(NAME, f"{name} is for the library alone", pos)
    count(nodes, len(shape), len(shape), name, pos)
    values = [
        address(context, node) if letter == "a" else whole(context, node)
        for letter, node in zip(shape, nodes, strict=True)
    ]
    text = f"{function}({', '.join(v.text for v in values)})"
    return Value(result, text, calls=True, bits=64)


RULES: dict[str, tuple[Rule, tuple[str, ...]]] = {
    name: (partial(_service, name=name), ()) for name in _SHAPES
}
