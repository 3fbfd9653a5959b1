"""Holds and overrides act at once, on any machine. On a straight line the motion
is known in closed form, so it is the shortest there is.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from cnc_core.engine.jerk_planner import (
    INTERVAL,
    JerkPlanner,
    Limits,
    sample,
)
from cnc_core.units import AnyArray, FloatArray

COMMIT_S = 0.01


def _line(length: float, feed: float) -> AnyArray:
    line = np.zeros(1, INTERVAL)
    line["length"], line["feed"], line["blocks"] = length, feed, 1
    line["d1"][:, :, 0] = 1.0
    return line


def _arc(
    radius: float, turn: float, feed: float, heading: float = 0.0
) -> AnyArray:
    """A turn (rad) to the left, or to the right below 0, in 20 intervals of two axes."""
    arc = np.zeros(20, INTERVAL)
    arc["length"], arc["feed"] = radius * abs(turn) / 20, feed
    arc["blocks"][-1] = 1
    bend = np.sign(turn) / radius
    ends = heading + np.linspace(0.0, turn, 21)
    angle = np.stack([ends[:-1], ends[1:]], axis=1)
    for axis, phase in enumerate((0.0, -np.pi / 2)):
        arc["d1"][:, :, axis] = np.cos(angle + phase)
        arc["d2"][:, :, axis] = -np.sin(angle + phase) * bend
        arc["d3"][:, :, axis] = -np.cos(angle + phase) * bend**2
    return arc


def _down_to(
    v: float, a: float, low: float, acc: float, jerk: float
) -> tuple[float, float]:
    """Seconds and mm of the quickest way from (v, a) to (low, 0), below it."""
    steepest = min(acc, math.sqrt(a * a / 2 + jerk * (v - low)))
    steepest = max(steepest, -a)
    gone = (2 * steepest**2 - a * a) / (2 * jerk)
    phases = (
        ((a + steepest) / jerk, -jerk),
        (max(0.0, (v - low - gone) / steepest), 0.0),
        (steepest / jerk, jerk),
    )
    time = way = 0.0
    for t, j in phases:
        way += v * t + a * t**2 / 2 + j * t**3 / 6
        v += a * t + j * t**2 / 2
        a += j * t
        time += t
    return time, way


def _random(seed: int) -> tuple[Limits, float, float, JerkPlanner]:
    """A machine, its feed, a share, and its planner ahead of the middle of a line: it does not
    brake yet.
    """
    rng = np.random.default_rng(seed)
    v, acc = 10 ** rng.uniform(1, 3), 10 ** rng.uniform(1.5, 4.3)
    jerk = acc * 10 ** rng.uniform(0, 5)
    feed = v * rng.uniform(0.1, 1.0)
    length = feed * 10 ** rng.uniform(-0.5, 1.5)
    limits = Limits([v], [acc], [jerk])
    planner = JerkPlanner(limits, window=120)
    planner.push(_line(length, feed))
    planner.finish()
    planner.take(1e-6)
    planner.take(rng.uniform(0.02, 0.5) * planner.tail()["time"].sum())
    return limits, feed, 10 ** rng.uniform(-3, -0.05), planner


def _state(planner: JerkPlanner) -> tuple[float, float]:
    """Speed and acceleration at the end of what was taken."""
    tail = planner.tail()
    return tail["v0"][0], tail["a0"][0]


def _driven(laws: AnyArray) -> float:
    return float(laws["length"].sum())


@pytest.mark.parametrize("seed", range(60))
def test_a_hold_on_a_line_is_the_shortest_stop(seed: int) -> None:
    """Also where the jerk reaches the acceleration within a fraction of a cycle: there the
    line was driven to its end.
    """
    limits, _, _, planner = _random(seed)
    v, a = _state(planner)
    _, way = _down_to(v, a, 0.0, limits.a[0], limits.j[0])
    left = _driven(planner.tail())
    planner.hold(True)
    stop = planner.take()
    assert _driven(stop) <= 1.012 * min(way, left) + 1e-6
    planner.hold(False)
    rest = planner.take()
    assert _driven(stop) + _driven(rest) == pytest.approx(left, abs=1e-6)


@pytest.mark.parametrize("seed", range(60))
def test_a_lower_override_on_a_line_is_met_at_once(seed: int) -> None:
    """As soon as the limits allow, down to a thousandth of the present speed, and within the
    limits.
    """
    limits, feed, low, planner = _random(seed)
    v, a = _state(planner)
    asked = low * v
    time, _ = _down_to(v, a, asked, limits.a[0], limits.j[0])
    planner.override(asked / feed)
    laws = planner.take()
    dt = time / 200
    states = sample(laws, dt)
    v = states[:, 1]
    until = int(np.argmax(v <= 1.005 * asked)) * dt
    assert until <= 1.01 * time + 2 * dt
    assert v[int(1.01 * time / dt) + 3 :].max() <= 1.005 * asked
    assert np.abs(states[:, 2]).max() <= 1.001 * limits.a[0]
    assert np.abs(np.diff(states[:, 2])).max() <= 1.001 * limits.j[0] * dt


@pytest.mark.parametrize("low", [0.2, 0.02, 0.01, 0.001])
@pytest.mark.parametrize("where", ["line", "arc"])
def test_a_deep_drop_ahead_of_a_long_line(where: str, low: float) -> None:
    """One change of the override, on the line ahead of an arc or on an arc ahead of a line.

    Below two hundredths it had no effect at all: parts of the present plan short enough for
    an arc did not fit over the line.
    """
    planner = JerkPlanner(Limits([300.0] * 2, [3000.0] * 2, [50000.0] * 2))
    line, arc = _line(2000.0, 100.0), _arc(40.0, 1.5, 100.0)
    for part in (line, arc) if where == "line" else (arc, _turned(line, 1.5)):
        planner.push(part)
    planner.finish()
    planner.take(0.3)
    planner.override(low)
    taken = [planner.take(COMMIT_S) for _ in range(60)]
    assert taken[-1]["v0"].max() <= 1.005 * 100.0 * low
    assert taken[-1]["v0"].max() >= 0.5 * 100.0 * low


def _turned(line: AnyArray, angle: float) -> AnyArray:
    line["d1"][:, :, 0] = np.cos(angle)
    line["d1"][:, :, 1] = np.sin(angle)
    return line


@pytest.mark.parametrize("low", [0.05, 0.02])
def test_a_deep_drop_on_an_arc_is_met_in_time(low: float) -> None:
    """The last of a fall is short and lasts long: it took up to 2.1 times as long as on a line,
    since the way down was looked at, not the time.
    """
    feed, acc, jerk = 50.0, 800.0, 2500.0
    planner = JerkPlanner(Limits([300.0] * 2, [acc] * 2, [jerk] * 2))
    for k in range(4):
        planner.push(_arc(80.0, 1.57, feed, 1.57 * k))
    planner.take(0.9)
    v, a = _state(planner)
    time, _ = _down_to(v, a, low * feed, acc, jerk)
    planner.override(low)
    planner.take(1.1 * time + COMMIT_S)
    v, _ = _state(planner)
    assert 0.8 * low * feed <= v <= 1.05 * low * feed


@pytest.mark.parametrize("low", [0.005, 0.01, 0.02])
def test_a_short_drop_leaves_no_crawl(low: float) -> None:
    """An override that is low for a moment, and the speed comes back."""
    planner = JerkPlanner(Limits([300.0] * 2, [3000.0] * 2, [50000.0] * 2))
    planner.push(_line(2000.0, 100.0))
    planner.finish()
    planner.take(0.6)
    for begun in range(2, 60, 7):
        planner.override(low)
        planner.take(1e-3 * begun)
        planner.override(1.0)
        planner.take(0.2)
        v, _ = _state(planner)
        assert v == pytest.approx(100.0, rel=1e-3), begun


@pytest.mark.parametrize("seconds", [2e-9, 1e-7, 1e-5])
@pytest.mark.parametrize("feed", [100.0, 1.0, 0.001])
def test_a_tiny_part_of_a_long_law_is_handed_out(
    feed: float, seconds: float
) -> None:
    """What is shorter than a part may be is a little more, not all of the cruise: the
    operator's next order waited until its end, seconds later.
    """
    planner = JerkPlanner(Limits([300.0], [3000.0], [50000.0]))
    planner.push(_line(100.0 * feed, feed))
    planner.finish()
    planner.take(5.0)
    assert planner.take(seconds)["time"].sum() < 1e-3
    planner.override(0.5)
    planner.take(0.2)
    assert planner.take(0.01)["v0"].max() == pytest.approx(0.5 * feed)


@pytest.mark.parametrize("feed", [1.0, 0.02])
@pytest.mark.parametrize("bend", [0.0, 0.01])
def test_a_raised_override_ends_a_crawl_on_lines(
    bend: float, feed: float
) -> None:
    """At a thousandth of a low feed, with only a part of the line in the window or a bend behind
    it: it went on for ever.
    """
    planner = JerkPlanner(Limits([300.0] * 2, [3e3] * 2, [5e4] * 2), window=12)
    for k in range(20):
        planner.push(_turned(_line(10.0, feed), k * bend))
    for low, commits in ((1.0, 17), (0.001, 4), (1.0, 100)):
        planner.override(low)
        for _ in range(commits):
            laws = planner.take(COMMIT_S)
    assert laws["v0"][0] == pytest.approx(feed, rel=1e-3)


def _on_arcs(
    accel: float, jerk: float, radius: float, feed: float
) -> JerkPlanner:
    """At the begin of 60 arcs of 0.7 rad, to the right and to the left in turn."""
    planner = JerkPlanner(Limits([300.0] * 2, [accel] * 2, [jerk] * 2))
    for k in range(60):
        turn = 0.7 if k % 2 else -0.7
        planner.push(_arc(radius, turn, feed, 0.0 if turn < 0 else -0.7))
    planner.finish()
    return planner


@pytest.mark.parametrize(
    ("accel", "rate", "radius", "feed", "low"),
    [(267.0, 70943.0, 3.4, 5.1, 0.022), (896.0, 95132.0, 3.4, 25.2, 0.01)],
)
def test_a_raised_override_on_arcs_of_quick_axes(
    accel: float, rate: float, radius: float, feed: float, low: float
) -> None:
    """Full acceleration is there at once: behind a drop the speed is back within 1.2 times what the
    acceleration needs, and 50 ms. Windows failed, and it took up to 0.5 s.
    """
    planner = _on_arcs(accel, accel * rate, radius, feed)
    planner.take(1.0)
    planner.override(low)
    planner.take(1.0)
    planner.override(1.0)
    laws = np.concatenate([planner.take(COMMIT_S) for _ in range(300)])
    speeds = sample(laws, 1e-3)[:, 1]
    back = np.nonzero(speeds >= 0.95 * speeds.max())[0][0]
    assert back <= 1000.0 * 1.2 * feed / accel + 50.0


@pytest.mark.parametrize("feed", [1.0, 10.0, 50.0])
@pytest.mark.parametrize("low", [0.2, 0.05, 0.01, 0.005])
def test_a_deep_drop_on_arcs(feed: float, low: float) -> None:
    """From twice the feed to a share of it: the speed falls over the way that it takes, not over
    the intervals of an arc, which are long at a low speed. It stayed at six times as much.
    """
    planner = _on_arcs(3000.0, 50000.0, 6.0, feed)
    planner.override(2.0)
    planner.take(0.5)
    planner.override(low)
    laws = np.concatenate([planner.take(COMMIT_S) for _ in range(80)])
    speeds = sample(laws, 1e-3)[:, 1]
    assert speeds[200:].max() <= 1.15 * low * feed
    assert speeds[500:].max() <= 1.005 * low * feed
    assert speeds[500:].min() >= 0.98 * low * feed


@pytest.mark.parametrize(
    ("start", "feed", "acc", "jerk", "low"),
    [
        (0.345, 100.0, 800.0, 2500.0, 0.02),
        (0.356, 100.0, 3000.0, 10000.0, 0.03),
        (0.38, 100.0, 3000.0, 10000.0, 0.05),
        (0.748, 100.0, 800.0, 2500.0, 0.01),
        (0.413, 100.0, 500.0, 2500.0, 0.02),
    ],
)
def test_a_drop_on_a_circle_that_takes_all_jerk(
    start: float, feed: float, acc: float, jerk: float, low: float
) -> None:
    """It is met about as soon as a feed hold: windows for so low a feed had steps so short that
    they ended ahead of any stop, and it took more than twice as long.
    """

    def driven(order: Callable[[JerkPlanner], None]) -> FloatArray:
        planner = JerkPlanner(Limits([300.0] * 2, [acc] * 2, [jerk] * 2))
        for k in range(60):
            planner.push(_arc(8.0, 1.2, feed, 1.2 * k))
        planner.take(start)
        order(planner)
        laws = np.concatenate([planner.take(COMMIT_S) for _ in range(120)])
        return np.asarray(sample(laws, 1e-3)[:, 1])

    held = driven(lambda planner: planner.hold(True))
    fallen = driven(lambda planner: planner.override(low))
    down = [int(np.argmax(v <= 1.05 * low * feed)) for v in (held, fallen)]
    assert 0 < down[1] <= 1.15 * down[0]


@pytest.mark.parametrize("seed", range(6))
def test_a_drop_does_not_fall_below_what_is_asked_for(seed: int) -> None:
    """On arcs most did, to less than 0.8 of it: the last of a fall weighed next to
    nothing beside its beginning.
    """
    rng = np.random.default_rng(seed)
    for low in (0.05, 0.1, 0.3):
        feed = float(rng.choice([30.0, 50.0, 100.0]))
        acc = float(rng.choice([500.0, 800.0, 3000.0]))
        jerk = float(rng.choice([2500.0, 10000.0, 50000.0]))
        planner = JerkPlanner(Limits([300.0] * 2, [acc] * 2, [jerk] * 2))
        for k in range(20):
            planner.push(_arc(20.0, 0.5, feed, 0.5 * k))
        planner.take(float(rng.uniform(0.3, 1.0)))
        planner.override(low)
        laws = np.concatenate([planner.take(COMMIT_S) for _ in range(100)])
        v = sample(laws, 1e-3)[:, 1]
        assert v.min() >= 0.9 * low * feed, (low, feed, acc, jerk)


@pytest.mark.parametrize(
    ("acc", "jerk", "radius", "feed", "low", "seconds"),
    [
        (300.0, 12000.0, 545.0, 300.0, 0.9, 0.28),
        (300.0, 3000.0, 3400.0, 500.0, 0.8, 0.38),
        (500.0, 20000.0, 829.0, 300.0, 0.9, 0.16),
    ],
)
def test_a_change_while_the_speed_rises_leaves_no_saw(
    acc: float,
    jerk: float,
    radius: float,
    feed: float,
    low: float,
    seconds: float,
) -> None:
    """The way takes as long as with that override from the start: the short window behind the
    change was driven until it all but stood, since most of its knots are where it comes to rest.
    """

    def lasts(at: float) -> float:
        planner = JerkPlanner(Limits([700.0] * 2, [acc] * 2, [jerk] * 2))
        for k in range(3):
            planner.push(_arc(radius, 0.7, feed, 0.7 * k))
        planner.finish()
        taken = [planner.take(at)] if at > 0.0 else []
        planner.override(low)
        while len(laws := planner.take(COMMIT_S)):
            taken.append(laws)
        return float(np.concatenate(taken)["time"].sum())

    assert lasts(seconds) <= 1.01 * lasts(0.0)


@pytest.mark.parametrize(
    ("radius", "feed", "acc", "jerk", "cycle", "low", "seconds"),
    [
        (0.295, 10.0, 5000.0, 300000.0, 0.002, 0.0005, 0.312),
        (0.0882, 5.0, 5000.0, 500000.0, 0.002, 0.0005, 0.18),
        (0.0652, 5.0, 5000.0, 500000.0, 0.001, 0.0005, 0.03),
    ],
)
def test_a_creeping_tool_speeds_up_again(
    radius: float,
    feed: float,
    acc: float,
    jerk: float,
    cycle: float,
    low: float,
    seconds: float,
) -> None:
    """Behind an override of next to nothing every window was refused, and the tool crept on for
    ever: from there it may stand for a moment.
    """
    limits = Limits([300.0] * 2, [acc] * 2, [jerk] * 2)
    planner = JerkPlanner(limits, cycle_s=cycle)
    for k in range(40):
        planner.push(_arc(radius, 1.2, feed, 1.2 * k))
    planner.take(0.3)
    planner.override(low)
    for _ in range(round(seconds / COMMIT_S)):
        planner.take(COMMIT_S)
    planner.override(1.0)
    laws = np.concatenate([planner.take(COMMIT_S) for _ in range(200)])
    assert laws["v0"].max() >= 0.5 * feed
