"""Both look-ahead modes from the PLC process through the real handshake
(specification section 9, T1).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core import Cell
from support.command_line import T1, Outcome
from support.seeds import few

Cli = Callable[..., Outcome]
# idx: type, N, start, length, radius, angle, tangent
EXPECTED = [
    (3, 20, 0.0, 1.0, 0.0, 0.0, 0.0),
    (1, 30, 0.0, 300000.0, 0.0, 0.0, 0.0),
    (1, 40, 300000.0, 400000.0, 0.0, 0.0, 1.570796),
    (2, 50, 700000.0, 314159.265359, 200000.0, 1.570796, 0.0),
    (4, 60, 1014159.265359, 5.5, 0.0, 0.0, 0.0),
    (2, 70, 1014159.265359, 157079.632679, 100000.0, -1.570796, 0.0),
    (1, 80, 1171238.898038, 200000.0, 0.0, 0.0, 1.570796),
    (5, 90, 1371238.898038, 2.0, 0.0, 0.0, 0.0),
]


def as_rows(response: list[dict[str, Any]]) -> list[tuple[float, ...]]:
    """(type, N, start, length, radius, angle, tangent) of each element, rounded to 6 decimals."""
    for block in response:
        assert block["programmed_radius"] == pytest.approx(
            block["compensated_radius"], abs=1e-6
        )
    keys = (
        "block_type",
        "block_number",
        "start_position",
        "length",
        "compensated_radius",
        "circle_angle",
        "tangent_variation",
    )
    return [tuple(round(b[k], 6) for k in keys) for b in response]


@pytest.mark.ci_cases
@pytest.mark.parametrize("at", ["start", "end"])
def test_t1_by_index(cli: Cli, program: Callable[..., Path], at: str) -> None:
    """Index 0 gives all eight entries, before any motion and after the end alike."""
    answer = cli(
        "lookahead", program(T1), "--index", 0, "--at", at, "--json"
    ).json
    assert as_rows(answer["response"]) == EXPECTED
    assert answer["mode"] == 1
    assert answer["state"] == {
        "max_dist_prog_start": pytest.approx(1371238.898038, abs=1e-6),
        "count_logged_blocks": 8,
        "f_log_is_active": False,
    }


@pytest.mark.ci
@pytest.mark.parametrize(
    ("index", "first"), [(5, 5), (7, 7), (5.9, 5), (8, 8), (-1, 8), (1e300, 8)]
)
def test_t1_from_an_index_on(
    cli: Cli, program: Callable[..., Path], index: float, first: int
) -> None:
    """The answer runs from the truncated index to the end; an index outside the
    log gives nothing.
    """
    answer = cli("lookahead", program(T1), "--index", index, "--json").json
    assert as_rows(answer["response"]) == EXPECTED[first:]


@pytest.mark.ci_cases
@pytest.mark.parametrize("at", ["start", "end"])
@pytest.mark.parametrize(
    ("start", "length", "numbers"),
    [
        (800000, 400000, [50, 70, 80]),
        (1371238.9, 1, []),
        (0, 1e12, [30, 40, 50, 70, 80]),
        (300000, 1, [40]),
        (0, -5, []),
    ],
)
def test_t1_by_distance(
    cli: Cli,
    program: Callable[..., Path],
    at: str,
    start: float,
    length: float,
    numbers: list[int],
) -> None:
    """Mode 2 returns whole motion elements that touch [S, S+L), no markers."""
    answer = cli(
        "lookahead",
        program(T1),
        "--distance",
        start,
        length,
        "--at",
        at,
        "--json",
    ).json
    assert [b["block_number"] for b in answer["response"]] == numbers
    assert answer["mode"] == 2


@pytest.mark.parametrize(
    "request_",
    [
        ("--distance", "nan", "5"),
        ("--distance", "0", "inf"),
        ("--index", "nan"),
    ],
)
def test_nonsense_on_the_command_line_is_refused(
    cli: Cli, program: Callable[..., Path], request_: tuple[str, ...]
) -> None:
    """NaN and infinity are no positions."""
    answer = cli("lookahead", program(T1), *request_, "--json")
    assert answer.status == 1
    assert "900012" in answer.err


RAW = """
from plc_client import task
import math
NONSENSE = [(math.nan, 0.0), (0.0, math.nan), (math.inf, 0.0), (-math.inf, 5.0), (0.0, math.inf)]
NONSENSE += [(-1e308, 0.0), (1e308, 1e308), (0.0, -5.0), (5e-324, 5e-324)]

@task(interval=0.001)
class Raw:
    def setup(self, hli):
        self.unit, self.asked, self.answers = hli.gpCh[0].contour_lookahead, 0, []

    def cyclic(self):
        if self.unit.semaphor_rw:
            return
        if self.asked > len(self.answers):
            self.answers.append([self.unit.response.block[i].block_type for i in range(128)])
        if self.asked < len(NONSENSE):
            self.unit.request.start_position, self.unit.request.length = NONSENSE[self.asked]
            self.asked += 1
            self.unit.semaphor_rw = True

    def finished(self):
        return len(self.answers) == len(NONSENSE)

    def result(self):
        return self.answers
