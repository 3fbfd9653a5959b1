"""A cell of tests behind a server of OPC UA; needs asyncua."""

from __future__ import annotations

import logging
from typing import Any

from cnc_core.bridges.opcua.server import Bridge, Door
from cnc_core.bridges.symbols.cell import ServedCell
from support.bridged import Bridged


class Served:
    """A server of OPC UA beside a cell; ``url`` is its address.

    Whatever else is asked for, the cell answers.
    """

    def __init__(self, bridged: Bridged, door: Door) -> None:
        # as the command does it; pytest would keep what is logged
        logging.getLogger("asyncua").setLevel(logging.CRITICAL)
        self._bridged = bridged
        self.name_axes()
        self.bridge = Bridge(ServedCell(bridged.name), door)
        bridged.loop.run(self.bridge.start())
        self._running = bridged.loop.start(self.bridge.run())
        self.url = f"opc.tcp://127.0.0.1:{self.bridge.port}/"

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bridged, name)

    def name_axes(self) -> None:
        """What a CNC tells of its axes."""
        coord = self._bridged.channel.bahn_state.coord_r[0]
        coord.name, coord.log_axis_nr_r = "X", 1
        for k, axis in enumerate(self._bridged.cnc.areas.gpAx[:3]):
            axis.head.log_ax_n_r, axis.head.axis_type_r = k + 1, 1

    def close(self) -> None:
        """Leave its clients; the cell stays."""
        self._running.cancel()
        self._bridged.loop.run(self.bridge.stop())
