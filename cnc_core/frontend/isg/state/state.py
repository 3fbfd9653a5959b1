"""All that the parts of the front end share: one object per program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from cnc_core.errors import ERRORS, Place
from cnc_core.frontend.base.flow import Flow
from cnc_core.frontend.base.lexer import Warn
from cnc_core.frontend.base.scanner import Modal
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.frontend.port import ChannelPort

from .axis_places import AxisPlaces
from .call import ModalCycle
from .channel import ChannelState
from .offsets import Offsets
from .patterns import Patterns
from .rt_cycles import RealTimeCycles
from .rt_loop import RealTimeLoop
from .spaces import Spaces
from .store import Store
from .timers import Timers


@dataclass
class ProgramState:
    """Data only: the executor and the front end stand above it.

    ``place``: the place in the file of an offset in the present block.
    ``has_file``: a program file of this name stands beside the program.
    ``visiting``: a block is only checked, not executed.
    ``macros``: text by name.  ``programs``: #FILE NAME by key.
    ``signals``: how many #SIGNAL of each number wait for their #WAIT.
    ``signal_read``: the last #SIGNAL READ has found its signal.
    ``lenient``: unknown # commands and undefined M functions are warnings.
    """

    machine: ProgramMachine
    modal: Modal
    port: ChannelPort
    flow: Flow
    store: Store
    offsets: Offsets
    warn: Warn
    place: Callable[[int], Place]
    has_file: Callable[[str], bool]
    lenient: bool = False
    visiting: bool = False
    macros: dict[str, str] = field(default_factory=dict)
    programs: dict[str, str] = field(default_factory=dict)
    signals: dict[int, int] = field(default_factory=dict)
    signal_read: bool = False
    patterns: Patterns = field(default_factory=Patterns)
    modal_cycle: ModalCycle = field(default_factory=ModalCycle)
    timers: Timers = field(default_factory=Timers)
    channel: ChannelState = field(init=False)
    spaces: Spaces = field(init=False)
    loop: RealTimeLoop = field(init=False)
    rt_cycles: RealTimeCycles = field(init=False)
    axis_places: AxisPlaces = field(init=False)

    def __post_init__(self) -> None:
        self.channel = ChannelState(
            self.machine, self.modal, self.offsets, self.warn
        )
        self.spaces = Spaces(self.machine, self.modal, self.offsets)
        self.loop = RealTimeLoop(self.modal, self.place, self.channel.splines)
        self.rt_cycles = RealTimeCycles(self.port, self.place)
        self.axis_places = AxisPlaces(
            self.machine, self.modal, self.offsets, self.flow
        )

    def rotation_in_cycle(self, offset: int) -> None:
        """Warn: cycles expect coordinate systems that are made with #CS."""
        levels = self.store.arguments
        in_cycle = levels[-1] is not levels[0]
        if self.spaces.rotation is not None and in_cycle:
            self.warn(910111, ERRORS[910111], offset)
