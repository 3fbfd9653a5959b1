"""Axis exchange on the way of a program's rows: other axes stand at the places
of the channel.
"""

from __future__ import annotations

from ..config import CellConfig, setups_of
from ..config.exchange import axes_of, places_of
from ..frontend.axes import OpenAxes, Placed
from ..frontend.port import ChannelPort
from ..geometry.stages.axis_limits import AxisLimits
from ..units import FloatArray

EMPTY = "of place {}, which is empty,"


def alone(cell: CellConfig) -> OpenAxes:
    """The axes of a channel whose machine is not known."""
    setups = setups_of(cell)
    return OpenAxes(axes_of(setups), places_of(setups[0]))


class Exchange:
    """Keeps the limits of a program those of the axes that are there.

    A place without an axis does not move: it stands at 0.
    """

    def __init__(
        self, cell: CellConfig, port: ChannelPort, limits: AxisLimits
    ) -> None:
        self._port, self._limits = port, limits
        count = len(cell.axis_names)
        self._shown: list[Placed | None] = (
            list(port.axes.places) if port.axes else [None] * count
        )
        for place in range(count - cell.guests, count):
            if self._shown[place] is None:
                limits.set_range(place, EMPTY.format(place), 0.0, 0.0)

    def limit(self, stood: FloatArray) -> FloatArray:
        """(axes,) where the axes stand; ``stood`` (axes,) those before them."""
        position = stood.copy()
        axes = self._port.axes
        if axes is None:
            return position
        for place, one in enumerate(axes.places):
            before, self._shown[place] = self._shown[place], one
            if before == one:
                continue
            axis = axes.axis(one.number) if one else None
            low, high, position[place] = (
                (axis.low, axis.high, axis.position) if axis else (0.0,) * 3
            )
            name = one.name if one else EMPTY.format(place)
            self._limits.set_range(place, name, low, high)
        return position
