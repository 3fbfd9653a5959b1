"""Cases of the watchdogs and of the error records."""

from __future__ import annotations

from typing import Any

from plc_client import CncErrorRecord
from plc_client.mock import cnc_error, line
from plc_client.runner import PlcRunner

from .case import Case, Inputs

OUT = ("done", "busy", "error", "error_id")


def _silent(runner: PlcRunner, scan: int) -> None:
    """The CNC falls silent, and comes back."""
    cnc: Any = runner.cnc
    cnc.watchdogs.lc_dead = 20 <= scan < 40


def _read(fb: Any, inputs: Inputs) -> None:
    fb.fresh = bool(fb(**inputs))
    fb.shown = fb.last or NOTHING


def _reader(hli: Any, block: Any) -> Any:
    fb = block(hli.gpCh[0])
    fb.fresh, fb.shown = False, NOTHING
    return fb


NOTHING = CncErrorRecord(0, "", 0, 0, 0, 0, "", "", 0, 0)
SHOWN = (
    *("error_id", "module", "line", "channel", "recovery_class"),
    *("reaction_class", "file", "block_number", "file_offset"),
)
CASES = {
    "watchdog": Case(
        "Watchdog",
        (*OUT, "alive", "state"),
        {
            0: {"enable": False, "cycle_time_us": 5000},
            3: {"enable": True},
            50: {"enable": False},
        },
        tuple(
            f"head.mc_watchdog.{name}"
            for name in ("enable_w", "alive_rw", "cycle_time_w")
        ),
        absent=(20, 40),
        kinds={"cycle_time_us": "UDINT"},
    ),
    "watchdog of the CNC": Case(
        "CncWatchdog",
        ("done", "busy", "error", "alive", "missed", "state"),
        {0: {"enable": False}, 3: {"enable": True}, 50: {"enable": False}},
        tuple(
            f"head.lc_watchdog.{name}"
            for name in ("enable_w", "alive_rw", "alive_state_r")
        ),
        make=lambda hli, block: block(hli.gpCh[0], cycle_time_us=4000),
        st="fb(enable := i_enable, cycle_time_us := 4000);",
        before=_silent,
    ),
    "errors read": Case(
        "ErrorReader",
        (
            *("error", "error_id", "fresh", "count", "state"),
            *(f"shown.{name}:last.{name}" for name in SHOWN),
            "shown.program:last.program_name",
        ),
        {
            0: {"enable": True, "acknowledge": True},
            12: {"acknowledge": False},
            30: {"acknowledge": True},
        },
        ("mc_error.enable_w", "mc_error.semaphor_rw"),
        tuple(
            step
            for number in (7, 8, 9, 10)
            for step in (cnc_error(number), line(0.5))
        ),
        make=_reader,
        run=_read,
        scans=50,
    ),
    "error written": Case(
        "ErrorWriter",
        (*OUT, "state"),
        {
            0: {
                "execute": False,
                "number": 4711,
                "reaction_class": 2,
                "recovery_class": 8,
                "module": "VALVE",
            },
            3: {"execute": True},
            10: {"execute": False, "reaction_class": 9},
            15: {"execute": True},
            20: {"execute": False, "number": 0},
            25: {"execute": True},
        },
        (
            "lc_error.semaphor_rw",
            "lc_error.enable_w",
            "lc_error.satz_r.kopf.error_id",
            "lc_error.satz_r.kopf.channel",
            "lc_error.satz_r.kopf.modul_name.zeichen",
            "lc_error.satz_r.kopf.reaction_class",
        ),
        kinds={
            "module": "STRING(15)",
            "number": "UDINT",
            "reaction_class": "UINT",
            "recovery_class": "UINT",
        },
    ),
}
