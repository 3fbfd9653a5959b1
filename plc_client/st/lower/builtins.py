"""Standard functions: the table, and how arguments reach it."""

from __future__ import annotations

import functools
from collections.abc import Callable

from ..errors import ARGUMENT, Position, StopHere
from ..model import types
from ..syntax import tree
from .context import Context
from .value import Value

Rule = Callable[[Context, list[tree.Node], Position], Value]


@functools.cache
def table() -> dict[str, tuple[Rule, tuple[str, ...]]]:
    """Name -> (rule, names of the parameters); made when it is first used."""
    from . import (  # noqa: PLC0415 (the rules use this module)
        builtin_memory,
        builtin_numbers,
        builtin_selection,
        builtin_texts,
        builtin_times,
    )

    found: dict[str, tuple[Rule, tuple[str, ...]]] = {}
    for module in (
        builtin_numbers,
        builtin_selection,
        builtin_texts,
        builtin_times,
        builtin_memory,
    ):
        found |= module.RULES
    return found


@functools.cache
def _conversion(key: str) -> tuple[str, str] | None:
    """(source, target) of ``INT_TO_REAL``; the source of ``TO_REAL`` is empty."""
    names = {*types.ELEMENTARY, "STRING", "WSTRING"}
    if key.startswith("TO_") and key[3:] in names:
        return "", key[3:]
    source, found, target = key.partition("_TO_")
    if found and source in names | {"ANY", "ENUM"} and target in names:
        return source, target
    if key.startswith("TRUNC_") and key[6:] in types.ELEMENTARY:
        return "TRUNC", key[6:]
    return None


def known(key: str) -> bool:
    """Whether there is a standard function of this name."""
    return key in table() or _conversion(key) is not None


def names() -> list[str]:
    """All names of the table."""
    return list(table())


def call(context: Context, name: str, node: tree.Call) -> Value:
    """A call of a standard function."""
    pair = _conversion(name)
    if pair is not None and name not in table():
        from . import conversions  # noqa: PLC0415

        found = arguments(node, ("IN",), name)
        count(found, 1, 1, name, node.pos)
        return conversions.convert_named(context, *pair, found[0], node.pos)
    rule, parameters = table()[name]
    return rule(context, arguments(node, parameters, name), node.pos)


def arguments(
    node: tree.Call, parameters: tuple[str, ...], name: str
) -> list[tree.Node]:
    """The arguments in the order of the parameters."""
    found: dict[int, tree.Node] = {}
    for place, argument in enumerate(node.arguments):
        if argument.value is None or argument.out:
            text = f"{name} takes inputs alone"
            raise StopHere(ARGUMENT, text, argument.pos)
        key = argument.name.upper()
        if key == "EN":
            raise StopHere(ARGUMENT, "EN is not supported", argument.pos)
        found[_index(key, place, parameters, argument)] = argument.value
    missing = [k for k in range(len(found)) if k not in found]
    if missing:
        text = f"{name}: argument {missing[0] + 1} is missing"
        raise StopHere(ARGUMENT, text, node.pos)
    return [found[k] for k in range(len(found))]


def _index(
    key: str,
    place: int,
    parameters: tuple[str, ...],
    argument: tree.Argument,
) -> int:
    if not key:
        return place
    if key in parameters:
        return parameters.index(key)
    if key.startswith("IN") and key[2:].isdigit():
        offset = 1 if parameters and parameters[0] == "K" else 0
        return int(key[2:]) - 1 + offset
    text = f"{argument.name} is no parameter; use {', '.join(parameters)}"
    raise StopHere(ARGUMENT, text, argument.pos)


def count(
    found: list[tree.Node], low: int, high: int, name: str, pos: Position
) -> None:
    """StopHere: the number of arguments is wrong."""
    if low <= len(found) <= high:
        return
    wanted = str(low) if low == high else f"{low} to {high}"
    if high > 1000:
        wanted = f"at least {low}"
    text = f"{name} takes {wanted} arguments, not {len(found)}"
    raise StopHere(ARGUMENT, text, pos)
