"""Arguments of standard functions: their order and their number."""

from __future__ import annotations

from collections.abc import Callable

from ..errors import ARGUMENT, Position, StopHere
from ..syntax import tree
from .context import Context
from .value import Value

Rule = Callable[[Context, list[tree.Node], Position], Value]


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
        offset = 2 if parameters and parameters[0] == "K" else 0
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
