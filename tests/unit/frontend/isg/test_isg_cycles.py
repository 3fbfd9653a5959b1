"""Built-in cycles of the ISG dialect beyond what the golden programs say."""

import re

import numpy as np
import pytest
from shapely.geometry import LineString, Point, box

from cnc_core.config import CellConfig, ToolConfig, parse_config
from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend import create
from cnc_core.frontend.isg.cycles.declaration import (
    Given,
    Surroundings,
    number_text,
)
from cnc_core.frontend.isg.cycles.preview import CODES
from cnc_core.frontend.isg.cycles.registry import CYCLES, find
from cnc_core.frontend.machine import HscSetting, ProgramMachine, Tool
from cnc_core.frontend.offline import read_all
from cnc_core.frontend.port import OfflinePort
from cnc_core.geometry.shapes import pocket
from cnc_core.geometry.shapes.fits import fit_circle
from cnc_core.geometry.shapes.rotation import from_points
from cnc_core.program import Program


def machine(**more):
    return ProgramMachine(
        ("X", "Y", "Z"),
        (False,) * 3,
        (0, 1, 2),
        np.zeros(3),
        tools={1: Tool(5.0), 2: Tool(3.0)},
        **more,
    )


class LivePort(OfflinePort):
    """A machine that answers; nothing moves."""

    answers = True


def cycle_run(tmp_path, text, machine_=None, port_type=OfflinePort, **files):
    """Front end and port behind the whole program, and its rows."""
    (tmp_path / "main.nc").write_text(text)
    for name, content in files.items():
        (tmp_path / name.replace("__", ".")).write_text(content)
    used = machine_ or machine()
    port = port_type(used.start)
    reader = create(
        "isg",
        tmp_path / "main.nc",
        used,
        port,
        collect=port_type is OfflinePort,
    )
    rows = []
    try:
        for item in read_all(reader):
            if hasattr(item, "rows"):
                rows += list(item.rows)
    except CncError as error:
        return reader, port, rows, error
    finally:
        reader.close()
    return reader, port, rows, None


def test_plain_message_has_a_time_stamp_in_front(tmp_path):
    """`#MSG SAVE` without EXCLUSIVE: date, time, blank, text."""
    text = (
        "#VAR\nV.CYC.SysRetNormalZ\n#ENDVAR\n"
        "L CYCLE [NAME=SysCalcPlane.ecy @P50=1 @P60=0 @P70=0 @P51=0 "
        "@P61=1"
    )
    text += (
        ' @P71=0 @P52=1 @P62=1 @P72=0]\n#FILE NAME[MSG="r.txt"]\n'
        '#MSG SAVE ["Normal Z = %f",V.CYC.SysRetNormalZ]\n'
    )
    _, port, _, _ = cycle_run(tmp_path, text)
    assert re.fullmatch(
        r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d Normal Z = 1\.000000\n",
        port.texts["r.txt"],
    )


def test_no_output_is_written_by_a_cycle_that_fails(tmp_path):
    """V.CYC keeps what it held if the parameters are wrong or the points degenerate."""
    text = "#VAR\nV.CYC.SysRetRadius = 7\n#ENDVAR\n"
    text += "L CYCLE [NAME=SysCalcCircle @P50=0 @P60=0 @P51=1 @P61=1 @P52=2 @P62=2]\n"
    _, port, _, _ = cycle_run(
        tmp_path, text + '#MSG ["%f", V.CYC.SysRetRadius]\n'
    )
    assert port.messages == ["7.000000"]


@pytest.mark.parametrize(
    ("declared", "code"),
    [
        ("V.CYC.SysRetVariance : STRING[5]", 907012),
        ("V.CYC.SysRetVariance[2]", 907015),
    ],
)
def test_no_output_is_written_if_one_does_not_fit(tmp_path, declared, code):
    """A variable of another type or shape is an error, and the others keep what they held."""
    text = f"#VAR\nV.CYC.SysRetRadius = 7\n{declared}\n#ENDVAR\n"
    text += "L CYCLE [NAME=SysCalcCircle @P50=0 @P60=0 @P51=1 @P61=1 @P52=2 @P62=0]\n"
    reader, port, _, _ = cycle_run(
        tmp_path, text + '#MSG ["%f", V.CYC.SysRetRadius]\n'
    )
    assert [e.code for e in reader.errors] == [code]
    assert port.messages == ["7.000000"]


