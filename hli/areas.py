"""The global pointers of the HLI over one segment."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING, Any

from .segment import Segment
from .structures import (
    HLI_AHEAD,
    HLI_AXIS,
    HLI_CHANNEL,
    HLI_EXT_VAR,
    HLI_PLATFORM,
    HLI_SEGMENT,
    HLI_SIDECAR,
)
from .symbol import Symbol, SymbolError, resolve
from .view import Pointers


class Areas:
    """The global pointers of the HLI over one segment; areas that are not
    configured are NULL (``Pointers``).
    """

    def __init__(self, segment: Segment) -> None:
        root: HLI_SEGMENT = HLI_SEGMENT(segment.root)
        self.segment = segment
        self.root = root
        self.gNrCh: int = root.segment_head.channel_count
        self.gNrAx: int = root.segment_head.axis_count
        self.gpPform: HLI_PLATFORM = root.platform
        self.gpCh: Pointers[HLI_CHANNEL] = Pointers(
            "gpCh", root.channel, self.gNrCh
        )
        self.gpAx: Pointers[HLI_AXIS] = Pointers("gpAx", root.axis, self.gNrAx)
        self.gpVECh: Pointers[HLI_EXT_VAR] = Pointers(
            "gpVECh", root.ext_var_channel, self.gNrCh
        )
        self.gpVEGlobal: HLI_EXT_VAR = root.ext_var_global
        self.gpAhead: Pointers[HLI_AHEAD] = Pointers("gpAhead", root.ahead, 1)
        self.sidecar: HLI_SIDECAR = root.sidecar

    if not TYPE_CHECKING:  # a type checker shall find unknown names

        def __getattr__(self, name: str) -> Any:
            raise AttributeError(_unknown(name))

    def symbol(self, path: str) -> Symbol:
        """The variable behind a TwinCAT-style path:
        ``symbol("HLI_Global_Variables.gpCh[0]^....").value``.

        Raises SymbolError (a ValueError) that says where the path stops.
        """
        if not isinstance(path, str):
            raise SymbolError(f"symbol {path!r}: a text is needed")
        return resolve(self, path)


GLOBALS = ("gpPform", "gpCh", "gpAx", "gpVECh", "gpVEGlobal", "gpAhead")
NUMBERS = ("gNrCh", "gNrAx")
PARTS = (("gpCh[0]", HLI_CHANNEL), ("gpAx[0]", HLI_AXIS))


def _unknown(name: str) -> str:
    """The text for a name that the HLI does not have, with the nearest."""
    text = f"hli has no member {name!r}"
    for area, view in PARTS:
        if name in view._names:
            return f"{text}; did you mean hli.{area}.{name}?"
    known = {one.lower(): one for one in (*GLOBALS, *NUMBERS)}
    near = difflib.get_close_matches(name.lower(), known, n=1)
    if near:
        return f"{text}; did you mean hli.{known[near[0]]}?"
    return f"{text}; it has {', '.join((*GLOBALS, *NUMBERS))}"
