"""The look-ahead tells the programmed contour, whatever drives it: random
programs against an independent geometry, and smoothed ones against plain ones.

``HLI_COSIM_CONTOURS`` is how many programs each property takes (default 4).
"""

from __future__ import annotations

import functools
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cnc_core.config import parse_config
from cnc_core.process import preparation
from cnc_core.program import Program
from hli import layout
from hli.handshake import BLOCK_ROWS
from support.contour_oracle import (
    MEMBERS,
    Contour,
    Element,
    Facts,
    Oracle,
    differences,
)
from support.contour_programs import Contours
from support.inside import Inside
from support.osai_programs import SETUP_3
from support.seeds import few

pytestmark = pytest.mark.sanitize("engine")

COUNT = int(os.environ.get("HLI_COSIM_CONTOURS", "4"))
CELL = parse_config(
    """
[axes.X]
[axes.Y]
[axes.Z]
[channel]
interpolator_function = "FCT_LOOK_AHEAD_CUSTOM | FCT_CONTOUR_LAH"
lookahead_blocks_max = 1000
lookahead_blocks = 1000
contour_lookahead_log_max = 1000
[tools.1]
radius_mm = 2.0
"""
)
SUFFIX = {"isg": "nc", "iso": "ngc", "isons": "isons", "osai": "osai"}
CASES = [(dialect, seed) for seed in range(COUNT) for dialect in SUFFIX]
EVERYTHING = 1e12


class Machine(Inside):
    """A program of any dialect; answers of several pages."""

    def __init__(
        self,
        folder: Path,
        text: str,
        dialect: str,
        levels: dict[str, Any] | None = None,
        immediate: bool = False,
    ) -> None:
        service = (
            layout.HLI_SERVICE_IMMEDIATE
            if immediate
            else layout.HLI_SERVICE_CYCLIC
        )
        (folder / "CONFIG1").write_text(SETUP_3)
        super().__init__(
            folder,
            text,
            CELL,
            suffix=SUFFIX[dialect],
            levels=levels,
            service=service,
        )
        self._immediate = immediate
        if immediate:
            self.engine.serve_start()

    def log(self) -> list[Facts]:
        """All entries of mode 1."""
        found: list[Facts] = []
        while part := self.ask(len(found), 0.0):
            found += part
        return found

    def ahead(self, start: float = -1.0) -> list[Facts]:
        """All elements that mode 2 tells from a distance on."""
        found = part = self.ask(start, EVERYTHING)
        while len(part) == BLOCK_ROWS:
            start = part[-1]["start_position"] + part[-1]["length"]
            part = self.ask(start, EVERYTHING)
            found += part
        return found

    def ask(self, start: float, length: float) -> list[Facts]:
        """One request; the cycles it takes belong to the run."""
        unit = self.clah
        unit.request.start_position, unit.request.length = start, length
        unit.semaphor_rw = True
        if self._immediate:
            while unit.semaphor_rw:
                pass  # the service's thread answers
        else:
            self.run(1)
        out = []
        for block in unit.response.block:
            if block.block_type == 0:
                break
            out.append({name: float(getattr(block, name)) for name in MEMBERS})
        return out


def _oracle(path: Path, dialect: str) -> Contour:
    (path.parent / "CONFIG1").write_text(SETUP_3)
    program = Program(path, CELL, dialect, programmed=True)
    try:
        return Oracle(CELL.axis_values("start_mm")).follow(program.batches())
    finally:
        close = getattr(program.reader, "close", None)
        if close:
            close()


def _first(contour: Contour, enabled: bool) -> list[Facts]:
    """What is known ahead of the start: up to a reset, up to the end of a loop
    that will be driven, up to the beginning of one that will not.
    """
    return [
        e.facts
        for e in contour.elements
        if e.epoch == 0 and (enabled or e.loop < 0)
    ]


def _driven(contour: Contour) -> Iterator[tuple[list[Element], set[int]]]:
    """Elements between two resets, with any of the loops left out."""
    for number in sorted({e.section for e in contour.elements}):
        section = [e for e in contour.elements if e.section == number]
        loops = sorted({e.loop for e in section if e.loop >= 0})
        for bits in range(1 << len(loops)):
            out = {loop for k, loop in enumerate(loops) if bits >> k & 1}
            yield [e for e in section if e.loop not in out], out


def _turn_back(cnc: Machine) -> None:
    cnc.level(cnc.bahn.backward_motion, True)
    cnc.run(300)


