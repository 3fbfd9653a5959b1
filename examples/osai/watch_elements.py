"""A PLC program that follows a profile.

The program counts polynomial elements ahead and notes how far the contour is known.
Run it in its folder::

    cd examples/osai
    hli-cosim run part.osai --config cell.toml --plc watch_elements.py
"""

from plc_client import ContourLookahead, Hli, task

POLYNOMIAL = 6


@task(interval=0.002)
class Watch:
    def setup(self, hli: Hli):
        self.ch = hli.gpCh[0]
        self.clah = ContourLookahead(self.ch)
        self.ahead = 0  # polynomial elements in the next 20 mm
        self.known_mm = 0.0  # of contour ahead
        self.sharpest = 0.0  # rad, tangent variation there

    def cyclic(self):
        self.clah(
            start_position=self.ch.bahn_state.dist_prog_start, length=200_000.0
        )  # 0.1 um
        if self.clah.done:
            elements = self.clah.blocks
            curves = elements[elements["block_type"] == POLYNOMIAL]
            self.ahead = len(curves)
            self.known_mm = float(elements["length"].sum()) / 1e4
            self.sharpest = (
                float(curves["tangent_variation"].max()) if len(curves) else 0.0
            )
