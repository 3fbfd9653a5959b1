"""What the programs of a CNC process have said: warnings, errors, messages."""

from __future__ import annotations

from typing import Any

from ..config import CellConfig
from ..errors import CncError
from ..frontend.port import MESSAGES_KEPT, keep
from .preparation import Preparation
from .report import KEPT_TEXTS, log_warnings


class Said:
    """Of all programs that ran, in their order; the first texts are kept."""

    def __init__(self, cell: CellConfig) -> None:
        self._log_max = cell.channel.contour_lookahead_log_max
        self.warnings = list(cell.warnings())
        self.errors: list[CncError] = []
        self._messages: list[str] = []
        self._blocks = 0
        self._dialect: str | None = None

    def warn(self, text: str) -> None:
        """A warning of the run."""
        keep(self.warnings, text, KEPT_TEXTS)

    def message(self, text: str) -> None:
        """A message of a program, or an error of the PLC."""
        keep(self._messages, text, MESSAGES_KEPT)

    def collect(self, preparation: Preparation, state: Any) -> None:
        """Take over what a program has said, ahead of the next one or of the
        end; ``state``: the engine's.
        """
        self._blocks += preparation.blocks
        program = preparation.program
        warned = (
            [str(one) for one in program.reader.warnings] if program else []
        )
        for text in preparation.port.messages:
            if text not in warned:
                self.message(text)
        for text in warned:
            self.warn(text)
        self.warnings += log_warnings(state, self._log_max)
        if program:
            self._dialect = program.dialect
        error = preparation.error
        if error and error not in self.errors:
            self.errors += [error, *error.also]

    def as_json(self) -> dict[str, Any]:
        """Its part of the report."""
        first = self.errors[0] if self.errors else None
        return {
            "blocks": self._blocks,
            "messages": self._messages,
            "warnings": self.warnings,
            "errors": [error.as_json() for error in self.errors],
            "source": first.place.source if first else "",
            "dialect": self._dialect,
        }
