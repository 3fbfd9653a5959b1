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
    """

    name: str
    pid: int
    clock: str
    program: str
    state: str
    plc: int | None

    def as_json(self) -> dict[str, Any]:
        return asdict(self)


def _info(name: str, root: layout.HLI_SEGMENT) -> CellInfo:
    side, channel = root.sidecar, root.channel[0]
    mode = channel.channel_mc_control.mode_and_state.state_r
    plc = side.plc
    return CellInfo(
        name,
        int(side.cnc.pid or root.segment_head.owner_pid),
        CLOCKS.get(side.cnc.clock, str(side.cnc.clock)),
        channel.bahn_state.prog_name_r.decode("latin-1"),
        STATES.get(mode.state, str(mode.state)),
        int(plc.pid) if plc.attached else None,
    )


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
