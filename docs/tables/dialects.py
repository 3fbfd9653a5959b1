"""Functions, commands, setup codes, parameters and cycles of the dialects."""

from __future__ import annotations

import re
from collections.abc import Iterator

from cnc_core.frontend.isg import reference as isg
from cnc_core.frontend.isg.commands import table as isg_commands
from cnc_core.frontend.isg.cycles.registry import CYCLES
from cnc_core.frontend.isg.language import gcodes
from cnc_core.frontend.iso import codes as iso_codes
from cnc_core.frontend.iso import reference as iso
from cnc_core.frontend.isons import reference as isons
from cnc_core.frontend.isons.base import codes as isons_codes
from cnc_core.frontend.isons.base import parameters
from cnc_core.frontend.osai import codes as osai_codes
from cnc_core.frontend.osai import front_end as osai_front_end
from cnc_core.frontend.osai import reference as osai

from .texts import DescriptionError, bounds, entries, same, table

WORKS, STORED, REFUSED = "works", "stored", "refused"


def code_range(word: str, scale: int) -> list[int]:
    """Functions of ``53-59`` or ``5.1``, counted in 1 / scale."""
    first, _, last = word.partition("-")
    low, high = (round(float(one) * scale) for one in (first, last or first))
    step = 1 if "." in word else scale
    return list(range(low, high + 1, step))


def functions(
    text: str, states: dict[int, str], letter: str, scale: int = 1
) -> str:
    """Table of G or M functions; the state comes from the code."""
    rows, described = [], []
    for names, said in entries(text):
        codes = [c for word in names.split() for c in code_range(word, scale)]
        described += codes
        found = {states.get(code, "unknown") for code in codes}
        if len(found) != 1:
            raise DescriptionError(f"{letter} {names}: {found}")
        rows.append([names, found.pop(), said])
    same(described, states, f"{letter} functions")
    return table((letter, "State", "Meaning"), rows)


def isg_g_functions(_: str) -> str:
    works = {4, *gcodes.EFFECTS, *gcodes.COMPENSATION, *gcodes.EXECUTED}
    works |= {*gcodes.INITIAL, *gcodes.USER_CODES}
    states = dict.fromkeys(works, WORKS) | dict.fromkeys(gcodes.STORED, STORED)
    states |= dict.fromkeys(gcodes.REFUSED, REFUSED)
    return functions(isg.G_FUNCTIONS, states, "G")


def isg_command_table(_: str) -> str:
    rows, described = [], []
    for names, said in command_entries(isg.COMMANDS):
        described += names
        state = {isg_commands.TABLE.get(name, "unknown") for name in names}
        if len(state) != 1:
            raise DescriptionError(f"{names}: {state}")
        shown = ", ".join(f"`#{name}`" for name in names)
        rows.append([shown, state.pop(), said])
    same(described, isg_commands.TABLE, "# commands")
    return table(("Command", "State", "Meaning"), rows)


def command_entries(text: str) -> Iterator[tuple[list[str], str]]:
    """Names parted by ``;`` or by the end of a line."""
    parted = re.sub(r"(?m)^(\S.*[^;\n])\n(?=\S)", r"\1;\n", text)
    for names, said in entries(parted):
        yield [name.strip() for name in names.split(";")], said


def iso_g_functions(_: str) -> str:
    states = dict.fromkeys(iso_codes.KNOWN, REFUSED)
    states |= dict.fromkeys(iso_codes.SUPPORTED, WORKS)
    return functions(iso.G_FUNCTIONS, states, "G", 10)


def iso_m_functions(_: str) -> str:
    states = dict.fromkeys(iso_codes.STANDARD_M, WORKS)
    return functions(iso.M_FUNCTIONS, states, "M")


def osai_g_functions(_: str) -> str:
    works = {*osai_front_end.SUPPORTED_G, *osai_codes.TRANSITIONS}
    states = dict.fromkeys(works, WORKS)
    states |= dict.fromkeys(osai_front_end.ARCS, REFUSED)
    return functions(osai.G_FUNCTIONS, states, "G")


def shown(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:g}"


def setup_field(field: osai_codes.Field) -> str:
    """Name, what it may be, and the default in brackets."""
    if field.letter:
        allowed = "axis"
    elif field.words:
        allowed = "\\|".join(field.words)
    else:
        allowed = bounds(field.low, field.high, 1e9)
        allowed = " ".join(
            filter(None, ("whole" if field.whole else "", allowed))
        )
    default = "" if field.default is None else shown(field.default)
    default = (
        f"default {default}"
        if default
        else "optional"
        if field.optional
        else ""
    )
    inside = ", ".join(filter(None, (allowed, default)))
    return f"`{field.name}`" + (f" ({inside})" if inside else "")


def osai_setup_codes(_: str) -> str:
    said = dict(entries(osai.SETUP_CODES))
    same(list(said), osai_codes.CODES, "setup codes")
    rows = [
        [code, ", ".join(map(setup_field, fields)), said[code]]
        for code, fields in osai_codes.CODES.items()
    ]
    return table(("Code", "Fields", "Effect"), rows)


def isons_functions(which: str) -> str:
    text = isons.PATH_FUNCTIONS if which == "path" else isons.G_FUNCTIONS
    other = isons.G_FUNCTIONS if which == "path" else isons.PATH_FUNCTIONS
    elsewhere = {
        code
        for names, _ in entries(other)
        for word in names.split()
        for code in code_range(word, 1)
    }
    states = dict.fromkeys(isons_codes.KNOWN - elsewhere, WORKS)
    return functions(text, states, "G")


def isons_parameters(which: str) -> str:
    known, ending = {
        "generic": (parameters.GENERIC, ""),
        "axis": (parameters.AXIS, "_X"),
        "positioner": (parameters.POSITIONER, "_P0"),
    }[which]
    rows = []
    for name, one in known.items():
        default = "none" if abs(one.default) >= 1e11 else f"{one.default:g}"
        allowed = one.choices or bounds(one.low, one.high, 1e11)
        kind = "whole number" if one.whole else "number"
        state = f"stored: {one.stored}" if one.stored else f"acts: {one.acts}"
        rows.append([f"`{name}{ending}`", kind, default, allowed or "-", state])
    return table(("Parameter", "Type", "Default", "Range", "State"), rows)


def cycle(name: str) -> str:
    one = next(c for c in CYCLES if c.name == name)
    rows = []
    for p in one.parameters:
        names = " ".join(f'"{word}"' for word in p.names)
        allowed = p.range_text + (f", or {names}" if names else "")
        value = "-" if p.default is None else f"{p.default:g}"
        default = "required" if p.required else p.default_text or value
        rows.append(
            [str(p.number), p.text, p.unit or "-", allowed or "-", default]
        )
    outputs = ", ".join(one.outputs)
    head = f"Outputs, `V.CYC.`: {outputs}\n\n" if outputs else ""
    return head + table(("@P", "Meaning", "Unit", "Range", "Default"), rows)
