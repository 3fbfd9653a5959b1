"""Synchronisation types of M and H functions (P-CHAN-00041)."""

from __future__ import annotations

import difflib
from typing import Annotated

from pydantic import AfterValidator

# Synchronisation of the M functions of the built-in machine (P-CHAN-00041);
# what is absent is undefined.
DEFAULT_M_SYNCH: dict[int, str] = dict.fromkeys(
    (
        *(0, 1, 2, 3, 4, 5, 17, 19, 29, 30),
        *(*range(6, 12), *range(40, 46)),
    ),
    "NO_SYNCH",
)
SYNCH_BASES = (
    *("NO_SYNCH", "MOS", "MVS_SVS", "MVS_SNS", "MNS_SNS", "MNE_SNS"),
    *("MVS_SLM", "MVS_SLP", "MEP_SVS", "MET_SVS"),
)
SYNCH_FLAGS = ("BWD_SYNCH", "FWD_SYNCH")
SYNCH: dict[str, int] = {  # values of P-CHAN-00041 (hli_reference 6.4)
    "NO_SYNCH": 0,
    "MOS": 0x1,
    "MVS_SVS": 0x2,
    "MVS_SNS": 0x4,
    "MNS_SNS": 0x8,
    # 0x20; the front end puts it where the probe trips, from there it acts as
    # MVS_SNS
    "MNE_SNS": 0x4,
    "MVS_SLM": 0x4000,
    "MVS_SLP": 0x8000,
    "MEP_SVS": 0x1000000,
    "MET_SVS": 0x2000000,
    "BWD_SYNCH": 0x400000,
    "FWD_SYNCH": 0x800000,
}


def synch_value(text: str) -> int:
    """Value of a synchronisation type: one base type, flags joined by ``|``.
    ValueError if it is none.
    """
    words = [word.strip() for word in text.split("|")]
    unknown = [word for word in words if word not in SYNCH]
    if unknown:
        near = difflib.get_close_matches(unknown[0], SYNCH, n=1)
        hint = f"did you mean {near[0]!r}?" if near else ", ".join(SYNCH)
        raise ValueError(f"unknown synchronisation type {unknown[0]!r}; {hint}")
    bases = [word for word in words if word in SYNCH_BASES]
    if len(bases) != 1 or len(set(words)) < len(words):
        raise ValueError(
            f"{text!r}: one of {', '.join(SYNCH_BASES)}, and flags {', '.join(SYNCH_FLAGS)} with |"
        )
    value = 0
    for word in words:
        value |= SYNCH[word]
    return 0 if bases == ["NO_SYNCH"] else value


def _checked_synch(text: str) -> str:
    synch_value(text)
    return text


SynchName = Annotated[str, AfterValidator(_checked_synch)]
