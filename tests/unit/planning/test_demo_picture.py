"""The moment that the demo's picture shows."""

from __future__ import annotations

import numpy as np
import pytest

from cnc_core.planning.demo_picture import moment_of
from plc_client.builtin.demo import COLUMNS


def table(rows: list[dict[str, float]]) -> dict[str, np.ndarray]:
    """Columns of the demo PLC's report; a millisecond a row."""
    base = dict.fromkeys(COLUMNS, 0.0) | {
        "override": 100.0,
        "cause_start": -1.0,
        "cause_end": -1.0,
    }
    full = [base | {"cell_time_s": i / 1e3} | row for i, row in enumerate(rows)]
    return {name: np.array([row[name] for row in full]) for name in COLUMNS}


ARC = {"cause_start": 6e4, "cause_end": 9e4, "cause_radius": 2e4}
CORNER = {"cause_start": 7e4, "cause_end": 7e4}


def test_an_arc_ahead_tells_more_than_a_deeper_drop_at_a_corner() -> None:
    """Its scan, both overrides, place and radius in mm."""
    rows = [{}, {"override": 30.0, **CORNER}, {}, {"override": 45.0, **ARC}]
    moment = moment_of(table(rows))
    assert moment is not None
    assert (moment.time_s, moment.before, moment.override) == (0.003, 100, 45)
    assert (moment.cause, moment.cause_end, moment.radius) == (6.0, 9.0, 2.0)
    assert moment.reason == "because of this arc of R 2 mm"


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        ([{}, {"override": 30.0, **CORNER}], "because of this corner"),
        ([{}, {"override": 45.0, **ARC, "dist_prog_start": 6e4}], None),
        ([{}, {}], None),
        ([], None),
    ],
)
def test_without_an_arc_ahead(
    rows: list[dict[str, float]], reason: str | None
) -> None:
    """A corner, or nothing: an arc under the tool shows no look-ahead."""
    moment = moment_of(table(rows))
    assert (moment and moment.reason) == reason
