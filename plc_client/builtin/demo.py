"""The demonstration PLC: reads the contour ahead of the tool (mode 2) and the
marked log (mode 1), sets the override.

Every scan it follows the coming contour, looks at the elements within
``window`` of path ahead and lowers the path override where they hold small
radii or sharp tangents.  While single block is on, the operator continues.

Arguments: ``window`` (0.1 um, default 10 mm),
``radius`` (0.1 um: a full override from this radius on, default 20 mm),
``tangent`` (rad: from this angle on the lowest override, default 1), ``lowest``
(percent, default 30), ``records`` (at most so many rows in the report).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hli import layout
from hli.view import BLOCK_DTYPE

from ..blocks import ContourLookahead, FeedControl
from ..task import task
from . import acknowledge
from .arguments import checked

DEFAULTS: dict[str, Any] = {
    "window": 100_000.0,
    "radius": 200_000.0,
    "tangent": 1.0,
    "lowest": 30.0,
    "records": 20_000,
}
COLUMNS = (
    "cell_time_s",
    "dist_prog_start",
    "override",
    "window_start",
    "window_end",
    "elements",
    "active_feed",
    "max_dist_prog_start",
    "cause_start",
    "cause_end",
    "cause_radius",
)

NO_CAUSE = (-1.0, -1.0, 0.0)
"""Start, end and radius of what lowers the override (0: a corner), 0.1 um."""


@task(interval=0.001)
class Plc:
    """Both modes at once: two function blocks take turns on the control unit of
    channel 0.
    """

    def __init__(self, args: dict[str, Any]) -> None:
        self._args = checked(args, DEFAULTS)
        self._rows: list[tuple[float, ...]] = []
        self._every = (
            1  # every n-th scan is recorded; doubled when the record is full
        )
        self._scans = 0
        self._logged: list[np.ndarray[Any, Any]] = []
        self._followed = 0

    def setup(self, hli: Any) -> None:
        self._hli = hli
        self._ch = hli.gpCh[0]
        self._contour = ContourLookahead(self._ch.contour_lookahead)
        self._log = ContourLookahead(self._ch.contour_lookahead)
        self._feed = FeedControl(self._ch)
        self._others = acknowledge.Plc({"single_block": False})
        self._others.setup(hli)
        self._ahead: np.ndarray[Any, Any] = np.zeros(0, BLOCK_DTYPE)
        self._resets = 0
        self._feed()

    def cyclic(self) -> None:
        self._others.cyclic()
        distance = self._ch.bahn_state.dist_prog_start
        self._keep_ahead(distance)
        self._read_log()
        window = self._window(distance)
        override, cause = self._override(distance, window)
        self._feed(override=override)
        self._record(distance, override, window, cause)

    def finished(self) -> bool:
        """All that was logged has been read."""
        return sum(map(len, self._logged)) >= int(
            self._ch.contour_lookahead.state.count_logged_blocks
        )

    def result(self) -> dict[str, Any]:
        log = np.concatenate([np.zeros(0, BLOCK_DTYPE), *self._logged])
        return {
            "columns": list(COLUMNS),
            "rows": [list(row) for row in self._rows],
            "elements_followed": self._followed,
            "log_entries": len(log),
            "log_types": [int(t) for t in log["block_type"][:1000]],
            "lowest_override": min(
                (row[2] for row in self._rows), default=100.0
            ),
        }

    # -- steps
    def _keep_ahead(self, distance: float) -> None:
        """Append what became known, drop what lies behind the tool."""
        new = self._contour.follow(self._args["window"])
        if self._contour.resets != self._resets:
            self._resets = self._contour.resets
            self._ahead = self._ahead[:0]
        self._followed += len(new)
        if len(new):
            self._ahead = np.concatenate([self._ahead, new])
        behind = (
            self._ahead["start_position"] + self._ahead["length"] <= distance
        )
        if len(behind) and behind[0]:
            self._ahead = self._ahead[~behind]

    def _read_log(self) -> None:
        new = self._log.read_log()
        if len(new):
            self._logged.append(new)

    def _window(self, distance: float) -> np.ndarray[Any, Any]:
        reach = distance + float(self._args["window"])
        return self._ahead[self._ahead["start_position"] < reach]

    def _override(
        self, distance: float, window: np.ndarray[Any, Any]
    ) -> tuple[float, tuple[float, float, float]]:
        """Percent: proportional to the square root of the smallest radius, and
        to the sharpest corner ahead; start, end and radius of what decides.
        """
        if not len(window):
            return 100.0, NO_CAUSE
        arcs = window["block_type"] == layout.HLI_CLAH_CIRCULAR
        radii = np.where(arcs, window["compensated_radius"], np.inf)
        of_radii = np.sqrt(np.maximum(radii, 0.0) / self._args["radius"])
        # the tangent turns at an element's start: behind it lies no corner
        ahead = window["start_position"] > distance
        turns = np.where(ahead, window["tangent_variation"], 0.0)
        of_turns = 1.0 - np.minimum(turns / self._args["tangent"], 1.0)
        shares = np.minimum(of_radii, of_turns)
        k = int(np.argmin(shares))
        percent = max(min(float(shares[k]), 1.0) * 100.0, self._args["lowest"])
        radius = float(radii[k]) if of_radii[k] <= of_turns[k] else 0.0
        start, length = (
            float(window[name][k]) for name in ("start_position", "length")
        )
        cause = (start, start + length, radius)
        return round(percent, 1), cause if shares[k] < 1.0 else NO_CAUSE

    def _record(
        self,
        distance: float,
        override: float,
        window: np.ndarray[Any, Any],
        cause: tuple[float, float, float],
    ) -> None:
        self._scans += 1
        if self._scans % self._every:
            return
        start = float(window["start_position"][0]) if len(window) else distance
        end = (
            float(window["start_position"][-1] + window["length"][-1])
            if len(window)
            else distance
        )
        feed = self._ch.bahn_state.active_feed_r
        known = self._ch.contour_lookahead.state.max_dist_prog_start
        self._rows.append(
            (
                self._hli.cell_time_s,
                distance,
                override,
                start,
                end,
                len(window),
                feed,
                known,
                *cause,
            )
        )
        if len(self._rows) >= self._args["records"]:
            self._rows = self._rows[1::2]
            self._every *= 2
