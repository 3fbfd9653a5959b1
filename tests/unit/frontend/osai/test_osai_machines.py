"""Five-axis profiles on machines of every MAC type, through the whole program,
against a product of matrices.
"""

import numpy as np
import pytest

from cnc_core.config import parse_config
from cnc_core.planning import plan_program
from support.osai_programs import Workshop

ROTARY = "kind = 'rotary'\nv_max_mm_s = 400.0\na_max_mm_s2 = 4000.0\nj_max_mm_s3 = 80000.0\n"
CELL = parse_config(
    f"[axes.X]\nid=1\n[axes.Y]\nid=2\n[axes.Z]\nid=3\n[axes.A]\nid=4\n"
    f"{ROTARY}[axes.C]\nid=5\n{ROTARY}"
)
CHAINS = {  # from the part to the tool (specification 9.3), and a bed
    "WRK": ("WRK TOL LI1 LI2 LI3", "WRK"),
    "MIX": ("WRK LI1 LI2 LI3 TOL", "B12"),
    "TOL": ("LI1 LI2 LI3 WRK TOL", "B23"),
    "WC1": ("WRK LI1 TOL LI2 LI3", "BC1"),
    "WC2": ("WRK LI1 LI2 TOL LI3", "BC2"),
    "TC1": ("LI1 WRK LI2 LI3 TOL", "BC1"),
    "TC2": ("LI1 LI2 WRK LI3 TOL", "TOL"),
    "C12": ("LI1 WRK LI2 TOL LI3", "B23"),
}
CUTS = {
    "WRK": ("LI1", 0),
    "B12": ("LI1", 1),
    "BC1": ("LI2", 0),
    "B23": ("LI2", 1),
    "BC2": ("LI3", 0),
    "TOL": ("LI3", 1),
}
AXIS = {
    "X": (0, 90, 0),
    "Y": (-90, 0, 0),
    "Z": (0, 0, 0),
    "A": (0, 90, 0),
    "C": (0, 0, 0),
}  # turns +Z to the axis
LENGTH = 50.0


def turned(angles):
    """Rx Ry Rz of degrees, 4 x 4."""
    out = np.eye(4)
    for (i, k), angle in zip(
        ((1, 2), (2, 0), (0, 1)), np.radians(angles), strict=True
    ):
        one = np.eye(4)
        one[i, i] = one[k, k] = np.cos(angle)
        one[k, i], one[i, k] = np.sin(angle), -np.sin(angle)
        out = out @ one
    return out


def moved(by):
    out = np.eye(4)
    out[:3, 3] = by
    return out


def angles_of(turn):
    """Angles whose Rx Ry Rz is ``turn``."""
    b = np.arcsin(np.clip(turn[0, 2], -1, 1))
    if abs(turn[0, 2]) > 1 - 1e-12:
        return np.degrees(
            [np.arctan2(turn[1, 0], turn[1, 1]) * np.sign(turn[0, 2]), b, 0.0]
        )
    return np.degrees(
        [
            np.arctan2(-turn[1, 2], turn[2, 2]),
            b,
            np.arctan2(-turn[0, 1], turn[0, 0]),
        ]
    )


class Machine:
    """Axes in the order of a chain, steps from frame to frame with random
    offsets; X, Y, Z, A about X, C about Z.
    """

    def __init__(self, kind, seed):
        rng, (chain, self.bed) = np.random.default_rng(seed), CHAINS[kind]
        self.places = dict(
            zip(
                ("LI1", "LI2", "LI3"), rng.permutation(list("XYZ")), strict=True
            )
        ) | {
            "WRK": "C",
            "TOL": "A",
        }
        order, (place, behind) = chain.split(), CUTS[self.bed]
        cut = order.index(place) + behind
        self.part, self.tool = (
            [*(self.places[e] for e in order[:cut][::-1]), "w"],
            [*(self.places[e] for e in order[cut:]), "t"],
        )
        self.steps = {}
        for names in (self.part, self.tool):
            before = np.eye(4)
            for name in names:
                wanted = turned(AXIS[name]) if name in AXIS else np.eye(4)
                offset = (
                    rng.uniform(-30, 30, 3) if name in "ACt" else np.zeros(3)
                )
                self.steps[name] = offset, angles_of(before.T @ wanted)
                before = wanted

    def pose(self, q):
        """Tip and direction in the part's frame."""
        ends = []
        for names in (self.part, self.tool):
            frame = np.eye(4)
            for name in names:
                offset, angles = self.steps[name]
                frame = frame @ moved(offset) @ turned(angles)
                frame = frame @ (
                    moved((0, 0, q[name]))
                    if name in "XYZ"
                    else turned((0, 0, q.get(name, 0.0)))
                )
            ends.append(frame)
        frame = np.linalg.inv(ends[0]) @ ends[1]
        return (frame @ [0, 0, -LENGTH, 1])[:3], frame[:3, 2]

    def setup(self, kind):
        place = {axis: place for place, axis in self.places.items()}
        lines = [
            "(PNT,CLP,CLP,QUI)",
            "(VER,PRG,REL,REL)",
            "(THR,0.01,0.001,0,0,0.02)",
            f"(TOL,{LENGTH},5,1,-90,0)",
        ]
        roles = zip("XYZAC", ("ABS", "ORD", "VRT", "OTH", "OTH"), strict=True)
        lines += [f"(MAC,{kind},{self.bed})"]
        lines += [
            f"(AXI,{name},{i},{role},{place[name]})"
            for i, (name, role) in enumerate(roles, 1)
        ]
        for name, (offset, angles) in self.steps.items():
            lines.append(
                f"(CIN,{name},"
                + ",".join(f"{v:.12f}" for v in (*offset, *angles))
                + ")"
            )
        return "\n".join(lines) + "\n"


@pytest.mark.ci_cases
@pytest.mark.parametrize("kind", CHAINS)
def test_a_profile_on_every_type_of_machine(tmp_path, kind):
    """Tips and directions of known poses: the axes go there, tips stay on the way, limits hold."""
    shop, machine = Workshop(tmp_path), Machine(kind, sum(map(ord, kind)))
    first, last = (
        np.array([10, 20, 30, 25, 35.0]),
        np.array([15, 18, 33, 28, 39.0]),
    )
    poses = [
        dict(zip("XYZAC", first + u * (last - first), strict=True))
        for u in np.linspace(0, 1, 5)
    ]
    points = [np.concatenate(machine.pose(q)) for q in poses]
    words = [
        "".join(f"{n}{v:.9f}" for n, v in zip("XYZijk", p, strict=True))
        for p in points
    ]
    body = "\n".join([f"{words[0]}F2000", *words[1:]])
    text = f"G0X10Y20Z30A25C35\n(HSM,CONFIG1)\nG61\n{body}\nG60\n"
    result = plan_program(
        shop.program(text, machine.setup(kind), cell=CELL, programmed=False),
        keep_samples=True,
    )
    axes = result.samples["pos"]
    assert axes[-1] == pytest.approx(last, abs=1e-5)
    driven = np.array(
        [machine.pose(dict(zip("XYZAC", q, strict=True)))[0] for q in axes[::5]]
    )
    for point in points:
        chords = np.diff(driven, axis=0)
        t = ((point[:3] - driven[:-1]) * chords).sum(axis=1) / np.maximum(
            (chords**2).sum(axis=1), 1e-18
        )
        off = np.linalg.norm(
            point[:3] - driven[:-1] - np.clip(t, 0, 1)[:, None] * chords, axis=1
        ).min()
        assert off <= 0.01
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02
    shop.close()
