"""A call of a built-in cycle: checked as a whole, then its results stored and
its program made a program level.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.flow import ProgramFile
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.source import TextSource
from cnc_core.frontend.base.variables import REAL64, Value, Variable
from cnc_core.frontend.isg.cycles import pattern
from cnc_core.frontend.isg.cycles.checking import check
from cnc_core.frontend.isg.cycles.declaration import (
    Cycle,
    CycleError,
    Given,
    Problem,
    Surroundings,
)

from ..state.call import Call
from ..state.patterns import At
from ..state.state import ProgramState
from ..state.store import VECTOR_NAMES
from ..state.system import PER_AXIS, SIMPLE

WRAPPER = "SysPosPatternWrapper"
FILES_MAX = (
    50_000  # with further calls, errors do not name the line of the call
)
ROTATION_ACTIVE = 910111


class CycleRunner:
    """Executes the built-in cycles of one program.

    ``owner``: whose local subprograms a made program sees.
    """

    def __init__(self, state: ProgramState) -> None:
        self._state = state
        self.owner: dict[int, ProgramFile] = {}
        self._lines: dict[
            int, int
        ] = {}  # of the calls, by the number of the made file

    def surroundings(self) -> Surroundings:
        """The channel as it is now."""
        state = self._state
        machine, modal, channel = (
            state.machine,
            state.modal,
            state.channel,
        )
        names = [
            None if axis < 0 else machine.axes[axis].upper()
            for axis in machine.main
        ]
        # cycles run without diameter programming
        shares = [0.5 if state.offsets.diameter else 1.0, 1.0, 1.0]
        at = [
            0.0 if axis < 0 else share * PER_AXIS["ABS"](state, axis)
            for axis, share in zip(machine.main, shares, strict=True)
        ]
        radius_mm = channel.tool_data.radius_mm
        factor = state.offsets.plane_factor(17) or math.nan  # as cycles run
        return Surroundings(
            axes=(names[0], names[1], names[2]),
            position=(at[0], at[1], at[2]),
            unit_mm=modal.unit_mm,
            tool_radius=radius_mm / (modal.unit_mm * factor),
            feed=channel.feeds.per_minute_mm / modal.unit_mm,
            trafo=state.spaces.active_kin is not None,
            absolute=modal.absolute,
            compensated=channel.compensation.choice.active,
            programs={
                f"hscs.{name}.prog": setting.program
                for name, setting in machine.hsc_settings.items()
            },
        )

    # checks

    def checked(self, cycle: Cycle, call: Call) -> tuple[Given, Surroundings]:
        """Parameters and surroundings of a call.

        Raises one CncError with all others in ``also``.
        """
        around = self.surroundings()
        given, problems = check(cycle, call.arguments or {}, around)
        if cycle.moves:
            problems += self._unfit(cycle.name, around)
        errors = [fail(p.code, p.text, self._offset(call, p)) for p in problems]
        if errors:
            first, *first.also = errors
            raise first
        if cycle.moves and SIMPLE["ROT_ACTIVE"](self._state):
            self._state.warn(
                ROTATION_ACTIVE,
                f"{cycle.name}: {ERRORS[ROTATION_ACTIVE]}",
                call.offset,
            )
        return given, around

    @staticmethod
    def _offset(call: Call, problem: Problem) -> int:
        return call.offsets.get(problem.number, call.offset)

    @staticmethod
    def _unfit(name: str, around: Surroundings) -> list[Problem]:
        problems = []
        if None in around.axes:
            problems.append(
                Problem(900016, f"{name} needs the three main axes")
            )
        if around.compensated:
            problems.append(
                Problem(
                    906003, f"{name}: {ERRORS[906003]}: deselect it with G40"
                )
            )
        return problems

    # execution

    def start(self, cycle: Cycle, call: Call) -> ProgramFile | None:
        """Check a call and begin it: outputs and files are written.

        Returns the program to execute, None if there is none.
        """
        given, around = self.checked(cycle, call)
        try:
            work = cycle.build(given, around)
        except CycleError as error:
            raise fail(
                error.code, f"{cycle.name}: {error.text}", call.offset
            ) from None
        for code, text in work.warnings:
            self._state.warn(code, f"{cycle.name}: {text}", call.offset)
        self._outputs_fit(work.outputs, call)
        for name, value in work.outputs.items():
            self._put_out(name.upper(), value)
        for name, text in work.files.items():
            self._state.port.write_file(name, text)
        return self.made(cycle.name, work.lines) if work.lines else None

    def start_pattern(
        self, call: Call, find: Callable[[], None]
    ) -> ProgramFile:
        """The program that executes a cycle at the places of a pattern.

        ``find`` fails if the cycle does not exist.
        """
        identity, state = call.pattern, self._state
        assert identity is not None
        errors: list[CncError] = []
        if call.retract is None:
            text = f"{ERRORS[pattern.NO_RETRACT]}: PATTERN_RETRACT is not given"
            errors.append(fail(pattern.NO_RETRACT, text, call.offset))
        places: list[At] = []

        def look_up() -> None:
            places.extend(state.patterns.places(identity, call.offset))

        for step in (look_up, find):
            try:
                step()
            except CncError as error:
                errors += [error, *error.also]
        around = self.surroundings()
        errors += [
            fail(p.code, p.text, call.offset)
            for p in self._unfit(WRAPPER, around)
        ]
        if errors:
            first, *first.also = errors
            raise first
        assert call.retract is not None
        inner = pattern.call_text(call.name, call.arguments or {}, call.local)
        if state.offsets.diameter:
            inner = f"G51\n{inner}\nG52"
        return self.made(
            WRAPPER, pattern.wrapper(places, call.retract, inner, around)
        )

    def made(self, name: str, lines: list[str]) -> ProgramFile:
        """A program without a file, beside the calling one.

        Its name says where it was called.
        """
        flow = self._state.flow
        busy = [level.file for level in flow.levels]
        line = self._lines.get(flow.file.number, self._state.place(0).line)
        where = (
            f", called in line {line}" if len(flow.files) < FILES_MAX else ""
        )
        for depth in range(len(busy) + 1):
            title = (
                f"<{name}.ecy{where}>"
                if not depth
                else f"<{name}.ecy{where}, {depth + 1}>"
            )
            file = flow.file_of(flow.file.path.parent / title)
            if file not in busy:
                break
        if self._state.offsets.diameter:
            lines = ["G52", *lines, "G51"]
        file.source = TextSource(file.path, "\n".join([*lines, "M17", ""]))
        file.blocks.clear()
        file.places.clear()
        self.owner[file.number] = self.owner.get(flow.file.number, flow.file)
        self._lines[file.number] = line
        return file

    def _outputs_fit(self, outputs: dict[str, float], call: Call) -> None:
        """Every declared variable can take its value: none is written if one cannot."""
        for name, value in outputs.items():
            variable = self._state.store.cycle.get(name.upper())
            if variable is not None:
                variable.type.convert(value, variable.name, call.offset)
                variable.place([], call.offset)

    def _put_out(self, name: str, value: float) -> None:
        """Write a V.CYC variable that the program has declared.

        A vector may be an array, or variables of the old names.
        """
        cycle = self._state.store.cycle
        variable = cycle.get(name)
        if variable is not None:
            _assign(variable, value)
        base, axis = name[:-1], "XYZ".find(name[-1])
        vector = cycle.get(base) if base in VECTOR_NAMES and axis >= 0 else None
        if vector is None:
            return
        if len(vector.values) > axis and vector.dimensions:
            vector.values[axis] = value
        elif variable is None:
            cycle.declare_beside(base, name, Variable(f"V.CYC.{name}", REAL64))
            self._put_out(name, value)


def _assign(variable: Variable, value: Value) -> None:
    variable.values[0] = variable.type.convert(value, variable.name, 0)
