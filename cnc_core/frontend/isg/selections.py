"""G functions that move nothing: offsets, mirroring, rotation, limits, weights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cnc_core.blocks import SOFT_LIMITS, motion_planes
from cnc_core.errors import ERRORS

from ..base.lexer import fail
from ..base.scanner import NO_CORRECTION, MotionWords, Row
from .language import gcodes
from .language.word_block import Words
from .state.dynamics import WEIGHTS
from .state.offsets import MIRROR, ZERO_OFFSET
from .state.spaces import Rotation
from .state.state import ProgramState


class Selections:
    """Takes these functions out of a block."""

    def __init__(self, state: ProgramState) -> None:
        self._state, self._channel = state, state.channel
        self._machine, self._modal = state.machine, state.modal
        self._offsets = state.offsets
        self._due_limits: list[Row] = []

    def limit_rows(self) -> list[Row]:
        """Rows of the software limits that changed since the last call."""
        rows, self._due_limits = self._due_limits, []
        return rows

    def take(self, words: Words) -> Words:
        """Take offsets, mirroring, diameter and feed modes out of a block.

        Returns the words that are left for the motion.
        """
        codes = words.codes
        if not codes:
            return self._feed_word(words)
        takers = [code for code in gcodes.AXIS_TAKERS if f"G{code}" in codes]
        if len(takers) > 1:
            raise fail(908005, ERRORS[908005], codes[f"G{takers[1]}"])
        if words.motion.absolute is not None or words.motion.inch is not None:
            self._select_first(words)
        self._modes(words)
        self._selections(words)
        self._weights(words)
        if takers:
            words = self._take_axes(takers[0], words)
        self._stored_codes(words)
        return self._feed_word(words)

    def _select_first(self, words: Words) -> None:
        """G90, G91, G70, G71 count for everything in their block."""
        self._modal.apply(
            MotionWords(absolute=words.motion.absolute, inch=words.motion.inch)
        )

    def _modes(self, words: Words) -> None:
        for mode in gcodes.FEED_MODES:
            if f"G{mode}" in words.codes:
                if mode == 95 and self._channel.smooth.hsc is not None:
                    raise fail(
                        120433, f"{ERRORS[120433]}: G95", words.codes["G95"]
                    )
                self._channel.feeds.choose(mode)
        if "G51" in words.codes or "G52" in words.codes:
            self._offsets.diameter = "G51" in words.codes
            self._offsets.update()
        if "G69" in words.codes and self._state.spaces.rotation is not None:
            self._channel.not_compensated("G69", words.codes["G69"])
            self._state.spaces.set_rotation(None)
        if "G164" in words.codes or "G165" in words.codes:
            self._modal.set_rule(NO_CORRECTION, "G164" in words.codes)

    def _selections(self, words: Words) -> None:
        """Zero offsets and mirroring."""
        codes = words.codes
        for code in range(53, 60):
            if f"G{code}" in codes:
                self._zero_offset(code - 53, codes[f"G{code}"])
        if 159 in words.values:
            self._zero_offset(round(words.values[159]), codes["G159"])
            self._offsets.by_value[ZERO_OFFSET] += 1
        for code, (x, y) in gcodes.MIRRORS.items():
            if f"G{code}" in codes and (x, y) != self._offsets.signs():
                self._channel.not_compensated(f"G{code}", codes[f"G{code}"])
                self._offsets.set_mirror(x, y)

    def _zero_offset(self, number: int, offset: int) -> None:
        self._offsets.check_number(number, offset)
        if number != self._offsets.number:
            self._channel.not_compensated("a change of the zero offset", offset)
        self._offsets.select(number)

    def _take_axes(self, code: int, words: Words) -> Words:
        offset, axes = words.codes[f"G{code}"], words.motion.axis
        if code == 92:
            self._channel.not_compensated("G92", offset)
            self._offsets.set_g92(axes, add=not self._modal.absolute)
        elif code == 68:
            return self._rotate(words, offset)
        elif code == 160:
            self._exclude(words, offset)
        elif code == 351:
            self._mirror_axes(axes, offset)
        elif code in gcodes.SOFT_LIMITS:
            self._soft_limits(code, axes, offset)
        elif code in WEIGHTS and not axes:
            raise fail(900004, f"G{code} without axis words", offset)
        elif code in WEIGHTS:
            self._channel.dynamics.weigh(code, axes, offset)
        elif code == 74 and not axes:
            raise fail(900004, "G74 without axis words", offset)
        return replace(words, motion=replace(words.motion, axis={}))

    def _rotate(self, words: Words, offset: int) -> Words:
        """G68 R30 X10 Y5: contour rotation about a point of the plane, the
        present one where no word names it.
        """
        self._channel.not_compensated("G68", offset)
        modal, axes = self._modal, words.motion.axis
        plane = words.motion.plane or modal.plane
        first, second, third = (
            self._machine.main[place] for place in motion_planes(plane)
        )
        if third in axes:
            raise fail(22156, ERRORS[22156], offset)
        if set(axes) - {first, second} or min(first, second) < 0:
            raise fail(
                900010,
                "G68: only words of the plane's axes name the centre",
                offset,
            )
        self._state.spaces.set_rotation(None)
        self._state.spaces.touch()
        present = self._state.spaces.position_in(
            self._state.spaces.wanted(), self._state.spaces.axes()
        )
        total = self._offsets.selected_total()
        centre = [
            self._offsets.from_zero(a, axes[a])
            if a in axes
            else float(present[a] - total[a])
            for a in (first, second)
        ]
        rotation = Rotation(
            plane, words.motion.r or 0.0, (centre[0], centre[1])
        )
        self._state.spaces.set_rotation(rotation)
        self._state.rotation_in_cycle(offset)
        return replace(words, motion=replace(words.motion, axis={}, r=None))

    def _soft_limits(
        self, code: int, axes: dict[int, float], offset: int
    ) -> None:
        """G98, G99: lowest and highest position of axes, machine coordinates,
        within the machine's own range.
        """
        if not axes:
            raise fail(900004, f"G{code} without axis words", offset)
        side = code - 98
        wide = np.full(len(self._offsets.names), 1e9)
        machine = self._machine.limits or (-wide, wide)
        if self._channel.soft_limits is None:
            self._channel.soft_limits = machine[0].copy(), machine[1].copy()
        for axis, word in axes.items():
            own = float(machine[side][axis])
            value = word * self._offsets.scale(axis) + (
                0.0 if self._modal.absolute else own
            )
            if (own - value) * (1, -1)[side] > 0:
                self._state.warn(
                    21648,
                    f"G{code} {self._offsets.names[axis]}{word:g}: {ERRORS[21648]}",
                    offset,
                )
                value = own
            self._channel.soft_limits[side][axis] = value
            if (
                self._channel.soft_limits[0][axis]
                >= self._channel.soft_limits[1][axis]
            ):
                raise fail(
                    21649,
                    f"G{code} {self._offsets.names[axis]}{word:g}: {ERRORS[21649]}",
                    offset,
                )
        row = self._modal.row(SOFT_LIMITS, 0, code=code)
        row["end"] = np.nan
        row["end"][0][: len(self._offsets.names)] = self._channel.soft_limits[
            side
        ]
        self._due_limits.append(row)

    def _exclude(self, words: Words, offset: int) -> None:
        if 160 not in words.values:
            raise fail(900004, "G160 without =number", offset)
        number = round(words.values[160])
        self._offsets.check_number(number, offset)
        for axis, value in words.motion.axis.items():
            if value not in (0.0, 1.0):
                raise fail(
                    900012,
                    f"G160 {self._offsets.names[axis]}{value:g}: 0 or 1 is expected",
                    offset,
                )
        self._offsets.exclude(
            number,
            {axis: value == 1.0 for axis, value in words.motion.axis.items()},
        )

    def _mirror_axes(self, axes: dict[int, float], offset: int) -> None:
        if any(value not in (1.0, -1.0) for value in axes.values()):
            raise fail(20860, ERRORS[20860], offset)
        self._channel.not_compensated("G351", offset)
        for axis, value in axes.items():
            self._offsets.mirror[axis] = value
        self._offsets.by_value[MIRROR] += 1
        self._offsets.update()

    def _weights(self, words: Words) -> None:
        """G128=, G131= ..: one weight for all axes."""
        for code, value in words.values.items():
            if code in WEIGHTS:
                every = dict.fromkeys(range(len(self._machine.axes)), value)
                self._channel.dynamics.weigh(
                    code, every, words.codes[f"G{code}"]
                )

    def _stored_codes(self, words: Words) -> None:
        if not 0 <= words.values.get(115, 0) <= 14:
            raise fail(20151, ERRORS[20151], words.codes["G115"])
        if "G13" in words.codes and not self._channel.corner_param:
            raise fail(20795, ERRORS[20795], words.codes["G13"])
        for name, offset in words.codes.items():
            code = int(name[1:])
            if code in gcodes.STORED:
                self._channel.stored_without_effect(name, offset)

    def _feed_word(self, words: Words) -> Words:
        if self._channel.feeds.per_minute or words.motion.f is None:
            return words
        self._channel.feeds.word(words.motion.f, words.offsets["F"])
        return replace(words, motion=replace(words.motion, f=None))