def test_outputs_are_in_the_unit_of_the_program(tmp_path):
    """Under G70 inches go in and come out, the variance in square inches."""
    text = "#VAR\nV.CYC.SysRetRadius\nV.CYC.SysRetVariance\n#ENDVAR\nG70\n"
    text += (
        "L CYCLE [NAME=SysCalcCircle @P50=1 @P60=0 @P51=0 @P61=1 @P52=-1 "
        "@P62=0 @P53=0 @P63=-1.1]\n"
    )
    _, port, _, _ = cycle_run(
        tmp_path,
        text + '#MSG ["%.9f %.9f", V.CYC.SysRetRadius, V.CYC.SysRetVariance]\n',
    )
    radius, variance = map(float, port.messages[0].split())
    points = np.array([(1, 0), (0, 1), (-1, 0), (0, -1.1)])
    found = fit_circle(points)
    assert radius == pytest.approx(found.radius, abs=1e-8)
    assert variance == pytest.approx(found.variance, abs=1e-8)


# SysPosRotationToPlane

ISG_POINTS = (
    "@P6=100 @P7=30 @P8=-25 @P9=100 @P10=70 @P11=-25 @P12=115 @P13=70 @P14=-50"
)
BEC_POINTS = (
    "@P6=100 @P7=30 @P8=25 @P9=100 @P10=70 @P11=25 @P12=115 @P13=70 @P14=50"
)
AXES = {
    "RTP-1 ISG": (
        ISG_POINTS,
        "0.000000 1.000000 0.000000|-0.514496 0.000000 0.857493|0.857493 0.000000 0.514496",
    ),
    "RTP-1 BEC": (
        BEC_POINTS,
        "0.000000 1.000000 0.000000|-0.514496 0.000000 -0.857493|-0.857493 0.000000 0.514496",
    ),
    "RTP-2 ISG": (
        "@P15=60 @P16=0 @P17=90",
        "0.000000 1.000000 0.000000|-0.500000 0.000000 0.866025|0.866025 0.000000 0.500000",
    ),
    "RTP-2 BEC": (
        "@P15=-60 @P16=0 @P17=90",
        "0.000000 1.000000 0.000000|-0.500000 0.000000 -0.866025|-0.866025 0.000000 0.500000",
    ),
    "RTP-2 ISG extrinsic": (
        "@P15=60 @P16=0 @P17=90 @P18=2",
        "0.000000 0.500000 0.866025|-1.000000 0.000000 0.000000|0.000000 -0.866025 0.500000",
    ),
    "one angle": (
        "@P16=90",
        "0.000000 0.000000 -1.000000|0.000000 1.000000 0.000000|1.000000 0.000000 0.000000",
    ),
}


@pytest.mark.parametrize("case", AXES)
def test_result_file_of_the_acceptance_programs(tmp_path, case):
    """Mode 4 writes the axes of the plane and does nothing else; the origin does not matter."""
    definition, axes = AXES[case]
    reader, port, rows, _ = cycle_run(
        tmp_path,
        f"L CYCLE [NAME=SysPosRotationToPlane.ecy @P1=4 @P3=140 @P20=1 {definition}]\nM30\n",
    )
    assert not reader.errors
    assert [int(row["type"]) for row in rows] == [5]
    wanted = "".join(
        f"{n}-Axis: {axis}\n"
        for n, axis in zip("XYZ", axes.split("|"), strict=True)
    )
    assert port.texts == {"SysPosRotationToPlaneResult.txt": wanted}


SEQUENCES = {
    (1, 1): "0.813798 0.543838 -0.204874|0.342020 -0.163176 0.925417",
    (1, 2): "0.813798 0.469846 -0.342020|0.378522 0.018028 0.925417",
    (2, 1): "0.813798 0.522099 -0.255236|0.296198 0.005236 0.955112",
    (2, 2): "0.813798 0.500000 -0.296198|0.418412 -0.150384 0.895721",
    (3, 1): "0.843493 0.492404 -0.214610|0.336824 -0.173648 0.925417",
    (3, 2): "0.784102 0.521281 -0.336824|0.377786 0.029696 0.925417",
}
SEQUENCES |= {
    ({2: 4, 3: 5, 1: 6}[n], kind): SEQUENCES[n, 3 - kind]
    for n, kind in list(SEQUENCES)
}


