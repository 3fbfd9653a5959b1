"""The variables of an FMU: what goes in, what comes out.

All values are numbers in one row: parameters, inputs, outputs, in this order.
A variable's value reference is its place in the row.  The one text, the name of
the program, has a place there, too, but no number.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from ..config import CellConfig
from ..errors import CncError

MODEL = "fmu.json"  # what the slave has to know
ARRAY = 8  # elements of the contour ahead, and M functions, that are shown
NO_FUNCTION = -1
MEMBERS = (
    ("kind", ""),
    ("start", "mm"),
    ("length", "mm"),
    ("radius", "mm"),
    ("tangent", "rad"),
)
ARRAYS = ("m", *(f"ahead.{name}" for name, _ in MEMBERS))
OVERRIDE, FEED_HOLD, START = "override", "feed_hold", "start"
PROGRAM_END = "program_end"
EXTERNAL = "V.E."
TENTH_UM, UM_S = 1e-4, 1e-3  # in mm, mm/s


@dataclass(frozen=True)
class Variable:
    """One number.

    ``kind``: Real, Integer, Boolean, or String.  ``causality``: parameter, input
    or output.  ``symbol``: what it is in the HLI or the PLC; ``scale``: from its
    unit to ours.  ``array``: the array of FMI 3.0 that it is an element of.
    ``text``: a String's start.
    """

    name: str
    kind: str
    causality: str
    unit: str = ""
    start: float = 0.0
    about: str = ""
    symbol: str = ""
    scale: float = 1.0
    array: str = ""
    text: str = ""


def parameters(cell: CellConfig, program: str) -> list[Variable]:
    """The program, and the limits of the machine that an importer may change."""
    about = "NC program: a path, or a file of the FMU's resources"
    name = Variable("program", "String", "parameter", about=about, text=program)
    return [name, *limits(cell)]


def limits(cell: CellConfig) -> Iterator[Variable]:
    tolerance = cell.channel.tolerance_mm
    yield _parameter("tolerance", "mm", tolerance, "allowed path deviation")
    for name, axis in cell.axes.items():
        for short, member, unit in (
            ("v_max", "v_max_mm_s", "mm/s"),
            ("a_max", "a_max_mm_s2", "mm/s2"),
            ("j_max", "j_max_mm_s3", "mm/s3"),
        ):
            start = float(getattr(axis, member))
            about = f"limit of axis {name}, per degree if it is rotary"
            yield _parameter(f"{name}.{short}", unit, start, about)


def _parameter(name: str, unit: str, start: float, about: str) -> Variable:
    return Variable(name, "Real", "parameter", unit, start, about)


def inputs() -> list[Variable]:
    """What the importer commands."""
    speed = "of the path speed, 0 to 200"
    start = "the program starts as soon as it is on"
    return [
        Variable(OVERRIDE, "Real", "input", "%", 100.0, speed),
        Variable(
            FEED_HOLD, "Boolean", "input", about="the path stops and waits"
        ),
        Variable(START, "Boolean", "input", start=1.0, about=start),
    ]


def externals(cell: CellConfig) -> list[Variable]:
    """The numbers that programs share with the PLC, V.E, as inputs."""
    about = "external variable; it is written as soon as it changes"
    kinds = {"BOOLEAN": "Boolean", "REAL64": "Real", "UNS32": "Real"}
    return [
        Variable(
            f"{EXTERNAL}{name}{index}",
            kinds.get(found.type, "Integer"),
            "input",
            about=about,
            symbol=f"{EXTERNAL}{name}{index}",
        )
        for name, found in cell.externals.items()
        if found.type != "STRING"
        for index in _indices(found.size)
    ]


def _indices(size: int | None) -> list[str]:
    return [""] if size is None else [f"[{i}]" for i in range(size)]


def outputs(cell: CellConfig) -> list[Variable]:
    """State of the cell behind each step."""
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
        _flag(PROGRAM_END, "", "the program is completed"),
        _whole("m_functions", "", "M functions that were output so far"),
        _whole("elements", "", "elements of the contour ahead"),
        *_row("m", "Integer", "", NO_FUNCTION, "of the last M functions"),
        *(
            element
            for name, unit in MEMBERS
            for element in _row(
                f"ahead.{name}",
                "Real",
                unit,
                0.0,
                "of an element of the contour ahead",
            )
        ),
    ]


def _row(
    array: str, kind: str, unit: str, start: float, about: str
) -> list[Variable]:
    """An array of FMI 3.0; in FMI 2.0 the number stands in the name."""
    first, dot, member = array.partition(".")
    return [
        Variable(
            f"{first}{i}{dot}{member}",
            kind,
            "output",
            unit,
            start,
            about,
            array=array,
        )
        for i in range(ARRAY)
    ]


def _real(
    name: str, unit: str, symbol: str, about: str, scale: float = 1.0
) -> Variable:
    return Variable(name, "Real", "output", unit, 0.0, about, symbol, scale)


def _whole(name: str, symbol: str, about: str) -> Variable:
    return Variable(name, "Integer", "output", about=about, symbol=symbol)


def _flag(name: str, symbol: str, about: str) -> Variable:
    return Variable(name, "Boolean", "output", about=about, symbol=symbol)


def told_apart(
    found: Sequence[Variable], others: Sequence[Variable]
) -> list[Variable]:
    """A symbol that is an input, too, gets ``.now`` behind its name."""
    taken = {other.name for other in others}
    return [
        replace(v, name=f"{v.name}.now") if v.name in taken else v
        for v in found
    ]


def check_names(variables: Sequence[Variable]) -> None:
    """CncError: two variables of one name."""
    seen: set[str] = set()
    for variable in variables:
        if variable.name in seen:
            raise CncError(902001, f"FMU: two variables {variable.name!r}")
        seen.add(variable.name)
