"""Cases of the level units."""

from __future__ import annotations

import math
from typing import Any

from plc_client.mock import line, optional_stop

from .case import Case, Inputs

LEVEL = ("done", "busy", "error", "error_id", "state", "refused")
CONTROL = "bahn_mc_control."


def _words(*units: str) -> tuple[str, ...]:
    words = ("enable_w", "command_w")
    return tuple(f"{unit}.{word}" for unit in units for word in words)


def _of_channel(*units: str) -> tuple[str, ...]:
    return _words(*(CONTROL + unit for unit in units))


def _none(fb: Any, inputs: Inputs) -> None:
    """HLI_NONE of Structured Text is None here."""
    fb(**{k: None if v == -1.0e308 else v for k, v in inputs.items()})


def _levels(fb: Any, inputs: Inputs) -> None:
    mask = inputs.get("mask", 0)
    on = inputs.get("enable", True)
    fb(tuple(n for n in range(1, 11) if mask >> (n - 1) & 1), on)


def _unit(path: str) -> Any:
    def make(hli: Any, block: Any) -> Any:
        unit = hli.gpCh[0]
        for part in path.split("."):
            unit = getattr(unit, part)
        return block(unit)

    return make


def _level_unit(path: str, kind: str, values: tuple[Any, Any]) -> Case:
    st_type = "" if kind == "BOOL" else f"_{kind}"
    outputs = "value:value_active", "request", "enabled"
    return Case(
        "LevelUnit",
        (*LEVEL[:5], *outputs),
        {
            0: {"enable": False, "value": values[0]},
            3: {"enable": True},
            8: {"value": values[1]},
            20: {"enable": False},
            25: {"enable": True, "value": values[0]},
        },
        _words(path),
        kinds={"value": kind},
        make=_unit(path),
        st_block=f"LevelUnit{st_type}",
        st=f"fb(unit := gpCh[0]^.{path}, enable := i_enable, value := i_value);",
        absent=(30, 40),
    )


NONE = -1.0e308
CASES = {
    "unit bool": _level_unit(CONTROL + "feedhold", "BOOL", (False, True)),
    "unit uint": _level_unit(CONTROL + "override", "UINT", (500, 2000)),
    "unit dint": _level_unit(
        CONTROL + "ext_command_speed", "DINT", (-7, 1 << 30)
    ),
    "unit udint": _level_unit(
        "decoder_mc_control.program_block_ignore", "UDINT", (1, 1 << 31)
    ),
    "feed hold": Case(
        "FeedHold",
        (*LEVEL, "standing"),
        {
            0: {"hold": False, "enable": True},
            5: {"hold": True},
            20: {"hold": False},
            25: {"hold": True},
            30: {"enable": False},
        },
        _of_channel("feedhold"),
        absent=(40, 50),
    ),
    "feed control": Case(
        "FeedControl",
        ("override:override_active", "feedhold:feedhold_active"),
        {
            0: {"override": 100.0, "feedhold": False},
            5: {"override": 33.35},
            20: {"override": 200.0, "feedhold": True},
        },
        _of_channel("override", "override_valid", "feedhold"),
    ),
    "override": Case(
        "Override",
        (*LEVEL, "path:path_active", "rapid:rapid_active", "effective"),
        {
            0: {"path": 100.0, "rapid": NONE, "enable": True},
            5: {"path": 33.35},
            9: {"path": 200.1},
            12: {"path": math.nan},
            14: {"path": 0.25, "rapid": 50.0},
            25: {"path": NONE},
            30: {"rapid": NONE},
            35: {"path": 10.0, "rapid": 20.0},
            40: {"enable": False},
        },
        _of_channel(
            *("override", "override_valid"),
            *("rapid_override", "rapid_override_valid"),
        ),
        run=_none,
        absent=(45, 50),
    ),
    "optional stop": Case(
        "OptionalStop",
        LEVEL,
        {
            0: {"stop": True, "enable": True},
            30: {"stop": False},
            40: {"enable": False},
        },
        _of_channel("m01_stop_enable"),
        (line(1), optional_stop(), line(30)),
    ),
    "real-time loop": Case(
        "RtLoop",
        LEVEL,
        {
            0: {"loop": True, "enable": True},
            20: {"loop": False},
            40: {"enable": False},
        },
        _of_channel("rt_loop_enable"),
    ),
    "skip levels": Case(
        "SkipLevels",
        LEVEL,
        {
            0: {"mask": 0, "enable": True},
            5: {"mask": 0b1000000101},
            30: {"enable": False},
        },
        _words("decoder_mc_control.program_block_ignore"),
        run=_levels,
        declared="levels : ARRAY [1..10] OF BOOL; n : INT; ",
        st=(
            "FOR n := 1 TO 10 DO levels[n] := (SHR(i_mask, n - 1) AND 1) <> 0; "
            "END_FOR fb(levels := levels, enable := i_enable);"
        ),
        kinds={"mask": "DWORD"},
    ),
    "direction": Case(
        "PathDirection",
        (*LEVEL, "backward_active", "distance"),
        {
            0: {
                "backward": False,
                "simulate": False,
                "clear_storage": False,
                "enable": True,
            },
            20: {"backward": True},
            30: {"simulate": True},
            33: {"backward": False},
            40: {"clear_storage": True},
            50: {"enable": False},
        },
        _of_channel("backward_motion", "simulate_motion"),
    ),
    "external speed": Case(
        "ExternalSpeed",
        LEVEL,
        {
            0: {"speed": 100, "enable": True},
            20: {"speed": -5_000_000},
            40: {"enable": False},
        },
        _of_channel("ext_command_speed", "ext_command_speed_valid"),
    ),
    "axis": Case(
        "AxisControl",
        LEVEL,
        {
            0: {
                "release": True,
                "feedhold": False,
                "override": NONE,
                "drive_on": True,
                "torque_permission": True,
                "enable": True,
            },
            5: {"release": False},
            15: {"release": True, "override": 50.05},
            20: {"override": -1.0},
            25: {"override": 120.0, "drive_on": False, "feedhold": True},
            35: {"override": NONE, "torque_permission": False},
            45: {"enable": False},
        },
        tuple(
            f"axis:{path}"
            for path in _words(
                "lr_mc_control.release_feedhold",
                "lr_mc_control.drive_on",
                "lr_mc_control.torque_permission",
                "ipo_mc_control.feedhold",
                "ipo_mc_control.override",
                "ipo_mc_control.override_valid",
            )
        ),
        make=lambda hli, block: block(hli.gpAx[0]),
        run=_none,
    ),
    "single block": Case(
        "SingleBlock",
        (
            *LEVEL[:5],
            *("value", "request", "enabled", "waiting", "steps"),
        ),
        {
            0: {"enable": True, "next_block": False},
            15: {"next_block": True},
            20: {"next_block": False},
            40: {"next_block": True},
            60: {"enable": False, "next_block": False},
        },
        _of_channel("single_block", "continue_machining"),
        (line(1), line(1), line(1), line(30)),
        80,
    ),
}
