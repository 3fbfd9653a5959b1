"""The soak in small: ``bench/soak.py`` runs a simulated week of the same lots."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import soak_cell
from soak import Lot, drive, grown, judged, soak
from soak_cell import Sums
from soak_programs import Part, part

MOTIONS = 25


@pytest.fixture(scope="module")
def lot(tmp_path_factory: pytest.TempPathFactory) -> Lot:
    """A cell with a program of each dialect."""
    return drive(3, 1, MOTIONS, tmp_path_factory.mktemp("soak"))


def test_a_lot_keeps_all_promises(lot: Lot) -> None:
    """Ends, ways, requests and functions as the oracle has them, no stand
    without a reason, nothing left.
    """
    sums = lot.sums
    assert sums.wrong == judged(sums) == []
    assert sums.programs == 4
    assert sums.requests > 0
    assert sums.functions > 0
    assert sums.worst_end_nm < 1.0
    assert sums.waits_cycles > 0
    assert lot.held["files"] == 0


@pytest.mark.ci
def test_a_log_is_gone_on_with(lot: Lot) -> None:
    """A line says all; seeds that are there are not driven once more."""
    assert Lot.read(lot.line()) == lot
    assert list(soak(1, 3, [lot], 1, MOTIONS)) == []
    (more,) = soak(lot.sums.cycles + 1, 3, [lot], 1, MOTIONS)
    assert more.seed == 4


@pytest.mark.ci
def test_a_wrong_way_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An oracle that has another length for the last motion."""

    def longer(*words: Any) -> Part:
        one = part(*words)
        one.way += 1e-4
        return one

    monkeypatch.setattr(soak_cell, "part", longer)
    sums = drive(3, 1, MOTIONS, tmp_path).sums
    assert any("nm a metre" in text for text in sums.wrong)


def test_stands_and_growth_are_told(lot: Lot) -> None:
    """A path that starves or stands for no reason, a process that holds more."""
    starved = Sums(no_blocks_cycles=2, unexplained_longest=5)
    assert len(judged(starved)) == 2
    held = {"memory": 1 << 30, "descriptors": 99, "files": 1}
    assert len(grown([lot, Lot(4, 1.0, Sums(), held)])) == 3
