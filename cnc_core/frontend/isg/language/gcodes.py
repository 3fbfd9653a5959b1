"""The G functions of the dialect: groups, motion words, accepted and refused
codes.
"""

from __future__ import annotations

from collections.abc import Callable

from cnc_core.frontend.base.scanner import MotionWords

# (group, error for two of the group in one block, codes); the manual's numbers,
# 900011 where it has none
GROUPS: tuple[tuple[str, int, tuple[int, ...]], ...] = (
    (
        "motion",
        20108,
        (*range(5), 33, 63, 74, 301, 302, 303, 331, 332),
    ),
    ("plane", 20108, (17, 18, 19)),
    ("mirror", 20112, (20, 21, 22, 23, 351)),
    ("corner", 20113, (25, 26)),
    ("radius compensation", 20114, (40, 41, 42)),
    ("diameter", 20115, (51, 52)),
    ("zero offset", 20116, (53, 54, 55, 56, 57, 58, 59, 159)),
    ("exact stop", 20117, (60, 359, 360, 61, 260, 261)),
    ("unit", 20118, (70, 71)),
    ("measuring", 20123, (100, 101, 102, 106, 107, 108)),
    ("look-ahead", 20124, (115, 116, 117)),
    ("radius compensation mode", 20126, (138, 139, 236, 237, 238, 239)),
    ("circle centre", 20127, (161, 162)),
    ("centre correction", 20128, (164, 165)),
    ("manual mode", 20129, (200, 201, 202)),
    ("corner deceleration", 20794, (12, 13)),
    ("dimension", 900011, (90, 91)),
    ("feed mode", 900011, (93, 94, 95, 194)),
    ("spindle mode", 900011, (96, 97, 196)),
    ("spline", 900011, (150, 151)),
    ("masking", 900011, (140, 141)),
    ("rotation", 900011, (68, 69)),
    ("feed-forward", 900011, (135, 136, 137)),
    ("block transition", 900011, (8, 9, 900, 901)),
    ("feed of radius compensation", 900011, (10, 11)),
)
GROUP_OF: dict[int, tuple[str, int]] = {
    code: (name, error) for name, error, codes in GROUPS for code in codes
}

# Calls of subprograms: of the configuration or of #FILE NAME.
USER_CODES = frozenset({*range(80, 90), *range(800, 840)})
USER_VALUES = 50


def _motion(code: int) -> Callable[[MotionWords], None]:
    def set_motion(words: MotionWords) -> None:
        words.motion = code

    return set_motion


def _plane(code: int) -> Callable[[MotionWords], None]:
    def set_plane(words: MotionWords) -> None:
        words.plane = code

    return set_plane


def _flag(name: str, value: bool) -> Callable[[MotionWords], None]:
    def set_flag(words: MotionWords) -> None:
        setattr(words, name, value)

    return set_flag


EFFECTS: dict[int, Callable[[MotionWords], None]] = {
    **{code: _motion(code) for code in (0, 1, 2, 3)},
    **{code: _plane(code) for code in (17, 18, 19)},
    60: _flag("block_stop", True),
    261: _flag("exact_stop", False),
    70: _flag("inch", True),
    71: _flag("inch", False),
    90: _flag("absolute", True),
    91: _flag("absolute", False),
    161: _flag("centre_absolute", True),
    162: _flag("centre_absolute", False),
    **{code: _motion(1) for code in (33, 63, 331, 332)},
    359: _flag("exact_stop", False),
    360: _flag("exact_stop", True),
}

# The C scanner reads these too.
PLAIN = frozenset({*range(4), 17, 18, 19, 90, 91})

# Tool radius compensation: cnc_core.frontend.base.compensation.
COMPENSATION = frozenset(
    {
        *(5, 10, 11),
        *(25, 26),
        *(40, 41, 42),
        *(138, 139, 237, 239),
    }
)

# Executed by cnc_core.frontend.isg.executor.
OFFSETS = frozenset({*range(53, 60), 92, 159, 160})
MIRRORS = {
    20: (1.0, 1.0),
    21: (-1.0, 1.0),
    22: (1.0, -1.0),
    23: (-1.0, -1.0),
}
DIAMETER = frozenset({51, 52})
FEED_MODES = (93, 94, 95, 194)
DYNAMICS = frozenset({*range(127, 135), 230, 231, 233})
CONTOURING = frozenset({61, 260, 261, 150, 151})
CORNERS = frozenset({301, 302})
SPINDLE = frozenset({96, 97, 196, 166})
SOFT_LIMITS = (98, 99)
EXECUTED = OFFSETS | DIAMETER | DYNAMICS | CONTOURING | CORNERS
EXECUTED |= SPINDLE | frozenset(
    {*SOFT_LIMITS, *MIRRORS, *FEED_MODES, 68, 69, 74, 164, 165, 351}
)

# Initial states and constant states of this kernel: they change nothing.
INITIAL = frozenset({8, 9, 12, 117, 135, 140, 163, 202, 900})

# Accepted and kept, without effect on the rows, with one warning.
STORED = frozenset(
    {
        *(13, 901),
        *(115, 116, 136, 137, 167, 193),
        *(293, 333, 334, 338, 339),
    }
)

# With ``=value``.
VALUED = frozenset(
    {
        *(115, 128, 129, 131, 133, 134),
        *(159, 160, 231, 233),
        *(333, 334, 338, 339),
    }
)
VALUE_OPTIONAL = frozenset({115})

# Axis words of the block belong to these functions and move nothing.
AXIS_TAKERS = frozenset(
    {
        *(68, 74, 92, 98, 99),
        *(127, 130, 132, 136),
        *(160, 230, 351),
    }
)

ACCEPTED = INITIAL | STORED | EXECUTED | COMPENSATION

# Known to the manual and refused by name.
REFUSED = frozenset(
    {
        *(66, *range(100, 109), 112, 141),
        *(200, 201, 236, 238),
        *(303, 310),
    }
)
