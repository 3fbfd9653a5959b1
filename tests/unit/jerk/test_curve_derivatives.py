"""What the jerk-limited planner takes for the third derivative of smoothed
curves is what the axes are driven by.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from cnc_core.config import parse_config
from cnc_core.planning import plan_program
from cnc_core.program import Program

AXIS = "[axes.{}]\nv_max_mm_s = {}\na_max_mm_s2 = {}\nj_max_mm_s3 = {}\n"
# name: (cycle, limits of X Y Z, feed, blocks)
CASES = {
    "engraving": (
        0.0005,
        [(300, 3000, 50000)] * 3,
        6000,
        "G01 X2 Y4|X2.3129 Y4.2717|X2.618 Y3.9948|X2.908 Y3.5147|X3.1756 "
        "Y3.4417|X3.4142 Y3.6263|X3.618 Y3.4183|"
        "X3.782 Y2.7718|X3.9021 Y2.3327|X3.9754 Y2.3598|X4 Y2.300|"
        "X3.9754 Y1.7341|X3.9021 Y1.0966|X3.782 Y0.9558|"
        "X3.618 Y1.0671|X3.4142 Y0.7979|X3.1756 Y0.2056|X2.908 Y-0.0493|"
        "X2.618 Y0.1906|X2.3129 Y0.3209|X2.000 Y0.0000|"
        "X1.6871 Y-0.2717|X1.382 Y0.0052|X1.092 Y0.4853",
    ),
    "unequal axes": (
        0.001,
        [(100, 300, 50000), (20, 1000, 5000), (20, 1000, 1000000)],
        18000,
        "G01 X-20.6201 Y41.6988 Z-31.0535|G01 X-20.4871 Y41.6434 "
        "Z-31.0638|G02 X-23.3904 Y42.4799 I-1.0027 J1.9765|"
        "G03 X-57.5548 Y35.7121 I-17.0118 J-3.7392 Z-29.5638|G03 "
        "X-57.4705 Y35.6887 I1.2104 J4.2013 Z-28.0638|"
        "G01 X-57.0599 Y34.5884|G03 X-57.2694 Y34.7314 I1.6132 J2.5891|G01 X-56.9442 Y35.0906|"
        "G02 X-57.169 Y35.5768 I1.4962 J0.9867 Z-26.5638",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_jerk_of_blended_corners_within_microns(
    name: str, tmp_path: Path
) -> None:
    """Corners blended within 0.003 mm: sampled at the cycle, the jerk stays
    within 1.5 % of each axis' own limit.
    """
    cycle, limits, feed, blocks = CASES[name]
    cell = f'name = "c"\ncycle_s = {cycle}\n' + "".join(
        AXIS.format(a, *m) for a, m in zip("XYZ", limits, strict=True)
    )
    path = tmp_path / "part.nc"
    path.write_text(
        "\n".join(["G90 G71", f"F{feed}", *blocks.split("|"), "M30", ""])
    )
    result = plan_program(
        Program(path, parse_config(cell, "c"), "isg", tolerance=0.003),
        window=120,
    ).as_json()
    assert result["max_ratio"]["jerk"] <= 1.015
    assert result["path_deviation_mm"] <= 0.003


def test_jerk_of_blends_of_a_micrometre(tmp_path: Path) -> None:
    """Corners within 1e-5 mm are crept through: blends of a micrometre take
    many cycles (jerk before: 1.086).
    """
    limits = [(201.8, 2270, 6535), (532.4, 6973, 5709), (151.2, 526.1, 84330)]
    cell = 'name = "c"\ncycle_s = 0.00025\n' + "".join(
        AXIS.format(a, *m) for a, m in zip("XYZ", limits, strict=True)
    )
    path = tmp_path / "part.nc"
    path.write_text(
        "G90\nG1 X0.0315 Y0.2735 F3057\nX0.0497 Y0.5481\nX0.0545 Y0.8233\nX0.0459 Y1.0985\nM30\n"
    )
    result = plan_program(
        Program(path, parse_config(cell, "c"), "isg", tolerance=1e-5),
        window=120,
    ).as_json()
    assert result["max_ratio"]["jerk"] <= 1.015
    assert result["path_deviation_mm"] <= 1e-5


# cycle, limits of X Y Z, feed, tolerance, points: axes many times slower than others
BESIDE = {
    "a corner": (
        0.001,
        [(200, 10000, 200000), (30, 1000, 5000), (100, 1000, 20000)],
        12000,
        0.1,
        [(19.81, 2.78), (35.57, 15.09)],
    ),
    "twelve lines": (
        0.001,
        [(11.2, 1100, 1940), (347, 1800, 247000), (28, 1850, 1440)],
        30000,
        0.2,
        [
            (2.1, 0.5),
            (3.7, -0.3),
            (4.4, -1.2),
            (5.3, -1.9),
            (11.6, -7.8),
            (11.2, -10.1),
            (11.2, -15.9),
            (10.6, -18.9),
            (9.6, -21.7),
            (9.7, -24.1),
            (9.1, -27.9),
            (7.7, -30.6),
        ],
    ),
    "three lines": (
        0.001,
        [(92.6, 8410, 581000), (11.8, 779, 4300), (77.4, 2980, 4850)],
        6000,
        0.05,
        [(99.2, 64.5), (124.7, 67.0), (132.8, 59.1)],
    ),
    "six lines": (
        0.001,
        [(166, 2590, 144000), (16.9, 4800, 2660), (12.1, 176, 12400)],
        6000,
        0.2,
        [
            (29.0, -19.6),
            (26.3, -1.4),
            (28.5, 6.5),
            (19.7, 7.3),
            (-14.8, -7.5),
            (-16.2, -1.8),
        ],
    ),
    "other twelve": (
        0.001,
        [(163, 329, 550000), (21.9, 3260, 1250), (83.7, 933, 357000)],
        6000,
        0.5,
        [
            (16.219, -4.243),
            (21.037, -3.808),
            (41.181, -7.458),
            (72.347, -13.214),
            (76.451, -13.929),
            (88.737, -8.701),
            (93.722, -7.022),
            (104.989, -0.114),
            (105.517, -0.02),
            (121.441, 2.75),
            (125.592, 5.243),
            (137.921, 20.404),
        ],
    ),
}


@pytest.mark.parametrize("name", BESIDE)
def test_jerk_of_an_axis_that_the_path_outruns(
    name: str, tmp_path: Path
) -> None:
    """Where a slow axis moves little the path is many times as fast as it may
    be, so its third derivative counts at that speed (jerk before: 1.07 to 1.34).
    """
    cycle, limits, feed, tolerance, points = BESIDE[name]
    cell = f'name = "c"\ncycle_s = {cycle}\n' + "".join(
        AXIS.format(a, *m) for a, m in zip("XYZ", limits, strict=True)
    )
    path = tmp_path / "part.nc"
    lines = [f"G1 X{x} Y{y}" for x, y in points]
    path.write_text("\n".join([f"G90 G71 F{feed}", *lines, "M30", ""]))
    result = plan_program(
        Program(path, parse_config(cell, "c"), "isg", tolerance=tolerance),
        window=120,
    ).as_json()
    assert result["max_ratio"]["jerk"] <= 1.015
    assert result["path_deviation_mm"] <= tolerance
