"""What stands at the places of the channel: names, offsets and limits follow an
exchange of axes.
"""

from __future__ import annotations

from cnc_core.errors import CncError
from cnc_core.frontend.axes import ChannelAxes, Placed
from cnc_core.frontend.base.flow import Flow
from cnc_core.frontend.base.scanner import Modal
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.units import FloatArray

from .offsets import Offsets

FREE = "?"  # with its number: what a place without an axis is called


class AxisPlaces:
    """``names``: channel index by name in capitals, long names first; everything
    that reads a program shares it.
    """

    def __init__(
        self,
        machine: ProgramMachine,
        modal: Modal,
        offsets: Offsets,
        flow: Flow,
    ) -> None:
        self._machine, self._modal = machine, modal
        self._offsets, self._flow = offsets, flow
        self.names: dict[str, int] = {}
        own = len(machine.axes) - machine.guests
        titles = [name.upper() for name in machine.axes[:own]]
        self._shown: list[Placed | None] | None = None
        self._name([*titles, *[""] * machine.guests])

    def _name(self, titles: list[str]) -> None:
        by_length = sorted(titles, key=len, reverse=True)
        self.names.clear()
        self.names.update(
            {name: titles.index(name) for name in by_length if name}
        )
        for place, name in enumerate(titles):
            self._offsets.names[place] = name or f"{FREE}{place}"
        self._modal.name_axes(titles)

    def take(
        self, axes: ChannelAxes, soft: tuple[FloatArray, FloatArray] | None
    ) -> None:
        """What stands where has changed; the axes stand, their coordinates are
        the machine's.

        ``soft``: lowest and highest position by G98 and G99.
        """
        before = self._shown if self._shown is not None else list(axes.home)
        after = list(axes.places)
        position = self._modal.position
        for place, (old, new) in enumerate(zip(before, after, strict=True)):
            if old != new:
                position[place] = self._place(axes, place, new)
                self._bound(axes, place, new, soft)
        self._shown = after
        self._name([one.name if one else "" for one in after])
        for file in self._flow.known_files:
            file.blocks.clear()  # they mean other axes now
        self._modal.set_position(position)
        self._offsets.update()
        for place, (old, new) in enumerate(zip(before, after, strict=True)):
            if old != new:
                self._modal.set_offset_of(place)

    def _place(
        self, axes: ChannelAxes, place: int, one: Placed | None
    ) -> float:
        """Offsets and limits of a place; where its axis stands."""
        offsets, machine = self._offsets, self._machine
        offsets.g92[place] = offsets.pset[place] = 0.0
        axis = axes.axis(one.number) if one else None
        if axis is None:
            return 0.0
        if machine.velocity is not None:
            machine.velocity[place] = axis.limits[0]
        if machine.acceleration is not None:
            machine.acceleration[place] = axis.limits[1]
        return axis.position

    def _bound(
        self,
        axes: ChannelAxes,
        place: int,
        one: Placed | None,
        soft: tuple[FloatArray, FloatArray] | None,
    ) -> None:
        """G98 and G99 end with the axis that was here."""
        axis = axes.axis(one.number) if one else None
        low, high = (axis.low, axis.high) if axis else (0.0, 0.0)
        for limits in (self._machine.limits, soft):
            if limits is not None:
                limits[0][place], limits[1][place] = low, high


def refuse_kind(
    machine: ProgramMachine, axes: ChannelAxes, place: int, one: Placed
) -> CncError | None:
    """A place is for linear or for rotary axes; limits of the jerk need a
    channel that is planned with them.
    """
    axis = axes.axis(one.number)
    if axis is None:
        return None
    if axis.limits[2] > 0 and not axes.jerk_limited:
        return CncError(
            907058,
            f"axis {one.number} has a limit of the jerk, the channel none",
        )
    if axis.rotary == machine.rotary[place]:
        return None
    kinds = ("a linear", "a rotary")
    return CncError(
        907058,
        f"axis {one.number} is {kinds[axis.rotary]} axis, place {place} is for"
        f" {kinds[machine.rotary[place]]} one",
    )
