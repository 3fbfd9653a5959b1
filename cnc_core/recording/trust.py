"""Whether a file of a stranger can be the recording that it says it is.

Readers take the account's shape and the columns' types for granted.  So both are
looked at once, when a file is opened.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from .npz_member import KINDS
from .schema import COLUMNS
from .source import Source, not_a_recording

_UDINT = Annotated[int, Field(ge=0, lt=1 << 32)]
_STRICT = ConfigDict(strict=True, extra="allow")


class _Axis(BaseModel):
    model_config = _STRICT
    kind: str
    v_max: float = 0.0
    a_max: float = 0.0
    j_max: float = 0.0


class _File(BaseModel):
    """A program or a cell's file."""

    model_config = _STRICT
    file: str = ""
    text: str = ""


class _Memory(BaseModel):
    """The segment that the scans were of."""

    model_config = _STRICT
    layout: str
    channels: _UDINT
    axes: _UDINT
    generation: _UDINT
    cycle_ns: _UDINT


class _Plc(BaseModel):
    model_config = _STRICT
    args: dict[str, Any] | None = None
    inputs: dict[str, Any] = {}
    force: list[str] = []
    st: list[str] = []


class _Channel(BaseModel):
    """One channel of several."""

    model_config = _STRICT
    name: str
    axes: dict[str, _Axis]
    start: dict[str, float]
    program: _File


class _Account(BaseModel):
    """What a reader asks of the account of a recording."""

    model_config = _STRICT
    columns: dict[str, dict[str, str]] = {}
    axes: dict[str, _Axis] = {}
    start: dict[str, float] = {}
    program: _File = _File()
    cell: _File = _File()
    channels: list[_Channel] = []
    memory: _Memory | None = None
    plc: _Plc = _Plc()
    lost: dict[str, int] = {}
    clock: str = ""
    cycle_s: float = 0.0


def trusted(path: Path, source: Source) -> Source:
    """The source itself; CncError 901002 says what a recording cannot have."""
    try:
        _Account.model_validate(source.meta)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise not_a_recording(
            path, f"its account: {place}: {first['msg']}"
        ) from None
    for table, columns in source.tables.items():
        for column, kind in columns.items():
            if not _is_likely(table, column, kind):
                raise not_a_recording(
                    path, f"{table}.{column} cannot be of the type {kind}"
                )
    return source


def _is_likely(table: str, column: str, kind: str) -> bool:
    known = COLUMNS.get(table, {}).get(column)
    return kind in KINDS and (known is None or kind == known.type)
