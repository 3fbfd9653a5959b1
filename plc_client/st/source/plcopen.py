"""PLCopen XML: POUs with bodies in ST; declarations are written back as text."""

from __future__ import annotations

from collections.abc import Iterable
from xml.sax.saxutils import unescape

from ..errors import Log, Origin, Problem
from .text import clean
from .twincat import Element, read_xml
from .units import Unit, split

_SECTIONS = {
    "inputVars": "VAR_INPUT",
    "outputVars": "VAR_OUTPUT",
    "inOutVars": "VAR_IN_OUT",
    "localVars": "VAR",
    "tempVars": "VAR_TEMP",
    "externalVars": "VAR_EXTERNAL",
    "globalVars": "VAR_GLOBAL",
}
_KINDS = {
    "program": "PROGRAM",
    "function": "FUNCTION",
    "functionBlock": "FUNCTION_BLOCK",
}
_STRINGS = {"string": "STRING", "wstring": "WSTRING"}


def plcopen_units(
    name: str,
    text: str,
    log: Log,
    defines: Iterable[str],
    declared: frozenset[str],
) -> list[Unit]:
    """The units of a PLCopen project."""
    root = read_xml(name, text, log)
    if root is None:
        return []
    lines = text.split("\n")
    writer = _Writer(name, log)
    types = _path(root, "types")
    if types is not None:
        for group in types.children:
            for element in group.children:
                writer.take(element)
    for element in _globals(root):
        writer.globals(element)
    found: list[Unit] = []
    for part, line, namespace in writer.parts:
        shown = Origin(name, tuple(lines))
        cleaned = clean(part, defines, declared)
        cleaned.text = "\n" * max(line - 1, 0) + cleaned.text
        units = split(cleaned, shown, log)
        for unit in units:
            unit.namespace = namespace
        found += units
    return found


def _path(root: Element, name: str) -> Element | None:
    return root.child(name)


def _globals(element: Element) -> list[Element]:
    found = element.all("globalVars")
    for child in element.children:
        if child.name != "types":
            found += _globals(child)
    return found


class _Writer:
    """Elements to ST text with the line their body begins at."""

    def __init__(self, file: str, log: Log) -> None:
        self._file, self._log = file, log
        self.parts: list[tuple[str, int, str]] = []

    def take(self, element: Element) -> None:
        """One data type or POU."""
        if element.name == "dataType":
            base = element.child("baseType")
            if base is not None and base.children:
                name = element.attributes["name"]
                init = self._initial(element)
                text = f"TYPE {name} : {self._type(base.children[0])}{init};"
                self.parts.append((text + " END_TYPE", 1, ""))
        elif element.name == "pou":
            self._pou(element)

    def globals(self, element: Element) -> None:
        """One list of global variables."""
        name = element.attributes.get("name", "Globals")
        text = self._section(element)
        self.parts.append((text, 1, name))

    def _pou(self, element: Element) -> None:
        name = element.attributes["name"]
        kind = _KINDS.get(element.attributes.get("pouType", ""), "")
        body = element.child("body")
        code = body.child("ST") if body is not None else None
        if not kind or code is None:
            what = body.children[0].name if body and body.children else "empty"
            text = f"a body in {what} is not supported; only ST is"
            problem = Problem(952007, text, self._file, 1, 1, "", name, what)
            self._log.errors.append(problem)
            return
        inner = _deepest(code)
        head = f"{kind} {name}{self._result(element)} "
        sections = self._sections(element)
        lines = inner.text
        line = max(inner.line, 1)
        text = f"{head}{sections} {unescape(lines)}\nEND_{kind}"
        self.parts.append((text, line, ""))

    def _result(self, element: Element) -> str:
        interface = element.child("interface")
        result = interface.child("returnType") if interface else None
        if result is None or not result.children:
            return ""
        return f" : {self._type(result.children[0])}"

    def _sections(self, element: Element) -> str:
        interface = element.child("interface")
        if interface is None:
            return ""
        known = [c for c in interface.children if c.name in _SECTIONS]
        return " ".join(self._section(c) for c in known)

    def _section(self, element: Element) -> str:
        words = [_SECTIONS[element.name]]
        for attribute in ("constant", "retain", "persistent"):
            if element.attributes.get(attribute) == "true":
                words.append(attribute.upper())  # noqa: PERF401
        rows = [self._variable(v) for v in element.all("variable")]
        return f"{' '.join(words)} {' '.join(rows)} END_VAR"

    def _variable(self, element: Element) -> str:
        kind = element.child("type")
        written = self._type(kind.children[0]) if kind else "INT"
        address = element.attributes.get("address", "")
        where = f" AT {address}" if address else ""
        name = element.attributes["name"]
        return f"{name}{where} : {written}{self._initial(element)};"

    def _initial(self, element: Element) -> str:
        value = element.child("initialValue")
        if value is None or not value.children:
            return ""
        return f" := {self._value(value.children[0])}"

    def _value(self, element: Element) -> str:
        if element.name == "simpleValue":
            return element.attributes.get("value", "0")
        inner = []
        for value in element.children:
            text = self._value(value.children[0]) if value.children else ""
            member = value.attributes.get("member")
            times = value.attributes.get("repetitionValue")
            if member:
                text = f"{member} := {text}"
            inner.append(f"{times}({text})" if times else text)
        joined = ", ".join(inner)
        return f"[{joined}]" if element.name == "arrayValue" else f"({joined})"

    def _type(self, element: Element) -> str:  # noqa: PLR0911
        name, attributes = element.name, element.attributes
        if name == "derived":
            return attributes["name"]
        if name in _STRINGS:
            length = attributes.get("length")
            return _STRINGS[name] + (f"({length})" if length else "")
        if name == "array":
            return self._array(element)
        if name == "pointer":
            inner = element.child("baseType")
            assert inner is not None
            return f"POINTER TO {self._type(inner.children[0])}"
        if name == "struct":
            rows = [self._variable(v) for v in element.all("variable")]
            return f"STRUCT {' '.join(rows)} END_STRUCT"
        if name == "enum":
            return self._enum(element)
        return name

    def _array(self, element: Element) -> str:
        dims = [
            f"{d.attributes['lower']}..{d.attributes['upper']}"
            for d in element.all("dimension")
        ]
        base = element.child("baseType")
        assert base is not None
        return f"ARRAY [{', '.join(dims)}] OF {self._type(base.children[0])}"

    def _enum(self, element: Element) -> str:
        values = element.child("values")
        rows = []
        for value in values.all("value") if values else []:
            number = value.attributes.get("value")
            name = value.attributes["name"]
            rows.append(f"{name} := {number}" if number else name)
        return f"({', '.join(rows)})"


def _deepest(element: Element) -> Element:
    """``<ST><xhtml>text</xhtml></ST>``: the element that holds the text."""
    while element.children and not element.text.strip():
        element = element.children[0]
    return element
