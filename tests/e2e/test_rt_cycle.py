"""Real-time cycles: ``#RT CYCLE`` sets the condition of a real-time loop, reads
axes and external variables in every cycle (public pages "Realtime cycles").
"""

from __future__ import annotations

import random
import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from cnc_core.config import parse_config
from cnc_core.errors import CncError
from cnc_core.frontend.base.expression import FUNCTIONS
from cnc_core.frontend.base.formula import FormulaParser
from cnc_core.frontend.base.lexer import TokenStream
from cnc_core.frontend.isg.language.text import PATTERN
from support.command_line import Outcome
from support.inside import Inside
from support.seeds import few

Cli = Callable[..., Outcome]
Write = Callable[..., Path]
CELL = """
[axes.X]
[axes.Y]
[axes.Z]
[tools.1]
radius_mm = 1.0
[external.GO]
type = "UNS08"
scope = "global"
[external.OUT]
type = "REAL64"
scope = "global"
[external.LIMITED]
type = "SGN08"
scope = "global"
[external.LATE]
type = "REAL64"
scope = "global"
synchronised = false
[external.TEXT]
type = "STRING"
scope = "global"
"""
LOOP = "#RT WHILE\nX20\nY10\nX10\nY0\n#RT ENDWHILE\nN90 X0\n"
MANUAL = """%RtLoop
; RT WHILE condition
N0010 #RT CYCLE DELETE [ID = 4711 ]
N0020 #RT CYCLE [ID=4711 SCOPE = GLOBAL]
N0030   $IF V.E.GO != 0
N0040     V.RTG.LOOP.ENABLED = TRUE
N0050   $ELSE
N0060     V.RTG.LOOP.ENABLED = FALSE
N0070   $ENDIF
N0080 #RT CYCLE END
G1 X10 F6000
"""


def external(cnc: Inside, number: int) -> bytearray:
    """The block of a global external variable, from 1, as the PLC sees it."""
    area = memoryview(cnc.segment.root.ext_var_global).cast("B")
    return area[24 * (number - 1) : 24 * number]


def real(cnc: Inside, number: int) -> float:
    """A REAL64 of the PLC's side."""
    return float(struct.unpack("<d", external(cnc, number)[:8])[0])


def cycle(body: str, keys: str = "SCOPE = PROG") -> str:
    """A real-time cycle around the lines."""
    return f"#RT CYCLE [{keys}]\n{body}\n#RT CYCLE END\n"


def test_the_manuals_example(tmp_path: Path) -> None:
    """The vendor's program: an external variable of the PLC is the condition,
    taken in the cycle, without a stop; FALSE leaves the loop out.
    """
    with Inside(tmp_path, MANUAL + LOOP, CELL) as cnc:
        cnc.end()
        assert cnc.state.rt_loop_count_r == 0
    with Inside(tmp_path, MANUAL + LOOP, CELL) as cnc:
        external(cnc, 1)[0] = 1
        cnc.until(lambda: cnc.state.rt_loop_count_r >= 2)
        assert cnc.state.inside_rt_loop_r
        external(cnc, 1)[0] = 0
        cnc.end()
        assert cnc.pos[-1] == pytest.approx([0, 0, 0])


def test_a_number_of_passes(tmp_path: Path) -> None:
    """V.RTG.LOOP.COUNT ends the loop by itself; the decision is made while the
    path can still stop ahead of the loop's end, so the pass that is driven then
    counts no more.
    """
    body = "$IF V.RTG.LOOP.COUNT < 2\nV.RTG.LOOP.ENABLED = TRUE\n$ELSE\n"
    body += "V.RTG.LOOP.ENABLED = FALSE\n$ENDIF"
    text = cycle(body) + "G1 X10 F6000\n" + LOOP + "P1 = V.RTG.LOOP.COUNT\n"
    with Inside(tmp_path, text + "G1 X[P1]\n", CELL) as cnc:
        cnc.end()
        assert cnc.state.rt_loop_count_r == 3
        assert cnc.pos[-1] == pytest.approx([3, 0, 0])


def test_the_plc_stands_above_the_cycle(tmp_path: Path) -> None:
    """A level unit that the PLC enables is the condition."""
    levels = {"rt_loop_enable": False}
    text = cycle("V.RTG.LOOP.ENABLED = TRUE") + "G1 X10 F6000\n" + LOOP
    with Inside(tmp_path, text, CELL, levels=levels) as cnc:
        cnc.end()
        assert cnc.state.rt_loop_count_r == 0


