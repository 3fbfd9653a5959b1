"""The halves of TwinCAT objects become one tree."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..errors import SYNTAX, Log, StopHere
from ..syntax import tree
from .units import Unit

Parse = Callable[[Unit, Log], Any]


def assemble(unit: Unit, head: Any, parse: Parse, log: Log) -> Any:
    """A POU with its statements, methods, properties and actions."""
    if not isinstance(head, tree.Pou):
        return None
    head.origin, head.attributes = unit.origin, list(unit.attributes)
    if unit.body is not None:
        head.statements = parse(unit.body, log) or []
    for child in unit.children:
        found = parse(child, log)
        if found is None:
            continue
        if child.role == "Property":
            found = _property(child, found, parse, log)
        else:
            found = assemble(child, found, parse, log)
        if found is not None:
            head.children.append(found)
    return head


def _property(unit: Unit, head: Any, parse: Parse, log: Log) -> Any:
    if not isinstance(head, tree.Pou):
        stop = StopHere(SYNTAX, "PROPERTY name : type", (unit.line, 1))
        log.error(unit.origin, stop)
        return None
    head.origin = unit.origin
    for child in unit.children:
        accessor = parse(child, log)
        if accessor is None:
            continue
        accessor.kind = "getter" if child.role == "Get" else "setter"
        accessor.pos, accessor.origin = head.pos, unit.origin
        if child.body is not None:
            accessor.statements = parse(child.body, log) or []
        head.children.append(accessor)
    return head
