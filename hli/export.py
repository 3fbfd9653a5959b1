"""The HLI layout in other languages: C header, IEC 61131-3 Structured Text, JSON.

Everything is generated from ``hli.layout``; nothing here knows a byte offset of its own.
"""

from __future__ import annotations

import ctypes
import hashlib
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


def layout_hash() -> bytes:
    """SHA-256 over ``layout.describe()``: 32 bytes, part of the segment head, compared on attach."""
    return hashlib.sha256(layout.describe().encode()).digest()


def _c_member(name: str, ctype: Any) -> str:
    if layout.is_string(ctype):
        return f"char {name}[{ctype._length_}];"
    base, dims = layout.element_type(ctype)
    base_name = base.__name__ if issubclass(base, ctypes.Structure) else _C_TYPES[base.__name__]
    return f"{base_name} {name}" + "".join(f"[{d}]" for d in dims) + ";"


def c_header(asserts: bool = True) -> str:
    """C11 header with every structure; with ``asserts`` a ``_Static_assert`` holds every offset and size."""
    out = ["/* Generated from hli/layout.py. Do not edit. */", "#ifndef HLI_LAYOUT_H", "#define HLI_LAYOUT_H"]
    out += ["#include <stddef.h>", "#include <stdint.h>", ""]
    for name, value in layout.CONSTANTS.items():
        out.append(f"#define {name} {value:#x}ULL" if value > 0xFFFFFFFF else f"#define {name} {value}")
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
                out.append(f'_Static_assert(offsetof({cls.__name__}, {name}) == {offset}, "{cls.__name__}.{name}");')
            out.append(f'_Static_assert(sizeof({cls.__name__}) == {ctypes.sizeof(cls)}, "{cls.__name__}");')
        out.append("")
    out.append("#endif")
    return "\n".join(out) + "\n"


def _st_member(name: str, ctype: Any) -> str:
    if layout.is_string(ctype):
        return f"{name} : STRING({ctype._length_ - 1});"
    base, dims = layout.element_type(ctype)
    base_name = base.__name__ if issubclass(base, ctypes.Structure) else _ST_TYPES[base.__name__]
    if dims:
        ranges = ", ".join(f"0..{d - 1}" for d in dims)
        base_name = f"ARRAY [{ranges}] OF {base_name}"
    return f"{name} : {base_name};"


def _public(cls: type[ctypes.Structure]) -> bool:
    return not cls.__name__.startswith(("HLI_SEGMENT", "HLI_SIDE"))


def st_types() -> str:
    """TYPE declarations and the global pointers, for TwinCAT and CODESYS style compilers."""
    out = ["(* Generated from the hli-cosim layout. Names, types and semantics are the HLI's;"]
    out += ["   byte offsets are this emulation's own. *)", ""]
    out.append("VAR_GLOBAL CONSTANT")
    for name, value in layout.CONSTANTS.items():
        if name.endswith(("_MAXIDX", "_LAENGE")) or name.startswith("HLI_CLAH_"):
            out.append(f"    {name} : UDINT := {value};")
    out += ["END_VAR", ""]
    for cls in layout.structures():
        if not _public(cls):
            continue
        out += [f"TYPE {cls.__name__} :", "STRUCT"]
        out += [f"    {_st_member(name, ctype)}" for name, ctype in cls._fields_]  # type: ignore[misc]
        out += ["END_STRUCT", "END_TYPE", ""]
    out += ["VAR_GLOBAL", "    gpPform : POINTER TO HLI_PLATFORM;"]
    out.append(f"    gpCh : ARRAY [0..{layout.HLI_SYS_CH_MAXIDX}] OF POINTER TO HLI_CHANNEL;")
    out.append(f"    gpAx : ARRAY [0..{layout.HLI_SYS_AX_MAXIDX}] OF POINTER TO HLI_AXIS;")
    out.append(f"    gpVECh : ARRAY [0..{layout.HLI_SYS_CH_MAXIDX}] OF POINTER TO HLI_EXT_VAR;")
    out += ["    gpVEGlobal : POINTER TO HLI_EXT_VAR;", "    gNrCh : UINT;", "    gNrAx : UINT;", "END_VAR"]
    return "\n".join(out) + "\n"


def json_layout() -> dict[str, Any]:
    """Every structure with size and members (name, type, dimensions, offset, size), constants and hash."""
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
        structures[cls.__name__] = {"size": ctypes.sizeof(cls), "members": members}
    return {
        "abi_version": layout.HLI_ABI_VERSION,
        "layout_hash": layout_hash().hex(),
        "constants": dict(layout.CONSTANTS),
        "structures": structures,
        "aliases": dict(layout.ALIASES),
    }
