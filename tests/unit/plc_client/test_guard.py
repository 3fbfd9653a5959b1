"""A call of a task that lasts is told, with the line it is at."""

from __future__ import annotations

import pytest

from plc_client import guard
from plc_client.guard import Guard
from plc_client.program import Program


class Busy:
    """Goes round until the guard has told of it so often."""

    def __init__(self, told: list[str], often: int) -> None:
        self.told, self.often = told, often

    def cyclic(self) -> None:
        while len(self.told) < self.often:
            pass


def test_a_call_that_lasts_is_told_with_its_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The user's innermost line, the method and its class; again behind a gap."""
    monkeypatch.setattr(guard, "TELL_S", 0.2)
    monkeypatch.setattr(guard, "GAP_S", 0.2)
    told: list[str] = []
    watched = Guard(tell=told.append)
    program = Program.of(Busy, told, 2)
    program.guard = watched
    program.call_cyclic()
    watched.close()
    for text in told[:2]:
        assert text.startswith("test_guard.py:")
        assert "cyclic() of Busy has not returned for" in text
        assert "a task must not wait; it is at: " in text
