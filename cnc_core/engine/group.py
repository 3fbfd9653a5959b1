"""The engines of one CNC's channels, run together."""

from __future__ import annotations

from collections.abc import Sequence

from cnc_core._engine import ffi, lib

from . import Engine, Event


class EngineGroup:
    """The engines of all channels in the order of ``gpCh``.

    In each cycle one channel follows the other in this order, so a run in
    virtual time gives the same bits every time.
    """

    def __init__(self, engines: Sequence[Engine]) -> None:
        self.engines = tuple(engines)
        self.first = self.engines[0]
        handles = ffi.new("engine *[]", [one._handle for one in self.engines])
        if lib.engine_join(handles, len(self.engines)):
            raise ValueError(f"{len(self.engines)} channels are too many")
        self._who = ffi.new("uint32_t *")

    def run(self, cycles: int, wait_ns: int = 100_000_000) -> tuple[Event, int]:
        """Up to ``cycles`` cycles of all channels on this thread; what made them
        end, and the index of the channel.
        """
        event = lib.engine_run_all(
            self.first._handle, cycles, wait_ns, self._who
        )
        return Event(event), int(self._who[0])

    def wait(self, timeout_s: float) -> tuple[Event, int]:
        """Real time: wait for an event of a channel."""
        event = lib.engine_wait_all(
            self.first._handle, int(timeout_s * 1e9), self._who
        )
        return Event(event), int(self._who[0])
