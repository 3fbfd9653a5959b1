"""Function blocks on the HLI, one or more for every control unit; docs/reference/plc.md
draws their states.
"""

from .ahead import ContourEnd, EmptyReason
from .base import ExecuteBlock, FunctionBlock, State
from .commands import (
    ABSOLUTE_ONCE,
    RELATIVE,
    RELATIVE_ONCE,
    ContinueMachining,
    DeleteDistanceToGo,
    InsertStop,
    SingleBlock,
)
from .contour_ahead import AheadState, ContourAhead
from .contour_lookahead import ContourLookahead, LookaheadState
from .contour_queue import ContourQueue
from .distance import DistanceCam, DistanceTrigger, PathEstimate, SwitchState
from .feed_control import FeedControl
from .interface import HliShape, InterfaceState, MCV_HliInterface
from .level import (
    AxisControl,
    ExternalSpeed,
    FeedHold,
    LevelState,
    LevelUnit,
    OptionalStop,
    Override,
    PathDirection,
    RtLoop,
    SkipLevels,
)
from .mode import (
    AbortProgram,
    Mode,
    ModeControl,
    ProcessState,
    ResetChannel,
    ResumeProgram,
    RunMdi,
    SelectProgram,
    StartProgram,
    StopProgram,
)
from .program_flow import AcknowledgeAll, AutoContinue, TechnoFunction
from .technology import TechnoBlock, TechnoServer, TechnoState
from .watchdog import (
    CncErrorRecord,
    CncWatchdog,
    ErrorReader,
    ErrorState,
    ErrorWriter,
    Watchdog,
    WatchState,
)

__all__ = [
    "ABSOLUTE_ONCE",
    "RELATIVE",
    "RELATIVE_ONCE",
    "AbortProgram",
    "AcknowledgeAll",
    "AheadState",
    "AutoContinue",
    "AxisControl",
    "CncErrorRecord",
    "CncWatchdog",
    "ContinueMachining",
    "ContourAhead",
    "ContourEnd",
    "ContourLookahead",
    "ContourQueue",
    "DeleteDistanceToGo",
    "DistanceCam",
    "DistanceTrigger",
    "EmptyReason",
    "ErrorReader",
    "ErrorState",
    "ErrorWriter",
    "ExecuteBlock",
    "ExternalSpeed",
    "FeedControl",
    "FeedHold",
    "FunctionBlock",
    "HliShape",
    "InsertStop",
    "InterfaceState",
    "LevelState",
    "LevelUnit",
    "LookaheadState",
    "MCV_HliInterface",
    "Mode",
    "ModeControl",
    "OptionalStop",
    "Override",
    "PathDirection",
    "PathEstimate",
    "ProcessState",
    "ResetChannel",
    "ResumeProgram",
    "RtLoop",
    "RunMdi",
    "SelectProgram",
    "SingleBlock",
    "SkipLevels",
    "StartProgram",
    "State",
    "StopProgram",
    "SwitchState",
    "TechnoBlock",
    "TechnoFunction",
    "TechnoServer",
    "TechnoState",
    "WatchState",
    "Watchdog",
]
