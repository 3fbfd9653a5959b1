"""Feed reduced in front of sharp tangents, gently and early.

The speed is v = sqrt(2 a d) with an `a` that the arm can bear.
"""

import math

from plc_client import ContourAhead, Hli, Override, task

FEED_MM_S = 200.0
GENTLE_MM_S2 = 1000.0
SHARP_RAD = 0.3
SLOWEST_PERCENT = 8.0
# an override that is commanded now acts on the path so much later
BEHIND_S = 0.020


@task(interval=0.001)
class Feed:
    def setup(self, hli: Hli):
        self.state = hli.gpCh[0].bahn_state
        self.ahead = ContourAhead(hli.gpCh[0])
        self.override = Override(hli.gpCh[0])
        self.percent = 100.0

    def cyclic(self):
        self.ahead()
        speed_mm_s = self.state.active_feed_r / 1000.0
        way = max(self.way_to_corner() - speed_mm_s * BEHIND_S, 0.0)
        wanted = 100.0 * math.sqrt(2.0 * GENTLE_MM_S2 * way) / FEED_MM_S
        # and gently up again
        gain = 100.0 * GENTLE_MM_S2 * 0.001 / FEED_MM_S
        faster = self.percent + gain
        self.percent = max(min(wanted, faster, 100.0), SLOWEST_PERCENT)
        self.override(path=self.percent)

    def way_to_corner(self):
        """mm from the tool to the next sharp tangent or to the end of what is known."""
        for e in self.ahead.elements[1:]:
            if e["tangent_variation"] > SHARP_RAD:
                return (e["start_position"] - self.ahead.distance) / 1e4
        return (self.ahead.known - self.ahead.distance) / 1e4
