"""Random IsoNs programs against Python, transformation stacks against numpy,
corners against another construction.
"""

# ruff: noqa: PLR0911 - one return a kind of statement

import itertools
import math
import random

import numpy as np
import pytest

from cnc_core.blocks import CIRCULAR
from cnc_core.errors import CncError
from cnc_core.frontend import create
from cnc_core.frontend.offline import read_all
from cnc_core.frontend.port import OfflinePort
from support.isons_programs import run
from support.seeds import few

WRAP = 1000


class Writer:
    """A random structured program, as IsoNs text and as Python text."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.labels = 0
        self.left = 40

    def expression(self, depth=0):
        r = self.random
        kind = r.randrange(7 if depth < 3 else 2)
        if kind == 0:
            value = r.randrange(9)
            return str(value), str(float(value))
        if kind == 1:
            i = r.randrange(4)
            return f"$V{i}", f"v[{i}]"
        (a, p), (b, q) = self.expression(depth + 1), self.expression(depth + 1)
        if kind == 2:
            index = r.randrange(5)
            return f"$ARR[{index}]", f"arr[{index}]"
        if kind == 3:
            sign = r.choice("+-*")
            return f"({a}{sign}{b})", f"({p}{sign}{q})"
        if kind == 4:
            sign = r.choice(["<", ">", "<=", ">=", "=", "<>"])
            python = {"=": "==", "<>": "!="}.get(sign, sign)
            return f"({a}{sign}{b})", f"float({p}{python}{q})"
        if kind == 5:
            sign = r.choice(["&", "|", " XOR "])
            return (
                f"({a}{sign}{b})",
                f"float(int({p}){sign.replace(' XOR ', '^')}int({q}))",
            )
        return f"FIX(ABS({a})/3)", f"float(int(abs({p})/3))"

    def bounded(self):
        """A value in -WRAP..WRAP: x - FIX(x/WRAP)*WRAP."""
        a, p = self.expression()
        return f"({a})-FIX(({a})/{WRAP})*{WRAP}", f"math.fmod({p},{WRAP})"

    def statements(self, depth, subs):
        iso, python = [], []
        for _ in range(self.random.randrange(1, 4)):
            a, p = self.statement(depth, subs)
            iso += a
            python += p
        return iso, python

    def statement(self, depth, subs):
        r = self.random
        self.left -= 1
        kinds = ["assign", "array", "move"] + (
            ["if", "loop", "goto"] if depth < 3 and self.left > 0 else []
        )
        kind = r.choice(kinds + (["gosub"] if subs else []))
        if kind == "assign":
            i, (a, p) = r.randrange(4), self.bounded()
            return [f"$V{i}={a}"], [f"v[{i}]={p}"]
        if kind == "array":
            i, (a, p) = r.randrange(5), self.bounded()
            return [f"$ARR[{i}] = {a}"], [f"arr[{i}]={p}"]
        if kind == "move":
            i = r.randrange(4)
            return [f"G1 X[$V{i}] DY1"], [f"out.append((v[{i}],))"]
        if kind == "gosub":
            name = r.choice(subs)
            return [f"GOSUB {r.choice(['@', ''])}{name}"], [f"{name}()"]
        a, p = self.expression()
        body, code = self.statements(depth + 1, subs)
        code = ["    " + line for line in code]
        if kind == "if":
            other, other_code = self.statements(depth + 1, subs)
            iso = [f"IF {a}", *body, "ELSE", *other, "END_IF"]
            return iso, [
                f"if {p}:",
                *code,
                "else:",
                *("    " + line for line in other_code),
            ]
        if kind == "loop":
            count = r.randrange(4)
            return [f"LOOP {count}", *body, "END_LOOP"], [
                f"for _ in range({count}):",
                *code,
            ]
        self.labels += 1
        name = f"L{self.labels}"
        return [f"IF {a}", f"GOTO {name}", "END_IF", *body, f"@{name}"], [
            f"if not {p}:",
            *code,
        ]

    def program(self):
        names, iso, python = [], [], []
        for i in range(3):
            body, code = self.statements(1, list(names))
            iso += [f"@SUB{i}", *body, "RETURN"]
            python += [f"def SUB{i}():", *("    " + line for line in code)]
            names.append(f"SUB{i}")
        body, code = self.statements(0, names)
        head = ["DIM $ARR[5]", *(f"$V{i}={i}" for i in range(4)), "G90"]
        return "\n".join([*head, *body, "END_PROGRAM", *iso]) + "\n", "\n".join(
            [*python, *code]
        )


@pytest.mark.parametrize("seed", few(range(60), 12))
def test_random_programs_agree_with_python(tmp_path, seed):
    """Loops, branches, jumps, subroutines and arrays give what the same program in Python gives."""
    text, python = Writer(seed).program()
    space = {
        "v": [0.0, 1.0, 2.0, 3.0],
        "arr": [0.0] * 5,
        "out": [],
        "math": math,
    }
    exec(python, space)
    out = run(tmp_path, text)
    assert [out.variable(f"V{i}") for i in range(4)] == space["v"], text
    assert out.array("ARR") == space["arr"], text
    assert out.xy[:, 0].tolist() == [x for (x,) in space["out"]], text
    assert out.xy[:, 1].tolist() == [
        float(i + 1) for i in range(len(space["out"]))
    ]


def affine(matrix, shift):
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = matrix, shift
    return out


class Stack:
    """The transformations in force, as homogeneous matrices of X Y Z."""

    def __init__(self):
        self.swap = self.named = self.mirror = self.scale = self.turn = np.eye(
            4
        )
        self.origin = np.zeros(3)

    @property
    def matrix(self):
        return (
            affine(np.eye(3), self.origin)
            @ self.turn
            @ self.scale
            @ self.mirror
            @ self.swap
            @ self.named
        )


def change(rng, stack, state):
    """One random function: its text; the stack follows."""
    kind = rng.randrange(7)
    if kind == 0:
        state["plane"] = not state["plane"]
        stack.swap = affine(
            np.eye(3)[[1, 0, 2]] if state["plane"] else np.eye(3), np.zeros(3)
        )
        return "G22" if state["plane"] else "G23"
    if kind == 1:
        pair = rng.choice(["YZ", "XZ", "XY"])
        order = [0, 1, 2]
        i, j = ("XYZ".index(c) for c in pair)
        order[i], order[j] = order[j], order[i]
        stack.named = affine(np.eye(3)[order], np.zeros(3))
        return f"G26 {pair}"
    if kind == 2:
        axis = rng.randrange(2)
        state["mirror"][axis] *= -1
        stack.mirror = affine(np.diag([*state["mirror"], 1.0]), np.zeros(3))
        return [["G25", "G24"], ["G121", "G120"]][axis][
            state["mirror"][axis] < 0
        ]
    if kind == 3:
        ratio = np.array([rng.choice([0.5, 2.0, 1.5]) for _ in range(3)])
        centre = np.array([rng.randrange(-20, 20) for _ in range(3)])
        stack.scale = affine(np.diag(ratio), centre * (1 - ratio))
        return "G1051 X{} Y{} Z{} I{} J{} K{}".format(*centre, *ratio)
    if kind == 4:
        angle, x, y = (
            rng.randrange(-180, 180),
            rng.randrange(-20, 20),
            rng.randrange(-20, 20),
        )
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        centre = np.array([x, y, 0])
        stack.turn = affine(turn, centre - turn @ centre)
        return f"G50 X{x} Y{y} Z{angle}"
    if kind == 5:
        stack.turn = np.eye(4)
        return "G51"
    stack.origin = np.array(
        [rng.randrange(-50, 50) for _ in range(3)], dtype=float
    )
    return "G94 X{} Y{} Z{}".format(*stack.origin)


@pytest.mark.parametrize("seed", few(range(40), 20))
def test_transformations_agree_with_numpy(tmp_path, seed):
    """Swaps, mirrors, scaling, rotation and origins, in any order, are one product of matrices."""
    rng = random.Random(seed)
    stack, state = Stack(), {"plane": False, "mirror": [1.0, 1.0]}
    lines, want = [], []
    for _ in range(25):
        lines.append(change(rng, stack, state))
        point = [rng.randrange(-100, 100) for _ in range(3)]
        lines.append("G0 X{} Y{} Z{}".format(*point))
        want.append((stack.matrix @ [*point, 1.0])[:3])
        step = [rng.randrange(1, 9) for _ in range(3)]
        lines.append("G91 G1 X{} Y{} Z{}\nG90".format(*step))
        want.append((stack.matrix @ [*np.add(point, step), 1.0])[:3])
    out = run(tmp_path, "\n".join(lines) + "\n")
    assert out.ends[:, :3] == pytest.approx(np.array(want), abs=1e-6)


def greedy(points, size, angle, bevel):
    """Corners another way: (entry, exit) by corner index.  The fillet's centre
    is where the parallels meet.
    """
    left = [np.linalg.norm(b - a) for a, b in itertools.pairwise(points)]
    served = {}
    for k in range(1, len(points) - 1):
        a, p, b = points[k - 1 : k + 2]
        u, v = (p - a) / np.linalg.norm(p - a), (b - p) / np.linalg.norm(b - p)
        turn = math.degrees(math.acos(np.clip(u @ v, -1, 1)))
        if turn <= angle or turn > 180 - 1e-6:
            continue
        if bevel:  # the new edge and the two setbacks are an isosceles triangle
            setback = size / math.sqrt(2 + 2 * (u @ v))
            entry, leave = p - setback * u, p + setback * v
        else:
            side = math.copysign(1, u[0] * v[1] - u[1] * v[0])
            n, m = (
                side * np.array([-u[1], u[0]]),
                side * np.array([-v[1], v[0]]),
            )
            centre = np.linalg.solve([n, m], [n @ p + size, m @ p + size])
            entry, leave = centre - size * n, centre - size * m
            setback = np.linalg.norm(p - entry)
        if setback <= left[k - 1] and setback <= left[k]:
            left[k - 1] -= setback
            left[k] -= setback
            served[k] = (entry, leave)
    return served


@pytest.mark.parametrize("seed", few(range(40), 20))
def test_corners_agree_with_another_construction(tmp_path, seed):
    """Fillets and bevels of random polygons: which corners, entry and exit of each."""
    rng = random.Random(seed)
    points = [
        np.array([rng.uniform(0, 100), rng.uniform(0, 100)]) for _ in range(12)
    ]
    size, angle, bevel = (
        rng.uniform(1, 15),
        rng.choice([0, 20, 60]),
        bool(seed % 2),
    )
    text = "G0X{!r}Y{!r}\nG{} R{!r} A{}\n".format(
        *map(float, points[0]), 33 if bevel else 30, size, angle
    )
    text += "".join("G1X{!r}Y{!r}\n".format(*map(float, p)) for p in points[1:])
    out = run(tmp_path, text)
    served = greedy(points, size, angle, bevel)
    want = [points[0]]
    for k in range(1, len(points)):
        want += served.get(k, (points[k],))
    assert out.xy == pytest.approx(np.array(want), abs=1e-6)
    assert (out.moves["type"] == CIRCULAR).sum() == (
        0 if bevel else len(served)
    )


WORDS = [
    "G0",
    "G1",
    "G2",
    "X5",
    "Y-3",
    "I2",
    "R4",
    "F1",
    "G91",
    "G90",
    "[",
    "]",
    "$A",
    "=",
    "(",
    ")",
    "+",
    "IF",
    "LOOP",
    "3",
    "END_LOOP",
    "END_IF",
    "ELSE",
    "GOTO",
    "@L",
    "G50",
    "Z30",
    "G41",
    "G40",
    "D5",
    "T1",
    "HM1",
    "M3",
    "DIM",
    "$A[3]",
    '"',
    ",",
    "G1051",
    "DX1",
    "OX1",
    "USER_ZERO",
    "G54",
    "PA[0]",
    "G30",
    "A20",
    "WAIT_INPUT",
    "GET_VAR",
    "1.5",
    "G62",
    "N5",
    "//",
]


@pytest.mark.parametrize("seed", few(range(150), 24))
def test_any_text_gives_rows_or_errors(tmp_path, seed):
    """Random words in random order: nothing but numbered errors with their places."""
    rng = random.Random(seed)
    lines = [
        rng.choice(["", " "]).join(rng.choices(WORDS, k=rng.randrange(1, 6)))
        for _ in range(12)
    ]
    text = "\n".join(lines) + "\n"
    out = run(tmp_path, text, collect=True)
    assert all(error.place.line for error in out.errors), text
    if out.errors:
        with pytest.raises(CncError) as caught:
            run(tmp_path, text)
        assert caught.value.place.line, text


@pytest.mark.parametrize("seed", few(range(20), 10))
def test_scanner_and_parser_agree(tmp_path, seed):
    """Plain lines mean the same whether C or Python reads them: planes, arcs,
    distances, centres.
    """
    rng = random.Random(seed)
    lines = ["G0 X1 Y2 Z3 F2.5"]
    for _ in range(60):
        words = [
            rng.choice(["G0", "G1", "", "G17", "G18", "G19", "G90", "G91"])
        ]
        words += [
            f"{axis}{rng.randrange(-99, 99) / 10}"
            for axis in rng.sample("XYZ", rng.randrange(1, 3))
        ]
        if rng.random() < 0.3:
            words = [
                rng.choice(["G17", "G18", "G19", "G90", "G91"]),
                rng.choice(["G2", "G3"]),
            ]
            words += [
                f"{axis}{rng.randrange(-99, 99) / 10}" for axis in "XYZ"
            ] + [f"R{rng.randrange(100, 200)}"]
        lines.append(" ".join(words))
    lines += [
        "G91 G3 G18 I2 J3",
        "G91 G2 G19 I2 J3",
        "G90 G17 G0 X0 Y0",
        "G3 X10 Y0 I5 J0",
        "G2 X0 Y0 I5 J0",
    ]
    path = tmp_path / "p.isons"
    path.write_text("\n".join(lines))
    machine = run(tmp_path, "").reader.channel.machine
    readers = [
        create("isons", path, machine, OfflinePort(machine.start), collect=True)
        for _ in range(2)
    ]
    readers[1]._scan = False
    a, b = (
        np.concatenate([batch.rows for batch in read_all(reader, 50)])
        for reader in readers
    )
    assert len(a) == len(b) > 20
    for name in (
        "end",
        "type",
        "length",
        "center",
        "angle",
        "plane",
        "feed",
        "n",
        "line",
    ):
        assert a[name] == pytest.approx(b[name]), name
    assert [e.code for e in readers[0].errors] == [
        e.code for e in readers[1].errors
    ]
