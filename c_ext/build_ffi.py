"""cffi modules (API mode): ``cnc_core._engine`` (planner, interpolator,
scanner) and ``hli._sync`` (memory ordering).

The C declarations cffi needs are read from the headers, between ``/* cdef begin
*/`` and ``/* cdef end */``; the header of the shared-memory layout is generated
from ``hli/layout.py`` before anything is compiled.  The environment variable
HLI_COSIM_SANITIZE=address,undefined (or thread) builds both modules under the
sanitizers; HLI_COSIM_FLAGS=-O2 adds options of the compiler (``bench/determinism.py``);
HLI_COSIM_INTERLEAVE=1 with the places at which
``tests/unit/engine/test_interleaving.py`` switches between planner and GEO.
"""

from __future__ import annotations

import importlib
import os
import re
import shlex
import subprocess
import sys
import sysconfig
import types
from pathlib import Path
from typing import Any

from cffi import FFI

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
CDEF = re.compile(r"/\* cdef begin \*/(.*?)/\* cdef end \*/", re.S)


def cdef_of(*headers: str) -> str:
    """The declarations of the named headers, for ``FFI.cdef``."""
    return "\n".join(
        part
        for name in headers
        for part in CDEF.findall((HERE / name).read_text())
    )


def write_layout_header() -> None:
    """Generate c_ext/hli/hli_layout.h; imports hli.layout and hli.export
    without the (not yet built) hli package.
    """
    saved = {
        name: mod
        for name, mod in sys.modules.items()
        if name == "hli" or name.startswith("hli.")
    }
    for name in saved:
        del sys.modules[name]
    package = types.ModuleType("hli")
    package.__path__ = [str(ROOT / "hli")]
    sys.modules["hli"] = package
    try:
        layout: Any = importlib.import_module("hli.layout")
        export: Any = importlib.import_module("hli.export")
        layout.verify()
        text = export.c_header()
    finally:
        for name in [
            n for n in sys.modules if n == "hli" or n.startswith("hli.")
        ]:
            del sys.modules[name]
        sys.modules.update(saved)
    path = HERE / "hli" / "hli_layout.h"
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def knows(option: str) -> bool:
    """Whether the compiler takes an option."""
    compiler = os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc"
    command = [*shlex.split(compiler), option, "-E", "-x", "c", os.devnull]
    try:
        found = subprocess.run(command, check=False, capture_output=True)
    except OSError:
        return False
    return found.returncode == 0


def compile_args(root: Path = ROOT) -> tuple[list[str], list[str]]:
    """(compiler, linker) arguments; ``root``: the folder that is built in.

    No -ffast-math and no contraction: distances must add up the same
    everywhere.  Nobody reads errno or the exception flags behind a computation.
    The C library copies faster than the processor's string instructions, which
    GCC would take.
    """
    args = [
        "-std=gnu11",
        "-O3",
        "-fvisibility=hidden",
        "-Wall",
        "-Wextra",
        "-fno-fast-math",
        "-ffp-contract=off",
        "-fno-math-errno",
        "-fno-trapping-math",
    ]
    args += ["-Wno-psabi", "-pthread"]
    args += filter(knows, ["-mstringop-strategy=libcall"])
    args += os.environ.get("HLI_COSIM_FLAGS", "").split()
    if os.environ.get("SOURCE_DATE_EPOCH"):
        # the debugger's tables name the same folder wherever that is
        args.append(f"-ffile-prefix-map={root}=.")
    link = ["-pthread", "-lm", "-lrt"]
    if os.environ.get("HLI_COSIM_WERROR"):
        args.append("-Werror")
    if os.environ.get("HLI_COSIM_INTERLEAVE"):
        args.append("-DENGINE_INTERLEAVE")
    sanitize = os.environ.get("HLI_COSIM_SANITIZE")
    if sanitize:
        args += [
            f"-fsanitize={sanitize}",
            "-O1",  # compiled in half the time
            "-g",
            "-fno-omit-frame-pointer",
            "-fno-sanitize-recover=all",
        ]
        if "thread" in sanitize:
            # it says that fences are not modelled: docs/explanation/reliability.md
            args.append("-Wno-tsan")
        link.append(f"-fsanitize={sanitize}")
    return args, link


def module(name: str, headers: list[str], sources: list[str]) -> FFI:
    """One API-mode cffi module over the given headers and C files of c_ext."""
    write_layout_header()
    ffi = FFI()
    ffi.cdef(cdef_of(*headers))
    args, link = compile_args()
    relative = [os.path.relpath(HERE / s, ROOT) for s in sources]
    every_header = sorted(HERE.rglob("*.h"))
    ffi.set_source(
        name,
        "\n".join(f'#include "{h}"' for h in headers),
        sources=relative,
        include_dirs=[os.path.relpath(HERE, ROOT)],
        depends=[os.path.relpath(path, ROOT) for path in every_header],
        extra_compile_args=args,
        extra_link_args=link,
    )
    return ffi


SYNC_SOURCES = [
    "hli/sync.c",
    "hli/process.c",
    "hli/guard.c",
    "hli/queue.c",
    "hli/gather.c",
    "hli/bench.c",
    "hli/scans.c",
    "hli/trace.c",
    "hli/replay.c",
]
ENGINE_HEADERS = [
    "maths/plain.h",
    "rows/nc_block.h",
    "rows/scan.h",
    "stages/compensation/offset.h",
    "stages/smoothing/smoothing.h",
    "stages/contouring/contouring.h",
    "engine/state/api.h",
    "jerk/state/api.h",
    "jerk/topp2.h",
    "stages/polyline_distance.h",
]


def engine_sources() -> list[str]:
    """Every C file below c_ext but those of the other module; hli/sync.c too:
    the engine waits with its functions.
    """
    found = {str(path.relative_to(HERE)) for path in HERE.rglob("*.c")}
    return sorted(
        found
        - {
            "hli/bench.c",
            "hli/gather.c",
            "hli/guard.c",
            "hli/process.c",
            "hli/scans.c",
            "hli/trace.c",
            "hli/replay.c",
            "_engine.c",
            "_sync.c",
        }
    )


engine_ffi = module("cnc_core._engine", ENGINE_HEADERS, engine_sources())
sync_ffi = module(
    "hli._sync",
    [
        "hli/sync.h",
        "hli/guard.h",
        "hli/gather.h",
        "hli/bench.h",
        "hli/scans.h",
        "hli/trace.h",
        "hli/replay.h",
    ],
    SYNC_SOURCES,
)
