"""Marks of the contour look-ahead for the PLC, said as the HLI's manual says
them, in every dialect the same.

``#CONTOUR LOOKAHEAD LOG [ON | OFF | CLEAR] [[PARAM=x]]`` and ``#DISTANCE PROG
START CLEAR``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cnc_core.blocks import (
    DISTANCE_RESET,
    HAS_PARAM,
    MARKER,
    MARKER_CLEAR,
    MARKER_OFF,
    MARKER_ON,
    MARKER_PARAM,
)
from cnc_core.frontend.base.lexer import TokenStream, fail
from cnc_core.frontend.base.scanner import Row
from cnc_core.frontend.port import Wait

from ..language.formulas import Formulas
from ..motion.state import ChannelState

ACTIONS = {"ON": MARKER_ON, "OFF": MARKER_OFF, "CLEAR": MARKER_CLEAR}
Items = Sequence[Row | Wait]


def look_ahead_command(
    stream: TokenStream, formulas: Formulas, channel: ChannelState, n: int
) -> Callable[[], Items] | None:
    """What the block does; None if it does not begin with ``#``.  ``n``: its N
    number.
    """
    if stream.current.text != "#":
        return None
    start = stream.next().offset
    if stream.accept_name("DISTANCE"):
        _words(stream, "PROG", "START", "CLEAR")
        run = _distance(channel, n)
    elif stream.accept_name("CONTOUR"):
        run = _log(stream, formulas, channel, start, n)
    else:
        raise fail(
            900002,
            "#CONTOUR LOOKAHEAD and #DISTANCE PROG START CLEAR are the only commands with #",
            start,
        )
    if not stream.at_end:
        raise fail(
            900010, f"unexpected {stream.current.text!r}", stream.current.offset
        )
    return run


def _words(stream: TokenStream, *words: str) -> None:
    for word in words:
        if not stream.accept_name(word):
            raise fail(900010, f"{word} is expected", stream.current.offset)


def _distance(channel: ChannelState, n: int) -> Callable[[], Items]:
    return lambda: channel.emit(channel.modal.row(DISTANCE_RESET, n))


def _log(
    stream: TokenStream,
    formulas: Formulas,
    channel: ChannelState,
    start: int,
    n: int,
) -> Callable[[], Items]:
    _words(stream, "LOOKAHEAD")
    log = stream.accept_name("LOG")
    word = stream.accept_name(*ACTIONS)
    action = ACTIONS[word.text.upper()] if word else MARKER_PARAM
    if not log and action != MARKER_CLEAR:
        raise fail(
            900010, "#CONTOUR LOOKAHEAD: LOG is expected", stream.current.offset
        )
    bracket = stream.current.offset
    param = None
    if stream.accept("["):
        _words(stream, "PARAM")
        stream.expect("=", 900010)
        param = formulas.full("PARAM")
        stream.expect("]", 900010)
    if action == MARKER_CLEAR and param is not None:
        raise fail(900010, "LOG CLEAR takes no PARAM", bracket)

    def run() -> Items:
        if action == MARKER_CLEAR:
            channel.not_compensated("LOG CLEAR", start)
        value, flags = (0.0, 0) if param is None else (param(), HAS_PARAM)
        row = channel.modal.row(
            MARKER, n, code=action, value=value, flags=flags
        )
        if action == MARKER_CLEAR:
            return [*channel.output.flush(), Wait.DRAINED, row]
        return [*channel.emit(row)]

    return run
