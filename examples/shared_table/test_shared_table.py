"""The example's claim: both drills turn one table, and no degree is lost."""

from pathlib import Path

import pytest

from cnc_core import Cell

HERE = Path(__file__).parent


@pytest.mark.parametrize("clock", ["lockstep", "freerun"])
def test_the_table_goes_to_and_fro(clock):
    """Each drill turns it three times: the table ends where the ways of both
    together bring it, at home, and stands while it is nobody's.
    """
    programs = [HERE / "left.nc", HERE / "right.nc"]
    with Cell(HERE / "cell.toml") as cell:
        result = cell.run(programs, HERE / "table.py", clock=clock).check()
    assert [one["end"] for one in result.channels] == ["completed"] * 2
    assert result.plc["result"]["degrees"] == 3 * (40 + 20)
    assert result.plc["result"]["moved_alone"] == 0
    if clock == "lockstep":
        assert result.plc["result"]["holders"] == [1, 0, 1, 0, 1, 0, 1]
