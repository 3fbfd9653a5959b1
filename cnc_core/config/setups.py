"""The channels of a cell, each with the cell as this channel sees it.

Everything that knows one channel so serves each of several.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from hli.layout import HLI_SYS_AX_MAXIDX, HLI_SYS_CH_MAXIDX

from .axes import AxisConfig
from .cell import CellConfig
from .channel import ChannelConfig
from .channels import ChannelPlace, ChannelTable

CHANNELS_MAX = HLI_SYS_CH_MAXIDX + 1
AXES_MAX = HLI_SYS_AX_MAXIDX + 1
NAME_LENGTH = 23
FREE_PLACE = "QFREE"  # with a number: the name of a place without an axis
# of a machine with one channel: with several each channel has its own
OF_ONE_CHANNEL = ("axes", "spindles", "kinematics", "probe", "zero_offsets")
# at the top for all channels; a channel's table replaces or extends it
FOR_ALL = ("tools", "external", "isons", "osai")


@dataclass(frozen=True)
class ChannelSetup:
    """One channel: its place, the cell as it sees it, its program."""

    place: ChannelPlace
    cell: CellConfig
    program: str = ""
    dialect: str | None = None

    @property
    def areas(self) -> int:
        """Axis areas that it has in the HLI."""
        return self.own_axes + len(self.cell.spindles)

    @property
    def own_axes(self) -> int:
        """Axes that it begins with; places for guests lie behind them."""
        return len(self.cell.axes) - self.cell.guests


def setups_of(cell: CellConfig) -> tuple[ChannelSetup, ...]:
    """The channels of a cell in the order of ``gpCh``; ValueError tells what is
    wrong in one of them.
    """
    if not cell.channels:
        return (ChannelSetup(ChannelPlace(), cell),)
    _check_names(cell)
    found: list[ChannelSetup] = []
    base, axes = 0, _axes_by_number(cell)
    for index, (name, table) in enumerate(cell.channels.items()):
        place = ChannelPlace(index, name, base)
        seen = _seen_by(cell, table, place, axes)
        found.append(ChannelSetup(place, seen, table.program, table.dialect))
        base += found[-1].areas
    if base > AXES_MAX:
        raise ValueError(
            f"channels: {base} axes and spindles, the HLI has room for"
            f" {AXES_MAX}"
        )
    _check_axes(found)
    return tuple(found)


def _check_names(cell: CellConfig) -> None:
    if len(cell.channels) > CHANNELS_MAX:
        raise ValueError(
            f"channels: {len(cell.channels)} tables, the HLI has room for"
            f" {CHANNELS_MAX}"
        )
    known: dict[str, str] = {}
    for name in cell.channels:
        plain = name.replace("_", "").replace("-", "")
        if not (
            plain.isalnum() and plain.isascii() and len(name) <= NAME_LENGTH
        ):
            raise ValueError(
                f"channel name {name[:40]!r}: at most {NAME_LENGTH} letters,"
                " digits, '_' and '-'"
            )
        other = known.setdefault(name.lower(), name)
        if other != name:
            raise ValueError(
                f"channel names {other} and {name} differ only in capitals"
            )
    for key in OF_ONE_CHANNEL:
        if key in cell.model_fields_set:
            raise ValueError(
                f"{key}: belongs to one channel; write [channels.NAME.{key}]"
            )


def _axes_by_number(cell: CellConfig) -> dict[int, tuple[str, AxisConfig]]:
    """Channel and table of every axis by its logical number."""
    found: dict[int, tuple[str, AxisConfig]] = {}
    base = 0
    for name, table in cell.channels.items():
        for i, axis in enumerate(table.axes.values(), base + 1):
            found.setdefault(axis.id or i, (name, axis))
        base += len(table.axes) + len(table.spindles)
    return found


def _guests(
    table: ChannelTable,
    place: ChannelPlace,
    axes: dict[int, tuple[str, AxisConfig]],
) -> dict[str, dict[str, Any]]:
    """Places for axes of other channels: like the axes that they are for."""
    found: dict[str, dict[str, Any]] = {}
    for number in table.guest_axes:
        home, axis = axes.get(number, ("", None))
        where = f"channels.{place.name}.guest_axes"
        if axis is None:
            raise ValueError(f"{where}: no channel has an axis {number}")
        if home == place.name or f"{FREE_PLACE}{number}" in found:
            raise ValueError(f"{where}: axis {number} has a place already")
        like = axis.model_dump(
            exclude_unset=True, exclude={"min_mm", "max_mm", "start_mm"}
        )
        found[f"{FREE_PLACE}{number}"] = like | {"id": number}
    return found


def _seen_by(
    cell: CellConfig,
    table: ChannelTable,
    place: ChannelPlace,
    axes: dict[int, tuple[str, AxisConfig]],
) -> CellConfig:
    """The cell as one of its channels sees it."""
    own = table.model_dump(exclude_unset=True, by_alias=True)
    top = cell.model_dump(exclude_unset=True, by_alias=True)
    for name in own.get("external", {}):
        if table.external[name].scope == "global":
            raise ValueError(
                f"channels.{place.name}.external.{name}: a global variable is of"
                f" all channels; write [external.{name}] with scope global"
            )
    values: dict[str, Any] = {"name": cell.name, "cycle_s": cell.cycle_s}
    for key in FOR_ALL:
        if key in top or key in own:
            values[key] = top.get(key, {}) | own.get(key, {})
    values |= {key: own[key] for key in OF_ONE_CHANNEL if key in own}
    parameters = {
        key: value
        for key, value in own.items()
        if key in ChannelConfig.model_fields
    }
    values["channel"] = top.get("channel", {}) | parameters
    for i, axis in enumerate(values["axes"].values(), 1):
        axis.setdefault("id", place.axis_base + i)
    guests = _guests(table, place, axes)
    values["axes"] = values["axes"] | guests
    try:
        return type(cell).model_validate(values).with_guests(len(guests))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(["channels", place.name, *map(str, first["loc"])])
        text = str(first["msg"]).removeprefix("Value error, ")
        raise ValueError(f"{where}: {text}") from None


def _check_axes(found: list[ChannelSetup]) -> None:
    """An axis, by its logical number, belongs to one channel."""
    owners: dict[int, str] = {}
    for setup in found:
        cell = setup.cell
        own = setup.own_axes
        names = [*cell.axis_names[:own], *cell.spindles]
        spindles = [spindle.id for spindle in cell.spindles.values()]
        numbers = [*cell.axis_ids[:own], *spindles]
        for name, number in zip(names, numbers, strict=True):
            owner = owners.get(number)
            if owner is not None:
                raise ValueError(
                    f"channels.{setup.place.name}.axes.{name}: logical axis"
                    f" number {number} belongs to {owner} already; an axis"
                    " belongs to one channel"
                )
            owners[number] = f"axis {name} of channel {setup.place.name}"
