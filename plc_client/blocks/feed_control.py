"""Feed override and feedhold of a channel."""

from __future__ import annotations

from hli.structures import HLI_BAHN_MC_CONTROL, HLI_CHANNEL

from .level import OVERRIDE_MAX_PERCENT, command, stretch_of
from .owner import channel_of


class FeedControl:
    """Level units ``bahn_mc_control.override``, ``override_valid`` and
    ``feedhold``: command first, then enable.

    ``FeedControl(hli.gpCh[0])(override=80.0, feedhold=False)`` once per scan;
    override in percent, 0..200 in steps of 0.1.  Outputs: ``override`` (percent
    the CNC uses), ``feedhold`` (what the CNC uses).
    """

    def __init__(self, ch: HLI_CHANNEL | HLI_BAHN_MC_CONTROL) -> None:
        ch = channel_of(self, ch, "bahn_mc_control")
        self._control = control = ch.bahn_mc_control
        self._memory = stretch_of(
            control.override, control.override_valid, control.feedhold
        )
        # override, feedhold and the memory behind the last call
        self._override: float | None = None
        self._feedhold = False
        self._settled = b""
        self.override = 100.0
        self.feedhold = False

    def __call__(self, override: float = 100.0, feedhold: bool = False) -> None:
        """One scan.  Raises ValueError for an override outside 0..200 % (or NaN)."""
        if (
            override == self._override
            and feedhold == self._feedhold
            and self._memory.tobytes() == self._settled
        ):
            return  # as the last call left it
        if not 0.0 <= override <= OVERRIDE_MAX_PERCENT:
            raise ValueError(
                f"override {override} %: 0..{OVERRIDE_MAX_PERCENT:g}"
            )
        control = self._control
        command(control.override, round(override * 10.0))
        command(control.override_valid, True)
        command(control.feedhold, feedhold)
        # before the CNC's answer is read: never newer
        self._override, self._feedhold = override, feedhold
        self._settled = self._memory.tobytes()
        self.override = control.override.state_r / 10.0
        self.feedhold = control.feedhold.state_r

    def _commanded(self) -> float:
        """Percent that the unit commands now; 100 while it is free."""
        unit = self._control.override
        return unit.command_w / 10.0 if unit.enable_w else 100.0

    def release(self) -> None:
        """Give the units back to the operator's values."""
        for unit in (
            self._control.override,
            self._control.override_valid,
            self._control.feedhold,
        ):
            unit.enable_w = False
