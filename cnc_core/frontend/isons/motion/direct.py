"""Functions that move or stop the axes at once: G71 homing, G101 stop, G102
probing, G100 commands on the path.
"""

from __future__ import annotations

from cnc_core.blocks import (
    EVENT,
    EVENT_COMMAND,
    EVENT_OVERRIDE,
    EXACT_STOP,
    HAS_VALUE,
    PATH_FEED,
)
from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.probe import trip
from cnc_core.frontend.base.scanner import MotionWords, Row
from cnc_core.frontend.port import Wait
from cnc_core.units import FloatArray

from ..base.homing_modes import ABSOLUTE
from ..base.machine import HomingSensors
from ..base.parameters import acceleration
from ..base.text import AXIS_LETTERS
from ..base.words import Words
from ..devices.homing import NoMethodError, NoSensorError, Speeds, search
from .motions import in_machine_coordinates, place_of, targets
from .state import ChannelState

PER_MINUTE = 60.0
COMMAND_MAX = 2**31


def command(
    channel: ChannelState, words: Words, offset: int
) -> list[Row | Wait]:
    """G100 X: an event on the path, without a stop."""
    number = words.take("X")
    if number is None or not 0 <= number < COMMAND_MAX or number != int(number):
        raise fail(900012, "G100: X with a whole number is expected", offset)
    row = channel.modal.row(
        EVENT, words.block.n, code=EVENT_COMMAND, value=number, flags=HAS_VALUE
    )
    return [*channel.emit(row)]


def override(channel: ChannelState, on: bool, n: int) -> list[Row | Wait]:
    """G10, G11."""
    return [
        *channel.emit(
            channel.modal.row(
                EVENT, n, code=EVENT_OVERRIDE, value=float(on), flags=HAS_VALUE
            )
        )
    ]


def stop(channel: ChannelState, offset: int) -> list[Row | Wait]:
    """G101: the axes stop where they are; what has been handed out is left out."""
    channel.not_compensated("G101", offset)
    channel.stopping = True
    return [*channel.output.flush(), Wait.STOPPED]


def probe(channel: ChannelState, words: Words, offset: int) -> list[Row | Wait]:
    """G102: at ACQ_VEL to the target, or to where the sensor trips."""
    channel.not_compensated("G102", offset)
    given = targets(channel, words)
    if not given:
        raise fail(900004, "G102: axes with their targets are expected", offset)
    start = channel.modal.position
    place = place_of(channel, given)
    found = trip(start, place, channel.machine.axes, channel.machine.probe)
    if found is None:
        channel.failure = CncError(909160).at(
            fail(909160, ERRORS[909160], offset).place
        )
    else:
        place = found[1]
    rows = [*channel.output.flush()]
    speed = (
        channel.parameters["ACQ_VEL"]
        or channel.modal.feed * channel.parameters["FEEDRES"]
    )
    rows += way(channel, place, speed, words.block.n, offset)
    return [Wait.DRAINED, *rows, Wait.DRAINED]


def way(
    channel: ChannelState,
    place: FloatArray,
    speed_mm_min: float,
    n: int,
    offset: int,
) -> list[Row]:
    """A straight motion to a machine position, with a stop at its end."""
    targets = {i: float(value) for i, value in enumerate(place)}
    words = MotionWords(axis=targets, n=n, motion=1)
    rows = in_machine_coordinates(channel, words, offset)
    for row in rows:
        row["feed"] = speed_mm_min / PER_MINUTE
        row["flags"] |= EXACT_STOP | PATH_FEED
    return rows


def home(channel: ChannelState, words: Words, offset: int) -> list[Row | Wait]:
    """G71: the axes that are named, one behind the other."""
    channel.not_compensated("G71", offset)
    axes = channel.named_axes(words)
    if not axes:
        raise fail(900004, "G71: an axis is expected", offset)
    rows: list[Row | Wait] = [*channel.output.flush(), Wait.DRAINED]
    for axis in axes:
        rows += _home_axis(channel, axis, words.block.n, offset)
        if channel.failure is not None:
            break
    return [*rows, Wait.DRAINED]


def _home_axis(
    channel: ChannelState, axis: int, n: int, offset: int
) -> list[Row]:
    p = channel.parameters
    letter = channel.machine.axes[axis].upper()
    if letter not in AXIS_LETTERS:
        raise fail(
            900001, f"G71: axis {letter} has no machine parameters", offset
        )
    mode, unit = int(p[f"RZERO_MODE_{letter}"]), 1.0 / p["RESQUOTE"]
    fast = p[f"RZERO_VEL_{letter}"] or p["FEEDDEF"]
    slow = p[f"RZERO_VELF_{letter}"] or fast / 10.0
    accel = acceleration(p[f"RZERO_ACC_{letter}"], p["TAU"])
    overrun = (fast / PER_MINUTE) ** 2 / (2.0 * accel) if accel > 0.0 else 0.0
    sensors = channel.cell.homing.get(letter, HomingSensors())
    here = float(channel.modal.position[axis])
    try:
        ways = search(mode, here, sensors, Speeds(fast, slow, overrun))
    except NoMethodError as wrong:
        raise fail(909161, f"G71 {letter}: {wrong}", offset) from None
    except NoSensorError as missing:
        raise fail(
            1005, f"G71 {letter}: {ERRORS[1005]}: {missing}", offset
        ) from None
    reference = ways[-1].target if ways else here
    ends = [(step.target, step.speed) for step in ways]
    ends.append((reference + p[f"RZERO_OFFSET_{letter}"] * unit, fast))
    rows, seconds, place = [], 0.0, channel.modal.position
    for target, speed in ends:
        begin, left = float(place[axis]), p["TIME_OUT_HOME"] / 1000.0 - seconds
        needed = abs(target - begin) / speed * PER_MINUTE
        seconds += needed
        place = place.copy()
        place[axis] = (
            target
            if needed <= left
            else begin + (target - begin) * left / needed
        )
        rows += way(channel, place, speed, n, offset)
        if needed > left:
            text = (
                f"G71 {letter}: {ERRORS[1005]} ({p['TIME_OUT_HOME'] / 1e3:g} s)"
            )
            channel.failure = fail(1005, text, offset)
            return rows
    preset = p[f"RZERO_PRESET_{letter}"] * unit
    # the encoder says where the axis is
    if mode == ABSOLUTE and not p.given(f"RZERO_PRESET_{letter}"):
        preset = _encoder(sensors, letter, offset) + float(place[axis]) - here
    channel.frame.home[axis] = float(place[axis]) - preset
    channel.frame.update()
    channel.homed.add(axis)
    return rows


def _encoder(sensors: HomingSensors, letter: str, offset: int) -> float:
    if sensors.absolute is None:
        text = (
            f"G71 {letter}: {ERRORS[1005]}: the axis has no absolute "
            "encoder (absolute of its homing table)"
        )
        raise fail(1005, text, offset)
    return sensors.absolute
