"""Scratch folders of runs; those of killed launchers are removed."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from pathlib import Path

from hli._sync import lib as sync

SCRATCH = "hli-cosim-run-"


def scratch_prefix() -> str:
    """How folders of this process begin: with it and its start, so that the next
    launcher knows when nobody needs them.
    """
    me = os.getpid()
    return f"{SCRATCH}{me}-{sync.hs_process_start(me)}-"


def scratch_folder() -> Path:
    """A folder of this process."""
    return Path(tempfile.mkdtemp(prefix=scratch_prefix()))


def sweep_folders() -> None:
    """Remove this user's folders whose launcher was killed."""
    for path in Path(tempfile.gettempdir()).glob(f"{SCRATCH}*"):
        match = re.fullmatch(rf"{SCRATCH}(\d+)-(\d+)-.+", path.name)
        try:
            ours = (
                path.lstat().st_uid == os.getuid()
                and path.is_dir()
                and not path.is_symlink()
            )
        except OSError:
            continue
        if (
            match
            and ours
            and not sync.hs_process_alive(int(match[1]), int(match[2]))
        ):
            shutil.rmtree(path, ignore_errors=True)


def files_below(folder: Path | None) -> dict[str, int]:
    """Files below the folder with their time of change; none without a folder."""
    if folder is None or not folder.is_dir():
        return {}
    return {
        str(p.relative_to(folder)): p.stat().st_mtime_ns
        for p in sorted(folder.rglob("*"))
        if p.is_file()
    }
