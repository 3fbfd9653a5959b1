"""Structured Text on the HLI: files to units to trees to C, loaded into the PLC process."""

from __future__ import annotations

from .build import Checked, build, check, sources_of
from .errors import Problem, StError
from .options import Built, Options
from .source.files import is_st

__all__ = [
    "Built",
    "Checked",
    "Options",
    "Problem",
    "StError",
    "build",
    "check",
    "is_st",
    "sources_of",
]