@pytest.mark.parametrize(("sequence", "kind"), SEQUENCES)
def test_every_sequence_intrinsic_and_extrinsic(tmp_path, sequence, kind):
    """New X and Z axis of 10, 20, 30 degrees in all six sequences, both ways."""
    text = (
        f"L CYCLE [NAME=SysPosRotationToPlane @P1=4 @P20=1 @P15=10 "
        f"@P16=20 @P17=30 @P18={kind} @P19={sequence}]\n"
    )
    _, port, _, _ = cycle_run(tmp_path, text)
    lines = port.texts["SysPosRotationToPlaneResult.txt"].splitlines()
    assert [lines[0][8:], lines[2][8:]] == SEQUENCES[sequence, kind].split("|")


# HSC


def hsc_machine():
    return machine(
        hsc_settings={
            "finish": HscSetting("finish.nc", 0.01),
            "rough": HscSetting("", 0.5),
        }
    )


def test_hsc_settings_call_the_subprogram_once(tmp_path):
    """HSC-1: one call, the tolerance readable, the position unchanged; a state
    without program does nothing.
    """
    text = (
        "G00 Z150\nL CYCLE [NAME=SysHscSettings.ecy \\\n  @P1 = 4 \\\n]\n"
        "L CYCLE [NAME=SysHscSettings.ecy @P1=2]\nG70\n"
    )
    text += '#MSG ["%f %f", V.G.HSCS.FINISH.TOLERANCE, V.G.HSCS.ROUGH.TOLERANCE]\nX1\nM30\n'
    reader, port, rows, _ = cycle_run(
        tmp_path,
        text,
        hsc_machine(),
        finish__nc='#MSG ["%f", V.G.HSCS.FINISH.TOLERANCE]\n; #HSC ON[A \\\n B]\nM17\n',
    )
    assert not reader.errors
    assert port.messages == ["0.010000", "0.000394 0.019685"]
    assert [row["end"][2] for row in rows[:2]] == [150.0, 150.0]


def test_hsc_settings_without_its_file_says_which(tmp_path):
    """A configured subprogram that does not exist is an error by name."""
    reader, _, _, _ = cycle_run(
        tmp_path, "L CYCLE [NAME=SysHscSettings.ecy @P1=4]\n", hsc_machine()
    )
    assert [(e.code, "finish.nc" in e.text) for e in reader.errors] == [
        (907030, True)
    ]


# refusals


def test_wrong_calls_are_refused_before_any_row_all_at_once(tmp_path):
    """A machine that would move gets no row: every problem of every call comes first."""
    text = (
        "V.P.N = 1\nG00 X50\nL CYCLE [NAME=SysCalcCircle @P50=V.P.N @P51="
        "0 @P61=1 @P53=2]\nG00 X60\n"
    )
    text += "L CYCLE [NAME=SysHscSettings @P1=9]\nM30\n"
    reader, _, rows, error = cycle_run(tmp_path, text, port_type=LivePort)
    assert rows == []
    assert error.code == 13320
    assert len(reader.errors) == 5
    assert [e.place.line for e in (error, *error.also)] == [3, 3, 3, 3, 5]


def test_wrong_calls_in_called_files_are_found_too(tmp_path):
    """The dry run is made for programs whose subprograms call cycles."""
    files = {
        "a__nc": "L b.nc\nM17\n",
        "b__nc": "L CYCLE [NAME=SysHscSettings @P1=9]\nM17\n",
    }
    _, _, rows, error = cycle_run(
        tmp_path, "G00 X50\nN10L a.nc\nM30\n", port_type=LivePort, **files
    )
    assert rows == []
    assert (error.code, error.place.line) == (13320, 1)
    assert error.place.file.endswith("b.nc")


def test_the_dry_run_leaves_what_only_the_machine_knows_alone(tmp_path):
    """A program that asks the machine is executed; its wrong call stops it when it comes."""
    text = "G00 X50\n#TIMER READ [ID=1]\nL CYCLE [NAME=SysHscSettings @P1=9]\nM30\n"
    _, _, rows, error = cycle_run(tmp_path, text, port_type=LivePort)
    assert [row["end"][0] for row in rows] == [50.0]
    assert error.code == 13320


