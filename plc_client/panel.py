"""The operator's panel in the PLC: what a person commands beside the program.

Levels (override, feed hold, single block) are forced, so they hold against the
program, ``hli-cosim force`` lists them, and ``release`` gives them back.
Commands (start, stop, reset ..) are function blocks that run behind the tasks
until they are done, as a program of the PLC would call them.
"""

from __future__ import annotations

import math
from typing import Any

from hli.symbol import SymbolError

from .blocks.base import ERROR_TEXTS
from .blocks.commands import ContinueMachining
from .blocks.mode import (
    ERROR_TRANSITION,
    AbortProgram,
    ResetChannel,
    ResumeProgram,
    RunMdi,
    SelectProgram,
    StartProgram,
    StopProgram,
)
from .online import Forces, SymbolTable

PERCENT_MAX = 200.0
CONTINUE_S = 5.0
MDI_CHARACTERS = 299
LEVELS: dict[str, tuple[str, ...]] = {
    "override": ("override", "override_valid"),
    "rapid_override": ("rapid_override", "rapid_override_valid"),
    "feedhold": ("feedhold",),
    "single_block": ("single_block",),
}
COMMANDS: dict[str, Any] = {
    "start": StartProgram,
    "stop": StopProgram,
    "resume": ResumeProgram,
    "abort": AbortProgram,
    "reset": ResetChannel,
    "select": SelectProgram,
    "mdi": RunMdi,
    "continue": lambda ch: ContinueMachining(ch, CONTINUE_S),
}
WITH_TEXT = ("start", "select", "mdi")
PROBLEMS = ERROR_TEXTS | {
    ERROR_TRANSITION: "what the channel does does not allow it",
    901001: "there is no such program",
    905020: "no program is selected",
}


class Panels:
    """A panel for each channel of a connection.

    ``any``: a command is under way, ``step`` has to be called in each scan.
    """

    def __init__(self, hli: Any, table: SymbolTable, forces: Forces) -> None:
        self._panels = [
            Panel(hli, table, forces, channel) for channel in range(hli.gNrCh)
        ]
        self.any = False

    def operate(
        self, what: str, value: Any = None, channel: Any = 0
    ) -> dict[str, Any]:
        """Set a level of a channel or begin a command there.  ValueError."""
        count = len(self._panels)
        if type(channel) is not int or not 0 <= channel < count:
            raise ValueError(
                f"channel {channel!r}: the cell has {count}, from 0"
            )
        answer = self._panels[channel].operate(what, value)
        self._look()
        return answer

    def states(self) -> list[dict[str, Any]]:
        """The state of each panel, in the order of the channels."""
        return [panel.state() for panel in self._panels]

    def step(self) -> None:
        """One scan of the commands that are under way."""
        for panel in self._panels:
            if panel.any:
                panel.step()
        self._look()

    def _look(self) -> None:
        self.any = any(panel.any for panel in self._panels)


class Panel:
    """The panel of one channel.

    ``any``: a command is under way, ``step`` has to be called in each scan.
    """

    def __init__(
        self, hli: Any, table: SymbolTable, forces: Forces, channel: int
    ) -> None:
        self._hli, self._table, self._forces = hli, table, forces
        self._channel = channel
        self._before: dict[str, Any] = {}
        self._block: Any = None
        self._inputs: tuple[Any, ...] = ()
        self.any = False
        self._shown: dict[str, Any] = {"command": None, "state": "idle"}

    # -- orders
    def operate(self, what: str, value: Any = None) -> dict[str, Any]:
        """Set a level or begin a command; None gives a level back.

        Raises ValueError: there is no such thing, the value does not fit, or a
        command is under way.
        """
        if what in LEVELS:
            self._level(what, value)
        elif what in COMMANDS:
            self._begin(what, value)
        else:
            known = ", ".join([*LEVELS, *COMMANDS])
            raise ValueError(f"{what!r} is not on the panel: {known}")
        return self.state()

    def state(self) -> dict[str, Any]:
        """The last command, and the levels that the panel holds."""
        forced = dict(self._forces.items())
        held = {
            level: forced[path]
            for level, (unit, *_) in LEVELS.items()
            if (path := self._symbol(unit, "command_w").path) in forced
        }
        for level in ("override", "rapid_override"):
            if level in held:
                held[level] /= 10.0
        return self._shown | {"held": held}

    def step(self) -> None:
        """One scan of the command that is under way."""
        block = self._block
        block(True, *self._inputs)
        if block.busy:
            return
        self._shown["state"] = "done" if block.done else "error"
        number = int(block.error_id)
        self._shown |= {"error_id": number, "error": PROBLEMS.get(number, "")}
        block(False, *self._inputs)
        self._block, self.any = None, False

    # -- levels
    def _symbol(self, unit: str, member: str) -> Any:
        control = f"gpCh[{self._channel}]^.bahn_mc_control"
        return self._table[f"{control}.{unit}.{member}"]

    def _level(self, what: str, value: Any) -> None:
        unit, *valid = LEVELS[what]
        if value is None:
            self._give_back(what)
            return
        commands = [(unit, _command_of(what, value))]
        commands += [(name, True) for name in valid]
        for name, command in commands:
            for member, wanted in (("command_w", command), ("enable_w", True)):
                self._hold(self._symbol(name, member), wanted)

    def _hold(self, symbol: Any, value: Any) -> None:
        if symbol.path not in dict(self._forces.items()):
            self._before[symbol.path] = symbol.value
        self._forces.force(symbol.path, symbol, value)

    def _give_back(self, what: str) -> None:
        """As it was before; what nobody remembers is not enabled any more."""
        forced = dict(self._forces.items())
        for name in LEVELS[what]:
            for member in ("enable_w", "command_w"):
                symbol = self._symbol(name, member)
                if symbol.path not in forced:
                    continue
                self._forces.let_go([(symbol.path, symbol.path)])
                default = False if member == "enable_w" else symbol.value
                symbol.value = self._before.pop(symbol.path, default)

    # -- commands
    def _begin(self, what: str, value: Any) -> None:
        if self._block is not None:
            busy = self._shown["command"]
            raise ValueError(f"{busy} is not done yet")
        self._inputs = (_text_of(what, value),) if what in WITH_TEXT else ()
        channel = self._hli.gpCh[self._channel]
        self._block, self.any = COMMANDS[what](channel), True
        self._shown = {"command": what, "state": "busy"}


def _command_of(what: str, value: Any) -> Any:
    """What ``command_w`` gets: per mille of a percentage, or a BOOL."""
    if what in ("feedhold", "single_block"):
        if not isinstance(value, bool):
            raise SymbolError(f"{what} {value!r}: true or false")
        return value
    number = not isinstance(value, bool) and isinstance(value, (int, float))
    if not number or not math.isfinite(value):
        raise SymbolError(f"{what} {value!r}: a number of percent is needed")
    if not 0.0 <= value <= PERCENT_MAX:
        raise SymbolError(f"{what} {value} %: 0..{PERCENT_MAX:g}")
    return round(value * 10.0)


def _text_of(what: str, value: Any) -> str:
    text = "" if value is None else value
    if not isinstance(text, str) or len(text.encode()) > MDI_CHARACTERS:
        raise SymbolError(
            f"{what}: a text of at most {MDI_CHARACTERS} bytes is needed"
        )
    if what == "mdi" and not text.strip():
        raise SymbolError("mdi: a block is needed")
    return text
