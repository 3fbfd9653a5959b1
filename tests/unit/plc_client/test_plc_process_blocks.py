"""Distance switches, technology blocks, watchdogs, errors and MCV_HliInterface
against the mock CNC.
"""

import math
from collections.abc import Iterator
from typing import Any

import pytest

from plc_client import (
    CncWatchdog,
    DistanceCam,
    DistanceTrigger,
    ErrorReader,
    ErrorState,
    ErrorWriter,
    InterfaceState,
    MCV_HliInterface,
    PathEstimate,
    SwitchState,
    TechnoServer,
    TechnoState,
    Watchdog,
    WatchState,
    connect,
)
from plc_client.mock import MockCnc, arc, cnc_error, h, line, m, s, t


@pytest.fixture
def make() -> Iterator[Any]:
    """A mock CNC and the PLC's connection."""
    opened: list[Any] = []

    def build(*script: Any, **options: Any) -> tuple[MockCnc, Any]:
        cnc = MockCnc(script, **options)
        hli = connect(cnc.name)
        opened.extend((cnc, hli))
        return cnc, hli

    yield build
    for item in reversed(opened):
        item.close()


@pytest.mark.ci_cases
@pytest.mark.parametrize("lead_s", [0.0, 0.013, 0.040])
@pytest.mark.parametrize("scan", [1, 4, 10])
@pytest.mark.parametrize("feed", [33.3, 100.0])
def test_trigger_is_early_by_the_lead_whatever_the_scan(
    make: Any, lead_s: float, scan: int, feed: float
) -> None:
    """Where a device with this dead time acts: around the place, at most half a scan beside it."""
    cnc, hli = make(line(100), feed_mm_s=feed)
    fb = DistanceTrigger(hli.gpCh[0], scan_s=scan * 0.001)
    place = 456_789.0
    while not fb(place, lead_s):
        cnc.run_to(cnc.cycles + scan)
    acts_at = cnc.distance + feed * 10_000.0 * lead_s
    half_a_scan = 0.5 * scan * 0.001 * feed * 10_000.0
    assert abs(acts_at - place) <= half_a_scan + 1.0
    assert (fb.state, fb.done, fb.time_to_go) == (SwitchState.PASSED, True, 0.0)


def test_trigger_tells_the_time_to_go_and_falls_when_the_path_runs_back(
    make: Any,
) -> None:
    """For outputs with a time stamp; backward motion takes the switch back."""
    cnc, hli = make(line(100))
    fb = DistanceTrigger(hli.gpCh[0])
    assert not fb(100_000.0)
    assert math.isinf(fb.time_to_go)  # stands
    cnc.run_to(50)
    fb(100_000.0, lead_s=0.02)
    assert fb.time_to_go == pytest.approx(0.05 - 0.02)
    cnc.run_to(150)
    assert fb(100_000.0)
    unit = hli.gpCh[0].bahn_mc_control.backward_motion
    unit.command_w = unit.enable_w = True
    cnc.run_to(250)
    assert not fb(100_000.0)
    assert not fb(0.0, enable=False)
    assert fb.state is SwitchState.OFF


def test_estimate_follows_braking_to_standstill_and_no_further(
    make: Any,
) -> None:
    """v = 0.1 m/s, a = -1 m/s2: 5 mm and no way back."""
    cnc, hli = make(line(100))
    path = PathEstimate(hli.gpCh[0])
    cnc.run_to(10)
    path()
    path.speed, path.acceleration = 1_000_000.0, -10_000_000.0
    assert path.at(0.1) - path.distance == pytest.approx(50_000.0)
    assert path.at(5.0) == path.at(0.1)


def test_cam_switches_on_its_tracks_with_both_leads(make: Any) -> None:
    """q is on from (begin - opening way) to (end - closing way)."""
    cnc, hli = make(line(100))
    fb = DistanceCam(hli.gpCh[0])
    on = []
    for _ in range(1000):
        if fb(
            [(200_000.0, 400_000.0), (600_000.0, 700_000.0)],
            on_lead_s=0.010,
            off_lead_s=0.020,
        ):
            on.append((fb.track, cnc.distance))
        cnc.cycle()
    for track, begin, end in (
        (0, 190_000.0, 380_000.0),
        (1, 590_000.0, 680_000.0),
    ):
        places = [d for i, d in on if i == track]
        assert places[0] == pytest.approx(begin, abs=1000.0)
        assert places[-1] == pytest.approx(end, abs=1100.0)


def test_functions_that_take_several_scans(make: Any) -> None:
    """M8 stays open until the pump runs; everything else is acknowledged at
    once; order and payload arrive.
    """
    cnc, hli = make(
        line(1),
        t(7),
        s(6_000_000),
        m(8, value=-345),
        h(3),
        line(1),
        m(9, late=True),
        line(1),
    )
    functions = TechnoServer(hli)
    coolant, tool, spindle = (
        functions.on("M", 8),
        functions.on("T"),
        functions.on("S"),
    )
    seen, held = [], 0
    for _ in range(120):
        seen += [(f.kind, f.number) for f in functions()]
        tool()
        spindle()
        held += coolant.active
        coolant(done=held >= 20)
        cnc.cycle()
    assert seen == [("T", 7), ("S", 6_000_000), ("M", 8), ("H", 3), ("M", 9)]
    assert (coolant.payload.add_value, coolant.count, held) == (-345, 1, 20)
    assert (tool.function.number, spindle.function.area) == (7, "gpAx[0]")
    assert (cnc.ended, coolant.state) == (True, TechnoState.IDLE)
    with pytest.raises(ValueError, match="already"):
        functions.on("M", 8)
    with pytest.raises(ValueError, match="M, H, S or T"):
        functions.on("X")


