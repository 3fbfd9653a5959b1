"""Words that select: slots, heads, feed, tool, speed."""

from __future__ import annotations

from cnc_core.blocks import S, T
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import MotionWords, Row

from ..base.words import Words
from .frame import check_slot
from .state import ChannelState

LARGEST = 2**31 - 1  # number of a tool in a row


def selections(channel: ChannelState, words: Words) -> list[Row]:
    """Slots, head, pause mode, feed, tool and speed of a block."""
    rows: list[Row] = []
    for name, layer in (
        ("USER_ZERO", channel.frame.origin),
        ("USER_OFFSET", channel.frame.offset),
    ):
        number = words.take(name)
        if number is not None:
            channel.not_compensated(name, words.offset(name))
            layer.select(check_slot(name, number, words.offset(name)))
            channel.frame.update()
    head = words.take("H")
    if head is not None:
        channel.not_compensated("H", words.offset("H"))
        channel.frame.select_head(
            check_slot("H", head, words.offset("H")), words.offset("H")
        )
    mode = words.take("PAUSE_MODE")
    if mode is not None:
        if mode not in range(5):
            raise fail(
                900012,
                f"PAUSE_MODE {mode:g} is not 0..4",
                words.offset("PAUSE_MODE"),
            )
        channel.pause_mode = int(mode)
    if "F" in words.values and 4 not in words.codes:
        feed_word(channel, words)
    rows += tool_words(channel, words)
    return rows + speed_word(channel, words)


def feed_word(channel: ChannelState, words: Words) -> None:
    """F."""
    feed = words.take("F") or 0.0
    if feed <= 0:
        raise fail(900006, f"F{feed:g}: {ERRORS[900006]}", words.offset("F"))
    error, _ = channel.modal.apply(MotionWords(f=feed))
    if error:
        raise fail(error, ERRORS[error], words.offset("F"))
    channel.modes_changed = channel.modes_changed or channel.modes.mild_on


def tool_words(channel: ChannelState, words: Words) -> list[Row]:
    """T and D."""
    rows = []
    number = words.take("T")
    if number is not None:
        number = (
            number if channel.tool_instead is None else channel.tool_instead
        )
        channel.tool_instead = None
        check_tool(channel, number, words.offset("T"))
        channel.not_compensated("T", words.offset("T"))
        channel.tool, channel.diameter = int(number), None
        rows += channel.emit(
            channel.modal.row(T, words.block.n, code=channel.tool)
        )
    diameter = words.take("D")
    if diameter is not None:
        channel.not_compensated("D", words.offset("D"))
        if diameter < 0:
            raise fail(900012, f"D{diameter:g} is negative", words.offset("D"))
        channel.diameter = diameter * channel.modal.unit_mm
    return rows


def check_tool(channel: ChannelState, number: float, offset: int) -> None:
    """A tool of the machine, or 0."""
    known = {**channel.cell.tools, **channel.machine.tools}
    if (
        number != int(number)
        or not 0 <= number <= LARGEST
        or (number and known and number not in known)
    ):
        raise fail(900014, f"T{number:g}: the machine has no such tool", offset)
    if number and not known and not channel.without_tools_told:
        channel.without_tools_told = True
        channel.warn(
            907042,
            f"T{number:g}: the machine has no tool table, diameter and length are 0",
            offset,
        )


def speed_word(channel: ChannelState, words: Words) -> list[Row]:
    """S."""
    speed = words.take("S")
    if speed is None:
        return []
    if speed < 0:
        raise fail(900012, f"S{speed:g} is negative", words.offset("S"))
    highest = channel.parameters["SPEEDMAX"]
    speed = max(speed, channel.parameters["SPEEDMIN"])
    channel.spindle = min(speed, highest) if highest else speed
    if channel.parameters["WR_SPD"]:
        channel.speed_copied(channel.spindle)
    return channel.emit(
        channel.modal.row(S, words.block.n, value=channel.spindle)
    )
