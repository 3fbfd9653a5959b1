"""A wheel is the same to the byte wherever it is built, with SOURCE_DATE_EPOCH set."""

from __future__ import annotations

import runpy
import shutil
import subprocess
from pathlib import Path

import pytest

from support.paths import ROOT

SOURCE = "maths/plain.c"


def compiled(folder: Path, *, reproducible: bool) -> bytes:
    """An object with tables for a debugger, built in a folder."""
    room = folder / "c_ext" / "maths"
    shutil.copytree(ROOT / "c_ext" / "maths", room)
    names = runpy.run_path(str(ROOT / "c_ext" / "build_ffi.py"))
    args, _ = names["compile_args"](folder)
    assert any("prefix-map" in arg for arg in args) == reproducible
    source = f"c_ext/{SOURCE}"
    words = [*args, "-g", "-I", "c_ext", "-c", source, "-o", "plain.o"]
    subprocess.run(["gcc", *words], cwd=folder, check=True)
    return (folder / "plain.o").read_bytes()


@pytest.mark.ci
@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")
@pytest.mark.parametrize("reproducible", [True, False])
def test_objects_name_no_folder_of_the_build(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reproducible: bool
) -> None:
    """Two builds in two folders are the same to the byte; without the variable they
    are not, since a debugger looks for the sources there.
    """
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    if reproducible:
        monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    built = []
    for name in ("one", "another"):
        folder = tmp_path / name
        folder.mkdir()
        built.append(compiled(folder, reproducible=reproducible))
    assert (built[0] == built[1]) == reproducible