@pytest.mark.parametrize(
    ("word", "passes", "expected"),
    [("", 5, None), ("ONCE ", 1, 1), ("EDGE ", 1, 3), ("ALWAYS ", 5, None)],
)
def test_frequencies(
    word: str, passes: int, expected: int | None, tmp_path: Path
) -> None:
    """$IF counts cycles; ONCE is true once, EDGE at every rising edge (three
    times on a path that comes by three times), ALWAYS from then on.
    """
    body = f"$IF {word}V.RTA.ACS.ACT_POS.X > 5\nV.E.OUT = V.E.OUT + 1\n$ENDIF"
    text = cycle(body) + "G1 F6000\n" + "X10\nX0\n" * 3
    with Inside(tmp_path, text, CELL) as cnc:
        cnc.end()
        count = real(cnc, 2)
        behind = int((cnc.pos[:, 0] > 5).sum())
        first = int((cnc.pos[:, 0] > 5).argmax())
        if expected is not None:
            assert count == expected
        elif word:
            assert count == pytest.approx(len(cnc.pos) - first, abs=60)
        else:
            assert count == pytest.approx(behind, abs=2)


def test_nested_branches(tmp_path: Path) -> None:
    """$ELSEIF and $IF inside each other; what is not synchronised, P
    parameters and V.P have the value of the place of the definition.
    """
    body = (
        "$IF V.E.GO == 1\nV.E.OUT = 10\n$ELSEIF V.E.GO == 2\n"
        "$IF P1 > 3\nV.E.OUT = P1 * 2 + V.E.LATE\n$ELSE\nV.E.OUT = 99\n$ENDIF\n"
        "$ELSEIF V.E.GO == 3\nV.E.LIMITED = 1000\n$ELSE\nV.E.OUT = -[7]\n$ENDIF"
    )
    text = "P1 = 4\nV.E.LATE = 11\n" + cycle(body) + "P1 = 0\nV.E.LATE = 5\n"
    with Inside(tmp_path, text + "G1 X100 F600\n", CELL) as cnc:
        cnc.run(20)
        assert real(cnc, 2) == -7
        for go, due in ((1, 10.0), (2, 19.0)):
            external(cnc, 1)[0] = go
            cnc.run(2)
            assert real(cnc, 2) == due
        external(cnc, 1)[0] = 3
        cnc.run(2)
        assert external(cnc, 3)[0] == 127


def test_defined_held_deleted(tmp_path: Path) -> None:
    """DEF only defines; START, HOLD, CONTINUE and DELETE act ahead of the next
    block; START makes ONCE look again. A cycle of the program ends with it.
    """
    body = "$IF ONCE TRUE\nV.E.GO = V.E.GO + 1\n$ENDIF\nV.E.OUT = V.E.OUT + 1"
    text = (
        f"#RT CYCLE DEF [ID = 17 SCOPE = PROG]\n{body}\n#RT CYCLE END\n"
        "G1 X1 F6000\nM00\n#RT CYCLE START [ID = 17]\nM00\n"
        "#RT CYCLE HOLD [ID = 17]\nM00\n#RT CYCLE CONTINUE [ID = 17]\nM00\n"
        "#RT CYCLE START [ID=17]\nM00\n#RT CYCLE DELETE [ID = 17]\nM00\n"
    )
    seen = []
    with Inside(tmp_path, text, CELL) as cnc:
        for _ in range(6):
            cnc.run(200)
            before = real(cnc, 2)
            cnc.run(10)
            seen.append((external(cnc, 1)[0], real(cnc, 2) - before))
            cnc.level(cnc.bahn.continue_machining, True)
            cnc.run(2)
            cnc.level(cnc.bahn.continue_machining, False)
    assert seen == [(0, 0), (1, 10), (1, 0), (1, 10), (2, 10), (2, 0)]


