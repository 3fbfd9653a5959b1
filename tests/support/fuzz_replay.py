"""The C harnesses of ``tests/fuzz/harness`` as functions of Python, over the installed modules.

A small library is compiled from the harness alone.  Its table of functions is
filled with those of ``cnc_core._engine``, so the engine is not compiled again,
and one built under sanitizers is driven under them.
"""

from __future__ import annotations

import contextlib
import ctypes
import re
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

from cnc_core._engine import ffi, lib

from hli.export import c_header
from plc_client.st.machine.compiler import compiler
from support.paths import ROOT, TESTS

HARNESS = TESTS / "fuzz" / "harness"
NOT_LOADED = {"fuzzer.c", "replay.c", "shake.c"}
"""They belong to the programs of bench/fuzz.py."""
TARGETS = ("scanner", "words", "stages", "engine")


def called() -> list[str]:
    """Names of the functions that the harness calls, in the table's order."""
    return re.findall(
        r"CALL\((nc_\w+|engine_\w+)\)", (HARNESS / "calls.h").read_text()
    )


def build(folder: Path) -> Path:
    """The library, compiled into ``folder``."""
    (folder / "hli").mkdir()
    (folder / "hli" / "hli_layout.h").write_text(c_header())
    names = called()
    (folder / "fuzz_loaded.h").write_text(
        "\n".join(f"#define {name} fuzz_calls.to_{name}" for name in names)
    )
    made = folder / "harness.so"
    subprocess.run(
        [
            compiler(),
            *("-shared", "-fPIC", "-O0", "-std=gnu11", "-DFUZZ_LOADED"),
            *("-Wall", "-Wextra", "-Werror", "-ffp-contract=off"),
            *(f"-I{path}" for path in (folder, ROOT / "c_ext", HARNESS)),
            *sorted(
                str(path)
                for path in HARNESS.glob("*.c")
                if path.name not in NOT_LOADED
            ),
            *("-lm", "-o", str(made)),
        ],
        check=True,
    )
    return made


class Harness:
    """The targets of a built library."""

    def __init__(self, path: Path) -> None:
        self._library = ctypes.CDLL(str(path))
        names = self._names = called()
        table = self._table = (ctypes.c_void_p * len(names)).in_dll(
            self._library, "fuzz_calls"
        )
        for at, name in enumerate(names):
            place = ffi.cast("uintptr_t", ffi.addressof(lib, name))
            table[at] = int(place)
        self._library.fuzz_verdict.restype = ctypes.c_char_p

    def broken(self, target: str, data: bytes) -> str:
        """What an input breaks, in words; "" where every promise is kept."""
        run: Callable[[bytes, ctypes.c_size_t], int]
        run = getattr(self._library, f"fuzz_{target}")
        run(data, ctypes.c_size_t(len(data)))
        said: bytes = self._library.fuzz_verdict()
        return said.decode()

    @contextlib.contextmanager
    def instead(
        self, name: str, call: Callable[..., int], types: str
    ) -> Iterator[None]:
        """Another function in the place of one that returns ``int``; ``types``:
        P a pointer, N a size, i an int, one letter a parameter.
        """
        kinds = {"P": ctypes.c_void_p, "N": ctypes.c_size_t, "i": ctypes.c_int}
        made = ctypes.CFUNCTYPE(ctypes.c_int, *(kinds[k] for k in types))(call)
        at = self._names.index(name)
        before = self._table[at]
        self._table[at] = ctypes.cast(made, ctypes.c_void_p).value
        try:
            yield
        finally:
            self._table[at] = before
