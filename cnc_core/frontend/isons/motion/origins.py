"""Origins, offsets, heads and tool lengths: G43 .. G46, G53 .. G59, G82 .. G99, OX."""

from __future__ import annotations

from cnc_core.frontend.base.lexer import fail
from cnc_core.units import FloatArray

from ..base.text import AXIS_LETTERS
from ..base.words import Words
from .frame import Layer, check_slot
from .state import ChannelState

FIXED_ORIGINS = {55: "Y", 56: "Z", 57: "XY", 58: "YZ", 59: "XZ"}


def frame_function(
    channel: ChannelState, code: int, offset: int, words: Words
) -> None:
    """What moves the zero: origins, offsets, heads, lengths, presets."""
    frame = channel.frame
    channel.not_compensated(f"G{code}", offset)
    if code in (98, 53, 99):
        frame.origin.on = code == 99
    elif code in (96, 97):
        frame.offset.on = code == 97
    elif code in (87, 88):
        frame.head_on = code == 88
    elif code == 94 and "USER_OFFSET" not in words.values:
        frame.origin.store(
            some_values(channel, words, frame.origin.value, code, offset)
        )
    elif code in (93, 94):  # the guide's example of USER_OFFSET has G94
        offsets(channel, words, code, offset)
    elif code in (92, 82, 95, 85):
        layer = frame.origin if code in (92, 82) else frame.offset
        frame.set_here(
            layer, some_axes(channel, words, code, offset), code in (82, 85)
        )
    elif code in range(54, 60):
        recall(channel, code, offset, words)
    elif code == 89:
        channel.frame.preset(
            some_values(
                channel, words, frame.position_from_home(), code, offset
            )
        )
    elif code == 86:
        frame.preset_turns(rotary_axes(channel, words, offset))
    else:
        length(channel, code, offset, words)
    frame.update()


def some_axes(
    channel: ChannelState, words: Words, code: int, offset: int
) -> list[int]:
    """Axes that are named, at least one."""
    axes = channel.named_axes(words)
    if not axes:
        raise fail(900004, f"G{code}: axes are expected", offset)
    return axes


def some_values(
    channel: ChannelState,
    words: Words,
    current: FloatArray,
    code: int,
    offset: int,
) -> dict[int, float]:
    """As ``_given``, at least one."""
    values = channel.given(words, current)
    if not values:
        raise fail(900004, f"G{code}: axes with values are expected", offset)
    return values


def offsets(
    channel: ChannelState, words: Words, code: int, offset: int
) -> None:
    """G93."""
    layer = channel.frame.offset
    values = channel.given(words, layer.value)
    for letter in AXIS_LETTERS:
        value = words.take("DO" + letter)
        if value is not None:
            axis = channel.axis(letter, words.offset("DO" + letter))
            values[axis] = value * channel.scale(axis)
    if not values and not words.block.indexed:
        raise fail(900004, f"G{code}: axes with values are expected", offset)
    layer.store(values)
    for name, (number, value_of, place) in words.block.indexed.items():
        words.used.add(name)
        channel.positioner_offset(number(), value_of(), name == "DP", place)


def recall(channel: ChannelState, code: int, offset: int, words: Words) -> None:
    """G54 .. G59."""
    layer: Layer = channel.frame.origin
    number = layer.index
    if code == 54:
        axes = channel.named_axes(words) or [channel.axis("X", offset)]
        if 54 in words.indices:
            number = check_slot("G54", words.indices[54], offset)
    else:
        axes = [channel.axis(letter, offset) for letter in FIXED_ORIGINS[code]]
    layer.recall(axes, number)


def rotary_axes(channel: ChannelState, words: Words, offset: int) -> list[int]:
    """The rotary axes of G86."""
    axes = some_axes(channel, words, 86, offset)
    for axis in axes:
        if not channel.machine.rotary[axis]:
            raise fail(
                909113,
                f"G86: {channel.machine.axes[axis]} is not a rotary axis",
                offset,
            )
    return axes


def length(channel: ChannelState, code: int, offset: int, words: Words) -> None:
    """G43 .. G46."""
    frame = channel.frame
    if code in (44, 46):
        frame.length[:] = frame.length_extra[:] = 0.0
        frame.length_axis = -1
        return
    signs = words.block.signs
    if len(signs) != 1:
        raise fail(900004, f"G{code}: one axis with + or - is expected", offset)
    letter, sign = next(iter(signs.items()))
    words.used.add(letter)
    axis = channel.axis(letter, offset)
    length = length_word(channel, code, axis, words)
    if words.take("K") == 1.0:
        frame.length_extra[axis] = length or channel.table[1]
    else:
        frame.length[:] = 0.0
        frame.length[axis] = sign * (length or channel.table[1])
    frame.length_axis = axis


def length_word(
    channel: ChannelState, code: int, axis: int, words: Words
) -> float:
    """Length that G43 or G45 names, 0: that of the tool table."""
    if code == 45:
        return 0.0
    value, relative = words.take("X"), words.take("DX")
    if relative is not None:
        return (
            float(abs(channel.frame.length[axis]))
            + relative * channel.modal.unit_mm
        )
    return (value or 0.0) * channel.modal.unit_mm


def origin_words(channel: ChannelState, words: Words) -> None:
    """OX0 OY1: origins of single axes from slots."""
    for letter in AXIS_LETTERS:
        number = words.take("O" + letter)
        if number is None:
            continue
        offset = words.offset("O" + letter)
        channel.not_compensated(f"O{letter}", offset)
        channel.frame.origin.recall(
            [channel.axis(letter, offset)],
            check_slot(f"O{letter}", number, offset),
        )
        channel.frame.update()
