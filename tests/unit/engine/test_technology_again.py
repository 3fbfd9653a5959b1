"""A PLC that ends between fetch and acknowledgement: its function is offered
once more, marked, to the PLC that comes next, and to no other.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from hli._sync import ffi, lib

from hli import layout
from hli.areas import Areas
from plc_client.blocks.program_flow import (
    TechnoArea,
    TechnoArray,
    techno_areas,
)
from support.channels import Channels
from support.inside import Inside

pytestmark = pytest.mark.sanitize("engine", "hli")

CELL = """
[channel.m_synch]
50 = "MOS"
51 = "MVS_SVS"
53 = "MNS_SNS"
54 = "MVS_SLM"
"""
PROGRAM = "N10 G1 X1 F6000\nN20 M51 X2\nN30 M53 X3\nN40 X4\nM30\n"


class Plc:
    """One PLC after the other on the memory of a CNC in this process."""

    def __init__(self, cnc: Inside) -> None:
        self._cnc = cnc
        self.carried: list[tuple[int, bool]] = []
        self._open: list[tuple[TechnoArray, int]] = []
        self.attach()

    def attach(self) -> None:
        """The next PLC; what the one before knew is gone."""
        lib.hs_plc_register(ffi.cast("void *", self._cnc.segment.base))
        self._areas = techno_areas(Areas(self._cnc.segment))
        self._open = []

    def detach(self) -> None:
        self._cnc.side.plc.attached = 0

    def fetch(self) -> None:
        for area in self._areas:
            for array, index, function in area.fetch_all():
                self.carried.append((function.number, function.again))
                self._open.append((array, index))

    def acknowledge(self) -> None:
        for array, index in self._open:
            array.acknowledge(index)
        self._open = []


@pytest.fixture
def cnc(tmp_path: Path) -> Iterator[Inside]:
    with Inside(tmp_path, PROGRAM, CELL) as inside:
        yield inside


def waits(cnc: Inside, number: int) -> None:
    """Until the CNC shows a function."""
    unit = cnc.channel.techno_unit_std_sync[0]
    cnc.until(
        lambda: (
            unit.please_rw
            and layout.HLI_M_H_PROZESS.from_buffer(unit.attribut_r).nr == number
        )
    )


@pytest.mark.parametrize("gap", [0, 1, 50])
def test_a_fetched_function_comes_again_to_the_next_plc(
    cnc: Inside, gap: int
) -> None:
    """Also if nobody has seen that there was no PLC between."""
    plc = Plc(cnc)
    waits(cnc, 51)
    plc.fetch()
    cnc.run(5)
    if gap:
        plc.detach()
        cnc.run(gap)
    plc.attach()
    plc.fetch()
    assert plc.carried == [(51, False)]  # the CNC has had no cycle yet
    cnc.run(1)
    plc.fetch()
    assert plc.carried == [(51, False), (51, True)]
    plc.acknowledge()
    waits(cnc, 53)
    plc.fetch()
    assert plc.carried[-1] == (53, False)
    plc.acknowledge()
    cnc.end()
    assert len(plc.carried) == 3
    assert not any(cnc.side.techno.again)


def test_a_function_nobody_has_fetched_comes_once(cnc: Inside) -> None:
    """It has waited through the change of the PLC, whether the next one fetches
    it before the CNC's next cycle or behind it.
    """
    plc = Plc(cnc)
    waits(cnc, 51)
    plc.attach()
    plc.fetch()
    cnc.run(5)
    plc.fetch()
    assert plc.carried == [(51, False)]
    plc.acknowledge()
    waits(cnc, 53)
    plc.attach()
    cnc.run(3)
    plc.fetch()
    cnc.run(3)
    plc.fetch()
    plc.acknowledge()
    cnc.end()
    assert plc.carried == [(51, False), (53, False)]


def test_what_was_acknowledged_does_not_come_again(cnc: Inside) -> None:
    plc = Plc(cnc)
    waits(cnc, 51)
    plc.fetch()
    plc.acknowledge()
    plc.attach()
    waits(cnc, 53)
    plc.fetch()
    plc.acknowledge()
    cnc.end()
    assert plc.carried == [(51, False), (53, False)]


@pytest.mark.ci
@pytest.mark.parametrize("seed", range(8))
def test_restarts_at_random_lose_and_double_nothing(
    seed: int, tmp_path: Path
) -> None:
    """M functions of four kinds; each comes once, and once more for each PLC
    that ended while it was open.
    """
    rng = random.Random(seed)
    lines, wanted = ["N10 G1 X0 F9000"], []
    for n in range(40):
        number = rng.choice([50, 51, 53, 54])
        wanted.append(number)
        lines.append(f"N{n} M{number} X{n % 7 + 1}")
    with Inside(tmp_path, "\n".join([*lines, "M30", ""]), CELL) as cnc:
        plc, lost = Plc(cnc), []
        while not cnc.state.program_end_r:
            cnc.run(rng.randint(1, 30))
            plc.fetch()
            if rng.random() < 0.3:
                waiting = [n for n, _ in plc.carried[-len(plc._open) :]]
                lost += [n for n in waiting if plc._open and n != 50]
                plc.attach()
            elif rng.random() < 0.6:
                plc.acknowledge()
            assert cnc.engine.state.cycle < 400_000
    first = [number for number, again in plc.carried if not again]
    assert first == wanted
    assert [n for n, again in plc.carried if again] == lost


TWO = """
[channel.m_synch]
51 = "MVS_SVS"
[channels.mill.axes.X]
[channels.mill.spindles.S]
id = 90
m3_synch = "MVS_SVS"
[channels.saw.axes.X]
[channels.saw.spindles.S]
id = 91
m3_synch = "MVS_SVS"
"""


MILL = 4  # behind the axes and spindles of both channels


def test_each_channel_offers_its_own_again(tmp_path: Path) -> None:
    """A function that a dead PLC has fetched comes again from its own channel or
    its spindle, marked; one that it has not fetched comes once, without a mark.
    """
    texts = [
        "M51\nG1 X1 F6000\nM30\n",
        "M51\nM3 S500\nG1 X1 F6000\nM51\nM30\n",
    ]
    with Channels(tmp_path, texts, TWO) as cnc:
        for place in (1, 3):
            cnc.root.axis[place].head.plc_present_w = True
        memory = ffi.cast("void *", cnc.segment.base)
        carried: list[tuple[str, int, bool]] = []

        def fetch(areas: list[TechnoArea], done: bool) -> None:
            for area in areas:
                for array, index, function in area.fetch_all():
                    carried.append(
                        (function.area, function.number, function.again)
                    )
                    if done:
                        array.acknowledge(index)

        lib.hs_plc_register(memory)
        saw = cnc.root.channel[1].techno_unit_std_sync[0]
        cnc.until(lambda: saw.please_rw)
        dead = techno_areas(Areas(cnc.segment))
        fetch(dead[:MILL] + dead[MILL + 1 :], False)
        cnc.run(5)
        lib.hs_plc_register(memory)
        cnc.run(2)
        following = techno_areas(Areas(cnc.segment))
        for _ in range(100):
            cnc.run(5)
            fetch(following, True)
        assert cnc.end() == ["completed"] * 2
        assert not any(cnc.root.sidecar.techno.again)
    assert [one for one in carried if one[0] == "gpCh[0]"] == [
        ("gpCh[0]", 51, False)
    ]
    assert [one for one in carried if one[0] == "gpCh[1]"] == [
        ("gpCh[1]", 51, False),
        ("gpCh[1]", 51, True),
        ("gpCh[1]", 51, False),
    ]


def test_a_spindle_of_a_further_channel_offers_again(tmp_path: Path) -> None:
    """Its units have marks of their own, by the axis."""
    texts = ["G1 X1 F6000\nM30\n", "M3 S500\nG1 X1 F6000\nM30\n"]
    with Channels(tmp_path, texts, TWO) as cnc:
        for place in (1, 3):
            cnc.root.axis[place].head.plc_present_w = True
        memory = ffi.cast("void *", cnc.segment.base)
        lib.hs_plc_register(memory)
        unit = cnc.root.axis[3].techno_unit_std_sync[0]
        cnc.until(lambda: unit.please_rw)
        spindle = techno_areas(Areas(cnc.segment))[3]
        first = [f.again for _, _, f in spindle.fetch_all()]
        cnc.run(3)
        lib.hs_plc_register(memory)
        cnc.run(1)
        found = list(spindle.fetch_all())
        for array, index, _ in found:
            array.acknowledge(index)
        second = [f.again for _, _, f in found]
        assert (first, second) == ([False], [True])
        assert cnc.end() == ["completed"] * 2
