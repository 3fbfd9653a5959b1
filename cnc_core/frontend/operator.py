"""Who answers the dialogs of a program: a script of answers, or an operator at
the terminal or at the monitor's page.

A script is a JSON list, one entry a dialog in the order in which they come: the
name of a button (``"YES"``), or ``{"set": {"INPUT": 5.0}, "press": "BUTTON"}``.
"""

from __future__ import annotations

import json
import select
import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any, Protocol

from ..errors import CncError, Place
from ..files import read_text

LOOK_S = 0.2  # between two looks whether the run is to end


@dataclass(frozen=True)
class Question:
    """A dialog: its text, its buttons, and the values of its inputs by name.

    ``channel``: name of the channel that asks, if there are several.
    """

    title: str
    text: str
    buttons: tuple[str, ...] = ()
    inputs: dict[str, float] = field(default_factory=dict)
    channel: str = ""


@dataclass(frozen=True)
class Answer:
    """Inputs that the operator has set, then the button pressed.

    ``given``: the operator has answered.
    """

    values: dict[str, float] = field(default_factory=dict)
    press: str = ""
    given: bool = True


class Desk(Protocol):
    """A place beside the terminal where somebody may answer."""

    @property
    def attended(self) -> bool:
        """Whether somebody sits there."""
        ...

    def shown(self, question: Question) -> AbstractContextManager[None]:
        """A dialog is open."""
        ...

    def answered(self, wait_s: float) -> Answer | None:
        """The answer to the open dialog, if it comes within this time."""
        ...


class Operator:
    """Answers from ``script``, behind it from the terminal if ``terminal``, or
    from the ``desk``.

    ``interrupted``: the run is to end.  ``ended``: the program that asks has been
    ended meanwhile; called between two looks for an answer.
    """

    def __init__(
        self,
        script: Sequence[Answer] = (),
        terminal: bool = False,
        interrupted: Callable[[], bool] = lambda: False,
        desk: Desk | None = None,
    ) -> None:
        self._script, self._terminal = list(script), terminal
        self.interrupted = interrupted
        self.ended: Callable[[], bool] = lambda: False
        self._desk = desk

    @property
    def waiting(self) -> bool:
        """The script holds another answer."""
        return bool(self._script)

    def ask(self, question: Question) -> Answer | None:
        if self._script:
            return self._script.pop(0)
        desk = self._desk
        if desk is None:
            return self._at_terminal(question) if self._terminal else None
        if not (self._terminal or desk.attended):
            return None
        with desk.shown(question):
            if self._terminal:
                return self._at_terminal(question)
            return self._at_desk(desk)

    def _over(self) -> bool:
        """Whether an answer is of no use any more."""
        return self.interrupted() or self.ended()

    def _at_desk(self, desk: Desk) -> Answer | None:
        while not self._over():
            answer = desk.answered(LOOK_S)
            if answer is not None:
                return answer
        return None

    def _at_terminal(self, question: Question) -> Answer | None:
        """One line a time: ``NAME=VALUE`` fills an input, a button's name
        presses it.
        """
        values: dict[str, float] = {}
        sys.stdout.write(f"\n{question.title}\n{question.text}\n")
        while True:
            sys.stdout.write(_prompt(question))
            sys.stdout.flush()
            line = self._line()
            if line is None:  # the end of the input, or an answer at the desk
                return self._desk.answered(0.0) if self._desk else None
            name, equals, value = (part.strip() for part in line.partition("="))
            if equals and name.upper() in question.inputs:
                number = _number(value)
                if number is not None:
                    values[name.upper()] = number
                    continue
            elif name.upper() in question.buttons or (
                not name and not question.buttons
            ):
                return Answer(values, name.upper())
            sys.stdout.write("not understood\n")

    def _line(self) -> str | None:
        while not self._over():
            if select.select([sys.stdin], [], [], LOOK_S)[0]:
                return sys.stdin.readline() or None
            if self._desk is not None and self._desk.answered(0.0):
                return None
        return None


def _number(text: str) -> float | None:
    """A finite number, None if the text is none."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if isfinite(value) else None


def _prompt(question: Question) -> str:
    inputs = "".join(
        f"{name}=.. (now {value:g})  "
        for name, value in question.inputs.items()
    )
    return f"{inputs}{' | '.join(question.buttons) or 'Enter'}? "


def read_answers(path: Path) -> list[Answer]:
    """The script of a file; CncError if it is none."""
    try:
        entries = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise CncError(
            902001, f"answers: not JSON: {error}", Place(str(path))
        ) from None
    if not isinstance(entries, list):
        raise CncError(902001, "answers: a list is expected", Place(str(path)))
    return [_answer(entry, path) for entry in entries]


def _is_number(value: Any) -> bool:
    """Finite, and an integer that a float holds."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and abs(value) <= sys.float_info.max


def _answer(entry: Any, path: Path) -> Answer:
    if isinstance(entry, str):
        return Answer(press=entry)
    if isinstance(entry, dict) and set(entry) <= {"set", "press"}:
        values, press = entry.get("set", {}), entry.get("press", "")
        numbers = isinstance(values, dict) and all(
            map(_is_number, values.values())
        )
        if numbers and isinstance(press, str):
            return Answer(
                {name.upper(): float(v) for name, v in values.items()}, press
            )
    form = '{"set": {"NAME": 1.0}, "press": "BUTTON"}'
    text = f"answers: {entry!r} is neither a button nor {form}"
    raise CncError(902001, text, Place(str(path)))