def test_a_wrong_call_that_is_not_executed_does_not_stop_a_run(tmp_path):
    """`check` reports it; a machine executes the program."""
    text = (
        "G00 X1\n$IF 0\nL CYCLE [NAME=SysHscSettings @P1=9]\n$ENDIF\n"
        "L CYCLE [NAME=SysHscSettings @P1=1]\nM30\n"
    )
    _, _, rows, error = cycle_run(tmp_path, text, port_type=LivePort)
    assert error is None
    assert len(rows) == 2
    reader, _, _, _ = cycle_run(tmp_path, text)
    assert [e.code for e in reader.errors] == [13320]


def test_the_dry_run_writes_nothing(tmp_path):
    """Messages and files come once, of the real run."""
    text = 'G00 X1\n#MSG SAVE EXCLUSIVE ["once"]\nL CYCLE [NAME=SysHscSettings @P1=1]\nM30\n'
    _, port, rows, error = cycle_run(tmp_path, text, port_type=LivePort)
    assert error is None
    assert port.texts == {"message.txt": "once\n"}
    assert len(rows) == 2


def test_codes_of_cycles_are_in_the_table():
    """Every number that a cycle may report has its meaning."""
    assert {code for code in CODES if code in ERRORS} == CODES - {
        code for code in range(907101, 907111) if code not in ERRORS
    }


# declarations


def test_names_are_found_in_any_case_with_or_without_extension():
    """Folders, case and the extension do not matter for a built-in cycle."""
    assert find("SYSCALCCIRCLE.ECY") is find("cycles/SysCalcCircle") is not None
    assert find("SysCalc") is None


@pytest.mark.parametrize("cycle", CYCLES, ids=lambda c: c.name)
def test_declarations_are_sound(cycle):
    """Numbers are unique and in 1..200, defaults lie in their ranges, required
    parameters have none.
    """
    numbers = [p.number for p in cycle.parameters]
    assert len(set(numbers)) == len(numbers)
    for p in cycle.parameters:
        assert 1 <= p.number <= 200
        assert p.default is None or (
            not p.required and p.low <= p.default <= p.high
        )


@pytest.mark.parametrize(
    "value", [0.0, -0.0, 1e-300, 1e-7, 0.1, 1 / 3, 123456789.123, -5.0, 1e9]
)
def test_numbers_written_into_a_cycle_have_no_exponent(value):
    """The text is digits with an optional point and gives the number back."""
    text = number_text(value)
    assert re.fullmatch(r"-?\d+(\.\d+)?", text)
    assert float(text) == pytest.approx(value, rel=1e-15, abs=1e-19)


# pockets


def made(**given):
    """The moves of a pocket call (tool radius 5), as polylines: [(points, feed kind)]."""
    cycle = find("SysMillRectangularPocket")
    values = {
        1: 0.0,
        2: 50.0,
        3: 2.0,
        4: 12.0,
        5: 4.0,
        6: 5.0,
        20: 600.0,
        21: 300.0,
        72: 40.0,
        73: 30.0,
    }
    values |= {int(k[1:]): float(v) for k, v in given.items()}
    around = Surroundings(("X", "Y", "Z"), (0.0, 0.0, 60.0), 1.0, 5.0, 0.0)
    work = cycle.build(Given(values, cycle.parameters), around)
    return work, values


def path_of(tmp_path, work):
    """(n, 3) dense points of the tool's centre while it cuts, from the rows of the program."""
    (tmp_path / "p.nc").write_text(
        "\n".join(["G00 Z60", *work.lines, "M30", ""])
    )
    used = machine()
    reader = create(
        "isg", tmp_path / "p.nc", used, OfflinePort(used.start), collect=True
    )
    points, at = [], np.zeros(3)
    for batch in read_all(reader):
        for row in batch.rows:
            if row["type"] > 2:
                continue
            end = row["end"][:3].copy()
            if row["type"] == 2:
                centre, angle = row["center"], row["angle"]
                first = np.arctan2(at[1] - centre[1], at[0] - centre[0])
                turn = np.linspace(0, angle, 200)
                xy = centre + row["radius"] * np.column_stack(
                    [np.cos(first + turn), np.sin(first + turn)]
                )
                z = np.linspace(at[2], end[2], 200)
                points += [*np.column_stack([xy, z])]
            else:
                points += [at, end]
            at = end
    assert not reader.errors
    return np.array(points)


