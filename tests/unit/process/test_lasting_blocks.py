"""A run that moves, but comes to no other block, says what it waits for."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from cnc_core.process import scene
from support.inside import Inside

LOOP = "N5 G1 X1 F6000\nN10 #RT WHILE\nN20 G1 X11\nN25 X1\nN30 #RT ENDWHILE\n"


def looking(cnc: Inside) -> scene.RunScene:
    """What the process of a run looks through."""
    options: Any = SimpleNamespace(
        run=SimpleNamespace(clock="freerun"),
        once=True,
        name="a",
        wait_plc=True,
    )
    found = scene.RunScene(
        cnc.engine, cnc.segment.root, cnc.cell, options=options
    )
    found.phase, found.preparation = scene.RUNNING, cnc.preparation
    return found


@pytest.mark.parametrize(
    ("text", "unit", "value", "what", "who"),
    [
        (LOOP, "rt_loop_enable", True, scene.LOOP[0], "rt_loop_enable"),
        ("N7 G1 X900 F6000\n", "override", 1, scene.BLOCK, "override 0.1 %"),
    ],
    ids=["loop", "override"],
)
def test_what_lasts_is_told(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    text: str,
    unit: str,
    value: int,
    what: str,
    who: str,
) -> None:
    """A scribbling PLC left a real-time loop on, or an override of 0.1 %: the
    run was held without a word.
    """
    monkeypatch.setattr(scene, "LASTS_WALL_S", 0.0)
    with Inside(tmp_path, text) as cnc:
        look = looking(cnc)
        cnc.level(cnc.bahn.override_valid, True)
        cnc.level(getattr(cnc.bahn, unit), value)
        cnc.run(3000)
        assert cnc.state.active_feed_r
        look()
        cnc.run(2000)
        found = look()
        assert found.cell_s == pytest.approx(2.0)
        ((said, ends),) = found.reasons
        assert said == what
        assert who in ends


def test_a_block_that_has_begun_is_not_told(tmp_path: Path) -> None:
    """A block may take its time."""
    with Inside(tmp_path, "N7 G1 X900 F6000\n") as cnc:
        look = looking(cnc)
        cnc.run(3000)
        look()
        cnc.run(3000)
        assert not look().reasons


@pytest.mark.ci
@pytest.mark.parametrize("block", ["#FLUSH WAIT", "#TIME 0.01"])
def test_a_loop_that_asks_for_a_variable_is_told(
    tmp_path: Path, block: str
) -> None:
    """Each pass was a short wait of its own, so that none was ever told."""
    lines = ["N5 G1 X1 F6000", "N10 $WHILE V.E.GO == 0", f"N15 {block}"]
    text = "\n".join([*lines, "N20 $ENDWHILE", "N25 M30", ""])
    with Inside(tmp_path, text, "[external.GO]\n") as cnc:
        look = looking(cnc)
        cnc.side.plc.attached = True
        cnc.run(500)
        found = []
        for _ in range(8):
            cnc.run(217)
            found.append(look())
        program: Any = cnc.preparation.program
        program.reader.flow.close()
        cell_s = found[-1].cell_s
        assert cell_s is not None
        assert cell_s > 1.0
        ((what, who),) = found[-1].reasons
        assert "loop without motion" in what
        assert "variable" in who
        assert found[-1].key == found[-2].key
