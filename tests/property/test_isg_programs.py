"""Random ISG programs against a few lines of Python that know nothing of the front end."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from cnc_core.errors import CncError
from support.isg_programs import Run
from support.seeds import few

SEEDS = range(40)


# ------------------------------------------------------------------------------------------------
# expressions
def _expression(rng: random.Random, depth: int) -> tuple[str, str]:
    """(NC text, Python text) of one random expression; every operand is
    bracketed in Python alone.
    """
    if depth == 0 or rng.random() < 0.15:
        value = rng.choice([rng.randint(0, 9), round(rng.uniform(0, 20), 3)])
        return rng.choice(
            [
                (f"{value}", f"({value})"),
                ("P1", "p[1]"),
                ("V.P.A", "p['A']"),
                ("PI", "math.pi"),
            ]
        )
    kind = rng.random()
    if kind < 0.15:
        a = _expression(rng, depth - 1)
        return f"-[{a[0]}]", f"(-({a[1]}))"
    if kind < 0.4:
        name, python = rng.choice(
            [
                ("ABS", "abs({})"),
                ("SQR", "(({0})*({0}))"),
                ("INT", "float(math.trunc({}))"),
                ("FLOOR", "float(math.floor({}))"),
                ("CEIL", "float(math.ceil({}))"),
                ("SIN", "math.sin(math.radians({}))"),
                ("COS", "math.cos(math.radians({}))"),
                ("ATAN", "math.degrees(math.atan({}))"),
                ("NOT", "float(not ({}))"),
                ("FRACT", "(({0})-math.trunc({0}))"),
            ]
        )
        a = _expression(rng, depth - 1)
        return f"{name}[{a[0]}]", python.format(a[1])
    operators = {
        "+": "({}+{})",
        "-": "({}-{})",
        "*": "({}*{})",
        "<": "float({}<{})",
        ">": "float({}>{})",
        "<=": "float({}<={})",
        ">=": "float({}>={})",
        "==": "float({}=={})",
        "!=": "float({}!={})",
        "&&": "float(bool({}) and bool({}))",
        "||": "float(bool({}) or bool({}))",
        " XOR ": "float(bool({}) != bool({}))",
    }
    name = rng.choice(list(operators))
    a, b = _expression(rng, depth - 1), _expression(rng, depth - 1)
    return f"[{a[0]}]{name}[{b[0]}]", operators[name].format(a[1], b[1])


def _flat(rng: random.Random) -> tuple[str, str]:
    """A chain of operators without brackets: precedence decides."""
    python = {"+": "+", "-": "-", "*": "*", "/": "/", "<": "<", ">": ">"}
    text, other, compared = f"{rng.randint(1, 9)}", "", False
    other = text
    for _ in range(rng.randint(1, 6)):
        name = rng.choice([n for n in python if not (compared and n in "<>")])
        compared = compared or name in "<>"
        value = rng.randint(1, 9)
        text, other = (
            f"{text} {name} {value}",
            f"{other} {python[name]} {value}",
        )
    return text, other


@pytest.mark.parametrize("seed", SEEDS)
def test_expressions_agree_with_python(seed, tmp_path):
    """Random expression trees, and chains whose precedence counts, give what Python computes."""
    rng = random.Random(seed)
    pairs = [_expression(rng, rng.randint(1, 5)) for _ in range(15)] + [
        _flat(rng) for _ in range(15)
    ]
    p = {1: round(rng.uniform(-5, 5), 2), "A": float(rng.randint(-9, 9))}
    lines = [
        f"P1={p[1]} V.P.A={p['A']}",
        *(f"V.P.R{i} = {nc}" for i, (nc, _) in enumerate(pairs)),
    ]
    run = Run("\n".join(lines), tmp_path)
    assert not run.codes
    for i, (nc, python) in enumerate(pairs):
        wanted = float(eval(python, {"math": math, "p": p}))
        found = run.reader.state.store.program[f"R{i}"].values[0]
        # steps of comparisons and roundings stand in the trees: angles may
        # differ by the last digit only
        assert found == pytest.approx(wanted, rel=1e-9, abs=1e-9), (nc, python)


# ------------------------------------------------------------------------------------------------
# control flow
class Program:
    """A random structured program as NC text, and the same as Python source."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.subs = self.rng.randint(0, 3)
        self.loops = 0
        self.text: list[str] = []
        self.python: list[str] = ["def main(v, out, sub):"]

    def make(self) -> tuple[str, list[str]]:
        """Text and Python source; subprogram i may call the ones before it."""
        heads, source = [], []
        for number in range(self.subs):
            nc, py = self._body(1, 3, number, False)
            heads += [f"%L SUB{number}", *nc, "M17"]
            source += [
                f"def sub{number}(v, out):",
                *(f"    {line}" for line in py or ["pass"]),
            ]
        nc, py = self._body(0, 6, self.subs, False)
        source += [
            "def main(v, out):",
            *(f"    {line}" for line in py or ["pass"]),
        ]
        start = ["%MAIN", "G01 F1000 P1=0 P2=1 P3=2", *nc, "M30"]
        return "\n".join([*heads, *start, ""]), source

    def _condition(self) -> tuple[str, str]:
        name, sign, value = (
            self.rng.randint(1, 3),
            self.rng.choice(["<", ">", "=="]),
            self.rng.randint(0, 6),
        )
        return f"P{name} {sign} {value}", f"v[{name}] {sign} {value}"

    def _body(
        self, depth: int, most: int, subs: int, loop: bool
    ) -> tuple[list[str], list[str]]:
        nc: list[str] = []
        py: list[str] = []
        for _ in range(self.rng.randint(1, most)):
            a, b = self._statement(depth, subs, loop)
            nc += (
                [self.rng.choice(["", "N10 ", "  "]) + a[0], *a[1:]]
                if a and a[0][:1] != "%"
                else a
            )
            py += b
            if self.rng.random() < 0.2:
                nc.append(
                    self.rng.choice(["", "; text $ENDIF", "( $ENDWHILE )"])
                )
        return nc, py

    def _statement(
        self, depth: int, subs: int, loop: bool
    ) -> tuple[list[str], list[str]]:
        makers = [self._motion, self._motion, self._assign]
        if depth < 4:
            makers += [
                self._if,
                self._for,
                self._while,
                self._switch,
                self._repeat,
            ]
        if loop:
            makers += [self._break]
        if subs:
            makers += [self._call]
        return self.rng.choice(makers)(depth, subs, loop)

    def _motion(self, *_):
        name = self.rng.randint(1, 3)
        if self.rng.random() < 0.3:
            x = self.rng.randint(-50, 50)
            return [f"X{x} Y{len(self.text)}"], [f"out.append({x}.0)"]
        return [f"X[P{name}*2+1]"], [f"out.append(v[{name}]*2.0+1)"]

    def _assign(self, *_):
        a, b, c = (
            self.rng.randint(1, 3),
            self.rng.randint(1, 3),
            self.rng.randint(0, 3),
        )
        return [f"P{a} = [P{b} + {c}] MOD 7"], [f"v[{a}] = (v[{b}] + {c}) % 7"]

    def _if(self, depth, subs, loop):
        test, pytest_ = self._condition()
        nc, py = [f"$IF {test}"], [f"if {pytest_}:"]
        for word in [
            "",
            *(["$ELSEIF"] * self.rng.randint(0, 2)),
            *(["$ELSE"] if self.rng.random() < 0.5 else []),
        ]:
            if word == "$ELSEIF":
                test, pytest_ = self._condition()
                nc.append(f"$ELSEIF {test}")
                py.append(f"elif {pytest_}:")
            elif word:
                nc.append("$ELSE")
                py.append("else:")
            a, b = self._body(depth + 1, 3, subs, loop)
            nc += a
            py += [f"    {line}" for line in b or ["pass"]]
        return [*nc, "$ENDIF"], py

    def _for(self, depth, subs, loop):
        self.loops += 1
        i, first, last, step = (
            100 + self.loops,
            self.rng.randint(0, 3),
            self.rng.randint(0, 4),
            self.rng.choice([1, 2]),
        )
        if self.rng.random() < 0.3:
            first, last, step = last, first, -step
        a, b = self._body(depth + 1, 3, subs, True)
        head = f"for v[{i}] in range({first}, {last + (1 if step > 0 else -1)}, {step}):"
        return [f"$FOR P{i} = {first}, {last}, {step}", *a, "$ENDFOR"], [
            head,
            *(f"    {line}" for line in b or ["pass"]),
        ]

    def _while(self, depth, subs, loop):
        self.loops += 1
        i, last = 100 + self.loops, self.rng.randint(0, 3)
        a, b = self._body(depth + 1, 3, subs, True)
        nc = [
            f"P{i} = 0",
            f"$WHILE P{i} < {last}",
            f"P{i} = P{i} + 1",
            *a,
            "$ENDWHILE",
        ]
        return nc, [
            f"v[{i}] = 0",
            f"while v[{i}] < {last}:",
            f"    v[{i}] += 1",
            *(f"    {line}" for line in b),
        ]

    def _repeat(self, depth, subs, loop):
        self.loops += 1
        i, last = 100 + self.loops, self.rng.randint(1, 3)
        a, b = self._body(depth + 1, 2, subs, False)
        nc = [
            f"P{i} = 0",
            "$REPEAT",
            f"P{i} = P{i} + 1",
            *a,
            f"$UNTIL P{i} >= {last}",
        ]
        body = [
            f"    v[{i}] += 1",
            *(f"    {line}" for line in b),
            f"    if v[{i}] >= {last}:",
            "        break",
        ]
        return nc, [f"v[{i}] = 0", "while True:", *body]

    def _switch(self, depth, subs, loop):
        name = self.rng.randint(1, 3)
        nc, py = (
            [f"$SWITCH P{name}"],
            [f"_s = v[{name}]", "if False:", "    pass"],
        )
        for value in self.rng.sample(range(6), self.rng.randint(1, 3)):
            a, b = self._body(depth + 1, 2, subs, False)
            nc += [f"$CASE {value}", *a, "$BREAK"]
            py += [
                f"elif _s == {value}:",
                *(f"    {line}" for line in b or ["pass"]),
            ]
        if self.rng.random() < 0.5:
            a, b = self._body(depth + 1, 2, subs, False)
            nc += ["$DEFAULT", *a, "$BREAK"]
            py += ["else:", *(f"    {line}" for line in b or ["pass"])]
        return [*nc, "$ENDSWITCH"], py

    def _break(self, *_):
        test, python = self._condition()
        word, other = self.rng.choice(
            [("$BREAK", "break"), ("$CONTINUE", "continue")]
        )
        return [f"$IF {test}", word, "$ENDIF"], [
            f"if {python}:",
            f"    {other}",
        ]

    def _call(self, depth, subs, loop):
        number = self.rng.randrange(subs)
        return [f"LL SUB{number}"], [f"sub{number}(v, out)"]


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", few(range(60), 20))
def test_control_flow_agrees_with_python(seed, tmp_path):
    """Random programs of nested statements and subprograms drive to the
    positions of the same Python function.
    """
    text, source = Program(seed).make()
    space: dict = {}
    exec("\n".join(source), space)
    out: list[float] = []
    space["main"]({1: 0.0, 2: 1.0, 3: 2.0}, out)
    run = Run(text, tmp_path)
    assert not run.codes, text
    wanted, position = [], 0.0
    for x in out:  # a motion that does not move gives no row
        if x != position:
            wanted.append(x)
        position = x
    assert run.x() == wanted, text
    again = Run(text, tmp_path, scan=False)
    assert (again.rows == run.rows).all(), "with and without the C scanner"


