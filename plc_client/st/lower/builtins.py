"""Standard functions: the table and their calls."""

from __future__ import annotations

import functools
from dataclasses import fields

from ..model import types
from ..syntax import tree
from . import (
    builtin_hli,
    builtin_memory,
    builtin_numbers,
    builtin_selection,
    builtin_texts,
    builtin_times,
    conversions,
)
from .builtin_arguments import Rule, arguments, count
from .context import Context, Settled
from .value import Value


@functools.cache
def table() -> dict[str, tuple[Rule, tuple[str, ...]]]:
    """Name -> (rule, names of the parameters); made when it is first used."""
    found: dict[str, tuple[Rule, tuple[str, ...]]] = {}
    for module in (
        builtin_numbers,
        builtin_selection,
        builtin_texts,
        builtin_times,
        builtin_memory,
        builtin_hli,
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
        found = arguments(node, ("IN",), name)
        count(found, 1, 1, name, node.pos)
        return conversions.convert_named(context, *pair, found[0], node.pos)
    rule, parameters = table()[name]
    nodes = arguments(node, parameters, name)
    if name in builtin_memory.RULES or name in builtin_hli.RULES:
        return rule(context, nodes, node.pos)
    before, nodes = _in_order(context, nodes)
    result = rule(context, nodes, node.pos)
    if before:
        text = f"({', '.join(before)}, {result.text})"
        result = result.with_text(text)
        result.calls = True
    return result


def _in_order(
    context: Context, nodes: list[tree.Node]
) -> tuple[list[str], list[tree.Node]]:
    """(assignments, arguments): beside a call they are read from left to right."""
    if len(nodes) < 2 or not any(_runs_user_code(node) for node in nodes):
        return [], nodes
    before, values = context.in_order([context.value(node) for node in nodes])
    return before, [
        Settled(node.pos, value)
        for node, value in zip(nodes, values, strict=True)
    ]


def _runs_user_code(node: object) -> bool:
    """There is a call in it that is not of a standard function."""
    if isinstance(node, list):
        return any(_runs_user_code(part) for part in node)
    if not isinstance(node, (tree.Node, tree.Argument)):
        return False
    if isinstance(node, tree.Call):
        base = node.base
        if not isinstance(base, tree.Name) or not known(base.name.upper()):
            return True
    return any(_runs_user_code(getattr(node, f.name)) for f in fields(node))
