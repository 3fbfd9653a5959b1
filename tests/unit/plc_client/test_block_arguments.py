"""What the constructors of the blocks take, and what they refuse."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import plc_client
from hli import Areas, layout
from hli.handshake import ContourUnit, snapshot, word_pointer
from hli.queue import Queue
from hli.structures import HLI_CHANNEL
from hli.view import overlay
from plc_client import TechnoServer, blocks, connect
from plc_client.blocks.program_flow import TechnoArray
from plc_client.blocks.watchdog import read_record, write_record
from plc_client.image import InputImage
from plc_client.mock import MockCnc, line

OWN_UNITS: dict[str, tuple[str, ...]] = {
    "AbortProgram": ("channel_mc_control.mode_and_state",),
    "AutoContinue": ("bahn_mc_control.continue_machining",),
    "CncWatchdog": ("head.lc_watchdog",),
    "ContinueMachining": ("bahn_mc_control.continue_machining",),
    "ContourAhead": ("contour_lookahead",),
    "ContourLookahead": ("contour_lookahead",),
    "ContourQueue": ("contour_lookahead",),
    "DeleteDistanceToGo": ("bahn_mc_control.delete_distance_to_go",),
    "DistanceCam": ("bahn_state",),
    "DistanceTrigger": ("bahn_state",),
    "ErrorReader": ("mc_error",),
    "ErrorWriter": ("lc_error",),
    "ExternalSpeed": ("bahn_mc_control.ext_command_speed",),
    "FeedControl": ("bahn_mc_control",),
    "FeedHold": ("bahn_mc_control.feedhold",),
    "InsertStop": ("bahn_mc_control.insert_cmd",),
    "ModeControl": ("channel_mc_control.mode_and_state",),
    "OptionalStop": ("bahn_mc_control.m01_stop_enable",),
    "Override": ("bahn_mc_control.override", "bahn_mc_control.rapid_override"),
    "PathDirection": ("bahn_mc_control.backward_motion",),
    "PathEstimate": ("bahn_state",),
    "ResetChannel": ("channel_mc_control.mode_and_state",),
    "ResumeProgram": ("channel_mc_control.mode_and_state",),
    "RtLoop": ("bahn_mc_control.rt_loop_enable",),
    "RunMdi": ("channel_mc_control.mode_and_state",),
    "SelectProgram": ("channel_mc_control.mode_and_state",),
    "SingleBlock": ("bahn_mc_control.single_block",),
    "SkipLevels": ("decoder_mc_control.program_block_ignore",),
    "StartProgram": ("channel_mc_control.mode_and_state",),
    "StopProgram": ("channel_mc_control.mode_and_state",),
    "Watchdog": ("head.mc_watchdog",),
}
OTHERS = {
    "AxisControl": "gpAx[0]",
    "LevelUnit": "gpCh[0].bahn_mc_control.feedhold",
    "AcknowledgeAll": "",
    "MCV_HliInterface": "",
    "TechnoServer": "",
}


@pytest.fixture
def hli() -> Iterator[Any]:
    """A connection with a mock CNC."""
    with MockCnc([line(10)]) as cnc, connect(cnc.name) as found:
        yield found


def at(hli: Any, path: str) -> Any:
    return hli.symbol(path).value if path else hli


def memory(hli: Any) -> bytes:
    return bytes(hli.segment.memory)


def test_every_block_is_listed() -> None:
    """A new block says here what it takes."""
    made = {
        name
        for name in blocks.__all__
        if inspect.isclass(one := getattr(blocks, name))
        and {"ch", "unit", "ax", "hli"} & set(inspect.signature(one).parameters)
    }
    assert made == set(OWN_UNITS) | set(OTHERS)


@pytest.mark.parametrize("name", OWN_UNITS)
def test_a_block_takes_the_channel_or_its_own_unit(hli: Any, name: str) -> None:
    """Both make the same block, also once the input image is there."""
    block = getattr(plc_client, name)
    for unit in OWN_UNITS[name]:
        block(at(hli, f"gpCh[0].{unit}"))
    block(hli.gpCh[0])
    image = InputImage(hli)
    block(at(hli, f"gpCh[0].{OWN_UNITS[name][0]}"))
    image.close()


WRONG = (
    "",
    "gpAx[0]",
    "gpPform",
    "gpCh[0]",
    "gpCh[0].head",
    "gpCh[0].bahn_state",
    "gpCh[0].bahn_mc_control",
    "gpCh[0].bahn_mc_control.feedhold",
    "gpCh[0].bahn_mc_control.rapid_override_valid",
    "gpCh[0].contour_lookahead",
    "gpCh[0].contour_lookahead.request",
    "gpCh[0].mc_error",
    "gpAx[0].ipo_mc_control.feedhold",
)


def wrong_things(hli: Any, name: str) -> Iterator[Any]:
    right = OWN_UNITS.get(name)
    taken = (
        {OTHERS[name]}
        if right is None
        else {"gpCh[0]", *(f"gpCh[0].{unit}" for unit in right)}
    )
    for path in WRONG:
        level = name == "LevelUnit" and path.endswith(("hold", "_valid"))
        if path not in taken and not level:
            yield at(hli, path)
    yield from (hli.gpCh, None, 0, "gpCh[0]", hli.gpCh[0]._c)
    # memory of nobody
    yield HLI_CHANNEL(layout.HLI_CHANNEL())
    yield snapshot(hli.gpCh[0].bahn_state)


@pytest.mark.parametrize("name", [*OWN_UNITS, *OTHERS])
def test_a_block_refuses_everything_else(hli: Any, name: str) -> None:
    """TypeError with the right spelling; no byte of the memory changes."""
    block = getattr(plc_client, name)
    before = memory(hli)
    for given in wrong_things(hli, name):
        with pytest.raises(TypeError) as error:
            block(given)
        assert str(error.value).startswith(f"{name}: takes ")
        assert f"{name}(hli" in str(error.value)
    assert memory(hli) == before


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (
            lambda hli: plc_client.ContourLookahead(hli.gpCh[0].bahn_state),
            "ContourLookahead: takes the channel, ContourLookahead(hli.gpCh[0]),"
            " or its unit, ContourLookahead(hli.gpCh[0].contour_lookahead);"
            " not hli.gpCh[0].bahn_state (HLI_BAHN_STATE)",
        ),
        (
            plc_client.Override,
            "Override: takes the channel, Override(hli.gpCh[0]),"
            " or its unit, Override(hli.gpCh[0].bahn_mc_control.override),"
            " or its unit, Override(hli.gpCh[0].bahn_mc_control.rapid_override);"
            " not hli (Hli)",
        ),
        (
            lambda hli: plc_client.AcknowledgeAll(hli.gpCh[0]),
            "AcknowledgeAll: takes the whole HLI, AcknowledgeAll(hli);"
            " not hli.gpCh[0] (HLI_CHANNEL)",
        ),
        (
            lambda hli: plc_client.AxisControl(hli.gpCh[0]),
            "AxisControl: takes the axis, AxisControl(hli.gpAx[0]);"
            " not hli.gpCh[0] (HLI_CHANNEL)",
        ),
        (
            lambda hli: plc_client.FeedHold(hli.gpCh),
            "not hli.gpCh (all of them)",
        ),
    ],
    ids=["unit", "hli", "channel", "axis", "all"],
)
def test_the_text_spells_it_right(
    hli: Any, make: Callable[[Any], Any], text: str
) -> None:
    """What the block takes, as a program writes it, and what it got."""
    with pytest.raises(TypeError) as error:
        make(hli)
    assert text in str(error.value)


DOORS: dict[str, Callable[[Any], Any]] = {
    "ContourUnit": ContourUnit,
    "TechnoArray": lambda given: TechnoArray(given, "gpCh[0]", False),
    "read_record": read_record,
    "write_record": lambda given: write_record(given, blocks.watchdog.NO_ERROR),
    "word_pointer": lambda given: word_pointer(given, "clah_bell"),
    "snapshot": snapshot,
    "Queue": Queue,
    "InputImage": InputImage,
    "overlay": lambda given: overlay(given, layout.HLI_M_H_PROZESS),
}


@pytest.mark.parametrize("door", DOORS)
def test_no_view_of_another_type_gets_to_c(hli: Any, door: str) -> None:
    """Every function that hands memory to C refuses what it cannot work on."""
    before = memory(hli)
    wrong: list[Any] = [
        hli.gpCh[0].bahn_mc_control,
        HLI_CHANNEL(layout.HLI_CHANNEL()),
        HLI_CHANNEL(layout.HLI_CHANNEL()).contour_lookahead,
        None,
        b"0" * 4096,
    ]
    for given in wrong:
        error = (TypeError, ValueError) if door == "snapshot" else TypeError
        with pytest.raises(error):
            DOORS[door](given)
    assert memory(hli) == before


def test_doors_know_their_sizes(hli: Any) -> None:
    """No pointer behind a structure's end, no other elements, no other word."""
    unit = ContourUnit(hli.gpCh[0].contour_lookahead)
    with pytest.raises(TypeError, match="BLOCK_DTYPE"):
        unit.answer(np.zeros(3))
    with pytest.raises(IndexError):
        hli.gpCh[0]._pointer(1 << 30)
    with pytest.raises(ValueError, match="no side word"):
        word_pointer(hli.root, "stats")
    with pytest.raises(TypeError, match="is no HLI_CHANNEL"):
        HLI_CHANNEL(layout.HLI_AXIS())
    assert isinstance(hli, Areas)


@pytest.mark.parametrize("slot", [-1, 4, 1 << 40])
def test_a_slot_that_is_not_there_is_refused(hli: Any, slot: int) -> None:
    """By its range, ahead of C."""
    queue, none = Queue(hli.gpAhead[0]), np.zeros(0)
    with pytest.raises(IndexError, match=r"runs 0\.\.3"):
        queue.take(slot)
    with pytest.raises(IndexError, match=r"runs 0\.\.3"):
        queue.answer(slot, none, none, {})


@pytest.mark.parametrize("number", [-1, "50", 50.5, True, [50]])
def test_a_function_has_a_whole_number(hli: Any, number: Any) -> None:
    """A block for ``"50"`` would have waited for ever."""
    with pytest.raises(ValueError, match="a whole number from 0 on"):
        TechnoServer(hli).on("M", number)
