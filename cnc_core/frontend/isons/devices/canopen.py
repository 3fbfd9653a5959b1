"""SDO transfers to simulated CANopen nodes, whose objects stand in the cell file."""

from __future__ import annotations

from cnc_core.frontend.base.lexer import fail

Objects = dict[tuple[int, int], int]  # values by index and subindex
BYTES = (1, 2, 4)


class Nodes:
    """Objects of all nodes by (index, subindex); values are signed integers."""

    def __init__(self, nodes: dict[int, Objects]) -> None:
        self._nodes = {
            number: dict(objects) for number, objects in nodes.items()
        }

    def _object(
        self, address: tuple[float, ...], offset: int
    ) -> tuple[Objects, tuple[int, int]]:
        """The node's objects and the key of this one."""
        if any(value != int(value) for value in address):
            raise fail(
                909105,
                "SDO: node, index, subindex and length are whole numbers",
                offset,
            )
        node, index, sub, length = (int(value) for value in address)
        if length not in BYTES:
            raise fail(900012, f"SDO: length {length} is not 1, 2 or 4", offset)
        if node not in self._nodes:
            raise fail(
                909142, f"SDO: the cell has no CANopen node {node}", offset
            )
        objects = self._nodes[node]
        if (index, sub) not in objects:
            raise fail(
                909142,
                f"SDO: node {node} has no object {index:#06x} sub {sub}",
                offset,
            )
        return objects, (index, sub)

    def read(self, address: tuple[float, ...], offset: int) -> float:
        """SDO_UL: the object's low bytes, signed."""
        objects, key = self._object(address, offset)
        bits = 8 * int(address[3])
        value = objects[key] & ((1 << bits) - 1)
        return float(value - (1 << bits) if value >> (bits - 1) else value)

    def write(
        self, address: tuple[float, ...], value: float, offset: int
    ) -> None:
        """SDO_DL; the value has to fit its length."""
        objects, key = self._object(address, offset)
        bits = 8 * int(address[3])
        lowest, beyond = -(1 << (bits - 1)), 1 << bits
        if value != int(value) or not lowest <= value < beyond:
            raise fail(
                900012,
                f"SDO_DL: {value:g} is no integer of {bits // 8} bytes",
                offset,
            )
        objects[key] = int(value)
