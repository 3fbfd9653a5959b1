"""A cell as an observer sees it: there, gone, or back again."""

from __future__ import annotations

import time
from typing import Any

from hli._sync import lib

from hli import layout, segment
from hli.areas import Areas
from hli.cells import CLOCKS
from hli.errors import HliError

from .events import Events
from .sight import Sight

RETRY_S = 0.2  # between two looks for a cell that is not there
LIFE_S = 0.1  # between two looks whether its processes live
PHASES = {
    layout.HLI_PHASE_STARTING: "starting",
    layout.HLI_PHASE_READY: "ready",
    layout.HLI_PHASE_RUNNING: "running",
    layout.HLI_PHASE_ENDED: "program ended",
    layout.HLI_PHASE_SHUTDOWN: "shut down",
}


class Observer:
    """One cell by its name.

    ``look`` attaches, tells of deaths and returns, and is cheap otherwise.
    ``sights`` read the memory while the cell is there, one a channel, else
    there are none; ``sight`` is the first one.
    ``life`` counts the CNCs that were seen under the name.
    """

    def __init__(self, name: str, events: Events) -> None:
        self.name = segment.check_name(name)
        self.events = events
        self.sights: list[Sight] = []
        self.areas: Areas | None = None
        self.life = 0
        self.gone_since = time.monotonic()
        self.problem = f"no cell {name!r} runs"
        self._segment: segment.Segment | None = None
        self._next = 0.0
        self._plc: tuple[int, int] | None = None

    def look(self) -> Sight | None:
        """The cell now; None while it is not there."""
        now = time.monotonic()
        if now >= self._next:
            if self._segment is None:
                self._attach()
            else:
                self._look_after(self._segment)
            wait = LIFE_S if self._segment else RETRY_S
            self._next = now + wait
        return self.sight

    def close(self) -> None:
        """Give the mapping up."""
        found, self._segment = self._segment, None
        self.sights, self.areas = [], None
        if found is not None:
            found.close()

    # -- life of the CNC
    def _attach(self) -> None:
        try:
            found = segment.observe(self.name)
        except (HliError, OSError) as error:
            if not self.life:  # else it is told how it went
                self.problem = str(error)
            return
        if not found.owner_alive():
            if not self.life:
                self.problem = f"the CNC of cell {self.name!r} has died"
            found.close()
            return
        self._segment = found
        self.areas = Areas(found)
        count = self.areas.gNrCh
        self.sights = [Sight(self.areas, channel) for channel in range(count)]
        self.life += 1
        self._plc = None
        again = " again" if self.life > 1 else ""
        self._tell("cell", f"the CNC is there{again}: process {self.pid}")
        self._look_after(found)

    def _look_after(self, found: segment.Segment) -> None:
        phase = self.phase
        if found.lost:
            self._leave("the memory of the cell was cut")
        elif not found.owner_alive():
            ended = phase == layout.HLI_PHASE_SHUTDOWN
            self._leave("the CNC has ended" if ended else "the CNC has died")
        elif phase == layout.HLI_PHASE_SHUTDOWN:
            self._leave("the CNC has ended")
        else:
            self._look_after_plc()

    def _leave(self, why: str) -> None:
        self.problem = why
        self._tell("cell", why)
        self.gone_since = time.monotonic()
        self.close()

    # -- life of the PLC
    def _look_after_plc(self) -> None:
        assert self.areas is not None
        side = self.areas.sidecar.plc
        now = None
        if side.attached:
            now = int(side.pid), int(side.start)
            if not lib.hs_process_alive(*now):
                now = None
        if now == self._plc:
            return
        if self._plc is not None:
            self._tell("plc", f"the PLC is gone: process {self._plc[0]}")
        if now is not None:
            self._tell("plc", f"the PLC is there: process {now[0]}")
        self._plc = now

    # -- facts
    @property
    def sight(self) -> Sight | None:
        """The first channel; None while the cell is not there."""
        return self.sights[0] if self.sights else None

    @property
    def plc_there(self) -> bool:
        """A PLC is attached and lives."""
        return self._plc is not None

    @property
    def pid(self) -> int:
        """The CNC's process."""
        assert self.areas is not None
        return int(self.areas.sidecar.cnc.pid)

    @property
    def phase(self) -> int:
        """HLI_PHASE_*."""
        assert self.areas is not None
        return int(self.areas.sidecar.cnc.phase)

    def facts(self) -> dict[str, Any]:
        """What the page's head shows of the cell."""
        if self.areas is None:
            gone_s = time.monotonic() - self.gone_since
            return {
                "name": self.name,
                "there": False,
                "problem": self.problem,
                "gone_s": round(gone_s, 1),
                "life": self.life,
            }
        cnc = self.areas.sidecar.cnc
        return {
            "name": self.name,
            "there": True,
            "life": self.life,
            "pid": self.pid,
            "plc": self._plc[0] if self._plc else None,
            "clock": CLOCKS.get(cnc.clock, str(cnc.clock)),
            "cycle_s": cnc.cycle_ns * 1e-9,
            "axis_areas": self.areas.gNrAx,
            "phase": PHASES.get(self.phase, str(self.phase)),
        }

    def _tell(self, kind: str, text: str) -> None:
        cell_s = self.sight.cell_s if self.sight else None
        self.events.add(kind, text, cell_s=cell_s)
