"""Typed views: attribute access to the memory itself, by the manual's names.

``view_class(structure)`` builds one class per structure of ``hli.layout``: a
property per member, sub-structures as sub-views that are built once and then
stand in slots, arrays as tuples of views or as ``ArrayView``, strings as
``str``, BOOL as ``bool``.  Reading and writing go straight to the shared
memory, one member at a time and never torn; for several members that belong
together use ``hli.handshake.snapshot``.  Semaphores and the flags of the
technology units are loaded with acquire and stored with release (in C).
Members the CNC owns (``_r``) can be written too, as in the real shared memory:
nothing but the convention protects them.

Names that do not exist raise AttributeError and tell the nearest one, for
reading and for writing.  Numbers that do not fit the member raise OverflowError
with the member's name; nothing wraps silently.
"""

from __future__ import annotations

import contextlib
import ctypes
import difflib
import functools
import operator
from collections.abc import Callable, Iterator
from typing import (
    TYPE_CHECKING,
    Any,
    Generic,
    Self,
    SupportsIndex,
    TypeVar,
    overload,
)

import numpy as np

from . import layout
from ._sync import ffi, lib
from .checks import bool_checker, checker
from .errors import HliNotConfigured

_T = TypeVar("_T")
FLAG_NAMES = frozenset({"please_rw", "done_w"})
BLOCK_DTYPE = np.dtype(layout.HLI_CONTOUR_LOOKAHEAD_BLOCK)
BLOCK_FIELDS = tuple(
    name for name in BLOCK_DTYPE.names or () if not name.startswith("fill_")
)


def _is_flag(name: str) -> bool:
    return name.endswith("semaphor_rw") or name in FLAG_NAMES


class View:
    """Base of the generated views; ``_c`` is the ctypes structure over the
    memory, ``_parent`` the view around it.

    Numbers are properties over the structure's own fields.  Parts
    (sub-structures and arrays) stand in slots of their name: an access is one
    step as long as the part was built before, and ``__getattr__`` builds it at
    the first one.
    """

    __slots__ = ("__weakref__", "_c", "_parent", "_pointers")
    _c: Any
    _parent: Any  # a View, or None
    _pointers: dict[str, Any]
    _structure: type[ctypes.Structure] = ctypes.Structure
    _names: tuple[str, ...] = ()
    _writers: dict[
        str, Callable[[View, Any], None]
    ] = {}  # how a member is written
    _parts: dict[str, Callable[[View], Any]] = {}  # how a part is built

    def __init__(self, structure: Any, parent: View | None = None) -> None:
        if not isinstance(structure, self._structure):
            raise TypeError(
                f"{type(self).__name__}: {type(structure).__name__} is no"
                f" {self._structure.__name__}"
            )
        object.__setattr__(self, "_c", structure)
        object.__setattr__(self, "_parent", parent)
        object.__setattr__(self, "_pointers", {})

    @property
    def _address(self) -> int:
        return ctypes.addressof(self._c)

    def _pointer(self, offset: int = 0) -> Any:
        """cffi ``void *`` into the memory; keep the view alive as long as it is
        used.
        """
        if not 0 <= offset < ctypes.sizeof(self._c):
            raise IndexError(
                f"{type(self).__name__}: byte {offset} of"
                f" {ctypes.sizeof(self._c)}"
            )
        return ffi.cast("void *", ctypes.addressof(self._c) + offset)

    # type checkers know the members from ``structures.pyi``, and no others
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            build = self._parts.get(name)
            if build is None:
                raise AttributeError(self._unknown(name))
            part = build(self)
            object.__setattr__(self, name, part)
            return part

        def __setattr__(self, name: str, value: Any) -> None:
            write = self._writers.get(name)
            if write is None:
                raise AttributeError(self._unknown(name))
            write(self, value)

    def __delattr__(self, name: str) -> None:
        raise AttributeError(
            f"{type(self).__name__}.{name}: what lies in the memory cannot be deleted"
        )

    def _assign(self, name: str, value: Any) -> None:
        """A part as a whole: the bytes of another one of its type."""
        target, source = getattr(self._c, name), getattr(value, "_c", value)
        if not isinstance(source, type(target)):
            raise TypeError(
                f"{name} is a {type(target).__name__}; assign its members,"
                " or another one as a whole"
            )
        ctypes.memmove(
            ctypes.addressof(target),
            ctypes.addressof(source),
            ctypes.sizeof(target),
        )

    def _replace(self, name: str, part: View) -> None:
        """Let this name lead to another view (an image of the memory)."""
        object.__setattr__(self, name, part)

    def _restore(self, name: str) -> None:
        """The name leads to the memory again."""
        with contextlib.suppress(AttributeError):
            object.__delattr__(self, name)

    def _unknown(self, name: str) -> str:
        near = difflib.get_close_matches(name, self._names, n=1, cutoff=0.5)
        hint = (
            f"; did you mean {near[0]}?"
            if near
            else f"; members: {', '.join(self._names)}"
        )
        return f"{type(self).__name__} has no member {name!r}{hint}"

    def __dir__(self) -> list[str]:
        """The members, each by the one name it has in the layout."""
        more = {"as_array"} & set(vars(type(self)))
        return sorted({*self._members(), *more})

    def _members(self) -> list[str]:
        fields: list[Any] = list(self._structure._fields_)
        return [name for name, *_ in fields if not name.startswith("fill_")]

    def __repr__(self) -> str:
        """Where it stands, its type and its values; a line for each value where
        one line does not hold them.
        """
        head = f"{path_of(self)}: {type(self).__name__}"
        values = [f"{n} = {_shown(getattr(self, n))}" for n in self._members()]
        line = f"<{head}({', '.join(values)})>"
        if len(line) <= _REPR_COLUMNS:
            return line
        return "\n".join([f"<{head}", *(f"  {v}" for v in values)]) + ">"


