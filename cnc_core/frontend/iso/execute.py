"""Words of one line to rows, in the order of execution that RS-274 lays down."""

from __future__ import annotations

from collections.abc import Callable

from cnc_core.blocks import SMOOTHING, STANDSTILL, M, S, T, motion_planes
from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.compensation import Choice, Compensation
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, MotionWords, Row
from cnc_core.frontend.iso import codes
from cnc_core.frontend.iso import parameters as p
from cnc_core.frontend.iso.cycles import DWELL_MAX_S, Drilling
from cnc_core.frontend.iso.frame import Frame, machine_coordinates
from cnc_core.frontend.iso.mover import Mover, add_turns
from cnc_core.frontend.iso.usage import check_usage
from cnc_core.frontend.iso.words import Words
from cnc_core.frontend.machine import ProgramMachine, Tool

SYSTEMS = {
    540: 1,
    550: 2,
    560: 3,
    570: 4,
    580: 5,
    590: 6,
    591: 7,
    592: 8,
    593: 9,
}
TURNS_MAX = 1_000_000
Warn = Callable[[str], None]


class Executor:
    """State of the channel beyond the modal state of the motions."""

    def __init__(
        self, machine: ProgramMachine, modal: Modal, warn: Warn
    ) -> None:
        self._machine, self._modal, self._warn = machine, modal, warn
        self._axes = {
            name.upper(): i
            for i, name in enumerate(machine.axes)
            if len(name) == 1
        }
        self.frame = Frame(machine, modal)
        self.compensation = Compensation(modal)
        self.compensation.choice = Choice(corner=26)
        self.drilling = Drilling(machine, modal)
        self.motion_off = True  # G80, and at the program's start
        self.inverse_time = False
        self.to_top = False
        self.spindle = 0  # M3 or M4 while it turns
        self.surface_speed = False
        self.tool = 0
        self.ended = False
        self.tolerance_mm = 0.0  # of G64 P

    @property
    def plain(self) -> bool:
        """A line of axis words is G0 to G3 with a feed per minute."""
        return (
            self.drilling.code is None
            and not self.motion_off
            and not self.inverse_time
        )

    def execute(self, words: Words) -> list[Row]:
        """Rows of one block; sets ``ended`` when the block ends the program."""
        before = self.compensation.choice
        try:
            return self._executed(words)
        except CncError:
            self.compensation.take_back(before)
            raise

    def _executed(self, words: Words) -> list[Row]:
        motion = self._motion_of(words)
        self._check_m(words)
        check_usage(words, motion)
        mover = Mover(
            self._modal,
            words.n,
            words.first(codes.AXIS_LETTERS + "IJKR"),
            self._minutes(words, motion),
        )
        self._feed_mode(words)
        self._feed(words)
        rows = self._switch_rows(words)
        rows += self._dwell(words, mover)
        self._codes(words)
        rows += self._tolerance(words)
        rows += self._compensation(words)
        self._tool_length(words)
        self._system(words)
        rows += self._nonmodal(words, mover)
        rows += self._motion(motion, words, mover)
        self.compensation.settle()
        rows += self._ends(words)
        return rows

    # what the block moves

    def _motion_of(self, words: Words) -> int | None:
        """G function of the motion in tenths; None where nothing moves (G80
        included).
        """
        taker = words.one_of(codes.TAKES_AXES)
        given = next(
            (code for code in words.g if codes.GROUP_OF[code] == "motion"), None
        )
        if taker is not None:
            if given not in (None, 800):
                text = f"{codes.name(taker)} and {codes.name(given or 0)} use the same axis words"
                raise fail(908005, text, words.g[taker])
            return None
        if given == 800 and (words.axes or words.centre):
            raise fail(
                908003,
                f"G80: {ERRORS[908003]}",
                words.first(codes.AXIS_LETTERS + "IJK"),
            )
        if given is not None:
            return None if given == 800 else given
        return self._modal_motion(words) if words.axes or words.centre else None

    def _modal_motion(self, words: Words) -> int:
        if self.motion_off:
            raise fail(
                908003, ERRORS[908003], words.first(codes.AXIS_LETTERS + "IJK")
            )
        return (
            self._modal.motion * 10
            if self.drilling.code is None
            else self.drilling.code
        )

    def _check_m(self, words: Words) -> None:
        for code, offset in words.m.items():
            if (
                code not in codes.STANDARD_M
                and code not in self._machine.m_functions
            ):
                known = code in (98, 99) or 50 <= code <= 73
                text = (
                    "is not supported"
                    if known
                    else "is not defined: give its synchronisation (m_synch)"
                )
                raise fail(
                    900003 if known else 900009, f"M{code} {text}", offset
                )

    # modes and functions, in their order

    def _minutes(self, words: Words, motion: int | None) -> float | None:
        """G93: duration of the block's motion."""
        mode = words.one_of((930, 940))
        if not (
            mode == 930 or (mode is None and self.inverse_time)
        ) or motion in (None, 0):
            return None
        if motion in codes.CYCLES:
            raise fail(
                900003,
                f"{codes.name(motion or 0)} with G93 is not supported",
                words.g.get(motion or 0, 0),
            )
        if not words.values.get("F", 0.0) > 0:
            raise fail(
                900006,
                "G93: F is missing or not positive",
                words.first(codes.AXIS_LETTERS),
            )
        return 1.0 / words.values["F"]

    def _feed_mode(self, words: Words) -> None:
        if 930 in words.g and not self.inverse_time:
            self.inverse_time = True
            self._modal.assume_feed()  # the rows' feed follows from their length
        elif 940 in words.g and self.inverse_time:
            self.inverse_time = False
            self._modal.forget_feed()

    def _feed(self, words: Words) -> None:
        """F counts in the unit before a G20 or G21 of its block."""
        if "F" in words.values and not self.inverse_time:
            Mover(self._modal, words.n, words.offsets["F"]).apply(
                MotionWords(f=words.values["F"])
            )

    def _switch_rows(self, words: Words) -> list[Row]:
        n, row, rows = words.n, self._modal.row, []
        self._spindle_mode(words)
        if "S" in words.values and not self.surface_speed:
            rows.append(row(S, n, value=words.values["S"]))
        if "T" in words.values:
            self.tool = int(words.values["T"])
            rows.append(row(T, n, code=self.tool))
        if 6 in words.m:
            self.frame.tool = self.tool
        self.spindle = next(
            (m if m != 5 else 0 for m in codes.SPINDLE if m in words.m),
            self.spindle,
        )
        if 49 in words.m:
            self._warn("M49: the overrides stay enabled")
        order = (6, *codes.SPINDLE, *codes.COOLANT)
        rows += [row(M, n, code=m) for m in order if m in words.m]
        return rows + [
            row(M, n, code=m) for m in words.m if m not in codes.STANDARD_M
        ]

    def _spindle_mode(self, words: Words) -> None:
        if 960 in words.g:
            self.surface_speed = True
            self._warn(
                "G96: the spindle speed of constant surface speed is not computed"
            )
        if 970 in words.g:
            self.surface_speed = False

    def _dwell(self, words: Words, mover: Mover) -> list[Row]:
        if 40 not in words.g:
            return []
        if "P" not in words.values:
            raise fail(900004, "G4 without P", words.g[40])
        if words.values["P"] > DWELL_MAX_S:
            raise fail(
                900012,
                f"G4: P out of range 0..{DWELL_MAX_S:g} s",
                words.offsets["P"],
            )
        return [mover.dwell(words.values["P"])]

    def _codes(self, words: Words) -> None:
        """Plane, unit, path control, distance mode, retract mode."""

        def chosen(first: int, second: int) -> bool | None:
            code = words.one_of((first, second))
            return None if code is None else code == first

        plane, control = (
            words.one_of((170, 180, 190)),
            words.one_of((610, 611, 640)),
        )
        motion = MotionWords(
            plane=None if plane is None else plane // 10,
            inch=chosen(200, 210),
            absolute=chosen(900, 910),
            centre_absolute=chosen(901, 911),
            exact_stop=None if control is None else control != 640,
        )
        Mover(self._modal, words.n, words.g.get(plane or 0, 0)).apply(motion)
        to_top = chosen(990, 980)
        self.to_top = self.to_top if to_top is None else to_top

    def _tolerance(self, words: Words) -> list[Row]:
        """G64 P: the path may leave the contour by P.

        G64 without P, G61 and G61.1: the path stays on the contour.
        """
        code = words.one_of((610, 611, 640))
        if code is None:
            return []
        given = words.values.get("P", 0.0) if code == 640 else 0.0
        if given < 0.0:
            raise fail(900012, "G64: P is negative", words.offsets["P"])
        before, self.tolerance_mm = (
            self.tolerance_mm,
            given * self._modal.unit_mm,
        )
        if self.tolerance_mm == before:
            return []
        return [
            self._modal.row(
                SMOOTHING,
                words.n,
                code=int(self.tolerance_mm > 0.0),
                value=self.tolerance_mm,
            )
        ]

    def _compensation(self, words: Words) -> list[Row]:
        side = words.one_of((400, 410, 420))
        radius = self.compensation.choice.radius_mm
        if side in (410, 420):
            number = int(words.values.get("D", self.frame.tool))
            radius = (
                self._tool_data(
                    number, words.offsets.get("D", words.g[side])
                ).radius_mm
                if number
                else 0.0
            )
        given = {} if side is None else {f"G{side // 10}": words.g[side]}
        return self.compensation.update(
            given, radius, self._modal.plane, words.n
        )

    def _tool_data(self, number: int, offset: int) -> Tool:
        if number not in self._machine.tools:
            raise fail(900014, f"the machine has no tool {number}", offset)
        return self._machine.tools[number]

    def _tool_length(self, words: Words) -> None:
        code = words.one_of((430, 431, 490))
        if code is None:
            return
        if code != 490 and self.frame.z < 0:
            raise fail(
                900016,
                f"{codes.name(code)}: the machine has no Z axis",
                words.g[code],
            )
        self.frame.length_mm = 0.0 if code == 490 else self._length(code, words)
        self.frame.update()

    def _length(self, code: int, words: Words) -> float:
        if code == 431:
            if set(words.axes) != {"Z"}:
                raise fail(
                    900004,
                    "G43.1 takes Z and no other axis word",
                    words.g[code],
                )
            return words.values["Z"] * self._modal.unit_mm
        number = int(words.values.get("H", self.frame.tool))
        if number and not self._machine.tools:
            self._warn(
                f"G43: the machine has no tools, the length of tool {number} is taken as 0"
            )
            return 0.0
        return (
            self._tool_data(
                number, words.offsets.get("H", words.g[code])
            ).length_mm
            if number
            else 0.0
        )

    def _system(self, words: Words) -> None:
        code = words.one_of(tuple(SYSTEMS))
        if code is not None:
            self.frame.select(SYSTEMS[code])
            self.frame.update()

    # non-modal functions

    def _nonmodal(self, words: Words, mover: Mover) -> list[Row]:
        code = next(
            (g for g in words.g if codes.GROUP_OF[g] == "non-modal"), None
        )
        if code in (280, 300):
            return self._go_home(
                p.HOME_1 if code == 280 else p.HOME_2, words, mover
            )
        if code in (281, 301):
            self.frame.store_home(p.HOME_1 if code == 281 else p.HOME_2)
        elif code == 100:
            self._set_system(words)
        elif code is not None and code // 10 == 92:
            self._g92(code, words)
        self.frame.update()
        return []

    def _go_home(self, first: int, words: Words, mover: Mover) -> list[Row]:
        """Move by the programmed point to the stored one.

        Only the named axes move, or all if none is named.
        """
        if self.compensation.choice.active:
            raise fail(
                906003,
                ERRORS[906003],
                words.g[280 if first == p.HOME_1 else 300],
            )
        named = {
            self._axes[letter]: value for letter, value in words.axes.items()
        }
        motion = self._modal.motion
        rows = mover.line(0, named)
        home = self.frame.home(first)
        with machine_coordinates(self._modal, mm=True):
            rows += mover.line(
                0,
                {
                    i: float(home[i])
                    for i in range(len(home))
                    if not named or i in named
                },
            )
        mover.apply(MotionWords(motion=motion))
        return rows

    def _set_system(self, words: Words) -> None:
        """G10 L2 gives the offset; G10 L20 gives the position these
        coordinates.
        """
        kind, number, offset = (
            words.values.get("L"),
            words.values.get("P", 0.0),
            words.g[100],
        )
        if kind not in (2, 20):
            raise fail(900003, "G10 without L2 or L20 is not supported", offset)
        if number != int(number) or not 0 <= number <= p.SYSTEM_COUNT:
            raise fail(
                900012, f"G10: P{number:g} is not 0..{p.SYSTEM_COUNT}", offset
            )
        for letter, value in words.axes.items():
            axis = self._axes[letter]
            work = value * self.frame.scale(axis)
            if kind == 20:
                _, g92, length = self.frame.parts(axis)
                work = float(self._modal.position[axis]) - work - g92 - length
            system = int(number) or self.frame.system
            self.frame.parameters[
                self.frame.system_at(system, self.frame.slot[axis])
            ] = work

    def _g92(self, code: int, words: Words) -> None:
        if code == 920:
            if not words.axes:
                raise fail(900004, "G92 without an axis word", words.g[code])
            axes = {
                self._axes[letter]: value
                for letter, value in words.axes.items()
            }
            self.frame.set_g92(
                {
                    axis: value * self.frame.scale(axis)
                    for axis, value in axes.items()
                }
            )
        elif code == 921:
            self.frame.clear_g92()
        else:
            self.frame.parameters[p.G92_ACTIVE] = float(code == 923)

    # motion

    def _motion(
        self, motion: int | None, words: Words, mover: Mover
    ) -> list[Row]:
        if 800 in words.g:
            self.motion_off = True
            self.drilling.end()
        if motion is None:
            return []
        if motion in codes.CYCLES:
            return self._cycle(motion, words, mover)
        self.motion_off = False
        self.drilling.end()
        moves = MotionWords(
            axis={self._axes[a]: v for a, v in words.axes.items()},
            motion=motion // 10,
        )
        moves.centre, moves.r = words.centre, words.values.get("R")
        if 530 in words.g:
            with machine_coordinates(self._modal, mm=False):
                return mover.motion(moves)
        return (
            self._arc(moves, words, mover)
            if motion in codes.ARCS
            else mover.motion(moves)
        )

    def _cycle(self, motion: int, words: Words, mover: Mover) -> list[Row]:
        if self.compensation.choice.active:
            raise fail(
                906003,
                ERRORS[906003],
                words.g.get(motion, words.first(codes.AXIS_LETTERS)),
            )
        self.motion_off = False
        return self.drilling.run(
            motion, words, mover, self.spindle, to_top=self.to_top
        )

    def _arc(self, moves: MotionWords, words: Words, mover: Mover) -> list[Row]:
        turns = words.values.get("P", 1.0)
        if turns != int(turns) or not 1 <= turns <= TURNS_MAX:
            raise fail(
                900012,
                f"P{turns:g}: a whole number of turns from 1 on is expected",
                words.offsets["P"],
            )
        third = "IJK"[motion_planes(self._modal.plane)[2]]
        if moves.centre.pop(third, 0.0):
            raise fail(
                900015,
                f"{third}: no centre word of plane G{self._modal.plane}",
                words.offsets[third],
            )
        before = self._modal.position
        rows = mover.motion(moves)
        axis = self._machine.main[motion_planes(self._modal.plane)[2]]
        for row in rows:
            if turns > 1:
                add_turns(
                    row,
                    int(turns) - 1,
                    0.0
                    if axis < 0
                    else float(self._modal.position[axis] - before[axis]),
                )
        return rows

    def _ends(self, words: Words) -> list[Row]:
        """M0 and M1 stop, M2 and M30 end the program, behind the motion."""
        stops = [m for m in (*codes.STOPS, *codes.PROGRAM_ENDS) if m in words.m]
        self.ended = any(m in codes.PROGRAM_ENDS for m in stops)
        return [
            self._modal.row(M, words.n, code=m, flags=STANDSTILL) for m in stops
        ]
