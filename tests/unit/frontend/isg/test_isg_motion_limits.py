"""Limits that a program sets for its motions: weights, #VECTOR LIMIT,
#OVERRIDE, #SLOPE, #HSC; closed formulas.
"""

from functools import partial

import numpy as np
import pytest

from cnc_core.blocks import DYNAMICS, POLYNOMIAL, SMOOTHING
from cnc_core.blocks.pool import joined
from cnc_core.config import load_config
from cnc_core.engine import Engine, Event
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.programs import ended_program, planned

CELL = """
[axes.X]
v_max_mm_s = 300.0
a_max_mm_s2 = 3000.0
j_max_mm_s3 = 0.0
[axes.Y]
v_max_mm_s = 300.0
a_max_mm_s2 = 3000.0
j_max_mm_s3 = 0.0
[axes.Z]
v_max_mm_s = 300.0
a_max_mm_s2 = 3000.0
j_max_mm_s3 = 0.0
"""
USABLE = 0.999  # share of the acceleration that the planner plans with


program_of = partial(ended_program, cell=CELL)


def samples_of(tmp_path, text):
    """Samples of a program's plan."""
    return planned(program_of(tmp_path, text)).samples


def ramp_time(length, speed, accel):
    """Rest to rest with constant acceleration."""
    if speed**2 / accel > length:
        return 2 * np.sqrt(length / accel)
    return length / speed + speed / accel


@pytest.mark.parametrize(
    ("text", "speed", "accel"),
    [
        ("G01 X100 F12000", 200, 3000),
        ("G131=25\nG01 X100 F12000", 200, 750),
        ("G131=50\nG131=50\nG01 X100 F12000", 200, 1500),
        ("G131 50\nG01 X100 F12000", 200, 1500),
        ("G130 Y10\nG01 X100 F12000", 200, 3000),
        ("G130 X10\nG130 Y50\nG01 X100 F12000", 200, 300),
        ("G130 X10\nG131=100\nG01 X100 F12000", 200, 3000),
        ("G231=10\nG01 X100 F12000", 200, 3000),
        ("G231=10\nG00 X100", 300, 300),
        ("G230 X20\nG00 X100", 300, 600),
        ("G129=50\nG00 X100", 150, 3000),
        ("G129=50\nG01 X100 F18000", 300, 3000),
        ("G128=50\nG01 X100 F18000", 150, 3000),
        ("G127 X40\nG00 X100", 120, 3000),
        ("G129 = 50 X0\nG128=40\nG00 X100", 120, 3000),
        ("#OVERRIDE [RAPID_FACT=50]\nG00 X100", 150, 3000),
        ("#OVERRIDE [RAPID_FACT=200]\nG129=40\nG00 X100", 240, 3000),
        ("#OVERRIDE [FEED_FACT=50]\nG01 X100 F12000", 100, 3000),
        ("#VECTOR LIMIT ON [ACC=3600000]\nG01 X100 F12000", 200, 1000),
        (
            "#VECTOR LIMIT ON [DEC=1800000 ACC=3600000]\nG01 X100 F12000",
            200,
            500,
        ),
        ("#VECTOR LIMIT ON [VEL=6000]\nG01 X100 F12000", 100, 3000),
        ("#VECTOR LIMIT ON [VEL=6000]\nG00 X100", 300, 3000),
        ("#VECTOR LIMIT ON [VEL=6000 RAPID]\nG00 X100", 100, 3000),
        (
            "#VECTOR LIMIT ON [ACC=3600000]\n#VECTOR LIMIT OFF [ACC]\nG01 X100 F12000",
            200,
            3000,
        ),
        (
            "#VECTOR LIMIT ON [ACC=3600000]\n#VECTOR LIMIT OFF ALL\n"
            "#VECTOR LIMIT ON ALL\nG01 X100 F12000",
            200,
            1000,
        ),
        (
            "#VECTORACC ON [3600000]\n#VECTORVEL ON [6000]\nG01 X100 F12000",
            100,
            1000,
        ),
    ],
)
def test_a_straight_line_takes_the_time_its_limits_ask_for(
    tmp_path, text, speed, accel
):
    """Velocity and acceleration as weighted, each weight relative to 100 %."""
    usable = accel if "VECTOR" in text and accel < 3000 else USABLE * accel
    assert planned(program_of(tmp_path, text)).motion_time_s == pytest.approx(
        ramp_time(100, speed, usable), rel=2e-3
    )


