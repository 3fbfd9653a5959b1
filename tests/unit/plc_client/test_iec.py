"""IEC 61131-3 standard function blocks, on a clock the test moves."""

import pytest

from plc_client import (
    CTD,
    CTU,
    CTUD,
    F_TRIG,
    R_TRIG,
    RS,
    SR,
    TOF,
    TON,
    TP,
    clock,
)

MS = 1_000_000


class Clock:
    """ns that only the test moves."""

    def __init__(self) -> None:
        self.ns = 0

    def __call__(self) -> int:
        return self.ns


def outputs(timer: object, clock_: Clock, inputs: str) -> str:
    """One call per ms with IN from the text of 0 and 1; Q as the same kind of text."""
    out = ""
    for i, value in enumerate(inputs):
        clock_.ns = i * MS
        timer(value == "1")  # type: ignore[operator]
        out += str(int(timer.Q))  # type: ignore[attr-defined]
    return out


@pytest.mark.parametrize(
    ("kind", "inputs", "expected"),
    [
        (
            TON,
            "0111110110",
            "0000110000",
        ),  # Q after 3 ms of TRUE, a shorter input gives nothing
        (TON, "1111011111", "0001000011"),
        (
            TOF,
            "0110000011010000",
            "0111110011111110",
        ),  # falls 3 ms behind IN, retriggered by the new TRUE
        (TOF, "0000", "0000"),
        (TP, "0100000100", "0111000111"),  # a pulse of 3 ms
        (TP, "0111111100", "0111000000"),  # a long input gives one pulse
        (
            TP,
            "0101010000",
            "0111011100",
        ),  # edges during the pulse count for nothing
    ],
)
def test_timer_diagrams(kind: type, inputs: str, expected: str) -> None:
    """Timing diagrams of the standard with PT = 3 ms, one column per ms."""
    clock_ = Clock()
    assert outputs(kind(PT=0.003, now_ns=clock_), clock_, inputs) == expected


def test_ton_shows_elapsed_time_and_holds_it_at_pt() -> None:
    """ET runs to PT and goes back to 0 with IN."""
    clock_ = Clock()
    timer = TON(PT=0.002, now_ns=clock_)
    shown = []
    for i, value in enumerate([True, True, True, True, False]):
        clock_.ns = i * MS
        timer(value)
        shown.append(timer.ET)
    assert shown == [0.0, 0.001, 0.002, 0.002, 0.0]


def test_ton_with_pt_zero_is_immediate() -> None:
    """PT 0 or less: Q with the input."""
    clock_ = Clock()
    assert TON(PT=0.0, now_ns=clock_)(True)
    assert TON(PT=-1.0, now_ns=clock_)(True)


def test_timers_run_on_the_cells_clock() -> None:
    """Without a clock of its own a timer reads the cell's."""
    cell = Clock()
    try:
        clock.set_source(cell)
        timer = TON(PT=0.005)
        assert not timer(True)
        cell.ns = 5 * MS
        assert timer(True)
    finally:
        clock.set_source(lambda: 0)


def test_edges_last_one_call() -> None:
    """R_TRIG and F_TRIG."""
    rising, falling = R_TRIG(), F_TRIG()
    signal = [False, True, True, False, True]
    assert [rising(s) for s in signal] == [False, True, False, False, True]
    assert [falling(s) for s in signal] == [False, False, False, True, False]


def test_r_trig_sees_true_in_its_first_call() -> None:
    """The standard's initial value of the memory is FALSE."""
    assert R_TRIG()(True)


def test_ctu_counts_edges_until_reset() -> None:
    """Q at CV >= PV, R dominates, the counter stops at its limit."""
    counter = CTU(PV=2)
    assert [counter(cu) for cu in (True, True, False, True, False, True)] == [
        False,
        False,
        False,
        True,
        True,
        True,
    ]
    assert counter.CV == 3
    assert not counter(True, R=True)
    assert counter.CV == 0
    counter.CV = 32767
    counter(False)
    counter(True)
    assert counter.CV == 32767


def test_ctd_counts_down_from_pv() -> None:
    """LD loads and dominates; Q at CV <= 0."""
    counter = CTD(PV=2)
    counter(False, LD=True)
    assert (counter.CV, counter.Q) == (2, False)
    assert [counter(cd) for cd in (True, False, True)] == [False, False, True]