# ------------------------------------------------------------------------------------------------
# offsets
class OffsetModel:
    """What lies between programmed and machine coordinates, in numpy; every
    step gives an NC line.
    """

    lengths = {0: 0.0, 1: 20.0, 2: 7.0}
    mirrors = {20: (1, 1), 21: (-1, 1), 22: (1, -1), 23: (-1, -1)}

    def __init__(self, rng: random.Random) -> None:
        self.rng = rng
        self.table = np.zeros((4, 3))
        self.table[1], self.table[2] = [100, 10, 0], [-50, 0, 5]
        self.zero, self.g92, self.mirror = np.zeros(3), np.zeros(3), np.ones(3)
        self.tool, self.unit, self.absolute, self.share = 0, 1.0, True, 1.0
        self.offset, self.position = np.zeros(3), np.zeros(3)
        self.driven: list[np.ndarray] = []

    def words(self) -> dict[int, float]:
        return {
            i: round(self.rng.uniform(-20, 20), 3)
            for i in range(3)
            if self.rng.random() < 0.6
        }

    def text(self, words: dict[int, float]) -> str:
        return " ".join(f"{'XYZ'[i]}{v}" for i, v in words.items())

    def step(self) -> str:
        makers = [
            self.select,
            self.additive,
            self.turn,
            self.length,
            self.dimension,
            self.scale,
            self.stored,
        ]
        return self.rng.choice(
            [*makers, self.move, self.move, self.move, self.move]
        )()

    def select(self) -> str:
        number = self.rng.randint(0, 3)
        self.zero = self.table[number].copy()
        return (
            f"G{53 + number}" if self.rng.random() < 0.5 else f"G159={number}"
        )

    def additive(self) -> str:
        words = self.words()
        for i, v in words.items():
            self.g92[i] = v * self.unit + (
                0.0 if self.absolute else self.g92[i]
            )
        return f"G92 {self.text(words)}" if words else ""

    def turn(self) -> str:
        code = self.rng.choice(list(self.mirrors))
        self.mirror[:2] = self.mirrors[code]
        return f"G{code}"

    def length(self) -> str:
        self.tool = self.rng.randint(0, 2)
        return f"D{self.tool}"

    def dimension(self) -> str:
        self.absolute = self.rng.random() < 0.7
        return "G90" if self.absolute else "G91"

    def scale(self) -> str:
        if self.rng.random() < 0.5:
            self.unit = self.rng.choice([1.0, 25.4])
            return "G71" if self.unit == 1.0 else "G70"
        self.share = self.rng.choice([1.0, 0.5])
        return "G52" if self.share == 1.0 else "G51"

    def stored(self) -> str:
        number, axis, value = (
            self.rng.randint(1, 3),
            self.rng.randint(0, 2),
            self.rng.randint(-30, 30),
        )
        self.table[number][axis] = value * self.unit
        return f"V.G.NP[{number}].V.{'XYZ'[axis]} = {value}"

    def move(self) -> str:
        words, before = self.words(), self.position.copy()
        total = (
            self.zero + self.g92 + np.array([0.0, 0.0, self.lengths[self.tool]])
        )
        for i, v in words.items():
            value = (
                v * self.unit * self.mirror[i] * (self.share if i == 0 else 1.0)
            )
            if self.absolute:
                self.offset[i] = total[i]
            self.position[i] = value + (
                self.offset[i] if self.absolute else self.position[i]
            )
        if np.linalg.norm(self.position - before) >= 1e-9:
            self.driven.append(self.position.copy())
        return self.text(words)


