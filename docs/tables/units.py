"""A page for each structure of the HLI: its members, their values, its units."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Iterator
from typing import Any

from hli import layout
from hli.values import Meanings, served_since, values

from .members import described_members, type_text, who_writes
from .texts import DescriptionError, table

ROOTS = {
    "segment_head": "segment head",
    "platform": "gpPform",
    "channel": "gpCh[i]",
    "axis": "gpAx[i]",
    "ext_var_channel": "gpVECh[i]",
    "ext_var_global": "gpVEGlobal",
    "sidecar": "sidecar",
    "ahead": "gpAhead[i]",
}
PLACES = 8  # that a page lists
LEVEL_UNIT = {"enable_w", "command_w", "state_r"}
OF_THE_UNIT = ("command_w", "state_r")  # they carry the unit's unit


@functools.cache
def places() -> dict[str, list[str]]:
    """Structure -> where it stands: ``gpCh[i].bahn_state``."""
    found: dict[str, list[str]] = {"HLI_SEGMENT": []}
    for name, ctype in layout.HLI_SEGMENT._fields_:
        base, _ = layout.element_type(ctype)
        _walk(ROOTS[name], base, found)
    return found


def _walk(path: str, structure: Any, found: dict[str, list[str]]) -> None:
    found.setdefault(structure.__name__, []).append(path)
    for name, ctype in structure._fields_:
        base, sizes = layout.element_type(ctype)
        if name.startswith("fill_") or not is_structure(base):
            continue
        index = "".join(f"[{'jkl'[i]}]" for i in range(len(sizes)))
        _walk(f"{path}.{name}{index}", base, found)


def is_structure(base: Any) -> bool:
    return isinstance(base, type) and issubclass(base, ctypes.Structure)


def file_name(structure: str) -> str:
    return f"{structure.lower()}.md"


def index_table(_: str) -> str:
    """Every structure with its page, where it stands and what it is for."""
    rows = [
        [
            f"[`{name}`](hli/{file_name(name)})",
            ", ".join(f"`{place}`" for place in places().get(name, [])[:1]),
            purpose,
        ]
        for name, (purpose, _) in described_members().items()
    ]
    return table(("Structure", "Where", "What it is"), rows)


def pages() -> dict[str, str]:
    """File name below ``docs/reference/hli`` -> text."""
    told = values()
    unknown = told.keys() - described_members().keys()
    if unknown:
        raise DescriptionError(f"values of unknown structures: {unknown}")
    return {
        file_name(name): _page(name, purpose, told.get(name, {}))
        for name, (purpose, _) in described_members().items()
    }


def _page(name: str, purpose: str, told: dict[str, Meanings]) -> str:
    structure = {one.__name__: one for one in layout.structures()}[name]
    parts = [
        f"# `{name}`",
        f"{purpose[0].upper()}{purpose[1:]}.",
        _where(name, structure),
        _members(structure).rstrip(),
        *_values(name, told),
        *_units(structure),
        "[All structures](../hli_members.md), [the HLI](../hli.md),"
        " [control units](../control.md).",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _where(name: str, structure: Any) -> str:
    found = places().get(name, [])
    size = f"{ctypes.sizeof(structure)} bytes."
    if not found:
        return size
    listed = ", ".join(f"`{place}`" for place in found[:PLACES])
    more = len(found) - PLACES
    rest = f" and {more} more places" if more > 0 else ""
    return f"It stands at {listed}{rest}. {size}"


def _members(structure: Any) -> str:
    name = structure.__name__
    said = described_members()[name][1]
    rows = []
    for member, ctype in structure._fields_:
        if member.startswith("fill_"):
            continue
        unit, _, meaning = said[member]
        rows.append(
            [
                f"`{member}`",
                type_text(ctype, ""),
                str(getattr(structure, member).offset),
                unit or "-",
                who_writes(name, member),
                served_since(name, member, meaning),
                meaning.replace("](", "](../").replace("](../http", "](http"),
            ]
        )
    head = (
        "Member",
        "Type",
        "Offset",
        "Unit",
        "Written by",
        "Served since",
        "Meaning",
    )
    return table(head, rows)


def _values(name: str, told: dict[str, Meanings]) -> Iterator[str]:
    """A table of values for each member that has some."""
    unknown = told.keys() - described_members()[name][1].keys()
    if unknown:
        raise DescriptionError(f"{name}: values of unknown members {unknown}")
    for member, meanings in told.items():
        rows = [[f"`{value}`", said] for value, said in meanings]
        yield f"## Values of `{member}`"
        yield table(("Value", "Meaning"), rows).rstrip()


def _units(structure: Any) -> Iterator[str]:
    """A section for each control unit among the members."""
    said = described_members()[structure.__name__][1]
    for member, ctype in structure._fields_:
        base, sizes = layout.element_type(ctype)
        if not is_structure(base) or sizes:
            continue
        fields = dict(base._fields_)
        if not fields.keys() >= LEVEL_UNIT or is_structure(fields["command_w"]):
            continue
        unit, _, meaning = said[member]
        where = places()[structure.__name__][0]
        yield f"## Unit `{member}`"
        yield f"`{where}.{member}`: {meaning}."
        yield _unit_table(base, unit).rstrip()


def _unit_table(base: Any, unit: str) -> str:
    said = described_members()[base.__name__][1]
    rows = [
        [
            f"`{name}`",
            type_text(ctype, ""),
            unit if unit and name in OF_THE_UNIT else "-",
            who_writes(base.__name__, name),
            said[name][2],
        ]
        for name, ctype in base._fields_
        if not name.startswith("fill_")
    ]
    return table(("Member", "Type", "Unit", "Written by", "Meaning"), rows)