def test_watchdog_keeps_the_cnc_content_and_a_silent_plc_is_noticed(
    make: Any,
) -> None:
    """alive as long as it is called; after a miss 270053, by mc_error too."""
    cnc, hli = make(line(1))
    fb, errors = Watchdog(hli.gpCh[0]), ErrorReader(hli.gpCh[0])
    fb(cycle_time_us=20_000)
    assert fb.state is WatchState.WAITING
    for _ in range(50):
        cnc.run_to(cnc.cycles + 10)
        fb(cycle_time_us=20_000)
    assert (fb.alive, fb.state) == (True, WatchState.ALIVE)
    cnc.run_to(cnc.cycles + 30)
    fb(cycle_time_us=20_000)
    assert (fb.state, fb.error_id) == (WatchState.MISSED, 270053)
    assert [e.error_id for e in errors()] == [270053]
    fb(enable=False)
    assert fb.state is WatchState.OFF


def test_plc_watches_the_cnc(make: Any) -> None:
    """The CNC's signs stop: missed; they come back: alive."""
    cnc, hli = make(line(1))
    fb = CncWatchdog(hli.gpCh[0], cycle_time_us=10_000)
    fb()
    cnc.cycle()
    assert fb()
    cnc.watchdogs.lc_dead = True
    for _ in range(20):
        cnc.cycle()
        fb()
    assert (fb.alive, fb.missed, fb.state) == (False, 1, WatchState.MISSED)
    cnc.watchdogs.lc_dead = False
    cnc.cycle()
    assert fb()
    assert hli.gpCh[0].head.lc_watchdog.alive_state_r


def test_errors_arrive_one_by_one_and_none_is_lost(make: Any) -> None:
    """With enable the CNC waits for the acknowledgement; the record names the block."""
    cnc, hli = make(line(1), cnc_error(20131))
    for number in (1, 2, 3):
        cnc.errors.add(number)
    fb = ErrorReader(hli.gpCh[0])
    fb()
    cnc.cycle()
    assert fb(acknowledge=False) == []
    assert (fb.error, fb.error_id, fb.state) == (True, 1, ErrorState.STANDING)
    found = []
    for _ in range(40):
        found += fb()
        cnc.cycle()
    assert [e.error_id for e in found] == [1, 2, 3, 20131]
    assert (found[-1].block_number, found[-1].program, found[-1].module) == (
        20,
        "mock.nc",
        "MOCK",
    )
    assert (fb.count, fb.last) == (4, found[-1])


def test_plc_reports_an_error(make: Any) -> None:
    """lc_error: done when the CNC took it; number 0 is no error."""
    cnc, hli = make(line(1))
    fb = ErrorWriter(hli.gpCh[0])
    fb(True, 4711, reaction_class=5)
    assert (fb.busy, hli.gpCh[0].lc_error.satz_r.kopf.error_id) == (True, 4711)
    cnc.cycle()
    assert fb(True, 4711)
    fb(False)
    fb(True, 0)
    assert fb.error_id == 1


def test_interface_check_passes_and_shows_both_shapes(make: Any) -> None:
    """Initialized in the first scan; both spellings."""
    _, hli = make(line(1))
    fb = MCV_HliInterface(hli)
    assert fb()
    assert (fb.Initialized, fb.Initialised, fb.Error, fb.ErrorID) == (
        True,
        True,
        False,
        0,
    )
    assert fb.PlcHli == fb.CncHli == fb.ExpectedHli == fb.ActualHli


def break_shape(hli: Any, what: str) -> None:
    head = hli.root.segment_head
    if what == "info":
        head._c.channel_count = 0
    elif what == "pform":
        hli.gpPform = None
    elif what == "version":
        hli.gpPform.nc_config.hli_version_r.zeichen = "V9"
    elif what == "pfifc":
        head._c.segment_size += 8
    elif what == "chifc":
        hli.gpCh[0].head.sizeof_interface_r = 1
    elif what == "axifc":
        hli.gpAx[0].head.sizeof_interface_r = 1
    elif what == "channels":
        head._c.channel_count = 2
    elif what == "axes":
        head._c.axis_count = 9
    elif what == "extvar":
        hli.gpVECh = (None, *hli.gpVECh[1:])


ORDER = [
    "info",
    "pform",
    "version",
    "pfifc",
    "chifc",
    "axifc",
    "channels",
    "axes",
    "extvar",
]
NUMBERS = [40019, 40014, 40015, 40022, 40018, 40017, 40021, 40020, 40024]


@pytest.mark.parametrize("first", range(len(ORDER)))
def test_interface_errors_in_their_order(make: Any, first: int) -> None:
    """With everything from the n-th check on broken, the n-th number is told;
    after 100 scans it checks again.
    """
    _, hli = make(line(1))
    for what in reversed(ORDER[first:]):
        break_shape(hli, what)
    fb = MCV_HliInterface(hli)
    assert not fb()
    assert (fb.Error, fb.ErrorID, fb.state) == (
        True,
        NUMBERS[first],
        InterfaceState.ERROR,
    )
    for _ in range(99):
        fb()
        assert fb.error
    fb()
    assert (fb.state, fb.error_id) == (InterfaceState.CHECKING, 0)
    fb()
    assert fb.ErrorID == NUMBERS[first]


def test_arcs_of_the_script_are_what_the_look_ahead_shows(make: Any) -> None:
    """Length, radius and angle of an arc; N numbers by position."""
    cnc, _ = make(line(30), arc(20, -math.pi / 2, tangent=0.5))
    row = cnc.path[1]
    assert (row["block_type"], row["block_number"]) == (2, 20)
    assert row["length"] == pytest.approx(314159.265)
    assert (
        row["circle_angle"],
        row["compensated_radius"],
        row["tangent_variation"],
    ) == (-math.pi / 2, 200_000.0, 0.5)
