"""Homing (G71) on a simulated axis: the ways of one search by RZERO_MODE, and
where the reference is found.

Modes 0..7: to the sensor, away, back, to the encoder index; 8, 9: to the index
alone; 32: no search; 64: absolute encoder; 128 + 256 * method: the drive homes
by itself (CANopen DS402).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..base.homing_modes import (
    ABSOLUTE,
    BY_INDEX,
    DRIVE,
    METHOD,
    NO_SEARCH,
    SENSOR_MODE_MAX,
)
from ..base.machine import HomingSensors

# DS402 methods; from 17 on those of 1 on, without index
AT_LIMIT = (1, 2)
INWARDS = (4, 6)
WITHOUT_INDEX = 16


@dataclass(frozen=True)
class Way:
    """One motion to ``target``, mm from home of the machine, at ``speed`` mm/min."""

    target: float
    speed: float


@dataclass(frozen=True)
class Speeds:
    """RZERO_VEL and RZERO_VELF, mm/min; how far the axis overruns the sensor at
    the fast one, mm.
    """

    fast: float
    slow: float
    overrun: float


class NoSensorError(Exception):
    """The search finds nothing: what is missing."""


class NoMethodError(Exception):
    """There is no such mode, or the simulated drive does not know it: which one."""


def search(
    mode: int, here: float, sensors: HomingSensors, speeds: Speeds
) -> list[Way]:
    """The ways of a search, the last one ending at the reference; none where
    nothing has to move.
    """
    if mode in (NO_SEARCH, ABSOLUTE):
        return []
    if mode >= DRIVE and mode % METHOD == DRIVE:
        return _by_drive(mode // METHOD, here, sensors, speeds)
    if mode in BY_INDEX:
        return [
            Way(
                _index(here, 1 if mode == BY_INDEX[1] else -1, sensors),
                speeds.slow,
            )
        ]
    if not 0 <= mode <= SENSOR_MODE_MAX:
        raise NoMethodError(f"RZERO_MODE {mode} is not known")
    direction = 1 if mode % 2 else -1
    edge, ways = _edge(direction, sensors), []
    if (edge - here) * direction > 0:
        ways.append(Way(edge + direction * speeds.overrun, speeds.fast))
    released = edge - direction * sensors.release
    ways.append(Way(released, speeds.slow))
    at = released
    if mode < 4:
        ways.append(Way(edge, speeds.slow))
        at = edge
    if mode % 4 >= 2:
        ways.append(
            Way(
                _index(at, direction if mode < 4 else -direction, sensors),
                speeds.slow,
            )
        )
    return ways


def _edge(direction: int, sensors: HomingSensors) -> float:
    """Where the sensor of a direction switches."""
    edge = sensors.positive if direction > 0 else sensors.negative
    if edge is None:
        raise NoSensorError(
            f"the axis has no {'positive' if direction > 0 else 'negative'} home sensor"
        )
    return edge


def _index(here: float, direction: int, sensors: HomingSensors) -> float:
    """The next encoder index."""
    if sensors.index <= 0.0:
        raise NoSensorError("the axis has no encoder index")
    turns = (here - sensors.index_offset) / sensors.index
    ahead = (
        math.floor(turns + 1e-9) + 1
        if direction > 0
        else math.ceil(turns - 1e-9) - 1
    )
    return sensors.index_offset + ahead * sensors.index


def _limit(direction: int, sensors: HomingSensors) -> float:
    """Where the limit switch of a direction switches."""
    edge = sensors.limit_positive if direction > 0 else sensors.limit_negative
    if edge is None:
        name = "positive" if direction > 0 else "negative"
        raise NoSensorError(
            f"the axis has no {name} limit switch (limit_{name} of its homing table)"
        )
    return edge


def _by_drive(
    method: int, here: float, sensors: HomingSensors, speeds: Speeds
) -> list[Way]:
    """DS402: 1, 2, 17, 18 limit switches; 3..6, 19..22 home switch; 33, 34
    index; 35, 37 here; 1..6 end on an index.

    3 and 5 end where the home switch releases, the index beside it; 4 and 6
    where it switches, the index inside.
    """
    if method in (35, 37):
        return []
    if method in (33, 34):
        return [
            Way(_index(here, 1 if method == 34 else -1, sensors), speeds.slow)
        ]
    base = method - WITHOUT_INDEX if method > WITHOUT_INDEX else method
    if base not in range(1, 7):
        raise NoMethodError(
            f"RZERO_MODE {DRIVE + METHOD * method}: the simulated drive has "
            f"no homing method {method}"
        )
    if base in AT_LIMIT:
        direction = 1 if base == 2 else -1
        edge = _limit(direction, sensors)
    else:
        direction = 1 if base <= 4 else -1
        edge = _edge(direction, sensors)
    ways = [Way(edge, speeds.fast)] if (edge - here) * direction > 0 else []
    ways.append(Way(edge - direction * sensors.release, speeds.slow))
    if base in INWARDS:
        ways.append(Way(edge, speeds.slow))
    if method < WITHOUT_INDEX:
        ways.append(
            Way(
                _index(
                    ways[-1].target,
                    direction if base in INWARDS else -direction,
                    sensors,
                ),
                speeds.slow,
            )
        )
    return ways
