"""A PLC program: where will the tool be in 50 ms, and a valve that needs 40 ms.

The override changes all the time, so the speed does.  `PathEstimate` follows the
plan of the CNC, which knows what comes: arcs, corners, braking.  It cannot know
that the override will change meanwhile; that alone is left as its error.
`naive_um` is what the speed of now would have told.  The valve opens and closes
once at each place, 40 ms ahead.

hli-cosim run examples/arc_line_arc.nc --plc examples/where_in_t.py
  --watch WhereInT.worst_um --watch WhereInT.naive_um --watch WhereInT.edges
"""

import math
from collections import deque

from plc_client import DistanceCam, FeedControl, Hli, PathEstimate, task

MM = 10_000.0  # 0.1 um
SCAN_S = 0.001
AHEAD = 50  # scans
SLOWEST, FASTEST, PERIOD_S = 40.0, 120.0, 0.7
GLUE = [(30 * MM, 55 * MM), (70 * MM, 120 * MM)]  # on the arc, over the joints
HYSTERESIS = 0.05 * MM


@task(interval=SCAN_S)
class WhereInT:
    def setup(self, hli: Hli):
        self.ch = hli.gpCh[0]
        self.path = PathEstimate(self.ch)
        self.feed = FeedControl(self.ch)
        self.valve = DistanceCam(
            self.ch, SCAN_S, estimate=self.path, hysteresis=HYSTERESIS
        )
        self.told = deque(maxlen=AHEAD)  # places told, the oldest first
        self.time = 0.0
        self.open = False
        self.edges = 0
        self.compared = 0
        self.worst_um = self.naive_um = 0.0

    def cyclic(self):
        self.time += SCAN_S
        middle, swing = (FASTEST + SLOWEST) / 2, (FASTEST - SLOWEST) / 2
        wave = math.sin(2 * math.pi * self.time / PERIOD_S)
        self.feed(override=round(middle + swing * wave))

        place = self.path()  # first in each scan
        opened = self.valve(GLUE, on_lead_s=0.040, off_lead_s=0.040)
        self.edges += opened != self.open
        self.open = opened
        self.compare(place)

    def compare(self, place: float):
        """What was told 50 ms ago against what has come."""
        if len(self.told) == AHEAD and self.told[0]:
            by_plan, by_speed = (
                abs(told - place) / 10 for told in self.told[0]
            )
            self.worst_um = max(self.worst_um, by_plan)
            self.naive_um = max(self.naive_um, by_speed)
            self.compared += 1
        ahead_s = AHEAD * SCAN_S
        known = self.path.planned and self.path.plan.horizon >= ahead_s
        naive = place + self.path.speed * ahead_s
        self.told.append((self.path.at(ahead_s), naive) if known else None)
