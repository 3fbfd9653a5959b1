"""The CNC of the cell as objects of OPC 40502."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib.metadata import version
from typing import Any

from asyncua import ua

from . import cnc_values, model
from .cnc_values import AXIS, CHANNEL, TURNS, Position, drive_of
from .entries import ModelEntry
from .space import HAS_PROPERTY, Space, std
from .types import CncPositionDataType, Types

UNITS = {
    "mm": (5066068, "mm"),
    "mm/s": (4405558, "mm/s"),
    "deg": (17476, "°"),
    "%": (20529, "%"),
    "W": (5723220, "W"),
    "N.m": (20053, "N·m"),
    "1/min": (5394509, "1/min"),
}
UNIT_OF = {
    "ActFeedrate": "mm/s",
    "CmdFeedrate": "mm/s",
    "DryRunFeed": "mm/s",
    "ActJogIncrement": "mm",
    "ActOverride": "%",
    "CmdOverride": "%",
    "ActLoad": "%",
    "ActPower": "W",
    "ActTorque": "N.m",
    "CmdTorque": "N.m",
    "ActSpeed": "1/min",
    "CmdSpeed": "1/min",
}
RANGE_OF = {"%": (0.0, 200.0)}
RANGE = (-1e9, 1e9)
CNC = "CncInterface"
VARIANTS = {
    "Boolean": ua.VariantType.Boolean,
    "Double": ua.VariantType.Double,
    "String": ua.VariantType.String,
    "UInt32": ua.VariantType.UInt32,
    "NodeId": ua.VariantType.NodeId,
}
Get = Callable[[Any], Any]


class Cnc:
    """Builds the objects of one cell, anew for each CNC."""

    def __init__(self, space: Space, types: Types, name: str) -> None:
        self._space, self._types, self._name = space, types, name
        self.interface = self._id(CNC)
        self._nodes: list[ua.NodeId] = []
        self._shape: object = None

    def _id(self, path: str) -> ua.NodeId:
        return ua.NodeId(path, self._types.ns)

    # -- what is there without a CNC, too
    def add_interface(self) -> None:
        """CncInterface with its lists."""
        kind = self._types.object_type("CncInterfaceType")
        name = self._types.name(CNC)
        parent = std(ua.ObjectIds.ObjectsFolder)
        self._space.object(self.interface, name, parent, kind)
        texts = {
            "CncTypeName": f"hli-cosim cell {self._name}",
            "Fix": "0",
            "VendorName": "hli-cosim",
            "VendorRevision": version("hli-cosim"),
            "Version": "1.00",
        }
        for member, text in texts.items():
            self._space.constant(
                self._id(f"{CNC}.{member}"),
                self._types.name(member),
                self.interface,
                ua.Variant(text, ua.VariantType.String),
                self._types.data_type("String"),
            )
        for what in ("Axis", "Channel", "Spindle"):
            self._space.object(
                self._id(f"{CNC}.Cnc{what}List"),
                self._types.name(f"Cnc{what}List"),
                self.interface,
                self._types.object_type(f"Cnc{what}ListType"),
            )

    # -- what a CNC has
    def build(self, root: Any) -> None:
        """Channels, axes and spindles of this CNC, instead of those before.

        Of a CNC that comes back as it was, clients keep their subscriptions.
        """
        head = root.segment_head
        drives = [self._drive_of(root, k) for k in range(head.axis_count)]
        shape = head.channel_count, drives
        if shape == self._shape:
            return
        self._shape = shape
        self._space.delete(reversed(self._nodes))
        self._nodes.clear()
        for k in range(head.channel_count):
            self._channel(k)
        for k, (name, turns) in enumerate(drives):
            self._drive(k, name, turns)

    @staticmethod
    def _drive_of(root: Any, k: int) -> tuple[str, bool]:
        """Name of an axis, and whether it is a spindle."""
        turns = root.axis[k].head.axis_type_r == cnc_values.SPINDLE
        coord = cnc_values.coord_of(root, root.axis[k])
        name = coord.name.decode() if coord is not None else ""
        number = root.axis[k].head.log_ax_n_r or k + 1
        return name or f"{'S' if turns else 'A'}{number}", bool(turns)

    def _object(self, path: str, name: str, parent: str, kind: str) -> str:
        node = self._space.object(
            self._id(path),
            self._types.name(name),
            self._id(parent),
            self._types.object_type(kind),
        )
        self._nodes.append(node)
        return path

    def _channel(self, k: int) -> None:
        name = f"Channel{k + 1}"
        parent = f"{CNC}.CncChannelList"
        path = self._object(f"{parent}.{name}", name, parent, "CncChannelType")

        def of(get: Get) -> Get:
            return lambda root: get(root.channel[k])

        self._members(path, "CncChannelType", CHANNEL, of)

    def _drive(self, k: int, name: str, turns: bool) -> None:
        what = "Spindle" if turns else "Axis"
        kind = f"Cnc{what}Type"
        parent = f"{CNC}.Cnc{what}List"
        path = self._object(f"{parent}.{name}", name, parent, kind)

        def of(get: Get) -> Get:
            return lambda root: get(drive_of(root, k))

        self._members(path, kind, TURNS if turns else AXIS, of)
        channel = self._id(f"{CNC}.CncChannelList.Channel1")
        self._member(path, "ActChannel", "NodeId", "item", lambda root: channel)

    def _members(
        self,
        path: str,
        kind: str,
        values: dict[str, Get],
        of: Callable[[Get], Get],
    ) -> None:
        for name, data_type, what, _ in model.all_members_of(kind):
            if name in values:
                get = of(values[name])
                if what == "position":
                    self._position(path, name, get)
                else:
                    self._member(path, name, data_type, what, get)

    def _member(
        self, path: str, name: str, data_type: str, kind: str, get: Get
    ) -> None:
        plain = data_type.removesuffix("[]")
        variant = VARIANTS.get(plain, ua.VariantType.Int32)
        entry = ModelEntry(get, lambda value: ua.Variant(value, variant))
        node = self._space.variable(
            self._id(f"{path}.{name}"),
            self._types.name(name),
            self._id(path),
            entry,
            self._types.data_type(data_type),
            array=data_type.endswith("[]"),
            definition=self._types.kind(kind),
            reference=HAS_PROPERTY if kind == "property" else 47,
        )
        self._nodes.append(node)
        if kind == "analog":
            self._unit(f"{path}.{name}", node, UNIT_OF.get(name, "mm"))

    def _position(self, path: str, name: str, get: Get) -> None:
        whole = f"{path}.{name}"
        node = self._space.variable(
            self._id(whole),
            self._types.name(name),
            self._id(path),
            ModelEntry(get, _structure),
            self._types.data_type(model.POSITION),
            definition=self._types.kind("position"),
        )
        self._nodes.append(node)
        for part in model.POSITION_MEMBERS:
            entry = ModelEntry(_part(get, part), _double)
            self._nodes.append(
                self._space.variable(
                    self._id(f"{whole}.{part}"),
                    self._types.name(part),
                    node,
                    entry,
                    self._types.data_type("Double"),
                )
            )
        self._unit(whole, node, "mm")

    def _unit(self, path: str, node: ua.NodeId, unit: str) -> None:
        number, text = UNITS[unit]
        info = ua.EUInformation(
            NamespaceUri="http://www.opcfoundation.org/UA/units/un/cefact",
            UnitId=number,
            DisplayName=ua.LocalizedText(text),
            Description=ua.LocalizedText(text),
        )
        low, high = RANGE_OF.get(unit, RANGE)
        span = ua.Range(Low=low, High=high)
        constants: Iterable[tuple[str, Any, int]] = (
            ("EngineeringUnits", info, ua.ObjectIds.EUInformation),
            ("EURange", span, ua.ObjectIds.Range),
        )
        for name, value, data_type in constants:
            self._nodes.append(
                self._space.constant(
                    self._id(f"{path}.{name}"),
                    ua.QualifiedName(name, 0),
                    node,
                    ua.Variant(value, ua.VariantType.ExtensionObject),
                    std(data_type),
                )
            )


def _double(value: float) -> ua.Variant:
    return ua.Variant(value, ua.VariantType.Double)


def _structure(place: Position) -> ua.Variant:
    value = CncPositionDataType(place.ActPos, place.CmdPos, place.RemDist)
    return ua.Variant(value, ua.VariantType.ExtensionObject)


def _part(get: Get, name: str) -> Get:
    return lambda root: dict(vars(get(root)))[name]
