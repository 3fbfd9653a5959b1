"""Values of any type as an input ``ANY``: where the value is, its size, its class."""

from __future__ import annotations

from ..model import types
from ..model.classes import ClassType, InterfaceType
from .context import Context
from .value import Value

_ORDER = [
    "BOOL",
    "BIT",
    "BYTE",
    "WORD",
    "DWORD",
    "LWORD",
    "SINT",
    "INT",
    "DINT",
    "LINT",
    "USINT",
    "UINT",
    "UDINT",
    "ULINT",
    "REAL",
    "LREAL",
    "STRING",
    "WSTRING",
    "TIME",
    "DATE",
    "DATE_AND_TIME",
    "TIME_OF_DAY",
]
_POINTER, _REFERENCE, _SUBRANGE, _ENUM, _ARRAY, _USER = 22, 23, 24, 25, 26, 28
_LTIME = 37


_KINDS: list[tuple[type, int]] = [
    (types.Subrange, _SUBRANGE),
    (types.EnumType, _ENUM),
    (types.ArrayType, _ARRAY),
]


def class_of(type_: types.Type) -> int:
    """The number in TYPE_CLASS."""
    name = type_.name
    if isinstance(type_, types.StringType):
        name = "WSTRING" if type_.wide else "STRING"
    elif isinstance(type_, types.PointerType):
        return _REFERENCE if type_.reference else _POINTER
    elif not isinstance(type_, types.Elementary):
        found = (n for kind, n in _KINDS if isinstance(type_, kind))
        return next(found, _USER)
    return _ORDER.index(name) if name in _ORDER else _LTIME


def as_any(context: Context, value: Value) -> Value:
    """A variable is handed over by its address, all else by that of a copy."""
    type_ = value.type
    where = value.place if value.bit is None else ""
    before = ""
    if not where and type_.scalar and not isinstance(type_, InterfaceType):
        name = context.scalar(type_)
        before, where = f"{name} = {value.text}, ", f"(st_ptr)&{name}"
    elif not where or isinstance(type_, ClassType):
        where = value.place or value.text
    buffer = context.buffer(types.ANY.size)
    text = (
        f"({before}*(st_ptr *){buffer} = (st_ptr)({where}), "
        f"*(st_i32 *)({buffer} + 8) = {type_.size}, "
        f"*(st_i32 *)({buffer} + 12) = {class_of(type_)}, {buffer})"
    )
    return Value(types.ANY, text, calls=value.calls)
