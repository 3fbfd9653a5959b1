"""The structures of the HLI as a stub file for editors and type checkers."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from typing import Any

from hli import layout, view

from .members import described_members

HEAD = '''\
"""The structures of the HLI: ``python docs/generate.py --write`` makes this file."""

from typing import Any

import numpy as np

from .view import ArrayView, View, ViewArray
'''
KINDS = {"c_bool": "bool", "c_double": "float", "c_char": "str"}
EXTRA = {
    "HLI_CONTOUR_LOOKAHEAD_RESPONSE": (
        "def as_array(self) -> np.ndarray[Any, Any]: ...",
    ),
    "HLI_EXT_VAR": (
        "def __getitem__(self, index: int) -> int: ...",
        "def __setitem__(self, index: int, value: int) -> None: ...",
    ),
}
LINK = re.compile(r"\[([^]]*)\]\([^)]*\)")


def stub() -> str:
    """The text of ``hli/structures.pyi``."""
    return "\n".join([HEAD, *map(class_of, layout.structures())])


def class_of(structure: Any) -> str:
    purpose, said = described_members()[structure.__name__]
    lines = [f"class {structure.__name__}(View):"]
    lines += [*indented(docstring(meaning("", "", purpose))), ""]
    fields = dict(structure._fields_)
    for name, ctype in fields.items():
        if not name.startswith("fill_"):
            lines.append(f"    {name}: {type_of(ctype)}")
            lines += indented(docstring(meaning(*said[name])))
    for alias, target in view.aliases_of(structure):
        lines.append(f"    {alias}: {type_of(fields[target])}")
        lines += indented(docstring(f"Alias of ``{target}``."))
    lines += indented(EXTRA.get(structure.__name__, ()))
    return "\n".join([*lines, ""])


def type_of(ctype: Any) -> str:
    """The Python type of a member."""
    base, dimensions = layout.element_type(ctype)
    if layout.is_string(base):
        name = "str"
    elif issubclass(base, layout.Structure):
        name = base.__name__
        return f"ViewArray[{name}]" if dimensions else name
    else:
        name = KINDS.get(base.__name__, "int")
    for _ in dimensions:
        name = f"ArrayView[{name}]"
    return name


def meaning(unit: str, writer: str, said: str) -> str:
    parts = [LINK.sub(r"\1", said).replace("`", "``")]
    parts += [f"unit: {unit}"] if unit else []
    parts += [f"written by: {writer}"] if writer else []
    text = "; ".join(part for part in parts if part)
    return f"{text[0].upper()}{text[1:]}."


def docstring(text: str) -> list[str]:
    lines = textwrap.wrap(text, 70)
    if len(lines) == 1:
        return [f'"""{text}"""']
    return [f'"""{lines[0]}', *lines[1:], '"""']


def indented(lines: Any) -> Iterator[str]:
    return (f"    {line}" for line in lines)
