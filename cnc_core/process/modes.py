"""Operation modes and their states (hli_reference 5.4): what a mode command
means for programs.

The engine takes the command, stops and resumes the path alone; the rest is
carried out here.  Intermediate transitions are made by themselves: SELECTED to
ACTIVE is one command.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from hli import layout

from ..engine import Engine, ModeCommand
from ..errors import ERRORS, CncError

DESELECTED, SELECTED, READY = (
    layout.HLI_IMCM_PROCESS_DESELECTED,
    layout.HLI_IMCM_PROCESS_SELECTED,
    layout.HLI_IMCM_PROCESS_READY,
)
ACTIVE, HOLD, ERROR = (
    layout.HLI_IMCM_PROCESS_ACTIVE,
    layout.HLI_IMCM_PROCESS_HOLD,
    layout.HLI_IMCM_PROCESS_ERROR,
)
ABORTING, STOPPING, RESET = (
    layout.HLI_IMCM_PROCESS_ABORTING,
    layout.HLI_IMCM_PROCESS_STOPPING,
    layout.HLI_IMCM_PROCESS_RESETTING,
)
AUTOMATIC, MDI, MANUAL, REFERENCE = (
    layout.HLI_IMCM_AUTOMATIC_MODE,
    layout.HLI_IMCM_MDI_MODE,
    layout.HLI_IMCM_MANUAL_MODE,
    layout.HLI_IMCM_REFERENCE_MODE,
)
REFERENCE_PROGRAM = "rpf.nc"
REFUSED = 1
"""Class of an error record: a command that cannot be carried out."""


class Channel(Protocol):
    """What the modes move."""

    def start_program(self, path: Path) -> None: ...

    def abort_program(self) -> None: ...

    def hold_program(self) -> bool: ...

    def resume_program(self) -> None: ...

    def reset_channel(self) -> None: ...


class ModeControl:
    """Mode and state of one channel.

    ``folder``: where programs are looked for.  ``scratch``: file that MDI text
    is written to.  ``report`` gets errors.
    """

    def __init__(
        self,
        engine: Engine,
        channel: Channel,
        folder: Path,
        scratch: Path,
        state_after: int,
        report: Callable[[CncError], None],
    ) -> None:
        self._engine, self._channel, self._report = engine, channel, report
        self._folder, self._scratch, self._state_after = (
            folder,
            scratch,
            state_after,
        )
        self.mode, self.program = AUTOMATIC, None  # type: int, Path | None
        self._then: ModeCommand | None = None
        self.aborted = False
        self.running = (
            False  # a program is active, held, or on its way to its end
        )
        self._set(SELECTED)

    def select(self, program: Path) -> None:
        """The program of the command line stands ready."""
        self.program = program
        self._set(READY)

    def start(self) -> None:
        """Start what is selected."""
        assert self.program is not None
        self.aborted, self.running = False, True
        self._state = ACTIVE
        self._channel.start_program(self.program)

    def show(self) -> None:
        """Tell the PLC; a program that begins does so with its first data."""
        self._engine.set_mode(self.mode, self._state)

    def end_beside_dialog(self) -> bool:
        """Carry out a command that ends the program while it waits in a dialog;
        whether there was one.  Other commands wait for the answer.
        """
        command = self._engine.see_mode_command()
        if command is None or self._then is not None:
            return False
        stays = command.to_mode == self.mode and command.to_state == ACTIVE
        if stays or command.to_state == HOLD:
            return False
        self._engine.take_mode_command()
        self.handle(command)
        return True

    def handle(self, command: ModeCommand) -> None:
        """Carry out a command; what cannot be done is reported and changes nothing."""
        if not self.running:
            self._carry_out(command)
        elif self.aborted:  # by an order of the cell; commands of the PLC wait
            self._then = command
        elif command.to_state == HOLD:
            if not self._hold(command):
                self._refuse(command)
        elif command.to_mode == self.mode and command.to_state == ACTIVE:
            self._go_on(command)
        else:
            self._then = command
            self.abort()

    def _go_on(self, command: ModeCommand) -> None:
        """ACTIVE while a program runs: that one goes on, no other begins."""
        found = self._found_by(command)
        if self._names_another(command.parameter, found):
            self._refuse(
                command, f", with {command.parameter}: another one runs"
            )
            return
        if found != HOLD:
            self._engine.set_mode(self.mode, found)
        if found in (HOLD, STOPPING):
            self._channel.resume_program()

    def _found_by(self, command: ModeCommand) -> int:
        """State that a command has found, and that stays if it changes nothing.
        A program may have begun or ended since GEO took it.
        """
        runs = command.state in (ACTIVE, HOLD, STOPPING)
        return command.state if runs and self.running else self._state

    def _names_another(self, parameter: str, found: int) -> bool:
        """Whether a command names, or in MDI holds, a program that is not the
        one that runs.  A text is to be driven each time that it comes; that of
        a text in HOLD means that this one goes on.
        """
        if not parameter:
            return False
        if self.mode == MDI:
            runs = self._scratch.read_bytes().decode("latin-1")
            same = runs == parameter + "\n"
            return not same or found == ACTIVE
        try:
            file = self.find(parameter)
        except CncError:
            return True
        return self.program is None or file.resolve() != self.program.resolve()

    def _hold(self, command: ModeCommand) -> bool:
        return (
            command.to_mode == self.mode
            and self._found_by(command) == ACTIVE
            and self._channel.hold_program()
        )

    def held(self, stands: bool) -> None:
        """The channel has come to its pause, or goes on behind it."""
        self._set(HOLD if stands else ACTIVE)

    def abort(self) -> None:
        """Brake and end the program."""
        self.aborted = True
        self._set(ABORTING)
        self._channel.abort_program()

    def program_ended(self, error: CncError | None) -> None:
        """The program's end has been reached: on its own, by an error or by an
        abort.
        """
        self.running = False
        command, self._then = self._then, None
        again = command is not None and command.to_state == READY
        if self._state_after == SELECTED and not again:
            self.program = None
        self._state = (
            ERROR
            if error
            else self._state_after
            if self.program or self._state_after == SELECTED
            else SELECTED
        )
        if command is None:
            self.show()
        else:  # which shows its outcome alone
            self._carry_out(command)

    def _carry_out(self, command: ModeCommand) -> None:
        target = command.to_state
        if target == RESET:
            self._channel.reset_channel()
            self._change_mode(command.to_mode)
            self.program = None
            self._set(SELECTED)
        elif target == HOLD or self._state == ERROR:
            self._refuse(command)
        elif target in (DESELECTED, SELECTED):
            self._change_mode(command.to_mode)
            self.program = None
            self._set(target)
        else:
            self._prepare(command)

    def _prepare(self, command: ModeCommand) -> None:
        """To READY, and on to ACTIVE if that is asked for."""
        self._change_mode(command.to_mode)
        if self.mode not in (AUTOMATIC, MDI, REFERENCE):
            self._set(command.to_state)
            return
        try:
            self.program = self._program(command.parameter)
        except CncError as error:
            self.program = None
            self._report(error)
            self._set(SELECTED if self._state == READY else self._state)
            return
        if command.to_state == ACTIVE:
            self.start()
        else:
            self._set(READY)

    @property
    def free(self) -> bool:
        """A job may begin: nothing is executed, held or in error."""
        return (
            not self.running
            and self.mode == AUTOMATIC
            and self._state in (SELECTED, READY, DESELECTED)
        )

    def start_job(self, program: Path) -> None:
        """Start what a program of another channel has ordered."""
        self.select(program)
        self.start()

    def find(self, name: str) -> Path:
        """A program by its name; CncError: there is none."""
        for path in (self._folder / name, Path(name)):
            # False, where Path.is_file raises: a name too long for the file
            # system
            if os.path.isfile(path):
                return path
        raise CncError(901001, f"mode command: program {name} not found")

    def reset(self) -> None:
        """As the PLC's command; an executed program is aborted first."""
        self.handle(ModeCommand(0, 0, self.mode, RESET, "", self._state))

    def _program(self, parameter: str) -> Path:
        if self.mode == MDI and parameter:
            self._scratch.write_text(parameter + "\n", "latin-1")
            return self._scratch
        name = parameter or (
            REFERENCE_PROGRAM if self.mode == REFERENCE else ""
        )
        if not name:
            if self.program is None:
                raise CncError(905020)
            return self.program
        return self.find(name)

    def _change_mode(self, mode: int) -> None:
        if mode != self.mode:
            self.mode, self.program = mode, None
            self._state = SELECTED

    def _set(self, state: int) -> None:
        self._state = state
        self.show()

    def _refuse(self, command: ModeCommand, why: str = "") -> None:
        self._report(
            CncError(
                270061,
                f"{ERRORS[270061]}: {command.to_state} from {command.state}"
                f"{why}",
            )
        )
        self._engine.set_mode(self.mode, self._found_by(command))
