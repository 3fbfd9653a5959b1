"""The PLC beside a CNC process: attached, lost, came back."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

from hli._sync import lib as sync

from hli.errors import HliTimeout
from hli.segment import Segment


class PlcLife:
    """Looks whether the PLC lives; ``tell`` gets what has changed."""

    def __init__(self, segment: Segment, tell: Callable[[str], None]) -> None:
        self._segment, self._tell = segment, tell
        self._plc = segment.root.sidecar.plc
        self._present, self._seen, self._generation = False, False, 0

    @property
    def alive(self) -> bool:
        """A PLC is attached and its process lives."""
        plc = self._plc
        return bool(plc.attached) and bool(
            sync.hs_process_alive(plc.pid, plc.start)
        )

    def look(self) -> None:
        """Tell what has changed.

        A PLC that died is taken off the segment, so that the next one finds it
        free.
        """
        if not self._plc.attached:
            if self._present:
                self._present = False
                self._tell("PLC has left")
        elif self.alive:
            self._note_plc()
        else:
            self._take_off()

    def _note_plc(self) -> None:
        generation = int(self._plc.generation)
        if self._present and generation == self._generation:
            return
        came = "came back" if self._seen else "attached"
        self._tell(f"PLC {came} (process {self._plc.pid})")
        self._present = self._seen = True
        self._generation = generation

    def _take_off(self) -> None:
        # the next PLC may be registering: then the next look does it
        with contextlib.suppress(HliTimeout), self._segment.locked(0.0):
            if self._plc.attached and not self.alive:
                self._plc.attached = 0
                self._plc.finished = 0
                self._present, self._seen = False, True
                self._tell(f"PLC lost (process {self._plc.pid} died)")
