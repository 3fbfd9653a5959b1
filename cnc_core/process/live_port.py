"""The running channel as the front end sees it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..engine import external
from ..files import RunFolder
from ..frontend.machine import External
from ..frontend.operator import Answer, Operator, Question
from ..frontend.port import (
    MESSAGES_KEPT,
    Condition,
    ExternalValue,
    RtOp,
    keep,
)
from .axes import AxesOf
from .jobs import JobsOf
from .options import OUT_FOLDER
from .signals import SignalsOf


class LivePort:
    """The running channel as the front end sees it; positions and time are
    those at the last drain.

    ``areas``: writable buffers of the external variables, "channel" and
    "global", as they were latched. ``put_out``: where a write (area, byte,
    data) goes besides. ``folder``: where files go that the program writes; it
    is made with the first. ``operator``: who answers dialogs.  ``retained``:
    what dialects keep from program to program.
    """

    answers = True
    manual_data = False
    channel = 1
    channel_name = ""
    condition: Condition | None = None
    signals: SignalsOf | None = None
    axes: AxesOf | None = None
    jobs: JobsOf | None = None

    def __init__(
        self,
        start: npt.NDArray[np.float64],
        areas: dict[str, Any] | None = None,
        folder: Path = OUT_FOLDER,
        skip_levels: int = 0,
        put_out: Callable[[int, int, bytes], None] | None = None,
        retained: dict[str, Any] | None = None,
        operator: Operator | None = None,
    ) -> None:
        self.operator = operator or Operator()
        self.operator.interrupted = lambda: self.interrupted
        self._put_out = put_out
        self.retained = {} if retained is None else retained
        self.interrupted = False
        self.asks = False  # a dialog is open
        # whether somebody has ended the program that asks
        self.ended: Callable[[], bool] = lambda: False
        self.latched_s = 0.0
        self.live: Callable[[], tuple[npt.NDArray[np.float64], float]] = (
            self._latched
        )
        self.levels = skip_levels
        self._areas = areas or {
            "channel": bytearray(external.AREA_BYTES),
            "global": bytearray(external.AREA_BYTES),
        }
        self._folder = RunFolder(folder)
        self.latched = start.copy()
        self.latched_loop = False, 0
        self.put_cycle: Callable[[int, int, bool, Sequence[RtOp]], None] = (
            lambda _slot, _state, _program, _ops: None
        )
        self.messages: list[str] = []
        self.told: Callable[[str, str], None] = lambda _kind, _text: None

    def moved(self, position: npt.NDArray[np.float64]) -> None:
        """The machine knows its position itself."""

    def position(self) -> npt.NDArray[np.float64]:
        return self.latched.copy()

    def live_position(self) -> npt.NDArray[np.float64]:
        return self.live()[0]

    def live_now_s(self) -> float:
        return self.live()[1]

    def _latched(self) -> tuple[npt.NDArray[np.float64], float]:
        return self.latched.copy(), self.latched_s

    def message(self, text: str) -> None:
        keep(self.messages, text, MESSAGES_KEPT)
        self.told("message", text)

    def ask(self, question: Question) -> Answer | None:
        self.asks, self.operator.ended = True, self.ended
        try:
            return self.operator.ask(
                replace(question, channel=self.channel_name)
            )
        finally:
            self.asks = False

    def now_s(self) -> float:
        return self.latched_s

    def skip_levels(self) -> int:
        return self.levels

    def read_external(self, variable: External, element: int) -> ExternalValue:
        return external.read(self._areas[variable.scope], variable, element)

    def write_external(
        self, variable: External, element: int, value: ExternalValue
    ) -> None:
        area = self._areas[variable.scope]
        external.write(area, variable, element, value)
        if self._put_out:
            begin = external.place(variable, element)
            data = bytes(
                area[
                    begin : begin
                    + variable.blocks_per_element * external.BLOCK_BYTES
                ]
            )
            self._put_out(0 if variable.scope == "channel" else 1, begin, data)

    def loop_state(self, written: bool) -> tuple[bool, int]:
        return self.latched_loop

    def rt_cycle(
        self, slot: int, state: int, program: bool, ops: Sequence[RtOp]
    ) -> None:
        self.put_cycle(slot, state, program, ops)

    def append_file(self, name: str, text: str) -> None:
        self._folder.append(name, text)

    def write_file(self, name: str, text: str) -> None:
        self._folder.write(name, text)

    def read_file(self, name: str) -> str | None:
        return self._folder.read(name)
