"""The ADS server with the client of pyads, which nobody here wrote."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from support.bridged import ADS_HOST, Bridged

pyads: Any = pytest.importorskip("pyads")
constants: Any = pytest.importorskip("pyads.constants")

NET_ID = "127.0.0.1.1.1"
CH = "HLI_Global_Variables.gpCh[0]^"
FEED = f"{CH}.bahn_state.active_feed_r"
OVERRIDE = f"{CH}.bahn_mc_control.override"
WAIT_S = 20.0


class Callbacks(dict[Any, Any]):
    """Those of pyads; one that is taken away may still be called: it is kept."""

    def __init__(self) -> None:
        super().__init__()
        self._kept: list[Any] = []

    def pop(self, key: Any, default: Any = None) -> Any:
        self._kept.append(super().pop(key, default))
        return self._kept[-1]


@pytest.fixture(scope="module")
def connect(bridged: Bridged) -> Iterator[Callable[[int], Any]]:
    """Connections to AMS ports of the server."""
    monkeypatch = pytest.MonkeyPatch()
    monkeypatch.setattr(pyads.pyads_ex, "callback_store", Callbacks())
    pyads.open_port()
    pyads.add_route(NET_ID, ADS_HOST)
    opened: dict[int, Any] = {}

    def call(port: int) -> Any:
        if port not in opened:
            opened[port] = pyads.Connection(NET_ID, port, ADS_HOST)
            opened[port].open()
        return opened[port]

    yield call
    for connection in opened.values():
        connection.close()
    monkeypatch.undo()
    pyads.delete_route(pyads.AmsAddr(NET_ID, 851))
    pyads.close_port()


@pytest.fixture
def plc(connect: Callable[[int], Any]) -> Any:
    """The connection to the PLC's port."""
    return connect(851)


def until(condition: Callable[[], bool]) -> None:
    """Wait for it; it fails after a while."""
    end = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.005)


@pytest.mark.parametrize(
    "path",
    [
        FEED,
        "HLI_Global_Variables.gpCh[0].bahn_state.active_feed_r",
        "gpCh[0]^.bahn_state.active_feed_r",
        "gpch[0].BAHN_STATE.Active_Feed_R",
    ],
)
def test_paths_are_found_as_people_write_them(
    bridged: Bridged, plc: Any, path: str
) -> None:
    """With and without the list's name, the caret, and in any case of letters."""
    bridged.channel.bahn_state.active_feed_r = -12345
    assert plc.read_by_name(path, pyads.PLCTYPE_DINT) == -12345


def test_types_come_with_the_symbols(bridged: Bridged, plc: Any) -> None:
    """A client that names no type gets numbers, texts and BOOLs."""
    bridged.channel.bahn_state.prog_name_r = "part-7.nc"
    bridged.channel.bahn_state.dist_prog_start = 1.25e6
    bridged.channel.bahn_state.program_end_r = True
    assert plc.read_by_name(f"{CH}.bahn_state.prog_name_r") == "part-7.nc"
    assert plc.read_by_name(f"{CH}.bahn_state.dist_prog_start") == 1.25e6
    assert plc.read_by_name(f"{CH}.bahn_state.program_end_r") is True
    assert plc.read_by_name("HLI_Global_Variables.gNrCh") == 1


def test_an_unknown_symbol_is_told(plc: Any) -> None:
    """Also a channel that the CNC does not have."""
    for path in ("gpCh[0]^.nothing", "gpCh[7]^.head.channel_nr", "MAIN.none"):
        with pytest.raises(pyads.ADSError) as refused:
            plc.read_by_name(path, pyads.PLCTYPE_DINT)
        assert refused.value.err_code == 0x710


def test_the_plcs_members_are_written_by_the_plc(
    bridged: Bridged, plc: Any
) -> None:
    """A control unit, by name and by handle."""
    plc.write_by_name(f"{OVERRIDE}.command_w", 500, pyads.PLCTYPE_UINT)
    assert bridged.channel.bahn_mc_control.override.command_w == 500
    handle = plc.get_handle(f"{OVERRIDE}.enable_w")
    plc.write_by_name("", True, pyads.PLCTYPE_BOOL, handle=handle)
    assert bridged.channel.bahn_mc_control.override.enable_w is True
    plc.release_handle(handle)


def test_the_cncs_members_are_refused(bridged: Bridged, plc: Any) -> None:
    """With the error of ADS, and nothing changes."""
    bridged.channel.bahn_state.active_feed_r = 77
    with pytest.raises(pyads.ADSError) as refused:
        plc.write_by_name(FEED, 5, pyads.PLCTYPE_DINT)
    assert refused.value.err_code == 0x704
    assert bridged.channel.bahn_state.active_feed_r == 77