@contextlib.contextmanager
def telling_first_use(
    view_class: type[View], part: str, told: Callable[[], None]
) -> Iterator[None]:
    """Meanwhile ``told()`` is called when a view of the class gives out this part
    for the first time: ahead of it nobody can have used it.
    """
    build = view_class._parts[part]

    def building(view: View) -> Any:
        told()
        return build(view)

    view_class._parts[part] = building
    try:
        yield
    finally:
        view_class._parts[part] = build


_REPR_COLUMNS = 80
_REPR_ITEMS = 8


def _shown(value: Any) -> str:
    """A member's value within a line."""
    if isinstance(value, View):
        return type(value).__name__
    if isinstance(value, ViewArray):
        return f"{type(value[0]).__name__} * {len(value)}"
    if not isinstance(value, ArrayView):
        return repr(value)
    if value._check is None:
        return f"{len(value)} arrays"
    items = ", ".join(map(repr, value[:_REPR_ITEMS]))
    return f"[{items}{', ..' if len(value) > _REPR_ITEMS else ''}]"


class ArrayView(Generic[_T]):
    """An array of numbers or BOOLs in the memory: index, slice reads, item
    writes with range check, ``as_array()``.
    """

    __slots__ = ("_a", "_check", "_name", "_parent")

    def __init__(self, name: str, array: Any, parent: View) -> None:
        self._name = name
        self._a = array
        self._parent = parent
        self._check = (
            checker(name, array._type_)
            if not hasattr(array._type_, "_length_")
            else None
        )

    def __len__(self) -> int:
        return len(self._a)

    def _at(self, index: int) -> int:
        if not 0 <= index < len(self._a):
            raise IndexError(
                f"{self._name}[{index}]: index runs 0..{len(self._a) - 1}"
            )
        return index

    @overload
    def __getitem__(self, index: int) -> _T: ...

    @overload
    def __getitem__(self, index: slice) -> list[_T]: ...

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return list(self._a[index])
        item = self._a[self._at(index)]
        return (
            item
            if self._check
            else ArrayView(f"{self._name}[{index}]", item, self._parent)
        )

    def __setitem__(self, index: int, value: _T) -> None:
        if self._check is None:
            raise TypeError(
                f"{self._name}[{index}] is an array; assign its elements"
            )
        self._a[self._at(index)] = self._check(value)

    def __iter__(self) -> Iterator[_T]:
        return (self[i] for i in range(len(self)))

    def as_array(self) -> np.ndarray[Any, Any]:
        """numpy array over the memory itself (no copy)."""
        return np.ctypeslib.as_array(self._a)

    def __repr__(self) -> str:
        return f"<{path_of(self)}: {_shown(self)}>"


class ViewArray(tuple[_T, ...]):
    """An array of structures as a tuple of views, with the whole as one numpy
    structured array.
    """

    _ctypes_array: Any = None

    def as_array(self) -> np.ndarray[Any, Any]:
        """numpy structured array over the memory itself (no copy)."""
        return np.frombuffer(
            self._ctypes_array, dtype=np.dtype(self._ctypes_array._type_)
        )


# properties
def _scalar(name: str, ctype: Any) -> property:
    check = checker(name, ctype)

    def write(self: Any, value: Any) -> None:
        setattr(self._c, name, check(value))

    # read without a Python function: scans read many
    return property(operator.attrgetter(f"_c.{name}"), write)


