"""A tilted plane on the three example machines, judged by forward kinematics
written down for each of them here.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cnc_core.blocks import ELEMENT, PIECE, TANGENTS, blocks
from cnc_core.config import CellConfig, load_config, parse_config
from cnc_core.errors import CncError
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.inside import Inside
from support.limits import legal
from support.paths import FIVE_AXIS

L = 80.0
Z = np.array([0, 0, 1.0])


def about(axis: str, degrees: np.ndarray) -> Rotation:
    return Rotation.from_euler(axis, degrees.reshape(-1, 1), degrees=True)


def table_table(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) tip and tool direction in the part: the part is turned by -C about
    Z, then by -A about X 50 below.
    """
    pivot = np.array([0, 0, -50.0])
    tip, a, c = q[:, :3] - L * Z, about("x", q[:, 3]), about("z", q[:, 4])
    turned = (
        a.inv().inv()
    )  # the part went by -A, so the tip is seen turned by +A
    return c.apply(turned.apply(tip - pivot) + pivot), c.apply(
        turned.apply(np.tile(Z, (len(q), 1)))
    )


def head_table(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The head tilts by B about Y, 150 above the spindle nose; the part turns
    by -C about (20, 10), origin at Z 40.
    """
    pivot, part = np.array([0, 0, 150.0]), np.array([20, 10, 40.0])
    b, c = about("y", q[:, 3]), about("z", q[:, 4])
    tip = q[:, :3] + pivot + b.apply(np.tile((-L * Z) - pivot, (len(q), 1)))
    return c.apply(tip - part), c.apply(b.apply(np.tile(Z, (len(q), 1))))


def head_head(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """C about Z carries B about Y, 246.5 above the spindle nose; the part moves by -X."""
    pivot = np.array([0, 0, 246.5])
    head = about("z", q[:, 3]) * about("y", q[:, 4])
    d = head.apply(np.tile(Z, (len(q), 1)))
    return q[:, :3] + pivot + head.apply(
        np.tile(-L * Z - pivot, (len(q), 1))
    ), d


MACHINES = {
    "table_table": table_table,
    "head_table": head_table,
    "head_head": head_head,
}


def plan(tmp_path: Path, cell: CellConfig, text: str, **options):
    path = tmp_path / "part.nc"
    path.write_text(text)
    return plan_program(
        Program(path, cell, "isg"), keep_samples=True, **options
    )


def distance_to_segments(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    best = np.full(len(points), np.inf)
    for a, b in itertools.pairwise(corners):
        t = np.clip(
            (points - a) @ (b - a) / max((b - a) @ (b - a), 1e-30), 0, 1
        )[:, None]
        best = np.minimum(
            best, np.linalg.norm(points - a - t * (b - a), axis=1)
        )
    return best


def ring(center, radius: float, first: float, last: float) -> np.ndarray:
    """(n, 3) points of an arc in the plane, degrees; chords below 0.05 um off."""
    angle = np.radians(np.linspace(first, last, 2001))
    return np.column_stack(
        [
            center[0] + radius * np.cos(angle),
            center[1] + radius * np.sin(angle),
            0 * angle,
        ]
    )


CONTOUR = np.vstack(
    [
        [(0, 0, 0), (30, 0, 0)],
        ring((30, 10), 10, -90, 0),
        [(40, 20, 0)],
        ring((30, 20), 10, 0, 180),
        [(0, 20, 0), (0, 0, 0)],
    ]
)
PROGRAM = """N10 G00 G90 T1 D1
N20 #TRAFO ON
N30 G00 X0 Y0 Z100
N40 #CS ON [10, 5, 20, 0, 25, 30]
N50 #TOOL ORI CS
N60 G00 X0 Y0 Z5
N70 G01 Z0 F2400
N80 X30
N90 G03 X40 Y10 I0 J10
N100 G01 Y20
N110 G03 X20 Y20 R10
N120 G01 X0
N130 Y0
N140 G00 Z20
N150 #CS OFF
N160 #TRAFO OFF
M30
"""
PLANE = Rotation.from_euler("ZYX", (30, 25, 0), degrees=True)


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.ci
def test_the_tip_follows_a_tilted_contour(name, tmp_path):
    """Within 1 um of the programmed contour, at the programmed feed, the tool
    along the plane's normal, limits kept.
    """
    cell = load_config(FIVE_AXIS / f"{name}.toml")
    result = plan(tmp_path, cell, PROGRAM)
    q, block = result.samples["pos"], result.samples["block"]
    tip, direction = MACHINES[name](q)
    cutting = np.flatnonzero((block >= 4) & (block < 10))
    local = PLANE.inv().apply(tip[cutting] - (10, 5, 20))
    assert len(cutting) > 1000
    assert np.abs(local[:, 2]).max() < 1e-3
    assert distance_to_segments(local, CONTOUR).max() < 1e-3
    assert distance_to_segments(CONTOUR, local).max() < 0.05  # all of it
    assert np.abs(direction[cutting] - PLANE.apply(Z)).max() < 1e-9
    speed = np.linalg.norm(np.diff(tip[cutting], axis=0), axis=1) / cell.cycle_s
    assert speed.max() <= 40.0 * 1.005
    assert np.median(speed) > 20.0
    low, high = cell.axis_values("min_mm"), cell.axis_values("max_mm")
    assert ((q >= low - 1e-9) & (q <= high + 1e-9)).all()
    assert (
        max(result.max_ratio[k] for k in ("velocity", "acceleration", "jerk"))
        <= 1.02
    )
    assert result.path_deviation_mm < 1e-4


@pytest.mark.ci_cases
@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("jerk", [True, False])
def test_the_tip_holds_its_line_while_rotary_axes_move(name, jerk, tmp_path):
    """Lines, a standing tip and a helix during which both rotary axes turn: 1
    um, and the feed of the tip.
    """
    tilt = {"table_table": "A", "head_table": "B", "head_head": "B"}[name]
    text = f"""G00 G90 T1 D1
#TRAFO ON
G00 X0 Y0 Z100
G01 X40 Y30 Z90 {tilt}35 C50 F3000
G01 {tilt}10 C-20
G02 X60 Y30 Z80 I10 J0 {tilt}30 C20
G01 X0 Y0 Z100 {tilt}0 C0
"""
    cell = load_config(FIVE_AXIS / f"{name}.toml")
    if not jerk:
        axes = {
            n: a.model_copy(update={"j_max_mm_s3": 0.0})
            for n, a in cell.axes.items()
        }
        cell = cell.model_copy(update={"axes": axes})
    result = plan(tmp_path, cell, text)
    tip, _ = MACHINES[name](result.samples["pos"])
    block = result.samples["block"]
    helix = ring((50, 30), 10, 180, 0)
    helix[:, 2] = np.linspace(90, 80, len(helix))
    paths = {
        1: [(0, 0, 100), (40, 30, 90)],
        2: [(40, 30, 90), (40, 30, 90)],
        3: helix,
        4: [(60, 30, 80), (0, 0, 100)],
    }
    for element, corners in paths.items():
        points = tip[block == element]
        assert len(points) > 50
        assert (
            distance_to_segments(points, np.array(corners, float)).max() < 1e-3
        ), element
    speed = (
        np.linalg.norm(np.diff(tip, axis=0), axis=1)[block[1:] > 0]
        / cell.cycle_s
    )
    assert speed.max() <= 50.0 * 1.01
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02


@pytest.mark.ci
def test_compensation_acts_in_the_tilted_plane(tmp_path):
    """G42 under #CS and #TRAFO: the tool centre runs the tool radius beside the
    contour, in its plane.
    """
    text = PROGRAM.replace("N60 G00 X0 Y0 Z5", "N60 G00 X-12 Y-12 Z5")
    text = text.replace(
        "N70 G01 Z0 F2400", "N70 G01 Z0 F2400\nN75 G42 G01 X0 Y0"
    ).replace("N140 G00 Z20", "N135 G40 G01 X-12 Y-12\nN140 G00 Z20")
    result = plan(tmp_path, load_config(FIVE_AXIS / "head_head.toml"), text)
    tip, _ = head_head(result.samples["pos"])
    rows = np.unique(result.samples["block"])
    local = PLANE.inv().apply(tip - (10, 5, 20))
    cutting = (
        (np.abs(local[:, 2]) < 1e-3)
        & (local[:, 0] > 1)
        & (local[:, 0] < 39)
        & (local[:, 1] > -3.9)
    )
    outside = distance_to_segments(local[cutting], CONTOUR)
    assert len(rows) > 8
    assert cutting.sum() > 1000
    assert np.abs(outside - 4.0).max() < 1e-3


def test_the_example_program_runs_on_all_three(tmp_path):
    """The programs beside the example cells are planned without errors."""
    for name in MACHINES:
        program = (
            "tilted_plane_a.nc" if name == "table_table" else "tilted_plane.nc"
        )
        result = plan_program(
            Program(
                FIVE_AXIS / program,
                load_config(FIVE_AXIS / f"{name}.toml"),
                "isg",
            )
        )
        assert result.path_deviation_mm < 1e-4


def test_limits_are_those_of_the_axes(tmp_path):
    """A tip that is in reach for the tip is refused where an axis is not, with
    its block and before anything moves.
    """
    cell = load_config(FIVE_AXIS / "head_head.toml")
    with pytest.raises(CncError) as wrong:
        plan(
            tmp_path,
            cell,
            "G00 T1 D1\n#TRAFO ON\nG00 X0 Y0 Z-200\nN7 G01 B90 F500\n",
        )
    assert (wrong.value.code, wrong.value.place.line) == (903001, 4)
    assert "axis Z" in wrong.value.text


def test_what_the_plc_sees_is_the_programmed_contour(tmp_path):
    """Elements keep type, radius, length, N; pieces cover them; other rows keep their places."""
    path = tmp_path / "part.nc"
    path.write_text(
        PROGRAM.replace("N100", "#CONTOUR LOOKAHEAD LOG ON [PARAM=5]\nN100 M8")
    )
    program = Program(path, load_config(FIVE_AXIS / "table_table.toml"), "isg")
    rows = np.concatenate([b.rows for b in program.batches()])
    seen = rows[(rows["type"] <= 3) & (rows["flags"] & PIECE == 0)]
    arc = seen[seen["n"] == 90][0]
    assert (arc["type"], arc["radius"], arc["programmed_radius"]) == (
        2,
        10.0,
        10.0,
    )
    assert arc["flags"] & ELEMENT
    assert arc["degree"] == TANGENTS
    assert arc["length"] == pytest.approx(5 * np.pi)
    pieces = rows[(rows["n"] == 90) & (rows["flags"] & PIECE != 0)]
    assert pieces["value"].sum() == pytest.approx(5 * np.pi)
    kinds = [
        int(r["type"]) for r in rows if r["n"] in (0, 100) and r["type"] > 3
    ]
    assert kinds[:2] == [9, 5]
    at = [i for i, r in enumerate(rows) if r["n"] == 90]
    marker = int(np.flatnonzero(rows["type"] == 9)[0])
    assert marker == at[-1] + 1


# ------------------------------------------------------------------------------------------------
# the cell file
BASE = "[axes.X]\n[axes.Y]\n[axes.Z]\n[axes.A]\nkind='rotary'\n[axes.C]\nkind='rotary'\n"


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("type='table-tabel'\nrotary=['C','A']", "kinematics.1.type"),
        ("type='table-table'", "rotary"),
        ("type='table-table'\nrotary=['C','B']", "no axis 'B'"),
        ("type='table-table'\nrotary=['C','X']", "an axis stands twice"),
        (
            "type='table-table'\nrotary=['C','A']\nlinear=['X','Y','A']",
            "an axis stands twice",
        ),
        ("type='table-table'\nrotary=['C','A']\nbed='BC1'", "has no bed BC1"),
        ("type='WC1'\nrotary=['C','A']\nbed='B9'", "kinematics.1.bed"),
        (
            "type='table-table'\nrotary=['C','A']\npoints={X=[0,0,0]}",
            "points: X is none of C, A",
        ),
        (
            "type='table-table'\nrotary=['C','A']\ndirections={A=[0,0,0]}",
            "directions: A has no length",
        ),
        (
            "type='table-table'\nrotary=['C','A']\ndirections={X=[0,0,1]}",
            "do not span the space",
        ),
        (
            "type='table-table'\nrotary=['C','A']\ntool_direction=[0,0,0]",
            "tool_direction has no length",
        ),
        (
            "type='table-table'\nrotary=['C','A']\npoint={A=[0,0,0]}",
            "did you mean 'points'",
        ),
        (
            "type='table-table'\nrotary=['C','A']\ncin={X=[0,0,0,0,0,0]}",
            "cin: A is missing",
        ),
        (
            "type='table-table'\nrotary=['C','A']\npart=[0,0,1]\ncin={X=[0,0,0,0,0,0]}",
            "cin and part exclude each other",
        ),
    ],
)
def test_wrong_tables_are_refused_by_name(table, words):
    """Every mistake names its key."""
    with pytest.raises(CncError) as wrong:
        parse_config(f"{BASE}[kinematics.1]\n{table}\n")
    assert wrong.value.code == 902001
    assert words in wrong.value.text


def test_cin_steps_give_the_manuals_machine():
    """The table of section 10.3 as `cin`: tip and direction of its fifth row."""
    text = """[axes.X]
[axes.Y]
[axes.Z]
[axes.A]
kind = "rotary"
[axes.B]
kind = "rotary"
[kinematics.3]
type = "TOL"
bed = "B12"
linear = ["Y", "X", "Z"]
rotary = ["A", "B"]
cin.Y = [0,0,0,90,0,180]
cin.X = [0,0,0,0,90,0]
cin.Z = [0,0,0,0,-90,0]
cin.A = [0,0,0,0,0,0]
cin.B = [0,0,0,-90,0,0]
cin.t = [0,246.5,0,90,0,0]
cin.w = [0,0,0,90,0,180]
"""
    kin = parse_config(text).kinematic_machines[3]
    pose = kin.forward(np.array([100, 50, 400, 30, 20.0]), 100)
    assert (
        np.abs(pose.tip[0] - (-2.632652991, -9.254989831, 74.396506898)).max()
        < 2e-9
    )


def test_number_of_the_transformation():
    """kin_id of the channel, else the first table; it must exist."""
    tables = (
        "[kinematics.5]\ntype='table-table'\nrotary=['C','A']\n"
        "[kinematics.2]\ntype='head-head'\nrotary=['C','A']\n"
    )
    assert parse_config(BASE + tables).kin_id == 5
    assert parse_config(f"[channel]\nkin_id=2\n{BASE}{tables}").kin_id == 2
    with pytest.raises(CncError, match="kin_id"):
        parse_config(f"[channel]\nkin_id=3\n{BASE}{tables}")
    with pytest.raises(CncError, match="not a number"):
        parse_config(
            BASE + "[kinematics.head]\ntype='head-head'\nrotary=['C','A']\n"
        )
    with pytest.raises(CncError, match="not a rotary axis"):
        parse_config(
            BASE.replace("[axes.C]\nkind='rotary'", "[axes.C]") + tables
        )


def test_elements_name_the_tangents_of_the_tip(tmp_path):
    """Over several switches of coordinates in one batch: unit tangents along
    the programmed lines and arcs.
    """
    path = tmp_path / "part.nc"
    path.write_text(PROGRAM + "#CS ON [1,2,3,40,50,60]\n")
    cell = load_config(FIVE_AXIS / "head_table.toml")
    shown, found = {}, {}
    for programmed in (True, False):
        for batch in Program(
            path, cell, "isg", programmed=programmed
        ).batches():
            start = cell.axis_values("start_mm")
            if programmed:
                for block in blocks(
                    batch, start, cell.axis_names, cell.main_axes
                ):
                    value = block.as_json()
                    if "end" in value:
                        shown.setdefault(value["n"], []).append(value)
                continue
            rows = batch.rows[
                (batch.rows["type"] <= 3) & (batch.rows["flags"] & ELEMENT != 0)
            ]
            for row in rows[rows["degree"] == TANGENTS]:
                at = int(row["pool"])
                found[int(row["n"])] = batch.pool[at : at + 6].reshape(2, 3)
    assert len(found) >= 9
    for n, tangents in found.items():
        assert np.abs(np.linalg.norm(tangents, axis=1) - 1.0).max() < 1e-9
        first, last = shown[n][0], shown[n][-1]
        if first["type"] == "linear":
            way = np.array([first["end"][a] - first["start"][a] for a in "XYZ"])
            assert np.abs(tangents - way / np.linalg.norm(way)).max() < 1e-9
        else:
            slope = np.polynomial.polynomial.polyder
            ends = [
                [
                    np.polynomial.polynomial.polyval(
                        s, slope(block["coeff"][a])
                    )
                    for a in "XYZ"
                ]
                for block, s in ((first, 0.0), (last, last["s"]))
            ]
            assert np.abs(tangents - ends).max() < 1e-9


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.ci
def test_control_by_the_plc_keeps_the_tip_on_its_path(seed, tmp_path):
    """Backward motion, feed hold and override at random moments: the tip stays
    on the contour, limits hold, it ends.
    """
    rng = np.random.default_rng(seed)
    cell = load_config(FIVE_AXIS / "head_table.toml")
    text = """T1 D1 G90
#TRAFO ON
G00 X0 Y0 Z100
G01 X40 Y30 B30 C40 F4000
#CS ON [0,0,0,10,20,30]
G91 G03 X20 Y0 I10 J0 B-10
G90
#CS OFF
G01 X0 Y0 Z100 B5 C-30
G01 B25 C30 F2000
#TRAFO OFF
G01 Z300
"""
    with Inside(tmp_path, text, cell) as cnc:
        cnc.end()
        still = np.vstack([cell.axis_values("start_mm"), cnc.pos])
    with Inside(tmp_path, text, cell) as cnc:
        cnc.level(cnc.bahn.override_valid, True)
        for _ in range(1200):
            for unit, chance in (
                (cnc.bahn.backward_motion, 0.008),
                (cnc.bahn.feedhold, 0.004),
            ):
                if rng.random() < chance:
                    cnc.level(unit, bool(rng.random() < 0.5))
            if rng.random() < 0.004:
                cnc.level(cnc.bahn.override, int(rng.choice([300, 1000, 2000])))
            cnc.run(1)
        for unit in (cnc.bahn.backward_motion, cnc.bahn.feedhold):
            cnc.level(unit, False)
        cnc.level(cnc.bahn.override, 1000)
        cnc.until(lambda: bool(cnc.state.program_end_r))
        driven = cnc.pos
        legal(driven, cell)
        assert cnc.engine.state.infeasible == 0
    assert np.abs(driven[-1] - still[-1]).max() < 1e-9
    path, d = still[:-1], np.diff(still, axis=0)
    for q in driven[::7]:
        t = np.clip(
            ((q - path) * d).sum(axis=1)
            / np.maximum((d * d).sum(axis=1), 1e-30),
            0,
            1,
        )[:, None]
        assert (
            np.linalg.norm(path + t * d - q, axis=1).min() < 2e-3
        )  # the reference is a polyline of samples


@pytest.mark.parametrize("x", [0.0, 5e-7, 1e-3, 0.5])
def test_rotary_axes_that_turn_while_the_tip_all_but_stands(x, tmp_path):
    """However short the tip's way: limits hold, the motion takes what the axes
    need, the tip stays.
    """
    text = f"T1 D1\n#TRAFO ON\nG00 X0 Y0 Z100\nG01 X{x:.7f} B60 C30 F60000\nX10 F3000\n"
    cell = load_config(FIVE_AXIS / "head_table.toml")
    result = plan(tmp_path, cell, text)
    assert max(v for v in result.max_ratio.values() if v is not None) <= 1.02
    turning = result.samples["block"] == 1
    assert 0.5 < turning.sum() * cell.cycle_s < 1.5
    tip, _ = head_table(result.samples["pos"][turning])
    assert (
        distance_to_segments(tip, np.array([(0, 0, 100), (x, 0, 100)])).max()
        < 1e-3
    )


@pytest.mark.parametrize("tolerance", [0.01, 0.002, 0.0005])
@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.ci_cases
def test_smoothing_and_kinematics_share_the_tolerance(
    machine: str, tolerance: float, tmp_path: Path
) -> None:
    """Corners of the tip while rotary axes turn: it leaves the programmed lines
    by the tolerance at most, in all.
    """
    cell = load_config(FIVE_AXIS / f"{machine}.toml")
    rng, names = np.random.default_rng(3), list(cell.axes)
    k = np.arange(25)
    points = np.column_stack(
        [
            3.0 * k,
            4.0 * (k % 2),
            0.3 * rng.uniform(-1, 1, 25),
            15 + 3 * (k % 3),
            4.0 * k,
        ]
    )
    points = np.round(points, 4)
    blocks_ = [
        " ".join(f"{n}{v:.4f}" for n, v in zip(names, p, strict=True))
        for p in points
    ]
    text = (
        f"G90 T1 D1\n#KIN ID[9]\n#TRAFO ON\nG0 {blocks_[0]}\n#TIME 0.02\nG1 F3000\n"
        + "\n".join(blocks_[1:])
        + "\nM30\n"
    )
    path = tmp_path / "part.nc"
    path.write_text(text)
    result = plan_program(
        Program(path, cell, "isg", tolerance=tolerance), keep_samples=True
    )
    tip, _ = MACHINES[machine](result.samples["pos"])
    tip = tip[
        np.flatnonzero(np.linalg.norm(tip - points[0, :3], axis=1) < 1e-6)[-1] :
    ]
    a, step = points[:-1, :3], np.diff(points[:, :3], axis=0)
    t = np.clip(
        ((tip[:, None] - a) * step).sum(-1) / (step**2).sum(-1), 0.0, 1.0
    )
    away = np.linalg.norm(tip[:, None] - a - t[..., None] * step, axis=2).min(
        axis=1
    )
    assert 0.5 * tolerance < away.max() <= tolerance
    assert away.max() <= result.path_deviation_mm <= tolerance
