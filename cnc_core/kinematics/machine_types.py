"""Eight types of machines and six places of the bed, as chains.

Source: HSM specification, sections 9.3 and 9.4 (codes MAC and CIN).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .chain import Chain, HasMatrix, Joint

# elements from the part to the tool
CHAINS: dict[str, tuple[str, ...]] = {
    "WRK": ("WRK", "TOL", "LI1", "LI2", "LI3"),
    "MIX": ("WRK", "LI1", "LI2", "LI3", "TOL"),
    "TOL": ("LI1", "LI2", "LI3", "WRK", "TOL"),
    "WC1": ("WRK", "LI1", "TOL", "LI2", "LI3"),
    "WC2": ("WRK", "LI1", "LI2", "TOL", "LI3"),
    "TC1": ("LI1", "WRK", "LI2", "LI3", "TOL"),
    "TC2": ("LI1", "LI2", "WRK", "LI3", "TOL"),
    "C12": ("LI1", "WRK", "LI2", "TOL", "LI3"),
}
# where the bed cuts the chain: element, and whether the cut is behind it
# (toward the tool)
CUTS: dict[str, tuple[str, bool]] = {
    "WRK": ("LI1", False),
    "B12": ("LI1", True),
    "BC1": ("LI2", False),
    "B23": ("LI2", True),
    "BC2": ("LI3", False),
    "TOL": ("LI3", True),
}
BASIC = ("WRK", "MIX", "TOL")
PART, TOOL = "w", "t"


@dataclass(frozen=True)
class Element:
    """An axis of the setup: channel index and its CIN step."""

    axis: int
    step: HasMatrix


def machine_chain(
    mac: str,
    bed: str,
    elements: Mapping[str, Element],
    part: HasMatrix,
    tool: HasMatrix,
) -> Chain:
    """The chain of ``(MAC,mac,bed)``; ``elements`` by CinType (LI1 LI2 LI3 WRK
    TOL); ``part``, ``tool``: CIN w, t.

    ValueError names an unknown type or bed, or a missing element.
    """
    if mac not in CHAINS:
        raise ValueError(f"machine type {mac!r} is none of {', '.join(CHAINS)}")
    if bed not in CUTS:
        raise ValueError(f"bed {bed!r} is none of {', '.join(CUTS)}")
    order = CHAINS[mac]
    missing = [name for name in order if name not in elements]
    if missing:
        raise ValueError(f"machine type {mac}: no axis is {missing[0]}")
    name, behind = CUTS[bed]
    cut = order.index(name) + behind

    def joint(element: str) -> Joint:
        return Joint(
            elements[element].axis,
            element in ("WRK", "TOL"),
            elements[element].step,
        )

    return Chain(
        [joint(e) for e in reversed(order[:cut])],
        part,
        [joint(e) for e in order[cut:]],
        tool,
    )
