"""The keys of a cell file, from its models."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, get_args, get_origin

import annotated_types
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from cnc_core.config import CellConfig, ChannelConfig
from cnc_core.config.channels import ChannelTable
from cnc_core.config.reference import KEYS

from .texts import entries, plain, same, table


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
        return f"{plain(found['ge'])} to {plain(found['le'])}"
    return " and ".join(f"{signs[key]} {plain(found[key])}" for key in found)


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
    kind, allowed = kind_and_range(arguments[0], metadata)
    both = arguments[0] is bool and len(arguments) > 1
    return f"{kind} or a number" if both else kind, allowed


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
    shown = f"{plain(value)}" if isinstance(value, float) else str(value)
    return f"`{shown}`".replace("|", "\\|") if isinstance(value, str) else shown


SHARED = {*CellConfig.model_fields, *ChannelConfig.model_fields}


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
        if model is ChannelTable and name in SHARED:
            continue  # described where a cell with one channel has it
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
