"""Names and types of all variables of a program, for other processes."""

from __future__ import annotations

from typing import Any

from .symbols import size_of


def listing_of(description: dict[str, Any]) -> dict[str, Any]:
    """``types``: rows; ``roots``: programs and lists of globals."""
    types = [*description["types"]]
    roots = [[name, row["type"]] for name, row in description["roots"].items()]
    for name, variables in description["lists"].items():
        if "HLI_" not in name:
            roots.append([name, len(types)])
            types.append(_list_row(name, variables, description["types"]))
    return {"types": types, "roots": roots}


def _list_row(name: str, variables: Any, types: list[Any]) -> list[Any]:
    """A list as a structure; its constants are no variables."""
    members: dict[str, list[int]] = {}
    at = 0
    for variable, row in variables.items():
        if "type" in row:
            members[variable] = [row["type"], at, -1]
            at += -(-size_of(types, row["type"]) // 8) * 8
    return ["t", name, at, members]
