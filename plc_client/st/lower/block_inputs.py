"""Calls of the library's blocks: who calls, and inputs that are wrong for certain."""

from __future__ import annotations

from ..errors import ARGUMENT, Origin, Position, StopHere
from ..model.classes import Routine
from ..syntax import tree
from .context import HERE, Context
from .value import Value

_KINDS = ("M", "H", "S", "T")
_ANY_NUMBER = -(1 << 31)


def notes(context: Context, called: Origin) -> bool:
    """Whether a call leads from the user's text into the library."""
    inside = context.origin.file.startswith("<")
    return called.file.startswith("<library>") and not inside


def noted(context: Context, name: str, pos: Position) -> str:
    """C that notes the call: a trap inside of it has this place."""
    line, call = pos[0] - context.first_line, f"k{context.number()}"
    row = f'{{{HERE}, {line}, "{name}"}}'
    context.statics.append(f"static const st_call {call} = {row};")
    return f"st_caller = &{call}"


def check(
    routine: Routine, values: dict[str, Value], given: dict[str, tree.Argument]
) -> None:
    """StopHere: a constant input that ``TechnoServer.on`` refuses."""
    origin = routine.origin
    own = origin is not None and origin.file.startswith("<library>")
    if not own or routine.label != "TechnoServer.on":
        return
    kind, number = values["KIND"].constant, values["NUMBER"].constant
    if kind is not None and kind not in _KINDS:
        text = f"technology function {kind!r}: M, H, S or T"
        raise StopHere(ARGUMENT, text, given["KIND"].pos)
    if number is not None and number < 0 and number != _ANY_NUMBER:
        text = f"technology function number {number}: from 0 on, or"
        text += " HLI_ANY_NUMBER for all of the kind"
        raise StopHere(ARGUMENT, text, given["NUMBER"].pos)
