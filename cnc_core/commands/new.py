"""The command ``new``: a folder with everything of a first cell."""

from __future__ import annotations

import os
import shutil
import string
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from ..errors import CncError, Place
from .console import app, err, out

_TEMPLATES = Path(__file__).resolve().parent.parent / "data" / "new"
_WORDS = {
    "python": {
        "PLC": "machine.py",
        "TASK": "Machine",
        "VALVE": "valve",
        "CLOSED": "clamp_closed",
        "DOOR": "door_shut",
    },
    "st": {
        "PLC": "machine.st",
        "TASK": "MAIN",
        "VALVE": "bValve",
        "CLOSED": "bClampClosed",
        "DOOR": "bDoorShut",
    },
}


@app.command()
def new(
    name: Annotated[Path, typer.Argument(help="folder that is made")],
    st: Annotated[
        bool, typer.Option("--st", help="a PLC in Structured Text")
    ] = False,
) -> None:
    """Begin a cell: part, machine, PLC, simulated inputs, test, editor
    settings; its test passes at once.

    Example: hli-cosim new my-cell --st
    """
    kind = "st" if st else "python"
    make(name, kind)
    plc = _WORDS[kind]["PLC"]
    out.print(f"{name} holds a cell that runs. Try:\n")
    out.print(f"  cd {name}")
    out.print(f"  hli-cosim run part.nc --config cell.toml --plc {plc}")
    out.print("  pytest -q")
    if find_spec("pytest") is None:
        err.print("pytest is not installed: pip install pytest")


def make(folder: Path, kind: str) -> None:
    """Write the folder, or nothing.  CncError: it is there and not empty."""
    _check(folder)
    target = folder.resolve()
    words = {"NAME": target.name, **_WORDS[kind]}
    with tempfile.TemporaryDirectory(
        prefix=".hli-cosim-new-", dir=target.parent
    ) as draft:
        content = Path(draft) / "content"
        for source in ("both", kind):
            _copy(_TEMPLATES / source, content, words)
        if target.exists():
            _move(content, target)
        else:
            content.rename(target)


def _check(folder: Path) -> None:
    try:
        taken = folder.exists() and any(folder.iterdir())
    except NotADirectoryError:
        raise CncError(901004, "a file is there", Place(str(folder))) from None
    if taken:
        raise CncError(
            901004,
            "the folder is there and not empty; choose another name",
            Place(str(folder)),
        )
    parent = folder.resolve().parent
    if not parent.is_dir():
        raise CncError(
            901001, "folder not found; make it first", Place(str(parent))
        )


def _copy(source: Path, target: Path, words: dict[str, str]) -> None:
    """All templates: ``.txt`` goes, ``dot_`` is a dot, ``$WORD`` is replaced."""
    for path in sorted(source.rglob("*.txt")):
        parts = path.relative_to(source).with_suffix("").parts
        named = [part.replace("dot_", ".", 1) for part in parts]
        file = target.joinpath(*named)
        file.parent.mkdir(parents=True, exist_ok=True)
        text = string.Template(path.read_text()).substitute(words)
        file.write_text(text)


def _move(content: Path, target: Path) -> None:
    """Into a folder that is there and empty; all or nothing."""
    moved: list[Path] = []
    try:
        for path in sorted(content.iterdir()):
            moved.append(target / path.name)
            os.rename(path, moved[-1])
    except BaseException:
        for path in moved:
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
        raise