def area(values, edge=0.0):
    """The pocket as a polygon of its own coordinates."""
    r = values.get(65, 5.0)
    x, y = values[72] / 2, values[73] / 2
    shape = (
        box(-x + r, -y + r, x - r, y - r)
        if min(x, y) > r
        else LineString([(r - x, r - y), (x - r, y - r)])
    )
    return shape.buffer(r, quad_segs=400).buffer(-edge)


CASES = {
    "roughing": {"p31": 1, "p32": 1},
    "by default": {},
    "straight infeed": {"p34": 1, "p32": 1},
    "straight infeed, square": {"p34": 1, "p72": 20, "p73": 20},
    "square": {"p72": 20, "p73": 20},
    "square, up-cut": {"p72": 20, "p73": 20, "p32": 1, "p30": 1},
    "upright": {"p72": 15, "p73": 44, "p6": 10},
    "corners": {"p65": 9, "p6": 3.3, "p32": 1},
    "helix": {"p31": 1, "p32": 2, "p8": 4, "p7": 1.5},
    "both": {"p31": 3, "p15": 0.5, "p16": 0.4, "p65": 7, "p30": 1},
    "finishing": {"p31": 2, "p16": 0.4, "p65": 8},
    "tight": {"p72": 10.001, "p73": 10.001, "p32": 1},
    "slot": {"p72": 50, "p73": 10, "p32": 1},
}


@pytest.mark.parametrize("case", CASES)
def test_the_tool_stays_inside_the_pocket_and_leaves_nothing(tmp_path, case):
    """Swept area inside the pocket at every level; the floor is cleared; depth
    exact, infeeds in range.
    """
    work, values = made(**CASES[case])
    points = path_of(tmp_path, work)
    wall = area(values)
    below = points[points[:, 2] < -1e-9]
    assert below[:, 2].min() == -12.0
    centre = LineString(below[:, :2])
    assert wall.contains(centre)
    assert centre.distance(wall.exterior) >= 5.0 - 2e-4
    levels = np.unique(np.round(below[:, 2], 9))
    if values.get(31, 3) != 2 and "p32" not in CASES[case]:
        assert np.diff(np.concatenate([levels, [0.0]])).max() <= 4.0 + 1e-9
    if values.get(31, 3) == 2:
        return
    floor = below[below[:, 2] < -12.0 + 0.5 + 1e-9]
    swept = LineString(floor[:, :2]).buffer(5.0, quad_segs=200)
    assert wall.difference(swept.buffer(1e-3)).area < 1e-2


def test_the_finished_wall_is_exact(tmp_path):
    """Roughing leaves the allowances, finishing takes them."""
    work, _ = made(p31=1, p15=1, p16=0.5, p65=6)
    rough = path_of(tmp_path, work)
    assert rough[:, 2].min() == -11.0
    assert np.abs(rough[rough[:, 2] < 0][:, 0]).max() == pytest.approx(14.5)
    work, _ = made(p31=3, p15=1, p16=0.5, p65=6)
    done = path_of(tmp_path, work)
    assert done[:, 2].min() == -12.0
    assert np.abs(done[done[:, 2] < 0][:, 0]).max() == pytest.approx(15.0)
    assert np.abs(done[done[:, 2] < 0][:, 1]).max() == pytest.approx(10.0)


def test_rotation_turns_the_whole_path_about_the_centre(tmp_path):
    """@P42 and @P40, @P41 only place the path."""
    plain = path_of(tmp_path, made()[0])
    turned = path_of(tmp_path, made(p42=37, p40=12, p41=-7)[0])
    c, s = np.cos(np.radians(37)), np.sin(np.radians(37))
    low, other = (path[2:][path[2:, 2] < 2] for path in (plain, turned))
    assert other[:, :2] == pytest.approx(
        low[:, :2] @ np.array([[c, s], [-s, c]]) + [12, -7], abs=1e-9
    )


def test_helix_pitch_and_radius(tmp_path):
    """No turn of the plunge falls more than the pitch; the helix keeps its radius."""
    work, _ = made(p32=2, p7=1.5, p8=4)
    arcs = [line for line in work.lines if line.startswith("G03")]
    heights = [float(re.search(r"Z(\S+)", line)[1]) for line in arcs]
    steps = np.diff([0.0, *heights])
    assert steps.min() >= -1.5 - 1e-9
    assert all("I-4 J0" in line for line in arcs)