def test_structures_are_read_and_written_as_a_whole(
    bridged: Bridged, plc: Any
) -> None:
    """Of a unit that is written, what the CNC owns stays."""
    bridged.channel.bahn_mc_control.rapid_override.state_r = 321
    shape = (
        ("request_r", pyads.PLCTYPE_UINT, 1),
        ("enable_w", pyads.PLCTYPE_BOOL, 1),
        ("fill_1", pyads.PLCTYPE_BYTE, 1),
        ("command_w", pyads.PLCTYPE_UINT, 1),
        ("state_r", pyads.PLCTYPE_UINT, 1),
    )
    path = f"{CH}.bahn_mc_control.rapid_override"
    unit = plc.read_structure_by_name(path, shape)
    assert unit["state_r"] == 321
    unit |= {"enable_w": True, "command_w": 800, "state_r": 1}
    plc.write_structure_by_name(path, unit, shape)
    now = bridged.channel.bahn_mc_control.rapid_override
    assert (now.command_w, now.enable_w, now.state_r) == (800, True, 321)


def test_symbols_of_a_python_task(bridged: Bridged, plc: Any) -> None:
    """Numbers, texts, lists and parts that are objects; read and written."""
    assert plc.read_by_name("Slow.gain") == bridged.task.gain
    assert plc.read_by_name("Slow.inner.et") == 1.5
    assert plc.read_by_name("Slow.flags") == [True, False]
    plc.write_by_name("Slow.gain", 7.25)
    plc.write_by_name("Slow.text", "longer text", pyads.PLCTYPE_STRING)
    assert (bridged.task.gain, bridged.task.text) == (7.25, "longer text")
    with pytest.raises(pyads.ADSError):
        plc.read_by_name("Slow._hidden", pyads.PLCTYPE_LINT)


def test_symbols_of_an_st_program(bridged: Bridged, plc: Any) -> None:
    """With structures, arrays of two dimensions, and blocks of the library."""
    assert plc.read_by_name("MAIN.title") == "spindle"
    assert plc.read_by_name("MAIN.grid[1,2]") == 4
    plc.write_by_name("MAIN.pair.b[2]", 2.5)
    assert plc.read_by_name("MAIN.pair.b") == [0.0, 2.5, 0.0]
    plc.write_by_name("main.title", "Grün", pyads.PLCTYPE_STRING)
    assert plc.read_by_name("MAIN.timer.Q") is False
    first = plc.read_by_name("MAIN.count")
    until(lambda: plc.read_by_name("MAIN.count") > first)


def test_all_symbols_are_listed_with_their_types(plc: Any) -> None:
    """What is listed can be read, and has the type that is listed."""
    listed = {one.name: one for one in plc.get_all_symbols()}
    assert listed[FEED].symbol_type == "DINT"
    assert listed[f"{CH}.bahn_state"].symbol_type == "HLI_BAHN_STATE"
    assert listed["MAIN.grid"].symbol_type == "ARRAY [0..1,1..2] OF INT"
    assert "Slow.inner.q" in listed
    assert len(listed) > 1000
    assert listed[FEED].read() == plc.read_by_name(FEED)


def test_many_are_read_and_written_at_once(bridged: Bridged, plc: Any) -> None:
    """One that is unknown or refused leaves the others."""
    bridged.channel.bahn_state.active_feed_r = 99
    paths = [FEED, "Slow.gain", f"{OVERRIDE}.command_w", "MAIN.title"]
    found = plc.read_list_by_name(paths)
    assert found[FEED] == 99
    assert found["Slow.gain"] == bridged.task.gain
    done = plc.write_list_by_name(
        {f"{OVERRIDE}.command_w": 640, FEED: 1, "Slow.gain": 1.5}
    )
    assert done[f"{OVERRIDE}.command_w"] == done["Slow.gain"] == "no error"
    assert done[FEED] != "no error"
    assert bridged.channel.bahn_mc_control.override.command_w == 640
    assert bridged.channel.bahn_state.active_feed_r == 99


def test_external_variables_are_an_array_with_slices(
    bridged: Bridged, plc: Any
) -> None:
    """A slice is a shorter read from an element's offset."""
    plc.write_by_name("gpVEGlobal^[7]", 1234, pyads.PLCTYPE_UDINT)
    assert bridged.cnc.areas.gpVEGlobal.value[7] == 1234
    at = plc.get_symbol("HLI_Global_Variables.gpVEGlobal^[6]")
    three = plc.read(at.index_group, at.index_offset, pyads.PLCTYPE_UDINT * 3)
    assert list(three) == [0, 1234, 0]
    plc.write(
        at.index_group, at.index_offset, [5, 6, 7], pyads.PLCTYPE_UDINT * 3
    )
    assert bridged.cnc.areas.gpVEGlobal.value[6:9] == [5, 6, 7]