@pytest.mark.parametrize("seed", range(30))
def test_offsets_and_mirroring_agree_with_numpy(seed, tmp_path):
    """Zero offsets, G92, tool lengths, mirroring, inch, diameter: each axis
    takes them at its next absolute word.
    """
    model = OffsetModel(random.Random(seed))
    run = Run("\n".join(["G00", *(model.step() for _ in range(80))]), tmp_path)
    assert not run.codes
    assert run.ends[:, :3] == pytest.approx(
        np.array(model.driven).reshape(-1, 3), abs=1e-9
    )


# ------------------------------------------------------------------------------------------------
# fuzz
WORDS = (
    """
$IF 1|$ELSE|$ENDIF|$FOR P1=1,3,1|$ENDFOR|$WHILE P1<4|$ENDWHILE|$DO|$ENDDO|$BREAK
$CONTINUE|$SWITCH P1|$CASE 1|$ENDSWITCH|$DEFAULT|$REPEAT|$UNTIL 1|$GOTO [A]
$GOTO N20|[A]|N20:|#VAR|#ENDVAR|V.L.A : SGN08 = 5|P1=P1+1|X[P1]|LL S|L x.nc
L CYCLE [NAME=s.nc @P1=2]|%L S|%M|M17|M30|G54 X1|G92 X0|G21|D1|"M" = "X5"|"M"
#COMMENT BEGIN|#COMMENT END|#IF 1|#ELSE|#ENDIF|/ X1|/2 Y1|V.P.T = "abc"
V.P.T = MID[V.P.T,1,2]|X V.A.ABS.Y|#MSG ["%d", P1]|#FLUSH WAIT|G41 D1|G40 X0
G02 X5 I2|#DELETE V.P.T|V.E.GO = 1|G93 F2|G94|S100 M3|#ERROR [ID=5 RC=0]
#TIMER START|X=SIZEOF[P1]|\\|X10 \\|#PSET X5|#MCS ON|#OVERRIDE [FEED_FACT=50]
G80 [1,,2]|#WAIT [ID=1]|#SIGNAL [ID=1]|@P1=3
""".strip()
    .replace("\n", "|")
    .split("|")
)
LETTERS = '[]()"=,;:$#%/\\ .-+*NGXPVL019\t\0é'


