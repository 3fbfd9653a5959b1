"""#MC_MovePath, #WAIT MC_Status, #MCV_GrpResetForced: programs in other channels.

Syntax and meaning follow the Job Manager of TF5200, pages "Commanding agents",
"#WAIT MC_Status command" and "#MCV_GroupResetForced command".
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.jobs import ENDS, ChannelJobs, JobState, Order
from cnc_core.frontend.port import Condition, Wait

from .base import CommandBase, Items, Run

NUMBER_MAX = 2**31 - 1
VALUES_MAX = 20
KEYS = re.compile(r"JOBID|FILENAME|CH|ID", re.IGNORECASE)
OPTIONS = re.compile(
    r"(InitializeOnActualPosition|SetDefaultConfig|ReportSceneSampl\w*"
    r"|ReportRunTimeMeasure|ReportAxesPositionSampl\w*)\s*=\s*(\w+)",
    re.IGNORECASE,
)
VALUE = re.compile(r"@\s*PL?(\d+)", re.IGNORECASE)
WORDS = ("ON", "OFF", "USE_ACTUAL")
WHO = "the program of the other channel, by its end"

Whole = Callable[[], int]


@dataclass
class _Keys:
    """What stands in the bracket; ``states`` of #WAIT MC_Status."""

    numbers: dict[str, Whole] = field(default_factory=dict)
    file: Formula | None = None
    values: dict[int, Formula] = field(default_factory=dict)
    states: list[JobState] = field(default_factory=list)


class JobCommands(CommandBase):
    """The Job Manager's commands."""

    def _move_path(self) -> Run:
        """``[SYN] [CH=.. JobID=.. FileName=".." @PL1=..]``."""
        return self._ordered("MC_MovePath")

    def _reset_forced(self) -> Run:
        """``[SYN] [CH=.. JobID=..]``: a reset of the other channel."""
        return self._ordered("MCV_GrpResetForced")

    def _ordered(self, name: str) -> Run:
        self._drain = self._stream.accept_name("SYN") is not None
        keys, jobs, start = self._job_keys(name), self._jobs(name), self._start
        channel = self._needed(keys, "CH", name)
        number = self._needed(keys, "JOBID", name)
        if (keys.file is None) == (name == "MC_MovePath"):
            raise fail(900010, f"#{name}: FileName", start)

        def run() -> Items:
            file = keys.file() if keys.file else ""
            if not isinstance(file, str):
                raise fail(900012, "FileName: a text is expected", start)
            values = {
                place: self._given_value(value)
                for place, value in keys.values.items()
            }
            place = self._state.place(start)
            jobs.order(Order(number(), channel(), file, values, place))
            return []

        return run

    def _wait_status(self) -> Run:
        """``#WAIT MC_Status [JobID=.. MC_DONE ..]``; without states any end."""
        keys, jobs = self._job_keys("WAIT MC_Status"), self._jobs("WAIT")
        number, start = (
            self._needed(keys, "JOBID", "WAIT MC_Status"),
            self._start,
        )
        states = frozenset(keys.states) or ENDS

        def wait() -> Items:
            job, place = number(), self._state.place(start)
            if jobs.reached(job, states, place):
                return []
            self._state.port.condition = Condition(
                lambda: jobs.reached(job, states, place),
                f"job {job} has ended",
                WHO,
            )
            return [Wait.CONDITION]

        return wait

    def _jobs(self, name: str) -> ChannelJobs:
        jobs = self._state.port.jobs
        if jobs is None:
            text = f"#{name}: the cell has one channel"
            raise fail(900003, text, self._start)
        return jobs

    def _needed(self, keys: _Keys, key: str, name: str) -> Whole:
        if key not in keys.numbers:
            raise fail(900010, f"#{name} without {key}", self._start)
        return keys.numbers[key]

    def _given_value(self, value: Formula) -> float:
        found = value()
        if isinstance(found, str):
            raise fail(900012, "@PL: a number is expected", self._start)
        return float(found)

    # ---------------------------------------------------------------- the bracket
    def _job_keys(self, name: str) -> _Keys:
        stream, keys = self._stream, _Keys()
        opened = self._formulas.open()
        while not stream.is_op("]"):
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            if not stream.accept(","):
                self._job_key(name, keys)
        self._formulas.close(opened)
        return keys

    def _job_key(self, name: str, keys: _Keys) -> None:
        stream, offset = self._stream, self._stream.current.offset
        value = VALUE.match(stream.text, offset)
        option = OPTIONS.match(stream.text, offset)
        if value:
            self._value_key(keys, value)
        elif option:
            if option[2].upper() not in WORDS:
                raise fail(900010, f"{option[1]}: ON or OFF", offset)
            stream.skip_to(option.end())
            self._state.channel.stored_without_effect(option[1], offset)
        elif name == "WAIT MC_Status" and stream.is_name(*JobState.__members__):
            keys.states.append(JobState[stream.next().text.upper()])
        else:
            self._number_key_of_job(name, keys)

    def _value_key(self, keys: _Keys, found: re.Match[str]) -> None:
        stream, offset = self._stream, found.start()
        number = int(found[1])
        if not 1 <= number <= VALUES_MAX:
            raise fail(900012, f"@PL{number}: 1 to {VALUES_MAX}", offset)
        stream.skip_to(found.end())
        stream.expect("=", 900010)
        keys.values[number] = self._formulas.expression()

    def _number_key_of_job(self, name: str, keys: _Keys) -> None:
        stream, offset = self._stream, self._stream.current.offset
        found = KEYS.match(stream.text, offset)
        if found is None:
            raise fail(
                900010, f"#{name}: unexpected {stream.describe()}", offset
            )
        stream.skip_to(found.end())
        stream.expect("=", 900010)
        key = "JOBID" if found[0].upper() == "ID" else found[0].upper()
        if key == "FILENAME":
            keys.file = self._formulas.expression()
            return
        least = 1 if key == "CH" else 0
        keys.numbers[key] = self._whole(
            self._formulas.expression(), key, least, NUMBER_MAX
        )