def test_ctud_order_of_inputs() -> None:
    """R before LD before counting; both edges at once cancel."""
    counter = CTUD(PV=3)
    counter(CU=True)
    assert counter.CV == 1
    counter(CU=False, LD=True)
    assert (counter.CV, counter.QU) == (3, True)
    counter(CU=True, CD=True)
    assert counter.CV == 3
    counter(R=True, LD=True)
    assert (counter.CV, counter.QD) == (0, True)


def test_bistables_differ_when_both_inputs_are_true() -> None:
    """SR: set dominant; RS: reset dominant; both hold their state."""
    sr, rs = SR(), RS()
    assert sr(True, True)
    assert not rs(True, True)
    assert sr(False, False)
    assert rs(True, False)
    assert rs(False, False)
    assert not sr(False, True)
    assert not rs(False, True)


def test_tp_edge_in_the_scan_that_finds_the_pulse_over() -> None:
    """The pulse ended between two scans, then IN rose: a new pulse, not a lost edge."""
    clock_ = Clock()
    pulse, out = TP(PT=0.010, now_ns=clock_), []
    for ms, value in (
        (0, True),
        (5, False),
        (12, True),
        (20, True),
        (22, True),
    ):
        clock_.ns = ms * MS
        out.append((pulse(value), pulse.ET))
    assert out == [
        (True, 0.0),
        (True, 0.005),
        (True, 0.0),
        (True, 0.008),
        (False, 0.010),
    ]


def test_tp_with_pt_zero_gives_no_pulse_and_et_falls_with_in() -> None:
    """ET is held at PT as long as IN stays TRUE."""
    clock_ = Clock()
    assert not TP(PT=0.0, now_ns=clock_)(True)
    pulse = TP(PT=0.002, now_ns=clock_)
    shown = []
    for i, value in enumerate([True, True, True, True, False]):
        clock_.ns = i * MS
        pulse(value)
        shown.append(pulse.ET)
    assert shown == [0.0, 0.001, 0.002, 0.002, 0.0]


def test_tof_holds_et_at_pt_until_in_comes_back() -> None:
    """Standard figure: ET runs after the fall, stays at PT, is 0 with IN."""
    clock_ = Clock()
    timer, shown = TOF(PT=0.002, now_ns=clock_), []
    for i, value in enumerate([True, False, False, False, False, True]):
        clock_.ns = i * MS
        timer(value)
        shown.append((timer.Q, timer.ET))
    assert shown == [
        (True, 0.0),
        (True, 0.0),
        (True, 0.001),
        (False, 0.002),
        (False, 0.002),
        (True, 0.0),
    ]


def test_pt_may_change_while_a_timer_runs() -> None:
    """The new PT counts from the same start."""
    clock_ = Clock()
    timer = TON(PT=0.010, now_ns=clock_)
    timer(True)
    clock_.ns = 4 * MS
    assert timer(True, PT=0.003)


def test_timers_survive_a_clock_that_begins_anew() -> None:
    """After a CNC restart the cell's clock counts from 0: the timer runs its time from there."""
    clock_ = Clock()
    clock_.ns = 1000 * MS
    timer = TON(PT=0.003, now_ns=clock_)
    timer(True)
    clock_.ns = 0
    assert not timer(True)
    clock_.ns = 3 * MS
    assert timer(True)


def test_f_trig_is_silent_in_its_first_call() -> None:
    """TwinCAT and CODESYS start with the memory at TRUE: no edge before there was a TRUE."""
    assert not F_TRIG()(False)


def test_ctd_and_ctud_stop_at_their_lower_limit() -> None:
    """CV is an INT."""
    down, both = CTD(PV=1), CTUD(PV=1)
    down.CV = both.CV = -32768
    down(True)
    both(CD=True)
    assert (down.CV, both.CV) == (-32768, -32768)


def test_edges_during_reset_are_used_up() -> None:
    """A counting input that rose under R does not count when R falls."""
    counter = CTU(PV=5)
    counter(True, R=True)
    counter(True)
    assert counter.CV == 0