@pytest.mark.ci_cases
@pytest.mark.parametrize(("dialect", "seed"), few(CASES, len(CASES) // 2))
@pytest.mark.parametrize("service", ["cyclic", "immediate"])
def test_every_member_is_what_geometry_says(
    tmp_path: Path, dialect: str, seed: int, service: str
) -> None:
    """isg_contour_lookahead 5.4: log and mode 2, forward and backward, real-time
    loops repeated and left out.
    """
    program, enabled = Contours(seed, dialect), seed % 2 == 0
    path = tmp_path / f"plain.{SUFFIX[dialect]}"
    path.write_text(program.plain)
    due = _oracle(path, dialect)
    immediate = service == "immediate"
    levels = {"rt_loop_enable": enabled}
    with Machine(tmp_path, program.text, dialect, levels, immediate) as cnc:
        if dialect == "osai":  # whose setups and profiles wait for the path
            _tell_everything(cnc, due)
            return
        assert differences(cnc.ahead(), _first(due, enabled)) == []
        assert differences(cnc.log(), due.log) == []
        for _ in range(6):
            cnc.run(200)
            _is_a_stretch(cnc.ahead(), due)
        _turn_back(cnc)
        _is_a_stretch(cnc.ahead(), due)
        assert differences(cnc.log(), due.log) == []
        cnc.level(cnc.bahn.backward_motion, False)
        cnc.level(cnc.bahn.rt_loop_enable, False)
        cnc.end()
        assert differences(cnc.log(), due.log) == []
        _is_a_stretch(cnc.ahead(), due)


def _tell_everything(cnc: Machine, due: Contour) -> None:
    """All elements are told ahead of where the path is, backward too."""
    told = set()
    for step in range(20_000):
        if cnc.state.program_end_r:
            break
        answer = cnc.ahead()
        _is_a_stretch(answer, due)
        told |= {(e["block_count_r"], e["start_position"]) for e in answer}
        cnc.run(100)
        if step == 8:
            _turn_back(cnc)
            _is_a_stretch(cnc.ahead(), due)
            cnc.level(cnc.bahn.backward_motion, False)
    assert len(told) == len(due.elements)


def _is_a_stretch(answer: list[Facts], due: Contour) -> None:
    """The answer is a stretch of the contour as it is driven."""
    closest: list[str] = []
    for driven, left_out in _driven(due):
        for at in range(len(driven) - len(answer) + 1):
            part = driven[at : at + len(answer)]
            wrong = _wrong(answer, part, bool(due.loops))
            if not wrong:
                return
            if not closest or len(wrong) < len(closest):
                closest = [*wrong, f"without loops {left_out}"]
    raise AssertionError(closest)


def _wrong(answer: list[Facts], part: list[Element], loops: bool) -> list[str]:
    """Differences; passes of loops shift distances alike, and decide what an
    element follows.
    """
    expected = []
    shift = 0.0
    if loops and part:
        shift = answer[0]["start_position"] - part[0].facts["start_position"]
    for mine, element in zip(answer, part, strict=True):
        facts = dict(element.facts)
        facts["start_position"] += shift
        for other in (element.again, element.skipped):
            if other is not None and (
                abs(mine["tangent_variation"] - other) < 1e-4
            ):
                facts["tangent_variation"] = other
        expected.append(facts)
    return differences(answer, expected)


@pytest.mark.ci_cases
@pytest.mark.parametrize(("dialect", "seed"), few(CASES, len(CASES) // 2))
def test_a_tolerance_changes_nothing_that_is_told(
    tmp_path: Path, dialect: str, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """isg_contour_lookahead 5.4: smoothing changes what is driven only."""
    program = Contours(seed, dialect)
    with Machine(tmp_path, program.plain, dialect) as cnc:
        plain = [cnc.ahead(), cnc.log()]
    monkeypatch.setattr(
        preparation, "Program", functools.partial(Program, tolerance=0.05)
    )
    with Machine(tmp_path, program.plain, dialect) as cnc:
        assert differences(cnc.ahead(), plain[0]) == []
        assert differences(cnc.log(), plain[1]) == []


TILTED = """N10 G17 G90
N20 #CS ON [0, 0, 0, -14, 47, -27]
N30 #HSC ON [BSPLINE PATH_DEV = 0.05]
N40 G1 X10 F3000
N50 G3 X20 Y10 J10
N60 G1 Y25
N70 G3 X10 Y35 I-10
N80 #HSC OFF
N90 #CS OFF
N100 G1 X0
M30
"""


def test_smoothing_in_a_tilted_frame_turns_no_element(tmp_path: Path) -> None:
    """A circle of a tilted plane is driven in pieces; what follows it is told
    from its programmed end.  All of N40 to N70 are tangential.
    """
    plain = TILTED.replace("#HSC", "; #HSC")
    with Machine(tmp_path, plain, "isg") as cnc:
        expected = cnc.ahead()
    with Machine(tmp_path, TILTED, "isg") as cnc:
        told = cnc.ahead()
    assert [e["tangent_variation"] for e in told[:4]] == pytest.approx([0] * 4)
    assert differences(told, expected) == []
