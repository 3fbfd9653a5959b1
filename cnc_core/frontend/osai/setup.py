"""Setup files: lines ``(CODE, p1, p2, ...)`` to validated records.

The text is read once when ``(HSM,file)`` names it; ``SetupFile.resolve`` makes
the records, at every G61 anew, because fields may be E and L variables.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from cnc_core.errors import CncError, Place
from cnc_core.files import Folders
from cnc_core.frontend.base.guess import guess
from cnc_core.frontend.base.source import Source
from cnc_core.frontend.osai import codes
from cnc_core.frontend.osai.codes import CODES, Field
from cnc_core.frontend.osai.variables import FIELD

LINE = re.compile(r"\s*\(\s*([A-Za-z0-9]+)\s*(,.*)?\)\s*$")
NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?$")
LINES_MAX = 1000
VALUE_MAX = 1e12
VARIABLE_DIGITS = 6
SHOWN = 40

Value = float | str | None
Variables = Callable[[str, int], float]


@dataclass
class Record:
    """One line with its values by field name."""

    code: str
    values: dict[str, Value]
    place: Place
    columns: dict[str, int] = field(default_factory=dict)

    def number(self, name: str) -> float:
        value = self.values[name]
        assert isinstance(value, float)
        return value

    def maybe(self, name: str) -> float | None:
        value = self.values[name]
        assert not isinstance(value, str)
        return value

    def word(self, name: str) -> str:
        value = self.values[name]
        assert isinstance(value, str)
        return value

    def fail(self, code: int, text: str, name: str = "") -> CncError:
        """An error at a field of the record."""
        place = self.place
        column = self.columns.get(name, place.column)
        return CncError(
            code, text, Place(place.file, place.line, column, place.source)
        )

    def printed(self) -> str:
        """The record as a setup line, every default in its place."""
        return f"({','.join([self.code, *(_printed(v) for v in self.values.values())])})"


def _printed(value: Value) -> str:
    return (
        ""
        if value is None
        else value
        if isinstance(value, str)
        else f"{value:.12g}"
    )


@dataclass
class SetupLine:
    """``fields``: text and column of each field."""

    code: str
    fields: list[tuple[str, int]]
    place: Place


class Records:
    """All records of a setup: general codes by name, axis codes by name and axis."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.general: dict[str, Record] = {}
        self.axes: dict[str, dict[str, Record]] = {
            code: {} for code in codes.PER_AXIS
        }
        self.order: list[Record] = []

    def add(self, record: Record) -> None:
        self.order.append(record)
        if record.code not in codes.PER_AXIS:
            if record.code in self.general:
                raise record.fail(909206, f"{record.code} twice in one setup")
            self.general[record.code] = record
            return
        name = record.word("Name")
        table = self.axes[record.code]
        if name in table:
            raise record.fail(
                909206, f"{record.code} twice for axis {name}", "Name"
            )
        table[name] = record

    def get(self, code: str) -> Record:
        """A general record, or one of its defaults."""
        if code in self.general:
            return self.general[code]
        return Record(code, dict(DEFAULTS[code]), Place(str(self.path)))

    def scaled(self, unit_mm: float, rotary: frozenset[str]) -> Records:
        """The same with every length in mm; ``rotary``: axes whose own unit is
        the degree.
        """
        if unit_mm == 1.0:
            return self
        out = Records(self.path)
        for record in self.order:
            own = record.code in codes.OWN_UNIT
            if own and record.word("Name") in rotary:
                out.add(record)
                continue
            values = dict(record.values)
            for spec in CODES[record.code]:
                value = values[spec.name]
                if spec.length and isinstance(value, float):
                    values[spec.name] = value * unit_mm
            out.add(replace(record, values=values))
        return out

    def missing(self, text: str, code: int = 909207) -> CncError:
        return CncError(code, text, Place(str(self.path), 1, 1))

    def as_json(self) -> dict[str, Any]:
        """What ``check`` prints: the codes with every value in its place."""
        return {
            "file": str(self.path),
            "codes": [
                {"code": r.code, "line": r.place.line, **r.values}
                for r in self.order
            ],
            "printed": [r.printed() for r in self.order],
        }


DEFAULTS: dict[str, dict[str, Value]] = {
    "JRK": {
        "Mode": "ENA",
        "Jrs": None,
        "Entities": 0.0,
        "Tstab": 0.0,
        "Tintgr": 0.0,
        "Ttop": 0.0,
    },
    "TOL": {
        "Len": None,
        "Radius": None,
        "EdgeRad": 0.0,
        "Angle": -90.0,
        "OriginLen": 0.0,
    },
    "TOD": {"Xcomp": 0.0, "Ycomp": 0.0, "Zcomp": 1.0},
    "CRV": {"Len": 0.0, "Ratio": 0.0, "Mode": "G63"},
    "EDG": {"Angle": 0.0, "VAngle": 0.0, "Mode": "G66", "Acc": 1.0},
    "SMS": {f.name: f.default for f in CODES["SMS"]},
}