def test_weights_hold_from_their_block_on(tmp_path):
    """The samples of the second line accelerate with a quarter of what those of
    the first one do.
    """
    samples = samples_of(
        tmp_path, "G01 X100 F12000\nG60 X100\nG04 0.1\nG131=25\nX200"
    )
    accel = np.abs(np.diff(samples["pos"][:, 0], 2)) / 1e-6
    middle = np.argmax(samples["pos"][:, 0] >= 100 - 1e-6)
    assert accel[:middle].max() == pytest.approx(USABLE * 3000, rel=1e-3)
    assert accel[middle + 50 :].max() == pytest.approx(USABLE * 750, rel=1e-3)


def test_radial_acceleration_bounds_arcs(tmp_path):
    """v^2 / r on a full circle."""
    samples = samples_of(
        tmp_path, "#VECTOR LIMIT ON [RADIAL_ACC=1800000]\nG02 I50 F18000"
    )
    assert samples["v"].max() == pytest.approx(np.sqrt(500 * 50), rel=1e-3)


def test_corners_keep_the_weighted_acceleration(tmp_path):
    """The jump of velocity at a corner is bounded by what is allowed on both sides."""
    zigzag = "\n".join(f"G01 X{i} Y{i % 2} F12000" for i in range(1, 20))
    for weight in (100, 20, 2):
        samples = samples_of(tmp_path, f"G131={weight}\n{zigzag}")
        accel = np.abs(np.diff(samples["pos"], 2, axis=0)) / 1e-6
        assert accel.max() <= 30.0 * weight * 1.001


def test_weights_above_the_machine_are_warned_and_hold_at_its_limit(tmp_path):
    """50130."""
    program = program_of(tmp_path, "G131=150 G133=50\nG01 X100 F12000")
    batch = joined(list(program.batches()))
    assert [w.code for w in program.reader.warnings] == [50130, 50130]
    assert DYNAMICS not in batch.rows["type"]


@pytest.mark.parametrize(
    "text",
    [
        "G131=-1",
        "#VECTOR LIMIT ON [ACC=0]",
        "#OVERRIDE [RAPID_FACT=0]",
        "#SLOPE [TYPE=COS]",
    ],
)
def test_wrong_limits_are_refused(tmp_path, text):
    """At their place."""
    program = program_of(tmp_path, text, collect=True)
    list(program.batches())
    assert [e.code for e in program.errors] in ([900012], [900010])


def test_slope_and_ramp_times_reach_the_engine_as_rows(tmp_path):
    """Profile; jerk shares of feed and rapid motions, from ramp times."""
    batch = joined(
        list(
            program_of(
                tmp_path,
                "#SLOPE [TYPE=STEP]\nG133=200 G233=400\nG134=800\nG00 X1",
            ).batches()
        )
    )
    rows = batch.rows[batch.rows["type"] == DYNAMICS]
    assert rows["code"].tolist() == [5, 3, 3, 3, 3]
    assert rows["end"][1:, 0].tolist() == [0.5, 0.25, 0.125, 0.125]
    assert rows["value"].tolist() == [0, 0, 1, 0, 1]


@pytest.mark.parametrize(
    "on",
    [
        "#HSC ON [BSPLINE PATH_DEV=0.05 TRACK_DEV=5]",
        "#HSC ON [BSPLINE PATH_DEV 0.05]",
        "#HSC ON [OPMODE=1 CONTERROR=0.05]",
        "#FILTER ON [AX_DEV=0.05]",
    ],
)
def test_chains_are_smoothed_within_the_tolerance(tmp_path, on):
    """A circle of 5-degree chords becomes polynomials; not further away than
    allowed; OFF ends it.
    """
    points = "\n".join(
        f"G01 X{20 * np.sin(a):.4f} Y{20 - 20 * np.cos(a):.4f} F6000"
        for a in np.radians(range(5, 180, 5))
    )
    off = "#FILTER OFF" if "FILTER" in on else "#HSC OFF"
    program = program_of(tmp_path, f"{on}\n{points}\n{off}\nG01 X30\nX30 Y30")
    batch = joined(list(program.batches()))
    assert (batch.rows["type"] == POLYNOMIAL).sum() > 3
    assert SMOOTHING not in batch.rows["type"]
    assert batch.rows["type"][-3:-1].tolist() == [1, 1]
    assert 0 < program.smoothing.report.deviation <= 0.05
    result = plan_program(
        program_of(tmp_path, f"{on}\n{points}\n{off}\nG01 X30")
    )
    assert result.path_deviation_mm <= 0.05
    assert result.max_ratio["acceleration"] <= 1.0


