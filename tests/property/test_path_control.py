"""Random programs under random control by the PLC: the path is never left,
limits hold, no function is lost.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from support.inside import Inside
from support.limits import FloatArray, legal
from support.seeds import few

pytestmark = pytest.mark.sanitize("engine")


CONFIG = "[channel.m_synch]\n" + "".join(
    f'{50 + i}="{t}"\n' for i, t in enumerate(("MOS", "MVS_SVS", "MNS_SNS"))
)


def _program(rng: np.random.Generator, loops: bool = False) -> str:
    lines, x, y = ["G1 F6000"], 0.0, 0.0
    for k in range(int(rng.integers(6, 18))):
        nx, ny = (float(v) for v in rng.uniform(0, 40, 2).round(3))
        kind = int(rng.integers(0, 8))
        if kind == 0:
            lines.append(f"N{k} M{int(rng.integers(50, 53))}")
        elif kind == 1:
            lines.append(f"N{k} G4 0.01")
        elif kind == 2 and loops:
            lines += [
                "#RT WHILE",
                f"G1 X{nx} Y{ny}",
                f"X{nx + 5} Y{ny}",
                f"X{x} Y{y}",
                "#RT ENDWHILE",
            ]
        elif kind == 3:
            radius = (
                float(np.hypot(nx - x, ny - y)) * float(rng.uniform(0.55, 2))
                + 0.01
            )
            lines.append(
                f"N{k} G{int(rng.integers(2, 4))} X{nx} Y{ny} R{radius:.4f}"
            )
            x, y = nx, ny
        elif kind == 4:
            lines.append(f"N{k} G1 X{nx} Y{ny} M{int(rng.integers(50, 53))}")
            x, y = nx, ny
        else:
            lines.append(
                f"N{k} G1 X{nx} Y{ny} F{int(rng.integers(1000, 9000))}"
            )
            x, y = nx, ny
    return "\n".join(lines) + "\n"


def _plain(folder: Path, text: str) -> FloatArray:
    """The path of an undisturbed run, densely sampled."""
    with Inside(folder, text, re.sub('"[A-Z_]+"', '"NO_SYNCH"', CONFIG)) as cnc:
        cnc.end()
        return np.vstack([np.zeros(3), cnc.pos])


def _distance(path: FloatArray, points: FloatArray) -> float:
    """Largest distance of the points from the polyline."""
    a, b = path[:-1], path[1:]
    d = b - a
    length2 = np.maximum((d * d).sum(axis=1), 1e-30)
    worst = 0.0
    for p in points:
        t = np.clip(((p - a) * d).sum(axis=1) / length2, 0.0, 1.0)
        worst = max(
            worst, float(np.linalg.norm(a + t[:, None] * d - p, axis=1).min())
        )
    return worst


class _Plc:
    """Fetches and acknowledges after random delays; notes the functions with
    the direction they came in.
    """

    def __init__(self, cnc: Inside, rng: np.random.Generator) -> None:
        self.cnc, self.rng = cnc, rng
        self.seen: list[tuple[int, bool]] = []
        self.open: dict[int, int] = {}

    def scan(self) -> None:
        for i, unit in enumerate(self.cnc.channel.techno_unit_std_sync):
            if unit.please_rw and self.rng.random() < 0.4:
                number = int.from_bytes(
                    bytes(unit.attribut_r.data[:4]), "little"
                )
                self.seen.append(
                    (number, bool(self.cnc.state.backward_active_r))
                )
                unit.please_rw = False
                self.open[i] = int(self.rng.integers(0, 20))
            elif i in self.open:
                self.open[i] -= 1
                if self.open[i] <= 0:
                    unit.done_w = True
                    del self.open[i]


def _drive(
    cnc: Inside,
    rng: np.random.Generator,
    commands: dict[str, float],
    cycles: int,
) -> _Plc:
    plc = _Plc(cnc, rng)
    units: dict[str, Any] = {
        "backward": cnc.bahn.backward_motion,
        "hold": cnc.bahn.feedhold,
        "loop": cnc.bahn.rt_loop_enable,
        "simulate": cnc.bahn.simulate_motion,
    }
    cnc.level(cnc.bahn.override_valid, True)
    for _ in range(cycles):
        for name, chance in commands.items():
            if rng.random() >= chance:
                continue
            if name == "override":
                cnc.level(
                    cnc.bahn.override, int(rng.choice([0, 300, 1000, 2000]))
                )
            else:
                cnc.level(units[name], bool(rng.random() < 0.5))
        plc.scan()
        cnc.run(1)
    for unit in units.values():
        cnc.level(unit, False)
    cnc.level(cnc.bahn.override, 1000)
    for _ in range(100_000):
        if cnc.state.program_end_r:
            return plc
        plc.scan()
        cnc.run(1)
    raise AssertionError(
        f"no end: stop {cnc.state.stop_condition_r:#x} at {cnc.state.dist_prog_start}"
    )


@pytest.mark.ci
@pytest.mark.parametrize("seed", few(range(12), 2))
def test_backward_and_forward_keep_to_the_contour(
    seed: int, tmp_path: Path
) -> None:
    """Backward, forward, feed hold and override at random moments: contour,
    limits and the end stay what they are.
    """
    rng = np.random.default_rng(seed)
    text = _program(rng)
    path = _plain(tmp_path, text)
    with Inside(tmp_path, text, CONFIG) as cnc:
        plc = _drive(
            cnc, rng, {"backward": 0.01, "hold": 0.004, "override": 0.004}, 2500
        )
        assert (
            _distance(path, cnc.pos[::3]) < 1e-3
        )  # the reference is a polyline of samples
        assert np.allclose(cnc.pos[-1], path[-1], atol=1e-9)
        assert cnc.engine.state.infeasible == 0
        legal(cnc.pos, cnc.cell)
        assert cnc.state.dist_prog_start == pytest.approx(
            cnc.clah.state.max_dist_prog_start, abs=1e-3
        )
        forward = [n for n, back in plc.seen if not back]
        assert len(forward) >= text.count("M5")


@pytest.mark.ci
@pytest.mark.parametrize("seed", few(range(12), 2))
def test_real_time_loops_in_both_directions(seed: int, tmp_path: Path) -> None:
    """Real-time loops switched on and off at random, with backward motion:
    contour, limits, distance at the end.
    """
    rng = np.random.default_rng(100 + seed)
    text = _program(rng, loops=True)
    path = _plain(tmp_path, re.sub("#RT .*\n", "", text))  # every loop once
    with Inside(tmp_path, text, CONFIG) as cnc:
        chances = {"loop": 0.01, "hold": 0.002, "override": 0.003} | (
            {"backward": 0.006} if seed % 2 else {}
        )
        _drive(cnc, rng, chances, 3000)
        assert _distance(path, cnc.pos[::3]) < 1e-3
        assert np.allclose(cnc.pos[-1], path[-1], atol=1e-9)
        assert cnc.engine.state.infeasible == 0
        legal(cnc.pos, cnc.cell)
