"""The types of OPC 40502 in the address space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asyncua import ua

from . import model
from .space import HAS_PROPERTY, HAS_SUBTYPE, Space, std

ENUMERATION, STRUCTURE, BASE_VARIABLE = 29, 22, 63
ENUM_STRINGS, LOCALIZED_TEXT = 0, 21
MANDATORY, OPTIONAL, HAS_RULE, HAS_ENCODING = 78, 80, 37, 38
BINARY = 76


@dataclass
class CncPositionDataType:
    """Position, setpoint and remaining distance of a unit."""

    ActPos: ua.Double = 0.0
    CmdPos: ua.Double = 0.0
    RemDist: ua.Double = 0.0


BUILT_IN = {
    name: std(getattr(ua.ObjectIds, name))
    for name in ("Boolean", "Double", "NodeId", "String", "UInt32")
}


class Types:
    """Node ids of the model in its namespace."""

    def __init__(self, space: Space, namespace: int) -> None:
        self._space = space
        self.ns = namespace
        self._next = 7_000_000  # for what the specification gives no id here

    def own(self, number: int) -> ua.NodeId:
        """A node of the model."""
        return ua.NodeId(number, self.ns)

    def name(self, text: str) -> ua.QualifiedName:
        """A name of the model."""
        return ua.QualifiedName(text, self.ns)

    def object_type(self, name: str) -> ua.NodeId:
        """An object type by its name."""
        return self.own(model.OBJECT_TYPES[name][0])

    def data_type(self, name: str) -> ua.NodeId:
        """A data type by its name."""
        name = name.removesuffix("[]")
        if name in model.ENUMERATIONS:
            return self.own(model.ENUMERATIONS[name][0])
        if name == model.POSITION:
            return self.own(model.POSITION_TYPE)
        return BUILT_IN[name]

    def kind(self, name: str) -> ua.NodeId:
        """The type definition of a kind of variable."""
        if name == "position":
            return self.own(model.POSITION_VARIABLE)
        return std(model.KINDS[name])

    def fresh(self) -> ua.NodeId:
        """An id that nobody has."""
        self._next += 1
        return self.own(self._next)

    # -- adding them
    def add_all(self) -> None:
        """Data types, then variable types, then object types."""
        for name, (number, texts) in model.ENUMERATIONS.items():
            self._enumeration(name, number, texts)
        self._position()
        for name, (number, above) in model.OBJECT_TYPES.items():
            self._object_type(name, number, above)
        for name in model.OBJECT_TYPES:
            self._members(name)

    def _enumeration(
        self, name: str, number: int, texts: tuple[str, ...]
    ) -> None:
        attributes = ua.DataTypeAttributes()
        node = self._space.add(
            self.own(number),
            self.name(name),
            std(ENUMERATION),
            attributes,
            ua.NodeId(),
            HAS_SUBTYPE,
        )
        values = [
            ua.EnumValueType(
                Value=k,
                DisplayName=ua.LocalizedText(text),
                Description=ua.LocalizedText(""),
            )
            for k, text in enumerate(texts)
        ]
        fields = [
            ua.EnumField(
                Value=k,
                DisplayName=ua.LocalizedText(text),
                Description=ua.LocalizedText(""),
                Name=text,
            )
            for k, text in enumerate(texts)
        ]
        self._space.define(node, ua.EnumDefinition(Fields=fields))
        self._space.constant(
            self.fresh(),
            ua.QualifiedName("EnumValues", 0),
            node,
            ua.Variant(values, ua.VariantType.ExtensionObject),
            std(ua.ObjectIds.EnumValueType),
        )

    def _position(self) -> None:
        node = self._space.add(
            self.own(model.POSITION_TYPE),
            self.name(model.POSITION),
            std(STRUCTURE),
            ua.DataTypeAttributes(),
            ua.NodeId(),
            HAS_SUBTYPE,
        )
        encoding = self._space.add(
            self.own(model.POSITION_ENCODING),
            ua.QualifiedName("Default Binary", 0),
            node,
            ua.ObjectAttributes(),
            BINARY,
            HAS_ENCODING,
        )
        fields = [
            ua.StructureField(
                Name=name, DataType=BUILT_IN["Double"], ValueRank=-1
            )
            for name in model.POSITION_MEMBERS
        ]
        shape = ua.StructureDefinition(
            DefaultEncodingId=encoding,
            BaseDataType=std(STRUCTURE),
            StructureType=ua.StructureType.Structure,
            Fields=fields,
        )
        self._space.define(node, shape)
        register: Any = ua.register_extension_object
        register(model.POSITION, encoding, CncPositionDataType, node)
        attributes = ua.VariableTypeAttributes()
        attributes.DataType = node
        attributes.ValueRank = -1
        self._space.add(
            self.own(model.POSITION_VARIABLE),
            self.name("CncPositionVariableType"),
            std(BASE_VARIABLE),
            attributes,
            ua.NodeId(),
            HAS_SUBTYPE,
        )

    def _object_type(self, name: str, number: int, above: int) -> None:
        own = above in model.OWN_IDS
        self._space.add(
            self.own(number),
            self.name(name),
            self.own(above) if own else std(above),
            ua.ObjectTypeAttributes(),
            ua.NodeId(),
            HAS_SUBTYPE,
        )

    def _members(self, type_name: str) -> None:
        for name, data_type, kind, optional in model.members_of(type_name):
            attributes = ua.VariableAttributes()
            attributes.DataType = self.data_type(data_type)
            attributes.ValueRank = 1 if data_type.endswith("[]") else -1
            reference = HAS_PROPERTY if kind == "property" else 47
            node = self._space.add(
                self.fresh(),
                self.name(name),
                self.object_type(type_name),
                attributes,
                self.kind(kind),
                reference,
            )
            self._rule(node, OPTIONAL if optional else MANDATORY)

    def _rule(self, node: ua.NodeId, rule: int) -> None:
        item = ua.AddReferencesItem()
        item.SourceNodeId = node
        item.ReferenceTypeId = std(HAS_RULE)
        item.IsForward = True
        item.TargetNodeId = std(rule)
        item.TargetNodeClass = ua.NodeClass.Object
        self._space.refer(item)
