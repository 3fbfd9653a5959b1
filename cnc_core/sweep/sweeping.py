"""A sweep: what is not complete is handed out, what comes back is kept."""

from __future__ import annotations

import contextlib
import fcntl
import os
import tomllib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from ..config import load_config
from ..config.toml import toml_of
from ..errors import CncError, ConfigError, Place
from .ledger import LEDGER, Ledger
from .local import Hands
from .on_ray import made as made_on_ray
from .points import files_of, points
from .study import Study, fingerprint
from .table import Results, write_table

LOCK = "sweep.lock"
Tick = Callable[[int, int], None]


def sweep(
    study_file: str | Path,
    out: str | Path,
    *,
    workers: int | None = None,
    resume: bool = False,
    ray: str | None = None,
    tick: Tick = lambda done, of: None,
) -> Results:
    """Make every run of a study that is not complete, and the table.

    ``workers``: processes, None: one a core.  ``resume``: go on in a folder
    that has runs.  ``ray``: address of a cluster, ``local`` for one that is
    started here.  ``tick``: called with the number of complete runs and of all.
    CncError: the study is wrong, the folder is another study's or in use, or it
    cannot be written.
    """
    file, folder = Path(study_file).resolve(), Path(out).resolve()
    study = Study.read(file)
    _check_cells(study, file.parent)
    runs = points(study)
    print_ = fingerprint(file, list(files_of(study, file.parent)))
    with _locked(folder), contextlib.closing(Ledger(folder)) as ledger:
        _claim(ledger, print_, folder, resume)
        ledger.take_over()
        complete = ledger.rows()
        left = [run.number for run in runs if run.number not in complete]
        done = len(runs) - len(left)
        tick(done, len(runs))
        for number in _made(file, folder, left, workers, ray):
            ledger.enter(number)
            done += 1
            tick(done, len(runs))
        return write_table(folder, runs, ledger.rows())


def _check_cells(study: Study, folder: Path) -> None:
    """ConfigError: a cell with several channels, of which no run would come."""
    for name in study.cells:
        if name and (folder / name).is_file():
            try:
                table = toml_of((folder / name).read_text(), name)
            except (tomllib.TOMLDecodeError, ConfigError):
                continue  # told by its run
            if table.get("channels"):
                load_config(folder / name).of_one_channel()


def _made(
    file: Path,
    folder: Path,
    numbers: Sequence[int],
    workers: int | None,
    ray: str | None,
) -> Iterator[int]:
    if ray is not None:
        address = None if ray == "local" else ray
        yield from made_on_ray(file, folder, numbers, address)
        return
    cores = len(os.sched_getaffinity(0))
    with Hands(file, folder) as hands:
        yield from hands.made(numbers, workers or cores)


def _claim(ledger: Ledger, own: str, folder: Path, resume: bool) -> None:
    """The folder belongs to this study."""
    found, place = ledger.fingerprint, Place(str(folder / LEDGER))
    if found is None:
        ledger.begin(own)
    elif not resume:
        raise CncError(
            901004, "the folder has runs: --resume goes on with them", place
        )
    elif found != own:
        raise CncError(
            902001,
            "the study or one of its files is not what it was when this"
            " folder was begun: choose another folder",
            place,
        )


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """One sweep at a time in a folder."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = os.open(folder / LOCK, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC)
    except OSError as error:
        text = f"folder cannot be written: {error.strerror}"
        raise CncError(901004, text, Place(str(folder))) from None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError:
        text = "another sweep is at work in this folder"
        raise CncError(905002, text, Place(str(folder))) from None
    finally:
        os.close(lock)
