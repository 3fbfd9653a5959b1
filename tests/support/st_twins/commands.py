"""Cases of the blocks with a rising edge and of the modes."""

from __future__ import annotations

from plc_client.mock import cnc_error, line, stop

from .case import Case

OUT = ("done", "busy", "error", "error_id")
MODE = (*OUT, "mode", "process_state")
CONTINUE = "bahn_mc_control.continue_machining."
EDGE = ("command_w", "enable_w")
PRESS = {0: {"execute": False}, 3: {"execute": True}, 40: {"execute": False}}
CASES = {
    "continue": Case(
        "ContinueMachining",
        (*OUT, "waiting"),
        {**PRESS, 45: {"execute": True}},
        tuple(CONTINUE + word for word in EDGE),
        (line(1), stop(), line(1), stop(), line(30)),
        90,
    ),
    "automatic": Case(
        "AutoContinue",
        ("count",),
        {},
        tuple(CONTINUE + word for word in EDGE),
        (line(1), stop(), line(1), stop(), line(30)),
        90,
    ),
    "delete distance": Case(
        "DeleteDistanceToGo",
        (*OUT, "active"),
        {**PRESS, 3: {"execute": True, "mask": 5}},
        (
            "bahn_mc_control.delete_distance_to_go.command_w",
            "bahn_mc_control.del_dist_to_go_end.command_w",
        ),
    ),
    "stop": Case(
        "InsertStop",
        (*OUT, "next_stop"),
        {**PRESS, 3: {"execute": True, "distance": 20_000.0, "mode": 1}},
        ("bahn_mc_control.insert_cmd.command_semaphor_rw",),
    ),
    "wrong stop": Case(
        "InsertStop", OUT, {**PRESS, 3: {"execute": True, "mode": 7}}
    ),
    "dead channel": Case("InsertStop", OUT, PRESS, absent=(2, 50)),
    "select": Case(
        "SelectProgram",
        MODE,
        {**PRESS, 3: {"execute": True, "program": "part.nc"}},
        started=False,
        named={"program": "program_name"},
    ),
    "start": Case(
        "StartProgram",
        MODE,
        PRESS,
        started=False,
        script=(line(2),),
        named={"program": "program_name"},
    ),
    "start another": Case(
        "StartProgram",
        MODE,
        {**PRESS, 3: {"execute": True, "program": "other.nc"}},
        named={"program": "program_name"},
    ),
    "hold": Case("StopProgram", MODE, PRESS),
    "hold nothing": Case("StopProgram", MODE, PRESS, started=False),
    "resume nothing": Case("ResumeProgram", MODE, PRESS),
    "abort": Case("AbortProgram", MODE, PRESS),
    "reset": Case("ResetChannel", MODE, PRESS),
    "mdi": Case(
        "RunMdi",
        MODE,
        {**PRESS, 3: {"execute": True, "text": "G01 X1"}},
        started=False,
        named={"text": "blocks"},
    ),
    "forbidden state": Case(
        "ModeControl",
        MODE,
        {**PRESS, 3: {"execute": True, "to_mode": 1, "to_state": 5}},
    ),
    "no mode": Case(
        "ModeControl", MODE, {**PRESS, 3: {"execute": True, "to_mode": 9}}
    ),
    "fault": Case(
        "ModeControl",
        MODE,
        {**PRESS, 3: {"execute": True, "to_mode": 2, "to_state": 5}},
        script=(line(0.4), cnc_error(7), line(30)),
    ),
}
