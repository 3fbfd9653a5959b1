"""SysMillRectangularPocket: roughing, finishing, or both."""

from __future__ import annotations

import math

from cnc_core.errors import ERRORS
from cnc_core.frontend.isg.cycles.declaration import (
    ANGLE,
    CONFLICT,
    FEED,
    INVALID,
    MISSING,
    NO_TOOL,
    PLAIN,
    SPEED,
    Cycle,
    Given,
    Parameter,
    Problem,
    Surroundings,
    Work,
    number_text,
)
from cnc_core.frontend.isg.cycles.text import Writer
from cnc_core.geometry.shapes.pocket import (
    DOWN,
    PLANE,
    Pocket,
    finish,
    placed,
    rough,
)

ROUGHING, FINISHING, BOTH = 1, 2, 3
MODES = {"ROUGHING": 1.0, "FINISHING": 2.0, "ROUGHING+FINISHING": 3.0}
SENSES = {"CLIMBMILLING": 0.0, "UPCUTMILLING": 1.0}
HELICAL = SEMICIRCLE = 2
STORED = 907042
NOTHING_TO_FINISH = 13164
MOVES_MAX = 500_000

P = Parameter
PARAMETERS = (
    P(1, "reference plane, Z", required=True),
    P(2, "retraction plane, Z", required=True),
    P(
        3,
        "safety clearance above the reference plane",
        required=True,
        low=0.0,
        above=True,
    ),
    P(4, "depth below the reference plane", required=True, low=0.0, above=True),
    P(5, "largest infeed in Z", required=True, low=0.0, above=True),
    P(6, "largest infeed in XY", required=True, low=0.0, above=True),
    P(
        7,
        "pitch of the plunge helix",
        low=0.0,
        above=True,
        default_text="10 % of the tool radius",
    ),
    P(
        8,
        "radius of the plunge helix",
        low=0.0,
        above=True,
        default_text="50 % of the tool radius",
    ),
    P(
        13,
        "safety clearance from the wall in XY (finishing)",
        low=0.0,
        above=True,
        default_text="@P72 / 8",
    ),
    P(15, "finishing allowance at the base", default=0.0, low=0.0),
    P(16, "finishing allowance at the edge", default=0.0, low=0.0),
    P(
        20,
        "feed in XY, roughing",
        FEED,
        low=0.0,
        above=True,
        default_text="F in force (V.G.FEEDRATE)",
    ),
    P(
        21,
        "feed in Z, roughing",
        FEED,
        low=0.0,
        above=True,
        default_text="@P20",
    ),
    P(
        22,
        "feed in XY, finishing",
        FEED,
        low=0.0,
        above=True,
        default_text="@P20",
    ),
    P(
        23,
        "feed in Z, finishing",
        FEED,
        low=0.0,
        above=True,
        default_text="@P22",
    ),
    P(
        25,
        "spindle speed, finishing",
        SPEED,
        low=0.0,
        above=True,
        default_text="as it is",
    ),
    P(
        30,
        "0 climb, 1 up-cut milling (with M3)",
        PLAIN,
        default=0.0,
        low=0,
        high=1,
        whole=True,
        names=SENSES,
    ),
    P(
        31,
        "1 roughing, 2 finishing, 3 both",
        PLAIN,
        default=3.0,
        low=1,
        high=3,
        whole=True,
        names=MODES,
    ),
    P(
        32,
        "plunge in Z: 1 vertical, 2 helical",
        PLAIN,
        default=2.0,
        low=1,
        high=2,
        whole=True,
    ),
    P(
        34,
        "infeed in XY: 1 straight, 2 in a semicircle",
        PLAIN,
        default=2.0,
        low=1,
        high=2,
        whole=True,
    ),
    P(40, "centre, X", default_text="current position"),
    P(41, "centre, Y", default_text="current position"),
    P(
        42,
        "rotation about Z through the centre",
        ANGLE,
        default=0.0,
        low=-360.0,
        high=360.0,
    ),
    P(65, "corner radius; 0: that of the tool", default=0.0, low=0.0),
    P(72, "length in X", required=True, low=0.0, above=True),
    P(73, "width in Y", required=True, low=0.0, above=True),
    P(135, "checked, without effect here", low=0.0, default_text="none"),
    P(
        170,
        "checked, without effect here",
        low=0.0,
        above=True,
        default_text="@P6",
    ),
    P(
        171,
        "checked, without effect here",
        FEED,
        low=0.0,
        above=True,
        default_text="@P21",
    ),
)


