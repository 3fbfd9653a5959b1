"""TwinCAT's files: TcPOU, TcDUT, TcGVL, TcIO and the project that lists them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

from ..errors import FILE, Log, Origin, Problem, StopHere, refuse
from .text import clean
from .units import Unit, split

_FOREIGN = ("NWL", "LD", "FBD", "SFC", "CFC", "IL")


@dataclass
class Element:
    """One XML element with the line at which its text begins."""

    name: str
    attributes: dict[str, str]
    text: str = ""
    line: int = 0
    begin: int = 0
    children: list[Element] = field(default_factory=list)

    def child(self, name: str) -> Element | None:
        """The first child of a name."""
        return next((c for c in self.children if c.name == name), None)

    def all(self, name: str) -> list[Element]:
        """All children of a name."""
        return [c for c in self.children if c.name == name]


class _Reader:
    """Expat's events to elements; names lose their namespace."""

    def __init__(self) -> None:
        self.root: Element | None = None
        self._open: list[Element] = []
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text
        self._parser.buffer_text = False

    def read(self, text: str) -> Element:
        # A source is never trusted: entities stay undefined.
        self._parser.EntityDeclHandler = _no_entities
        self._parser.Parse(text.encode("utf-8"), True)
        assert self.root is not None
        return self.root

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        element = Element(name.rpartition(":")[2], attributes)
        element.begin = self._parser.CurrentLineNumber
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)

    def _end(self, _: str) -> None:
        self._open.pop()

    def _text(self, data: str) -> None:
        element = self._open[-1]
        if not element.text.strip() and data.strip():
            element.text = ""
            element.line = self._parser.CurrentLineNumber
        element.text += data


def _no_entities(*_: Any) -> None:
    raise expat.ExpatError("entities are not allowed")


def read_xml(name: str, text: str, log: Log) -> Element | None:
    """The root of a text; an error goes to the log."""
    body = re.sub(r'encoding="[^"]*"', 'encoding="utf-8"', text, count=1)
    try:
        return _Reader().read(body)
    except expat.ExpatError as error:
        line = getattr(error, "lineno", 1)
        column = getattr(error, "offset", 0) + 1
        problem = Problem(FILE, f"no XML: {error}", name, line, column)
        log.errors.append(problem)
        return None


class _Texts:
    """Makes units of elements of one file."""

    def __init__(
        self,
        name: str,
        text: str,
        log: Log,
        defines: Iterable[str],
        declared: frozenset[str],
    ) -> None:
        self.origin = Origin(name, tuple(text.split("\n")))
        self.log = log
        self._defines, self._declared = tuple(defines), declared

    def unit(
        self, kind: str, element: Element | None, role: str
    ) -> Unit | None:
        """The clean text of an element."""
        if element is None:
            return None
        try:
            found = clean(element.text, self._defines, self._declared)
        except StopHere as stop:
            line, column = stop.pos
            moved = (line + element.line - 1, column)
            stop = StopHere(stop.code, stop.text, moved)
            self.log.error(self.origin, stop)
            return None
        unit = Unit(kind, found.text, self.origin, max(element.line, 1))
        unit.attributes, unit.role = found.attributes, role
        return unit

    def pou(self, element: Element, kind: str = "head") -> Unit | None:
        """Declaration, body and children of a POU, method or action."""
        role = element.name
        head = self.unit(kind, element.child("Declaration"), role)
        if head is None and element.name == "Action":
            name = element.attributes.get("Name", "Action")
            head = Unit("head", f"ACTION {name}:", self.origin, 1)
            head.role = role
        if head is None:
            return None
        head.body = self._body(element)
        for child in element.children:
            if child.name in ("Method", "Action"):
                self._child(head, self.pou(child))
            elif child.name == "Property":
                self._child(head, self._property(child))
        return head

    def _child(self, head: Unit, found: Unit | None) -> None:
        if found is not None:
            head.children.append(found)

    def _body(self, element: Element) -> Unit | None:
        implementation = element.child("Implementation")
        if implementation is None:
            return None
        for name in _FOREIGN:
            foreign = implementation.child(name)
            if foreign is not None:
                pou = element.attributes.get("Name", "")
                place = (foreign.begin, 1)
                problem = refuse(f"a body in {name}", place)
                self.log.error(self.origin, problem, pou)
                return None
        return self.unit("body", implementation.child("ST"), "body")

    def _property(self, element: Element) -> Unit | None:
        head = self.unit("head", element.child("Declaration"), "Property")
        if head is None:
            return None
        for name in ("Get", "Set"):
            child = element.child(name)
            if child is None:
                continue
            accessor = self.unit("accessor", child.child("Declaration"), name)
            if accessor is None:
                accessor = Unit("accessor", "", self.origin, 1, role=name)
            accessor.body = self._body(child)
            accessor.role = name
            head.children.append(accessor)
        return head


def twincat_units(
    name: str,
    text: str,
    log: Log,
    defines: Iterable[str],
    declared: frozenset[str],
) -> list[Unit]:
    """The units of a TwinCAT object."""
    root = read_xml(name, text, log)
    if root is None:
        return []
    texts = _Texts(name, text, log, defines, declared)
    found: list[Unit] = []
    for element in root.children:
        if element.name in ("POU", "Itf"):
            unit = texts.pou(element)
            if unit is not None:
                found.append(unit)
        elif element.name in ("DUT", "GVL"):
            found += _declarations(texts, element)
    return found


def _declarations(texts: _Texts, element: Element) -> list[Unit]:
    """Types and lists of globals: whole units in the declaration."""
    unit = texts.unit("unit", element.child("Declaration"), element.name)
    if unit is None:
        return []
    cleaned = clean(unit.text)
    cleaned.attributes = list(unit.attributes)
    padding = "\n" * (unit.line - 1)
    cleaned.text = padding + unit.text
    for attribute in cleaned.attributes:
        object.__setattr__(attribute, "line", attribute.line + unit.line - 1)
    found = split(cleaned, texts.origin, texts.log)
    for part in found:
        part.namespace = element.attributes.get("Name", "")
        if element.name == "GVL":
            part.attributes = list(unit.attributes)
    return found


def project_files(path: Path, log: Log) -> list[Path]:
    """The files a .plcproj compiles, in its order."""
    root = read_xml(str(path), path.read_text("utf-8-sig"), log)
    if root is None:
        return []
    names = []
    for group in root.all("ItemGroup"):
        for item in group.all("Compile"):
            names.append(item.attributes.get("Include", ""))  # noqa: PERF401
    found = []
    for name in names:
        file = path.parent / name.replace("\\", "/")
        if file.suffix.lower() not in (
            ".tcpou",
            ".tcdut",
            ".tcgvl",
            ".tcio",
            ".st",
        ):
            continue
        if not file.is_file():
            text = f"{name} of the project is not there"
            log.errors.append(Problem(FILE, text, str(path)))
            continue
        found.append(file)
    return found


def task_files(path: Path) -> list[Path]:
    """The .TcTTO files beside a project: its tasks."""
    folder = path if path.is_dir() else path.parent
    return sorted(p for p in folder.rglob("*") if p.suffix.lower() == ".tctto")