class SetupFile:
    """The lines of one file; CncError for the first line that is none."""

    def __init__(self, path: Path, folders: Folders | None = None) -> None:
        self.path = path
        self.errors: list[CncError] = []
        self.lines: list[SetupLine] = []
        source = Source(path, folders=folders)
        try:
            self._read(source)
        finally:
            source.close()

    def _read(self, source: Source) -> None:
        number = 0
        while (text := source.line()) is not None:
            number += 1
            if number > LINES_MAX:
                raise CncError(
                    909202,
                    f"more than {LINES_MAX} lines",
                    Place(str(self.path), number, 1, text[:80]),
                )
            try:
                line = self._line(text, Place(str(self.path), number, 1, text))
            except CncError as error:
                self.errors.append(error)
                continue
            if line:
                self.lines.append(line)

    def _line(self, text: str, place: Place) -> SetupLine | None:
        plain = text.partition(";")[0]
        if not plain.strip():
            return None
        found = LINE.match(plain)
        if not found:
            raise CncError(
                909202, "a setup line has the form (CODE,field,...)", place
            )
        code = found[1]
        if code not in CODES:
            place.column = found.start(1) + 1
            raise CncError(
                909203, f"unknown setup code {code}{guess(code, CODES)}", place
            )
        fields, at = [], found.start(2) + 1
        for part in found[2][1:].split(",") if found[2] else []:
            fields.append(
                (
                    "".join(part.split()),
                    at + len(part) - len(part.lstrip()) + 1,
                )
            )
            at += len(part) + 1
        return SetupLine(code, fields, place)

    def variables(self) -> list[tuple[str, int, Place]]:
        """Letter, number and place of every variable that a field names."""
        found = []
        for line in self.lines:
            for text, column in line.fields:
                if (named := FIELD.match(text)) and len(
                    named[3]
                ) <= VARIABLE_DIGITS:
                    place = Place(
                        line.place.file,
                        line.place.line,
                        column,
                        line.place.source,
                    )
                    found.append((named[2], int(named[3]), place))
        return found

    def resolve(self, variables: Variables) -> tuple[Records, list[CncError]]:
        """The records with the variables' values of now, and every error found."""
        records, errors = Records(self.path), list(self.errors)
        for line in self.lines:
            try:
                records.add(_record(line, variables))
            except CncError as error:
                errors.append(error)
        return records, errors


def _record(line: SetupLine, variables: Variables) -> Record:
    spec = CODES[line.code]
    while len(line.fields) > len(spec) and not line.fields[-1][0]:
        line.fields.pop()
    if len(line.fields) > len(spec):
        column = line.fields[len(spec)][1]
        raise _error(
            line,
            909202,
            f"{line.code} has {len(spec)} fields, not {len(line.fields)}",
            column,
        )
    record = Record(line.code, {}, line.place)
    for i, field_ in enumerate(spec):
        text, column = (
            line.fields[i]
            if i < len(line.fields)
            else ("", len(line.place.source.partition(";")[0].rstrip()))
        )
        record.columns[field_.name] = column
        record.values[field_.name] = _value(
            line, field_, text, column, variables
        )
    return record


def _value(
    line: SetupLine, spec: Field, text: str, column: int, variables: Variables
) -> Value:
    what = f"{line.code}, {spec.name}"
    if not text:
        if not spec.optional:
            raise _error(line, 909204, f"{what}: a value is obligatory", column)
        return spec.default
    if spec.letter:
        if len(text) != 1 or not (text.isascii() and text.isalpha()):
            raise _error(
                line,
                909205,
                f"{what}: {text[:SHOWN]!r} is no axis name",
                column,
            )
        return text
    if spec.words:
        if text not in spec.words:
            raise _error(
                line,
                909205,
                f"{what}: {text[:SHOWN]!r} is none of {', '.join(spec.words)}"
                + guess(text, spec.words),
                column,
            )
        return text
    return _checked(
        line, spec, _number(line, text, what, column, variables), column
    )


def _number(
    line: SetupLine, text: str, what: str, column: int, variables: Variables
) -> float:
    variable = FIELD.match(text)
    if variable:
        if len(variable[3]) > VARIABLE_DIGITS:
            raise _error(
                line, 909205, f"{what}: there is no such variable", column
            )
        return (-1.0 if variable[1] == "-" else 1.0) * variables(
            variable[2], int(variable[3])
        )
    if not NUMBER.match(text):
        raise _error(
            line,
            909205,
            f"{what}: {text[:SHOWN]!r} is neither a number nor an E or L variable",
            column,
        )
    return float(text)


def _checked(line: SetupLine, spec: Field, value: float, column: int) -> float:
    what = f"{line.code}, {spec.name}"
    if not abs(value) <= VALUE_MAX:
        raise _error(
            line,
            909205,
            f"{what}: the number is out of range, {VALUE_MAX:g} at most",
            column,
        )
    if spec.whole and value != int(value):
        raise _error(
            line, 909205, f"{what}: {value:g} is no whole number", column
        )
    if not spec.low <= value <= spec.high:
        raise _error(
            line,
            909205,
            f"{what}: {value:g} lies outside {spec.low:g}..{spec.high:g}",
            column,
        )
    return value


def _error(line: SetupLine, code: int, text: str, column: int) -> CncError:
    place = line.place
    return CncError(
        code, text, Place(place.file, place.line, column, place.source)
    )
