"""The members of the HLI, from its layout."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import Any

from hli import export, layout
from hli.reference import MEMBERS

from .texts import DescriptionError, same, table

WRITERS = (("_rw", "both"), ("_r", "CNC"), ("_w", "PLC"))


def writer_of(member: str) -> str:
    return next((w for ending, w in WRITERS if member.endswith(ending)), "")


Said = dict[str, tuple[str, str, str]]


@functools.cache
def described_members() -> dict[str, tuple[str, Said]]:
    """Structure -> (purpose, member -> (unit, writer, meaning))."""
    out: dict[str, tuple[str, Said]] = {}
    for names, purpose, members in blocks():
        said = dict(map(member_of, members))
        out |= dict.fromkeys(names.split(), (purpose, said))
    same(list(out), [one.__name__ for one in layout.structures()], "structures")
    return out


def blocks() -> Iterator[tuple[str, str, list[str]]]:
    """(structures, purpose, member lines): indented lines belong to the one above."""
    lines: list[str] = []
    for line in MEMBERS.strip().splitlines():
        heading = "|" not in line and not line.startswith(" ")
        if line.startswith(" ") and "|" in lines[-1]:
            lines[-1] += " " + line.strip()
        elif heading and lines and "|" in lines[-1]:
            yield block(lines)
            lines = [line]
        else:
            lines.append(line)
    yield block(lines)


def block(lines: list[str]) -> tuple[str, str, list[str]]:
    members = [line for line in lines if "|" in line]
    rest = [line for line in lines if "|" not in line]
    names = " ".join(line for line in rest if not line.startswith(" "))
    purpose = " ".join(line.strip() for line in rest if line.startswith(" "))
    return names, purpose, members


def member_of(line: str) -> tuple[str, tuple[str, str, str]]:
    name, unit, writer, said = (word.strip() for word in line.split("|", 3))
    return name, (unit, writer or writer_of(name), said)


def who_writes(structure: str, member: str) -> str:
    """CNC, PLC or both; DescriptionError where nothing says so."""
    writer = described_members()[structure][1][member][1]
    if not writer:
        raise DescriptionError(f"{structure}.{member}: who writes it?")
    return writer


def type_text(ctype: Any, folder: str = "hli/") -> str:
    """Structured Text's name of a member's type; that of a structure leads to
    its page in ``folder``.
    """
    base, dimensions = layout.element_type(ctype)
    if layout.is_string(base):
        name = f"STRING({base._length_ - 1})"
    elif base.__name__ in export._ST_TYPES:
        name = export._ST_TYPES[base.__name__]
    else:
        name = f"[{base.__name__}]({folder}{base.__name__.lower()}.md)"
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
        unit, _, said = members[member]
        writer = who_writes(name, member)
        offset = str(getattr(structure, member).offset)
        shown = (type_text(fields[member]), offset, unit or "-", writer, said)
        rows.append([f"`{member}`", *shown])
    head = ("Member", "Type", "Offset", "Unit", "Written by", "Meaning")
    return table(head, rows)


def hli_aliases(_: str) -> str:
    rows = [[f"`{old}`", f"`{new}`"] for old, new in layout.ALIASES.items()]
    return table(("Alias", "Canonical"), rows)
