"""Cases of the look-ahead, of technology functions and of the interface's check."""

from __future__ import annotations

from typing import Any

from plc_client.mock import (
    arc,
    distance_reset,
    dwell,
    h,
    line,
    log_off,
    log_on,
    m,
    rapid,
    s,
    t,
)

from .case import Case, Inputs

OUT = ("done", "busy", "error", "error_id", "state")
LOOK = (*OUT, "full", "more", "empty", "count")
UNIT = (
    "contour_lookahead.semaphor_rw",
    "contour_lookahead.request.start_position",
    "contour_lookahead.request.length",
)
MANY = tuple(line(0.5) for _ in range(300))
SCRIPT = (
    *(log_on(), line(1), m(8, waits=False), arc(2, 1.0), line(2), log_off()),
    *(distance_reset(), dwell(0.01), rapid(3), line(20)),
)


def _edge(fb: Any, inputs: Inputs) -> None:
    given = dict(inputs)
    if not given.pop("use_execute"):
        given["execute"] = None
    fb(**given)


def _two(hli: Any, block: Any) -> Any:
    fb, other = block(hli.gpCh[0]), block(hli.gpCh[0])
    fb.other = other
    return fb


def _run_two(fb: Any, inputs: Inputs) -> None:
    fb(inputs["at"], 5000.0)
    if inputs["both"]:
        fb.other(0.0, 0.0)


def _paged(fb: Any, inputs: Inputs) -> None:
    found = fb.follow(8000.0) if inputs["follow"] else fb.read_log()
    fb.new = len(found)
    fb.first_start = float(found["start_position"][0]) if len(found) else -1.0


def _pager(hli: Any, block: Any) -> Any:
    fb = block(hli.gpCh[0])
    fb.new, fb.first_start = 0, -1.0
    return fb


PAGES = ("new", "first_start", "count", "busy", "resets", "gaps", "state")
PAGED = "fb(by_follow := i_follow);"


def _kept(fb: Any, inputs: Inputs) -> None:
    found = fb(inputs["length"])
    fb.count = len(found)
    fb.first_start = float(found["start_position"][0]) if len(found) else -1.0
    fb.near = len(fb.window(15_000.0))


def _queue(fb: Any, inputs: Inputs) -> None:
    _edge(fb, inputs)
    rows = fb.blocks
    fb.last_start = float(rows["start_position"][-1]) if len(rows) else -1.0
    fb.detail_count = len(fb.details)
    fb.last_way = float(fb.details["way"][-1]) if fb.detail_count else -1.0


def _served(hli: Any, block: Any) -> Any:
    from plc_client import TechnoServer  # noqa: PLC0415

    server = TechnoServer(hli)
    fb = server.on("M", 8)
    fb.server, fb.others = server, server.on("H")
    fb.fetched, fb.told = 0, -1
    return fb


def _serve(fb: Any, inputs: Inputs) -> None:
    fb.fetched = len(fb.server())
    fb(done=inputs["ready"])
    fb.others(done=True)
    fb.told = fb.payload.add_value if fb.payload is not None else -1


def _server(hli: Any, block: Any) -> Any:
    fb = block(hli)
    fb.fetched, fb.numbers = 0, 0
    fb.spindle = fb.on("S", 500)
    return fb


def _serve_all(fb: Any, inputs: Inputs) -> None:
    found = fb()
    fb.fetched = len(found)
    fb.numbers += sum(f.number for f in found)
    fb.spindle(done=inputs["ready"])


def _acknowledging(hli: Any, block: Any) -> Any:
    fb = block(hli)
    fb.fetched = fb.count = fb.numbers = 0
    return fb


def _acknowledge(fb: Any, inputs: Inputs) -> None:
    found = fb()
    fb.fetched = len(found)
    fb.count += len(found)
    fb.numbers += sum(f.number for f in found)


