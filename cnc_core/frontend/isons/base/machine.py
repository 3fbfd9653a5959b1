"""What an IsoNs program sees of its machine beyond axes and tools: slots,
tables, parameters, simulated devices.
"""

from __future__ import annotations

from dataclasses import dataclass, field

SLOTS = 256
EVENTS = (
    "M_STOP",
    "M_START",
    "M_END",
    "M_GOBLOCK",
    "M_GORETRACE",
    "M_ERROR",
    "M_PAUSE",
    "M_GOPAUSE",
)
INPUTS, OUTPUTS, GENERICS, M_PARAMETERS = 256, 256, 10, 10
EVENT_SLOTS = 16  # numbers of G100 that the PLC can look back at
EVENT_PLACE = INPUTS + OUTPUTS + GENERICS + M_PARAMETERS  # block of their count
IO_BLOCKS = EVENT_PLACE + 1 + EVENT_SLOTS


@dataclass(frozen=True)
class Head:
    """Offsets from home and sensor offsets by axis letter, two values of the user."""

    offset: dict[str, float] = field(default_factory=dict)
    sensor: dict[str, float] = field(default_factory=dict)
    user: tuple[float, ...] = ()


@dataclass(frozen=True)
class ToolTable:
    """Diameter and length in mm, largest speed, up to 17 values of the user."""

    diameter: float = 0.0
    length: float = 0.0
    max_rpm: float = 0.0
    user: tuple[float, ...] = ()

    def values(self) -> list[float]:
        return [
            self.diameter,
            self.length,
            self.max_rpm,
            *self.user,
            *[0.0] * (17 - len(self.user)),
        ]


@dataclass(frozen=True)
class HomingSensors:
    """What the search for the home position finds on one axis; machine
    positions in mm or degrees, None: not there.

    ``negative``, ``positive``: where the sensor of a direction switches on;
    ``release``: how far back it switches off. ``index``: distance of the
    encoder's index marks, 0 none; ``index_offset``: position of one of them.
    ``absolute``: what an absolute encoder says where the axis stands.
    ``limit_negative``, ``limit_positive``: where the limit switches of the
    drive switch on.
    """

    negative: float | None = None
    positive: float | None = None
    release: float = 0.1
    index: float = 0.0
    index_offset: float = 0.0
    absolute: float | None = None
    limit_negative: float | None = None
    limit_positive: float | None = None


@dataclass(frozen=True)
class IsonsCell:
    """``parameters``: by full name.  ``origins``, ``offsets``: mm or degrees by
    slot and axis letter.

    ``canopen``: values of a node's objects by (index, subindex).  ``events``: M
    number of the macro by event, -1 none. ``passes_max``: jumps back after
    which a program that no machine drives counts as endless, 0: any number.
    ``io_block``: first block of the global external variables that holds
    inputs, outputs, $_K and $_PARM_.
    """

    parameters: dict[str, float] = field(default_factory=dict)
    origins: dict[int, dict[str, float]] = field(default_factory=dict)
    offsets: dict[int, dict[str, float]] = field(default_factory=dict)
    heads: dict[int, Head] = field(default_factory=dict)
    tools: dict[int, ToolTable] = field(default_factory=dict)
    canopen: dict[int, dict[tuple[int, int], int]] = field(default_factory=dict)
    events: dict[str, int] = field(default_factory=dict)
    pauses: dict[float, str] = field(default_factory=dict)
    macro_folder: str = "."
    app_path: str = "."
    positioners: int = 4
    io_block: int = 1
    passes_max: int = 20_000
    homing: dict[str, HomingSensors] = field(default_factory=dict)
