"""Scratch folders of runs; those of killed launchers are removed."""

from __future__ import annotations

import atexit
import functools
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
    """A folder of this process.  What is still there at its exit is removed."""
    _remove_at_exit(os.getpid())
    return Path(tempfile.mkdtemp(prefix=scratch_prefix()))


@functools.cache
def _remove_at_exit(pid: int) -> None:
    """A signal may end the process while nobody has the folder's name yet."""
    folder, pattern = Path(tempfile.gettempdir()), f"{scratch_prefix()}*"

    def remove() -> None:
        if os.getpid() == pid:  # not in a child that was forked
            for path in folder.glob(pattern):
                shutil.rmtree(path, ignore_errors=True)

    atexit.register(remove)


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
