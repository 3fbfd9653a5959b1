"""Words that select: slots, heads, feed, tool, speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cnc_core.blocks import S, T
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import MotionWords, Row

from ..language.words import Words
from .frame import check_slot

if TYPE_CHECKING:
    from .executor import Executor


def selections(executor: Executor, words: Words) -> list[Row]:
    """Slots, head, pause mode, feed, tool and speed of a block."""
    rows: list[Row] = []
    for name, layer in (
        ("USER_ZERO", executor.frame.origin),
        ("USER_OFFSET", executor.frame.offset),
    ):
        number = words.take(name)
        if number is not None:
            executor.not_compensated(name, words.offset(name))
            layer.select(check_slot(name, number, words.offset(name)))
            executor.frame.update()
    head = words.take("H")
    if head is not None:
        executor.not_compensated("H", words.offset("H"))
        executor.frame.select_head(
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
        executor.pause_mode = int(mode)
    if "F" in words.values and 4 not in words.codes:
        feed_word(executor, words)
    rows += tool_words(executor, words)
    return rows + speed_word(executor, words)


def feed_word(executor: Executor, words: Words) -> None:
    """F."""
    feed = words.take("F") or 0.0
    if feed <= 0:
        raise fail(900006, f"F{feed:g}: {ERRORS[900006]}", words.offset("F"))
    error, _ = executor.modal.apply(MotionWords(f=feed))
    if error:
        raise fail(error, ERRORS[error], words.offset("F"))
    executor.modes_changed = executor.modes_changed or executor.modes.mild_on


def tool_words(executor: Executor, words: Words) -> list[Row]:
    """T and D."""
    rows = []
    number = words.take("T")
    if number is not None:
        number, executor.tool_instead = (
            number if executor.tool_instead is None else executor.tool_instead,
            None,
        )
        check_tool(executor, number, words.offset("T"))
        executor.not_compensated("T", words.offset("T"))
        executor.tool, executor.diameter = int(number), None
        rows += executor.emit(
            executor.modal.row(T, words.block.n, code=executor.tool)
        )
    diameter = words.take("D")
    if diameter is not None:
        executor.not_compensated("D", words.offset("D"))
        if diameter < 0:
            raise fail(900012, f"D{diameter:g} is negative", words.offset("D"))
        executor.diameter = diameter * executor.modal.unit_mm
    return rows


def check_tool(executor: Executor, number: float, offset: int) -> None:
    """A tool of the machine, or 0."""
    known = {**executor.cell.tools, **executor.machine.tools}
    if (
        number != int(number)
        or number < 0
        or (number and known and number not in known)
    ):
        raise fail(900014, f"T{number:g}: the machine has no such tool", offset)
    if number and not known and not executor.without_tools_told:
        executor.without_tools_told = True
        executor.warn(
            907042,
            f"T{number:g}: the machine has no tool table, diameter and length are 0",
            offset,
        )


def speed_word(executor: Executor, words: Words) -> list[Row]:
    """S."""
    speed = words.take("S")
    if speed is None:
        return []
    if speed < 0:
        raise fail(900012, f"S{speed:g} is negative", words.offset("S"))
    highest = executor.parameters["SPEEDMAX"]
    speed = max(speed, executor.parameters["SPEEDMIN"])
    executor.spindle = min(speed, highest) if highest else speed
    if executor.parameters["WR_SPD"]:
        executor.speed_copied(executor.spindle)
    return executor.emit(
        executor.modal.row(S, words.block.n, value=executor.spindle)
    )