def test_a_cycle_of_the_program_ends_with_it(tmp_path: Path) -> None:
    """SCOPE PROG is over at the end, SCOPE GLOBAL is not."""
    text = cycle("V.E.OUT = V.E.OUT + 1")
    text += cycle("V.E.GO = 1 - V.E.GO", "ID = 3 SCOPE = GLOBAL")
    with Inside(tmp_path, text + "G1 X1 F6000\n", CELL) as cnc:
        cnc.end()
        before, flips = real(cnc, 2), []
        for _ in range(4):
            cnc.engine.run(1)
            flips.append(external(cnc, 1)[0])
        assert real(cnc, 2) == before
        assert flips in ([0, 1, 0, 1], [1, 0, 1, 0])


def test_the_program_reads_axes_and_the_condition(tmp_path: Path) -> None:
    """V.RTA and V.RTG wait for the blocks before them."""
    text = (
        "G1 X7 F6000\nP1 = V.RTA.ACS.ACT_POS.X\nV.RTG.LOOP.ENABLED = TRUE\n"
        "P2 = V.RTG.LOOP.ENABLED\nV.RTG.LOOP.ENABLED = FALSE\n"
        "P3 = V.RTG.LOOP.ENABLED\nG1 X[P1 * 2] Y[P2] Z[P3]\n"
    )
    with Inside(tmp_path, text, CELL) as cnc:
        cnc.end()
        assert cnc.pos[-1] == pytest.approx([14, 1, 0])


def _expression(rng: random.Random, depth: int, live: str) -> str:
    """A random expression over ``live``, a value that is 0.75."""
    if depth == 0 or rng.random() < 0.2:
        return rng.choice([live, live, f"{rng.uniform(0.1, 3.0):.3f}", "PI"])
    if rng.random() < 0.3:
        name = rng.choice(sorted(set(FUNCTIONS) - {"EXP", "DEXP"}))
        return f"{name}[{_expression(rng, depth - 1, live)}]"
    if rng.random() < 0.1:
        return f"-[{_expression(rng, depth - 1, live)}]"
    operator = rng.choice(
        [
            "||",
            "XOR",
            "&&",
            "|",
            "^",
            "&",
            "==",
            "!=",
            ">=",
            "<=",
            "<",
            ">",
            "+",
            "+",
            "-",
            "-",
            "*",
            "*",
            "/",
            "MOD",
        ]
    )
    left, right = (_expression(rng, depth - 1, live) for _ in range(2))
    return f"[{left} {operator} {right}]"


def _value(text: str) -> float | None:
    """What a block of the program makes of it, None: no finite number."""
    stream = TokenStream(text.replace("V.E.OUT", "0.75"), PATTERN)
    try:
        found = FormulaParser(stream).expression()()
    except CncError:
        return None
    return found if isinstance(found, float) else None


@pytest.mark.parametrize("seed", few(range(40), 1))
def test_expressions_are_those_of_the_program(
    seed: int, tmp_path: Path
) -> None:
    """Random expressions give in a real-time cycle what they give in a block;
    what has no finite result changes nothing.
    """
    rng = random.Random(seed)
    texts = [_expression(rng, 4, "V.E.OUT") for _ in range(60)]
    config = (
        CELL + '[external.R]\ntype = "REAL64"\nsize = 60\nscope = "global"\n'
    )
    first = parse_config(config).externals["R"].number
    due = [_value(text) for text in texts]
    lines = ["V.E.OUT = 0.75\n"]
    for i, text in enumerate(texts):
        if due[i] is not None:
            body = f"V.E.R[{i}] = {text}"
            lines.append(cycle(body, "ID=1 SCOPE=GLOBAL"))
    assert len(lines) > 20
    with Inside(tmp_path, "".join(lines), config) as cnc:
        cnc.end()
        got = [real(cnc, first + i) for i in range(60)]
    for i, text in enumerate(texts):
        assert got[i] == pytest.approx(due[i] or 0.0, rel=1e-12, abs=1e-12), (
            text
        )