def mutated(rng: random.Random) -> str:
    """Statements in any order, with characters lost, put in and doubled."""
    text = list(
        "\n".join(
            [
                "G01 F1000 P1=1",
                *(rng.choice(WORDS) for _ in range(rng.randint(5, 60))),
            ]
        )
    )
    for _ in range(rng.randint(0, 12)):
        place = rng.randrange(len(text))
        action = rng.random()
        if action < 0.4:
            del text[place]
        elif action < 0.7:
            text.insert(place, rng.choice(LETTERS))
        else:
            text[place : place + 1] = (
                text[place : place + rng.randint(1, 8)] * 2
            )
    return "".join(text)


@pytest.mark.parametrize("seed", few(range(50), 20))
def test_mutated_programs_never_fail_otherwise_than_by_number(seed, tmp_path):
    """Whatever stands in a program: errors with places, no traceback, an end."""
    try:
        run = Run(
            mutated(random.Random(seed)),
            tmp_path,
            idle=3000,
            lenient=bool(seed % 2),
        )
    except CncError as error:  # control characters: a file that is no text
        refused = (error.code, error.place.line > 0)
    else:
        refused = None
    if refused:
        assert refused == (901009, True)
        return
    for error in run.reader.errors:
        assert error.place.line >= 1
        assert error.place.column >= 1
    assert np.isfinite(run.rows["end"]).all()
