"""The program together with the rooms that its instructions act on."""

from __future__ import annotations

from typing import Protocol

from ..base.host import ProgramHost
from ..devices.canopen import Nodes
from ..devices.clock import Clock
from ..language.macros import Macros
from ..motion.state import ChannelState
from ..motion.system import System
from ..operator.forms import Forms
from .control import Control


class Program(ProgramHost, Protocol):
    """The host, with its channel, system variables, forms and devices."""

    @property
    def channel(self) -> ChannelState: ...

    @property
    def system(self) -> System: ...

    @property
    def control(self) -> Control: ...

    @property
    def macros(self) -> Macros: ...

    @property
    def forms(self) -> Forms: ...

    @property
    def nodes(self) -> Nodes: ...

    @property
    def clock(self) -> Clock: ...

    def count_values(self, count: int) -> None: ...
