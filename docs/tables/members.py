"""The members of the HLI, from its layout."""

from __future__ import annotations

import re
from typing import Any

from hli import export, layout
from hli.reference import MEMBERS

from .texts import DescriptionError, entries, same, table

WRITERS = (("_rw", "both"), ("_r", "CNC"), ("_w", "PLC"))


def writer_of(member: str) -> str:
    return next((w for ending, w in WRITERS if member.endswith(ending)), "")


def described_members() -> dict[
    str, tuple[str, dict[str, tuple[str, str, str]]]
]:
    """Structure -> (purpose, member -> (unit, writer, meaning))."""
    out: dict[str, tuple[str, dict[str, tuple[str, str, str]]]] = {}
    members: dict[str, tuple[str, str, str]] = {}
    for names, said in entries(MEMBERS):
        if re.fullmatch(r"[A-Z0-9_]+", names):
            members = {}
            out[names] = (said, members)
            continue
        name, unit, writer = [*(w.strip() for w in names.split("|")), "", ""][
            :3
        ]
        members[name] = (unit, writer or writer_of(name), said)
    return out


def type_text(ctype: Any) -> str:
    """Structured Text's name of a member's type."""
    base, dimensions = layout.element_type(ctype)
    if layout.is_string(base):
        name = f"STRING({base._length_ - 1})"
    else:
        name = export._ST_TYPES.get(base.__name__, base.__name__)
    ranges = ", ".join(f"0..{size - 1}" for size in dimensions)
    return f"ARRAY [{ranges}] OF {name}" if ranges else name


def structure_table(name: str) -> str:
    """The members of one structure, without its gaps."""
    structure = {one.__name__: one for one in layout.structures()}[name]
    members = described_members()[name][1]
    fields = dict(structure._fields_)
    real = [field for field in fields if not field.startswith("fill_")]
    same(list(members), real, name)
    rows = []
    for member in real:
        unit, writer, said = members[member]
        if not writer:
            raise DescriptionError(f"{name}.{member}: who writes it?")
        offset = str(getattr(structure, member).offset)
        shown = (type_text(fields[member]), offset, unit or "-", writer, said)
        rows.append([f"`{member}`", *shown])
    head = ("Member", "Type", "Offset", "Unit", "Written by", "Meaning")
    return table(head, rows)


def hli_members(_: str) -> str:
    described = described_members()
    names = [one.__name__ for one in layout.structures()]
    same(list(described), names, "structures")
    return "\n".join(
        f"## `{name}`\n\n{purpose[0].upper()}{purpose[1:]}.\n\n"
        + structure_table(name)
        for name, (purpose, _) in described.items()
    )


def hli_aliases(_: str) -> str:
    rows = [[f"`{old}`", f"`{new}`"] for old, new in layout.ALIASES.items()]
    return table(("Alias", "Canonical"), rows)
