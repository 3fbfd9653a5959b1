"""RTCP: G103 passes values, G104 lets the tool tip be programmed, G105 the axes
again.
"""

from __future__ import annotations

from cnc_core.blocks import COORDINATES
from cnc_core.blocks.coordinates import Coordinates
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Row
from cnc_core.frontend.machine import TipMachine
from cnc_core.frontend.port import Wait

from ..base.text import AXIS_LETTERS
from ..base.words import Words
from .state import ChannelState

VALUES, ON = 103, 104
NO_KINEMATICS = 910106
# the value of G103 that counts here: the tool length; the others are kept for
# the machine's geometry
LENGTH = "Z"


def tip_function(
    channel: ChannelState, code: int, words: Words, offset: int
) -> list[Row | Wait]:
    """G103, G104, G105."""
    channel.not_compensated(f"G{code}", offset)
    if code == VALUES:
        _take_values(channel, words)
        return []
    tip = channel.tip
    machine = tip.machine
    if machine is None:
        raise fail(NO_KINEMATICS, f"G{code}: {ERRORS[NO_KINEMATICS]}", offset)
    if tip.on == (code == ON):
        return []
    return [
        *channel.output.flush(),
        *_switch(channel, machine, words.block.n, on=code == ON),
    ]


def _take_values(channel: ChannelState, words: Words) -> None:
    for letter in AXIS_LETTERS:
        value = words.take(letter)
        if value is not None:
            channel.tip.values[letter] = value


def _switch(
    channel: ChannelState, machine: TipMachine, n: int, *, on: bool
) -> list[Row]:
    """No axis moves; the program names another point from here on."""
    tip, modal = channel.tip, channel.modal
    here = modal.position[None, :]
    if on:
        tip.length = tip.values.get(LENGTH, channel.table[1])
        place = machine.programmed(here, tip.length)[0]
    else:
        place = machine.driven(here, tip.length)[0]
    tip.on = channel.modes.tip_on = on
    coordinates = Coordinates()
    if on:
        kinematics = channel.machine.kin_id
        coordinates = Coordinates(kinematics=kinematics, length=tip.length)
    row = modal.row(COORDINATES, n)
    coordinates.fill(row, place)
    modal.set_position(place)
    channel.output.moved_to(place)
    channel.refresh()
    return channel.emit(row)