def conflict(text: str, number: int) -> Problem:
    return Problem(CONFLICT, f"CYC_PARAM_CONFLICT: {text}", number)


def planes(given: Given, around: Surroundings) -> list[Problem]:
    """The retraction plane lies above the clearance, the base allowance above
    the floor and within one infeed.
    """
    found = []
    if {1, 2, 3} <= given.values.keys() and given[1] + given[3] >= given[2]:
        found.append(
            conflict(
                f"@P2 ({given[2]:g}) does not lie above @P1 + @P3 "
                f"({given[1] + given[3]:g})",
                2,
            )
        )
    if 4 in given and given[15] >= given[4]:
        found.append(
            conflict(
                f"@P15 ({given[15]:g}) is not less than the depth @P4 ({given[4]:g})",
                15,
            )
        )
    if 5 in given and given[15] > given[5]:
        found.append(
            conflict(
                f"@P15 ({given[15]:g}) is more than the infeed @P5 ({given[5]:g})",
                15,
            )
        )
    return found


def tool(given: Given, around: Surroundings) -> list[Problem]:
    """The tool has a radius, fits the pocket and its corners, and the cut is
    not wider than the tool.
    """
    radius = around.tool_radius
    if math.isnan(radius):
        return [Problem(910113, f"#SCALE: {ERRORS[910113]}")]
    if radius <= 0:
        return [
            Problem(
                NO_TOOL,
                "CYC_NO_TOOL: the cycle needs a tool data set with a radius (D)",
            )
        ]
    found = []
    if 6 in given and given[6] > 2 * radius * (1 + 1e-12):
        text = (
            f"CYC_PARAM_INVALID: @P6 (largest infeed in XY) is {given[6]:g}, "
            f"allowed: <= {2 * radius:g}, the tool"
        )
        found.append(Problem(INVALID, text, 6))
    sides = [number for number in (72, 73) if number in given]
    narrow = [
        conflict(
            f"@P{number} ({given[number]:g}): the tool (radius {radius:g}) does not fit",
            number,
        )
        for number in sides
        if given[number] / 2 - radius < -1e-9
    ]
    room = min((given[n] / 2 - radius for n in sides), default=given[16])
    if not narrow and given[16] > room + 1e-9:
        found.append(
            conflict(
                f"@P16 ({given[16]:g}): the tool (radius {radius:g}) leaves room "
                f"for {room:g}",
                16,
            )
        )
    found += narrow
    corner = given[65]
    if 0 < corner < radius - 1e-9:
        found.append(
            conflict(
                f"@P65 ({corner:g}) is less than the tool radius {radius:g}", 65
            )
        )
    if sides and corner > min(given[n] for n in sides) / 2 + 1e-9:
        found.append(
            conflict(
                f"@P65 ({corner:g}) is more than half the shorter side", 65
            )
        )
    return found


def helix(given: Given, around: Surroundings) -> list[Problem]:
    """The helix of the plunge fits both sides."""
    sides = [given[number] for number in (72, 73) if number in given]
    radius = around.tool_radius
    if given[32] != HELICAL or given[31] == FINISHING or not sides:
        return []
    across = _helix_radius(given, around)
    room = min(sides) / 2 - radius
    if not radius > 0 or room < 0 or across <= room + 1e-9:
        return []
    text = (
        f"@P8 ({across:g}): the helix does not fit, at most {room:g}; "
        "@P32=1 plunges without one"
    )
    return [conflict(text, 8 if 8 in given.programmed else 32)]


def _helix_radius(given: Given, around: Surroundings) -> float:
    own = given.get(8)
    return 0.5 * around.tool_radius if own is None else own


def centre(given: Given, around: Surroundings) -> list[Problem]:
    """Both coordinates or none."""
    missing = {40: 41, 41: 40}
    return [
        conflict(f"@P{n} without @P{m}", n)
        for n, m in missing.items()
        if n in given.programmed and m not in given.programmed
    ]


