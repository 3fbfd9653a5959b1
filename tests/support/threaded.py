"""Planner, GEO and service as threads, or switched as if they were, while a PLC
commands at random: what the tests of the threads, ``bench/stress.py`` and
``bench/interleaved.py --threads`` drive.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from cnc_core.engine import Event
from support.inside import Inside

PROGRAM = """N10 #CONTOUR LOOKAHEAD LOG ON [PARAM=1]
N20 G01 X30 Y0 F6000
N25 M20
N30 X30 Y40
N40 #CONTOUR LOOKAHEAD LOG OFF [PARAM=2]
N50 #RT WHILE
N60 G01 X31 F8000
N70 X30
N80 #RT ENDWHILE
""" + "".join(
    f"N{100 + k} G01 X{30 + k % 7} Y{40 + (k * k) % 11} F8000\n"
    for k in range(3000)
)
FUNCTIONS = "FCT_IPO_DEFAULT | FCT_CONTOUR_LAH"
FORESIGHT = (
    f"{FUNCTIONS} | FCT_CALC_TIME | FCT_CALC_POS_V_0 | FCT_CALC_STATE_AT_T"
)
CONFIG = (
    '[channel]\ninterpolator_function = "%s"\nesa_time = [0.05]\n'
    '[channel.m_synch]\n20 = "MVS_SVS"\n'
)
FAR_MM, TURNS = 50.0, 50
LATE_S = 60.0
"""How much longer than said a busy machine may take for some motion."""


def drive(
    cnc: Inside, rng: np.random.Generator, seconds: float, first: int = 0
) -> bool:
    """Commands beside the threads for so long, and until the path has moved under
    them; whether GEO's thread has a deadline.  Behind it the threads are stopped,
    and all samples taken.  ``first``: the number of the first command.
    """
    cnc.engine.serve_start()
    fifo = cnc.engine.start()
    end, turn = time.monotonic() + seconds, first
    while time.monotonic() < end or (
        not far_enough(cnc, turn - first) and time.monotonic() < end + LATE_S
    ):
        event = cnc.engine.wait(0.005)
        if event is Event.NEED_BLOCKS:
            cnc.preparation.pump()
        elif event is Event.DRAINED:
            cnc.preparation.drained()
        cnc._take()
        command(cnc, turn, rng)
        turn += 1
    cnc.engine.stop()
    cnc.engine.serve_stop()
    cnc._take()
    return fifo


def drive_in_turns(
    cnc: Inside,
    rng: np.random.Generator,
    cycles: Callable[[int, int], Event],
    turns: int = 400,
) -> None:
    """The same commands, each behind a few cycles; all samples are taken.

    ``cycles(n, part)`` runs n cycles and says how they ended; each part has
    another number.
    """
    first, most = int(rng.integers(0, 60)), int(rng.integers(2, 30))
    for turn in range(first, first + turns):
        n = int(rng.integers(1, most + 1))
        for part in range(50):
            if not cnc.prepare(cycles(n, turn * 51 + part)):
                break
        cnc._take()
        command(cnc, turn, rng)


def far_enough(cnc: Inside, turn: int) -> bool:
    """Commands and motion have met each other; by what was recorded, since the
    threads own the engine's state.
    """
    driven = [path[-1] for path in cnc.paths if len(path)]
    return bool(turn > TURNS and driven and driven[-1] > FAR_MM)


def command(cnc: Inside, turn: int, rng: np.random.Generator) -> None:
    """One of the PLC's commands by turns, and a request."""
    bahn, insert = cnc.bahn, cnc.bahn.insert_cmd
    cnc.level(bahn.override_valid, True)
    cnc.level(bahn.override, int(rng.integers(200, 1500)))
    cnc.level(bahn.backward_motion, turn % 40 > 30)
    cnc.level(bahn.feedhold, turn % 17 == 0)
    cnc.level(bahn.delete_distance_to_go, turn % 50 == 25)
    cnc.level(bahn.continue_machining, turn % 3 == 0)
    cnc.level(bahn.single_block, turn % 60 == 10)
    cnc.level(bahn.rt_loop_enable, turn < 30)
    if turn % 20 == 5 and not insert.command_semaphor_rw:
        insert.enable_w = True
        insert.command_w.dist_or_pos, insert.command_w.rel_abs_mode = 5e4, 2
        insert.command_semaphor_rw = True
    for unit in cnc.channel.techno_unit_std_sync[:4]:
        if unit.please_rw:
            unit.done_w, unit.please_rw = True, False
    if not cnc.clah.semaphor_rw:
        cnc.clah.request.start_position = float(rng.integers(0, 300_000))
        cnc.clah.request.length = float(rng.integers(0, 2) * 50_000)
        cnc.clah.semaphor_rw = True