FUNCTIONS = (
    *(line(0.3), m(8, 7), line(0.3), m(8, 9), h(3), line(0.2), s(500)),
    *(t(12), m(50, waits=False), line(0.2), m(51, waits=False), line(20)),
)
TWO = """
FUNCTION_BLOCK TwoLookaheads EXTENDS ContourLookahead
VAR_INPUT place : LREAL; both : BOOL; END_VAR
VAR_OUTPUT other : ContourLookahead; END_VAR
start_position := place; length := 5000.0;
SUPER^();
IF both THEN other(start_position := 0.0, length := 0.0); END_IF
END_FUNCTION_BLOCK
"""
PAGES_ST = """
FUNCTION_BLOCK Pages EXTENDS ContourLookahead
VAR_INPUT by_follow : BOOL; END_VAR
VAR_OUTPUT new : INT; first_start : LREAL; END_VAR
IF by_follow THEN new := follow(8000.0); ELSE new := read_log(); END_IF
first_start := -1.0;
IF new > 0 THEN first_start := blocks[first].start_position; END_IF
END_FUNCTION_BLOCK
"""
KEPT = """
FUNCTION_BLOCK Kept EXTENDS ContourAhead
VAR_OUTPUT first_start : LREAL; near : INT; END_VAR
SUPER^();
first_start := -1.0;
IF count > 0 THEN first_start := elements[0].start_position; END_IF
near := window(15_000.0);
END_FUNCTION_BLOCK
"""
QUEUED = """
FUNCTION_BLOCK Queued EXTENDS ContourQueue
VAR_OUTPUT last_start, last_way : LREAL := -1.0; END_VAR
SUPER^();
last_start := -1.0;
IF count > 0 THEN last_start := blocks[count - 1].start_position; END_IF
last_way := -1.0;
IF detail_count > 0 THEN last_way := details[detail_count - 1].way; END_IF
END_FUNCTION_BLOCK
"""
ACKNOWLEDGED = """
FUNCTION_BLOCK Acknowledged EXTENDS AcknowledgeAll
VAR_OUTPUT fetched : INT; numbers : DINT; END_VAR
VAR k : INT; END_VAR
SUPER^();
fetched := number;
FOR k := 0 TO number - 1 DO numbers := numbers + functions[k].number; END_FOR
END_FUNCTION_BLOCK
"""
SERVER = """
FUNCTION_BLOCK Server EXTENDS TechnoServer
VAR_INPUT ready : BOOL; END_VAR
VAR_OUTPUT fetched : INT; numbers : DINT; spindle : TechnoBlock; END_VAR
VAR n : INT; END_VAR
on(spindle, 'S', 500);
SUPER^();
fetched := number;
FOR n := 0 TO number - 1 DO numbers := numbers + functions[n].number; END_FOR
spindle(done := ready);
END_FUNCTION_BLOCK
"""
SERVED = """
FUNCTION_BLOCK Served EXTENDS TechnoBlock
VAR_INPUT ready : BOOL; END_VAR
VAR_OUTPUT fetched : INT; told : DINT := -1; END_VAR
VAR server : TechnoServer; others : TechnoBlock; END_VAR
server.on(THIS^, 'M', 8);
server.on(others, 'H');
server();
fetched := server.number;
done := ready;
SUPER^();
others(done := TRUE);
IF count > 0 THEN told := function_.payload.m_h.add_value; END_IF
END_FUNCTION_BLOCK
"""
CASES = {
    "look-ahead, continuous": Case(
        "ContourLookahead",
        LOOK,
        {
            0: {"start_position": 0.0, "length": 20_000.0, "mode": 0},
            20: {"length": -1.0},
            25: {"length": 0.0, "start_position": 1.0},
            35: {"mode": 2},
            38: {"mode": 1},
            45: {"mode": 7},
            50: {"mode": 2, "length": 9000.0, "start_position": 1e9},
        },
        UNIT,
        SCRIPT,
    ),
    "look-ahead, full": Case(
        "ContourLookahead",
        LOOK,
        {0: {"start_position": 0.0, "length": 1e7, "mode": 2}},
        UNIT,
        MANY,
        20,
        mock={"ahead": 300},
    ),
    "look-ahead, at an edge": Case(
        "ContourLookahead",
        LOOK,
        {
            0: {
                "start_position": 0.0,
                "length": 20_000.0,
                "use_execute": True,
                "execute": False,
            },
            3: {"execute": True},
            4: {"execute": False},
            9: {"execute": True},
            20: {"execute": False},
            22: {"execute": True, "length": -1.0},
            25: {"execute": False, "length": 1.0},
            28: {"use_execute": False},
        },
        UNIT,
        SCRIPT,
        40,
        run=_edge,
    ),
    "look-ahead, two in turn": Case(
        "ContourLookahead",
        (*LOOK, "other.count", "other.done", "other.state"),
        {
            0: {"at": 0.0, "both": True},
            20: {"both": False},
            21: {"at": 10_000.0},
            40: {"both": True},
        },
        UNIT,
        SCRIPT,
        make=_two,
        run=_run_two,
        st_block="TwoLookaheads",
        around=TWO,
        st="fb(place := i_at, both := i_both);",
    ),
    "pages of the contour": Case(
        "ContourLookahead",
        PAGES,
        {0: {"follow": True}},
        UNIT,
        (*(line(0.3) for _ in range(20)), distance_reset(), line(4), line(30)),
        150,
        make=_pager,
        run=_paged,
        st_block="Pages",
        around=PAGES_ST,
        st=PAGED,
    ),
    "many pages": Case(
        "ContourLookahead",
        PAGES,
        {0: {"follow": True}},
        UNIT,
        MANY,
        60,
        make=_pager,
        run=_paged,
        st_block="Pages",
        around=PAGES_ST,
        st=PAGED,
        mock={"ahead": 200},
    ),
    "pages of the log": Case(
        "ContourLookahead",
        PAGES,
        {0: {"follow": False}},
        UNIT,
        (log_on(), *(line(0.1) for _ in range(200)), log_off(), line(30)),
        260,
        make=_pager,
        run=_paged,
        st_block="Pages",
        around=PAGES_ST,
        st=PAGED,
        mock={"ahead": 300},
    ),
    "ahead": Case(
        "ContourAhead",
        (
            *("done", "busy", "state", "count", "distance", "known"),
            *("first_start", "near"),
        ),
        {0: {"length": 20_000.0}},
        UNIT,
        (*(line(0.4) for _ in range(30)), distance_reset(), line(4), line(30)),
        200,
        make=_pager,
        run=_kept,
        st_block="Kept",
        around=KEPT,
        st="fb(length := i_length);",
    ),
    "queue": Case(
        "ContourQueue",
        (
            *OUT,
            *("count", "more", "empty", "end:ends_at", "epoch:answer_epoch"),
            *("distance", "tag", "last_start", "last_way", "detail_count"),
        ),
        {
            0: {
                "start_position": 0.0,
                "length": 20_000.0,
                "use_execute": False,
                "execute": False,
                "mode": 2,
                "epoch": 0,
                "beyond": False,
                "events": False,
                "details": False,
            },
            10: {"beyond": True},
            20: {"events": True, "details": True},
            30: {"mode": 1, "length": 0.0},
            35: {"beyond": False, "events": False, "details": False},
            40: {"mode": 2, "length": -1.0},
            45: {"use_execute": True, "length": 9000.0},
            47: {"execute": True},
            50: {"execute": False},
            53: {"execute": True, "epoch": 9},
        },
        (),
        SCRIPT,
        run=_queue,
        st_block="Queued",
        around=QUEUED,
        kinds={"mode": "UDINT", "epoch": "UDINT"},
        named={"details": "with_details"},
        st=(
            "fb(start_position := i_start_position, length := i_length, "
            "use_execute := i_use_execute, execute := i_execute, "
            "mode := i_mode, epoch := i_epoch, beyond := i_beyond, "
            "events := i_events, with_details := i_details);"
        ),
    ),
    "functions acknowledged": Case(
        "AcknowledgeAll",
        ("fetched", "count", "numbers"),
        {},
        (),
        FUNCTIONS,
        make=_acknowledging,
        run=_acknowledge,
        st_block="Acknowledged",
        around=ACKNOWLEDGED,
        st="fb();",
    ),
    "functions served": Case(
        "TechnoServer",
        ("fetched", "numbers", "spindle.active", "spindle.count"),
        {0: {"ready": False}, 40: {"ready": True}},
        (),
        FUNCTIONS,
        make=_server,
        run=_serve_all,
        st_block="Server",
        around=SERVER,
        st="fb(ready := i_ready);",
    ),
    "a function's block": Case(
        "TechnoBlock",
        ("busy", "active", "rising", "state", "count", "fetched", "told"),
        {
            0: {"ready": False},
            10: {"ready": True},
            12: {"ready": False},
            30: {"ready": True},
        },
        (),
        FUNCTIONS,
        make=_served,
        run=_serve,
        st_block="Served",
        around=SERVED,
        st="fb(ready := i_ready);",
    ),
    "interface": Case(
        "MCV_HliInterface",
        (
            *("done", "busy", "error", "error_id", "state", "Initialized"),
            *("PlcHli.version", "CncHli.sizeof_channel", "PlcHli.axes"),
        ),
        {},
        (),
        scans=210,
        make=lambda hli, block: block(hli, "an older one"),
        st="fb(version := 'an older one');",
    ),
}
