"""The tables of the reference, printed from the code into its pages.

A page keeps a table between ``<!-- generated: NAME ARGUMENT -->`` and
``<!-- end -->``.  ``python docs/generate.py`` names the pages that differ from
the code; with ``--write`` it writes them.
"""

from __future__ import annotations

import ast
import functools
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args, get_origin

import annotated_types
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from cnc_core.config import CellConfig
from cnc_core.config.reference import KEYS
from cnc_core.errors import ERRORS
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
from hli import export, layout
from hli.reference import MEMBERS

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
WORKS, STORED, REFUSED = "works", "stored", "refused"
REGION = re.compile(
    r"(<!-- generated: (\S+)(?: (\S+))? -->\n).*?(<!-- end -->)", re.DOTALL
)


class DescriptionError(ValueError):
    """A text describes what the code does not have, or leaves something out."""


# ------------------------------------------------------------------ the texts
def entries(text: str) -> Iterator[tuple[str, str]]:
    """(names, description): lines at the margin, the indented lines below."""
    names: list[str] = []
    said: list[str] = []
    for line in text.splitlines():
        if line.startswith(" "):
            said.append(line.strip())
        elif line:
            if said:
                yield " ".join(names), " ".join(said)
                names, said = [], []
            names.append(line)
    yield " ".join(names), " ".join(said)


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table."""
    lines = [list(head), ["---"] * len(list(head)), *map(list, rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def same(described: list[Any], known: Iterable[Any], subject: str) -> None:
    """DescriptionError unless each known one is described exactly once."""
    wanted = set(known)
    twice = {str(one) for one in described if described.count(one) > 1}
    wrong = {str(one) for one in wanted ^ set(described)}
    if twice or wrong:
        raise DescriptionError(f"{subject}: {sorted(twice | wrong)}")


# -------------------------------------------------------------- the dialects
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


# ---------------------------------------------------------------- the cycles
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


# ------------------------------------------------------------- the cell file
def bounds(low: float, high: float, none: float = 1e12) -> str:
    """``0 to 100``, ``>= 0``; empty without bounds."""
    has_low, has_high = low > -none, high < none
    if has_low and has_high:
        return f"{low:.10g} to {high:.10g}"
    return (
        f">= {low:.10g}" if has_low else f"<= {high:.10g}" if has_high else ""
    )


def limits(metadata: Iterable[Any]) -> str:
    """Range of a number from pydantic's constraints; 1e12 is none."""
    signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    found: dict[str, float] = {}
    for one in metadata:
        for key in signs:
            value = getattr(one, key, None)
            if value is not None and abs(value) < 1e10:
                found[key] = value
    if {"ge", "le"} <= found.keys():
        return f"{found['ge']:.10g} to {found['le']:.10g}"
    return " and ".join(f"{signs[key]} {found[key]:.10g}" for key in found)


def model_of(annotation: Any) -> type[BaseModel] | None:
    """The table that a key holds, if it holds one."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(model_of, get_args(annotation))), None)


NAMES = {str: "text", float: "number", int: "whole number", bool: "true, false"}


PLURAL = {
    "text": "texts",
    "number": "numbers",
    "whole number": "whole numbers",
    "table of numbers": "tables of numbers",
    "table of whole numbers": "tables of whole numbers",
    "list of numbers": "lists of numbers",
}


def kind_and_range(annotation: Any, metadata: Iterable[Any]) -> tuple[str, str]:
    """Words for a type and for its range."""
    arguments = [one for one in get_args(annotation) if one is not type(None)]
    origin = get_origin(annotation)
    if annotation in NAMES:
        return NAMES[annotation], limits(metadata)
    if hasattr(annotation, "__metadata__"):
        inner = [m for one in annotation.__metadata__ for m in constraints(one)]
        return kind_and_range(arguments[0], [*metadata, *inner])
    if origin is dict:
        kind, allowed = kind_and_range(arguments[1], ())
        return f"table of {PLURAL.get(kind, kind)}", allowed
    if origin is list:
        kind, allowed = kind_and_range(arguments[0], ())
        both = filter(None, (length(metadata), allowed))
        return f"list of {PLURAL[kind]}", ", ".join(both)
    if all(isinstance(one, str) for one in arguments):
        return "one of", ", ".join(f"`{one}`" for one in arguments)
    return kind_and_range(arguments[0], metadata)


def constraints(one: Any) -> Iterable[Any]:
    """A field's constraints, or the constraint itself."""
    return getattr(one, "metadata", None) or (one,)