def _flag(name: str, offset: int) -> property:
    check = bool_checker(name)

    def pointer(self: Any) -> Any:
        found = self._pointers.get(name)
        if found is None:
            found = self._pointers[name] = self._pointer(offset)
        return found

    def read(self: Any) -> bool:
        return bool(lib.hs_load_u8(pointer(self)))

    def write(self: Any, value: Any) -> None:
        lib.hs_store_u8(pointer(self), check(value))

    return property(read, write)


def _string(name: str, length: int) -> property:
    def read(self: Any) -> str:
        return str(getattr(self._c, name).decode("utf-8", "replace"))

    def write(self: Any, value: str) -> None:
        data = value.encode()
        if len(data) >= length:
            raise ValueError(
                f"{name}: {len(data)} bytes do not fit STRING({length - 1})"
            )
        setattr(self._c, name, data)

    return property(read, write)


def _part(name: str, ctype: Any) -> Callable[[View], Any] | None:
    """How the part of this name is built from the view around it; None: a
    single number, flag or text.
    """
    build: Callable[[Any, View], Any]
    if layout.is_string(ctype):
        return None
    if isinstance(ctype, type) and issubclass(ctype, ctypes.Structure):
        build = view_class(ctype)
    elif not hasattr(ctype, "_length_"):
        return None
    elif isinstance(ctype._type_, type) and issubclass(
        ctype._type_, ctypes.Structure
    ):
        build = _view_array
    else:
        build = functools.partial(ArrayView, name)
    return lambda view: build(getattr(view._c, name), view)


def _assigner(name: str) -> Callable[[View, Any], None]:
    return lambda view, value: view._assign(name, value)


def _alias(target: str) -> property:
    return property(
        operator.attrgetter(target),
        lambda self, value: setattr(self, target, value),
    )


def _view_array(array: Any, parent: View) -> ViewArray[Any]:
    cls = view_class(array._type_)
    views = ViewArray(cls(array[i], parent) for i in range(len(array)))
    views._ctypes_array = array
    return views


def _property(name: str, ctype: Any, offset: int) -> property:
    if layout.is_string(ctype):
        return _string(name, ctype._length_)
    return (
        _flag(name, offset)
        if _is_flag(name) and ctype is layout.BOOL
        else _scalar(name, ctype)
    )


@functools.cache
def view_class(structure: type[ctypes.Structure]) -> type[View]:
    """The view class of a structure of ``hli.layout``."""
    fields: list[tuple[str, Any]] = list(structure._fields_)  # type: ignore[arg-type]
    parts = {
        name: part for name, ctype in fields if (part := _part(name, ctype))
    }
    members: dict[str, Any] = {
        "__slots__": tuple(parts),
        "_parts": parts,
        "_structure": structure,
    }
    for name, ctype in fields:
        if name not in parts:
            members[name] = _property(
                name, ctype, getattr(structure, name).offset
            )
    for alias, target in aliases_of(structure):
        members[alias] = _alias(target)
    if structure is layout.HLI_CONTOUR_LOOKAHEAD_RESPONSE:
        members["as_array"] = lambda self: self.block.as_array()
    if structure is layout.HLI_EXT_VAR:
        members["__getitem__"] = lambda self, index: self.value[index]
        members["__setitem__"] = lambda self, index, value: (
            self.value.__setitem__(index, value)
        )
    found = [*(name for name, _ in fields), *members]
    names = tuple(
        dict.fromkeys(
            n for n in found if not n.startswith(("_", "fill_", "as_array"))
        )
    )
    writers = {
        name: _assigner(name) if name in parts else members[name].fset
        for name in names
    }
    return type(
        structure.__name__,
        (View,),
        {**members, "_names": names, "_writers": writers},
    )


def aliases_of(structure: type[ctypes.Structure]) -> list[tuple[str, str]]:
    """(alias, member) of a structure; ``a.b`` aliases belong to the structure
    of the member ``a``.
    """
    names = {name for name, _ in structure._fields_}  # type: ignore[misc]
    found = []
    for alias, target in layout.ALIASES.items():
        owner, _, old = alias.rpartition(".")
        member = target.rpartition(".")[2]
        if (
            member in names
            and old not in names
            and owner in ("", *_holders(structure))
        ):
            found.append((old, member))
    return found


def _holders(structure: type[ctypes.Structure]) -> set[str]:
    return {
        field[0]
        for cls in layout.structures()
        for field in cls._fields_
        if field[1] is structure
    }


def overlay(array: ArrayView[int], structure: type[ctypes.Structure]) -> Any:
    """A typed view over an array of the memory, as the PLC's typed pointer on
    ``attribut_r.data``.

    Raises TypeError (no array of the HLI, no structure) and ValueError (the
    array is too small).
    """
    if not isinstance(array, ArrayView):
        raise TypeError(
            "overlay: takes an array of the HLI, such as"
            f" hli.gpVECh[0].value; not {spelling(array)}"
        )
    if not (
        isinstance(structure, type) and issubclass(structure, ctypes.Structure)
    ):
        raise TypeError(f"overlay: {structure!r} is no ctypes structure")
    if len(array) < ctypes.sizeof(structure):
        raise ValueError(
            f"{structure.__name__} needs {ctypes.sizeof(structure)} bytes,"
            f" the array has {len(array)}"
        )
    return view_class(structure)(structure.from_buffer(array._a))


