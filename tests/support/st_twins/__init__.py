"""The suite that every function block on the HLI runs with its twin in Structured Text."""

from __future__ import annotations

from .ahead import CASES as AHEAD
from .case import Case
from .commands import CASES as COMMANDS
from .distance import CASES as DISTANCE
from .levels import CASES as LEVELS
from .watchdog import CASES as WATCHDOG

CASES: dict[str, Case] = {
    **COMMANDS, **LEVELS, **WATCHDOG, **DISTANCE, **AHEAD,
}  # fmt: skip
