"""Words of the interpolation modes and filters: G49, G63 .. G75, G106."""

from __future__ import annotations

from cnc_core.frontend.base.lexer import fail

from ..base.text import AXIS_LETTERS
from ..base.words import Words
from .path_modes import DEPTH_OFF
from .state import ChannelState

DEPTH_MAX = 2**31 - 1
ORDER_MAX = 7
SAMPLES_MAX = 10000
FILTER_CODES = (66, 72, 73, 74, 106)


def mode_function(
    channel: ChannelState, code: int, words: Words, offset: int
) -> None:
    """Take over one function; the rows for it come before the block's motion."""
    channel.modes_changed = True
    if code in (63, 64, 65, 67, 75):
        channel.modes.mode = code
    elif code == 68:
        _always_plane(channel, words, offset)
    elif code == 69:
        _depth(channel, words, offset)
    elif code == 49:
        _mild(channel, words, offset)
    else:
        {66: _feed_control, 72: _nurbs, 73: _noise, 74: _short, 106: _smooth}[
            code
        ](channel, words, offset)
        if not channel.modes.filtering:
            channel.warn(
                907042, f"G{code} acts when G69 X is over {DEPTH_OFF}", offset
            )


def _number(
    words: Words,
    name: str,
    offset: int,
    low: float,
    high: float = 1e9,
    *,
    whole: bool = False,
) -> float | None:
    """A word's value inside its range, None if it is not programmed."""
    value = words.take(name)
    if value is None:
        return None
    if not low <= value <= high or (whole and value != int(value)):
        what = "a whole number " if whole else ""
        raise fail(
            900012,
            f"{name}{value:g}: {what}{low:g} to {high:g} is expected",
            words.offset(name) or offset,
        )
    return value


def _switch(words: Words, offset: int, highest: int, now: int) -> int:
    """X; without it, as it is now, on if it was off."""
    value = _number(words, "X", offset, 0, highest, whole=True)
    return (now or 1) if value is None else int(value)


def _always_plane(channel: ChannelState, words: Words, offset: int) -> None:
    if not channel.modes.filtering:
        raise fail(909117, f"G68 needs G69 with X over {DEPTH_OFF}", offset)
    limit = _number(words, "X", offset, -1)
    channel.modes.mode = 68
    rate = channel.parameters["FEEDRES"] / 60.0
    channel.modes.transport_limit = (
        -1.0 if limit == -1.0 else (limit or 0.0) * rate
    )


def _depth(channel: ChannelState, words: Words, offset: int) -> None:
    value = _number(words, "X", offset, 0, DEPTH_MAX, whole=True)
    if value is None:
        raise fail(
            900012, "G69: X with the number of blocks is expected", offset
        )
    axes = channel.named_axes(words)
    if len(axes) > 1:
        raise fail(900004, "G69: one tangential axis at most", offset)
    channel.modes.depth = int(value)
    channel.modes.tangential = axes[0] if axes else None


def _mild(channel: ChannelState, words: Words, offset: int) -> None:
    """G49 XYZ, G49, G49 0, G49 1."""
    modes, axes = channel.modes, channel.named_axes(words)
    if 49 in words.indices:
        if axes:
            raise fail(900004, "G49: 0 or 1, or axes, not both", offset)
        if words.indices[49] not in (0.0, 1.0):
            raise fail(900012, "G49: 0 or 1 is expected", offset)
        modes.mild_on = words.indices[49] == 1.0 and bool(modes.mild)
        return
    modes.mild, modes.mild_on = set(axes), bool(axes)


def _feed_control(channel: ChannelState, words: Words, offset: int) -> None:
    filters = channel.modes.filters
    rate = channel.parameters["FEEDRES"] / 60.0 * channel.modal.unit_mm
    filters.feed_control = _switch(
        words, offset, SAMPLES_MAX, filters.feed_control
    )
    inertia, dead, floor = (_number(words, name, offset, 0) for name in "YZA")
    filters.inertia = filters.inertia if inertia is None else inertia
    filters.dead_band = filters.dead_band if dead is None else dead * rate
    filters.feed_floor = filters.feed_floor if floor is None else floor * rate


def _nurbs(channel: ChannelState, words: Words, offset: int) -> None:
    filters, unit = channel.modes.filters, channel.modal.unit_mm
    filters.nurbs = bool(_switch(words, offset, 1, 0))
    length = _number(words, "Y", offset, 0)
    step = _number(words, "A", offset, 1e-3)
    order = _number(words, "Z", offset, 1, ORDER_MAX, whole=True)
    filters.nurbs_length = (
        filters.nurbs_length if length is None else length * unit
    )
    filters.nurbs_step = filters.nurbs_step if step is None else step * unit
    filters.nurbs_order = filters.nurbs_order if order is None else int(order)


def _noise(channel: ChannelState, words: Words, offset: int) -> None:
    filters, unit = channel.modes.filters, channel.modal.unit_mm
    filters.noise = _switch(words, offset, 3, filters.noise)
    angle = _number(words, "Y", offset, 0, 180)
    length = _number(words, "Z", offset, 0)
    cusps = _number(words, "A", offset, 0, 1, whole=True)
    filters.noise_angle = filters.noise_angle if angle is None else angle
    filters.noise_length = (
        filters.noise_length if length is None else length * unit
    )
    filters.cusps = filters.cusps if cusps is None else bool(cusps)


def _short(channel: ChannelState, words: Words, offset: int) -> None:
    filters = channel.modes.filters
    filters.short = bool(_switch(words, offset, 1, 0))
    length = _number(words, "Y", offset, 0)
    filters.short_length = (
        filters.short_length
        if length is None
        else length * channel.modal.unit_mm
    )


def _smooth(channel: ChannelState, words: Words, offset: int) -> None:
    """G106 [axis] X A B."""
    filters, unit = channel.modes.filters, channel.modal.unit_mm
    number = words.indices.get(106)
    if number is None or number not in range(len(AXIS_LETTERS)):
        raise fail(
            900012,
            "G106: the index of an axis in brackets, [0] to [8], is expected",
            offset,
        )
    axis = channel.axis(AXIS_LETTERS[int(number)], offset)
    on = _switch(words, offset, 1, 0)
    level = _number(words, "A", offset, 0, 1)
    length = _number(words, "B", offset, 0)
    if length is not None:
        filters.smooth_length = length * unit
    if not on:
        filters.smooth.pop(axis, None)
        return
    filters.smooth[axis] = (
        filters.smooth.get(axis, 0.7) if level is None else max(level, 1e-6)
    )
