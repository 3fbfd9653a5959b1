"""The program that executes a cycle at the places of a call pattern
(SysPosPattern).
"""

from __future__ import annotations

from collections.abc import Mapping

from cnc_core.frontend.base.variables import Value
from cnc_core.frontend.isg.cycles.declaration import Surroundings, number_text
from cnc_core.frontend.isg.cycles.text import Writer

from ..state.patterns import At

NO_RETRACT = 22178


def wrapper(
    places: list[At], retract: float, call: str, around: Surroundings
) -> list[str]:
    """The program of SysPosPatternWrapper: at every place retract, position,
    turn, execute ``call``.
    """
    out = Writer(around, "")
    for place in places:
        out.lines.append("G90")
        x, y, z = (
            value / around.unit_mm for value in (place.x, place.y, place.z)
        )
        out.rapid(z=retract)
        out.rapid(x, y)
        values = ", ".join(
            number_text(value) for value in (x, y, z, 0.0, 0.0, place.c)
        )
        back = (
            [] if around.absolute else ["G91"]
        )  # the cycle finds the caller's
        out.lines += [f"#CS ON [{values}]", *back, call, "#CS OFF"]
    return out.lines


def call_text(name: str, arguments: Mapping[int, Value], local: bool) -> str:
    """A cycle call with its values."""

    def shown(value: Value) -> str:
        return (
            '"' + value.replace('"', '\\"') + '"'
            if isinstance(value, str)
            else number_text(value)
        )

    values = " ".join(
        f"@P{number}={shown(value)}"
        for number, value in sorted(arguments.items())
    )
    return f"{'LL' if local else 'L'} CYCLE [NAME={name} {values}]"
