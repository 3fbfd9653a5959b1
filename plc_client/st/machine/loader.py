"""A compiled program in this process: its memory, its entries, what its traps mean."""

from __future__ import annotations

import ctypes
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hli._sync import ffi, lib

from hli import layout

from ...task import PlcError
from ..options import Built
from .symbols import ListView, Memory


class _Trap(ctypes.Structure):
    _fields_ = [
        ("kind", ctypes.c_int32),
        ("line", ctypes.c_int32),
        ("pou", ctypes.c_char * 128),
        ("name", ctypes.c_char * 128),
        ("values", ctypes.c_int64 * 3),
        ("real", ctypes.c_double),
        ("caller_pou", ctypes.c_char * 128),
        ("caller_name", ctypes.c_char * 128),
        ("caller_line", ctypes.c_int32),
    ]


class StTrap(PlcError):  # noqa: N818 (the word of the trade)
    """A program did what it must not: the text names POU, line and values."""


_FUNCTIONS = (
    *("load_u8", "store_u8", "ring", "snapshot"),
    *("ahead_claim", "ahead_ask", "ahead_take"),
)


class _Services(ctypes.Structure):
    """``st_services`` of the run time."""

    _fields_ = [
        *((name, ctypes.c_void_p) for name in _FUNCTIONS),
        ("bell", ctypes.c_void_p),
        ("generation", ctypes.c_void_p),
        ("techno_again", ctypes.c_void_p),
        ("axis_again", ctypes.c_void_p),
        ("image", ctypes.c_int64),
    ]


def _address_of(name: str) -> int:
    return int(ffi.cast("uintptr_t", ffi.addressof(lib, f"hs_{name}")))


def _image_of(hli: Any) -> int:
    """How far the input image lies behind the memory; 0: there is none."""
    channel = hli.gpCh[0]
    place = channel._address + layout.HLI_CHANNEL.bahn_state.offset
    return int(channel.bahn_state._address - place)


def _bound(trap: _Trap) -> str:
    value, low, high = trap.values
    return f"index {value} is outside of {low}..{high}"


def _range(trap: _Trap) -> str:
    value, low, high = trap.values
    return f"value {value} is outside of the subrange {low}..{high}"


def _wild(trap: _Trap) -> str:
    name, (address, size, _) = trap.name.decode(), trap.values
    where = f"{address & (2**64 - 1):#x}"
    return f"{name} points to {where} ({size} bytes), outside of the program"


_AREA = 9
_AREAS = {
    "gpCh": "channel",
    "gpAx": "axis",
    "gpVECh": "channel",
    "gpAhead": "channel",
}
_KINDS: dict[int, Callable[[_Trap], str]] = {
    1: _bound,
    2: _range,
    3: lambda t: f"{t.name.decode()} is null",
    4: _wild,
    5: lambda t: f"division of {t.real:g} by zero",
    6: lambda t: "the stack is used up; does the POU call itself without end?",
    7: lambda t: f"the loop has not ended within {t.values[0]} ms",
    8: lambda t: "an abstract or unset method was called",
    _AREA: lambda t: (
        f"{_AREAS[t.name.decode()]} {t.values[0]} is not configured"
    ),
    10: lambda t: t.name.decode("cp1252", errors="replace"),
}


def _own_copy(library: Path) -> ctypes.CDLL:
    """Load a private copy: two instances of one program share nothing."""
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        path = Path(folder) / library.name
        shutil.copyfile(library, path)
        return ctypes.CDLL(str(path))


