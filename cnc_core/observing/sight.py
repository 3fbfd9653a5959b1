"""What the memory of a cell shows, as plain values in mm, mm/s, s and %."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable
from typing import Any

from hli._sync import ffi, lib

from hli.areas import Areas
from hli.cells import STATES
from hli.handshake import word_pointer
from hli.values import values

MM = 1e-4  # of 0.1 um
SNAPSHOT_TRIES = 100
MODES = {1: "standby", 2: "automatic", 3: "MDI", 4: "manual", 5: "reference"}
ROTARY = 2
ELEMENT_TYPES = {
    1: "linear",
    2: "circular",
    3: "log on",
    4: "log param",
    5: "log off",
    6: "polynomial",
}
FLAGS = (
    "program_end_r",
    "rapid_active_r",
    "backward_active_r",
    "feedhold_active_r",
    "dwell_time_active_r",
    "inside_rt_loop_r",
    "wait_continue_r",
    "wait_techno_acknowledge_r",
    "wait_error_removal_r",
)


def stop_texts() -> dict[int, str]:
    """Bit of ``stop_condition_r`` -> why the path stands."""
    told = values()["HLI_BAHN_STATE"]["stop_condition_r"]
    return {int(k.removeprefix("bit ")): text for k, text in told}


class _Copied:
    """A part of the channel that the CNC writes under its seqlock."""

    def __init__(self, view: Any, seq: Any) -> None:
        self.value = type(view._c)()
        self._view = view  # keeps the memory
        self._seq = seq
        self._source = view._pointer()
        self._target = ffi.cast("void *", ctypes.addressof(self.value))
        self._size = ctypes.sizeof(self.value)

    def take(self) -> bool:
        """Copy it undisturbed; False, and the copy is of no use: not now."""
        done = lib.hs_snapshot(
            self._seq, self._source, self._target, self._size, SNAPSHOT_TRIES
        )
        return bool(done == lib.HS_OK)


class Sight:
    """A channel of a cell and its axes.

    ``take`` copies what belongs together; the other methods tell of the copy.
    """

    def __init__(self, areas: Areas, channel: int = 0) -> None:
        self.areas = areas
        self.channel = channel
        self._channel = areas.gpCh[channel]
        seq = word_pointer(areas.root, "channel_seq")
        self._state = _Copied(self._channel.bahn_state, seq)
        unit = self._channel.contour_lookahead
        self._ahead = _Copied(unit.state, seq)
        self._unit: Any = unit._c
        self._answers = 0
        self._contour: dict[str, Any] = {"elements": []}
        self._stops = stop_texts()
        self._state.take()
        self._places = len(self._state.value.coord_r)
        # axes of a cell with one channel stay where they are
        self._move = areas.gNrCh > 1
        self._names: list[bytes] = []
        self.axes: list[tuple[int, str]] = []  # with their places
        self.spatial: list[int] = []
        self._find_axes()
        self.taken = False

    def _find_axes(self) -> None:
        """Which axes stand at which places of the channel now."""
        names = [one.name for one in self._state.value.coord_r[: self._places]]
        if names == self._names and self.spatial:
            return
        self._names = names
        told = [name.decode("latin-1") for name in names]
        self.axes = [(i, name) for i, name in enumerate(told) if name]
        places = [i for i, _ in self.axes]
        self.spatial = [
            i if i < 0 else places[i]
            for i in spatial([name for _, name in self.axes])
        ]

    @property
    def cell_s(self) -> float:
        """The cell's time, s."""
        return float(self.areas.sidecar.cnc.cell_time_ns * 1e-9)

    @property
    def cycle(self) -> int:
        """Completed cycles."""
        return int(self.areas.sidecar.cnc.cycle)

    def take(self) -> bool:
        """Copy status and look-ahead state."""
        self.taken = self._state.take() and self._ahead.take()
        if self._move and self.taken:
            self._find_axes()
        return self.taken

    @property
    def axis_numbers(self) -> set[int]:
        """Logical numbers of the axes that the channel has now."""
        coords = self._state.value.coord_r
        return {int(coords[i].log_axis_nr_r) for i, _ in self.axes}

    def error(self) -> tuple[int, int, int]:
        """Number, cycle and line of the channel's error unit."""
        head: Any = self._channel.mc_error._c.satz_r.kopf
        return int(head.error_id), int(head.cycle), int(head.line)

    def sample(self) -> list[float]:
        """One place of the trail: t s, x y z mm, v mm/s, path mm."""
        state = self._state.value
        place = [
            0.0 if i < 0 else state.coord_r[i].act_position_r * MM
            for i in self.spatial
        ]
        return [
            round(self.cell_s, 4),
            *(round(value, 4) for value in place),
            round(state.active_feed_r * 1e-3, 3),
            round(state.dist_prog_start * MM, 4),
        ]

    def program(self) -> str:
        """The name of the program that is selected."""
        return str(self._state.value.prog_name_r.decode("latin-1"))

    def motion(self) -> dict[str, Any]:
        """Speed, place, operation mode."""
        state, ahead = self._state.value, self._ahead.value
        mode = self._channel.channel_mc_control.mode_and_state._c.state_r
        bits = state.stop_condition_r
        known = ahead.max_dist_prog_start * MM
        return {
            "cell_s": self.cell_s,
            "cycle": self.cycle,
            "program": self.program(),
            "mode": MODES.get(mode.mode, str(mode.mode)),
            "state": STATES.get(mode.state, str(mode.state)),
            "v": state.active_feed_r * 1e-3,
            "feed": state.command_feed_r * 1e-3,
            "override": state.override_r / 10.0,
            "distance": state.dist_prog_start * MM,
            "known": known,
            "window": max(0.0, known - state.dist_prog_start * MM),
            "to_go": state.dist_to_go_r * MM,
            "n": state.block_number_r,
            "count": state.block_count_r,
            "tool": state.tool_nr_r,
            "stops": [
                text for bit, text in self._stops.items() if bits >> bit & 1
            ],
            "flags": [
                name.removesuffix("_r")
                for name in FLAGS
                if getattr(state, name)
            ],
            "units": self._units(),
        }

    def _units(self) -> dict[str, Any]:
        """What the operator panel commands, as the CNC uses it."""
        control: Any = self._channel.bahn_mc_control._c
        return {
            "override": control.override.state_r / 10.0,
            "rapid_override": control.rapid_override.state_r / 10.0,
            "feedhold": bool(control.feedhold.state_r),
            "single_block": bool(control.single_block.state_r),
        }

    def positions(self) -> list[dict[str, Any]]:
        """The axes: position, way to the end of the block."""
        state = self._state.value
        return [
            {
                "name": name,
                "unit": "deg"
                if state.coord_r[i].axis_type_r == ROTARY
                else "mm",
                "position": state.coord_r[i].act_position_r * MM,
                "target": state.coord_r[i].cmd_position_r * MM,
            }
            for i, name in self.axes
        ]

    def counters(self) -> dict[str, int]:
        """Requests, overruns and the like."""
        stats: Any = self.areas.sidecar.stats._c
        return {
            name: int(getattr(stats, name))
            for name, _ in stats._fields_
            if not name.startswith("fill_")
        }

    def contour(self) -> dict[str, Any]:
        """The last request of the contour look-ahead and its answer.

        An answer that the CNC is just writing is left for the next look.
        """
        number = int(self.areas.sidecar.clah_answer.word)
        unit = self._unit
        if number != self._answers and not unit.semaphor_rw:
            request = unit.request
            asked = request.start_position, request.length
            rows = elements_told(unit.response.block)
            again = int(self.areas.sidecar.clah_answer.word)
            if again == number and not unit.semaphor_rw:
                self._answers = number
                self._contour = {"elements": rows} | request_told(*asked)
        state = self._ahead.value
        return self._contour | {
            "answer": self._answers,
            "log": int(state.count_logged_blocks),
            "logging": bool(state.f_log_is_active),
        }


def spatial(names: list[str]) -> list[int]:
    """Places of X, Y and Z among the axes; without such names the first ones."""
    found = [names.index(n) if n in names else -1 for n in ("X", "Y", "Z")]
    if max(found) < 0:
        return [i if i < len(names) else -1 for i in range(3)]
    return found


def request_told(start: float, length: float) -> dict[str, Any]:
    """A request by its numbers in the HLI: lengths in mm."""
    mode = 1 if length == 0 else 2
    scale = 1.0 if mode == 1 else MM
    return {"mode": mode, "start": start * scale, "length": length * scale}


def elements_told(blocks: Iterable[Any]) -> list[dict[str, Any]]:
    """The elements of an answer up to the first of type 0; lengths in mm."""
    found = []
    for block in blocks:
        if not block.block_type:
            break
        kind = block.block_type
        found.append(
            {
                "type": ELEMENT_TYPES.get(kind, str(kind)),
                "n": block.block_number,
                "count": block.block_count_r,
                "start": block.start_position * MM,
                "length": block.length * MM,
                "radius": block.compensated_radius * MM,
                "programmed_radius": block.programmed_radius * MM,
                "angle": block.circle_angle,
                "turn": block.tangent_variation,
            }
        )
    return found
