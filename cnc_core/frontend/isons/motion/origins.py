"""Origins, offsets, heads and tool lengths: G43 .. G46, G53 .. G59, G82 .. G99, OX."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cnc_core.frontend.base.lexer import fail

from ..base.text import AXIS_LETTERS
from ..language.words import Words
from .frame import Layer, check_slot

if TYPE_CHECKING:
    from .executor import Array, Executor

FIXED_ORIGINS = {55: "Y", 56: "Z", 57: "XY", 58: "YZ", 59: "XZ"}


def frame_function(
    executor: Executor, code: int, offset: int, words: Words
) -> None:
    """What moves the zero: origins, offsets, heads, lengths, presets."""
    frame = executor.frame
    executor.not_compensated(f"G{code}", offset)
    if code in (98, 53, 99):
        frame.origin.on = code == 99
    elif code in (96, 97):
        frame.offset.on = code == 97
    elif code in (87, 88):
        frame.head_on = code == 88
    elif code == 94 and "USER_OFFSET" not in words.values:
        frame.origin.store(
            some_values(executor, words, frame.origin.value, code, offset)
        )
    elif code in (93, 94):  # the guide's example of USER_OFFSET has G94
        offsets(executor, words, code, offset)
    elif code in (92, 82, 95, 85):
        layer = frame.origin if code in (92, 82) else frame.offset
        frame.set_here(
            layer, some_axes(executor, words, code, offset), code in (82, 85)
        )
    elif code in range(54, 60):
        recall(executor, code, offset, words)
    elif code == 89:
        executor.frame.preset(
            some_values(
                executor, words, frame.position_from_home(), code, offset
            )
        )
    elif code == 86:
        frame.preset_turns(rotary_axes(executor, words, offset))
    else:
        length(executor, code, offset, words)
    frame.update()


def some_axes(
    executor: Executor, words: Words, code: int, offset: int
) -> list[int]:
    """Axes that are named, at least one."""
    axes = executor.named_axes(words)
    if not axes:
        raise fail(900004, f"G{code}: axes are expected", offset)
    return axes


def some_values(
    executor: Executor, words: Words, current: Array, code: int, offset: int
) -> dict[int, float]:
    """As ``_given``, at least one."""
    values = executor.given(words, current)
    if not values:
        raise fail(900004, f"G{code}: axes with values are expected", offset)
    return values


def offsets(executor: Executor, words: Words, code: int, offset: int) -> None:
    """G93."""
    layer = executor.frame.offset
    values = executor.given(words, layer.value)
    for letter in AXIS_LETTERS:
        value = words.take("DO" + letter)
        if value is not None:
            axis = executor.axis(letter, words.offset("DO" + letter))
            values[axis] = value * executor.scale(axis)
    if not values and not words.block.indexed:
        raise fail(900004, f"G{code}: axes with values are expected", offset)
    layer.store(values)
    for name, (number, value_of, place) in words.block.indexed.items():
        words.used.add(name)
        executor.positioner_offset(number(), value_of(), name == "DP", place)


def recall(executor: Executor, code: int, offset: int, words: Words) -> None:
    """G54 .. G59."""
    layer: Layer = executor.frame.origin
    number = layer.index
    if code == 54:
        axes = executor.named_axes(words) or [executor.axis("X", offset)]
        if 54 in words.indices:
            number = check_slot("G54", words.indices[54], offset)
    else:
        axes = [executor.axis(letter, offset) for letter in FIXED_ORIGINS[code]]
    layer.recall(axes, number)


def rotary_axes(executor: Executor, words: Words, offset: int) -> list[int]:
    """The rotary axes of G86."""
    axes = some_axes(executor, words, 86, offset)
    for axis in axes:
        if not executor.machine.rotary[axis]:
            raise fail(
                909113,
                f"G86: {executor.machine.axes[axis]} is not a rotary axis",
                offset,
            )
    return axes


def length(executor: Executor, code: int, offset: int, words: Words) -> None:
    """G43 .. G46."""
    frame = executor.frame
    if code in (44, 46):
        frame.length[:] = frame.length_extra[:] = 0.0
        frame.length_axis = -1
        return
    signs = words.block.signs
    if len(signs) != 1:
        raise fail(900004, f"G{code}: one axis with + or - is expected", offset)
    letter, sign = next(iter(signs.items()))
    words.used.add(letter)
    axis = executor.axis(letter, offset)
    length = length_word(executor, code, axis, words)
    if words.take("K") == 1.0:
        frame.length_extra[axis] = length or executor.table[1]
    else:
        frame.length[:] = 0.0
        frame.length[axis] = sign * (length or executor.table[1])
    frame.length_axis = axis


def length_word(
    executor: Executor, code: int, axis: int, words: Words
) -> float:
    """Length that G43 or G45 names, 0: that of the tool table."""
    if code == 45:
        return 0.0
    value, relative = words.take("X"), words.take("DX")
    if relative is not None:
        return (
            float(abs(executor.frame.length[axis]))
            + relative * executor.modal.unit_mm
        )
    return (value or 0.0) * executor.modal.unit_mm


def origin_words(executor: Executor, words: Words) -> None:
    """OX0 OY1: origins of single axes from slots."""
    for letter in AXIS_LETTERS:
        number = words.take("O" + letter)
        if number is None:
            continue
        offset = words.offset("O" + letter)
        executor.not_compensated(f"O{letter}", offset)
        executor.frame.origin.recall(
            [executor.axis(letter, offset)],
            check_slot(f"O{letter}", number, offset),
        )
        executor.frame.update()
