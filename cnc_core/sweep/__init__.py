"""Sweeps: one study, many runs, one table.

``study.py`` reads study.toml, ``points.py`` lays out its runs, ``one.py`` makes
one of them, ``worker.py`` is a process that makes one after the other.
``ledger.py`` keeps what is complete, ``sweeping.py`` hands the rest out,
``table.py`` writes the table and reads it again.
"""

from __future__ import annotations

from .study import Study
from .sweeping import sweep
from .table import Results

__all__ = ["Results", "Study", "sweep"]
