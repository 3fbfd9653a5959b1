"""The variables of an FMU: what goes in, what comes out.

All values are numbers in one row: parameters, inputs, outputs, in this order.
A variable's value reference is its place in the row.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..config import CellConfig
from ..errors import CncError

MODEL = "fmu.json"  # what the slave has to know
ELEMENTS_SHOWN = 8  # of the contour ahead
MEMBERS = (
    ("kind", ""),
    ("start", "mm"),
    ("length", "mm"),
    ("radius", "mm"),
    ("tangent", "rad"),
)
TENTH_UM, UM_S = 1e-4, 1e-3  # in mm, mm/s


@dataclass(frozen=True)
class Variable:
    """One number.

    ``kind``: Real, Integer or Boolean.  ``causality``: parameter, input or
    output.  ``symbol``: what it is in the HLI or the PLC; ``scale``: from its
    unit to ours.
    """

    name: str
    kind: str
    causality: str
    unit: str = ""
    start: float = 0.0
    about: str = ""
    symbol: str = ""
    scale: float = 1.0


def parameters(cell: CellConfig) -> list[Variable]:
    """Limits of the machine that an importer may change."""
    out = [
        _parameter(
            "tolerance",
            "mm",
            cell.channel.tolerance_mm,
            "allowed path deviation",
        )
    ]
    for name, axis in cell.axes.items():
        limits = (
            ("v_max", "v_max_mm_s", "mm/s"),
            ("a_max", "a_max_mm_s2", "mm/s2"),
            ("j_max", "j_max_mm_s3", "mm/s3"),
        )
        for short, member, unit in limits:
            start = float(getattr(axis, member))
            about = f"limit of axis {name}, per degree if it is rotary"
            out.append(_parameter(f"{name}.{short}", unit, start, about))
    return out


def _parameter(name: str, unit: str, start: float, about: str) -> Variable:
    return Variable(name, "Real", "parameter", unit, start, about)


def inputs(chosen: Sequence[str] = ()) -> list[Variable]:
    """What the importer commands, and the chosen symbols of the PLC."""
    return [
        Variable(
            "override",
            "Real",
            "input",
            "%",
            100.0,
            "of the path speed, 0 to 200",
        ),
        Variable(
            "feed_hold", "Boolean", "input", about="the path stops and waits"
        ),
        Variable(
            "start",
            "Boolean",
            "input",
            start=1.0,
            about="the program starts as soon as it is on",
        ),
        *(
            Variable(
                name, "Real", "input", about="a symbol of the PLC", symbol=name
            )
            for name in chosen
        ),
    ]


def outputs(cell: CellConfig, chosen: Sequence[str] = ()) -> list[Variable]:
    """State of the cell behind each step, and the chosen symbols."""
    path = "gpCh[0].bahn_state"
    look = "gpCh[0].contour_lookahead.state"
    ahead = "gpAhead[0].state"
    axes = [
        _real(
            f"{name}.position",
            "mm",
            f"{ahead}.position[{i}]",
            "as interpolated",
        )
        for i, name in enumerate(cell.axes)
    ]
    return [
        *axes,
        _real("speed", "mm/s", f"{ahead}.speed", "of the path"),
        _real("feed", "mm/s", f"{path}.command_feed_r", "as programmed", UM_S),
        _real(
            "distance",
            "mm",
            f"{path}.dist_prog_start",
            "since program start",
            TENTH_UM,
        ),
        _real(
            "known_distance",
            "mm",
            f"{look}.max_dist_prog_start",
            "up to where the contour is known",
            TENTH_UM,
        ),
        _real("override_now", "%", f"{path}.override_r", "in force", 0.1),
        _whole("block", f"{path}.block_number_r", "N of the block in motion"),
        _flag("moving", f"{path}.interpolation_active_r", "the path is driven"),
        _flag("holds", f"{path}.feedhold_active_r", "feed hold is on"),
        _flag(
            "waits_function",
            f"{path}.wait_techno_acknowledge_r",
            "an M, H, S or T is not acknowledged",
        ),
        _flag("waits_continue", f"{path}.wait_continue_r", "M0 or M1 waits"),
        _flag(
            "program_end", f"{path}.program_end_r", "the program is completed"
        ),
        _whole("elements", "", "elements of the contour ahead"),
        *(v for name, unit in MEMBERS for v in _elements(name, unit)),
        *(_real(name, "", name, "a symbol") for name in chosen),
    ]


def _elements(name: str, unit: str) -> list[Variable]:
    """One member of the coming elements; in FMI 3.0 an array."""
    about = "of an element of the contour ahead"
    return [
        _real(f"ahead{i}.{name}", unit, "", about)
        for i in range(ELEMENTS_SHOWN)
    ]


def _real(
    name: str, unit: str, symbol: str, about: str, scale: float = 1.0
) -> Variable:
    return Variable(name, "Real", "output", unit, 0.0, about, symbol, scale)


def _whole(name: str, symbol: str, about: str) -> Variable:
    return Variable(name, "Integer", "output", about=about, symbol=symbol)


def _flag(name: str, symbol: str, about: str) -> Variable:
    return Variable(name, "Boolean", "output", about=about, symbol=symbol)


def check_names(variables: Sequence[Variable]) -> None:
    """CncError: two variables of one name."""
    seen: set[str] = set()
    for variable in variables:
        if variable.name in seen:
            raise CncError(902001, f"FMU: two variables {variable.name!r}")
        seen.add(variable.name)


def as_table(variables: Sequence[Variable]) -> list[dict[str, Any]]:
    return [vars(variable) for variable in variables]