def test_ring_parallel_to_the_edge():
    """The outermost ring is the pocket's edge offset inwards by radius and allowance."""
    ring = pocket.outermost(pocket.Pocket(40, 30, 9, 1, 0, 1, 5, 1, 1), 1.0)
    assert (ring.x, ring.y, ring.corner) == (14.0, 9.0, 3.0)
    assert Point(14.0, 0.0).within(area({72: 40, 73: 30, 65: 9.0}))


# patterns

AT = (
    "#PATTERN BEGIN [ID=1]\n#AT [100, 0, 0]\n"
    "#AT [100, 100, 5, 0, 0, 60]\n#AT [0, 100, 10]\n#PATTERN END\n"
)
POCKET = "@P1=0 @P2=50 @P3=2 @P4=12 @P5=4 @P6=5 @P20=6000 @P21=4000 @P31=1 @P32=1 @P72=20 @P73=20"


def ends(tmp_path):
    """(n, 3) axis positions behind each motion, coordinate systems taken into account."""
    program = Program(
        tmp_path / "main.nc", CellConfig(tools={"1": ToolConfig(radius_mm=5.0)})
    )
    batches = list(program.batches())
    program.reader.close()
    return np.array(
        [
            row["end"][:3]
            for batch in batches
            for row in batch.rows
            if row["type"] <= 3
        ]
    )


def test_pattern_of_pockets_in_order(tmp_path):
    """PAT-1: Z100, place, cycle, three times; infeeds of 4 mm; surface,
    retraction plane and floor of each place.
    """
    call = f"L CYCLE [NAME=SysMillRectangularPocket.ecy {POCKET} PATTERN_ID=1 PATTERN_RETRACT=100]"
    (tmp_path / "main.nc").write_text(
        f"D1\n{AT}G00 Z60\nG00 X50 Y50\n{call}\nM30\n"
    )
    points = ends(tmp_path)
    positioned = [
        tuple(p[:2])
        for p, before in zip(points[1:], points, strict=False)
        if p[2] == before[2] == 100.0
    ]
    assert positioned == [(100.0, 0.0), (100.0, 100.0), (0.0, 100.0)]
    for (x, y), surface in zip(positioned, (0.0, 5.0, 10.0), strict=True):
        near = points[np.hypot(points[:, 0] - x, points[:, 1] - y) < 8.0]
        floors = sorted(
            {round(float(z), 9) for z in near[:, 2] if z < surface - 1e-9}
        )
        assert floors == [surface - 12.0, surface - 8.0, surface - 4.0]
        assert surface + 50.0 in near[:, 2]
    turned = points[(np.abs(points[:, 2] + 7.0) < 1e-9)]
    corner = np.array([96.339746, 113.660254]) - [100.0, 100.0]
    assert (
        np.abs(turned[:, :2] - [100.0, 100.0] - corner / 2).max(axis=1).min()
        < 1e-6
    )
    assert tuple(points[-1]) == (0.0, 100.0, 60.0)


def test_user_cycle_finds_its_place_and_its_parameters(tmp_path):
    """A user's cycle starts at (0, 0, retract - z) of every place, with numbers
    and texts as in the call.
    """
    text = (
        f'{AT}G01 F100 X5\nL CYCLE [NAME=c.ecy @P1=0.1 @P7="a b" PATTERN_I'
        f"D=1 PATTERN_RETRACT=100]\n"
    )
    text += '#MSG ["%d %d", V.G.CS_ACTIVE, V.G.CS_COUNT]\nM30\n'
    cycle = '#MSG ["%s %.17f %f %f %f", @P7, @P1, V.A.ABS.X, V.A.ABS.Y, V.A.ABS.Z]\nG01 X3\nM17\n'
    reader, port, _, _ = cycle_run(tmp_path, text, c__ecy=cycle)
    assert not reader.errors
    at = "a b 0.10000000000000001 0.000000 0.000000"
    assert port.messages == [
        f"{at} 100.000000",
        f"{at} 95.000000",
        f"{at} 90.000000",
        "0 0",
    ]


def test_the_pattern_leaves_plane_and_measure_to_the_cycle(tmp_path):
    """A user's cycle finds G91 and the plane as its caller has them."""
    text = f"{AT}G91 G18\nL CYCLE [NAME=c.ecy PATTERN_ID=1 PATTERN_RETRACT=20]\nM30\n"
    (tmp_path / "c.ecy").write_text("G02 F100 X2 Z0 I1\nM17\n")
    (tmp_path / "main.nc").write_text(text)
    arcs = [p for p in ends(tmp_path) if p[2] == 20.0 and p[0] in (102.0, 2.0)]
    assert len(arcs) == 2


