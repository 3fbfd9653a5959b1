"""The running cells of this user, as their segments show them."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from . import layout, segment
from .errors import HliError

CLOCKS = {
    layout.HLI_CLOCK_LOCKSTEP: "lockstep",
    layout.HLI_CLOCK_FREERUN: "freerun",
    layout.HLI_CLOCK_REALTIME: "realtime",
}
PREFIX = "HLI_IMCM_PROCESS_"
STATES = {
    value: name.removeprefix(PREFIX).lower()
    for name, value in layout.CONSTANTS.items()
    if name.startswith(PREFIX)
}


@dataclass(frozen=True)
class CellInfo:
    """A running cell.

    ``pid``: of the CNC.  ``state``: of its operation mode, in small letters.
    ``plc``: process of the PLC that is attached, or None.
    ``planner_us_per_ms``: its CPU time for each ms of motion, over all commits:
    p50, p99, max.
    ``channels``: program, state and planner of each, if there are several; those
    of the cell are the first's.
    """

    name: str
    pid: int
    clock: str
    program: str
    state: str
    plc: int | None
    planner_us_per_ms: dict[str, float]
    channels: tuple[dict[str, Any], ...] = ()

    def as_json(self) -> dict[str, Any]:
        found = asdict(self)
        if not self.channels:
            del found["channels"]
        return found


def _info(name: str, root: layout.HLI_SEGMENT) -> CellInfo:
    side, plc = root.sidecar, root.sidecar.plc
    count = root.segment_head.channel_count
    shown = list(map(_channel, root.channel[:count], side.planner[:count]))
    return CellInfo(
        name,
        int(side.cnc.pid or root.segment_head.owner_pid),
        CLOCKS.get(side.cnc.clock, str(side.cnc.clock)),
        shown[0]["program"],
        shown[0]["state"],
        int(plc.pid) if plc.attached else None,
        shown[0]["planner_us_per_ms"],
        tuple(shown) if len(shown) > 1 else (),
    )


def _channel(
    channel: layout.HLI_CHANNEL, planner: layout.HLI_SIDE_PLANNER
) -> dict[str, Any]:
    mode = channel.channel_mc_control.mode_and_state.state_r
    pace = (planner.p50, planner.p99, planner.most)
    return {
        "program": channel.bahn_state.prog_name_r.decode("latin-1"),
        "state": STATES.get(mode.state, str(mode.state)),
        "planner_us_per_ms": dict(
            zip(("p50", "p99", "max"), pace, strict=True)
        ),
    }


def running_cells() -> list[CellInfo]:
    """The cells whose owner lives, by name."""
    found = []
    for path in sorted(segment.SHM_DIR.iterdir()):
        if not segment.NAME_RULE.fullmatch(path.name):
            continue
        try:
            with segment.attach(path.name) as cell:
                if cell.owner_alive():
                    found.append(_info(path.name, cell.root))
        except (HliError, OSError, ValueError):
            continue  # no segment, another user's, or not published
    return found