@pytest.mark.sanitize("engine")
@pytest.mark.parametrize("function", ["SIN", "COS", "TAN", "COT"])
def test_an_angle_that_is_no_number_changes_nothing(
    function: str, tmp_path: Path
) -> None:
    """As any other value that is not finite; nothing becomes an integer of it."""
    body = f"V.E.OUT = {function}[10 ** 200 * 10 ** 200]"
    program = "V.E.OUT = 0.75\n" + cycle(body, "ID=1 SCOPE=GLOBAL")
    with Inside(tmp_path, program, CELL) as cnc:
        cnc.end()
        assert real(cnc, 2) == 0.75


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        ("#RT CYCLE DEF [SCOPE = PROG]\n#RT CYCLE END\n", 22003, 1),
        ("#RT CYCLE [SCOPE = GLOBAL]\n#RT CYCLE END\n", 22003, 1),
        ("#RT CYCLE START [SCOPE = PROG]\n", 22003, 1),
        ("#RT CYCLE START [ID = 5]\n", 907010, 1),
        ("#RT CYCLE\nG1 X1\n#RT CYCLE END\n", 900003, 2),
        ("#RT CYCLE\n#FLUSH\n#RT CYCLE END\n", 22004, 2),
        ("#RT CYCLE\nV.E.LATE = 1\n#RT CYCLE END\n", 22009, 2),
        ("#RT CYCLE\nV.P.A = 1\n#RT CYCLE END\n", 22009, 2),
        ("#RT CYCLE\nV.RTG.LOOP.OTHER = 0\n#RT CYCLE END\n", 900003, 2),
        ("#RT CYCLE\nV.RTG.OVERRIDE.VEL.CYCLE = 1\n#RT CYCLE END\n", 900003, 2),
        ("#RT CYCLE\nV.E.TEXT = 1\n#RT CYCLE END\n", 907011, 2),
        ("#RT CYCLE\n$IF ONCE 1\n$ELSE\n$ENDIF\n#RT CYCLE END\n", 900010, 3),
        ("#RT CYCLE\n$ENDIF\n#RT CYCLE END\n", 907020, 2),
        ("#RT CYCLE\n$IF 1\n#RT CYCLE END\n", 907021, 2),
        ("#RT CYCLE\n$WHILE 1\n#RT CYCLE END\n", 900003, 2),
        ("#RT CYCLE\n#RT CYCLE\n#RT CYCLE END\n", 22004, 2),
        ("#RT CYCLE\nV.E.OUT = 1\n", 907021, 1),
        ("#RT CYCLE END\n", 907020, 1),
        ("#RT CYCLE [SCOPE = LINE]\n#RT CYCLE END\n", 900010, 1),
        ("#RT CYCLE [ID]\n#RT CYCLE END\n", 900010, 1),
        (
            "#RT CYCLE\nV.E.OUT = V.RTA.ACS.ACT_POS.Q\n#RT CYCLE END\n",
            900016,
            2,
        ),
        ("#RT CYCLE\nV.E.OUT = V.RTG.TIMER[1]\n#RT CYCLE END\n", 900003, 2),
        ("$IF 0\n#RT CYCLE\n#FLUSH\n#RT CYCLE END\n$ENDIF\n", 22004, 3),
        (
            "G1 F100 X1\n#RT WHILE\nX2\n#RT CYCLE END\nX1\n#RT ENDWHILE\n",
            22073,
            4,
        ),
        ("G41 D1 G1 X1 F100\n#RT CYCLE\n#RT CYCLE END\n", 20651, 2),
        (
            "#RT CYCLE\n" + "V.E.OUT = 1\n" * 257 + "#RT CYCLE END\n",
            904010,
            259,
        ),
        ("#RT CYCLE\nV.E.OUT = 1\n#RT CYCLE END\n" * 17, 904010, 51),
    ],
)
def test_refused(
    text: str, code: int, line: int, cli: Cli, program: Write
) -> None:
    """Wrong cycles are refused at their place before anything runs."""
    cell = program(CELL, "cell.toml")
    outcome = cli("check", program(text), "--config", cell, "--json")
    assert [(e["code"], e["line"]) for e in outcome.json["errors"]][:1] == [
        (code, line)
    ]


def test_a_value_without_a_finite_result_is_left_out(tmp_path: Path) -> None:
    """It changes nothing, a condition of it is not true, and it is counted."""
    body = (
        "V.E.OUT = 1 / V.RTA.ACS.ACT_POS.Y\n$IF [V.RTA.ACS.ACT_POS.Y + 1] / 0\n"
    )
    text = cycle(body + "V.RTG.LOOP.ENABLED = TRUE\n$ENDIF")
    with Inside(
        tmp_path, "V.E.OUT = 5\n" + text + "G1 X1 F6000\n", CELL
    ) as cnc:
        cnc.end()
        assert real(cnc, 2) == 5.0
        assert cnc.engine.state.bad_commands > 0
        assert cnc.state.rt_loop_count_r == 0


