"""RTCP of the IsoNs dialect: G103, G104, G105 over the cell's kinematics."""

import numpy as np
import pytest

from cnc_core.blocks import ELEMENT, PIECE, POLYNOMIAL
from cnc_core.config import load_config
from cnc_core.errors import CncError
from cnc_core.frontend.port import OfflinePort
from cnc_core.program import Program
from support.isons_programs import run
from support.paths import FIVE_AXIS

CELL = FIVE_AXIS / "head_head.toml"


def test_the_tip_is_programmed(tmp_path):
    """G104 keeps the tip while rotary axes turn; G105 goes on with the axes;
    its length: G103 or tool.
    """
    cell = load_config(CELL)
    kinematics = cell.program_machine().kinematics[
        cell.program_machine().kin_id
    ]
    for head in ("G103 Z80\n", "T1\n"):
        path = tmp_path / "part.isons"
        path.write_text(
            head
            + "G0X10Y20Z200\nG104\n$A=$_Q2\nG1C30B20\nX50\nG105\n$B=$_Q2\nG1Z300\n"
        )
        program = Program(path, cell, "isons", OfflinePort(np.zeros(5)))
        rows = np.concatenate(
            [batch.rows.copy() for batch in program.batches()]
        )
        driven = rows[
            (rows["type"] <= POLYNOMIAL) & ((rows["flags"] & ELEMENT) == 0)
        ]
        pieces = driven[(driven["flags"] & PIECE) != 0]
        tips = kinematics.programmed(pieces["end"][:, :5], 80.0)
        assert tips[:, 1:3] == pytest.approx(
            np.array([[20.0, 120.0]] * len(tips)), abs=1e-3
        )
        assert tips[-1, 0] == pytest.approx(50, abs=1e-6)
        values = program.reader.store.scope.values
        assert values["A"] == pytest.approx(120)
        assert values["B"] == pytest.approx(pieces["end"][-1, 2])
        assert driven["end"][-1, :5] == pytest.approx(
            [*pieces["end"][-1, :2], 300, 30, 20]
        )


def test_without_kinematics(tmp_path):
    """G103 only passes values; G104 needs a table of the cell."""
    run(tmp_path, "G103 X1 Y2 W3\n")
    for code in (104, 105):
        with pytest.raises(CncError) as caught:
            run(tmp_path, f"G{code}\n")
        assert caught.value.code == 910106
