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
    ``channels``: program and state of each, if there are several; ``program``
    and ``state`` are those of the first.
    """

    name: str
    pid: int
    clock: str
    program: str
    state: str
    plc: int | None
    channels: tuple[dict[str, str], ...] = ()

    def as_json(self) -> dict[str, Any]:
        found = asdict(self)
        if not self.channels:
            del found["channels"]
        return found


def _info(name: str, root: layout.HLI_SEGMENT) -> CellInfo:
    side, plc = root.sidecar, root.sidecar.plc
    shown = [
        {"program": program, "state": state}
        for program, state in map(
            _channel, root.channel[: root.segment_head.channel_count]
        )
    ]
    return CellInfo(
        name,
        int(side.cnc.pid or root.segment_head.owner_pid),
        CLOCKS.get(side.cnc.clock, str(side.cnc.clock)),
        shown[0]["program"],
        shown[0]["state"],
        int(plc.pid) if plc.attached else None,
        tuple(shown) if len(shown) > 1 else (),
    )


def _channel(channel: layout.HLI_CHANNEL) -> tuple[str, str]:
    """Program and state of a channel."""
    mode = channel.channel_mc_control.mode_and_state.state_r
    return (
        channel.bahn_state.prog_name_r.decode("latin-1"),
        STATES.get(mode.state, str(mode.state)),
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