def test_the_count_is_written_by_the_cycle_and_by_the_program(
    tmp_path: Path,
) -> None:
    """V.RTG.LOOP.COUNT is R/W (public page "Channel-specific realtime
    variables"): it counts on from what is written.  Mode 2 goes by the passes
    that were driven.
    """
    cycle = "$IF EDGE V.RTG.LOOP.COUNT == 2\nV.RTG.LOOP.COUNT = 10\n$ENDIF\n"
    cycle += "V.RTG.LOOP.ENABLED = V.RTG.LOOP.COUNT < 12\n"
    text = (
        f"G1 X10 F6000\n#RT CYCLE [SCOPE=PROG]\n{cycle}#RT CYCLE END\n{LOOP}"
        "V.E.OUT = V.RTG.LOOP.COUNT\nV.RTG.LOOP.COUNT = 41\n"
        "V.E.LIMITED = V.RTG.LOOP.COUNT\nX1\nM30\n"
    )
    with Inside(tmp_path, text, CELL) as cnc:
        seen = set()
        for _ in range(20_000):
            if cnc.state.program_end_r:
                break
            cnc.run(1)
            seen.add(int(cnc.state.rt_loop_count_r))
        # the pass that begins at 12 is the last one
        assert seen - {2} == {0, 1, 10, 11, 12, 13, 41}
        assert real(cnc, 2) == 13.0
        assert external(cnc, 3)[0] == 41


@pytest.mark.parametrize("keys", ["[SCOPE=LINE]", "[SCOPE=GLOBAL]", "[WHAT=1]"])
def test_a_refused_cycle_is_one_error(
    keys: str, cli: Cli, program: Write
) -> None:
    """Its end is no error of its own."""
    text = f"#RT CYCLE {keys}\nV.RTG.LOOP.ENABLED = TRUE\n#RT CYCLE END\nM30\n"
    outcome = cli("check", program(text), "--json")
    assert [e["line"] for e in outcome.json["errors"]] == [1]


def test_a_cycle_of_one_block(tmp_path: Path) -> None:
    """SCOPE = BLOCK acts on the next NC block alone (public page "BLOCK
    validity"): V.E.OUT follows X there and nowhere else.
    """
    cycle = "V.E.OUT = V.RTA.ACS.ACT_POS.X\n#RT CYCLE END\n"
    text = (
        f"G1 X10 F6000\n#RT CYCLE [SCOPE=BLOCK]\n{cycle}; nothing\nX20\nX30\n"
        f"#RT CYCLE DEF [ID=17 SCOPE=BLOCK]\n{cycle}X40\n"
        "#RT CYCLE START [ID=17]\nX50\nX60\n#RT CYCLE START [ID=17]\nX70\nX80\n"
        + f"#RT CYCLE [SCOPE=BLOCK]\n{cycle}G4 X0.01\n" * 17  # 16 at a time
        + "X90\nM30\n"
    )
    with Inside(tmp_path, text, CELL) as cnc:
        seen = set()
        for _ in range(20_000):
            if cnc.state.program_end_r:
                break
            cnc.run(1)
            seen.add(round(real(cnc, 2), 1))
    between = {value for value in seen if value not in {0, 20, 50, 70, 80}}
    assert any(10 < value < 20 for value in between)
    assert any(40 < value < 50 for value in between)
    assert any(60 < value < 70 for value in between)
    assert not any(
        begin < value < begin + 10
        for value in between
        for begin in (0, 20, 30, 50, 70, 80)
    )
    assert {20.0, 50.0, 70.0, 80.0} <= seen


def test_a_loop_that_is_the_first_row_of_the_program_ends(
    tmp_path: Path,
) -> None:
    """Nothing stands ahead of it in the store."""
    text = (
        "#RT CYCLE [SCOPE=PROG]\nV.RTG.LOOP.ENABLED = V.RTG.LOOP.COUNT < 2\n"
        "#RT CYCLE END\n#RT WHILE\nG1 X5 F6000\nX0\n#RT ENDWHILE\nX1\nM30\n"
    )
    with Inside(tmp_path, text, CELL) as cnc:
        for _ in range(5000):
            if cnc.state.program_end_r:
                break
            cnc.run(1)
        assert cnc.state.program_end_r
        assert cnc.state.rt_loop_count_r == 3
