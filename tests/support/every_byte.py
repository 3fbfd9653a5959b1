"""The bytes of the HLI that a PLC may write at random."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from hli import layout

AXES = 3


def leaves(
    structure: Any, offset: int = 0, name: str = ""
) -> Iterator[tuple[str, int, int]]:
    """(name, offset, size) of every simple member."""
    for field, declared in structure._fields_:
        at, kind, count = offset + getattr(structure, field).offset, declared, 1
        while issubclass(kind, ctypes.Array):
            kind, count = kind._type_, count * kind._length_
        for k in range(count):
            if issubclass(kind, ctypes.Structure):
                yield from leaves(
                    kind, at + k * ctypes.sizeof(kind), f"{name}.{field}"
                )
            else:
                yield (
                    f"{name}.{field}",
                    at + k * ctypes.sizeof(kind),
                    ctypes.sizeof(kind),
                )


def bytes_of(keep_out: tuple[str, ...]) -> npt.NDArray[np.int64]:
    """Offsets of the bytes of channel 0 and the first axes, without the members
    whose name ends so.
    """
    areas = [(layout.HLI_CHANNEL, layout.HLI_SEGMENT.channel.offset)]
    size = ctypes.sizeof(layout.HLI_AXIS)
    areas += [
        (layout.HLI_AXIS, layout.HLI_SEGMENT.axis.offset + i * size)
        for i in range(AXES)
    ]
    offsets = []
    for structure, base in areas:
        for name, at, n in leaves(structure, base):
            if not name.endswith(keep_out):
                offsets += range(at, at + n)
    return np.array(offsets)
