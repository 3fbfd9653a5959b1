"""Program flow: leaving stops, fetching and acknowledging technology functions."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any, NamedTuple

from hli._sync import ffi, lib

from hli import layout
from hli.areas import Areas
from hli.structures import HLI_AXIS, HLI_CHANNEL, MC_CONTROL_BOOL_UNIT
from hli.view import ViewArray, expect, view_class

from .level import command
from .owner import areas_of, channel_of

# fkt_ctrl_r: HLI_INTF_M_FKT, _H_FKT, _SPINDEL, _TOOL
KINDS = {1: "M", 2: "H", 3: "S", 4: "T"}
_NOT_AWAITED = 0x1 | 0x40000  # synch_mode: MOS, MOS_TS
_PAYLOADS: dict[int, Any] = {
    1: layout.HLI_M_H_PROZESS,
    2: layout.HLI_M_H_PROZESS,
    3: layout.HLI_S_PROZESS,
    4: layout.HLI_T_PROZESS,
}


class AutoContinue:
    """Answers every stop that waits for "continue" (M00, M01, single block): an
    edge on ``continue_machining``.

    The edge is given once ``wait_axes_in_position_r`` fell and taken back when
    the CNC shows it in ``state_r``, so two stops in a row get two edges.
    ``count`` counts the edges.
    """

    def __init__(self, ch: HLI_CHANNEL | MC_CONTROL_BOOL_UNIT) -> None:
        ch = channel_of(self, ch, "bahn_mc_control.continue_machining")
        self._state = ch.bahn_state
        self._unit = ch.bahn_mc_control.continue_machining
        # reading the structures themselves is quick: most scans end there
        self._shown, self._commanded = self._state._c, self._unit._c
        self.count = 0

    def __call__(self) -> None:
        """One scan."""
        if (
            not self._shown.wait_continue_r
            and self._commanded.enable_w
            and not self._commanded.command_w
        ):
            return  # nothing waits, and nothing is commanded
        waiting = (
            self._state.wait_continue_r
            and not self._state.wait_axes_in_position_r
        )
        before = self._unit.command_w and self._unit.enable_w
        rise = waiting and not before
        self.count += rise
        command(self._unit, rise or (waiting and not self._unit.state_r))


# first bit of an array in HLI_SIDE_TECHNO.again (c_ext/hli/sync.h)
_BIT_STD, _BIT_LATE = 0, 20


def _never() -> int:
    """No function is offered again."""
    return 0


class TechnoFunction(NamedTuple):
    """A fetched technology function: kind M, H, S or T, its number (S: ``rev``;
    T: ``basic``), payload, origin.

    ``again``: a PLC before this one has fetched it and not acknowledged it.
    Nobody knows whether it was carried out.
    """

    kind: str
    number: int
    payload: Any
    area: str
    late: bool
    again: bool = False


class TechnoArray:
    """One technology array of a channel or axis with its pointers cast once."""

    def __init__(
        self,
        area: HLI_CHANNEL | HLI_AXIS,
        area_name: str,
        late: bool,
        again: Callable[[], int] = _never,
    ) -> None:
        expect(
            area,
            "TechnoArray",
            "hli.gpCh[0] or hli.gpAx[0]",
            layout.HLI_CHANNEL,
            layout.HLI_AXIS,
        )
        units: ViewArray[Any] = (
            area.techno_unit_late_sync if late else area.techno_unit_std_sync
        )
        self.area_name, self.late = area_name, late
        self._units = units  # keeps the memory alive
        self._pointers = [unit._pointer() for unit in units]
        self._first, self._count = self._pointers[0], len(self._pointers)
        of_axis = area_name.startswith("gpAx")
        # an axis has marks for its first array alone
        self._again = _never if of_axis and late else again
        self._bit = _BIT_LATE if late and not of_axis else _BIT_STD
        self._awaited = [True] * self._count
        self._copy = layout.TECHNO_UNIT_CH()
        self._target = ffi.cast("void *", ctypes.addressof(self._copy))

    def fetch_all(self) -> Iterator[tuple[int, TechnoFunction]]:
        """Fetch (please_rw FALSE) every function that is offered: its unit's
        index and its content, in order.

        A function the CNC does not wait for is acknowledged in the step in
        which it is fetched: behind that its unit may hold another one already.
        """
        index = lib.hs_techno_next(self._first, self._count, 0)
        while index >= 0:
            unit = self._pointers[index]
            ffi.memmove(self._target, unit, ctypes.sizeof(self._copy))
            function = self._decode(index)
            awaited = not function.payload.synch_mode & _NOT_AWAITED
            (lib.hs_techno_fetch if awaited else lib.hs_techno_take)(
                unit, self._target
            )
            self._awaited[index] = awaited
            yield index, function
            index = lib.hs_techno_next(self._first, self._count, index + 1)

    @property
    def offered_units(self) -> int:
        """Bit i: a function is offered in unit i."""
        return int(lib.hs_techno_offered(self._first, self._count))

    def function(self, index: int) -> TechnoFunction:
        """What a unit holds, left as it is."""
        ffi.memmove(
            self._target, self._pointers[index], ctypes.sizeof(self._copy)
        )
        return self._decode(index)

    def offered(self) -> Iterator[tuple[str, TechnoFunction]]:
        """Every function that is offered, left as it is: its place and content."""
        index = lib.hs_techno_next(self._first, self._count, 0)
        while index >= 0:
            array = "late" if self.late else "std"
            place = f"{self.area_name} {array} {index}"
            yield place, self.function(index)
            index = lib.hs_techno_next(self._first, self._count, index + 1)

    def acknowledge(self, index: int) -> None:
        """Acknowledge (done_w TRUE) the function fetched last from a unit."""
        if self._awaited[index]:
            lib.hs_techno_done(self._pointers[index])

    def _decode(self, index: int) -> TechnoFunction:
        code = self._copy.fkt_ctrl_r
        structure = _PAYLOADS.get(code, layout.HLI_M_H_PROZESS)
        payload: Any = view_class(structure)(
            structure.from_buffer_copy(bytes(self._copy.attribut_r.data))
        )
        number = {3: lambda: payload.rev, 4: lambda: payload.id.basic}.get(
            code, lambda: payload.nr
        )()
        return TechnoFunction(
            KINDS.get(code, "?"),
            number,
            payload,
            self.area_name,
            self.late,
            bool(self._again() >> self._bit + index & 1),
        )


class TechnoArea:
    """Both arrays of a channel or axis; they lie side by side, so that one look
    finds out that nothing is there.
    """

    def __init__(
        self,
        area: HLI_CHANNEL | HLI_AXIS,
        name: str,
        again: Callable[[], int] = _never,
    ) -> None:
        self._arrays = [
            TechnoArray(area, name, late, again) for late in (False, True)
        ]
        std: ViewArray[Any]
        late: ViewArray[Any]
        std, late = area.techno_unit_std_sync, area.techno_unit_late_sync
        self._first = std[0]._pointer()
        self._count = len(std) + len(late)
        self.units = (self._first, self._count)  # hs_units
        assert late[0]._address - std[0]._address == len(std) * ctypes.sizeof(
            layout.TECHNO_UNIT_CH
        )

    def fetch_all(self) -> Iterable[tuple[TechnoArray, int, TechnoFunction]]:
        """Every function that is offered, std array first."""
        if lib.hs_techno_next(self._first, self._count, 0) < 0:
            return ()
        return (
            (array, *found)
            for array in self._arrays
            for found in array.fetch_all()
        )

    def offered(self) -> Iterable[tuple[str, TechnoFunction]]:
        """Every function that is offered, left as it is."""
        if lib.hs_techno_next(self._first, self._count, 0) < 0:
            return ()
        return (found for array in self._arrays for found in array.offered())


def techno_areas(hli: Areas) -> list[TechnoArea]:
    """The configured areas, axes first; what an earlier PLC has left open is
    marked.
    """
    techno = hli.sidecar.techno
    axes, channels = techno.axis_again, techno.again
    areas = [
        TechnoArea(area, f"gpAx[{i}]", partial(axes.__getitem__, i))
        for i, area in enumerate(hli.gpAx)
        if area is not None
    ]
    return areas + [
        TechnoArea(area, f"gpCh[{i}]", partial(channels.__getitem__, i))
        for i, area in enumerate(hli.gpCh)
        if area is not None
    ]


class AcknowledgeAll:
    """Fetches and acknowledges all technology functions of all channels and
    axes (two-flag protocol), axes first.

    Returns the functions of this scan in order; ``on_function`` is called for
    each between fetch and acknowledgement.
    """

    def __init__(
        self,
        hli: Areas,
        on_function: Callable[[TechnoFunction], None] | None = None,
    ) -> None:
        self._areas = techno_areas(areas_of(self, hli))
        self._table = ffi.new(
            "hs_units[]", [area.units for area in self._areas]
        )
        self._on_function = on_function

    def __call__(self) -> list[TechnoFunction]:
        """One scan."""
        functions: list[TechnoFunction] = []
        if not lib.hs_techno_any(self._table, len(self._areas)):
            return functions
        for area in self._areas:
            for array, index, function in area.fetch_all():
                if self._on_function is not None:
                    self._on_function(function)
                functions.append(function)
                array.acknowledge(index)
        return functions
