"""Cases of the switches at a path distance."""

from __future__ import annotations

from typing import Any

from plc_client.mock import dwell, line

from .case import Case, Inputs

SWITCH = ("done", "busy", "state", "q")
SCRIPT = (line(2), dwell(0.005), line(1, feed_mm_s=50.0), line(30))


def _estimate(fb: Any, inputs: Inputs) -> None:
    fb()
    fb.later = fb.at(0.02)
    fb.far = fb.at(5.0)
    fb.rate = fb.speed_at(0.02)


def _told(hli: Any, block: Any) -> Any:
    fb = block(hli.gpCh[0])
    fb.later = fb.far = fb.rate = 0.0
    return fb


def _unplanned(hli: Any, block: Any) -> Any:
    fb = block(hli.gpCh[0])
    fb.path.plan._area = None
    return fb


def _shared(hli: Any, block: Any) -> Any:
    fb = block(hli.gpCh[0], hysteresis=500.0)
    fb.rose = 0
    return fb


def _tracks(fb: Any, inputs: Inputs) -> None:
    tracks = [
        (inputs["a"], inputs["a"] + 5000.0),
        (inputs["a"] + 8000.0, inputs["a"] + 20_000.0),
    ]
    fb(tracks, inputs["on"], inputs["off"], inputs["enable"])


TOLD = """
FUNCTION_BLOCK Told EXTENDS PathEstimate
VAR_OUTPUT later, far, rate : LREAL; END_VAR
SUPER^();
later := after(0.02); far := after(5.0); rate := speed_at(0.02);
END_FUNCTION_BLOCK
"""
CASES = {
    "estimate": Case(
        "PathEstimate",
        (
            "distance",
            "speed",
            "acceleration",
            "planned",
            "later",
            "far",
            "rate",
        ),
        script=SCRIPT,
        make=_told,
        run=_estimate,
        st_block="Told",
        around=TOLD,
        st="fb();",
        scans=100,
    ),
    "trigger": Case(
        "DistanceTrigger",
        (*SWITCH, "time_to_go"),
        {
            0: {"distance": 12_000.0, "lead_s": 0.0, "enable": True},
            20: {"lead_s": 0.01},
            70: {"distance": 45_000.0},
            85: {"enable": False},
            90: {"enable": True},
        },
        script=SCRIPT,
        scans=100,
    ),
    "trigger that falls back": Case(
        "DistanceTrigger",
        (*SWITCH, "time_to_go"),
        {0: {"distance": 12_000.0, "back": False}},
        script=SCRIPT,
        make=_shared,
        run=lambda fb, inputs: fb(inputs["distance"]),
        st="fb(distance := i_distance, hysteresis := 500.0);",
    ),
    "cam": Case(
        "DistanceCam",
        (*SWITCH, "track"),
        {
            0: {"a": 5000.0, "on": 0.0, "off": 0.0, "enable": True},
            30: {"on": 0.004, "off": 0.002},
            60: {"enable": False},
            70: {"enable": True, "a": 20_000.0},
        },
        script=SCRIPT,
        scans=100,
        run=_tracks,
        declared="tracks : ARRAY [0..HLI_TRACK_MAXIDX] OF HLI_TRACK; ",
        st=(
            "tracks[0].begin_at := i_a; tracks[0].end_at := i_a + 5000.0; "
            "tracks[1].begin_at := i_a + 8000.0; "
            "tracks[1].end_at := i_a + 20_000.0; "
            "fb(tracks := tracks, count := 2, on_lead_s := i_on, "
            "off_lead_s := i_off, enable := i_enable);"
        ),
    ),
}
