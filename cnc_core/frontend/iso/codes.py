"""The G and M functions of the dialect: modal groups, accepted and refused
codes.

G functions are counted in tenths: G1 is 10, G43.1 is 431.
"""

from __future__ import annotations

from cnc_core.frontend.base.scanner import (
    KEEP_CENTRE,
    MESSAGES,
    NO_EQUALS,
    NO_PITCH,
    RADIUS_ONCE,
    Rules,
)

RULES = Rules(
    RADIUS_ONCE | NO_PITCH | KEEP_CENTRE | NO_EQUALS | MESSAGES,
    centre_limit_mm=0.0254,
    centre_ratio=0.001,
)

LINES, ARCS = (0, 10), (20, 30)
CYCLES = (730, 810, 820, 830, 850, 860, 890)
PECKING, DWELLING, FEEDING_OUT = (730, 830), (820, 860, 890), (850, 890)
OTHER_MOTIONS = (
    50,
    51,
    52,
    53,
    330,
    331,
    382,
    383,
    384,
    385,
    700,
    710,
    711,
    712,
    740,
    760,
    840,
    870,
    880,
)
# functions that use the axis words in place of the motion
TAKES_AXES = (100, 280, 300, 431, 920)

GROUPS: tuple[tuple[str, tuple[int, ...]], ...] = (
    ("non-modal", (40, 100, 280, 281, 300, 301, 520, 530, 920, 921, 922, 923)),
    ("motion", (*LINES, *ARCS, *CYCLES, *OTHER_MOTIONS, 800)),
    ("plane", (170, 171, 180, 181, 190, 191)),
    ("distance mode", (900, 910)),
    ("centre mode", (901, 911)),
    ("feed mode", (930, 940, 950)),
    ("unit", (200, 210)),
    ("radius compensation", (400, 410, 411, 420, 421)),
    ("tool length", (430, 431, 432, 490)),
    ("retract mode", (980, 990)),
    ("coordinate system", (540, 550, 560, 570, 580, 590, 591, 592, 593)),
    ("path control", (610, 611, 640)),
    ("spindle mode", (960, 970)),
    ("lathe mode", (70, 80)),
)
GROUP_OF = {code: name for name, codes in GROUPS for code in codes}
SUPPORTED = frozenset(
    {
        40,
        100,
        280,
        281,
        300,
        301,
        530,
        920,
        921,
        922,
        923,
        *LINES,
        *ARCS,
        800,
        *CYCLES,
        170,
        180,
        190,
        900,
        910,
    }
    | {
        901,
        911,
        930,
        940,
        200,
        210,
        400,
        410,
        420,
        430,
        431,
        490,
        980,
        990,
        610,
        611,
        640,
        960,
        970,
    }
    | {540, 550, 560, 570, 580, 590, 591, 592, 593}
)
# Not of a group above, but known to controls of this family.
KNOWN = frozenset(GROUP_OF) | {
    90,
    110,
    120,
    130,
    150,
    160,
    310,
    500,
    510,
    600,
    650,
    660,
    670,
    680,
    690,
}

M_GROUPS: tuple[tuple[str, tuple[int, ...]], ...] = (
    ("stop", (0, 1, 2, 30)),
    ("tool change", (6,)),
    ("spindle", (3, 4, 5)),
    ("coolant off", (9,)),
    ("override", (48, 49)),
)
M_GROUP_OF = {code: name for name, codes in M_GROUPS for code in codes}
STOPS, PROGRAM_ENDS, SPINDLE, COOLANT, OVERRIDE = (
    (0, 1),
    (2, 30),
    (3, 4, 5),
    (7, 8, 9),
    (48, 49),
)
STANDARD_M = frozenset(
    {*STOPS, *PROGRAM_ENDS, *SPINDLE, 6, *COOLANT, *OVERRIDE}
)

# the order of the parameters from 5161, 5181, 5211, 5221, 5420 on
AXIS_LETTERS = "XYZABCUVW"
VALUE_LETTERS = "DFHIJKLPQRST"


def name(code: int) -> str:
    """``G43.1`` of 431."""
    return f"G{code // 10}" + (f".{code % 10}" if code % 10 else "")