"""


def test_nonsense_in_the_request_is_answered_and_counted(
    cell: Cell, program: Callable[..., Path]
) -> None:
    """Numbers that are no positions get an answer without elements; the CNC
    counts them and goes on.
    """
    result = cell.run(program(T1), program(RAW, "raw.py"))
    assert result.end == "completed", result.errors
    assert [sum(a) for a in result.plc["result"]][:8] == [0] * 8
    assert result.plc["result"][8][1:] == [0] * 127
    assert result.requests["bad"] == 5


def contour(seed: int) -> tuple[str, list[dict[str, float]]]:
    """A random program of lines, arcs, markers and dwells, and its elements
    computed with complex numbers.
    """
    rng = np.random.default_rng(seed)
    lines, elements = (
        ["G17 G90 F6000 G1", "#CONTOUR LOOKAHEAD LOG ON [PARAM=7]"],
        [{"type": 3, "length": 7.0, "start": 0.0}],
    )
    at, heading, distance = 0j, None, 0.0
    for _ in range(int(rng.integers(5, 60))):
        kind = rng.choice(
            ["line", "arc", "param", "dwell"], p=[0.5, 0.35, 0.1, 0.05]
        )
        if kind == "param":
            value = round(float(rng.uniform(-9, 9)), 3)
            lines.append(f"#CONTOUR LOOKAHEAD LOG [PARAM={value}]")
            elements.append({"type": 4, "length": value, "start": distance})
            continue
        if kind == "dwell":
            lines.append("G04 X0.002")
            continue
        angle, radius = 0.0, 0.0
        if kind == "line":
            to = complex(
                round(at.real + rng.uniform(-9, 9), 4),
                round(at.imag + rng.uniform(-9, 9), 4),
            )
            lines.append(f"G1 X{to.real:.4f} Y{to.imag:.4f}")
            length, into, out_of = (
                abs(to - at),
                (to - at) / abs(to - at),
                (to - at) / abs(to - at),
            )
        else:
            centre = complex(
                round(float(rng.uniform(-8, 8)), 4),
                round(float(rng.uniform(-8, 8)), 4),
            )
            quarter, sign = int(rng.integers(1, 5)), int(rng.choice([-1, 1]))
            spoke = -centre
            to = at + centre + spoke * 1j ** (quarter * sign)
            code = "G3" if sign > 0 else "G2"
            end = "" if quarter == 4 else f" X{to.real:.4f} Y{to.imag:.4f}"
            lines.append(f"{code}{end} I{centre.real:.4f} J{centre.imag:.4f}")
            angle, radius = sign * quarter * math.pi / 2, abs(centre)
            length = radius * abs(angle)
            into = spoke / radius * 1j * sign
            out_of = into * 1j ** (quarter * sign)
        turn = 0.0 if heading is None else abs(np.angle(into / heading))
        elements.append(
            {
                "type": 1 if kind == "line" else 2,
                "length": length * 1e4,
                "start": distance,
                "radius": radius * 1e4,
                "angle": angle,
                "turn": turn,
            }
        )
        distance += length * 1e4
        at, heading = complex(round(to.real, 4), round(to.imag, 4)), out_of
    lines.append("#CONTOUR LOOKAHEAD LOG OFF [PARAM=3]")
    elements.append({"type": 5, "length": 3.0, "start": distance})
    return "\n".join([*lines, "M30", ""]), elements


@pytest.mark.ci
@pytest.mark.parametrize("seed", few(range(6), 2))
def test_random_contours_by_index_and_distance(
    cli: Cli, program: Callable[..., Path], seed: int
) -> None:
    """Random lines, arcs and markers: every fact agrees with an independent
    construction, in both modes.
    """
    text, expected = contour(seed)
    path = program(text)
    by_index = cli(
        "lookahead",
        path,
        "--index",
        0,
        "--at",
        ["start", "end"][seed % 2],
        "--json",
    ).json["response"]
    assert [b["block_type"] for b in by_index] == [e["type"] for e in expected]
    for block, element in zip(by_index, expected, strict=True):
        for key, name in (
            ("start_position", "start"),
            ("length", "length"),
            ("programmed_radius", "radius"),
        ):
            assert block[key] == pytest.approx(element.get(name, 0.0), abs=1e-3)
        assert block["circle_angle"] == pytest.approx(
            element.get("angle", 0.0), abs=1e-9
        )
        assert block["tangent_variation"] == pytest.approx(
            element.get("turn", 0.0), abs=1e-7
        )
    by_distance = cli(
        "lookahead",
        path,
        "--distance",
        0,
        1e12,
        "--at",
        ["end", "start"][seed % 2],
        "--json",
    ).json["response"]
    assert by_distance == [b for b in by_index if b["block_type"] in (1, 2)]


@pytest.mark.ci
def test_answers_longer_than_the_array_are_paged(
    cli: Cli, program: Callable[..., Path]
) -> None:
    """300 logged entries come back complete although one answer holds 128."""
    config = program(
        "[channel]\ncontour_lookahead_log_max = 1000\n", "cell.toml"
    )
    lines = [f"N{i} G1 X{i * 0.1:.1f}" for i in range(1, 299)]
    path = program(
        "\n".join(
            [
                "F6000",
                "#CONTOUR LOOKAHEAD LOG ON",
                *lines,
                "#CONTOUR LOOKAHEAD LOG OFF",
                "",
            ]
        )
    )
    by_index = cli(
        "lookahead", path, "--index", 0, "--config", config, "--json"
    ).json["response"]
    assert [b["block_number"] for b in by_index[1:-1]] == list(range(1, 299))
    by_distance = cli(
        "lookahead", path, "--distance", 0, 1e9, "--config", config, "--json"
    ).json["response"]
    assert [b["block_number"] for b in by_distance] == list(range(1, 299))
