"""A PLC program: slower where the coming 5 mm of contour hold an arc.

hli-cosim run examples/part.nc --config examples/cell.toml --plc examples/override_from_contour.py
"""

from plc_client import ContourLookahead, FeedControl, Hli, task


@task(interval=0.001)
class OverrideFromContour:
    def setup(self, hli: Hli):
        self.ch = hli.gpCh[0]
        self.clah = ContourLookahead(self.ch)
        self.feed = FeedControl(self.ch)

    def cyclic(self):
        self.clah(
            start_position=self.ch.bahn_state.dist_prog_start, length=50_000.0
        )  # mode 2, 0.1 um
        if self.clah.done:
            arcs = self.clah.blocks["compensated_radius"] > 0
            self.feed(override=60.0 if arcs.any() else 100.0)
