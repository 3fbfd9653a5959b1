"""One PLC program for mock, lockstep, freerun and realtime."""

from typing import Any

from plc_client import ContourLookahead, Override, TechnoServer, task


@task(interval=0.001)
class SameEverywhere:
    """Slower where the coming 5 mm hold an arc; collects the contour."""

    slow = 60.0

    def setup(self, hli: Any) -> None:
        self.ch = hli.gpCh[0]
        self.contour = ContourLookahead(self.ch.contour_lookahead)
        self.override = Override(self.ch)
        self.functions = TechnoServer(hli)
        self.elements: list[int] = []
        self.arcs: list[tuple[float, float]] = []
        self.percent = 100.0
        self.commanded = False

    def cyclic(self) -> None:
        self.functions()
        for b in self.contour.follow(1_000_000.0):
            self.elements.append(int(b["block_number"]))
            if b["compensated_radius"] > 0:
                self.arcs.append(
                    (
                        float(b["start_position"]),
                        float(b["start_position"] + b["length"]),
                    )
                )
        here = self.ch.bahn_state.dist_prog_start
        near = any(begin - 50_000.0 < here < end for begin, end in self.arcs)
        self.percent = self.slow if near else 100.0
        self.override(path=self.percent)
        self.commanded |= near and self.override.effective == self.percent

    def result(self) -> dict[str, Any]:
        return {
            "elements": self.elements,
            "arcs": len(self.arcs),
            "commanded": self.commanded,
        }
