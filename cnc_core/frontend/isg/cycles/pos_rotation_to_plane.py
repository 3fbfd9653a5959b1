"""SysPosRotationToPlane: turns the tool, the machining coordinate system, or
both to a plane.
"""

from __future__ import annotations

import numpy as np

from cnc_core.frontend.isg.cycles.declaration import (
    ANGLE,
    CONFLICT,
    DEGENERATE,
    MISSING,
    NO_TRAFO,
    PLAIN,
    Cycle,
    CycleError,
    Given,
    Parameter,
    Problem,
    Surroundings,
    Work,
    number_text,
)
from cnc_core.frontend.isg.cycles.text import Writer
from cnc_core.geometry.shapes.rotation import (
    SEQUENCES,
    CollinearError,
    from_angles,
    from_points,
    zyx_angles,
)
from cnc_core.units import FloatArray

RESULT_FILE = "SysPosRotationToPlaneResult.txt"
BOTH, TOOL, SYSTEM, CALCULATE = 1, 2, 3, 4
POINTS, ANGLES = range(6, 15), range(15, 18)
INTRINSIC = 1

PARAMETERS = (
    Parameter(
        1,
        "1 system and tool, 2 tool, 3 system, 4 nothing moves",
        PLAIN,
        default=1.0,
        low=1,
        high=4,
        whole=True,
    ),
    Parameter(2, "retraction along Z, relative", default=0.0, low=0.0),
    *(
        Parameter(3 + i, f"new origin, {axis} (modes 1 and 3)", default=0.0)
        for i, axis in enumerate("XYZ")
    ),
    *(
        Parameter(
            6 + 3 * point + i, f"point {point + 1}, {axis} (without @P15-17)"
        )
        for point in range(3)
        for i, axis in enumerate("XYZ")
    ),
    *(
        Parameter(
            15 + i,
            f"angle about {axis} (without @P6-14)",
            ANGLE,
            default_text="0 if another angle is given",
        )
        for i, axis in enumerate("XYZ")
    ),
    Parameter(
        18,
        "1 intrinsic, 2 extrinsic",
        PLAIN,
        default=1.0,
        low=1,
        high=2,
        whole=True,
    ),
    Parameter(
        19,
        "sequence: 1 XYZ, 2 XZY, 3 YXZ, 4 YZX, 5 ZXY, 6 ZYX",
        PLAIN,
        default=6.0,
        low=1,
        high=6,
        whole=True,
    ),
    Parameter(
        20,
        f"1 writes {RESULT_FILE}",
        PLAIN,
        default=0.0,
        low=0,
        high=1,
        whole=True,
    ),
)


def definition(given: Given, around: Surroundings) -> list[Problem]:
    """All nine coordinates of the points, or at least one angle; not both."""
    points = [n for n in POINTS if n in given.programmed]
    angles = [n for n in ANGLES if n in given.programmed]
    if points and angles:
        text = (
            f"CYC_PARAM_CONFLICT: points (@P{points[0]}) and "
            f"angles (@P{angles[0]}) exclude each other"
        )
        return [Problem(CONFLICT, text, angles[0])]
    if not points and not angles:
        return [
            Problem(
                MISSING,
                "CYC_PARAM_MISSING: neither points (@P6 to @P14) "
                "nor angles (@P15 to @P17) are given",
            )
        ]
    if angles or len(points) == len(POINTS):
        return []
    points_missing = [n for n in POINTS if n not in given.programmed]
    names = {p.number: p.text.partition(" (")[0] for p in PARAMETERS}
    return [
        Problem(
            MISSING, f"CYC_PARAM_MISSING: @P{n} ({names[n]}) is not given", n
        )
        for n in points_missing
    ]


def transformation(given: Given, around: Surroundings) -> list[Problem]:
    """The tool can be turned only by a complete kinematic transformation."""
    wrong_mode = 1 in given.programmed and 1 not in given
    if around.trafo or wrong_mode or given[1] not in (BOTH, TOOL):
        return []
    text = (
        f"CYC_NO_TRAFO: mode {given[1]:g} turns the tool: "
        "it needs an active kinematic transformation (#TRAFO ON)"
    )
    return [Problem(NO_TRAFO, text, 1)]


def rotation_of(given: Given) -> FloatArray:
    """(3, 3) the new axes as columns, in the coordinate system before the call."""
    if POINTS[0] in given:
        values = [given[number] for number in POINTS]
        points = np.array(values, dtype=np.float64).reshape(3, 3)
        try:
            return from_points(points)
        except CollinearError as error:
            raise CycleError(DEGENERATE, f"CYC_DEGENERATE: {error}") from None
    x, y, z = (given.values.get(n, 0.0) for n in ANGLES)
    return from_angles(
        (x, y, z),
        SEQUENCES[int(given[19]) - 1],
        intrinsic=given[18] == INTRINSIC,
    )


def result_text(rotation: FloatArray) -> str:
    """The file: one axis a line, six decimals, no -0."""
    lines = []
    axes = np.round(rotation.T, 6) + 0.0
    for name, axis in zip("XYZ", axes, strict=True):
        lines.append(
            f"{name}-Axis: {axis[0]:.6f} {axis[1]:.6f} {axis[2]:.6f}\n"
        )
    return "".join(lines)


def build(given: Given, around: Surroundings) -> Work:
    """Retract, turn the coordinate system, turn the tool; write the axes."""
    rotation, mode, work = rotation_of(given), int(given[1]), Work()
    if given[20]:
        work.files[RESULT_FILE] = result_text(rotation)
    if mode == CALCULATE:
        return work
    out = Writer(around)
    if given[2]:
        out.lines += [f"G91 G00 {out.word(2, given[2])}", "G90"]
    origin = (
        (given[3], given[4], given[5])
        if mode in (BOTH, SYSTEM)
        else (0.0, 0.0, 0.0)
    )
    values = ", ".join(
        number_text(value) for value in (*origin, *zyx_angles(rotation))
    )
    out.lines.append(f"#CS ON [{values}]")
    if mode in (BOTH, TOOL):
        out.lines.append("#TOOL ORI CS")
    if mode == TOOL:
        out.lines.append("#CS OFF")
    work.lines = out.lines
    return work


CYCLE = Cycle(
    "SysPosRotationToPlane",
    "turn coordinate system and tool to a plane",
    PARAMETERS,
    build,
    (definition, transformation),
    moves=True,
)
