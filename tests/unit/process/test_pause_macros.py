"""HOLD and RESET with macros of an IsoNs program: what is left out comes once
more, nothing twice, and the path has no jump.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core.units import FloatArray
from hli.layout import HLI_M_H_PROZESS
from support.channels import AUTOMATIC, Channels

ACTIVE, HOLD, STOPPING, RESET, SELECTED = 4, 5, 13, 15, 2
MACROS = {
    "M61": "G1 F3000 DZ5\n",
    "M62": "G1 F3000 DZ-5\n",
    "M63": "M20\nDZ2\n",
}
BOTH = "M_PAUSE = 61\nM_GOPAUSE = 62\n"
PATH = "G1 F6000 X50\nX60 Y10\nX10 Y10\n"
SHORT = "G1 F6000 X10\nX20 Y10\n"
HALTED = (
    "G60 F6000\nG1 X100\n@LOOP\nIF $_Q0 > 30\nGOTO STOP\nEND_IF\nGOTO LOOP\n"
    "@STOP\nG101\nG1 F6000 Y10\n"
)
CYCLE_MM = 0.31  # the longest way of a cycle, at 300 mm/s
ONE = '[channel]\ninterpolator_function = "FCT_IPO_DEFAULT"\n'


class Cell:
    """A program with macros; functions are fetched and acknowledged at once."""

    def __init__(
        self,
        folder: Path,
        text: str,
        events: str,
        synch: str | dict[int, str] = "MVS_SVS",
        late: int = 0,
    ) -> None:
        """``synch``: of M20 and M21, or by number.  ``late``: cycles until a
        function is acknowledged.
        """
        for name, macro in MACROS.items():
            (folder / f"{name}.isons").write_text(macro)
        given = {20: synch, 21: synch} if isinstance(synch, str) else synch
        modes = "".join(f'{nr} = "{how}"\n' for nr, how in given.items())
        config = (
            f"{ONE}[channel.m_pre_outp]\n26 = 200000\n27 = 300000\n"
            f"[channel.m_synch]\n{modes}"
            f"[isons.events]\n{events}"
        )
        self.cnc = Channels(folder, [text], config, suffix="isons")
        self.channel = self.cnc.root.channel[0]
        self.places = [self.position()]
        self.codes: list[int] = []
        self._late = late
        self._open: list[tuple[int, Any]] = []

    def close(self) -> None:
        self.cnc.__exit__()

    def position(self) -> FloatArray:
        return np.array(self.cnc.positions(0))

    @property
    def state(self) -> int:
        unit = self.channel.channel_mc_control.mode_and_state
        return int(unit.state_r.state)

    def order(self, target: int) -> None:
        self.cnc.command(0, AUTOMATIC, target)

    def backward(self, value: bool) -> None:
        unit = self.channel.bahn_mc_control.backward_motion
        unit.enable_w, unit.command_w = True, value

    def level(self, unit: str, value: bool) -> None:
        self.cnc.level(0, unit, value)

    def press(self, unit: str) -> None:
        """A rising edge that the CNC sees."""
        self.level(unit, True)
        self.run(2)
        self.level(unit, False)

    @property
    def stop_condition(self) -> int:
        return int(self.channel.bahn_state.stop_condition_r)

    def run(self, cycles: int) -> None:
        for _ in range(cycles):
            self.cnc.run(1)
            self.places.append(self.position())
            for unit in (
                *self.channel.techno_unit_std_sync,
                *self.channel.techno_unit_late_sync,
            ):
                if unit.please_rw:
                    code = HLI_M_H_PROZESS.from_buffer_copy(unit.attribut_r)
                    self.codes.append(code.nr)
                    unit.please_rw = False
                    self._open.append((len(self.places) + self._late, unit))
            while self._open and self._open[0][0] <= len(self.places):
                self._open.pop(0)[1].done_w = True

    def until(self, what: Callable[[], bool], most: int = 5000) -> None:
        for _ in range(most):
            if what():
                return
            self.run(1)
        pytest.fail(f"not within {most} cycles; state {self.state}")

    def ends(self) -> None:
        self.until(lambda: not self.cnc.channels[0].modes.running)

    @property
    def way(self) -> float:
        steps = np.linalg.norm(np.diff(self.places, axis=0), axis=1)
        assert steps.max() < CYCLE_MM
        return float(steps.sum())


Make = Callable[..., Cell]


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Make]:
    """A cell, as its class takes it."""
    made: list[Cell] = []

    def one(*args: Any) -> Cell:
        made.append(Cell(tmp_path, *args))
        return made[-1]

    yield one
    for cell in made:
        cell.close()


@pytest.mark.sanitize
@pytest.mark.ci_cases
@pytest.mark.parametrize("hold", [200, 239, 300, 369])
def test_a_hold_while_it_brakes_to_its_end_drives_nothing_again(
    make: Make, hold: int
) -> None:
    """M_PAUSE and M_GOPAUSE are executed where it stands; then comes what is left."""
    cell = make(SHORT, BOTH)
    cell.run(hold)
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    assert cell.position()[2] == 5.0
    cell.order(ACTIVE)
    cell.ends()
    assert cell.position().tolist() == [20.0, 10.0, 0.0]
    assert cell.way == pytest.approx(10.0 + 10.0 * 2**0.5 + 10.0, abs=1e-3)


def test_a_hold_behind_the_end_is_refused(make: Make) -> None:
    """In the cycle in which the program ends: no macro moves an axis."""
    cell = make(SHORT, BOTH)
    cell.until(lambda: cell.position()[0] == 20.0)
    for _ in range(12):
        if not cell.cnc.channels[0].modes.running:
            break
        cell.order(HOLD)
        cell.run(1)
    cell.run(600)
    assert cell.position().tolist()[:2] == [20.0, 10.0]
    assert cell.state in (HOLD, SELECTED)
    assert (cell.position()[2] == 5.0) == (cell.state == HOLD)


@pytest.mark.ci_cases
@pytest.mark.parametrize("again", [51, 60, 100, 200, 245])
def test_active_while_the_pause_begins_is_not_lost(
    make: Make, again: int
) -> None:
    """It still brakes, or M_PAUSE runs: behind that the program goes on."""
    cell = make(PATH, BOTH)
    cell.run(50)
    cell.order(HOLD)
    cell.run(again - 50)
    cell.order(ACTIVE)
    cell.run(2)
    assert cell.state == STOPPING
    cell.ends()
    assert cell.position().tolist() == [10.0, 10.0, 0.0]
    assert cell.way == pytest.approx(50 + 10 * 2**0.5 + 50 + 10, abs=1e-3)


def test_a_second_active_does_not_take_the_next_hold_away(make: Make) -> None:
    """It comes while M_GOPAUSE runs, and asks for nothing that does not come."""
    cell = make(PATH, BOTH)
    cell.run(50)
    cell.order(HOLD)
    cell.run(10)
    cell.order(ACTIVE)
    cell.until(lambda: cell.position()[2] == 5.0)
    cell.until(lambda: cell.position()[2] < 4.0)
    cell.order(ACTIVE)
    cell.until(lambda: cell.state == ACTIVE)
    cell.run(50)
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    at = cell.position()
    cell.run(300)
    assert cell.position().tolist() == at.tolist()


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    ("stop", "z"),
    [
        (55, (2.0, 2.0)),
        (110, (2.0, 2.0)),
        (260, (2.0, 7.0)),
        (420, (7.0, 7.0)),
        (1120, (2.0, 7.0)),
        (1300, (2.0, 2.0)),
    ],
)
def test_a_reset_during_a_pause_ends_the_program(
    make: Make, stop: int, z: tuple[float, float]
) -> None:
    """Whether it brakes, parks, stands or goes back: M_STOP alone comes."""
    cell = make(PATH, BOTH + "M_STOP = 63\n")
    cell.run(50)
    cell.order(HOLD)
    for cycle in range(51, 2000):
        if cycle == stop:
            cell.order(RESET)
        elif cycle == 1000 and stop > 1000:
            cell.order(ACTIVE)
        cell.run(1)
    assert cell.state == SELECTED
    assert not cell.cnc.channels[0].modes.running
    assert cell.codes == [20]
    assert z[0] - 1e-9 <= cell.position()[2] <= z[1] + 1e-9
    assert cell.position()[0] < 60.0
    assert cell.way > 10.0
    cell.order(RESET)
    cell.run(3)
    assert cell.state == SELECTED


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    "synch", ["MVS_SVS", "MNS_SNS", "MOS", "MVS_SNS", "MVS_SLM"]
)
@pytest.mark.parametrize("hold", [40, 160, 420, 560, 640])
def test_functions_behind_a_pause_come_once(
    make: Make, synch: str, hold: int
) -> None:
    """Those that were left out with the path are put out when it goes on."""
    text = "G1 F6000 X50\nM20\nX60 Y10 M21\nM20\nX70\nM21\n"
    cell = make(text, BOTH, synch)
    cell.run(hold)
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    cell.order(ACTIVE)
    cell.ends()
    assert cell.codes == [20, 21, 20, 21]
    assert cell.position().tolist() == [70.0, 10.0, 0.0]


MODES = {
    20: "MVS_SVS",
    21: "MNS_SNS",
    22: "MOS",
    23: "MVS_SNS",
    24: "MVS_SLP",
    25: "MVS_SLM",
    26: "MEP_SVS",
    27: "MET_SVS",
}
BLOCKS = ["M21 M20", "M20 M21", "M23 M22", "M23 M24", "M21 M24", "M22 M23 M20"]
BLOCKS += ["X30 M21 M20", "X30 M20 M21 M23", "X30\nM26", "X30\nM27 M21"]


@pytest.mark.sanitize
@pytest.mark.ci_cases
@pytest.mark.parametrize("blocks", BLOCKS)
@pytest.mark.parametrize("late", [0, 400])
@pytest.mark.parametrize("share", [0.1, 0.3, 0.45, 0.6, 0.85])
def test_functions_of_one_block_come_once_and_in_order(
    make: Make, blocks: str, late: int, share: float
) -> None:
    """A pause changes neither which functions the PLC gets nor their order, and
    nothing waits for one that has been put out.  ``share``: of the program's time.
    """
    text = f"G1 F6000 X5\n{blocks}\nX40\nM22\nX45\n"
    plain = make(text, "", MODES, late)
    plain.ends()
    cell = make(text, BOTH, MODES, late)
    cell.run(int(share * len(plain.places)))
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    cell.order(ACTIVE)
    cell.ends()
    assert cell.codes == plain.codes
    assert cell.position().tolist() == [45.0, 0.0, 0.0]
    assert cell.way == pytest.approx(55.0, abs=1e-3)


@pytest.mark.parametrize("synch", ["MVS_SLM", "MVS_SVS", "MNS_SNS"])
def test_motion_waits_for_functions_put_out_before_a_pause(
    make: Make, synch: str
) -> None:
    """M20 is acknowledged long after the pause: only the macros move meanwhile."""
    cell = make("G1 F6000 X5\nM20\nX20\n", BOTH, synch, 1200)
    cell.run(160)
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    cell.order(ACTIVE)
    cell.run(500)
    assert cell.position().tolist() == [5.0, 0.0, 0.0]
    cell.ends()
    assert cell.codes == [20]
    assert cell.position().tolist() == [20.0, 0.0, 0.0]


def test_a_function_is_awaited_behind_a_pause(make: Make) -> None:
    """HOLD while M20 waits: it is not put out again, and the next motion waits
    for its acknowledgement.
    """
    cell = make("G1 F6000 X5\nM20\nX20\n", "M_GOPAUSE = 62\n")
    unit = cell.channel.techno_unit_std_sync[0]
    cell.cnc.until(lambda: bool(unit.please_rw))
    unit.please_rw = False
    cell.cnc.run(20)
    cell.order(HOLD)
    cell.cnc.until(lambda: cell.state == HOLD)
    cell.order(ACTIVE)
    cell.cnc.run(300)
    assert cell.position()[0] == 5.0
    assert not unit.please_rw
    unit.done_w = True
    cell.ends()
    assert cell.position().tolist() == [20.0, 0.0, 0.0]
    assert cell.codes == []


def test_functions_behind_g101_come(make: Make) -> None:
    """What it leaves out is awaited no more."""
    text = "G1 F6000 X50\nM20\nX60 Y10\nG101\nM21\nG1 X5\n"
    cell = make(text, "")
    cell.ends()
    assert cell.codes == [21]
    assert cell.position()[0] == 5.0


@pytest.mark.parametrize("behind", [0, 1, 5, 20, 60])
def test_a_hold_while_g101_brakes_drives_nothing_that_it_left_out(
    make: Make, behind: int
) -> None:
    """G101 leaves out the rest of X100; the pause adds its macros, then comes Y10."""
    plain = make(HALTED, "")
    plain.ends()
    stood = plain.position()[0]
    assert 30.0 < stood < 60.0
    cell = make(HALTED, BOTH)
    cell.until(lambda: cell.position()[0] > 30.0)
    cell.run(behind)
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    assert cell.position()[2] == 5.0
    cell.order(ACTIVE)
    cell.ends()
    assert cell.position().tolist() == [stood, 10.0, 0.0]
    assert cell.way == pytest.approx(stood + 20.0, abs=1e-3)


@pytest.mark.parametrize("back", [55, 120, 300])
def test_a_stop_is_no_way_back(make: Make, back: int) -> None:
    """Backward motion behind a RESET does not drive what was left out."""
    cell = make(PATH, "M_STOP = 63\n")
    cell.run(50)
    cell.order(RESET)
    cell.run(back - 50)
    cell.backward(True)
    cell.run(1000)
    assert cell.position()[0] < 25.0
    assert cell.position()[1] == 0.0
    cell.backward(False)
    cell.ends()
    assert cell.way < 40.0


def test_a_hold_on_the_way_back_only_stands(make: Make) -> None:
    """Macros belong to the way forward: the path goes on where it stood."""
    cell = make(PATH, BOTH)
    cell.run(300)
    cell.backward(True)
    cell.run(150)
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    cell.run(300)
    assert cell.position()[2] == 0.0
    cell.backward(False)
    cell.order(ACTIVE)
    cell.ends()
    assert cell.position().tolist() == [10.0, 10.0, 0.0]
    assert cell.way > 50 + 10 * 2**0.5 + 50


def test_the_way_back_ends_at_the_pause(make: Make) -> None:
    """While it stands paused, and behind that, the path is not driven back
    beyond the place of the pause.
    """
    cell = make(PATH, BOTH)
    cell.run(300)
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    at = cell.position()[0]
    cell.backward(True)
    cell.run(300)
    assert cell.position()[0] == at
    cell.backward(False)
    cell.run(300)
    cell.order(ACTIVE)
    cell.until(lambda: cell.position()[0] > at + 2.0)
    cell.backward(True)
    cell.run(1000)
    assert cell.position()[0] == pytest.approx(at, abs=1e-6)
    cell.backward(False)
    cell.ends()
    assert cell.position().tolist() == [10.0, 10.0, 0.0]
    assert cell.way > 50.0


@pytest.mark.parametrize("events", ["M_PAUSE = 61\n", "M_GOPAUSE = 62\n", BOTH])
@pytest.mark.parametrize("orders", ["-B A", "A-B", "A -B", "A   -B", "-B   A"])
def test_active_on_the_way_back_waits_for_its_end(
    make: Make, events: str, orders: str
) -> None:
    """ACTIVE (A) while the path is driven back in HOLD, together with the end of
    backward motion (-B), ahead of that or behind it: it goes on from the pause.
    """
    cell = make(SHORT, events)
    cell.run(50)
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    cell.backward(True)
    cell.run(60)
    for what in orders.replace("-B", "b"):
        if what == " ":
            cell.run(40)
        elif what == "A":
            cell.order(ACTIVE)
        else:
            cell.backward(False)
    cell.ends()
    assert cell.position()[:2].tolist() == [20.0, 10.0]
    assert cell.way < 10.0 + 10.0 * 2**0.5 + 22.0


@pytest.mark.parametrize("hold", range(100, 420, 35))
def test_a_hold_with_deleted_distance_only_stands(
    make: Make, hold: int
) -> None:
    """On the line to the next end, and until it begins, macros have no place:
    the corner is left out all the same, at no more than the feed.
    """
    cell = make("G1 F6 X20\nX20 Y20\nX40 Y20\n", BOTH)
    cell.run(95)
    cell.press("delete_distance_to_go")
    cell.run(hold - 97)
    driven = cell.channel.bahn_state.delete_distance_to_go_active_r
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    cell.run(200)
    assert (cell.position()[2] == 0.0) == bool(driven)
    cell.order(ACTIVE)
    cell.ends()
    assert cell.position().tolist() == [40.0, 20.0, 0.0]
    places = np.array(cell.places)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert steps.max() < 0.1005
    corner = np.linalg.norm(places[:, :2] - [20.0, 0.0], axis=1)
    assert corner.min() > 8.0
    assert cell.channel.bahn_state.dist_prog_start == pytest.approx(
        600_000 + (100_000 if not driven else 0), abs=20
    )


@pytest.mark.parametrize(
    "events", ["", "M_PAUSE = 61\n", "M_GOPAUSE = 62\n", BOTH]
)
@pytest.mark.parametrize("hold", [20, 200])
def test_single_block_stands_behind_a_pause(
    make: Make, events: str, hold: int
) -> None:
    """Ahead of the next block, whether the pause came there or within a block;
    the macros themselves do not stand, and the rest of a block does not.
    """
    cell = make("G1 F6000 X10\nX20\nX30\n", events)
    cell.level("single_block", True)
    cell.run(hold)
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    cell.run(100)
    cell.order(ACTIVE)
    cell.run(900)
    assert cell.state == ACTIVE
    assert cell.stop_condition == 8
    assert cell.position()[0] == 10.0
    cell.press("continue_machining")
    cell.run(600)
    assert cell.stop_condition == 8
    assert cell.position().tolist() == [20.0, 0.0, 0.0]
    cell.press("continue_machining")
    cell.ends()
    assert cell.position().tolist() == [30.0, 0.0, 0.0]


def test_single_block_stands_behind_g101(make: Make) -> None:
    """The first motion behind it is a block like others."""
    cell = make(HALTED, "")
    cell.level("single_block", True)
    cell.run(1500)
    assert 30.0 < cell.position()[0] < 60.0
    assert (cell.position()[1], cell.stop_condition) == (0.0, 8)


@pytest.mark.parametrize("events", ["", BOTH])
def test_an_inserted_stop_stands_behind_a_pause(
    make: Make, events: str
) -> None:
    """HOLD and ACTIVE leave it to "continue"."""
    cell = make(SHORT, events)
    insert = cell.channel.bahn_mc_control.insert_cmd
    insert.command_w.dist_or_pos, insert.command_w.rel_abs_mode = 5e4, 1
    insert.enable_w = insert.command_semaphor_rw = True
    cell.run(300)
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    cell.order(ACTIVE)
    cell.run(600)
    assert (cell.position()[0], cell.stop_condition) == (5.0, 1 << 11)
    cell.press("continue_machining")
    cell.ends()
    assert cell.position().tolist() == [20.0, 10.0, 0.0]


@pytest.mark.parametrize(
    "events", ["", "M_PAUSE = 61\n", "M_GOPAUSE = 62\n", BOTH]
)
def test_a_pause_says_what_it_waits_for(make: Make, events: str) -> None:
    """The bit of HOLD, with macros and without."""
    cell = make(PATH, events)
    cell.run(100)
    cell.order(HOLD)
    cell.until(lambda: cell.state == HOLD)
    cell.run(50)
    assert cell.stop_condition == 1 << 10
