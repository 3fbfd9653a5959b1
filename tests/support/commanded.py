"""A program and a PLC that are both random: every command of the HLI that
touches the path, in any order.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cnc_core.engine import Event
from cnc_core.errors import CncError
from support.inside import FloatArray, Inside

CYCLES = 3500
RELEASED = 3000  # from this cycle on nothing holds the path any more
LEVELS = (
    # name, probability per turn that it comes, that it goes
    ("feedhold", 0.04, 0.3),
    ("backward_motion", 0.03, 0.1),
    ("single_block", 0.02, 0.2),
    ("delete_distance_to_go", 0.02, 0.5),
    ("rt_loop_enable", 0.05, 0.05),
)
NO_JERK = "".join(f"[axes.{name}]\nj_max_mm_s3 = 0.0\n" for name in "XYZ")
FORESIGHT = " | FCT_CALC_TIME | FCT_CALC_POS_V_0 | FCT_CALC_STATE_AT_T"


def program(rng: np.random.Generator) -> str:
    """800 blocks: lines and arcs of 0.05 to 9 mm, M functions that are waited
    for, dwells, real-time loops, M01.
    """
    kind = rng.integers(0, 4)
    lines = ["N10 #CONTOUR LOOKAHEAD LOG ON [PARAM=1]", "N20 G01 X30 Y0 F6000"]
    x, y = 30.0, 0.0
    for _ in range(800):
        r = rng.random()
        if r < 0.02:
            lines.append(f"M{rng.choice([20, 21])}")
        elif r < 0.03:
            lines.append("G04 X0.05")
        elif r < 0.035:
            lines += [
                "#RT WHILE",
                f"G01 X{x + 1:.4f} F8000",
                f"X{x:.4f}",
                "#RT ENDWHILE",
            ]
        elif r < 0.04:
            lines.append("M01")
        else:
            step = float(rng.choice([0.05, 0.3, 2, 9]))
            to_x, to_y = x + rng.normal() * step, y + rng.normal() * step
            way = float(np.hypot(to_x - x, to_y - y))
            if way < 0.02:
                continue
            feed = int(rng.choice([500, 3000, 8000]))
            if kind == 1 or (kind == 3 and rng.random() < 0.5):
                word, radius = (
                    rng.choice(["G02", "G03"]),
                    way * rng.uniform(0.6, 5),
                )
                lines.append(
                    f"{word} X{to_x:.4f} Y{to_y:.4f} R{radius:.4f} F{feed}"
                )
            else:
                word = "G00" if rng.random() < 0.05 else "G01"
                lines.append(
                    f"{word} X{to_x:.4f} Y{to_y:.4f} Z{rng.normal() * step:.3f} F{feed}"
                )
            x, y = round(to_x, 4), round(to_y, 4)
    return "\n".join(lines) + "\n"


def config(rng: np.random.Generator, options: str) -> str:
    """Cell configuration; options: n no jerk limit, c another cycle than 1 ms,
    f the functions that look ahead.
    """
    text = NO_JERK if "n" in options else ""
    if "c" in options:
        text = f"cycle_s = {rng.choice([5e-4, 2e-3, 4e-3]):g}\n" + text
    functions = "FCT_IPO_DEFAULT | FCT_CONTOUR_LAH" + (
        FORESIGHT if "f" in options else ""
    )
    text += (
        f'[channel]\ninterpolator_function = "{functions}"\nesa_time = [0.05]\n'
    )
    return text + '[channel.m_synch]\n20 = "MVS_SVS"\n21 = "MNS_SNS"\n'


class RandomPlc:
    """Commands at random; from ``RELEASED`` on it lets the path go."""

    def __init__(self, cnc: Inside, rng: np.random.Generator) -> None:
        self.cnc, self.rng, self.turn = cnc, rng, 0
        self.on = dict.fromkeys((name for name, _, _ in LEVELS), False)

    def command(self, released: bool) -> None:
        """What a scan writes."""
        cnc, rng, bahn = self.cnc, self.rng, self.cnc.bahn
        for name, comes, goes in LEVELS:
            change = not released and (
                rng.random() > goes if self.on[name] else rng.random() < comes
            )
            self.on[name] = change
            cnc.level(getattr(bahn, name), change)
        cnc.level(bahn.override_valid, True)
        shares = [0, 100, 500, 1000, 1500]
        cnc.level(
            bahn.override,
            1000
            if released
            else int(rng.choice(shares, p=[0.05, 0.15, 0.3, 0.3, 0.2])),
        )
        cnc.level(bahn.continue_machining, self.turn % 2 == 0)
        insert = bahn.insert_cmd
        if (
            not released
            and rng.random() < 0.05
            and not insert.command_semaphor_rw
        ):
            insert.enable_w = True
            insert.command_w.dist_or_pos = float(
                rng.choice([1e3, 2e4, 5e4, 2e5])
            )
            insert.command_w.rel_abs_mode = int(
                rng.choice([0, 1, 2], p=[0.1, 0.3, 0.6])
            )
            insert.command_semaphor_rw = True
        for unit in cnc.channel.techno_unit_std_sync[:8]:
            if unit.please_rw and rng.random() < 0.5:
                unit.done_w, unit.please_rw = True, False
        if not cnc.clah.semaphor_rw:
            cnc.clah.request.start_position = float(rng.integers(0, 300_000))
            cnc.clah.request.length = float(rng.integers(0, 2) * 50_000)
            cnc.clah.semaphor_rw = True
        self.turn += 1


def drive(
    cnc: Inside, rng: np.random.Generator, cycles: Callable[[int, int], Event]
) -> tuple[FloatArray, float]:
    """Positions (n, axes) in mm at the cycle, and mm of path driven since the
    commands have ended (inf: program end).

    ``cycles(n, turn)`` runs up to n cycles.
    """
    plc, released_at = RandomPlc(cnc, rng), None
    while (
        cycle := int(cnc.engine.state.cycle)
    ) < CYCLES and not cnc.engine.state.program_end:
        cnc.prepare(cycles(int(rng.integers(1, 8)), plc.turn))
        cnc._take()
        plc.command(cycle > RELEASED)
        if cycle > RELEASED and released_at is None:
            released_at = float(cnc.engine.state.path)
    cnc._take()
    error: CncError | None = cnc.preparation.error
    assert error is None, error
    state = cnc.engine.state
    assert not state.fault
    way = (
        np.inf
        if state.program_end or released_at is None
        else abs(float(state.path) - released_at)
    )
    return cnc.pos, way