def test_pocket_under_other_modes(tmp_path):
    """G95, G70, G91, G19, G161, G51: the same motions as plain, in the units of the call."""
    call = "L CYCLE [NAME=SysMillRectangularPocket.ecy {} @P20=600 @P21=300 @P31=1 @P65={}]"
    plain = (
        "@P1=0 @P2=50.8 @P3=2.54 @P4=12.7 @P5=5.08 @P6=5.08 @P72=50.8 @P73=25.4"
    )
    inch = "@P1=0 @P2=2 @P3=0.1 @P4=0.5 @P5=0.2 @P6=0.2 @P72=2 @P73=1"
    found = []
    for modes, values, corner in (
        ("G71", plain, 7.62),
        ("G70 G91 G19 G161 G95 G51 S100", inch, 0.3),
    ):
        (tmp_path / "main.nc").write_text(
            f"D1\nG00 Z80\n{modes}\n{call.format(values, corner)}\nM30\n"
        )
        found.append(ends(tmp_path))
    assert found[1] == pytest.approx(found[0], abs=1e-9)


def test_local_cycle_at_a_pattern(tmp_path):
    """LL CYCLE finds the local subprogram of the caller's file."""
    text = (
        f'%L C\n#MSG ["%f", V.A.ABS.Z]\nM17\n%MAIN\n'
        f"{AT}LL CYCLE [NAME=C PATTERN_ID=1 PATTERN_RETRACT=20]\nM30\n"
    )
    reader, port, _, _ = cycle_run(tmp_path, text)
    assert not reader.errors
    assert port.messages == ["20.000000", "15.000000", "10.000000"]


def test_wrong_cycle_at_a_pattern_is_refused_before_the_first_place(tmp_path):
    """The parameters of a built-in cycle are checked ahead of all motion."""
    text = f"{AT}L CYCLE [NAME=SysHscSettings @P1=7 PATTERN_ID=1 PATTERN_RETRACT=20]\nM30\n"
    reader, _, rows, _ = cycle_run(tmp_path, text)
    assert [e.code for e in reader.errors] == [13320]
    assert [int(row["type"]) for row in rows] == [5]


def test_pattern_in_inches_keeps_its_places(tmp_path):
    """Places are lengths: defined under G70, called under G71."""
    text = "G70\n#PATTERN BEGIN [ID=1]\n#AT [1, 2, 0.5]\n#PATTERN END\nG71\n"
    text += "L CYCLE [NAME=c.ecy PATTERN_ID=1 PATTERN_RETRACT=20]\nM30\n"
    (tmp_path / "c.ecy").write_text("G00 X0 Y0 Z0\nM17\n")
    (tmp_path / "main.nc").write_text(text)
    assert ends(tmp_path)[-1] == pytest.approx([25.4, 50.8, 12.7])


# with coordinate systems and transformations


def test_mode_3_sets_the_coordinate_system(tmp_path):
    """RTP-2 ISG: (10, 20, 5) of the new system; #CS OFF ends it; the tool
    retracts along Z before.
    """
    call = (
        "L CYCLE [NAME=SysPosRotationToPlane.ecy @P1=3 @P2=50 @P3=140 "
        "@P4=0 @P5=-80 @P15=60 @P16=0 @P17=90]"
    )
    (tmp_path / "main.nc").write_text(
        f"G00 X1 Y2 Z3\n{call}\nG00 X10 Y20 Z5\n#CS OFF\nG00 X1 Y2 Z3\nM30\n"
    )
    points = ends(tmp_path)
    assert points == pytest.approx(
        np.array(
            [(1, 2, 3), (1, 2, 53), (134.330127, 10.0, -60.179492), (1, 2, 3)]
        ),
        abs=1e-6,
    )


RTP_2_BEC = {
    "as programmed": ("@P3=0 @P4=0 @P5=0", (-14.330127, 10.0, -14.820508)),
    "as described": ("@P3=140 @P4=0 @P5=80", (125.669873, 10.0, 65.179492)),
}


