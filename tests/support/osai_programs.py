"""Programs and setups of the 10-Series dialect for tests: the specification's
machines and examples, by line.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core.blocks import BlockBatch
from cnc_core.config import CellConfig, parse_config
from cnc_core.program import Program

SETUP_3 = """(PNT,AXI,AXI,QUI)
(VER,REL,PRG,PRG)
(JRK,ENA,,,400,150,200)
(THR,0.01,0.0001,0,0.001,0.05)
(TOL,,,0,-90,)
(TOD,0,0,1)
(CRV,1,6,G63)
(EDG,30,0,G66,1)
;
(AXI,X,1,ABS,LI1)
(AXP,X,0,,,)
(DIN,X,,,,,,)
;
(AXI,Y,2,ORD,LI2)
(AXP,Y,0,,,)
(DIN,Y,,,,,,)
;
(AXI,Z,3,VRT,LI3)
(AXP,Z,0,,,)
(DIN,Z,,,,,,)
"""
SETUP_5 = """(MAC,TOL,B12)
(PNT,CLP,CLP,QUI)
(VER,REL,PRG,PRG)
(THR,0.01,0.0001,0,0.001,0.05)
(JRK,ENA,,,400,150,200)
(TOL,,,0,-90,)
(CRV,1,6,G63)
(EDG,30,0,G66,1)
;
(AXI,X,1,ABS,LI2)
(AXP,X,0,,,)
(DIN,X,,,,,,)
(CIN,X,0,0,0,0,90,0)
;
(AXI,Y,2,ORD,LI1)
(AXP,Y,0,,,)
(DIN,Y,,,,,,)
(CIN,Y,0,0,0,90,0,180)
;
(AXI,Z,4,VRT,LI3)
(AXP,Z,0,,,)
(DIN,Z,,,,,,)
(CIN,Z,0,0,0,0,-90,0)
;
(AXI,A,5,OTH,WRK)
(AXP,A,0,,,)
(DIN,A,,,,,,)
(CIN,A,0,0,0,0,0,0)
;
(AXI,B,6,OTH,TOL)
(AXP,B,0,,,)
(DIN,B,,,,,,)
(CIN,B,0,0,0,-90,0,0)
;
(CIN,t,0,246.5,0,90,0,0)
(CIN,w,0,0,0,90,0,180)
"""
CELL_3 = CellConfig()
CELL_5_TEXT = """
[axes.X]
id = 1
[axes.Y]
id = 2
[axes.Z]
id = 4
[axes.A]
kind = "rotary"
id = 5
[axes.B]
kind = "rotary"
id = 6
"""
CELL_5 = parse_config(CELL_5_TEXT)


def changed(setup: str, **lines: str | None) -> str:
    """The setup with whole lines replaced: key ``PNT`` or ``AXI_X`` names the
    line, None takes it out.
    """
    out = setup.splitlines()
    for key, text in lines.items():
        head = "(" + key.replace("_", ",")
        at = next(
            (i for i, line in enumerate(out) if line.startswith(head + ",")),
            None,
        )
        if at is None:
            assert text is not None, key
            out.append(text)
        elif text is None:
            del out[at]
        else:
            out[at] = text
    return "\n".join(out) + "\n"


class Workshop:
    """Writes programs and setups into a folder and reads them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._made: list[Program] = []

    def program(
        self,
        text: str,
        setup: str = SETUP_3,
        cell: CellConfig = CELL_3,
        **options: Any,
    ) -> Program:
        """Rows as ``blocks`` shows them, unless ``programmed`` is False."""
        options.setdefault("programmed", True)
        (self.folder / "CONFIG1").write_text(setup)
        path = self.folder / "program.osai"
        path.write_text(text)
        self._made.append(Program(path, cell, "osai", **options))
        return self._made[-1]

    def close(self) -> None:
        for program in self._made:
            program.reader.close()  # type: ignore[attr-defined]

    def profile(
        self, body: str, setup: str = SETUP_3, head: str = "G61", **options: Any
    ) -> Program:
        """A program that is one profile."""
        return self.program(
            f"(HSM,CONFIG1)\n{head}\n{body}\nG60\n", setup, **options
        )


@pytest.fixture
def shop(tmp_path: Path) -> Iterator[Workshop]:
    """A workshop in the test's folder."""
    made = Workshop(tmp_path)
    yield made
    made.close()


def curves(
    program: Program, rows: int = 4096
) -> list[tuple[np.ndarray[Any, Any], float, Any]]:
    """(coefficients (axes, degree + 1), span, row) of every polynomial of a program."""
    axes, out = len(program.cell.axes), []
    while (batch := program.read(rows)) is not None:
        for row in batch.rows if isinstance(batch, BlockBatch) else ():
            assert isinstance(batch, BlockBatch)
            if row["type"] == 3 and not row["flags"] & 256:
                order = int(row["degree"]) + 1
                first = int(row["pool"])
                coef = batch.pool[first : first + axes * order].reshape(
                    axes, order
                )
                out.append((coef.copy(), float(row["angle"]), row.copy()))
    return out


def value(
    coef: np.ndarray[Any, Any], s: float, order: int = 0
) -> np.ndarray[Any, Any]:
    """A derivative of a polynomial at s."""
    for _ in range(order):
        coef = coef[:, 1:] * np.arange(1, coef.shape[1])
    return np.asarray(coef @ s ** np.arange(coef.shape[1]))
