"""SysHscSettings: calls the manufacturer's subprogram of a machining state
(``hscs.*`` of the channel).
"""

from __future__ import annotations

from cnc_core.frontend.isg.cycles.declaration import (
    PLAIN,
    Cycle,
    Given,
    Parameter,
    Surroundings,
    Work,
)

from ..state.system import STATES


def build(given: Given, around: Surroundings) -> Work:
    """One call, or nothing if the state has no subprogram."""
    program = around.programs.get(f"hscs.{STATES[int(given[1]) - 1]}.prog", "")
    return Work(lines=[f"L {program}"] if program else [])


CYCLE = Cycle(
    "SysHscSettings",
    "settings of the manufacturer for high-speed cutting",
    (
        Parameter(
            1,
            "1 deselect, 2 rough, 3 medium, 4 fine",
            PLAIN,
            default=1.0,
            low=1,
            high=4,
            whole=True,
        ),
    ),
    build,
)