@pytest.mark.parametrize("case", RTP_2_BEC)
def test_origin_of_the_other_edition(tmp_path, case):
    """RTP-2 BEC with the origin of its code and of its text."""
    origin, wanted = RTP_2_BEC[case]
    call = f"L CYCLE [NAME=SysPosRotationToPlane.ecy @P1=3 {origin} @P15=-60 @P17=90]"
    (tmp_path / "main.nc").write_text(f"{call}\nG00 X10 Y20 Z5\nM30\n")
    assert ends(tmp_path)[-1] == pytest.approx(np.array(wanted), abs=1e-6)


@pytest.mark.parametrize(
    ("points", "z"), [(ISG_POINTS, -6.002450), (BEC_POINTS, 6.002450)]
)
def test_points_in_the_new_system(tmp_path, points, z):
    """RTP-1: the three points lie beside the new plane by the same distance: the origin rules."""
    sign = 1 if z < 0 else -1
    call = f"L CYCLE [NAME=SysPosRotationToPlane.ecy @P1=3 @P3=140 @P4=0 @P5={-80 * sign} {points}]"
    inside = f"G00 X30 Y67.741941 Z{z}\nX70 Y67.741941\nX70 Y38.587182\n"
    (tmp_path / "main.nc").write_text(f"{call}\n{inside}M30\n")
    wanted = [
        (100, 30, -25 * sign),
        (100, 70, -25 * sign),
        (115, 70, -50 * sign),
    ]
    assert ends(tmp_path) == pytest.approx(
        np.array(wanted, dtype=float), abs=1e-5
    )


TABLES = """
[axes.X]
[axes.Y]
[axes.Z]
[axes.A]
kind = "rotary"
[axes.C]
kind = "rotary"
[tools.1]
length_mm = 80.0
[kinematics.9]
type = "table-table"
rotary = ["C", "A"]
directions = { A = [-1.0, 0.0, 0.0], C = [0.0, 0.0, -1.0] }
points = { A = [0.0, 0.0, -50.0], C = [0.0, 0.0, 0.0] }
"""
HEADS = """
[axes.X]
[axes.Y]
[axes.Z]
[axes.C]
kind = "rotary"
[axes.B]
kind = "rotary"
[tools.1]
length_mm = 80.0
[kinematics.9]
type = "head-head"
linear = ["X", "Y", "Z"]
rotary = ["C", "B"]
points = { C = [0.0, 0.0, 0.0], B = [0.0, 0.0, 246.5] }
"""


@pytest.mark.parametrize("mode", [1, 2])
@pytest.mark.parametrize(
    "config", [TABLES, HEADS], ids=["table-table", "head-head"]
)
def test_tool_is_turned_to_the_plane(tmp_path, config, mode):
    """RTP-1 on machines: retraction along Z, then rotary axes alone; mode 1
    leaves the system on, mode 2 does not.
    """
    call = (
        f"L CYCLE [NAME=SysPosRotationToPlane.ecy @P1={mode} @P2=50 "
        f"@P3=140 @P4=0 @P5=-80 {ISG_POINTS}]"
    )
    text = f"D1\nG00 X10 Y10 Z10\n#KIN ID[9]\n#TRAFO ON\nG00 X1 Y2 Z3\n{call}\n"
    text += '#MSG ["%d", V.G.CS_COUNT]\nG00 X30 Y67.741941 Z10\n#CS OFF\n#TRAFO OFF\nM30\n'
    (tmp_path / "main.nc").write_text(text)
    cell = parse_config(config)
    program = Program(tmp_path / "main.nc", cell, programmed=True)
    rows = [
        row
        for batch in program.batches()
        for row in batch.rows
        if row["type"] <= 3
    ]
    program.reader.close()
    assert program.port.messages == ["1" if mode == 1 else "0"]
    retracted, turned, last = rows[-3:]
    assert retracted["end"][:3] == pytest.approx([1, 2, 53])
    names = list(cell.axes)
    angle = {name: turned["end"][i] for i, name in enumerate(names)}
    about = "A" if "A" in angle else "B"
    assert abs(angle[about]) == pytest.approx(59.036243, abs=1e-5)
    assert last["end"][3:5] == pytest.approx(turned["end"][3:5])
    wanted = (30.0, 67.741941, 10.0)
    if mode == 1:
        turn = from_points(
            np.array(
                [(100, 30, -25), (100, 70, -25), (115, 70, -50)], dtype=float
            )
        )
        wanted = np.array([140.0, 0.0, -80.0]) + turn @ np.array(wanted)
    assert last["end"][:3] == pytest.approx(wanted, abs=1e-6)
