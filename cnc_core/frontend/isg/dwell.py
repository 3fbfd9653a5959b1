"""G04: a dwell in seconds or in turns of the spindle."""

from __future__ import annotations

from cnc_core.blocks import DWELL
from cnc_core.errors import ERRORS
from cnc_core.units import SECONDS_PER_MINUTE

from ..base.lexer import fail
from ..base.scanner import Row
from .commands.time import DWELL_MAX_S
from .language.word_block import Words
from .state.state import ProgramState

DWELL_WORDS = frozenset({"N", "S", "G motion"})


def dwell(state: ProgramState, words: Words) -> Row:
    """The row of a block with G04."""
    _check_alone(state, words)
    seconds = _seconds(state, words)
    if not 0 <= seconds <= DWELL_MAX_S:
        raise fail(
            20752,
            f"G04: {seconds:g} s out of range 0..{DWELL_MAX_S:g} s",
            words.codes["G4"],
        )
    return state.modal.row(DWELL, words.motion.n, value=seconds)


def _check_alone(state: ProgramState, words: Words) -> None:
    names = {state.machine.axes[i].upper() for i in words.motion.axis}
    for name, offset in words.offsets.items():
        if name not in DWELL_WORDS and name not in names:
            text = f"{ERRORS[900018]}: {name.removeprefix('G ')}"
            raise fail(900018, text, offset)


def _seconds(state: ProgramState, words: Words) -> float:
    axes, offset = words.motion.axis, words.codes["G4"]
    given = [
        value
        for value in (words.dwell, *axes.values(), words.spindle)
        if value is not None
    ]
    if words.dwell is not None and axes:
        raise fail(20013, ERRORS[20013], offset)
    if any(axis != state.machine.main[0] for axis in axes):
        raise fail(20014, ERRORS[20014], offset)
    if len(given) != 1:
        text = "G04 takes one time or a number of spindle turns"
        raise fail(900004, text, offset)
    if words.spindle is None:
        return given[0]
    rev_min = state.channel.spindle_rev_min
    if rev_min <= 0:
        raise fail(900019, "G04 S: no spindle speed is programmed", offset)
    return words.spindle * SECONDS_PER_MINUTE / rev_min
