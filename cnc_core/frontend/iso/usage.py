"""Every word of a line must be used by one of its functions."""

from __future__ import annotations

from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.iso import codes
from cnc_core.frontend.iso.words import Words

# Letters that a function takes, by its number in tenths.
TAKES: dict[int, str] = {
    40: "P",
    100: "LP",
    640: "PQ",
    430: "H",
    410: "D",
    420: "D",
    960: "D",
    **dict.fromkeys(codes.ARCS, "IJKRP"),
    **dict.fromkeys(codes.CYCLES, "RLKP"),
    730: "RLKPQ",
    830: "RLKPQ",
}
ALWAYS = "NFST"


def check_usage(words: Words, motion: int | None) -> None:
    """Error 908001 for a word that no function of the line uses.

    ``motion``: of the block, in tenths.
    """
    used = ALWAYS
    if motion is not None or words.one_of(codes.TAKES_AXES) is not None:
        used += codes.AXIS_LETTERS
    for code in {*words.g, motion} - {None}:
        used += TAKES.get(code or 0, "")
    for letter, offset in words.offsets.items():
        if letter not in used:
            number = (
                900015 if letter in "IJK" and motion in codes.LINES else 908001
            )
            raise fail(
                number, f"no function of the block uses {letter}", offset
            )
    if 530 in words.g and motion not in codes.LINES:
        raise fail(908005, "G53 needs G0 or G1", words.g[530])