def size(given: Given, around: Surroundings) -> list[Problem]:
    """The program of the cycle stays within bounds."""
    needed = {4, 5, 6, 72, 73}
    if not needed <= given.values.keys() or not around.tool_radius > 0:
        return []
    cuts = [
        given[4] / given[5],
        max(given[72], given[73]) / min(given[6], around.tool_radius),
    ]
    turns = given[4] / given[7] if 7 in given else 0.0
    if cuts[0] * (cuts[1] + 1.0) * 10.0 + turns <= MOVES_MAX:
        return []
    text = f"@P5, @P6 or @P7 is so small that the pocket takes more than {MOVES_MAX} motions"
    return [
        conflict(
            text,
            5
            if cuts[0] >= max(cuts[1], turns)
            else 6
            if cuts[1] >= turns
            else 7,
        )
    ]


def feeds(given: Given, around: Surroundings) -> list[Problem]:
    """Every feed that the mode needs is given, or an F is in force."""
    needed = 22 if given[31] == FINISHING else 20
    if around.feed > 0 or {20, needed} & given.programmed:
        return []
    return [
        Problem(
            MISSING,
            f"CYC_PARAM_MISSING: @P{needed} is not given, and no F is in force",
            needed,
        )
    ]


def _pocket(given: Given, around: Surroundings) -> Pocket:
    radius, lead, pitch = around.tool_radius, given.get(13), given.get(7)
    plunge = None
    if given[32] == HELICAL:
        room = min(given[72], given[73]) / 2 - radius - given[16]
        across = min(_helix_radius(given, around), room)
        if across > 0:
            plunge = (across, 0.1 * radius if pitch is None else pitch)
    return Pocket(
        length=given[72],
        width=given[73],
        corner=max(given[65], radius),
        depth=given[4],
        surface=given[1],
        safety=given[1] + given[3],
        tool=radius,
        cut=given[6],
        infeed=given[5],
        edge=given[16],
        base=given[15],
        helix=plunge,
        turn=-1 if given[30] else 1,
        lead=given[72] / 8 if lead is None else lead,
        round_infeed=given[34] == SEMICIRCLE,
    )


def _feed(given: Given, *numbers: int, otherwise: float) -> float:
    return next((given[n] for n in numbers if n in given), otherwise)


def _without_effect(given: Given, plunge: float) -> list[tuple[int, str]]:
    """A warning for each parameter that changes nothing."""
    same = {170: given[6], 171: plunge}
    warnings = [
        (STORED, f"@P{n} is checked, but has no effect")
        for n in (135, 170, 171)
        if n in given and given[n] != same.get(n)
    ]
    if given[32] != HELICAL:
        warnings += [
            (STORED, f"@P{n} has no effect without @P32=2 (helical plunge)")
            for n in (7, 8)
            if n in given
        ]
    return warnings


def build(given: Given, around: Surroundings) -> Work:
    """Above the centre, down, cut, up to the retraction plane."""
    pocket, mode, work, out = (
        _pocket(given, around),
        int(given[31]),
        Work(),
        Writer(around),
    )
    middle = (
        _feed(given, 40, otherwise=around.position[0]),
        _feed(given, 41, otherwise=around.position[1]),
    )
    top, f = given[2], around.feed
    plunge = _feed(given, 21, 20, otherwise=f)
    work.warnings += _without_effect(given, plunge)
    if around.position[2] < top:
        out.rapid(z=top)
    out.rapid(*middle)
    out.rapid(z=top)
    if mode in (ROUGHING, BOTH):
        speeds = {PLANE: _feed(given, 20, otherwise=f), DOWN: plunge}
        out.moves(placed(rough(pocket), middle, given[42]), speeds, middle)
    if mode == BOTH and not (pocket.edge or pocket.base):
        if 31 in given.programmed:
            work.warnings.append(
                (
                    NOTHING_TO_FINISH,
                    "no finishing allowance (@P15, @P16): roughing only",
                )
            )
    elif mode in (FINISHING, BOTH):
        if 25 in given:
            out.lines.append(f"S{number_text(given[25])}")
        plane = _feed(given, 22, 20, otherwise=f)
        out.moves(
            placed(finish(pocket), middle, given[42]),
            {PLANE: plane, DOWN: _feed(given, 23, otherwise=plane)},
            middle,
        )
    out.rapid(z=top)
    work.lines = out.lines
    return work


CYCLE = Cycle(
    "SysMillRectangularPocket",
    "mill a rectangular pocket",
    PARAMETERS,
    build,
    (planes, tool, helix, centre, size, feeds),
    moves=True,
)
