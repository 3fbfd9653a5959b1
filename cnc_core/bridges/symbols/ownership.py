"""Which bytes of the HLI a client may write: those of the PLC."""

from __future__ import annotations

import functools
from typing import Any

from hli.members import plc_bytes

from .listing import leaves
from .place import HLI_SPACE, Place


@functools.cache
def _mask() -> Any:
    return plc_bytes()


def writable(place: Place) -> bool:
    """The PLC owns something of it; symbols of the PLC are all its own."""
    if place.space != HLI_SPACE:
        return place.of_plc
    end = place.offset + place.size
    return bool(_mask()[place.offset : end].any())


def plc_leaves(place: Place) -> list[Place]:
    """The single values in a place that the PLC owns, flags last.

    A flag tells the CNC that all else is there.
    """
    found = [leaf for leaf in leaves(place) if writable(leaf)]
    return sorted(found, key=_is_flag)


def _is_flag(place: Place) -> bool:
    name = place.path.rpartition(".")[2]
    return name.endswith("semaphor_rw") or name in ("please_rw", "done_w")