class StProgram:
    """One instance of a program."""

    def __init__(self, built: Built) -> None:
        self.description: dict[str, Any] = built.description
        self.library = _own_copy(built.library)
        self.library.st_where.restype = ctypes.c_void_p
        guarded = self.library.st_guarded
        guarded.argtypes = [ctypes.c_void_p, ctypes.c_int64]
        self._guarded = guarded
        self._trap = _Trap.in_dll(self.library, "st_trap")
        self.address: int = self.library.st_where()
        rows = self.description["types"]
        size = self.description["memory"]
        statics = self.description["statics"]
        self.memory = Memory(self.address, size, rows, statics)
        self._attach(None)

    def entry(self, name: str) -> int:
        """Address of a program's function."""
        function = getattr(self.library, f"st_program_{name.upper()}")
        return ctypes.cast(function, ctypes.c_void_p).value or 0

    @property
    def guarded_entry(self) -> int:
        """Address of the function that calls an entry and catches its traps."""
        return ctypes.cast(self._guarded, ctypes.c_void_p).value or 0

    def _attach(self, hli: Any) -> None:
        """Hand the HLI's memory and the functions of its ordering over."""
        services = _Services(*map(_address_of, _FUNCTIONS))
        base = size = 0
        if hli is not None:
            base, size = hli.root._address, ctypes.sizeof(hli.root._c)
            side = hli.root.sidecar
            services.bell = side.clah_bell._address
            at = layout.HLI_SIDE_PLC.generation.offset
            services.generation = side.plc._address + at
            techno, members = side.techno._address, layout.HLI_SIDE_TECHNO
            services.techno_again = techno + members.again.offset
            services.axis_again = techno + members.axis_again.offset
            services.image = _image_of(hli)
        attach = self.library.st_attach
        attach.argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p]
        attach.restype = None
        attach(base, size, ctypes.byref(services))

    def connect(self, hli: Any) -> None:
        """Bind the HLI's pointers to a connection."""
        self._attach(hli)
        self._hli = hli

    def start(self, now_ns: int = 0) -> None:
        """All variables get their initial values; the HLI's pointers are set."""
        start = ctypes.cast(self.library.st_start, ctypes.c_void_p).value
        self.run(start or 0, now_ns)
        self._set_pointers()

    def _set_pointers(self) -> None:
        hli = getattr(self, "_hli", None)
        if hli is None:
            return
        at = self.description["lists"]["HLI_Global_Variables"]

        def put(name: str, index: int, area: Any) -> None:
            address = 0 if area is None else area._address
            offset = at[name]["at"] + 8 * index
            ctypes.c_uint64.from_address(self.address + offset).value = address

        for name in ("gpCh", "gpAx", "gpVECh", "gpAhead"):
            areas = getattr(hli, name)
            for index, area in enumerate(areas[0 : len(areas)]):
                put(name, index, area)
        put("gpPform", 0, hli.gpPform)
        put("gpVEGlobal", 0, hli.gpVEGlobal)
        for name in ("gNrCh", "gNrAx"):
            offset = at[name]["at"]
            place = ctypes.c_uint16.from_address(self.address + offset)
            place.value = int(getattr(hli, name))

    def allow(self, seconds: float) -> None:
        """Wall time one call may spend in loops; 0 sets no limit."""
        ns = round(seconds * 1e9) if seconds > 0 else 1 << 62
        self.library.st_allow(ctypes.c_int64(ns))

    def tell_on(self, descriptor: int) -> None:
        """Where a loop that lasts is told; otherwise on standard error."""
        ctypes.c_int.in_dll(self.library, "st_tell_on").value = descriptor

    def run(self, entry: int, now_ns: int) -> None:
        """Call an entry.  StTrap: the program was stopped."""
        if self._guarded(entry, now_ns):
            raise self.trap()

    def trap(self) -> StTrap:
        """The error of the trap that just ended a call."""
        trap = self._trap
        label = trap.pou.decode()
        text = _KINDS[trap.kind](trap)
        if trap.kind == _AREA:
            text += f"; {self._there_is(trap.name.decode())}"
        place = self._place(label, trap.line)
        caller = trap.caller_pou.decode()
        if caller and (not label or place.startswith("<library>")):
            called = trap.caller_name.decode()
            place = self._place(caller, trap.caller_line)
            return StTrap(f"{place}: {caller}: {called}: {text}")
        return StTrap(f"{place}: {label}: {text}")

    def _place(self, label: str, line: int) -> str:
        """``FILE:LINE`` of a line of a POU."""
        file, first = self.description["places"].get(label, ["", 0])
        return f"{file}:{first + line}"

    def _there_is(self, name: str) -> str:
        """Which indices of the HLI's areas there are."""
        hli = getattr(self, "_hli", None)
        if hli is None:
            return "there is no CNC"
        areas = getattr(hli, name)
        there = [k for k, area in enumerate(areas[:]) if area is not None]
        return f"the CNC has {there[0]}..{there[-1]}" if there else "none is"

    # -- variables
    def names(self) -> list[str]:
        """Programs and lists of globals."""
        return [*self.description["roots"], *self.description["lists"]]

    def __getitem__(self, name: str) -> Any:
        """A program or a list of globals.  KeyError names what there is."""
        key = name.upper()
        for known, row in self.description["roots"].items():
            if known.upper() == key:
                return self.memory.view(row["type"], row["at"], path=known)
        for known, rows in self.description["lists"].items():
            if known.upper() == key:
                return ListView(self.memory, known, rows)
        raise KeyError(
            f"no program {name}; there are {', '.join(self.names())}"
        )
