"""Laser power from the speed that the tool will have when the laser has answered.

The contour ahead says how fast the tool can be at every place.
On an arc the speed is sqrt(a * r) at most.
In front of an arc the tool must still be able to brake.
The task walks along that envelope for as long as the laser takes.
The speed at the end of the walk is the one to cut for.
"""

import math

from plc_client import ContourAhead, Hli, task

ENERGY_J_PER_MM = 20.0
LASER_DELAY_S = 0.025  # dead time and rise time of the source
STEP_S = 0.001
FEED_MM_S = 150.0
ACCELERATION = 2000.0 * 0.98  # mm/s2 that the CNC plans with
ON_ARCS = 2000.0 * 0.98 * 0.8  # share that it keeps for the centripetal part


@task(interval=0.001)
class LaserPower:
    def setup(self, hli: Hli):
        self.state = hli.gpCh[0].bahn_state
        self.ahead = ContourAhead(hli.gpCh[0])
        self.power_w = 0.0

    def cyclic(self):
        self.ahead()
        self.power_w = ENERGY_J_PER_MM * self.speed_after(LASER_DELAY_S)

    def speed_after(self, seconds):
        v, s = self.state.active_feed_r / 1000.0, 0.0
        zones = self.zones()
        for _ in range(round(seconds / STEP_S)):
            v = min(v + ACCELERATION * STEP_S, envelope(zones, s))
            s += v * STEP_S
        return v

    def zones(self):
        """(begin, end, speed) of the next elements, mm from the tool.

        Behind the last one the tool stands.
        """
        found, end = [], 0.0
        for e in self.ahead.window(150_000.0):
            begin = (e["start_position"] - self.ahead.distance) / 1e4
            end = begin + e["length"] / 1e4
            radius = e["compensated_radius"] / 1e4
            speed = FEED_MM_S
            if radius > 0.0:
                speed = min(FEED_MM_S, math.sqrt(ON_ARCS * radius))
            found.append((begin, end, speed))
        return [*found, (end, math.inf, 0.0)] if end < 15.0 else found


def envelope(zones, s):
    """The largest speed from which every slower zone ahead can still be met."""
    speeds = [
        math.sqrt(v * v + 2.0 * ACCELERATION * max(begin - s, 0.0))
        for begin, end, v in zones
        if end > s
    ]
    return min(speeds, default=FEED_MM_S)
