"""SysMillRectangularPocket: roughing, finishing, or both."""

from __future__ import annotations

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
HELICAL = 2
NOTHING_TO_FINISH = 13164
MOVES_MAX = 500_000

P = Parameter
PARAMETERS = (
    P(1, "surface, Z", required=True),
    P(2, "retraction plane, Z", required=True),
    P(3, "safety clearance above the surface", required=True, low=0.0),
    P(4, "depth below the surface", required=True, low=0.0, above=True),
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
        default_text="10 % of the tool radius",
    ),
    P(
        13,
        "safety clearance from the wall (finishing)",
        low=0.0,
        default_text="1/8 of half the shorter side",
    ),
    P(15, "finishing allowance at the base", default=0.0, low=0.0),
    P(16, "finishing allowance at the edge", default=0.0, low=0.0),
    P(
        20,
        "feed in XY, roughing",
        FEED,
        low=0.0,
        above=True,
        default_text="F in force",
    ),
    P(
        21,
        "feed in Z, roughing",
        FEED,
        low=0.0,
        above=True,
        default_text="F in force",
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
        default=1.0,
        low=1,
        high=3,
        whole=True,
        names=MODES,
    ),
    P(
        32,
        "plunge: 1 vertical, 2 helical",
        PLAIN,
        default=1.0,
        low=1,
        high=2,
        whole=True,
    ),
    P(70, "centre, X", default_text="current position"),
    P(71, "centre, Y", default_text="current position"),
    P(72, "length in X", required=True, low=0.0, above=True),
    P(73, "width in Y", required=True, low=0.0, above=True),
    P(74, "corner radius", low=0.0, default_text="tool radius"),
    P(
        75,
        "rotation about Z through the centre",
        ANGLE,
        default=0.0,
        low=-360.0,
        high=360.0,
    ),
)


def conflict(text: str, number: int) -> Problem:
    return Problem(CONFLICT, f"CYC_PARAM_CONFLICT: {text}", number)


def planes(given: Given, around: Surroundings) -> list[Problem]:
    """The retraction plane lies above the surface, the base allowance above the
    floor.
    """
    found = []
    if 1 in given and 2 in given and given[2] < given[1]:
        found.append(
            conflict(
                f"@P2 ({given[2]:g}) lies below the surface @P1 ({given[1]:g})",
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
    return found


def tool(given: Given, around: Surroundings) -> list[Problem]:
    """The tool has a radius, fits the pocket and its corners, and the cut is
    not wider than the tool.
    """
    radius = around.tool_radius
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
    found += [
        conflict(
            f"@P{number} ({given[number]:g}): the tool (radius {radius:g}) does not fit",
            number,
        )
        for number in sides
        if given[number] / 2 - radius - given[16] < -1e-9
    ]
    if 74 in given and given[74] < radius - 1e-9:
        found.append(
            conflict(
                f"@P74 ({given[74]:g}) is less than the tool radius {radius:g}",
                74,
            )
        )
    if (
        74 in given
        and sides
        and given[74] > min(given[n] for n in sides) / 2 + 1e-9
    ):
        found.append(
            conflict(
                f"@P74 ({given[74]:g}) is more than half the shorter side", 74
            )
        )
    return found


def helix(given: Given, around: Surroundings) -> list[Problem]:
    """Pitch and radius belong to the helix; it fits the pocket."""
    if given[32] != HELICAL:
        return [
            conflict(f"@P{n} without @P32=2 (helical plunge)", n)
            for n in (7, 8)
            if n in given.programmed
        ]
    sides = [given[number] for number in (72, 73) if number in given]
    room = min(sides, default=float("inf")) / 2 - around.tool_radius - given[16]
    if 8 in given and given[8] > room + 1e-9:
        return [
            conflict(
                f"@P8 ({given[8]:g}): the helix does not fit, at most {max(room, 0.0):g}",
                8,
            )
        ]
    return []


def centre(given: Given, around: Surroundings) -> list[Problem]:
    """Both coordinates or none."""
    missing = {70: 71, 71: 70}
    return [
        conflict(f"@P{n} without @P{m}", n)
        for n, m in missing.items()
        if n in given.programmed and m not in given.programmed
    ]


def size(given: Given, around: Surroundings) -> list[Problem]:
    """The program of the cycle stays within bounds."""
    needed = {4, 5, 6, 72, 73}
    if not needed <= given.values.keys() or around.tool_radius <= 0:
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
    wanted = (
        (20, 21)
        if given[31] != FINISHING
        else (20,)
        if 22 not in given.programmed
        else ()
    )
    if around.feed > 0:
        return []
    return [
        Problem(
            MISSING,
            f"CYC_PARAM_MISSING: @P{n} is not given, and no F is in force",
            n,
        )
        for n in wanted
        if n not in given.programmed
    ]


def _pocket(given: Given, around: Surroundings) -> Pocket:
    radius, corner, lead = around.tool_radius, given.get(74), given.get(13)
    half = min(given[72], given[73]) / 2
    plunge = None
    if given[32] == HELICAL:
        room = half - radius - given[16]
        own, pitch = given.get(8), given.get(7)
        across = min(0.1 * radius, room) if own is None else own
        plunge = (
            (across, 0.1 * radius if pitch is None else pitch)
            if across > 0
            else None
        )
    return Pocket(
        length=given[72],
        width=given[73],
        corner=radius if corner is None else max(corner, radius),
        depth=given[4],
        surface=given[1],
        safety=min(given[1] + given[3], given[2]),
        tool=radius,
        cut=given[6],
        infeed=given[5],
        edge=given[16],
        base=given[15],
        helix=plunge,
        turn=-1 if given[30] else 1,
        lead=half / 8 if lead is None else lead,
    )


def _feed(given: Given, *numbers: int, otherwise: float) -> float:
    return next((given[n] for n in numbers if n in given), otherwise)


def build(given: Given, around: Surroundings) -> Work:
    """Above the centre, down, cut, up to the retraction plane."""
    pocket, mode, work, out = (
        _pocket(given, around),
        int(given[31]),
        Work(),
        Writer(around),
    )
    middle = (
        _feed(given, 70, otherwise=around.position[0]),
        _feed(given, 71, otherwise=around.position[1]),
    )
    top, f = given[2], around.feed
    if around.position[2] < top:
        out.rapid(z=top)
    out.rapid(*middle)
    out.rapid(z=top)
    if mode in (ROUGHING, BOTH):
        speeds = {
            PLANE: _feed(given, 20, otherwise=f),
            DOWN: _feed(given, 21, otherwise=f),
        }
        out.moves(placed(rough(pocket), middle, given[75]), speeds)
    if mode == BOTH and not (pocket.edge or pocket.base):
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
            placed(finish(pocket), middle, given[75]),
            {PLANE: plane, DOWN: _feed(given, 23, otherwise=plane)},
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
