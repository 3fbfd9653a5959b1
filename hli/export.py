"""The HLI layout in other languages: C header, IEC 61131-3 Structured Text,
JSON.

Everything is generated from ``hli.layout``; nothing here knows a byte offset of
its own.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import re
import uuid
from typing import Any

from . import layout

_C_TYPES = {
    "c_bool": "uint8_t",
    "c_ubyte": "uint8_t",
    "c_short": "int16_t",
    "c_ushort": "uint16_t",
    "c_int": "int32_t",
    "c_uint": "uint32_t",
    "c_double": "double",
    "c_ulong": "uint64_t",
    "c_long": "int64_t",
    "c_char": "char",
}
_ST_TYPES = {
    "c_bool": "BOOL",
    "c_ubyte": "BYTE",
    "c_short": "INT",
    "c_ushort": "UINT",
    "c_int": "DINT",
    "c_uint": "UDINT",
    "c_double": "LREAL",
    "c_ulong": "ULINT",
    "c_long": "LINT",
}


_ST_HEAD = """(* Generated from the hli-cosim layout. Names, types and semantics are the HLI's;
   byte offsets are this emulation's own. *)
"""
GVL_CONSTANTS, GVL_VARIABLES = "HLI_Global_Constants", "HLI_Global_Variables"
ST_RENAMED = {"date": "error_date"}
"""Members whose names are reserved words of IEC 61131-3."""
ST_CONSTANTS = {
    "HLI_INTF_M_FKT": 1,
    "HLI_INTF_H_FKT": 2,
    "HLI_INTF_SPINDEL": 3,
    "HLI_INTF_TOOL": 4,
    "HLI_AXIS_READY": 1,
    "HLI_AXIS_ACTIVE": 3,
    "HLI_AXIS_HOLD": 5,
    "HLI_AXIS_ERROR": 7,
}
"""Values a PLC program compares members with (hli_reference 4.2, 6.2).

Modes and states stand in the layout.
"""


@functools.cache
def layout_hash() -> bytes:
    """SHA-256 over ``layout.describe()``: 32 bytes, part of the segment head,
    compared on attach.
    """
    return hashlib.sha256(layout.describe().encode()).digest()


def _c_member(name: str, ctype: Any) -> str:
    if layout.is_string(ctype):
        return f"char {name}[{ctype._length_}];"
    base, dims = layout.element_type(ctype)
    base_name = (
        base.__name__
        if issubclass(base, ctypes.Structure)
        else _C_TYPES[base.__name__]
    )
    return f"{base_name} {name}" + "".join(f"[{d}]" for d in dims) + ";"


def c_header(asserts: bool = True) -> str:
    """C11 header with every structure; with ``asserts`` a ``_Static_assert``
    holds every offset and size.
    """
    out = [
        "/* Generated from hli/layout.py. Do not edit. */",
        "#ifndef HLI_LAYOUT_H",
        "#define HLI_LAYOUT_H",
    ]
    out += ["#include <stddef.h>", "#include <stdint.h>", ""]
    for name, value in layout.CONSTANTS.items():
        out.append(
            f"#define {name} {value:#x}ULL"
            if value > 0xFFFFFFFF
            else f"#define {name} {value}"
        )
    digest = ", ".join(f"0x{b:02x}" for b in layout_hash())
    out += [f"#define HLI_LAYOUT_HASH {{{digest}}}", ""]
    for cls in layout.structures():
        fields: list[tuple[str, Any]] = list(cls._fields_)  # type: ignore[arg-type]
        out.append(f"typedef struct {cls.__name__} {{")
        out += [f"    {_c_member(name, ctype)}" for name, ctype in fields]
        out.append(f"}} {cls.__name__};")
        if asserts:
            for name, _ in fields:
                offset = getattr(cls, name).offset
                member = f"{cls.__name__}, {name}"
                told = f"{cls.__name__}.{name}"
                out.append(
                    f'_Static_assert(offsetof({member}) == {offset}, "{told}");'
                )
            out.append(
                f'_Static_assert(sizeof({cls.__name__}) == {ctypes.sizeof(cls)}, "{cls.__name__}");'
            )
        out.append("")
    out.append("#endif")
    return "\n".join(out) + "\n"


def _st_member(name: str, ctype: Any) -> str:
    name = ST_RENAMED.get(name, name)
    if layout.is_string(ctype):
        return f"{name} : STRING({ctype._length_ - 1});"
    base, dims = layout.element_type(ctype)
    base_name = (
        base.__name__
        if issubclass(base, ctypes.Structure)
        else _ST_TYPES[base.__name__]
    )
    if dims:
        ranges = ", ".join(f"0..{d - 1}" for d in dims)
        base_name = f"ARRAY [{ranges}] OF {base_name}"
    return f"{name} : {base_name};"


def _public(cls: type[ctypes.Structure]) -> bool:
    return not cls.__name__.startswith(("HLI_SEGMENT", "HLI_SIDE"))


def st_constants() -> dict[str, int]:
    """What ``HLI_Global_Constants`` of a PLC program holds."""
    public = re.compile("HLI_(.*_(MAXIDX|LAENGE)|(CLAH|IMCM|AHEAD)_.*)")
    return {
        name: value
        for name, value in layout.CONSTANTS.items()
        if public.fullmatch(name)
    } | ST_CONSTANTS


def _st_structure(cls: Any) -> str:
    if cls is layout.HLI_EXT_VAR:  # gpVECh[i]^[n], as in the manual
        return f"TYPE {cls.__name__} : ARRAY [0..{layout.HLI_EXT_VAR_MAXIDX}] OF UDINT;\nEND_TYPE\n"
    members = [f"    {_st_member(name, ctype)}" for name, ctype in cls._fields_]
    return (
        "\n".join(
            [
                f"TYPE {cls.__name__} :",
                "STRUCT",
                *members,
                "END_STRUCT",
                "END_TYPE",
            ]
        )
        + "\n"
    )


def _st_constant_list() -> str:
    lines = [
        f"    {name} : UDINT := {value};"
        for name, value in st_constants().items()
    ]
    return "\n".join(["VAR_GLOBAL CONSTANT", *lines, "END_VAR"]) + "\n"


def _st_pointer_list() -> str:
    """The global pointers; NULL until the PLC library has set them."""
    words = "POINTER TO HLI_EXT_VAR"
    members = [
        "gpPform : POINTER TO HLI_PLATFORM;",
        f"gpCh : ARRAY [0..{layout.HLI_SYS_CH_MAXIDX}] OF POINTER TO HLI_CHANNEL;",
        f"gpAx : ARRAY [0..{layout.HLI_SYS_AX_MAXIDX}] OF POINTER TO HLI_AXIS;",
        f"gpVECh : ARRAY [0..{layout.HLI_SYS_CH_MAXIDX}] OF {words};",
        f"gpVEGlobal : {words};",
        f"gpAhead : ARRAY [0..{layout.HLI_AHEAD_CH_MAXIDX}] OF POINTER TO HLI_AHEAD;",
        "gNrCh : UINT;",
        "gNrAx : UINT;",
    ]
    return (
        "\n".join(["VAR_GLOBAL", *(f"    {m}" for m in members), "END_VAR"])
        + "\n"
    )


def _st_structures() -> list[Any]:
    return [cls for cls in layout.structures() if _public(cls)]


def st_types() -> str:
    """Constants, TYPE declarations and the global pointers in one text, for
    TwinCAT and CODESYS style compilers.
    """
    parts = [
        _ST_HEAD,
        _st_constant_list(),
        *map(_st_structure, _st_structures()),
        _st_pointer_list(),
    ]
    return "\n".join(parts)


def twincat_files() -> dict[str, str]:
    """The same as files of a TwinCAT 3 project (name -> content), to be added
    as existing items.
    """
    files = {
        f"{cls.__name__}.TcDUT": _tc_object(
            "DUT", cls.__name__, _st_structure(cls)
        )
        for cls in _st_structures()
    }
    for name, text in (
        (GVL_CONSTANTS, _st_constant_list()),
        (GVL_VARIABLES, _st_pointer_list()),
    ):
        files[f"{name}.TcGVL"] = _tc_object("GVL", name, text)
    return files


def _tc_object(kind: str, name: str, declaration: str) -> str:
    """The same Id for the same name: files that are written again replace the
    old ones.
    """
    identity = uuid.uuid5(uuid.NAMESPACE_URL, f"hli-cosim/{kind}/{name}")
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n<TcPlcObject Version="1.1.0.1">\n'
        f'  <{kind} Name="{name}" Id="{{{identity}}}">\n'
        f"    <Declaration><![CDATA[{declaration}]]></Declaration>\n"
        f"  </{kind}>\n</TcPlcObject>\n"
    )


def json_layout() -> dict[str, Any]:
    """Every structure with size and members (name, type, dimensions, offset,
    size), constants and hash.
    """
    structures: dict[str, Any] = {}
    for cls in layout.structures():
        members = []
        fields: list[tuple[str, Any]] = list(cls._fields_)  # type: ignore[arg-type]
        for name, ctype in fields:
            string = layout.is_string(ctype)
            base, dims = (ctype, ()) if string else layout.element_type(ctype)
            st_name = _ST_TYPES.get(base.__name__, base.__name__)
            type_name = f"STRING({ctype._length_ - 1})" if string else st_name
            members.append(
                {
                    "name": name,
                    "type": type_name,
                    "dims": list(dims),
                    "offset": getattr(cls, name).offset,
                    "size": ctypes.sizeof(ctype),
                }
            )
        structures[cls.__name__] = {
            "size": ctypes.sizeof(cls),
            "members": members,
        }
    return {
        "abi_version": layout.HLI_ABI_VERSION,
        "layout_hash": layout_hash().hex(),
        "constants": dict(layout.CONSTANTS),
        "structures": structures,
        "aliases": dict(layout.ALIASES),
    }
