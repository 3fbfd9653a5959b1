"""The end of a run as the user sees it, from the reports of both sides."""

from __future__ import annotations

import re
import signal
from typing import Any

from ..errors import CncError, Place
from ..process.waiting import Waiting
from .child import Child, Job
from .result import RunResult
from .supervision import OUT_OF_TIME


def judge(result: RunResult, job: Job, cnc: dict[str, Any]) -> None:
    """The end of the run as the user should see it."""
    if job.out_of_time:
        _judge_time(result)
        return
    if job.stalled:
        result.end = "error"
        error = CncError(905024).as_json()
        for wait in result.waiting[:1]:  # where it stands
            error |= {"file": wait["file"], "line": wait["line"], "column": 1}
        result.errors.append(error)
    if job.plc is None:
        if not cnc:
            result.end = "aborted"
            result.errors.append(_died("CNC", job.cnc))
        elif result.errors and cnc.get("source"):
            result.error_text = cnc["source"]
        return
    if any(error["code"] == OUT_OF_TIME for error in result.errors):
        return  # the PLC was ended with it, however it was
    plc_failed = job.plc.process.poll() != 0 and (
        not result.plc or bool(result.plc.get("error"))
    )
    if cnc.get("source") and result.errors:
        result.error_text = cnc["source"]
    plc_error = result.plc.get("error") or (
        job.plc.said() if plc_failed else ""
    )
    if plc_failed and plc_error and "died" not in plc_error:
        result.end = "error"
        result.errors.append(_plc_error(plc_error))
    elif cnc.get("aborted_by_plc") and not plc_failed:
        result.errors = result.errors or [CncError(905023).as_json()]
    elif not cnc or plc_failed or result.end == "aborted":
        result.end = "aborted"
        who, child = ("CNC", job.cnc) if not cnc else ("PLC", job.plc)
        result.errors.append(_died(who, child))


def _judge_time(result: RunResult) -> None:
    """The launcher has ended a CNC that did not look at its time."""
    result.end = "error"
    if not any(error["code"] == OUT_OF_TIME for error in result.errors):
        waits = [Waiting(**one) for one in result.waiting]
        why = "; ".join(one.without_place() for one in waits)
        place = waits[0].place if waits else Place()
        text = (
            f"the time of --max-wall is over: {why or 'the CNC is still busy'}"
        )
        result.errors.append(CncError(OUT_OF_TIME, text, place).as_json())


def _died(who: str, child: Child) -> dict[str, Any]:
    last = child.said().splitlines()
    detail = f": {last[-1]}" if last and "Killed" not in last[-1] else ""
    text = f"the {who} process died{_how(child.process.poll())}{detail}"
    return CncError(905001, text).as_json()


def _how(status: int | None) -> str:
    """By which signal, or with which status."""
    if not status:
        return ""
    if status > 0:
        return f" with exit status {status}"
    try:
        return f" by {signal.Signals(-status).name}"
    except ValueError:
        return f" by signal {-status}"


def _plc_error(text: str) -> dict[str, Any]:
    """An error of the PLC program: ``FILE:LINE: Type: text`` with the user's
    frames below.
    """
    first, *frames = text.splitlines()
    match = re.match(r"(.+?):(\d+)(?::(\d+))?: (.*)", first)
    if match is None:
        return CncError(905003, f"PLC program: {first}").as_json()
    source = frames[-1].strip() if frames else ""
    place = Place(match[1], int(match[2]), int(match[3] or 1), source)
    return CncError(905003, f"PLC program: {match[4]}", place).as_json()


def be_strict(result: RunResult) -> None:
    """Warnings become errors (``--strict``)."""
    result.errors += [
        CncError(905026, text).as_json() for text in result.warnings
    ]
    if result.warnings and result.end == "completed":
        result.end = "error"
    result.warnings = []
