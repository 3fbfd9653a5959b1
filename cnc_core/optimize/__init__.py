"""``optimize``: the offline Path Optimizer (HSM specification 11).

Points go in, quintic polynomials come out.  The front end reads the program
with the given setup.  Polynomial profiles replace its profiles; everything
around them stays as it is written.  Beside the output stands its own setup
file, ``OUT`` with ``.setup`` behind.
"""

from __future__ import annotations

from pathlib import Path

from ..blocks.profile_columns import POINTS
from ..config import CellConfig
from .comparison import compare
from .optimizer import Optimizer
from .progress import Tick
from .result import OptimizeResult


def optimize(
    source: Path,
    setup: Path,
    out: Path,
    cell: CellConfig,
    tick: Tick = lambda _share, _n: None,
    *,
    compared: bool = False,
) -> OptimizeResult:
    """Smooth a program of points; ``compared``: plan it before and after.

    ``tick``: called with the share of the work that is done, and N.
    """
    result = Optimizer(source, setup, out, cell, tick).run()
    if compared:
        result.comparison = compare(source, out, setup, cell)
    return result


__all__ = ["POINTS", "OptimizeResult", "optimize"]