def test_cyclic_notifications_lose_nothing(plc: Any) -> None:
    """Their stamps are one cycle apart."""
    stamps: list[Any] = []

    @plc.notification(pyads.PLCTYPE_DINT, timestamp_as_filetime=True)
    def told(handle: int, name: str, stamp: int, value: int) -> None:
        stamps.append(stamp)

    wish = pyads.NotificationAttrib(
        4, constants.ADSTRANS_SERVERCYCLE, cycle_time=2
    )
    handles = plc.add_device_notification(FEED, wish, told)
    until(lambda: len(stamps) > 100)
    plc.del_device_notification(*handles)
    gaps = [b - a for a, b in itertools.pairwise(stamps)]
    assert all(abs(gap - 20_000) < 100 for gap in gaps), gaps


def test_notifications_on_change_come_with_each_change(
    bridged: Bridged, plc: Any
) -> None:
    """Of the HLI and of the PLC; the first one tells the value now."""
    seen: list[tuple[str, Any]] = []
    bridged.channel.bahn_state.active_feed_r = 0

    @plc.notification(pyads.PLCTYPE_DINT)
    def feed(handle: int, name: str, stamp: Any, value: int) -> None:
        seen.append(("feed", value))

    @plc.notification(pyads.PLCTYPE_LREAL)
    def gain(handle: int, name: str, stamp: Any, value: float) -> None:
        seen.append(("gain", value))

    mine = plc.add_device_notification(
        FEED, pyads.NotificationAttrib(4, cycle_time=1), feed
    )
    others = plc.add_device_notification(
        "Slow.gain", pyads.NotificationAttrib(8, cycle_time=1), gain
    )
    until(lambda: {kind for kind, _ in seen} == {"feed", "gain"})
    for value in (1, 2, 3):
        bridged.channel.bahn_state.active_feed_r = value
        until(lambda wanted=value: ("feed", wanted) in seen)  # type: ignore[misc]
    bridged.task.gain = 42.5
    until(lambda: ("gain", 42.5) in seen)
    plc.del_device_notification(*mine)
    plc.del_device_notification(*others)
    assert [v for kind, v in seen if kind == "feed"] == [0, 1, 2, 3]


def test_the_plc_stops_and_runs_again(bridged: Bridged, plc: Any) -> None:
    """STOP leaves the tasks' logic out; what they wrote stands."""
    assert plc.read_state() == (5, 0)
    plc.write_control(pyads.ADSSTATE_STOP, 0, 0, pyads.PLCTYPE_INT)
    assert plc.read_state() == (6, 0)
    scans = bridged.plc.hli.plc.scans
    before = bridged.task.n
    until(lambda: bridged.plc.hli.plc.scans > scans + 2)
    assert bridged.task.n == before
    plc.write_control(pyads.ADSSTATE_RUN, 0, 0, pyads.PLCTYPE_INT)
    until(lambda: bridged.task.n > before)


def test_config_takes_the_devices_away_until_run(
    connect: Callable[[int], Any], plc: Any
) -> None:
    """The cell is not touched."""
    system = connect(10_000)
    system.write_control(pyads.ADSSTATE_RECONFIG, 0, 0, pyads.PLCTYPE_INT)
    assert system.read_state()[0] == pyads.ADSSTATE_CONFIG
    with pytest.raises(pyads.ADSError):
        plc.read_by_name(FEED, pyads.PLCTYPE_DINT)
    system.write_control(pyads.ADSSTATE_RESET, 0, 0, pyads.PLCTYPE_INT)
    assert plc.read_by_name(FEED, pyads.PLCTYPE_DINT) is not None


@pytest.mark.parametrize("port", [550, 551, 552, 553, 851])
def test_every_device_tells_its_name_and_state(
    connect: Callable[[int], Any], port: int
) -> None:
    """PLC and tasks of the CNC."""
    name, version = connect(port).read_device_info()
    assert "CNC" in name or "PLC" in name
    assert version.version == 0
    assert connect(port).read_state() == (5, 0)


