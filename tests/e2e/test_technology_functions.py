"""M, H and T functions by the two-flag protocol (hli_reference section 6):
order, count, waits, speed.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core import Cell
from cnc_core.config import SYNCH
from support.plc.technology import NeverFetches, Techno
from support.seeds import few

Write = Callable[..., Path]
TYPES = {
    50: "MOS",
    51: "MVS_SVS",
    52: "MVS_SNS",
    53: "MNS_SNS",
    54: "MVS_SLM",
    55: "MVS_SLP",
    56: "MEP_SVS",
    57: "MET_SVS",
    58: "NO_SYNCH",
}


def config(program: Write) -> Path:
    lines = [
        "[channel]",
        "[channel.m_synch]",
        *(f'{n} = "{name}"' for n, name in TYPES.items()),
    ]
    lines += [
        "[channel.h_synch]",
        '7 = "MVS_SVS"',
        "[channel.m_pre_outp]",
        "56 = 20000",
        "57 = 30000",
    ]
    return program("\n".join(lines) + "\n", "cell.toml")


def expected_order(functions: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Within one block: what goes out before the motion, then the MNS types."""
    out = []
    for block in sorted({n for _, n in functions}):
        mine = [
            f
            for f in functions
            if f[1] == block and TYPES.get(f[0], "MVS_SVS") != "NO_SYNCH"
        ]
        out += [f for f in mine if TYPES.get(f[0]) != "MNS_SNS"] + [
            f for f in mine if TYPES.get(f[0]) == "MNS_SNS"
        ]
    return out


@pytest.mark.parametrize("seed", few(range(4), 1))
@pytest.mark.ci
def test_no_function_is_lost_doubled_or_out_of_order(
    program: Write, tmp_path: Path, seed: int
) -> None:
    """30 % functions of random types against a PLC that answers late and in any
    order: each exactly once, in order.
    """
    rng = np.random.default_rng(seed)
    lines, functions = ["F6000 G1 G90"], []
    for n in range(1, 201):
        words = [
            f"N{n}",
            f"X{n * 0.5:.1f} Y{rng.integers(0, 3)}"
            if rng.random() < 0.9
            else "",
        ]
        count = int(rng.integers(1, 4)) if rng.random() < 0.3 else 0
        for number in map(int, rng.choice(list(TYPES), count, replace=False)):
            words.append(f"M{number}")
            functions.append((number, n))
        if rng.random() < 0.05:
            words.append("H7")
            functions.append((7, n))
        lines.append(" ".join(words))
        if rng.random() < 0.1:
            lines.append("#EXPL SYN")
    path = program("\n".join([*lines, "M30", ""]))
    runs = []
    for i in range(2):
        record = tmp_path / f"{i}.npz"
        with Cell(config(program)) as cell:
            result = cell.run(path, Techno, record=record)
        assert result.end == "completed", result.errors
        runs.append((result.plc["result"], np.load(record)["pos"]))
    seen = [(number, block) for number, block, *_ in runs[0][0]]
    late = {54, 55}
    wanted = expected_order(
        [f for f in functions if TYPES.get(f[0]) != "NO_SYNCH"]
    )
    by_block = sorted(seen, key=lambda f: f[1])
    assert sorted(by_block) == sorted(wanted)
    blocks = [block for n, block in seen if n not in late]
    assert blocks == sorted(blocks)
    assert runs[0][0] == runs[1][0]
    assert (runs[0][1] == runs[1][1]).all()
    accel = np.abs(np.diff(runs[0][1], n=2, axis=0)).max() / 1e-6
    assert accel <= 3000.0 * 1.02


def by_number(seen: list[list[float]]) -> dict[int, list[float]]:
    return {int(row[0]): row for row in seen}


@pytest.mark.ci
def test_where_each_type_is_put_out(program: Write) -> None:
    """Distance and speed at which the PLC fetched each type; payload holds
    number, block and type.
    """
    text = (
        "F6000 G1\n"
        + "".join(
            f"N{i} X{i * 20} M{number}\n" for i, number in enumerate(TYPES, 1)
        )
        + "#EXPL SYN\nM30\n"
    )
    with Cell(config(program)) as cell:
        result = cell.run(program(text), Techno)
    seen = by_number(result.plc["result"])
    assert result.end == "completed", result.errors
    for i, (number, name) in enumerate(TYPES.items(), 1):
        if name == "NO_SYNCH":
            assert number not in seen
            continue
        _, block, synch, distance, speed, array, _ = seen[number]
        assert (block, synch) == (i, SYNCH[name])
        assert array == ("lat" if name in ("MVS_SLM", "MVS_SLP") else "std")
        start, end = (i - 1) * 200_000.0, i * 200_000.0
        if name == "MVS_SVS":
            assert (distance, speed) == (pytest.approx(start), 0)
        elif name == "MNS_SNS":
            assert (distance, speed) == (pytest.approx(end), 0)
        elif name == "MEP_SVS":
            assert start - 25_000.0 <= distance <= start
        elif name == "MET_SVS":
            assert start - 40_000.0 <= distance <= start
        else:
            assert start <= distance <= start + 30_000.0


@pytest.mark.ci
def test_an_acknowledgement_in_time_costs_no_speed(
    program: Write, tmp_path: Path
) -> None:
    """MVS_SNS and MOS on long blocks are passed at full speed when the PLC answers at once."""
    record = tmp_path / "r.npz"
    with Cell(config(program)) as cell:
        result = cell.run(
            program("F6000 G1\nX50 M52\nX100 M50\nX150 M52\nX200\nM30\n"),
            record=record,
        )
    assert result.end == "completed", result.errors
    with np.load(record) as columns:
        inside = (columns["s"] > 6.0) & (columns["s"] < 194.0)
        assert columns["v"][inside].min() == pytest.approx(100.0, rel=1e-4)


def test_a_plc_that_never_fetches_stalls_the_cnc(program: Write) -> None:
    """MOS must be fetched: the second function waits with
    wait_techno_acknowledge_r and stop condition 6.
    """
    with Cell(config(program)) as cell:
        result = cell.run(
            program("F6000 G1\nX1 M50\nX2 M50\nX3\nM30\n"), NeverFetches
        )
    assert result.end == "completed", result.errors
    assert result.plc["result"] > 200


def test_functions_without_a_present_plc_count_as_acknowledged(
    program: Write,
) -> None:
    """plc_present_w FALSE: no output, one warning."""
    plc = program(
        "from plc_client import task\n@task(interval=0.001)\nclass P:\n"
        "    def setup(self, hli):\n        self.ch = hli.gpCh[0]\n"
        "    def cyclic(self):\n        self.ch.head.plc_present_w = False\n",
        "absent.py",
    )
    with Cell(config(program)) as cell:
        result = cell.run(program("F600 G1\nX1\nX2 M51\nX3 M51\nM30\n"), plc)
    assert result.end == "completed", result.errors
    assert len([w for w in result.warnings if "plc_present_w" in w]) == 1
