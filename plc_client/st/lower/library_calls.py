"""Calls of the library: the place of what goes wrong inside, assertions, inputs
that are wrong for certain.
"""

from __future__ import annotations

from ..errors import ARGUMENT, Origin, Position, StopHere
from ..model import types
from ..model.classes import Routine
from ..syntax import tree
from .context import HERE, Context
from .value import RoutineRef, Value

SUITE = "FB_TESTSUITE"
_KINDS = ("M", "H", "S", "T")
_ANY_NUMBER = -(1 << 31)
_GENERIC = frozenset({"ASSERTEQUALS", "ASSERTNOTEQUALS"})


def is_one(routine: Routine) -> bool:
    """Whether a call of it is the place of a failure."""
    owner = routine.owner
    if owner is None or owner.name.upper() != SUITE:
        return False
    return routine.name.upper().startswith("ASSERT")


def site(context: Context, pos: Position) -> str:
    """C that notes where an assertion is called."""
    line = pos[0] - context.first_line
    return f"st_site_pou = {HERE}, st_site_line = {line}"


def chosen(context: Context, base: RoutineRef, node: tree.Call) -> RoutineRef:
    """``AssertEquals`` with values of any type becomes the method of their type."""
    routine = base.routine
    if not is_one(routine) or routine.name.upper() not in _GENERIC:
        return base
    assert routine.owner is not None
    values = [a.value for a in node.arguments[:2] if a.value is not None]
    if len(values) < 2:
        text = f"{routine.name} needs Expected and Actual"
        raise StopHere(ARGUMENT, text, node.pos)
    kind = _kind([context.value(value) for value in values])
    found = routine.owner.method(f"{routine.name}_{kind}".upper())
    if found is None:
        text = f"{routine.name} does not compare {kind}"
        raise StopHere(ARGUMENT, text, node.pos)
    return RoutineRef(found, base.instance, True)


_TIMES = {"TIME_OF_DAY": "TOD", "DATE_AND_TIME": "DT"}


def _kind(values: list[object]) -> str:
    """STRING, BOOL, a type of times and dates, or the widest of numbers."""
    bases = [value.base for value in values]  # type: ignore[attr-defined]
    texts = [base for base in bases if isinstance(base, types.StringType)]
    if texts:
        return "WSTRING" if any(text.wide for text in texts) else "STRING"
    families = {getattr(base, "family", "") for base in bases}
    if "real" in families:
        return "ANYREAL"
    if families == {"bool"}:
        return "BOOL"
    if families in ({"time"}, {"date"}):
        name: str = max(bases, key=lambda base: base.bits).name
        return _TIMES.get(name, name)
    signed = [getattr(base, "signed", False) for base in bases]
    return "LINT" if any(signed) else "ULINT"


# -- blocks
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
