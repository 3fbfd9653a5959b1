"""The G functions: what each does with the words of its block."""

from __future__ import annotations

MOTIONS = (0, 1, 2, 3)
PLANES = (17, 18, 19)
PATH_MODES = (63, 64, 65, 67, 68, 75)
# modal functions without words of their own; the groups exclude each other
# within a block
GROUPS: tuple[tuple[int, ...], ...] = (
    MOTIONS,
    (*PLANES, 70),
    (90, 91),
    (20, 21),
    (10, 11),
    (60, 61),
    PATH_MODES,
    (98, 53, 99),
    (96, 97),
    (104, 105),
    (87, 88),
    (40, 41, 42),
    (22, 23),
    (26, 27, 28),
    (120, 121),
    (24, 25),
    (50, 51, 52),
    (1051, 1050),
    (30, 31, 32),
    (33, 34, 35),
    (43, 44, 45, 46),
)
# modes and filters of the path
PATH_FUNCTIONS = frozenset({49, 66, 69, 72, 73, 74, 106, *PATH_MODES})
# functions that put rows or waits out by themselves
ROWS = frozenset(
    {
        4,
        10,
        11,
        40,
        41,
        42,
        *PLANES,
        48,
        62,
        70,
        71,
        80,
        100,
        101,
        102,
        103,
        104,
        105,
    }
)
# functions that use the axis words (and others) of their block, so only one of
# them fits into a block
TAKERS = frozenset(
    {
        4,
        26,
        30,
        33,
        36,
        43,
        45,
        47,
        48,
        50,
        *range(54, 60),
        70,
        80,
        81,
        82,
        84,
        85,
        86,
        89,
        92,
        93,
        94,
        95,
        1051,
    }
    | {49, 66, 68, 69, *range(71, 75), 100, 102, 103, 106}
)
SINGLE = frozenset({62, 83, 101, 940})
GROUP_OF = {code: group for group in GROUPS for code in group}
KNOWN = frozenset(GROUP_OF) | TAKERS | SINGLE