def length(metadata: Iterable[Any]) -> str:
    """How many entries a list has."""
    low = high = None
    for one in metadata:
        if isinstance(one, annotated_types.MinLen):
            low = one.min_length
        if isinstance(one, annotated_types.MaxLen):
            high = one.max_length
    if low is not None and low == high:
        return f"{low} entries"
    return "" if high is None else f"up to {high} entries"


def default_of(field: Any) -> str:
    """The default as the file would write it."""
    value = field.get_default(call_default_factory=True)
    if value is PydanticUndefined:
        return "required"
    if value is None or value in ("", {}, []):
        return "-" if value is None else f"`{value!r}`".replace("''", '""')
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return " ".join(
            f"{one:g}" if isinstance(one, float) else one for one in value
        )
    shown = f"{value:.10g}" if isinstance(value, float) else str(value)
    return f"`{shown}`".replace("|", "\\|") if isinstance(value, str) else shown


@dataclass(frozen=True)
class Key:
    """A key of the cell file, by its models: ``path`` without names."""

    path: str
    kind: str
    default: str
    allowed: str


def cell_keys(
    model: type[BaseModel] = CellConfig, prefix: str = ""
) -> Iterator[Key]:
    """Every key of the models, tables unfolded."""
    for name, field in model.model_fields.items():
        inner = model_of(field.annotation)
        if inner:
            yield from cell_keys(inner, f"{prefix}{name}.")
            continue
        kind, allowed = kind_and_range(field.annotation, field.metadata)
        yield Key(prefix + name, kind, default_of(field), allowed)


def cell_sections() -> Iterator[tuple[str, str, list[tuple[str, str, str]]]]:
    """(title, introduction, [(key, unit, meaning)]) of ``KEYS``."""
    title, intro = "", ""
    rows: list[tuple[str, str, str]] = []
    for names, said in entries(
        re.sub(r"(?m)^(\[.*\])\n(?=\S)", r"\1\n    \n", KEYS)
    ):
        if names.startswith("["):
            if rows:
                yield title, intro, rows
            title, intro, rows = names, said, []
        else:
            key, _, unit = names.partition(" |")
            rows.append((key, unit.strip(), said))
    yield title, intro, rows


def path_of(title: str, key: str) -> str:
    """``axes.v_max_mm_s`` of ``[axes.NAME]`` and ``v_max_mm_s``."""
    parts = [part for part in title.strip("[]").split(".") if part]
    return ".".join([*(p for p in parts if p != p.upper()), key])


def cell_tables(_: str) -> str:
    known = {key.path: key for key in cell_keys()}
    described, out = [], []
    for title, intro, keys in cell_sections():
        rows = []
        for name, unit, said in keys:
            path = path_of(title, name)
            described.append(path)
            key = known.get(path) or Key(path, "", "", "")
            shown = (
                key.kind,
                unit or "-",
                key.default,
                key.allowed or "-",
                said,
            )
            rows.append([f"`{name}`", *shown])
        head = "Top of the file" if title == "[]" else f"`{title}`"
        if title == "[]" and out:
            head = "Tables by name"
        body = table(
            ("Key", "Type", "Unit", "Default", "Range", "Meaning"), rows
        )
        out.append("\n\n".join(filter(None, (f"### {head}", intro, body))))
    same(described, known, "keys of the cell file")
    return "\n".join(out)


# ---------------------------------------------------------------- the errors
PLACES = {
    "cnc_core/frontend/isg/": "ISG program",
    "cnc_core/frontend/iso/": "iso program",
    "cnc_core/frontend/isons/": "IsoNs program",
    "cnc_core/frontend/osai/": "HSM program",
    "cnc_core/frontend/": "program",
    "cnc_core/config/": "cell file",
    "cnc_core/geometry/": "path",
    "cnc_core/optimize/": "Path Optimizer",
    "cnc_core/kinematics/": "kinematics",
    "cnc_core/engine/": "engine",
    "cnc_core/process/": "CNC process",
    "cnc_core/cell/": "run",
    "cnc_core/": "command line",
    "plc_client/": "PLC",
    "hli/": "HLI",
    "c_ext/rows/": "program",
    "c_ext/stages/": "path",
    "c_ext/jerk/": "planner",
    "c_ext/": "engine",
}


