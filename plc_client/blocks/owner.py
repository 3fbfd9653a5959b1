"""What a function block is made for: a channel, an axis, the whole connection.

A block takes its area, ``hli.gpCh[0]``, or its own unit there.  Everything else
is refused with the right spelling, before a byte of the memory is touched.
"""

from __future__ import annotations

import ctypes
from operator import attrgetter
from typing import Any, TypeAlias

from hli import layout
from hli.areas import Areas
from hli.structures import (
    HLI_AXIS,
    HLI_CHANNEL,
    MC_CONTROL_BOOL_UNIT,
    MC_CONTROL_LREAL_UNIT,
    MC_CONTROL_SGN32_UNIT,
    MC_CONTROL_UNS16_UNIT,
    MC_CONTROL_UNS32_UNIT,
)
from hli.view import View, expect, path_of, root_of, spelling

LEVEL_STRUCTURES: tuple[type[ctypes.Structure], ...] = (
    layout.MC_CONTROL_BOOL_UNIT,
    layout.MC_CONTROL_UNS16_UNIT,
    layout.MC_CONTROL_SGN32_UNIT,
    layout.MC_CONTROL_UNS32_UNIT,
    layout.MC_CONTROL_LREAL_UNIT,
)
AnyLevelUnit: TypeAlias = (
    MC_CONTROL_BOOL_UNIT
    | MC_CONTROL_UNS16_UNIT
    | MC_CONTROL_SGN32_UNIT
    | MC_CONTROL_UNS32_UNIT
    | MC_CONTROL_LREAL_UNIT
)


def channel_of(block: object, given: Any, *units: str) -> HLI_CHANNEL:
    """The channel that was given, or the one of the block's own unit.

    ``units``: the block's units, as paths from the channel.  Raises TypeError.
    """
    area: HLI_CHANNEL = _area(block, given, layout.HLI_CHANNEL, "gpCh", units)
    return area


def axis_of(block: object, given: Any) -> HLI_AXIS:
    """The axis that was given.  Raises TypeError."""
    area: HLI_AXIS = _area(block, given, layout.HLI_AXIS, "gpAx", ())
    return area


def areas_of(block: object, given: Any) -> Areas:
    """The connection that was given.  Raises TypeError."""
    if isinstance(given, Areas):
        return given
    name = type(block).__name__
    raise TypeError(
        f"{name}: takes the whole HLI, {name}(hli); not {spelling(given)}"
    )


def level_unit_of(block: object, given: Any) -> Any:
    """The level unit that was given.  Raises TypeError."""
    name = type(block).__name__
    example = f"a level unit, {name}(hli.gpCh[0].bahn_mc_control.feedhold)"
    expect(given, name, example, *LEVEL_STRUCTURES)
    return given


def area_around(view: View) -> Any:
    """The channel or axis around a view; None outside of them."""
    area: View | None = view
    while area is not None:
        if isinstance(area._c, (layout.HLI_CHANNEL, layout.HLI_AXIS)):
            return area
        area = area._parent
    return None


def _area(
    block: object,
    given: Any,
    structure: type[ctypes.Structure],
    pointers: str,
    units: tuple[str, ...],
) -> Any:
    area: Any = area_around(given) if isinstance(given, View) else None
    fitting = (
        area is not None
        and isinstance(area._c, structure)
        and isinstance(root_of(area)._c, layout.HLI_SEGMENT)
    )
    own = [attrgetter(unit)(area) for unit in units] if fitting else []
    if fitting and (given is area or any(given is unit for unit in own)):
        return area
    name = type(block).__name__
    where = path_of(area) if fitting else f"hli.{pointers}[0]"
    kind = "channel" if structure is layout.HLI_CHANNEL else "axis"
    example = f"the {kind}, {name}({where})"
    for unit in units:
        example += f", or its unit, {name}({where}.{unit})"
    raise TypeError(f"{name}: takes {example}; not {spelling(given)}")
