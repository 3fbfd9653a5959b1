"""The machine's C compiler behind a cache by content."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterable
from importlib import resources
from pathlib import Path

from ...task import PlcError

FLAGS = [
    "-std=gnu11",
    "-fPIC",
    "-fwrapv",
    "-fno-strict-aliasing",
    "-ffp-contract=off",
    "-fno-asynchronous-unwind-tables",
    "-fvisibility=hidden",
    "-w",
]
SMALL = 20_000
"""Lines of C up to which a program is optimised fully."""
_RUNTIME = ("st_state.c", "st_numbers.c", "st_texts.c")


def cache_folder() -> Path:
    """``$XDG_CACHE_HOME/hli-cosim/st``; ``HLI_COSIM_CACHE`` names another one.

    PlcError: another user could lay a program there, which this one would load.
    """
    own = os.environ.get("HLI_COSIM_CACHE")
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    above = Path(own) if own else Path(base) / "hli-cosim"
    above.parent.mkdir(parents=True, exist_ok=True)
    for folder in (above, above / "st"):
        _own_folder(folder)
    return folder


def _own_folder(folder: Path) -> None:
    """A folder that nobody else writes into, made where there is none."""
    with contextlib.suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    info = folder.stat()
    if info.st_uid != os.getuid():
        problem = f"belongs to user {info.st_uid}; set HLI_COSIM_CACHE"
    elif info.st_mode & 0o022:
        problem = "can be written by other users; remove it"
    else:
        return
    raise PlcError(f"the cache of compiled programs, {folder}, {problem}")


def compiler() -> str:
    """The C compiler.  PlcError: there is none."""
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        found = shutil.which(name) if name else None
        if found:
            return found
    text = "Structured Text needs a C compiler; install gcc or clang"
    raise PlcError(text)


@functools.cache
def _runtime() -> dict[str, str]:
    folder = resources.files(__package__.rpartition(".")[0]) / "runtime"
    names = ("st_runtime.h", "st_text_body.h", *_RUNTIME)
    return {name: folder.joinpath(name).read_text() for name in names}


def runtime_hash() -> str:
    """The run time's sources and the flags in one number."""
    text = "".join(_runtime().values()) + " ".join(_flags(0))
    return digest(text)


def digest(text: str) -> str:
    """Name of a text's place in the cache."""
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _flags(lines: int) -> list[str]:
    level = ["-O2"] if lines <= SMALL else ["-O1"]
    sanitize = os.environ.get("HLI_COSIM_ST_SANITIZE", "")
    if sanitize:
        level += [f"-fsanitize={sanitize}", "-fno-sanitize-recover=all", "-g"]
    return [*FLAGS, *level]


def _run(arguments: list[str]) -> None:
    import subprocess  # noqa: PLC0415 (a program that is cached starts without it)

    done = subprocess.run(
        arguments, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        first = (done.stderr.strip().splitlines() or ["no message"])[:3]
        text = "; ".join(first)
        raise PlcError(f"the C compiler failed on generated code: {text}")


class Objects:
    """Compiles C texts; what the cache holds is not compiled again."""

    def __init__(self) -> None:
        self.folder = cache_folder()
        self.compiled = 0

    def build(self, texts: dict[str, str], target: Path) -> None:
        """Compile all texts and link them to ``target``."""
        sources = dict(texts)
        for name in _RUNTIME:
            sources[name] = _runtime()[name]
        from concurrent.futures import ThreadPoolExecutor  # noqa: PLC0415

        lines = sum(text.count("\n") for text in texts.values())
        flags = _flags(lines)
        with tempfile.TemporaryDirectory(dir=self.folder) as scratch:
            headers = Path(scratch)
            for name, text in _runtime().items():
                (headers / name).write_text(text)
            with ThreadPoolExecutor(max_workers=2) as pool:
                jobs = [
                    pool.submit(self._object, name, text, flags, headers)
                    for name, text in sources.items()
                ]
                objects = [job.result() for job in jobs]
            self._link(objects, target, flags)

    def _object(
        self, name: str, text: str, flags: list[str], headers: Path
    ) -> Path:
        key = digest(text + " ".join(flags) + runtime_hash())
        found = self.folder / f"{key}.o"
        if found.exists():
            found.touch()
            return found
        self.compiled += 1
        source = headers / f"{Path(name).stem}_{key}.c"
        source.write_text(text)
        part = headers / f"{key}.o"
        arguments = [compiler(), *flags, "-I", str(headers)]
        _run([*arguments, "-c", str(source), "-o", str(part)])
        part.replace(found)
        return found

    def _link(
        self, objects: Iterable[Path], target: Path, flags: list[str]
    ) -> None:
        with tempfile.TemporaryDirectory(dir=self.folder) as scratch:
            part = Path(scratch) / "program.so"
            names = [str(o) for o in objects]
            sanitize = [f for f in flags if f.startswith("-fsanitize")]
            _run(
                [
                    compiler(),
                    "-shared",
                    "-o",
                    str(part),
                    *names,
                    *sanitize,
                    "-lm",
                    "-lpthread",
                ]
            )
            part.replace(target)