def numbers_in(path: Path) -> set[int]:
    """Error numbers that a source file mentions."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        nodes = ast.walk(ast.parse(text))
        found = {n.value for n in nodes if isinstance(n, ast.Constant)}
        return {n for n in found if isinstance(n, int) and n in ERRORS}
    return {
        int(word) for word in re.findall(r"\b(\d{4,6})u?\b", text)
    } & ERRORS.keys()


@functools.cache
def found_by() -> dict[int, set[str]]:
    """Number -> parts of the program that report it."""
    out: dict[int, set[str]] = {number: set() for number in ERRORS}
    for package in ("cnc_core", "plc_client", "hli", "c_ext"):
        for path in sorted((ROOT / package).rglob("*.*")):
            skipped = path.name in (
                "errors.py",
                "_engine.c",
                "_sync.c",
                "reference.py",
            )
            if path.suffix not in (".py", ".c", ".h") or skipped:
                continue
            name = path.relative_to(ROOT).as_posix()
            place = next(
                p for room, p in PLACES.items() if name.startswith(room)
            )
            for number in numbers_in(path):
                out[number].add(place)
    return out


def error_table(which: str) -> str:
    """Rows of the numbers in ``LOW-HIGH``."""
    low, high = map(int, which.split("-"))
    places = found_by()
    rows = [
        [
            str(number),
            ERRORS[number].replace("|", "\\|"),
            place_text(places[number]),
        ]
        for number in sorted(ERRORS)
        if low <= number <= high
    ]
    return table(("Number", "Text", "Found in"), rows)


def place_text(places: set[str]) -> str:
    dialects = {p for p in places if p.endswith(" program")}
    if len(dialects) > 1 or "program" in places:
        places = places - dialects | {"program"}
    return ", ".join(sorted(places)) or "reserved"


# ------------------------------------------------------------ the HLI members
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


def hli_members(_: str) -> str:
    described = described_members()
    structures = {one.__name__: one for one in layout.structures()}
    same(list(described), structures, "structures")
    out = []
    for name, (purpose, members) in described.items():
        fields = dict(structures[name]._fields_)
        real = [field for field in fields if not field.startswith("fill_")]
        same(list(members), real, name)
        rows = []
        for member in real:
            unit, writer, said = members[member]
            if not writer:
                raise DescriptionError(f"{name}.{member}: who writes it?")
            offset = str(getattr(structures[name], member).offset)
            shown = (
                type_text(fields[member]),
                offset,
                unit or "-",
                writer,
                said,
            )
            rows.append([f"`{member}`", *shown])
        head = ("Member", "Type", "Offset", "Unit", "Written by", "Meaning")
        title = f"## `{name}`\n\n{purpose[0].upper()}{purpose[1:]}.\n\n"
        out.append(title + table(head, rows))
    return "\n".join(out)


# ------------------------------------------------------------------ the pages
TABLES: dict[str, Callable[[str], str]] = {
    "isg-g-functions": isg_g_functions,
    "isg-commands": isg_command_table,
    "iso-g-functions": iso_g_functions,
    "iso-m-functions": iso_m_functions,
    "osai-g-functions": osai_g_functions,
    "osai-setup-codes": osai_setup_codes,
    "isons-g-functions": isons_functions,
    "isons-parameters": isons_parameters,
    "cycle": cycle,
    "cell-keys": cell_tables,
    "errors": error_table,
    "hli-members": hli_members,
}


def generated(text: str) -> str:
    """The page's text with its regions as the code has them."""

    def fill(region: re.Match[str]) -> str:
        body = TABLES[region[2]](region[3] or "")
        return f"{region[1]}\n{body}\n{region[4]}"

    return REGION.sub(fill, text)


def pages() -> list[Path]:
    return sorted((DOCS / "reference").rglob("*.md"))


def main() -> int:
    differ = []
    for page in pages():
        text = page.read_text(encoding="utf-8")
        new = generated(text)
        if new != text:
            differ.append(page)
            if "--write" in sys.argv:
                page.write_text(new, encoding="utf-8")
    for page in differ:
        print(page.relative_to(ROOT))
    return 0 if "--write" in sys.argv else len(differ)


if __name__ == "__main__":
    sys.exit(main())
