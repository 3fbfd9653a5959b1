"""The address space: nodes are added in heaps, variables have an entry each."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from asyncua import ua
from asyncua.server.address_space import AddressSpace, AttributeValue
from asyncua.server.internal_server import InternalServer

from ..symbols.cell import ServedCell
from .entries import Entry, bad

Told = Any
"""The method by which the items of a session hear of a variable."""
READ = 1
READ_WRITE = 3
HAS_COMPONENT, ORGANIZES, HAS_PROPERTY, HAS_SUBTYPE = 47, 35, 46, 45
VARIABLE, OBJECT, FOLDER = 63, 58, 61
PROPERTY = 68


def std(number: int) -> ua.NodeId:
    """A node of OPC UA itself."""
    return ua.NodeId(number)


class Space:
    """Adds nodes; knows the entry of each variable."""

    def __init__(self, server: InternalServer, cell: ServedCell) -> None:
        self._manager = server.node_mgt_service
        self.aspace: AddressSpace = server.aspace
        self.cell = cell
        self.entries: dict[ua.NodeId, Entry] = {}
        self.values: dict[ua.NodeId, AttributeValue] = {}
        self.paces: dict[ua.NodeId, float] = {}
        """Monitored variable -> s between two looks, the shortest asked for."""
        self.made_again: set[ua.NodeId] = set()
        """Monitored variables that have come back and are to be told."""
        self._waiting: dict[ua.NodeId, dict[int, Told]] = {}
        self._gone: list[ua.NodeId] = []

    # -- nodes
    def add(
        self,
        node: ua.NodeId,
        name: ua.QualifiedName,
        parent: ua.NodeId,
        attributes: Any,
        definition: int | ua.NodeId,
        reference: int = HAS_COMPONENT,
    ) -> ua.NodeId:
        """One node below another."""
        item = ua.AddNodesItem()
        item.RequestedNewNodeId = node
        item.BrowseName = name
        item.ParentNodeId = parent
        item.ReferenceTypeId = std(reference)
        item.NodeClass = _CLASSES[type(attributes)]
        if isinstance(definition, int):
            definition = std(definition)
        item.TypeDefinition = definition
        attributes.DisplayName = ua.LocalizedText(name.Name)
        item.NodeAttributes = attributes
        (result,) = self._manager.add_nodes([item])
        result.StatusCode.check()
        return node

    def define(self, node: ua.NodeId, definition: Any) -> None:
        """How clients read values of a data type."""
        value = ua.Variant(definition, ua.VariantType.ExtensionObject)
        held = AttributeValue(ua.DataValue(value))
        attributes = self.aspace[node].attributes
        attributes[ua.AttributeIds.DataTypeDefinition] = held

    def refer(self, item: ua.AddReferencesItem) -> None:
        """One more reference between nodes."""
        for code in self._manager.add_references([item]):
            code.check()

    def folder(
        self, node: ua.NodeId, name: ua.QualifiedName, parent: ua.NodeId
    ) -> ua.NodeId:
        """A folder."""
        return self.add(
            node, name, parent, ua.ObjectAttributes(), FOLDER, ORGANIZES
        )

    def object(
        self,
        node: ua.NodeId,
        name: ua.QualifiedName,
        parent: ua.NodeId,
        definition: int | ua.NodeId = OBJECT,
    ) -> ua.NodeId:
        """An object."""
        attributes = ua.ObjectAttributes()
        return self.add(node, name, parent, attributes, definition)

    def constant(
        self,
        node: ua.NodeId,
        name: ua.QualifiedName,
        parent: ua.NodeId,
        variant: ua.Variant,
        data_type: ua.NodeId,
    ) -> ua.NodeId:
        """A property that does not change."""
        attributes = _variable(data_type, isinstance(variant.Value, list))
        attributes.Value = variant
        attributes.AccessLevel = attributes.UserAccessLevel = READ
        return self.add(node, name, parent, attributes, PROPERTY, HAS_PROPERTY)

    def variable(
        self,
        node: ua.NodeId,
        name: ua.QualifiedName,
        parent: ua.NodeId,
        entry: Entry,
        data_type: ua.NodeId,
        *,
        array: bool = False,
        writable: bool = False,
        definition: int | ua.NodeId = VARIABLE,
        reference: int = HAS_COMPONENT,
    ) -> ua.NodeId:
        """A variable that asks its entry for each value."""
        attributes = _variable(data_type, array)
        access = READ_WRITE if writable else READ
        attributes.AccessLevel = attributes.UserAccessLevel = access
        self.add(node, name, parent, attributes, definition, reference)
        self.entries[node] = entry
        held = self.aspace[node].attributes[ua.AttributeIds.Value]
        held.value = None
        held.value_callback = lambda n, a: self.read(n)
        # what is written here goes to subscriptions and is not kept
        held.value_setter = lambda n, a, v: None
        self.values[node] = held
        self._monitor_again(node, held)
        return node

    def _monitor_again(self, node: ua.NodeId, held: AttributeValue) -> None:
        """Those who monitored a variable of this name before do so again."""
        for handle, told in self._waiting.pop(node, {}).items():
            if _listens(told, handle):
                held.datachange_callbacks[handle] = told
                where = node, ua.AttributeIds.Value
                self.aspace._handle_to_attribute_map[handle] = where
                self.made_again.add(node)

    def delete(self, nodes: Iterable[ua.NodeId]) -> None:
        """Take nodes away. Subscriptions wait for nodes of the same names."""
        items = []
        for node in nodes:
            self.entries.pop(node, None)
            held = self.values.pop(node, None)
            if held is not None and held.datachange_callbacks:
                self._waiting[node] = dict(held.datachange_callbacks)
                self._gone.append(node)
                held.datachange_callbacks.clear()
                for handle in self._waiting[node]:
                    self.aspace._handle_to_attribute_map.pop(handle, None)
            items.append(ua.DeleteNodesItem(node, True))
        self._manager.delete_nodes(ua.DeleteNodesParameters(items))

    async def tell_gone(self) -> None:
        """Tell who monitors variables that are gone and have not come back."""
        gone, self._gone = self._gone, []
        for node in gone:
            for handle, told in self._waiting.get(node, {}).items():
                if _listens(told, handle):
                    await told(handle, bad(ua.StatusCodes.BadNodeIdUnknown))

    # -- values
    def read(self, node: ua.NodeId) -> ua.DataValue:
        """The value of a variable now."""
        entry: Any = self.entries.get(node)
        if entry is None:
            return bad(ua.StatusCodes.BadNodeIdUnknown)
        found: ua.DataValue = entry.value(entry.sample(self.cell))
        return found


def _listens(told: Told, handle: int) -> bool:
    """The item has not been deleted in the meantime."""
    return handle in told.__self__._monitored_datachange


def _variable(data_type: ua.NodeId, array: bool) -> ua.VariableAttributes:
    attributes = ua.VariableAttributes()
    attributes.DataType = data_type
    attributes.ValueRank = 1 if array else -1
    attributes.MinimumSamplingInterval = 0.0
    return attributes


_CLASSES = {
    ua.ObjectAttributes: ua.NodeClass.Object,
    ua.VariableAttributes: ua.NodeClass.Variable,
    ua.ObjectTypeAttributes: ua.NodeClass.ObjectType,
    ua.VariableTypeAttributes: ua.NodeClass.VariableType,
    ua.DataTypeAttributes: ua.NodeClass.DataType,
}
