"""Everything the parts of the front end share: one object per program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from cnc_core.errors import Place
from cnc_core.frontend.base.flow import Flow
from cnc_core.frontend.base.scanner import Modal
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.frontend.port import ChannelPort

from ..cycles.modal import ModalCycle
from ..cycles.pattern import Patterns
from .offsets import Offsets
from .spaces import Spaces
from .store import Store
from .system import System

if TYPE_CHECKING:
    from ..cycles.running import CycleRunner
    from ..executor import Executor
    from .rt_loop import RealTimeLoop

Warn = Callable[[int, str, int], None]


@dataclass
class Context:
    """``warn``: a warning with its offset in the block.

    ``macros``: by name.  ``programs``: #FILE NAME by key.

    ``lenient``: unknown # commands and undefined M functions are warnings.
    """

    machine: ProgramMachine
    modal: Modal
    port: ChannelPort
    flow: Flow
    store: Store
    system: System
    offsets: Offsets
    warn: Warn
    lenient: bool = False
    visiting: bool = False  # a block is only looked at, not executed
    macros: dict[str, str] = field(default_factory=dict)
    programs: dict[str, str] = field(default_factory=dict)
    signals: dict[int, int] = field(default_factory=dict)
    patterns: Patterns = field(default_factory=Patterns)
    modal_cycle: ModalCycle = field(default_factory=ModalCycle)
    executor: Executor = field(init=False)
    cycles: CycleRunner = field(init=False)
    spaces: Spaces = field(init=False)
    loop: RealTimeLoop = field(init=False)
    place: Callable[[int], Place] = field(init=False)

    def __post_init__(self) -> None:
        self.spaces = Spaces(self.machine, self.modal, self.offsets)
