"""Kinematic chains against a construction of their own: 4x4 matrices of scipy
rotations, multiplied one by one.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cnc_core.config.kinematics import KinematicsConfig
from cnc_core.errors import CncError
from cnc_core.kinematics import inverse
from cnc_core.kinematics.chain import SingularMachine, Step
from cnc_core.kinematics.machine import Kinematics
from cnc_core.kinematics.machine_types import (
    CHAINS,
    CUTS,
    Element,
    machine_chain,
)

NAMES = ("LI1", "LI2", "LI3", "WRK", "TOL")
TYPES = list(itertools.product(CHAINS, CUTS))
WIDE = np.full(5, 1e5)


def random_step(rng: np.random.Generator) -> tuple[float, ...]:
    return (*rng.uniform(-300, 300, 3), *rng.uniform(-180, 180, 3))


def matrix(step: tuple[float, ...]) -> np.ndarray:
    """Tr(offset) Rx Ry Rz."""
    out = np.eye(4)
    out[:3, :3] = Rotation.from_euler("XYZ", step[3:], degrees=True).as_matrix()
    out[:3, 3] = step[:3]
    return out


def joint(name: str, value: float) -> np.ndarray:
    out = np.eye(4)
    if name in ("WRK", "TOL"):
        out[:3, :3] = Rotation.from_euler("Z", value, degrees=True).as_matrix()
    elif name not in ("t", "w"):
        out[2, 3] = value
    return out


def part_to_tool(
    mac: str, bed: str, steps: dict[str, tuple[float, ...]], q: dict[str, float]
) -> np.ndarray:
    """inv(bed to part) (bed to tool), from the texts of sections 9.3 and 10.2 alone."""
    order = (
        "T LI3 LI2 LI1 TOL WRK P|T TOL LI3 LI2 LI1 WRK P|T TOL WRK LI3 "
        "LI2 LI1 P|T LI3 LI2 TOL LI1 WRK P"
    )
    order += (
        "|T LI3 TOL LI2 LI1 WRK P|T TOL LI3 LI2 WRK LI1 P|T TOL LI3 WRK "
        "LI2 LI1 P|T LI3 TOL LI2 WRK LI1 P"
    )
    listed = dict(
        zip(
            ["WRK", "MIX", "TOL", "WC1", "WC2", "TC1", "TC2", "C12"],
            order.split("|"),
            strict=True,
        )
    )
    from_part = listed[mac].split()[::-1][1:-1]
    cut = {
        "WRK": ("LI1", 0),
        "B12": ("LI1", 1),
        "BC1": ("LI2", 0),
        "B23": ("LI2", 1),
        "BC2": ("LI3", 0),
    }
    element, behind = {**cut, "TOL": ("LI3", 1)}[bed]
    at = from_part.index(element) + behind
    sides = []
    for side in ([*from_part[:at][::-1], "w"], [*from_part[at:], "t"]):
        product = np.eye(4)
        for name in side:
            product = (
                product @ matrix(steps[name]) @ joint(name, q.get(name, 0.0))
            )
        sides.append(product)
    return np.linalg.inv(sides[0]) @ sides[1]


def random_machine(rng, mac, bed):
    steps = {name: random_step(rng) for name in (*NAMES, "t", "w")}
    made = {name: Step(step[:3], step[3:]) for name, step in steps.items()}
    elements = {name: Element(i, made[name]) for i, name in enumerate(NAMES)}
    chain = machine_chain(mac, bed, elements, made["w"], made["t"])
    return steps, Kinematics(chain, (0, 1, 2), -WIDE, WIDE)


@pytest.mark.parametrize(("mac", "bed"), TYPES)
def test_forward_is_the_product_of_the_steps(mac, bed):
    """All eight chains with all six beds: tip, direction and orientation, within 1e-9."""
    rng = np.random.default_rng([1, *map(ord, mac + bed)])
    for _ in range(5):
        steps, kin = random_machine(rng, mac, bed)
        q, length = (
            np.r_[rng.uniform(-500, 500, 3), rng.uniform(-400, 400, 2)],
            rng.uniform(0, 200),
        )
        expected = part_to_tool(
            mac, bed, steps, dict(zip(NAMES, q, strict=True))
        )
        pose = kin.forward(q, length)
        assert np.abs(pose.rotation[0] - expected[:3, :3]).max() < 1e-12
        assert (
            np.abs(pose.tip[0] - (expected @ [0, 0, -length, 1])[:3]).max()
            < 1e-9
        )
        assert np.abs(pose.direction[0] - expected[:3, 2]).max() < 1e-12


@pytest.mark.parametrize(("mac", "bed"), TYPES)
def test_inverse_brings_back_pose_and_position(mac, bed):
    """Every branch points the tool into the direction and holds the tip; the
    nearest one to a position is it.
    """
    rng = np.random.default_rng([2, *map(ord, mac + bed)])
    done = 0
    while done < 8:
        _, kin = random_machine(rng, mac, bed)
        q, length = (
            np.r_[rng.uniform(-500, 500, 3), rng.uniform(-400, 400, 2)],
            rng.uniform(0, 200),
        )
        pose = kin.forward(q, length)
        found = inverse.branches(kin.chain, pose.direction[0])
        if (
            len(found) < 2
            or abs(
                np.sin(np.radians(found[0].angles[1] - found[1].angles[1]) / 2)
            )
            < 0.02
        ):
            continue  # where the branches meet, angles are as good as the square root of rounding
        try:
            for branch in found:
                at = q.copy()
                at[list(kin.rotary_axes)] = branch.angles
                at = kin.axes_of_tip(pose.tip[0], at, length)[0]
                again = kin.forward(at, length)
                assert np.abs(again.tip - pose.tip).max() < 1e-9
                assert np.abs(again.direction - pose.direction).max() < 1e-9
        except SingularMachine:
            continue
        back = kin.inverse(pose.tip, pose.direction, q, length)[0]
        assert np.abs(back - q).max() < 1e-8 * max(1.0, np.abs(q).max())
        assert (
            np.abs(kin.driven(kin.programmed(q, length), length)[0] - q).max()
            < 1e-8
        )
        done += 1


@pytest.mark.parametrize("mac", CHAINS)
def test_derivatives_are_those_of_the_inverse(mac):
    """First and second derivative of the axes along a path, against central differences."""
    rng = np.random.default_rng([3, *map(ord, mac)])
    _, kin = random_machine(rng, mac, "WRK")
    a = np.r_[rng.uniform(-50, 50, 3), rng.uniform(-40, 40, 2)]
    b = np.r_[rng.uniform(-50, 50, 3), rng.uniform(20, 80, 2)]
    bend = np.r_[rng.uniform(-20, 20, 3), rng.uniform(-20, 20, 2)]

    def at(s: float) -> np.ndarray:
        return kin.driven(a + s * (b - a) + s * s * bend, 120.0)[0]

    jets = np.stack(
        [a + 0.3 * (b - a) + 0.09 * bend, (b - a) + 0.6 * bend, 2 * bend]
    )[None]
    h = 1e-4
    found = kin.driven_jets(jets, 120.0)[0]
    assert np.allclose(found[0], at(0.3), atol=1e-9)
    assert np.allclose(
        found[1], (at(0.3 + h) - at(0.3 - h)) / (2 * h), rtol=1e-5, atol=1e-3
    )
    assert np.allclose(
        found[2],
        (at(0.3 + h) - 2 * at(0.3) + at(0.3 - h)) / h**2,
        rtol=1e-3,
        atol=1.0,
    )


# ------------------------------------------------------------------------------------------------
# the manual's machine
K = 246.5


def sample_machine(low=-WIDE, high=WIDE) -> Kinematics:
    """Section 10.3: X Y Z A B, K 246.5."""
    elements = {
        "LI1": Element(1, Step(turns=(90, 0, 180))),
        "LI2": Element(0, Step(turns=(0, 90, 0))),
        "LI3": Element(2, Step(turns=(0, -90, 0))),
        "WRK": Element(3, Step()),
        "TOL": Element(4, Step(turns=(-90, 0, 0))),
    }
    chain = machine_chain(
        "TOL",
        "B12",
        elements,
        Step(turns=(90, 0, 180)),
        Step((0, K, 0), (90, 0, 0)),
    )
    return Kinematics(chain, (0, 1, 2), low, high)


@pytest.mark.parametrize(
    ("q", "length", "tip", "d"),
    [
        ((0, 0, 0, 0, 0), 0, (0, 0, -246.5), (0, 0, 1)),
        ((1, 2, 3, 0, 0), 100, (1, 2, -343.5), (0, 0, 1)),
        ((1, 2, 3, 0, 90), 100, (-345.5, 2, 3), (1, 0, 0)),
        ((1, 2, 3, 90, 90), 100, (1, -344.5, 3), (0, 1, 0)),
        (
            (100, 50, 400, 30, 20),
            100,
            (-2.632652991, -9.254989831, 74.396506898),
            (0.296198133, 0.171010072, 0.939692621),
        ),
        (
            (100, 50, 400, -90, 45),
            100,
            (100, 295.012499681, 154.987500319),
            (0, -0.707106781, 0.707106781),
        ),
        (
            (10, 20, 30, 180, -30),
            0,
            (-113.25, 20, -183.475262033),
            (0.5, 0, 0.866025404),
        ),
    ],
)
def test_worked_machine(q, length, tip, d):
    """The table of section 10.3."""
    pose = sample_machine().forward(np.array(q, float), length)
    assert np.abs(pose.tip[0] - tip).max() < 2e-9  # the table is rounded
    assert np.abs(pose.direction[0] - d).max() < 1e-9


def test_branches_of_the_worked_machine():
    """Section 10.4: A30 B20 or A-150 B-20."""
    kin = sample_machine()
    pose = kin.forward(np.array([100, 50, 400, 30.0, 20]), 100)
    found = sorted(
        b.angles for b in inverse.branches(kin.chain, pose.direction[0])
    )
    assert np.allclose(found, [(-150, -20), (30, 20)], atol=1e-9)
    for near, expected in (
        (np.zeros(5), (30, 20)),
        (np.array([0, 0, 0, -140, -10.0]), (-150, -20)),
    ):
        assert np.allclose(kin.orient(pose.direction[0], near)[3:], expected)
        assert np.allclose(
            kin.inverse(pose.tip, pose.direction, near, 100)[0, :3],
            (100, 50, 400),
        )


def test_constructed_part_side_machine():
    """Section 10.4: two tables, MAC WRK with bed WRK."""
    elements = {
        "LI1": Element(0, Step(turns=(0, 90, 0))),
        "LI2": Element(1, Step(turns=(-90, 0, -90))),
        "LI3": Element(2, Step(turns=(90, 0, 0))),
        "TOL": Element(3, Step(turns=(0, 90, 0))),
        "WRK": Element(4, Step(turns=(0, -90, 0))),
    }
    kin = Kinematics(
        machine_chain("WRK", "WRK", elements, Step(), Step()),
        (0, 1, 2),
        -WIDE,
        WIDE,
    )
    pose = kin.forward(np.array([100, 50, 400, 30, 20.0]), 100)
    assert (
        np.abs(
            pose.tip[0] - (160.082190214, 147.441762853, 234.807621135)
        ).max()
        < 1e-8
    )
    assert (
        np.abs(
            pose.direction[0] - (0.171010072, 0.469846310, 0.866025404)
        ).max()
        < 1e-9
    )


def test_singular_direction_keeps_the_axis_that_may_stand_anywhere():
    """B = 0: the tool lies on A, which stays where it is."""
    kin = sample_machine()
    near = np.array([0, 0, 0, 77.0, 12.0])
    assert np.allclose(kin.orient((0, 0, 1), near)[3:], (77, 0))
    assert inverse.branches(kin.chain, (0, 0, 2))[0].free == (True, False)


def test_turns_and_limits():
    """Of equal positions the nearest within the limits; none within them is an error of its own."""
    d = sample_machine().forward(np.array([0, 0, 0, 170.0, 30])).direction[0]
    near = np.array([0, 0, 0, -185.0, 28])
    assert np.allclose(sample_machine().orient(d, near)[3:], (-190, 30))
    low, high = (
        np.array([-1e5, -1e5, -1e5, -180, -90]),
        np.array([1e5, 1e5, 1e5, 180, 90.0]),
    )
    assert np.allclose(
        sample_machine(low, high).orient(d, near)[3:], (-10, -30)
    )
    assert np.allclose(
        sample_machine(low, high * [1, 1, 1, 1, 0.1]).orient(d, near)[3:],
        (-10, -30),
    )
    narrow = np.array([1e5, 1e5, 1e5, 180, 10.0])
    with pytest.raises(CncError) as wrong:
        sample_machine(-narrow, narrow).orient(d, near)
    assert wrong.value.code == 910102


def test_unreachable_direction():
    """A 45 degree head cannot point the tool down; a direction needs a length."""
    elements = {
        n: Element(i, Step(turns=t))
        for i, (n, t) in enumerate(
            [
                ("LI1", (0, 90, 0)),
                ("LI2", (-90, 0, -90)),
                ("LI3", (90, 0, 0)),
                ("WRK", (0, 0, 0)),
                ("TOL", (30, 0, 0)),
            ]
        )
    }
    kin = Kinematics(
        machine_chain("TOL", "WRK", elements, Step(), Step(turns=(-30, 0, 0))),
        (0, 1, 2),
        -WIDE,
        WIDE,
    )
    for direction in ((0, 0, -1), (0, 0, 0), (np.nan, 0, 1)):
        with pytest.raises(CncError) as wrong:
            kin.orient(direction, np.zeros(5))
        assert wrong.value.code == 910101


def test_a_rotary_axis_between_linear_ones_can_make_the_machine_singular():
    """WC1 with B between X and Y: at 90 degrees Z points along X."""
    table = KinematicsConfig(type="WC1", rotary=["C", "B"])
    kin = table.machine(1, ("X", "Y", "Z", "C", "B"), (0, 1, 2), -WIDE, WIDE)
    found = []
    for angle in range(0, 360, 5):
        try:
            kin.driven(np.array([1, 2, 3, 0, float(angle)]), 0.0)
        except SingularMachine as singular:
            found.append((angle, singular.code))
    assert [code for _, code in found] == [910103, 910103]
    assert found[1][0] - found[0][0] == 180
