"""Workers of a Ray cluster (extra ``ray``).

The folders of the study and of the sweep are on a file system that every node
sees.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ..errors import CncError
from .ledger import leave
from .one import make, recording_of
from .points import points
from .study import Study


def one(study_file: str, folder: str, number: int) -> dict[str, Any]:
    """The row of one run, on whichever node."""
    file = Path(study_file)
    study = Study.read(file)
    record = recording_of(study, Path(folder), number)
    return make(study, file.parent, points(study)[number], record)


def _row(ray: Any, ready: Any, number: int) -> dict[str, Any]:
    """What a run gave.  A node that is lost has cost Ray's own retries before it
    is a row; CncError: a file cannot be written.
    """
    try:
        row: dict[str, Any] = ray.get(ready)
    except ray.exceptions.RayTaskError as error:
        raise CncError(901004, f"run {number}: {error.cause}") from None
    except ray.exceptions.RayError as error:
        first = str(error).strip().partition("\n")[0]
        return {"end": "died", "error": f"its worker or node is lost: {first}"}
    return row


def made(
    study_file: Path,
    folder: Path,
    numbers: Sequence[int],
    address: str | None,
) -> Iterator[int]:
    """The numbers as their rows are left in the folder."""
    try:
        import ray  # noqa: PLC0415  (an extra)
    except ImportError:
        text = 'Ray is not installed: pip install "hli-cosim[ray]"'
        raise CncError(902001, text) from None
    ray.init(address=address, log_to_driver=False, configure_logging=False)
    try:
        remote = ray.remote(one)
        words = str(study_file), str(folder)
        waiting = {remote.remote(*words, number): number for number in numbers}
        while waiting:
            (ready, *_), _ = ray.wait(list(waiting), num_returns=1)
            number = waiting.pop(ready)
            leave(folder, number, _row(ray, ready, number))
            yield number
    finally:
        ray.shutdown()
