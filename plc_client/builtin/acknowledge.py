"""The default PLC: fetches and acknowledges every technology function and
continues every stop.
"""

from __future__ import annotations

from typing import Any

from ..blocks import AcknowledgeAll, AutoContinue
from ..task import task
from .arguments import checked


@task(interval=0.001)
class Plc:
    """Reports how many functions were acknowledged and stops continued.

    Argument: ``single_block`` (default true; false: while single block is on, the
    operator continues).
    """

    def __init__(self, args: dict[str, Any]) -> None:
        self._steps = checked(args, {"single_block": True})["single_block"]
        self._acknowledged = 0
        self._continued = 0

    def setup(self, hli: Any) -> None:
        self._functions = AcknowledgeAll(hli)
        self._flows = [
            (ch.bahn_mc_control, AutoContinue(ch))
            for ch in hli.gpCh
            if ch is not None
        ]

    def cyclic(self) -> None:
        self._acknowledged += len(self._functions())
        for control, flow in self._flows:
            if self._operator_continues(control):
                continue
            before = flow.count
            flow()
            self._continued += flow.count - before

    def _operator_continues(self, control: Any) -> bool:
        """Single block is on; an edge that is up is taken back all the same."""
        return not (
            self._steps
            or control.continue_machining.command_w
            or not control.single_block.state_r
        )

    def result(self) -> dict[str, int]:
        return {
            "acknowledged": self._acknowledged,
            "continued": self._continued,
        }
