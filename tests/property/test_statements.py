"""Statements of IsoNs and of the 10-Series dialect, by section, against a value that does not
come from this code; the table of the page is made from the same file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cnc_core.blocks import NC_BLOCK
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.fuzz_seeds import setup_of
from support.isons_programs import AXES, CELL, Outcome, exact_cell, run
from support.osai_programs import (
    CELL_3,
    CELL_5,
    SETUP_3,
    Workshop,
    shop,
)
from support.statements import (
    Statement,
    given_fields,
    stands,
    statements,
    words,
)

__all__ = ["shop"]
NEAR = 5e-4
ISONS, OSAI = statements("isons"), statements("osai")


def found_pairs(outcome: Outcome, wanted: dict[str, float]) -> dict[str, float]:
    """Last positions of axes; an axis that did not move stands at 0."""
    ends = outcome.ends
    variables = outcome.reader.store.scope.values
    return {
        name: float(ends[-1][AXES.index(name)])
        if name in AXES and len(ends) and name not in variables
        else outcome.variable(name)
        if name in variables
        else 0.0
        for name in wanted
    }


def planned_time(folder: Path, text: str) -> float:
    (folder / "timed.isons").write_text(text + "\n")
    program = Program(folder / "timed.isons", exact_cell(CELL), "isons")
    return plan_program(program).motion_time_s


@pytest.mark.parametrize("case", ISONS, ids=[s.title for s in ISONS])
def test_a_statement(case: Statement, tmp_path: Path) -> None:
    """What the table says of it."""
    outcome = run(tmp_path, case.program + "\n", collect=True)
    codes = [error.code for error in outcome.errors]
    kind, *rest = case.expected.split()
    if kind == "error":
        assert codes
        assert not rest or codes[0] == int(rest[0])
        return
    assert codes == []
    if kind == "warning":
        warned = [warning.code for warning in outcome.reader.warnings]
        assert int(rest[0]) in warned
    elif kind == "length":
        length = float(outcome.moves["length"].sum())
        assert length == pytest.approx(float(rest[0]), abs=NEAR)
    elif kind == "time":
        time, least = planned_time(tmp_path, case.program), float(rest[0])
        assert least - NEAR <= time < 1.5 * least + 0.2
    elif case.pairs:
        assert found_pairs(outcome, case.pairs) == pytest.approx(
            case.pairs, abs=NEAR
        )


@pytest.mark.parametrize("case", OSAI, ids=[s.title for s in OSAI])
def test_a_statement_of_a_profile(case: Statement, shop: Workshop) -> None:
    """What the table says of it; the program stands behind (HSM,CONFIG1)."""
    none = case.setup == "NO"
    head = "" if none else "(HSM,CONFIG1)\n"
    setup = SETUP_3 if none else setup_of(case)
    rotary = setup.startswith("(MAC") or "(AXI,A,5" in setup
    cell = CELL_5 if rotary else CELL_3
    text = f"{head}{case.program}\n"
    program = shop.program(text, setup, cell, collect=True, programmed=False)
    batches = [batch.rows for batch in program.batches()]
    rows = np.concatenate([np.empty(0, NC_BLOCK), *batches])
    moves = rows[(rows["type"] <= 3) & (rows["flags"] & 256 == 0)]
    codes = [error.code for error in program.errors]
    kind, *rest = case.expected.split()
    if kind == "error":
        assert codes
        assert not rest or codes[0] == int(rest[0])
        return
    assert codes == []
    if kind == "warning":
        assert int(rest[0]) in [w.code for w in program.reader.warnings]
    elif kind == "length":
        assert moves["length"].sum() == pytest.approx(float(rest[0]), abs=NEAR)
    elif kind == "time":
        timed = shop.program(text, setup, cell, programmed=False)
        time, least = plan_program(timed).motion_time_s, float(rest[0])
        assert least - NEAR <= time < 1.5 * least + 0.2
    elif case.pairs:
        axes = list(cell.axes)
        found = {a: float(moves["end"][-1][axes.index(a)]) for a in case.pairs}
        assert found == pytest.approx(case.pairs, abs=NEAR)


def test_every_statement_of_the_guide_has_a_program() -> None:
    """IsoNs: functions, words, variables, instructions, forms, parameters."""
    text = "\n".join(case.program.upper() for case in ISONS)
    missing = [word for _, word in words("isons") if not stands(word, text)]
    assert missing == []


def test_every_statement_of_a_profile_has_a_program() -> None:
    """10-Series: functions, words, codes, values and fields of the setup."""
    text = "\n".join(f"{case.program}\n{case.setup}" for case in OSAI)
    given, place, last = given_fields(OSAI), 0, ""
    missing = []
    for kind, word in words("osai"):
        if kind != "fields":
            missing += [] if stands(word, text) else [word]
            continue
        code = word.partition(".")[0]
        place, last = (place + 1 if code == last else 1), code
        missing += [] if (code, place) in given else [word]
    assert missing == []
