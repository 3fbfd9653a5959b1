"""Running IsoNs programs in tests: a machine, program text to rows."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cnc_core.blocks import NC_BLOCK, POLYNOMIAL
from cnc_core.config import CellConfig, parse_config
from cnc_core.errors import CncError
from cnc_core.frontend.port import OfflinePort
from cnc_core.program import Program

AXES = "XYZA"
CELL = """
[axes.X]
[axes.Y]
[axes.Z]
[axes.A]
kind = "rotary"
"""


@dataclass
class Outcome:
    """What a program gave: final rows, all of them and motions alone, its reader, the port."""

    rows: Any
    reader: Any
    port: OfflinePort
    errors: list[CncError] = field(default_factory=list)

    @property
    def moves(self) -> Any:
        return self.rows[self.rows["type"] <= POLYNOMIAL]

    @property
    def ends(self) -> Any:
        """(n, 4) X Y Z A."""
        return self.moves["end"][:, : len(AXES)]

    @property
    def xy(self) -> Any:
        return self.ends[:, :2]

    def variable(self, name: str) -> float:
        return float(self.reader.store.scope.values[name.upper()])

    def array(self, name: str) -> list[float]:
        return list(self.reader.store.scope.arrays[name.upper()])


def exact_cell(text: str) -> CellConfig:
    """A cell whose G60 has no tolerance unless it says so: rows are the
    programmed motions."""
    cell: CellConfig = parse_config(text)
    cell.isons.parameters.setdefault("TOL_G60", 0.0)
    return cell


def run(
    folder: Path,
    text: str,
    config: str = "",
    files: dict[str, str] | None = None,
    **options: Any,
) -> Outcome:
    """Read a whole program; CncError if it is wrong (unless ``collect``)."""
    path = folder / "program.isons"
    path.write_text(text)
    for name, content in (files or {}).items():
        (folder / name).write_text(content)
    cell = exact_cell(CELL + config)
    port = OfflinePort(np.zeros(4))
    program = Program(path, cell, "isons", port, **options)
    batches = [batch.rows.copy() for batch in program.batches()]
    rows = np.concatenate(batches) if batches else np.empty(0, NC_BLOCK)
    return Outcome(rows, program.reader, port, program.errors)
