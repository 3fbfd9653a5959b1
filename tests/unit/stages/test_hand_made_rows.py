"""Rows that no front end makes, handed to the stages in C by hand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cnc_core.blocks import (
    CIRCULAR,
    COMPENSATION,
    CONTOUR,
    NC_BLOCK,
    POLYNOMIAL,
    BlockBatch,
)
from cnc_core.errors import Place
from cnc_core.geometry.stages.contouring import Contouring, ContourMachine
from cnc_core.geometry.stages.radius_compensation import RadiusCompensation
from cnc_core.geometry.stages.smoothing import Smoothing
from cnc_core.geometry.stages.stage import RefusedRow
from support.smoothed_paths import MACHINE

pytestmark = pytest.mark.sanitize(
    "stages/smoothing", "stages/contouring", "stages/compensation"
)

AXES, DEGREE = 3, 4
NEED = AXES * (DEGREE + 1)


def contouring() -> Contouring:
    return Contouring(
        np.zeros(AXES),
        ContourMachine((0, 1, 2), 3000.0, 300.0, {}),
        lambda *_: Place("", 0),
        lambda _: None,
    )


def smoothing() -> Smoothing:
    return Smoothing(np.zeros(AXES), MACHINE, 0.1)


def curve(first: int, degree: int = DEGREE) -> Any:
    """A polynomial row whose coefficients begin at ``first``."""
    row = np.zeros(1, NC_BLOCK)
    row["type"], row["degree"], row["pool"] = POLYNOMIAL, degree, first
    row["length"], row["angle"], row["value"] = 1.0, 1.0, 1000.0
    row["end"][0, 0] = 1.0
    return row


def on() -> Any:
    """The row that makes contouring look at what follows."""
    row = np.zeros(1, NC_BLOCK)
    row["type"] = CONTOUR
    return row


@pytest.mark.parametrize(
    ("rows", "numbers"),
    [
        (curve(0), 0),
        (curve(0), NEED - 1),
        (curve(1), NEED),
        (curve(2**32 - 1), NEED),
        (curve(0, 255), NEED),
    ],
    ids=["none", "one short", "behind", "far away", "degree"],
)
@pytest.mark.parametrize("stage", [smoothing, contouring])
def test_coefficients_outside_the_pool_are_refused(
    stage: Callable[[], Smoothing | Contouring], rows: Any, numbers: int
) -> None:
    """Nothing is copied from memory that is not the batch's."""
    batch = BlockBatch(np.concatenate([on(), rows]), np.zeros(numbers))
    with pytest.raises(ValueError, match="coefficients outside the pool"):
        stage().push(batch)


@pytest.mark.parametrize("stage", [smoothing, contouring])
def test_coefficients_at_the_pools_end_are_taken(
    stage: Callable[[], Smoothing | Contouring],
) -> None:
    """The last number of the pool is the row's last coefficient."""
    pool = np.arange(7.0 + NEED)
    one = stage()
    out = [one.push(BlockBatch(curve(7), pool)), one.drain()]
    rows = np.concatenate([part.rows for part in out])
    owner = next(part for part in out if POLYNOMIAL in part.rows["type"])
    at = int(owner.rows["pool"][owner.rows["type"] == POLYNOMIAL][0])
    assert POLYNOMIAL in rows["type"]
    assert np.array_equal(owner.pool[at : at + NEED], pool[7:])


@pytest.mark.parametrize("plane", [0, 16, 20, 255])
@pytest.mark.parametrize("stage", [smoothing, contouring])
def test_a_circle_of_no_plane_is_refused(
    stage: Callable[[], Smoothing | Contouring], plane: int
) -> None:
    """Its axes are looked up by the plane's number."""
    row = np.zeros(1, NC_BLOCK)
    row["type"], row["plane"] = CIRCULAR, plane
    row["length"], row["radius"], row["angle"] = 1.0, 1.0, 1.0
    with pytest.raises(ValueError, match="a plane that the channel lacks"):
        stage().push(BlockBatch(np.concatenate([on(), row])))


@pytest.mark.parametrize(
    ("plane", "main"), [(20, (0, 1, 2)), (0, (0, 1, 2)), (18, (0, 1, -1))]
)
def test_compensation_in_no_plane_is_an_error(
    plane: int, main: tuple[int, int, int]
) -> None:
    """By number; compensation stays off."""
    row = np.zeros(1, NC_BLOCK)
    row["type"], row["plane"], row["code"] = COMPENSATION, plane, 41
    stage = RadiusCompensation(np.zeros(AXES), main, lambda *_: Place("", 0))
    with pytest.raises(RefusedRow) as refused:
        stage.push(BlockBatch(row))
    assert refused.value.error.code == 900016


def test_a_tolerance_of_nothing_drives_an_arc_exactly() -> None:
    """It would need chords without end: `#HSC ON [PATH_DEV=1e-12]` stood still."""
    row = np.zeros(1, NC_BLOCK)
    row["type"], row["plane"], row["feed"] = CIRCULAR, 17, 100.0
    row["center"], row["radius"] = (10_000.0, 0.0), 10_000.0
    row["angle"], row["length"] = np.pi, np.pi * 10_000.0
    row["end"][0, 0] = 20_000.0
    stage = Smoothing(np.zeros(AXES), MACHINE, 1e-12)
    out = np.concatenate([stage.push(BlockBatch(row)).rows, stage.drain().rows])
    assert out["type"].tolist() == [CIRCULAR]
