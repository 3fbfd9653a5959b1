"""Random stacks of coordinate systems against products of scipy rotations,
random five-axis programs against points.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cnc_core.blocks import ELEMENT, PIECE, blocks
from cnc_core.blocks.pool import coefficients
from cnc_core.config import CellConfig, load_config, parse_config
from cnc_core.kinematics.machine_types import CHAINS
from cnc_core.program import Program
from support.paths import FIVE_AXIS
from support.seeds import few


def matrix(values: np.ndarray) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3] = Rotation.from_euler(
        "ZYX", values[:2:-1], degrees=True
    ).as_matrix()
    out[:3, 3] = values[:3]
    return out


@pytest.mark.parametrize("seed", few(range(10), 2))
def test_random_stacks_of_frames(tmp_path, seed):
    """#CS and #ACS with offsets and contour rotation, switched in any order:
    every end is the matrices' product.
    """
    rng = np.random.default_rng(seed)
    acs, stack, lines, expected = [], [], [], []
    rotation, g92 = None, np.zeros(3)
    for _ in range(40):
        action = rng.integers(8)
        values = np.r_[
            rng.uniform(-50, 50, 3), rng.uniform(-180, 180, 3)
        ].round(3)
        text = ",".join(f"{v:.3f}" for v in values)
        if action == 0 and len(stack) < 4:
            lines.append(f"#CS ON [{text}]")
            stack.append((g92.copy(), matrix(values)))
            g92 = np.zeros(3)
        elif action == 1 and len(acs) < 2:
            lines.append(f"#ACS ON [{text}]")
            acs.append(matrix(values))
        elif action == 2 and stack:
            lines.append("#CS OFF")
            g92 = stack.pop()[0]
        elif action == 3 and acs:
            lines.append("#ACS OFF")
            acs.pop()
        elif action == 4:
            lines.append(
                f"G92 X{values[0]:.3f} Y{values[1]:.3f} Z{values[2]:.3f}"
            )
            g92 = values[:3]
        elif action == 5:
            rotation = None if rotation is not None else values[[3, 0, 1]]
            words = (
                "OFF"
                if rotation is None
                else "ON [ANGLE={:.3f} CENTER1={:.3f} CENTER2={:.3f}]".format(
                    *rotation
                )
            )
            lines.append(f"#ROTATION {words}")
        p = rng.uniform(-100, 100, 3).round(3)
        lines.append("G00 X{:.3f} Y{:.3f} Z{:.3f}".format(*p))
        if rotation is not None:
            centre = np.array([rotation[1], rotation[2], 0.0])
            p = centre + Rotation.from_euler(
                "z", rotation[0], degrees=True
            ).apply(p - centre)
        q = np.array([*(p + g92), 1.0])
        for shift, frame in reversed(stack):
            q = frame @ q
            q[:3] += shift
        for frame in reversed(acs):
            q = frame @ q
        expected.append(q[:3])
    path = tmp_path / "a.nc"
    path.write_text("\n".join(lines))
    program = Program(path, CellConfig(), "isg")
    rows = np.concatenate([b.rows for b in program.batches()])
    assert np.abs(rows["end"][:, :3] - np.array(expected)).max() < 1e-9


@pytest.mark.ci
@pytest.mark.parametrize("name", ["table_table", "head_table", "head_head"])
@pytest.mark.parametrize("seed", few(range(2), 1))
def test_random_five_axis_programs(tmp_path, name, seed):
    """Every piece stays within 0.1 um of its programmed line or helix, wherever one looks."""
    rng = np.random.default_rng([seed, len(name)])
    cell = load_config(FIVE_AXIS / f"{name}.toml")
    tilt, last = "A" if name == "table_table" else "B", (0.0, 0.0)
    lines = ["T1 D1", "#TRAFO ON", "G00 X0 Y0 Z90", "F3000"]
    if seed % 2:
        lines.append("#CS ON [5,5,5,10,20,30]")
    for _ in range(25):
        x, y = rng.uniform(-60, 60, 2)
        z, a, c = (
            rng.uniform(60, 110),
            rng.uniform(-25, 60),
            last[1] + rng.uniform(-200, 200),
        )
        last = (a, float(np.clip(c, -350, 350)))
        kind = rng.integers(3)
        words = f"X{x:.4f} Y{y:.4f} Z{z:.4f}"
        words = (
            f"G0{rng.integers(2, 4)} {words} R{rng.uniform(90, 150):.4f}"
            if kind == 2
            else f"G0{kind} {words}"
        )
        if rng.integers(4):
            words += f" {tilt}{last[0]:.3f} C{last[1]:.3f}"
        lines.append(words)
    path = tmp_path / "a.nc"
    path.write_text("\n".join(lines))
    check_pieces(path, cell, 80.0)


@pytest.mark.ci
@pytest.mark.parametrize("kind", CHAINS)
def test_every_chain_through_the_stage(tmp_path, kind):
    """The same on all eight chains, with pivots and part anywhere and a bed of any kind."""
    rng = np.random.default_rng([7, *map(ord, kind)])
    rotary = ["A", "B"] if kind in ("TC1", "C12") else ["C", "B"]
    beds = ["WRK", "B12", "B23", "TOL"] + (
        [] if kind in ("WRK", "MIX", "TOL") else ["BC1", "BC2"]
    )
    axes = "".join(
        f"[axes.{a}]\n" + ("kind='rotary'\n" if a in "ABC" else "")
        for a in ["X", "Y", "Z", *rotary]
    )
    p = rng.uniform(-200, 200, (4, 3)).round(3).tolist()
    text = (
        f"{axes}[tools.1]\nlength_mm=80.0\n[kinematics.9]\ntype='{kind}'\n"
        f"bed='{rng.choice(beds)}'\n"
    )
    text += (
        f"rotary={rotary}\n"
        f"points={{{rotary[0]}={p[0]},{rotary[1]}={p[1]}}}\npart={p[2]}\n"
        f"spindle={p[3]}\n"
    )
    lines = [
        "T1 D1",
        "#TRAFO ON",
        "G00 X0 Y0 Z90",
        "F3000",
        "#CS ON [5,5,5,10,20,30]",
    ]
    for _ in range(12):
        x, y, z, a, c = (rng.uniform(-1, 1, 5) * [60, 60, 40, 40, 40]).round(4)
        arc = rng.integers(2)
        lines.append(
            f"G0{3 if arc else 1} X{x} Y{y} Z{z} {rotary[0]}{c} {rotary[1]}{a}"
            + (" R150" if arc else "")
        )
    path = tmp_path / "a.nc"
    path.write_text("\n".join(lines))
    check_pieces(path, parse_config(text), 80.0)


def check_pieces(path: Path, cell: CellConfig, length: float) -> None:
    """Any point of any piece lies within 0.1 um of the programmed path of its line."""
    wanted = programmed(path, cell)
    kin = cell.kinematic_machines[9]
    batches = list(Program(path, cell, "isg").batches())
    position, checked = cell.axis_values("start_mm"), 0
    for batch in batches:
        rows = batch.rows
        for row in rows[(rows["type"] <= 3) & (rows["flags"] & ELEMENT == 0)]:
            if row["flags"] & PIECE:
                w = np.linspace(0, 1, 21)
                if row["type"] == 3:
                    coef = coefficients(np.array([row]), batch.pool, 5)[0]
                    q = (
                        (
                            coef[:, :, None]
                            * (w * row["angle"]) ** np.arange(6)[:, None]
                        )
                        .sum(axis=1)
                        .T
                    )
                else:
                    q = position + w[:, None] * (row["end"][:5] - position)
                tip = kin.forward(q, length).tip
                assert distance(tip, wanted[int(row["line"])]).max() < 1e-4
                checked += 1
            position = row["end"][:5].copy()
    assert checked > 20


def programmed(path: Path, cell: CellConfig) -> dict[int, np.ndarray]:
    """Dense points of the tip's path by line, from the blocks ahead of the kinematics."""
    out: dict[int, list[np.ndarray]] = {}
    start = cell.axis_values("start_mm")
    for batch in Program(path, cell, "isg", programmed=True).batches():
        for block in blocks(batch, start, cell.axis_names, cell.main_axes):
            value = block.as_json()
            if "end" not in value:
                continue
            a, b = (
                np.array([value[k][axis] for axis in "XYZ"])
                for k in ("start", "end")
            )
            w = np.linspace(0, 1, 4001)[:, None]
            points = a + w * (b - a)
            if value["type"] == "circular":
                c = np.array([value["center"]["X"], value["center"]["Y"]])
                angle = (
                    np.arctan2(*(a[:2] - c)[::-1]) + w[:, 0] * value["angle"]
                )
                points[:, :2] = c + value["radius"] * np.column_stack(
                    [np.cos(angle), np.sin(angle)]
                )
            if value["type"] == "polynomial":
                s = w[:, 0] * value["s"]
                points = np.column_stack(
                    [
                        np.polynomial.polynomial.polyval(s, value["coeff"][x])
                        for x in "XYZ"
                    ]
                )
            out.setdefault(value["line"], []).append(points)
    return {line: np.vstack(parts) for line, parts in out.items()}


def distance(points: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Of points from a dense polyline."""
    out = []
    for p in points:
        i = int(np.argmin(((path - p) ** 2).sum(axis=1)))
        best = np.inf
        for a, b in (
            (path[max(i - 1, 0)], path[i]),
            (path[i], path[min(i + 1, len(path) - 1)]),
        ):
            d = b - a
            t = np.clip((p - a) @ d / max(d @ d, 1e-30), 0, 1)
            best = min(best, float(np.linalg.norm(p - a - t * d)))
        out.append(best)
    return np.array(out)
