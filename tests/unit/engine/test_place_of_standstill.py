"""FCT_CALC_POS_V_0 under jerk: the place of rest that the PLC is told is where
a hold in the next cycle ends.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from support.inside import Inside

CONFIG = (
    '[channel]\ninterpolator_function = "FCT_IPO_DEFAULT | FCT_CALC_POS_V_0"\n'
)
LINE = "G1 X200 F12000\n"
FEEDS = "G1 X30 F12000\nG1 X60 F3000\nG1 X120 F12000\n"
WAVE = "F6000\n" + "".join(
    f"G1 X{i * 0.5:.4f} Y{3 * math.sin(i * 0.2):.4f}\n" for i in range(1, 200)
)
TENTH_UM = 1e4

# while the acceleration falls just below the feed, where no stop is found at
# once; in the last cycles ahead of a commit
CASES = [
    (LINE, cycle)
    for cycle in (20, 41, 48, 55, 62, 69, 90, 132, 202, 265, 342, 419)
]
CASES += [(FEEDS, cycle) for cycle in (41, 146, 153, 160, 167, 174, 335, 412)]
CASES += [(WAVE, cycle) for cycle in (27, 34, 41, 90, 356, 629)]


@pytest.mark.parametrize(
    ("text", "cycle"),
    CASES,
    ids=[f"{text[3:6]}-{cycle}".replace(" ", "") for text, cycle in CASES],
)
def test_the_place_of_rest_is_where_a_hold_rests(
    tmp_path: Path, text: str, cycle: int
) -> None:
    """Within 5 % of the way (it was nine times too far, or a commit too near)."""
    with Inside(tmp_path, text, CONFIG) as cnc:
        cnc.run(cycle)
        assert cnc.state.pos_v_0_valid_r
        place = [cnc.state.pos_v_0_pcs_r[i] / TENTH_UM for i in range(3)]
        told, begin = (
            cnc.state.dist_v_0_r / TENTH_UM,
            float(cnc.engine.state.path),
        )
        cnc.level(cnc.bahn.feedhold, True)
        cnc.until(
            lambda: (
                len(cnc.pos) > cycle + 5
                and bool((cnc.pos[-4:] == cnc.pos[-1]).all())
            )
        )
        way = float(cnc.engine.state.path) - begin
        assert told == pytest.approx(way, rel=0.055, abs=0.002)
        assert math.dist(cnc.pos[-1], place) < 0.06 * way + 0.01
