"""Assertions of ``FB_TestSuite``: the type chooses the method, the call is the place."""

from __future__ import annotations

from ..errors import ARGUMENT, Position, StopHere
from ..model import types
from ..model.classes import Routine
from ..syntax import tree
from .context import HERE, Context
from .value import RoutineRef

SUITE = "FB_TESTSUITE"
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
