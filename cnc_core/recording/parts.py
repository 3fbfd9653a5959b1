"""The parts of a recording while a run lasts: a folder beside the target.

``run.parquet.parts`` holds a stream of each process.  It goes when the target is
written; it stays where that was not possible, and readers understand it.  Only
its user can enter it.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from hli._sync import lib as sync

from ..errors import CncError
from .channels import ChannelsSource
from .source import ArrowSource, JoinedSource, Source
from .targets import check_kind, write_target

OWNER = "owner"
CNC, PLC = "cnc.arrow", "plc.arrow"


def part_of_channel(first: Path, index: int) -> Path:
    """The part of a channel beside that of the first one."""
    return first.with_name(f"cnc-{index}.arrow") if index else first


def folder_of(target: Path) -> Path:
    """The folder of the parts of a target."""
    return target.with_name(f"{target.name}.parts")


def check_target(path: Path) -> None:
    """CncError if no recording has such a name, or it is just being written."""
    check_kind(path)
    owner = living_owner(folder_of(path))
    if owner:
        raise CncError(
            901004, f"recording {path}: process {owner} is writing it"
        )


def check_writable(path: Path) -> None:
    """CncError if a file of this name cannot be written; leaves no file behind."""
    try:
        _try_to_write(path)
    except OSError as error:
        raise CncError(
            901004, f"{path}: cannot be written: {error.strerror}"
        ) from None


def why_unwritable(target: Path) -> str:
    """What the disk says to a recording there, empty if it can be written.

    Makes the folder of the target.
    """
    try:
        if not target.parent.exists():
            target.parent.mkdir(parents=True)
        _try_to_write(target)
    except OSError as error:
        return error.strerror or str(error)
    return ""


def _try_to_write(path: Path) -> None:
    there = path.exists()
    path.open("ab").close()
    if not there:
        path.unlink()


def living_owner(folder: Path) -> int:
    """The process that records into the folder, 0: none."""
    try:
        pid, start = map(int, (folder / OWNER).read_text().split())
    except (OSError, ValueError):
        return 0
    return pid if sync.hs_process_alive(pid, start) else 0


class Parts:
    """The folder of this process for one target.

    ``recovered``: the file that the parts of a dead process became.
    ``problem``: why nothing can be written there, empty if something can.  The
    run goes on all the same: its rows count as lost.
    """

    def __init__(self, target: Path) -> None:
        check_target(target)
        self.target = target
        self.folder = folder_of(target)
        self.recovered: Path | None = None
        self.problem = why_unwritable(target)
        if self.problem:
            return
        try:
            self.recovered = recover(target)
            self._make_folder()
        except OSError as error:
            self.problem = error.strerror or str(error)

    def _make_folder(self) -> None:
        """With its owner in it, or not at all."""
        self.folder.mkdir(mode=0o700)
        me = os.getpid()
        try:
            owner = f"{me} {sync.hs_process_start(me)}"
            (self.folder / OWNER).write_text(owner)
        except OSError:
            self.drop()
            raise

    @property
    def cnc(self) -> Path:
        """The part of the CNC process."""
        return self.folder / CNC

    @property
    def plc(self) -> Path:
        """The part of the PLC process."""
        return self.folder / PLC

    def finish(self, **end: object) -> int:
        """Write the target; returns the recorded cycles.  ``end``: what the end
        of the run adds to the recording's account.

        CncError: it cannot be written; the parts stay, as far as there are any.
        """
        if self.problem:
            raise self._nothing(self.problem)
        if not (self.folder / OWNER).exists():
            raise self._nothing(f"{self.folder} was removed")
        try:
            source = source_of_parts(self.folder)
            source.meta |= end | {"complete": True}
            write_target(source, self.target)
            rows = source.rows("cycles")
        except OSError as error:
            why = error.strerror or str(error)
            raise CncError(
                901004,
                f"recording {self.target}: {why};"
                f" what was recorded is in {self.folder}",
            ) from None
        self.drop()
        return rows

    def _nothing(self, why: str) -> CncError:
        return CncError(
            901004, f"recording {self.target}: {why}; nothing is recorded"
        )

    def drop(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self.folder, ignore_errors=True)


def is_folder_of_parts(folder: Path) -> bool:
    """Whether somebody records into this folder, or has done so."""
    return any((folder / name).exists() for name in (OWNER, CNC, PLC))


def source_of_parts(folder: Path, live: bool = False) -> JoinedSource:
    """What the folder holds."""
    sources: list[Source] = []
    if (folder / CNC).exists():
        sources.append(_of_cnc(folder, live))
    if (folder / PLC).exists():
        sources.append(ArrowSource(folder / PLC, live))
    return JoinedSource(sources)


def _of_cnc(folder: Path, live: bool) -> Source:
    """The CNC's part, or those of its channels as far as they have begun."""
    first = ArrowSource(folder / CNC, live)
    if "channel" not in first.meta:
        return first
    found, index = [first], 1
    while (part := part_of_channel(folder / CNC, index)).exists():
        source = ArrowSource(part, live)
        if source.meta:
            found.append(source)
        index += 1
    return ChannelsSource(found)


def recover(target: Path) -> Path | None:
    """Turn the parts of a dead process into a file of their own beside the
    target; None if there are none.
    """
    folder = folder_of(target)
    if not folder.is_dir():
        return None
    source = source_of_parts(folder)
    if not any(source.rows(table) for table in source.tables):
        shutil.rmtree(folder)
        return None
    name = free_name(target)
    write_target(source, name)
    shutil.rmtree(folder)
    return name


def free_name(target: Path) -> Path:
    """A name beside the target that nobody has."""
    number = 1
    while True:
        stem = f"{target.stem}-recovered-{number}"
        name = target.with_name(stem + target.suffix)
        if not name.exists():
            return name
        number += 1