def test_long_blocks_and_sharp_corners_stay_exact_under_hsc(tmp_path):
    """MAX_PATH_LENGTH, MAX_ANGLE."""
    text = "#HSC ON [BSPLINE PATH_DEV=0.1 {}]\nG01 X10 F6000\nX20 Y1\nX21 Y11\n#HSC OFF\nX40"

    def kinds(keys):
        return joined(
            list(program_of(tmp_path, text.format(keys)).batches())
        ).rows["type"]

    assert POLYNOMIAL in kinds("")
    assert POLYNOMIAL not in kinds("MAX_PATH_LENGTH=5")
    assert (kinds("MAX_ANGLE=45") == POLYNOMIAL).sum() < (
        kinds("") == POLYNOMIAL
    ).sum()


@pytest.mark.parametrize(
    ("head", "accel", "jerk"),
    [
        ("", 3000, 50000),
        ("G131=25", 750, 50000),
        ("G133=400", 3000, 12500),
        ("G134=200 G131=50", 1500, 25000),
        ("#VECTOR LIMIT ON [ACC=3600000]", 1000, 50000),
        ("#VECTOR LIMIT ON [JERK=2160000000]", 3000, 10000),
    ],
)
@pytest.mark.parametrize("path", ["G01 X100 F12000", "G02 I30 F12000"])
def test_the_jerk_limited_planner_keeps_the_weighted_limits(
    tmp_path, head, accel, jerk, path
):
    """Samples on the default machine; what is allowed is used up on a line.
    #VECTOR LIMIT is about the path: of its own length, not of the axes.
    """
    (tmp_path / "a.nc").write_text(f"{head}\n{path}\nM30\n")
    samples = plan_program(
        Program(tmp_path / "a.nc", load_config(None)), keep_samples=True
    ).samples
    seen = dict.fromkeys((2, 3), samples["pos"])
    seen |= {
        order: samples["s"][:, None]
        for order, limit in ((2, "[ACC"), (3, "[JERK"))
        if limit in head
    }
    measured = (
        np.abs(np.diff(seen[2], 2, axis=0)).max() / 1e-6,
        np.abs(np.diff(seen[3], 3, axis=0)).max() / 1e-9,
    )
    assert (
        measured[0] <= accel * 1.01
    )  # on an arc windows that begin in its middle may lie a little above
    assert measured[1] <= jerk * 1.005
    if path.startswith("G01"):
        full = min(
            accel, np.sqrt(200 * jerk)
        )  # what a ramp to 200 mm/s reaches
        assert measured[0] == pytest.approx(full, rel=0.01)
        assert measured[1] == pytest.approx(jerk, rel=0.01)


def test_weights_change_on_the_way(tmp_path):
    """The weaker block is entered and left without a stop, and inside its limits."""
    (tmp_path / "a.nc").write_text(
        "G01 X100 F12000\nG131=20\nX200\nG131=100\nX300\nM30\n"
    )
    samples = plan_program(
        Program(tmp_path / "a.nc", load_config(None)), keep_samples=True
    ).samples
    accel = np.abs(np.diff(samples["pos"][:, 0], 2)) / 1e-6
    inside = (samples["pos"][1:-1, 0] > 100.5) & (
        samples["pos"][1:-1, 0] < 199.5
    )
    assert accel[inside].max() <= 600 * 1.001
    assert samples["v"][1:-1][inside].min() > 100


@pytest.mark.parametrize("cell_text", ["", CELL])
def test_g166_drives_its_block_at_the_programmed_feed(tmp_path, cell_text):
    """Neither the operator's override nor #OVERRIDE acts on it; jerk-limited and not."""
    (tmp_path / "cell.toml").write_text(cell_text)

    def seconds(text):
        (tmp_path / "a.nc").write_text(text + "\nM30\n")
        cell = load_config(tmp_path / "cell.toml")
        program, engine = (
            Program(tmp_path / "a.nc", cell),
            Engine(cell, record_rows=10000),
        )
        try:
            engine.set_override(0.5)
            for batch in program.batches():
                assert engine.push(batch, 0) == len(batch)
            engine.finish()
            while engine.run(10000) not in (Event.PROGRAM_END, Event.FAULT):
                pass
            return float(engine.state.motion_time_s)
        finally:
            engine.close()

    assert seconds("G01 X5 F600\nX10\nX15") == pytest.approx(3.0, rel=0.02)
    assert seconds("G01 X5 F600\nG166 X10\nX15") == pytest.approx(2.5, rel=0.02)
    assert seconds(
        "#OVERRIDE [FEED_FACT=50]\nG166 G01 X5 F600\nG166 X10"
    ) == pytest.approx(1.0, rel=0.04)
