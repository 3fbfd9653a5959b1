"""Channel state: spindle, tool, feed mode, contour, limits."""

from __future__ import annotations

from dataclasses import replace

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.compensation import Compensation
from cnc_core.frontend.base.lexer import Warn, fail
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.machine import ProgramMachine, Tool
from cnc_core.units import FloatArray

from .contouring import Contouring, Smooth
from .corners import CornerWords
from .dynamics import Dynamics
from .feeds import Feeds
from .offsets import Offsets
from .splines import Splines, refused_with_compensation
from .turning import Turning


class ChannelState:
    """State of the channel beyond the modal state of the motions.

    ``soft_limits``: lowest and highest position by axis.  None: the machine's.
    ``corner_param``: #CORNER PARAM has been given.
    ``data``: number of the tool data in force (D).
    """

    def __init__(
        self,
        machine: ProgramMachine,
        modal: Modal,
        offsets: Offsets,
        warn: Warn,
    ) -> None:
        self._machine, self._modal = machine, modal
        self._offsets, self._warn = offsets, warn
        self.feeds = Feeds(machine, modal)
        self.turning = Turning(machine, modal)
        self.turning.diameter = self._diameter
        self.dynamics = Dynamics(modal, len(machine.axes), warn)
        self.contouring = Contouring(modal, offsets)
        self.smooth = Smooth(modal)
        self.splines = Splines(modal, offsets)
        self.corner_words = CornerWords(modal, offsets)
        self.compensation = Compensation(modal)
        self.soft_limits: tuple[FloatArray, FloatArray] | None = None
        self.corner_param = False
        self.tool: int = 0
        self.data: int = 0
        self.tool_data = Tool()
        self._mentioned: set[str] = set()

    @property
    def plain(self) -> bool:
        """The scanner knows what plain motion lines mean."""
        return self.feeds.plain and self.turning.plain

    @property
    def spindle_rev_min(self) -> float:
        """Speed of the spindle as the program wants it."""
        return self.turning.rev_min

    def _diameter(self) -> float:
        """mm, programmed at the first main axis."""
        axis = self._machine.main[0]
        if axis < 0:
            return 0.0
        offset = self._modal.offset_in_force[axis]
        return 2.0 * abs(float(self._modal.position[axis] - offset))

    def stored_without_effect(self, name: str, offset: int) -> None:
        """Say once that something is only kept."""
        if name in self._mentioned:
            return
        self._mentioned.add(name)
        text = f"{name} is stored, it has no effect on the motion"
        self._warn(907042, text, offset)

    def switch_spline(self, on: bool, n: int, offset: int) -> list[Row]:
        """G150, G151, #SPLINE."""
        if on and self.compensation.choice.active:
            raise refused_with_compensation(offset)
        return self.splines.switch(on, n)

    def check_contouring(self, on: bool, offset: int) -> None:
        """G61 and G261 do not go together with #HSC."""
        if on and self.smooth.hsc is not None:
            raise fail(120433, f"{ERRORS[120433]}: G61, G261", offset)

    def check_hsc(self, offset: int) -> None:
        """#HSC does not go together with G261, G95, G96."""
        active = [f"G{self.feeds.mode}"] if self.feeds.mode == 95 else []
        if self.contouring.active or active:
            name = (active or ["G261"])[0]
            raise fail(120433, f"{ERRORS[120433]}: {name} is active", offset)

    def not_compensated(self, name: str, offset: int) -> None:
        """Refuse ``name`` while tool radius compensation is active."""
        if self.compensation.choice.active:
            raise fail(906003, f"{name}: {ERRORS[906003]}", offset)

    def change_tool(self, radius: bool, value_mm: float) -> None:
        """V.G.WZ_AKT.R and .L."""
        tool = self.tool_data
        self.tool_data = (
            replace(tool, radius_mm=value_mm)
            if radius
            else replace(tool, length_mm=value_mm)
        )
        self._offsets.set_tool_length(self.tool_data.length_mm)
