"""IEC 61131-3 standard function blocks, on a clock the test moves."""

import pytest

from plc_client import CTD, CTU, CTUD, F_TRIG, R_TRIG, RS, SR, TOF, TON, TP, clock

MS = 1_000_000


class Clock:
    """ns that only the test moves."""

    def __init__(self) -> None:
        self.ns = 0

    def __call__(self) -> int:
        return self.ns


def run(timer: object, clock_: Clock, inputs: str) -> str:
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
        (TON, "0111110110", "0000110000"),  # Q after 3 ms of TRUE, a shorter input gives nothing
        (TON, "1111011111", "0001000011"),
        (TOF, "0110000011010000", "0111110011111110"),  # falls 3 ms behind IN, retriggered by the new TRUE
        (TOF, "0000", "0000"),
        (TP, "0100000100", "0111000111"),  # a pulse of 3 ms
        (TP, "0111111100", "0111000000"),  # a long input gives one pulse
        (TP, "0101010000", "0111011100"),  # edges during the pulse count for nothing
    ],
)
def test_timer_diagrams(kind: type, inputs: str, expected: str) -> None:
    """Timing diagrams of the standard with PT = 3 ms, one column per ms."""
    clock_ = Clock()
    assert run(kind(PT=0.003, now_ns=clock_), clock_, inputs) == expected


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
    assert [counter(cu) for cu in (True, True, False, True, False, True)] == [False, False, False, True, True, True]
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
