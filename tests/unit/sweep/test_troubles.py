"""What lies in the machine is no result of a run: a full disk, a killed process,
a launcher or a node that is gone.
"""

from __future__ import annotations

import socket
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from cnc_core.cell import warm
from cnc_core.errors import CncError
from cnc_core.sweep import on_ray, one
from cnc_core.sweep.ledger import Ledger, row_file
from cnc_core.sweep.points import points
from cnc_core.sweep.study import Study


@pytest.fixture
def study(tmp_path: Path) -> Study:
    file = tmp_path / "study.toml"
    file.write_text('programs = ["part.nc"]\n')
    return Study.read(file)


def failing(monkeypatch: pytest.MonkeyPatch, *errors: Exception) -> list[int]:
    """Runs fail with one error after the other, then they are good; the tries."""
    tries: list[int] = []

    def measured(*_: object) -> dict[str, Any]:
        tries.append(1)
        if len(tries) <= len(errors):
            raise errors[len(tries) - 1]
        return {"figure": 7}

    monkeypatch.setattr(one, "_measured", measured)
    monkeypatch.setattr(one, "PAUSE_S", 0.0)
    return tries


def test_a_killed_process_is_tried_again(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The row is that of the run that came through."""
    tries = failing(monkeypatch, CncError(905001, "the CNC process died"))
    row = one.make(study, tmp_path, points(study)[0], None)
    assert (row["end"], row["figure"], len(tries)) == ("completed", 7, 2)


def test_a_process_that_always_dies_is_a_row(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With its message, after three tries."""
    tries = failing(monkeypatch, *[CncError(905001, "died")] * 5)
    row = one.make(study, tmp_path, points(study)[0], None)
    assert (row["end"], len(tries)) == ("error", 3)
    assert "died" in row["error"]


@pytest.mark.parametrize(
    "error",
    [
        CncError(901004, "recording: cannot be written"),
        CncError(905001, "segment: No space left on device"),
    ],
)
def test_a_full_disk_is_no_row(
    study: Study,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    error: CncError,
) -> None:
    """The sweep is told, so that the run is made again later; nothing is left of
    its recording.
    """
    failing(monkeypatch, *[error] * 5)
    left = tmp_path / "0.parquet.parts"
    left.mkdir()
    with pytest.raises(OSError, match=error.text):
        one.make(study, tmp_path, points(study)[0], tmp_path / "0.parquet")
    assert not left.exists()


def test_a_torn_row_is_made_again(tmp_path: Path) -> None:
    """Half a file of a machine that died is dropped."""
    ledger = Ledger(tmp_path)
    row_file(tmp_path, 3).write_text('{"end": "comp')
    row_file(tmp_path, 4).write_text('{"end": "completed"}')
    ledger.take_over()
    assert list(ledger.rows()) == [4]
    assert not row_file(tmp_path, 3).exists()
    ledger.close()


def test_a_launcher_that_is_gone_ends_the_warm_process() -> None:
    """Without a word, also where it has left answers unread."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours:
        ours.send(b"an answer that nobody reads")
        theirs.close()
        assert warm._received(ours) == (b"", [])


class FakeRay(ModuleType):
    """One node: the task's outcome by its number."""

    def __init__(self, outcomes: dict[int, Any]) -> None:
        super().__init__("ray")
        lost = type("NodeDiedError", (Exception,), {})
        task = type("RayTaskError", (lost,), {"cause": "no space"})
        self.exceptions = SimpleNamespace(RayError=lost, RayTaskError=task)
        self._outcomes = outcomes

    def init(self, **_: object) -> None: ...

    def shutdown(self) -> None: ...

    def remote(self, _: object) -> Any:
        return SimpleNamespace(remote=lambda *words: words[-1])

    def wait(self, waiting: list[int], num_returns: int) -> Any:
        return waiting[:num_returns], waiting[num_returns:]

    def get(self, number: int) -> Any:
        found = self._outcomes[number]
        if isinstance(found, str):
            raise getattr(self.exceptions, found)("lost\nin detail")
        return found


def test_a_lost_node_loses_nothing_that_was_complete(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its run is a row with the reason; the others are what they were."""
    ledger = Ledger(tmp_path)
    fake = FakeRay({0: {"end": "completed"}, 1: "RayError", 2: {"end": "e"}})
    monkeypatch.setitem(sys.modules, "ray", fake)
    for number in on_ray.made(tmp_path, tmp_path, [0, 1, 2], None):
        ledger.enter(number)
    rows = ledger.rows()
    assert [rows[i]["end"] for i in range(3)] == ["completed", "died", "e"]
    assert "node is lost: lost" in rows[1]["error"]
    fake = FakeRay({3: "RayTaskError"})
    monkeypatch.setitem(sys.modules, "ray", fake)
    with pytest.raises(CncError, match="run 3: no space"):
        list(on_ray.made(tmp_path, tmp_path, [3], None))
    ledger.close()
