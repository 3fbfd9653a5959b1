"""A plan that gets no further says so; its wall time reaches it everywhere."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from cnc_core.config import load_config
from cnc_core.errors import CncError
from cnc_core.planning import plan_program
from cnc_core.planning.watching import PlanWatch
from cnc_core.program import Program

Write = Callable[..., Path]
ENDLESS = {
    "part.nc": "N10 G1 X1 F600\nN20 $WHILE 1\nN30 P1 = 1\nN40 $ENDWHILE\nM30\n",
    "dwells.nc": "N10 G1 X1 F600\nN20 $WHILE 1\nN30 G4 X1\nN40 $ENDWHILE\nM30\n",
}


@pytest.mark.ci
@pytest.mark.parametrize("name", ENDLESS)
def test_a_plan_without_motion_is_told(
    program: Write, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line with the place; the end by the wall time names it again."""
    said: list[str] = []
    source = Program(program(ENDLESS[name], name), load_config(None), "isg")
    looks = itertools.count(0.0, 0.02)  # s of wall time, whatever the load
    with monkeypatch.context() as patched:
        patched.setattr(time, "monotonic", looks.__next__)
        watch = PlanWatch(source, said.append, max_wall=1.5, patience_s=0.1)
        with pytest.raises(CncError) as caught:
            plan_program(source, look=watch.look)
    assert caught.value.code == 905025
    assert "--max-wall" in caught.value.text
    assert caught.value.place.line in (2, 3, 4)
    assert len(said) == 1
    assert said[0].startswith(name)
    assert "waits for the next motion" in said[0]


@pytest.mark.ci
def test_a_plan_that_moves_says_nothing(program: Write) -> None:
    """However short the patience."""
    said: list[str] = []
    text = "".join(f"N{i} G1 X{i % 7} F6000\n" for i in range(20000))
    source = Program(program(text), load_config(None), "isg")
    watch = PlanWatch(source, said.append, max_wall=600.0, patience_s=30.0)
    plan_program(source, look=watch.look)
    assert said == []
