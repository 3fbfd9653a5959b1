"""The operator of a running CNC in another process: dialogs, what is said, and
how far the program is prepared.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import asdict
from math import isfinite
from typing import Any

from hli.errors import HliError
from hli.orders import CNC, Order, OrdersAtOnce

from ..frontend.operator import Answer, Question

KEPT = 200  # texts
TEXT_MAX = 4000
ATTENDED_S = 3.0
"""Behind somebody's last look a dialog waits no more for him."""
CYCLES = 10_000
"""That a command of an operator may take until the CNC sees it."""


class OperatorDesk:
    """Answers ``look``, ``answer`` and ``cycles`` of other processes of this user.

    ``cycles``: somebody has given the PLC a command, which needs cycles to reach
    the CNC, also while a dialog is open.

    ``attended``: somebody is awaited from the start on.  ``facts``: how far the
    program is; it may fail while a program begins.
    """

    def __init__(
        self, facts: Callable[[], dict[str, Any]], *, attended: bool = False
    ) -> None:
        self._facts, self._awaited = facts, attended
        self._orders = OrdersAtOnce(CNC, self._obey)
        self._changed = threading.Condition()
        self._open = True
        self._looked = -ATTENDED_S
        self._said: deque[tuple[int, float, str, str]] = deque(maxlen=KEPT)
        self._number = self._asked = 0
        self._shown: tuple[int, Question] | None = None  # with its number
        self._answer: Answer | None = None
        self._cycles = 0  # that may run beside the dialog

    def open(self, name: str) -> None:
        """Listen; a CNC that cannot still does its work."""
        with contextlib.suppress(HliError, OSError):
            self._orders.open(name)

    def close(self) -> None:
        """Listen no more; ``facts`` is not called from here on."""
        with self._changed:
            self._open = False
        self._orders.close()

    # -- the CNC's side
    @property
    def attended(self) -> bool:
        """Whether somebody looks who can answer a dialog."""
        return self._awaited or time.monotonic() - self._looked < ATTENDED_S

    def say(self, kind: str, text: str) -> None:
        """A message, an error: shown to whoever looks."""
        with self._changed:
            self._number += 1
            row = self._number, time.time(), kind, text[:TEXT_MAX]
            self._said.append(row)

    @contextlib.contextmanager
    def shown(self, question: Question) -> Iterator[None]:
        """A dialog is open; one of another channel may be open below it."""
        with self._changed:
            below = self._shown
            self._asked += 1
            self._shown = self._asked, question
            self._answer, self._cycles = None, 0
        try:
            yield
        finally:
            with self._changed:
                self._shown, self._answer = below, None

    def takes_cycle(self) -> bool:
        """Whether one more cycle may run beside the dialog."""
        with self._changed:
            takes = self._cycles > 0
            self._cycles -= takes
            return takes

    def no_more_cycles(self) -> None:
        """The command is there."""
        with self._changed:
            self._cycles = 0

    def answered(self, wait_s: float) -> Answer | None:
        """The answer to the open dialog; None: none came within this time."""
        with self._changed:
            self._changed.wait_for(lambda: self._answer is not None, wait_s)
            return self._answer

    # -- the other processes' side
    def _obey(self, order: Order) -> Order:
        what = order.get("do")
        if what == "look":
            return self._look(order)
        if what == "answer":
            return self._take(order)
        if what == "cycles":
            return self._grant()
        raise ValueError(f"{what!r}: the CNC takes look, answer and cycles")

    def _grant(self) -> Order:
        with self._changed:
            self._cycles = CYCLES if self._shown else 0
            return {"cycles": self._cycles}

    def _look(self, order: Order) -> Order:
        since = order.get("since", 0)
        with self._changed:
            if order.get("attended"):
                self._looked = time.monotonic()
            said = [list(row) for row in self._said if row[0] > since]
            return {
                "said": said,
                "dialog": self._dialog(),
                "prepared": self._prepared(),
            }

    def _prepared(self) -> dict[str, Any]:
        """The facts; empty while there are none."""
        try:
            return self._facts() if self._open else {}
        except (AttributeError, TypeError, ValueError, LookupError):
            return {}  # a program is just being changed

    def _dialog(self) -> dict[str, Any] | None:
        if self._shown is None or self._answer is not None:
            return None
        number, question = self._shown
        return {"number": number} | asdict(question)

    def _take(self, order: Order) -> Order:
        """An answer to the dialog that is open, and to no other."""
        with self._changed:
            if self._shown is None or self._answer is not None:
                raise ValueError("no dialog is open")
            number, question = self._shown
            if order.get("number") != number:
                raise ValueError("this dialog is closed; another one is open")
            self._answer = answer_to(question, order)
            self._changed.notify_all()
        return {"answered": number}


def answer_to(question: Question, order: Order) -> Answer:
    """What somebody has entered and pressed.  ValueError: it does not fit."""
    values, press = order.get("set") or {}, order.get("press") or ""
    if not isinstance(values, dict) or not isinstance(press, str):
        raise ValueError("an answer has set (numbers by name) and press")
    found: dict[str, float] = {}
    for name, value in values.items():
        if name not in question.inputs:
            raise ValueError(f"the dialog has no input {name!r}")
        number = isinstance(value, (int, float)) and isfinite(value)
        if not number or isinstance(value, bool):
            raise ValueError(f"input {name}: a finite number is expected")
        found[name] = float(value)
    if press not in (question.buttons or ("",)):
        known = ", ".join(question.buttons) or "none"
        raise ValueError(f"the dialog has no button {press!r}; it has: {known}")
    return Answer(found, press)
