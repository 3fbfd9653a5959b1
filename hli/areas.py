"""The global pointers of the HLI over one segment."""

from __future__ import annotations

from typing import Any

from . import layout
from .segment import Segment
from .symbol import Symbol, resolve
from .view import Pointers, view_class


class Areas:
    """The global pointers of the HLI over one segment; areas that are not
    configured are NULL (``Pointers``).
    """

    def __init__(self, segment: Segment) -> None:
        root: Any = view_class(layout.HLI_SEGMENT)(segment.root)
        self.segment = segment
        self.root = root
        self.gNrCh: int = root.segment_head.channel_count
        self.gNrAx: int = root.segment_head.axis_count
        self.gpPform: Any = root.platform
        self.gpCh = Pointers("gpCh", root.channel, self.gNrCh)
        self.gpAx = Pointers("gpAx", root.axis, self.gNrAx)
        self.gpVECh = Pointers("gpVECh", root.ext_var_channel, self.gNrCh)
        self.gpVEGlobal: Any = root.ext_var_global
        self.gpAhead = Pointers(
            "gpAhead", root.ahead, min(self.gNrCh, len(root.ahead))
        )
        self.sidecar: Any = root.sidecar

    def symbol(self, path: str) -> Symbol:
        """The variable behind a TwinCAT-style path:
        ``symbol("HLI_Global_Variables.gpCh[0]^....").value``.

        Raises SymbolError (a ValueError) that says where the path stops.
        """
        return resolve(self, path)
