"""Axes of a cell that its channels may exchange."""

from __future__ import annotations

from collections.abc import Sequence

from ..frontend.axes import AxisData, Placed
from .setups import ChannelSetup


def axes_of(setups: Sequence[ChannelSetup]) -> dict[int, AxisData]:
    """Every axis of the cell by its logical number, where it starts."""
    found: dict[int, AxisData] = {}
    for setup in setups:
        names, numbers = setup.cell.axis_names, setup.cell.axis_ids
        for place in range(setup.own_axes):
            axis = setup.cell.axes[names[place]]
            found[numbers[place]] = AxisData(
                numbers[place],
                names[place],
                axis.kind == "rotary",
                (axis.v_max_mm_s, axis.a_max_mm_s2, axis.j_max_mm_s3),
                axis.min_mm,
                axis.max_mm,
                axis.start_mm,
                setup.place.index,
                place,
            )
    return found


def places_of(setup: ChannelSetup) -> list[Placed | None]:
    """What stands at the places of a channel when a program begins."""
    names, numbers = setup.cell.axis_names, setup.cell.axis_ids
    own = setup.own_axes
    placed = zip(names[:own], numbers[:own], strict=True)
    return [*(Placed(*one) for one in placed), *[None] * setup.cell.guests]