class Pointers(tuple[_T, ...]):
    """``gpCh``, ``gpAx``, ``gpVECh``: a view for each area the CNC has; the
    others are NULL.

    Iteration and slices give None for those; an index that names one raises
    HliNotConfigured instead of handing out a None that fails somewhere else.
    """

    name: str = ""
    configured: int = 0

    def __new__(cls, name: str, views: ViewArray[_T], count: int) -> Self:
        nulls: list[Any] = [None] * (len(views) - count)
        pointers = super().__new__(cls, (*views[:count], *nulls))
        pointers.name, pointers.configured = name, count
        return pointers

    @overload
    def __getitem__(self, index: SupportsIndex) -> _T: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[_T, ...]: ...

    def __getitem__(self, index: Any) -> Any:
        try:
            area = super().__getitem__(index)
        except IndexError:
            raise self._wrong(index) from None
        if area is None or (isinstance(area, View) and index < 0):
            raise self._wrong(index)
        return area

    if not TYPE_CHECKING:  # which finds unknown names

        def __getattr__(self, name: str) -> Any:
            right = f"write {self.name}[0].{name}"
            raise AttributeError(f"{self.name} holds all of them; {right}")

    def _wrong(self, index: int) -> IndexError:
        if not 0 <= index < len(self):
            return IndexError(
                f"{self.name}[{index}]: the index runs 0..{len(self) - 1}"
            )
        what = "axis" if self.name == "gpAx" else "channel"
        last = self.configured - 1
        there = f"{self.name}[0..{last}]" if last >= 0 else "none"
        return HliNotConfigured(
            f"{what} {index} is not configured: {self.name}[{index}] is NULL; the CNC has {there}"
        )

    def __repr__(self) -> str:
        return f"<hli.{self.name}[0..{len(self) - 1}]: {self.configured} configured>"


# where a view stands
_GLOBAL_NAMES = {
    "platform": "gpPform",
    "channel": "gpCh",
    "axis": "gpAx",
    "ext_var_channel": "gpVECh",
    "ext_var_global": "gpVEGlobal",
}


def root_of(view: View) -> View:
    """The outermost view around any view taken from it."""
    while view._parent is not None:
        view = view._parent
    return view


def path_of(part: View | ArrayView[Any]) -> str:
    """How a PLC program writes it: ``hli.gpCh[0].bahn_state``.

    A view of other memory begins with ``copy``.
    """
    parent = part._parent
    if parent is None:
        own = part._c if isinstance(part, View) else None
        return "hli" if isinstance(own, layout.HLI_SEGMENT) else "copy"
    name = part._name if isinstance(part, ArrayView) else _name_in(parent, part)
    if isinstance(parent._c, layout.HLI_SEGMENT):
        plain, bracket, index = name.partition("[")
        name = _GLOBAL_NAMES.get(plain, plain) + bracket + index
    return f"{path_of(parent)}.{name}"


def _name_in(parent: View, part: View) -> str:
    """The name of a part that was built before."""
    for name in parent._parts:
        with contextlib.suppress(AttributeError):
            found = object.__getattribute__(parent, name)
            if found is part:
                return name
            if isinstance(found, ViewArray) and part in found:
                return f"{name}[{found.index(part)}]"
    return type(part).__name__


def spelling(given: Any) -> str:
    """What a program gave where a part of the HLI was wanted, for an error's
    text.
    """
    if isinstance(given, View):
        return f"{path_of(given)} ({type(given).__name__})"
    if isinstance(given, ArrayView):
        return path_of(given)
    if isinstance(given, Pointers):
        return f"hli.{given.name} (all of them)"
    if hasattr(given, "gpCh"):
        return f"hli ({type(given).__name__})"
    return repr(given) if given is None else f"a {type(given).__name__}"


def expect(
    view: Any, caller: str, example: str, *structures: type[ctypes.Structure]
) -> None:
    """Refuse what is no view of one of these structures in the memory of an
    HLI.  Nothing of another type, size or owner gets to C.

    ``example``: how it is written right.  Raises TypeError.
    """
    known = isinstance(view, View) and type(view._c) in structures
    if known and isinstance(root_of(view)._c, layout.HLI_SEGMENT):
        return
    raise TypeError(f"{caller}: takes {example}; not {spelling(view)}")
