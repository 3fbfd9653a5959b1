"""Random RS-274 programs against an interpreter of its own, and the scanner against the parser."""

import itertools
import math
import random
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cnc_core.blocks import POLYNOMIAL
from cnc_core.errors import CncError
from cnc_core.frontend.iso import IsoFrontEnd
from cnc_core.frontend.machine import ProgramMachine, Tool
from cnc_core.frontend.offline import read_all
from cnc_core.frontend.port import OfflinePort
from support.seeds import few

START = (3.0, -4.0, 50.0)
MACHINE = ProgramMachine(
    ("X", "Y", "Z", "A"),
    (False, False, False, True),
    (0, 1, 2),
    np.array([*START, 0.0]),
    {1: Tool(3.0, 12.5)},
)
FIXED = settings(
    max_examples=200, deadline=None, derandomize=True, database=None
)


def read(text, scan=True):
    """(rows, errors) of a program."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "p.ngc"
        path.write_text(text)
        try:
            reader = IsoFrontEnd(
                path,
                MACHINE,
                OfflinePort(MACHINE.start),
                collect=True,
                scan=scan,
            )
        except CncError as refused:  # a file that is no text
            place = refused.place
            return np.empty(0), [(refused.code, place.line, place.column)]
        batches = [batch.rows for batch in read_all(reader, 16)]
    rows = np.concatenate(batches) if batches else np.empty(0)
    return rows, [(e.code, e.place.line, e.place.column) for e in reader.errors]


class Mini:
    """RS-274 in a few lines: writes a program and says where each of its lines
    leads, machine coordinates in mm.
    """

    def __init__(self, rng):
        self.rng, self.text, self.points = rng, [], []
        self.at, self.unit, self.absolute, self.to_r = (
            list(START),
            1.0,
            True,
            False,
        )
        self.systems, self.system, self.g92, self.length = (
            [[0.0] * 3 for _ in range(9)],
            0,
            [0.0] * 3,
            0.0,
        )
        self.series = None

    def number(self, low=-90, high=90):
        return round(self.rng.uniform(low, high), self.rng.randint(0, 3))

    def shift(self, i):
        return (
            self.systems[self.system][i]
            + self.g92[i]
            + (self.length if i == 2 else 0.0)
        )

    def go(self, i, to):
        if not isinstance(i, dict):
            i = {i: to}
        before = list(self.at)
        for axis, value in i.items():
            self.at[axis] = value
        if math.dist(before, self.at) > 1e-9:
            self.points.append((len(self.text) + 1, tuple(self.at)))

    def target(self, i, value):
        return value * self.unit + (
            self.shift(i) if self.absolute else self.at[i]
        )

    def words(self):
        chosen = [i for i in range(3) if self.rng.random() < 0.6] or [
            self.rng.randrange(3)
        ]
        return {i: self.number() for i in chosen}

    def say(self, line):
        self.text.append(line)

    def step(self):
        self.rng.choice(
            [self.line] * 5
            + [self.mode] * 2
            + [self.offset, self.home, self.machine, self.drill, self.drill]
        )()

    def line(self):
        words = self.words()
        self.go({i: self.target(i, v) for i, v in words.items()}, None)
        self.series = None
        self.say(
            self.rng.choice(["G0", "g01", "G 1"])
            + "".join(f" {'XYZ'[i]}{v}" for i, v in words.items())
        )

    def mode(self):
        which = self.rng.randrange(5)
        if which == 0:
            self.absolute = not self.absolute
            self.say("G90" if self.absolute else "G91")
        elif which == 1:
            self.unit = 25.4 if self.unit == 1.0 else 1.0
            self.say("G21" if self.unit == 1.0 else "G20")
        elif which == 2:
            self.system = self.rng.randrange(9)
            self.say(
                (
                    "G54",
                    "G55",
                    "G56",
                    "G57",
                    "G58",
                    "G59",
                    "G59.1",
                    "G59.2",
                    "G59.3",
                )[self.system]
            )
        elif which == 3:
            self.to_r = not self.to_r
            self.say("G99" if self.to_r else "G98")
        else:
            self.length = 0.0 if self.length else 12.5
            self.say("G43 H1" if self.length else "G49")

    def offset(self):
        i, value = self.rng.randrange(3), self.number()
        which = self.rng.randrange(4)
        if which == 0:
            self.systems[1][i] = value * self.unit
            self.say(f"G10 L2 P2 {'XYZ'[i]}{value}")
        elif which == 1:
            self.systems[self.system][i] = (
                self.at[i]
                - value * self.unit
                - (self.shift(i) - self.systems[self.system][i])
            )
            self.say(f"G10 L20 P0 {'XYZ'[i]}{value}")
        elif which == 2:
            self.g92[i] += self.at[i] - value * self.unit - self.shift(i)
            self.say(f"G92 {'XYZ'[i]}{value}")
        else:
            self.systems[2][i] = value
            self.say(f"#{5261 + i}={value}")

    def home(self):
        i, value = self.rng.randrange(3), self.number()
        self.go(i, self.target(i, value))
        self.go(i, START[i])
        self.say(f"G28 {'XYZ'[i]}{value}")

    def machine(self):
        i, value = self.rng.randrange(3), self.number()
        self.go(i, value * self.unit)
        self.series = None
        self.say(f"G53 G0 {'XYZ'[i]}{value}")

    def drill(self):
        code = self.rng.choice([81, 82, 83, 73])
        x, y, clearance, depth = (
            self.number(),
            self.number(),
            self.number(-20, 20),
            self.number(0.5, 20),
        )
        q, count = (
            round(depth / self.rng.uniform(1.2, 4) + 0.5, 2),
            self.rng.choice([1, 1, 2, 3]),
        )
        z = clearance - depth if self.absolute else -depth
        level = self.at[2] if self.series is None else self.series
        r = self.target(2, clearance)
        bottom = r - depth * self.unit
        self.series = level
        if self.at[2] < r:
            self.go(2, r)
        for _ in range(count):
            self.go({0: self.target(0, x), 1: self.target(1, y)}, None)
            self.go(2, r)
            at = r - q * self.unit
            while code in (73, 83) and at > bottom + 1e-9:
                self.go(2, at)
                if code == 83:
                    self.go(2, r)
                self.go(2, min(at + 0.254, r))
                at -= q * self.unit
            self.go(2, bottom)
            self.go(2, r if self.to_r else max(level, r))
        self.say(
            f"G{code} X{x} Y{y} Z{round(z, 6)} R{clearance} L{count} "
            + {81: "", 82: "P0.1"}.get(code, f"Q{q}")
        )


@pytest.mark.parametrize("seed", few(range(60), 20))
@pytest.mark.parametrize("scan", [True, False])
def test_programs_lead_where_an_independent_interpreter_goes(seed, scan):
    """Absolute, incremental, inch, offsets, tool length, home and drilling
    cycles: the same points, line for line.
    """
    mini = Mini(random.Random(seed))
    mini.say("G21 G90 G98 G54 F500")
    for _ in range(60):
        mini.step()
    text = "\n".join(mini.text)
    rows, errors = read(text, scan)
    rows = rows[rows["type"] <= POLYNOMIAL]
    assert not errors, text
    assert rows["line"].tolist() == [line for line, _ in mini.points], text
    for row, (line, point) in zip(rows, mini.points, strict=True):
        assert np.allclose(row["end"][:3], point, atol=1e-6), (line, text)


@pytest.mark.parametrize("seed", range(40))
def test_arcs_about_a_rounded_centre(seed):
    """Arcs whose end point and centre are rounded to 0.001 mm, as CAM writes
    them: end point, sense, sweep, radius.
    """
    rng = random.Random(seed)
    for _ in range(20):
        radius, first, sweep = (
            rng.uniform(0.5, 200),
            rng.uniform(0, 7),
            rng.uniform(0.01, 2 * math.pi - 0.01),
        )
        sense = rng.choice([1, -1])
        start = [
            round(radius * math.cos(first), 3),
            round(radius * math.sin(first), 3),
        ]
        end = [
            round(radius * math.cos(first + sense * sweep), 3),
            round(radius * math.sin(first + sense * sweep), 3),
        ]
        i, j = round(-start[0], 3), round(-start[1], 3)
        code = 3 if sense > 0 else 2
        rows, errors = read(
            f"G0 X{start[0]} Y{start[1]}\nG{code} X{end[0]} Y{end[1]} I{i} J{j} F100\n"
        )
        assert not errors
        assert np.allclose(rows[-1]["end"][:2], end)
        assert math.isclose(
            rows[-1]["angle"], sense * sweep, abs_tol=0.06 / radius
        )
        assert math.isclose(rows[-1]["radius"], radius, abs_tol=0.06)
        assert math.hypot(*rows[-1]["center"]) < 0.06


WORD = st.one_of(
    st.builds(
        "{}{}".format,
        st.sampled_from("XYZAIJKRFxyPQ"),
        st.integers(-9999, 9999).map(lambda i: i / 100),
    ),
    st.sampled_from(
        [
            "G0",
            "G01",
            "G02",
            "G3",
            "G17",
            "G18",
            "G19",
            "G90",
            "G91",
            "F600",
            "N10",
            "(c)",
            "I5 J5",
        ]
    ),
    st.sampled_from(
        [
            "X.5",
            "X=5",
            "X[1+2]",
            "X1e5",
            "X--1",
            "; c",
            "(",
            "S9",
            "M3",
            "X1 2",
            "K0",
            "(MSG,a)",
            "#1=3",
        ]
    ),
    st.sampled_from(
        [
            "G20",
            "G21",
            "G90.1",
            "G91.1",
            "G61",
            "G64",
            "G80",
            "G81 Z-5 R1",
            "G93",
            "G94",
            "G53",
            "G92 X1",
        ]
    ),
    st.sampled_from(
        [
            "G28",
            "G43 H1",
            "G49",
            "G54",
            "G55",
            "G10 L2 P1 X5",
            "G41 D1",
            "G40",
            "G99",
            "/",
            "%",
            "X#1",
        ]
    ),
)
LINE = st.builds(" ".join, st.lists(WORD, max_size=5))


@pytest.mark.ci
@FIXED
@given(st.lists(LINE, min_size=1, max_size=25))
@example(["X0.0 G02 G41 D1", "", "G18"])
def test_scanner_and_parser_agree(lines):
    """A program read by the scanner and the same program forced through the
    parser give the same rows and errors.
    """
    text = "F100 G0 X1\n" + "\n".join(lines)
    rows, errors = read(text)
    parsed, parser_errors = read(text, scan=False)
    assert errors == parser_errors
    assert rows.tobytes() == parsed.tobytes()


@pytest.mark.ci
@FIXED
@given(
    st.one_of(
        st.text(max_size=200),
        st.text("GXYZMNFIJKRPQLO#<>[]()=/%*+-. 0123456789\n", max_size=200),
    )
)
def test_any_text_is_read_or_refused(text):
    """No text makes the front end fail in another way than by a numbered error."""
    rows, errors = read(text.encode("utf-8", "replace").decode())
    assert rows.size == 0 or np.isfinite(rows["end"]).all()
    assert all(code and line for code, line, _ in errors)


def test_batches_of_any_size_give_the_same_rows(tmp_path):
    """Reading one row at a time loses and repeats nothing."""
    path = tmp_path / "p.ngc"
    path.write_text("G0 X1\nG81 X2 Z-5 R1 F9 L3 G91\nG80\nG1 X1\nM30\n")
    every = []
    for size in (1, 3, 100):
        reader = IsoFrontEnd(path, MACHINE, OfflinePort(MACHINE.start))
        every.append(
            np.concatenate(
                [batch.rows for batch in read_all(reader, size)]
            ).tobytes()
        )
    assert all(a == b for a, b in itertools.pairwise(every))
