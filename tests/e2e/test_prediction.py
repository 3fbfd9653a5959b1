"""FCT_CALC_TIME, FCT_CALC_POS_V_0, FCT_CALC_STATE_AT_T: what the HLI foresees comes true."""

from __future__ import annotations

import numpy as np
import pytest

from cnc_core import Cell
from plc_client import task
from support.plc.prediction import Hold300, Hold520, Note

PROGRAM = """#CHANNEL SET [ESA_TIME2=0.1]
G00 X20
G00 Y15
G01 X40 F6000
Y30
G02 X20 Y10 R20
G00 X0 Y0
Z5
G01 X15 F4000
M30
"""
FUNCTIONS = (
    '[channel]\ninterpolator_function = "FCT_IPO_DEFAULT | FCT_CALC_T'
    'IME | FCT_CALC_POS_V_0 | FCT_CALC_STATE_AT_T"\n'
)
FUNCTIONS += "esa_time = [0.05, 0.15]\n"
WITHOUT_JERK = "".join(f"[axes.{name}]\nj_max_mm_s3 = 0.0\n" for name in "XYZ")
HOLDS = {300: task(interval=0.001)(Hold300), 520: task(interval=0.001)(Hold520)}


def noted(tmp_path, plc, jerk, functions=FUNCTIONS):
    """What the PLC has seen, cycle by cycle."""
    (tmp_path / "cell.toml").write_text(
        functions + ("" if jerk else WITHOUT_JERK)
    )
    (tmp_path / "part.nc").write_text(PROGRAM)
    with Cell(tmp_path / "cell.toml") as cell:
        result = cell.run(tmp_path / "part.nc", plc=plc)
    assert result.end == "completed", result.errors
    return result.plc["result"]


@pytest.mark.ci
@pytest.mark.parametrize("jerk", [True, False], ids=["jerk", "acceleration"])
def test_time_and_speed_to_come(tmp_path, jerk):
    """The next feed block begins when the channel says; so does the path speed
    50, 150 and 100 ms ahead.
    """
    seen = noted(tmp_path, Note, jerk)
    starts = [
        i
        for i in range(1, len(seen))
        if seen[i - 1]["rapid"] and not seen[i]["rapid"]
    ]
    assert len(starts) == 2
    known = [
        (i, now["eta"])
        for i, now in enumerate(seen)
        if now["eta"] is not None and i < starts[1]
    ]
    assert len(known) > 0.95 * starts[1]
    for i, eta in known:
        start = next(s for s in starts if s > i)
        assert abs(eta - (start - i)) <= max(
            2.0, 0.03 * (start - i)
        )  # curves behind the plan are estimated
    assert all(now["eta"] is None for now in seen[starts[1] + 1 :])
    speeds = np.array([now["feed"] for now in seen])
    for k, ahead in enumerate((50, 150, 100)):
        foreseen = [
            (i, now["esa"][k])
            for i, now in enumerate(seen[: -ahead - 1])
            if now["esa"][k] is not None
        ]
        assert len(foreseen) > 0.4 * len(seen)
        for i, value in foreseen:
            assert abs(value - speeds[i + ahead]) <= 1.0


@pytest.mark.ci
@pytest.mark.parametrize("jerk", [True, False], ids=["jerk", "acceleration"])
@pytest.mark.parametrize("hold_at", [300, 520])
def test_a_hold_comes_to_rest_where_foreseen(tmp_path, jerk, hold_at):
    """From the cycle in which the feed hold is seen on, way and place of rest
    stay as told, to 1 um.
    """
    seen = noted(tmp_path, HOLDS[hold_at], jerk)
    first = next(i for i, now in enumerate(seen) if now["held"])
    rest = next(now for now in seen[first:] if now["feed"] == 0)
    assert seen[first]["feed"] > 0
    for now in seen[first : first + 5]:
        assert abs(now["way"] - (rest["dist"] - now["dist"])) <= 10.0
        assert np.abs(np.array(now["rest"]) - rest["at"]).max() <= 10
        assert now["acs"] == now["rest"]
    assert rest["way"] == pytest.approx(0.0, abs=1.0)
    assert rest["rest"] == rest["at"]


@pytest.mark.ci
def test_nothing_is_foreseen_unless_configured(tmp_path):
    """Without the functions the values stay 0 and not valid."""
    seen = noted(tmp_path, Note, True, "")
    assert all(
        now["eta"] is None and now["way"] is None and now["rest"] == [0, 0, 0]
        for now in seen
    )
    assert all(value is None for now in seen for value in now["esa"])
