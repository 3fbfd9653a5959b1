"""Symbol paths as TwinCAT and CODESYS write them, resolved to the memory
itself.

``HLI_Global_Variables.gpCh[0]^.bahn_state.dist_prog_start`` and
``hli.gpCh[0].bahn_state.dist_prog_start`` are the same eight bytes.  The
namespace in front, the ``^`` behind a pointer and the case of letters are
optional; an index may be a number or a constant
(``HLI_Global_Constants.HLI_SYS_CH_MAXIDX``).
"""

from __future__ import annotations

import ctypes
import difflib
import re
from typing import Any

from . import layout
from .view import ArrayView, Pointers, View

NAMESPACES = ("HLI_GLOBAL_VARIABLES", "HLI_GLOBAL_CONSTANTS")
_TOKEN = re.compile(
    r"\s*(?:(?P<name>[A-Za-z_]\w*)|(?P<index>\[[^\[\]]*\])|(?P<deref>\^)|(?P<dot>\.))"
)
_POINTERS = (
    "gpPform",
    "gpCh",
    "gpAx",
    "gpVECh",
    "gpVEGlobal",
    "gpAhead",
    "gNrCh",
    "gNrAx",
)


class SymbolError(ValueError):
    """A path that names nothing; the text says where it stops and what there
    would be.
    """


class Symbol:
    """One variable: ``value`` reads and writes it.  ``path`` is the path in its
    canonical spelling.
    """

    __slots__ = ("_holder", "_key", "path")

    def __init__(self, path: str, holder: Any, key: str | int) -> None:
        self.path = path
        self._holder = holder
        self._key = key

    @property
    def value(self) -> Any:
        """The value now; a structure or array gives its view."""
        if isinstance(self._key, int):
            return self._holder[self._key]
        return getattr(self._holder, self._key)

    @value.setter
    def value(self, value: Any) -> None:
        if isinstance(self._key, int):
            self._holder[self._key] = value
        else:
            setattr(self._holder, self._key, value)

    @property
    def memory(self) -> tuple[int, Any] | None:
        """Address and ctypes type of a number of the memory; None: this is a
        part, a text, or a variable of a task.
        """
        holder, key = self._holder, self._key
        if isinstance(holder, ArrayView) and holder._check is not None:
            kind = holder._a._type_
            begin = ctypes.addressof(holder._a)
            return begin + int(key) * ctypes.sizeof(kind), kind
        if not isinstance(holder, View):
            return None
        members: dict[str, Any] = dict(holder._structure._fields_)  # type: ignore[arg-type]
        kind = members[str(key)]
        if not issubclass(kind, ctypes._SimpleCData):
            return None
        return holder._address + getattr(
            holder._structure, str(key)
        ).offset, kind

    def __repr__(self) -> str:
        return f"<Symbol {self.path} = {self.value!r}>"


def tokens(path: str) -> list[str]:
    """Names and indices ("[3]") of a path; dereferences and dots are dropped.
    Raises SymbolError.
    """
    found, at = [], 0
    text = path.strip().removeprefix(".")
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise SymbolError(
                f"symbol {path!r}: {text[at:]!r} is not understood"
            )
        found += [part for part in (match["name"], match["index"]) if part]
        at = match.end()
    if not found or found[0].startswith("["):
        raise SymbolError(f"symbol {path!r}: a name is needed")
    return found


def index_of(path: str, token: str) -> int:
    """The number of "[3]" or "[HLI_SYS_CH_MAXIDX]"."""
    text = token[1:-1].strip().rpartition(".")[2]
    if text.isdigit():
        return int(text)
    value = {
        name.upper(): number for name, number in layout.CONSTANTS.items()
    }.get(text.upper())
    if value is None:
        raise SymbolError(
            f"symbol {path!r}: index {token} is neither a number nor a constant"
        )
    return value


def resolve(areas: Any, path: str) -> Symbol:
    """The symbol behind a path, from ``Areas`` (any connection).

    Raises SymbolError.
    """
    parts = tokens(path)
    if parts[0].upper() in NAMESPACES and len(parts) > 1:
        parts = parts[1:]
    name = _match(path, parts[0], _POINTERS)
    spelled = f"HLI_Global_Variables.{name}"
    holder, key = areas, name
    for part in parts[1:]:
        holder, key, step = _step(
            path, getattr_or_item(holder, key), part, spelled
        )
        spelled += step
    return Symbol(spelled, holder, key)


def getattr_or_item(holder: Any, key: str | int | tuple[int, ...]) -> Any:
    """One step down; several numbers: an array of several dimensions."""
    if isinstance(holder, Pointers) and isinstance(key, int):
        return holder[key : key + 1][0]  # None where it is not configured
    if isinstance(key, str):
        return getattr(holder, key)
    return holder[key]


def _step(
    path: str, value: Any, part: str, spelled: str
) -> tuple[Any, Any, str]:
    if part.startswith("["):
        return _index(path, value, part, spelled)
    if value is None:
        raise SymbolError(
            f"symbol {path!r}: {spelled} is not configured (its pointer is NULL)"
        )
    if not isinstance(value, View):
        raise SymbolError(f"symbol {path!r}: {spelled} has no members")
    arrow = "^" if spelled.count(".") == 1 else ""
    name = _match(path, part, value._names)
    return value, name, f"{arrow}.{name}"


def _index(
    path: str, value: Any, part: str, spelled: str
) -> tuple[Any, Any, str]:
    # HLI_EXT_VAR: an ARRAY OF UDINT by itself
    if isinstance(value, View) and hasattr(type(value), "value"):
        value = getattr(value, "value")  # noqa: B009
    if not isinstance(value, (tuple, ArrayView)):
        raise SymbolError(f"symbol {path!r}: {spelled} is no array")
    index = index_of(path, part)
    if not 0 <= index < len(value):
        raise SymbolError(
            f"symbol {path!r}: {spelled}[{index}]: the index runs 0..{len(value) - 1}"
        )
    return value, index, f"[{index}]"


def _match(path: str, name: str, names: tuple[str, ...]) -> str:
    if name in names:
        return name
    by_upper = {n.upper(): n for n in names}
    found = by_upper.get(name.upper())
    if found is None:
        near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
        hint = (
            f"; did you mean {near[0]}?"
            if near
            else f"; known: {', '.join(names)}"
        )
        raise SymbolError(f"symbol {path!r}: {name} is unknown{hint}")
    return found
