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
    """No arguments; reports how many functions were acknowledged and stops
    continued.
    """

    def __init__(self, args: dict[str, Any]) -> None:
        checked(args, {})
        self._acknowledged = 0
        self._continued = 0

    def setup(self, hli: Any) -> None:
        self._functions = AcknowledgeAll(hli)
        self._flows = [AutoContinue(ch) for ch in hli.gpCh if ch is not None]

    def cyclic(self) -> None:
        self._acknowledged += len(self._functions())
        for flow in self._flows:
            before = flow.count
            flow()
            self._continued += flow.count - before

    def result(self) -> dict[str, int]:
        return {
            "acknowledged": self._acknowledged,
            "continued": self._continued,
        }