def test_objects_of_the_cnc_are_listed_and_read(
    bridged: Bridged, connect: Callable[[int], Any]
) -> None:
    """The list has 84 bytes an object, with its name and its place."""
    com = connect(553)
    bridged.channel.bahn_state.dist_prog_start = 4.5e5
    count = com.read(0x130100, 0, pyads.PLCTYPE_UDINT)
    raw = bytes(com.read(0x130100, 1, pyads.PLCTYPE_BYTE * (84 * count)))
    rows = {
        raw[k + 20 : k + 52].rstrip(b"\0").decode(): raw[k : k + 84]
        for k in range(0, len(raw), 84)
    }
    row = rows["mc_cmd_bs_distance_prog_start_r"]
    group, offset = (int.from_bytes(row[k : k + 4], "little") for k in (12, 16))
    assert com.read(group, offset, pyads.PLCTYPE_LREAL) == 4.5e5
    with pytest.raises(pyads.ADSError):
        com.write(group, offset, 1.0, pyads.PLCTYPE_LREAL)


def test_members_of_the_manual_mode_resolve(bridged: Bridged, plc: Any) -> None:
    """Those that clients of the vendor's interface use; commands arrive."""
    paths = [
        f"{CH}.hb_mc_control.{unit}.{member}"
        for unit in ("activation", "tip_parameter", "key[10]", "rapid_key")
        for member in ("enable_w", "command_w", "command_semaphor_rw")
    ]
    paths += [
        f"{CH}.bahn_state.coord_r[0].hb_display_r.tipp_geschw",
        f"{CH}.hb_mc_control.handwheel_incs[4].command_w",
        "gpAx[0]^.ipo_mc_control.dyn_pos_limit_low.state_r",
        "gpAx[0]^.lr_mc_control.add_cmd_values.command_w.m_add_pos_value",
    ]
    for path in paths:
        assert plc.get_handle(path)
    key = f"{CH}.hb_mc_control.key[10].command_w.direction"
    plc.write_by_name(key, -1, pyads.PLCTYPE_INT)
    assert bridged.channel.hb_mc_control.key[10].command_w.direction == -1


def test_constants_of_the_interface_are_symbols(plc: Any) -> None:
    """Clients ask how long arrays are; nobody writes them."""
    path = "HLI_Global_Constants.HLI_TU_CH_STD_SYNC_MAXIDX"
    assert plc.read_by_name(path) == 19
    assert plc.read_by_name("HLI_HW_MAXIDX", pyads.PLCTYPE_UDINT) == 5
    listed = {symbol.name for symbol in plc.get_all_symbols()}
    assert {path, "HLI_Global_Constants.HLI_TECH_UNIT_CH_MAXIDX"} <= listed
    with pytest.raises(pyads.ADSError) as refused:
        plc.write_by_name(path, 3, pyads.PLCTYPE_UDINT)
    assert refused.value.err_code == 0x704


def test_a_shorter_number_sets_the_low_bytes(
    bridged: Bridged, plc: Any
) -> None:
    """As on a controller: some clients write a handwheel's DINT so."""
    unit = bridged.channel.hb_mc_control.handwheel_incs[0]
    unit.command_w = 0x0102_0304
    path = f"{CH}.hb_mc_control.handwheel_incs[0].command_w"
    plc.write_by_name(path, 0x0506, pyads.PLCTYPE_INT)
    assert unit.command_w == 0x0102_0506


def test_a_structure_may_come_short(bridged: Bridged, plc: Any) -> None:
    """Clients leave out bytes at the end of a command, and read less of it."""
    path = f"{CH}.channel_mc_control.mode_and_state.command_w"
    command = (0, 0, 2, 4, 0, 0)
    raw = b"".join(n.to_bytes(4, "little") for n in command)
    raw = (raw + b"part.nc").ljust(327, b"\0")
    handle = plc.get_handle(path)
    plc.write(0xF005, handle, list(raw), pyads.PLCTYPE_BYTE * len(raw))
    unit = bridged.channel.channel_mc_control.mode_and_state.command_w
    assert (unit.to_mode, unit.to_state) == (2, 4)
    assert unit.parameter == "part.nc"
    short = plc.read(0xF005, handle, pyads.PLCTYPE_BYTE * 40)
    assert bytes(short) == raw[:40]


def test_handles_outlive_the_plc(bridged: Bridged, plc: Any) -> None:
    """Another PLC comes; the same handles read its symbols."""
    gain = plc.get_handle("Slow.gain")
    feed = plc.get_handle(FEED)
    edition = bridged.cell.edition
    bridged.task.gain = 11.0
    bridged.restart_plc()
    until(lambda: bridged.cell.edition > edition)
    until(lambda: bridged.cell.plc_there and "Slow" in bridged.cell.plc)

    def read() -> bool:
        try:
            found = plc.read_by_name("", pyads.PLCTYPE_LREAL, handle=gain)
        except pyads.ADSError:
            return False
        return bool(found == 2.5)

    until(read)
    assert plc.read_by_name("", pyads.PLCTYPE_DINT, handle=feed) is not None
