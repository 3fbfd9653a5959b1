"""FeedControl, AutoContinue, AcknowledgeAll on a bare segment."""

from collections.abc import Iterator
from typing import Any

import pytest

import hli
from hli import layout
from hli.areas import Areas
from hli.view import overlay
from plc_client import AcknowledgeAll, AutoContinue, FeedControl
from support.fake_cnc import unique_name


@pytest.fixture
def areas() -> Iterator[Areas]:
    """One channel, three axes."""
    with hli.create(unique_name()) as segment:
        yield Areas(segment)


def test_feed_control_commands_override_and_feedhold(areas: Areas) -> None:
    """0.1 % in command_w, enable_w and override_valid set."""
    control = areas.gpCh[0].bahn_mc_control
    FeedControl(areas.gpCh[0])(override=72.5, feedhold=True)
    assert (control.override.command_w, control.override.enable_w) == (
        725,
        True,
    )
    assert (
        control.override_valid.command_w,
        control.override_valid.enable_w,
    ) == (True, True)
    assert (control.feedhold.command_w, control.feedhold.enable_w) == (
        True,
        True,
    )


@pytest.mark.parametrize("override", [-0.1, 200.1, float("nan")])
def test_feed_control_refuses_wrong_overrides(
    areas: Areas, override: float
) -> None:
    """ValueError; nothing is enabled."""
    with pytest.raises(ValueError, match="override"):
        FeedControl(areas.gpCh[0])(override=override)
    assert not areas.gpCh[0].bahn_mc_control.override.enable_w


def test_feed_control_gives_the_units_back(areas: Areas) -> None:
    """release() drops the enables."""
    feed = FeedControl(areas.gpCh[0])
    feed()
    feed.release()
    assert not areas.gpCh[0].bahn_mc_control.override.enable_w


def continue_cycle(ch: Any, before: bool, stops: int) -> tuple[bool, int]:
    """One CNC cycle: a rising edge leaves one stop; (command seen, stops left)."""
    unit = ch.bahn_mc_control.continue_machining
    command = unit.command_w and unit.enable_w
    if command and not before and stops:
        stops -= 1
    unit.state_r = command
    ch.bahn_state.wait_continue_r = stops > 0
    return command, stops


def test_auto_continue_gives_one_edge_per_stop(areas: Areas) -> None:
    """Three stops in a row, without a gap in wait_continue_r, are all left."""
    ch = areas.gpCh[0]
    flow, seen, stops = AutoContinue(ch), False, 3
    for _ in range(12):
        seen, stops = continue_cycle(ch, seen, stops)
        flow()
    assert stops == 0
    assert flow.count == 3
    assert not ch.bahn_mc_control.continue_machining.command_w


def test_auto_continue_waits_for_the_axes(areas: Areas) -> None:
    """No edge while wait_axes_in_position_r is TRUE, none without a stop."""
    ch = areas.gpCh[0]
    flow = AutoContinue(ch)
    flow()
    ch.bahn_state.wait_continue_r = True
    ch.bahn_state.wait_axes_in_position_r = True
    flow()
    assert not ch.bahn_mc_control.continue_machining.command_w
    ch.bahn_state.wait_axes_in_position_r = False
    flow()
    assert ch.bahn_mc_control.continue_machining.command_w


def test_auto_continue_takes_back_what_others_command(areas: Areas) -> None:
    """Without a stop the unit is commanded FALSE, whoever wrote it."""
    ch = areas.gpCh[0]
    flow, unit = AutoContinue(ch), ch.bahn_mc_control.continue_machining
    flow()
    unit.command_w = True
    flow()
    assert not unit.command_w
    unit.enable_w = False
    flow()
    assert unit.enable_w


def offer(unit: Any, code: int, number: int) -> None:
    """The CNC's side of the two-flag protocol."""
    payload = {3: layout.HLI_S_PROZESS, 4: layout.HLI_T_PROZESS}.get(
        code, layout.HLI_M_H_PROZESS
    )
    view = overlay(unit.attribut_r.data, payload)
    if code == 3:
        view.rev = number
    elif code == 4:
        view.id.basic = number
    else:
        view.nr = number
    unit.fkt_ctrl_r = code
    unit.done_w = False
    unit.please_rw = True


def test_all_functions_are_fetched_and_acknowledged(areas: Areas) -> None:
    """Both arrays of channel and axes, late arrays with gaps, axes first."""
    ch, ax = areas.gpCh[0], areas.gpAx[1]
    offer(ch.techno_unit_std_sync[0], 1, 30)
    offer(ch.techno_unit_std_sync[1], 4, 7)
    offer(ch.techno_unit_late_sync[13], 2, 99)
    offer(ax.techno_unit_std_sync[0], 3, 6_000_000)
    seen = []
    functions = AcknowledgeAll(areas, seen.append)()
    assert [(f.kind, f.number, f.area, f.late) for f in functions] == [
        ("S", 6_000_000, "gpAx[1]", False),
        ("M", 30, "gpCh[0]", False),
        ("T", 7, "gpCh[0]", False),
        ("H", 99, "gpCh[0]", True),
    ]
    assert seen == functions
    for unit in (
        *ch.techno_unit_std_sync[:2],
        ch.techno_unit_late_sync[13],
        ax.techno_unit_std_sync[0],
    ):
        assert (unit.please_rw, unit.done_w) == (False, True)
    assert not ch.techno_unit_late_sync[12].done_w


def test_a_function_in_any_unit_is_found(areas: Areas) -> None:
    """Alone in the first or last unit of each array of each area."""
    acknowledge = AcknowledgeAll(areas)
    assert acknowledge() == []
    for area in (*areas.gpCh, *areas.gpAx):
        if area is None:
            continue
        for units in (area.techno_unit_std_sync, area.techno_unit_late_sync):
            for unit in (units[0], units[len(units) - 1]):
                offer(unit, 1, 17)
                assert [f.number for f in acknowledge()] == [17]
                assert acknowledge() == []


def test_function_is_fetched_before_and_acknowledged_after_its_handler(
    areas: Areas,
) -> None:
    """The PLC executes between the two flags."""
    unit = areas.gpCh[0].techno_unit_std_sync[0]
    offer(unit, 1, 8)
    flags = []
    AcknowledgeAll(
        areas, lambda _: flags.append((unit.please_rw, unit.done_w))
    )()
    assert flags == [(False, False)]


def test_a_function_nobody_waits_for_is_acknowledged_while_it_is_fetched(
    areas: Areas,
) -> None:
    """Behind please_rw FALSE the unit of a MOS function may hold the next one,
    which done_w must not reach.
    """
    unit = areas.gpCh[0].techno_unit_std_sync[0]

    def next_function(_: Any) -> None:
        assert (unit.please_rw, unit.done_w) == (False, True)
        unit.done_w = False  # what the CNC does once the unit is free
        unit.please_rw = True

    offer(unit, 1, 8)
    overlay(unit.attribut_r.data, layout.HLI_M_H_PROZESS).synch_mode = 1
    functions = AcknowledgeAll(areas, next_function)
    functions()
    assert (unit.please_rw, unit.done_w) == (True, False)
