"""Parts of a recording: whole batches survive whatever happens to the file."""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest

from cnc_core.recording.parts import CNC, Parts, folder_of
from cnc_core.recording.reading import SOURCES, Recording
from cnc_core.recording.targets import WRITERS
from hli.part_file import PartFile

TABLES = {
    "cycles": {"cycle": "uint64", "v": "double"},
    "events": {"cycle": "uint64", "kind": "string", "text": "string"},
}
META = {
    "version": 1,
    "columns": {"cycles": {"cycle": "", "v": "mm/s"}},
    "start": {"X": 0.0},
}
BATCH = 100


def batch(first: int, rows: int = BATCH) -> dict[str, dict[str, object]]:
    """Cycles from ``first`` on, with an event at the first of them."""
    cycle = np.arange(first, first + rows, dtype=np.uint64)
    event = {"cycle": [first], "kind": ["message"], "text": [f"at {first}"]}
    return {"cycles": {"cycle": cycle, "v": cycle * 0.5}, "events": event}


def written(path: Path, batches: int) -> None:
    part = PartFile(path, TABLES, json.dumps(META).encode())
    for i in range(batches):
        assert part.add(batch(i * BATCH))
    part.close()


@pytest.mark.ci
def test_a_file_cut_anywhere_gives_every_whole_batch(tmp_path: Path) -> None:
    """200 random cuts: the rows are those of the batches in front of the cut."""
    whole = tmp_path / "a.arrow"
    written(whole, 30)
    data = whole.read_bytes()
    sizes = []
    with (tmp_path / "sizes.arrow").open("wb") as file:
        part = PartFile(Path(file.name), TABLES, json.dumps(META).encode())
        for i in range(30):
            part.add(batch(i * BATCH))
            sizes.append(Path(file.name).stat().st_size)
        part.close()
    cut_file = tmp_path / "cut.arrow"
    draw = random.Random(1)
    for _ in range(200):
        cut = draw.randrange(len(data))
        cut_file.write_bytes(data[:cut])
        recording = Recording(cut_file)
        whole_batches = sum(size <= cut for size in sizes)
        rows = len(recording.cycles) if recording.tables else 0
        assert rows == whole_batches * BATCH, cut
        assert not recording.complete
        if rows:
            cycles = recording.cycles["cycle"]
            assert (cycles == np.arange(rows)).all()
            assert len(recording.events) == whole_batches


def test_a_full_disk_loses_batches_and_nothing_else(tmp_path: Path) -> None:
    """A batch that does not fit leaves no trace; when there is room again, the
    next one is in the file.
    """
    path = tmp_path / "a.arrow"
    part = PartFile(path, TABLES, json.dumps(META).encode())
    assert part.add(batch(0))
    size = path.stat().st_size
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size + 50, before[1]))
        assert not part.add(batch(100))
        assert path.stat().st_size == size
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert part.problem is not None
    assert part.add(batch(200))
    part.close()
    cycles = Recording(path).cycles["cycle"]
    assert cycles.tolist() == [*range(100), *range(200, 300)]


@pytest.mark.parametrize("suffix", SOURCES)
def test_targets_hold_the_same_tables(tmp_path: Path, suffix: str) -> None:
    """Parquet, Arrow and npz give back what was recorded, with units."""
    parts = Parts(tmp_path / f"run{suffix}")
    written(parts.cnc, 5)
    assert parts.finish(end="completed") == 5 * BATCH
    recording = Recording(parts.target)
    assert recording.complete
    assert recording.cycles.units["v"] == "mm/s"
    assert (recording.cycles["cycle"] == np.arange(5 * BATCH)).all()
    assert (recording.cycles["v"] == np.arange(5 * BATCH) * 0.5).all()
    assert recording.events.row(4)["text"] == "at 400"
    assert os.listdir(tmp_path) == [f"run{suffix}"]


def test_a_target_that_cannot_be_written_keeps_the_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full disk at the end: no half file, the parts are readable, the error
    names them.
    """

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    parts = Parts(tmp_path / "run.parquet")
    written(parts.cnc, 3)
    monkeypatch.setitem(WRITERS, ".parquet", full)
    with pytest.raises(Exception, match=r"No space left.*run\.parquet\.parts"):
        parts.finish(end="completed")
    assert not parts.target.exists()
    recording = Recording(parts.target)
    assert len(recording.cycles) == 300
    assert not recording.complete


def test_a_disk_that_is_full_from_the_start_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run may go on: the end names the recording, no folder is left behind."""

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    parts = Parts(tmp_path / "run.parquet")
    assert parts.problem == "No space left on device"
    part = PartFile(parts.cnc, TABLES, json.dumps(META).encode())
    assert not part.add(batch(0))
    part.close()
    with pytest.raises(
        Exception, match=r"run\.parquet: No space left.*nothing"
    ):
        parts.finish(end="completed")
    assert os.listdir(tmp_path) == []


def test_a_folder_that_was_removed_is_told(tmp_path: Path) -> None:
    """Somebody removed the parts of a run: the end says so, and writes no empty
    file.
    """
    parts = Parts(tmp_path / "new" / "run.parquet")
    written(parts.cnc, 1)
    shutil.rmtree(parts.target.parent)
    with pytest.raises(Exception, match=r"run\.parquet\.parts was removed"):
        parts.finish(end="completed")
    assert os.listdir(tmp_path) == []


def test_parts_of_a_dead_process_are_recovered(tmp_path: Path) -> None:
    """The next recording to the same name finds them, and makes a file of them."""
    target = tmp_path / "run.arrow"
    folder = folder_of(target)
    folder.mkdir()
    (folder / "owner").write_text("999999999 1")
    written(folder / CNC, 2)
    with (folder / CNC).open("r+b") as file:
        file.truncate(folder.joinpath(CNC).stat().st_size - 20)
    parts = Parts(target)
    assert parts.recovered is not None
    assert len(Recording(parts.recovered).cycles) == BATCH
    assert not Recording(parts.recovered).complete


def test_parts_are_for_their_user_alone(tmp_path: Path) -> None:
    """Others cannot enter the folder while a run records, so no file in it."""
    before = os.umask(0)
    try:
        parts = Parts(tmp_path / "run.arrow")
        written(parts.cnc, 1)
    finally:
        os.umask(before)
    assert parts.folder.stat().st_mode & 0o777 == 0o700


def test_a_name_that_is_being_recorded_is_refused(tmp_path: Path) -> None:
    """Two runs never write the same recording."""
    first = Parts(tmp_path / "run.arrow")
    with pytest.raises(Exception, match="is writing it"):
        Parts(first.target)


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_run_that_recorded_nothing_has_a_recording(
    tmp_path: Path, suffix: str
) -> None:
    """A CNC that died before its first cycle: the file is there, without rows."""
    parts = Parts(tmp_path / f"run{suffix}")
    assert parts.finish(end="aborted") == 0
    assert parts.target.exists()
    if suffix in SOURCES:
        assert Recording(parts.target).meta["end"] == "aborted"
