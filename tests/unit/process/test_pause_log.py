"""The marked log (mode 1) over pauses with macros of an IsoNs program: what comes
again is logged again, and nothing stands in it twice.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.units import AnyArray
from hli.handshake import ContourUnit
from hli.layout import HLI_CLAH_LOG_OFF, HLI_CLAH_LOG_ON, HLI_CLAH_LOG_PARAM
from support.channels import AUTOMATIC, Channels

ACTIVE, HOLD = 4, 5
MARKERS = [HLI_CLAH_LOG_ON, HLI_CLAH_LOG_PARAM, HLI_CLAH_LOG_OFF]
CONFIG = "[isons.events]\nM_PAUSE = 61\nM_GOPAUSE = 62\n"
ON = "#CONTOUR LOOKAHEAD LOG ON [PARAM=1]\n"
PARAM = "#CONTOUR LOOKAHEAD LOG [PARAM=2.5]\n"
OFF = "#CONTOUR LOOKAHEAD LOG OFF [PARAM=3]\n"
AREA = f"G60 F6000\nG1 X10\n{ON}X20\n{PARAM}Y20\n%sX30\n{OFF}Y40\n"
PROGRAMS = {"known": AREA % "", "open": AREA % "M20\n"}  # M20: a macro
MACROS = {"M20": "G1 DZ1\nDZ-1\n", "M61": "G1 F3000 DZ5\n", "M62": "G1 DZ-5\n"}
BOTH = 2 * 5e4  # 0.1 um that M_PAUSE and M_GOPAUSE drive


def logged(cnc: Channels) -> AnyArray:
    """All entries of the log."""
    unit = ContourUnit(cnc.hli.gpCh[0].contour_lookahead)
    found: list[AnyArray] = []
    while True:
        assert unit.request(float(sum(map(len, found))), 0.0)
        cnc.run(1)
        count = unit.take()
        if not count:
            return np.concatenate(found)
        found.append(unit.rows[:count].copy())


def place_of(cnc: Channels) -> str:
    """Where the path stands: ahead of the area, in it, or behind."""
    x, y = cnc.positions(0)[:2]
    if y == 0.0 and x < 10.0:
        return "ahead"
    return "behind" if x > 29.999 else "inside"


@pytest.mark.sanitize
@pytest.mark.ci_cases
@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("hold", [*range(1, 700, 23), 138, 139, 140, 141])
def test_each_element_is_logged_once(
    tmp_path: Path, hold: int, program: str
) -> None:
    """The area has its markers once, in order; its elements follow each other, as
    long as what is driven, from where mode 2 tells them.
    """
    for name, text in MACROS.items():
        (tmp_path / f"{name}.isons").write_text(text)
    way = 4e5 + 2e4 * (program == "open")
    with Channels(tmp_path, [PROGRAMS[program]], CONFIG, suffix="isons") as cnc:
        unit = cnc.root.channel[0].channel_mc_control.mode_and_state
        cnc.run(hold)
        cnc.command(0, AUTOMATIC, HOLD)
        cnc.until(lambda: unit.state_r.state == HOLD, 4000)
        place = place_of(cnc)
        cnc.command(0, AUTOMATIC, ACTIVE)
        assert cnc.end() == ["completed"]
        entries = logged(cnc)
    kinds = entries["block_type"]
    marks = np.isin(kinds, MARKERS)
    assert kinds[marks].tolist() == MARKERS
    assert kinds[[0, -1]].tolist() == [HLI_CLAH_LOG_ON, HLI_CLAH_LOG_OFF]
    ways = entries[~marks]
    ends = ways["start_position"] + ways["length"]
    assert ends[:-1] == pytest.approx(ways["start_position"][1:], abs=0.01)
    begins = 1e5 + BOTH * (place == "ahead")
    assert entries["start_position"][0] == pytest.approx(begins, abs=1.0)
    inside = way + BOTH * (place == "inside")
    assert ways["length"].sum() == pytest.approx(inside, abs=1.0)
