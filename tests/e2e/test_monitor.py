"""The monitor in a real browser, beside a real cell.

The browser is Debian's chromium.  Without it these tests are skipped.  One
browser and one cell serve all of them.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

import hli
from cnc_core import Cell
from cnc_core.commands.demo_run import demo_program
from hli import orders
from support.browser import CHROMIUM, Browser, Tab
from support.command_line import command
from support.fake_cnc import unique_name
from support.monitor_page import monitor_of
from support.paths import ROOT

IMAGES = ROOT / "docs" / "images"
CELL = (ROOT / "cnc_core" / "data" / "cell.toml").read_text()
CYCLE_S = 0.004  # a quarter of the work, for a machine that tests beside
WAIT_S = 30.0
PASSES = 60  # of the bundled part: it drives as long as the tests need
OVERRIDE = "HLI_Global_Variables.gpCh[0]^.bahn_mc_control.override.command_w"

pytestmark = [
    pytest.mark.ci,
    pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed"),
]


@dataclass
class Shown:
    """A cell, its monitor and a tab."""

    name: str
    address: str
    tab: Tab
    late: Path  # a recording that is not there yet
    processes: dict[str, subprocess.Popen[str]]
    start: Callable[[str], None]

    def end(self, which: str, number: int = signal.SIGKILL) -> None:
        process = self.processes[which]
        process.send_signal(number)
        process.communicate()

    def read(self, path: str) -> float:
        """What ``hli-cosim read`` shows."""
        order = {"do": "read", "symbols": [path]}
        return float(orders.send(self.name, order)["values"][path])


@pytest.fixture(scope="module")
def shown(
    tmp_path_factory: pytest.TempPathFactory, browser: Browser
) -> Iterator[Shown]:
    """The bundled part beside the PLC of the demo, in real time."""
    folder = tmp_path_factory.mktemp("monitor")
    part = folder / "part.nc"
    part.write_text(demo_program(PASSES))
    cell = folder / "cell.toml"
    cell.write_text(CELL.replace("cycle_s = 0.001", f"cycle_s = {CYCLE_S}"))
    assert str(CYCLE_S) in cell.read_text()
    name = unique_name()
    plc = "-P -m plc_client --builtin demo --name"
    late = folder / "late.arrow"
    commands = {
        "cnc": command("cnc", part, "--config", cell, "--name", name),
        "plc": [sys.executable, *plc.split(), name],
        "monitor": command("monitor", name, "--port", 0, "--recording", late),
    }
    processes: dict[str, subprocess.Popen[str]] = {}

    def start(which: str) -> None:
        processes[which] = subprocess.Popen(
            commands[which],
            stdout=subprocess.PIPE if which == "monitor" else None,
            stderr=subprocess.DEVNULL,
            text=True,
        )

    try:
        for which in commands:
            start(which)
        told = processes["monitor"].stdout
        assert told is not None
        address = told.readline().strip()
        yield Shown(name, address, browser.tab(), late, processes, start)
    finally:
        for process in processes.values():
            if process.returncode is None:
                process.terminate()
                process.communicate()
        hli.sweep()


@pytest.fixture
def page(shown: Shown) -> Shown:
    """The page of the cell, open and live; no error on its console."""
    shown.tab.size(1400, 1500)
    shown.tab.said.clear()
    shown.tab.go(shown.address)
    shown.tab.until("document.querySelector('#status').innerText === 'live'")
    shown.tab.until("document.querySelectorAll('#axis-rows tr').length === 3")
    return shown


def test_the_page_tells_what_happens(page: Shown) -> None:
    """CNC, PLC's sight and its deed in words; path, program and scope are drawn;
    the token is gone from the address bar.
    """
    tab = page.tab
    tab.until(
        "machine.path.route.length > 50 && machine.path.trail.length > 20"
    )
    tab.until("!!document.querySelector('#program-lines .now')")
    tab.until("machine.scope.t.length > 50")
    assert re.search(r"drives|stands", tab.text("#story-cnc"))
    assert "mm of contour ahead" in tab.text("#story-sees")
    assert "override" in tab.text("#story-did")
    assert "token" not in str(tab.js("location.href"))
    tab.until("document.querySelectorAll('#task-rows tr').length > 0")
    tab.until("/requests, over a scan/.test(document.body.innerText)")
    tab.until("machine.latency.raw && machine.latency.raw.n > 0")
    assert "raw exchange" in tab.text("#latency-text")
    assert tab.said == []
    shot = Path(os.environ.get("HLI_COSIM_SHOTS", IMAGES))
    if os.environ.get("HLI_COSIM_GOLDEN") == "write":
        tab.screenshot(shot / "monitor.png")


def test_numbers_are_young_and_those_of_the_hli(page: Shown) -> None:
    """The distance on the page lies between two readings of the memory."""
    path = "gpCh[0].bahn_state.dist_prog_start"
    page.tab.js(f"machine.watch.add('{path}')")
    page.tab.until(f"machine.watch.rows.get('{path}').innerText !== '-'")
    before = page.read(path)
    shown = float(
        page.tab.until(
            f"(v => v > {before} && v)(Number("
            f"machine.watch.rows.get('{path}').innerText))"
        )
    )
    assert before < shown <= page.read(path)
    page.tab.until(
        "document.querySelector('#age').innerText === 'age below 0.2 s'"
    )
    page.tab.js(f"machine.watch.remove('{path}')")


def test_an_operator_acts_through_the_plc(page: Shown) -> None:
    """The override is forced in the PLC, shown, told with a name, released."""
    tab = page.tab
    tab.js("document.querySelector('#who').value = 'Ada'")
    tab.js(
        "(s => { s.value = 42; s.dispatchEvent(new Event('change')) })"
        "(document.querySelector('#set-override'))"
    )
    tab.until(
        "/42.0 %/.test(document.querySelector('#state-override').innerText)"
    )
    assert page.read(OVERRIDE) == 420
    row = (
        "[...document.querySelectorAll('#event-rows tr')].map(r => r.innerText)"
    )
    told = str(tab.until(f"{row}.find(t => /override 42/.test(t))"))
    assert "Ada (page" in told
    tab.until("!document.querySelector('#release-override').disabled")
    tab.click("#release-override")
    tab.until("document.querySelector('#release-override').disabled")
    answer = orders.send(page.name, {"do": "list"})
    assert answer["forced"] == {}


def test_a_symbol_is_forced_and_let_go_with_the_page(page: Shown) -> None:
    """``hli-cosim read`` sees the value; closing the page releases it."""
    tab, path = page.tab, "gpCh[0].bahn_mc_control.rapid_override.command_w"
    tab.js(f"machine.watch.add('{path}')")
    tab.js(
        "(r => { r.querySelector('input').value = '770';"
        " r.querySelector('button').click() })"
        "(document.querySelector('#watch-rows tr'))"
    )
    tab.until("/= 770/.test(document.querySelector('#forced-rows').innerText)")
    assert page.read(path) == 770
    tab.js(f"machine.watch.remove('{path}')")
    tab.go("about:blank")
    end = time.monotonic() + WAIT_S
    while orders.send(page.name, {"do": "list"})["forced"]:
        assert time.monotonic() < end
        time.sleep(0.05)


def test_keys_alone_do_everything(page: Shown) -> None:
    """Tab reaches each control, which has a name; Enter holds the feed."""
    tab = page.tab
    nameless = (
        "[...document.querySelectorAll('button, input, select')].filter(e =>"
        " !e.innerText.trim() && !e.ariaLabel && !(e.labels || []).length)"
        ".map(e => e.outerHTML)"
    )
    assert tab.js(nameless) == []
    tab.js("document.querySelector('#who').focus()")
    for _ in range(8):
        tab.key("Tab")
        if tab.js("document.activeElement.id") == "set-feedhold":
            break
    assert tab.js("document.activeElement.id") == "set-feedhold"
    tab.key("Enter")
    tab.until(
        "/feed hold/.test(document.querySelector('#story-cnc').innerText)"
    )
    tab.until("!document.querySelector('#release-feedhold').disabled")
    tab.key("Tab")
    assert tab.js("document.activeElement.id") == "release-feedhold"
    tab.key("Enter")
    tab.until("document.querySelector('#release-feedhold').disabled")
    yaw = tab.js("machine.path.yaw")
    tab.js("document.querySelector('#path-canvas').focus()")
    tab.key("ArrowRight")
    assert tab.js("machine.path.yaw") != yaw


def told(tab: Tab, text: str) -> None:
    """Wait until the machine's numbers say so."""
    tab.until(
        f"/{text}/.test(document.querySelector('#number-rows').innerText)"
    )


def pressed(tab: Tab, key: str) -> None:
    """Press a key of the panel; the PLC does it."""
    tab.click(f"#do-{key}")
    state = "document.querySelector('#panel-state').innerText"
    tab.until(f"/{key}: (?!busy)|not|refused/.test({state})")
    assert f"{key}: done" in tab.text("#panel-state")


def test_the_keys_of_the_panel(page: Shown) -> None:
    """Single block and continue, stop and resume, reset, MDI, start: the PLC
    does it, and the CNC's state follows.
    """
    tab = page.tab
    tab.click("#set-single_block")
    told(tab, "single block")
    distance = "gpCh[0].bahn_state.dist_prog_start"
    stood = page.read(distance)
    pressed(tab, "continue")
    deadline = time.monotonic() + WAIT_S
    while page.read(distance) == stood:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    told(tab, "single block")
    pressed(tab, "abort")
    pressed(tab, "reset")
    tab.click("#release-single_block")
    tab.until("document.querySelector('#release-single_block').disabled")
    tab.js("document.querySelector('#mdi').value = 'G01 X1 F2000'")
    tab.js("document.querySelector('#mdi-form').requestSubmit()")
    state = "document.querySelector('#panel-state').innerText"
    tab.until(f"/mdi: done/.test({state})")
    axes = "document.querySelector('#axis-rows').innerText"
    tab.until(f"/X\\s*1.0000 mm/.test({axes})")
    pressed(tab, "start")
    told(tab, "automatic, active")
    pressed(tab, "stop")
    told(tab, "automatic, hold")
    pressed(tab, "resume")
    told(tab, "automatic, active")
    events = tab.text("#event-rows")
    for what in ("stop", "resume", "reset", "mdi G01 X1 F2000"):
        assert what in events


def test_a_start_that_fails_says_why(page: Shown) -> None:
    """A program that is not there: the panel has the CNC's words at once."""
    tab = page.tab
    pressed(tab, "abort")
    pressed(tab, "reset")
    tab.js("document.querySelector('#start-program').value = 'missing.nc'")
    tab.click("#do-start")
    state = "document.querySelector('#panel-state').innerText"
    tab.until(f"/start: .*missing.nc not found/.test({state})")
    tab.until(
        f"/start: error .error 901001: there is no such program/.test({state})"
    )
    assert "missing.nc not found" in tab.text("#event-rows")
    pressed(tab, "reset")
    tab.js("document.querySelector('#start-program').value = 'part.nc'")
    pressed(tab, "start")
    told(tab, "automatic, active")
    tab.js("document.querySelector('#start-program').value = ''")


def test_the_scope_stops_at_its_edge_and_is_saved(page: Shown) -> None:
    """A trigger stops it behind the edge; the cursor reads a row; CSV has all."""
    tab = page.tab
    tab.js("machine.scope.add('gpCh[0].bahn_state.dist_prog_start')")
    tab.until("machine.scope.values.length === 3 && machine.scope.t.length > 9")
    tab.js(
        "(s => { const v = s.values[2]; const now = v[v.length - 1];"
        " document.querySelector('#trigger-symbol').value = s.paths[2];"
        " document.querySelector('#trigger-level').value = now + 10000;"
        " document.querySelector('#scope-span').value = '5';"
        " s.arm(true) })(machine.scope)"
    )
    tab.until("machine.scope.paused")
    at = (
        "machine.scope.values[2][machine.scope.t.indexOf(machine.scope.edgeAt)]"
    )
    level = "Number(document.querySelector('#trigger-level').value)"
    assert tab.js(f"{at} > {level}")
    count = tab.js("machine.scope.t.length")
    tab.js("machine.scope.plots[0].setCursor({left: 40, top: 20})")
    tab.until(
        "/behind the edge/.test("
        "document.querySelector('#scope-readout').innerText)"
    )
    tab.js(
        "window.saved = null; URL.createObjectURL = (b) => {"
        " b.text().then(t => { saved = t }); return 'blob:none' };"
        " HTMLAnchorElement.prototype.click = () => {};"
        " document.querySelector('#scope-csv').click()"
    )
    rows = str(tab.until("window.saved")).splitlines()
    assert rows[0].startswith("t,gpCh[0].bahn_state.active_feed_r,")
    assert len(rows) == 1 + int(count)
    tab.js("machine.scope.remove('gpCh[0].bahn_state.dist_prog_start')")


OUTSIDE = """machine.path.route.map(p => machine.path.project(...p))
.filter(([x, y]) => x < 0 || y < 0 || x > machine.path.canvas.clientWidth
|| y > machine.path.canvas.clientHeight).length"""
OVERLAPS = """[...document.querySelectorAll('td.n')].filter(e =>
e.clientWidth && e.scrollWidth > e.clientWidth + 1).map(e => e.outerHTML)"""


def test_a_phone_shows_it_whole(page: Shown) -> None:
    """390 px wide: nothing is wider than the screen, the path fits its canvas,
    no number runs into the next one.
    """
    tab = page.tab
    tab.size(390, 844, phone=True)
    tab.until("innerWidth === 390")
    assert tab.js("document.documentElement.scrollWidth") == 390
    wide = (
        "[...document.querySelectorAll('section')].filter(s =>"
        " s.getBoundingClientRect().right > 391).map(s => s.id)"
    )
    assert tab.js(wide) == []
    tab.until(f"({OUTSIDE}) === 0")
    tab.until("document.querySelectorAll('#contour-rows tr').length > 0")
    assert tab.js(OVERLAPS) == []
    if os.environ.get("HLI_COSIM_GOLDEN") == "write":
        tab.size(390, 1200, phone=True)
        tab.screenshot(IMAGES / "monitor_phone.png")


CONTROLS = {
    "button", "textbox", "searchbox", "slider", "spinbutton", "combobox",
    "checkbox", "link", "meter", "image", "listbox",
}  # fmt: skip


def test_a_screen_reader_names_every_control(page: Shown) -> None:
    """In the browser's own accessibility tree, with the tree of the HLI open and
    a symbol watched.
    """
    tab = page.tab
    tab.js(f"machine.watch.add('{OVERRIDE}')")
    tab.js(
        "document.querySelectorAll('#tree-root summary, #tree-root button')"
        ".forEach((each, i) => { if (i < 3) each.click() })"
    )
    tab.until("document.querySelectorAll('#watch-rows tr').length > 0")
    nodes = tab.do("Accessibility.getFullAXTree")["nodes"]
    found = [
        (each["role"]["value"], each.get("name", {}).get("value", "").strip())
        for each in nodes
        if not each["ignored"]
    ]
    seen = {role for role, _ in found}
    assert {"button", "slider", "textbox", "combobox", "meter"} <= seen
    assert [role for role, name in found if role in CONTROLS and not name] == []
    names = [name for role, name in found if role == "button"]
    assert "release" not in names, "which one of the levels?"


def test_without_a_name_the_cells_are_listed(
    shown: Shown, browser: Browser
) -> None:
    """``monitor`` alone lists the cells of this user; a click opens one."""
    process = subprocess.Popen(
        command("monitor", "--port", 0), stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        tab = browser.tab()
        tab.go(process.stdout.readline().strip())
        rows = "[...document.querySelectorAll('#cells-rows tr')]"
        row = f"{rows}.find(r => /{shown.name}/.test(r.innerText))"
        tab.until(f"!!({row})")
        assert "part.nc" in str(tab.js(f"({row}).innerText"))
        tab.js(f"({row}).querySelector('a, button').click()")
        tab.until("document.querySelector('#status').innerText === 'live'")
        assert tab.text("#title") == shown.name
    finally:
        process.terminate()
        process.communicate()


def test_a_wrong_token_sees_and_does_nothing(shown: Shown) -> None:
    """The address is refused; the page asks for a token and takes no wrong one."""
    tab = shown.tab
    base = shown.address.partition("#")[0]
    tab.go(f"{base}?token=wrong")
    assert tab.text("body").strip() == "the token is wrong"
    tab.go(f"{base}#token=wrong")
    tab.until("!document.querySelector('#login').hidden")
    assert "wrong" not in str(tab.js("location.href"))
    tab.go(base)
    tab.js("sessionStorage.clear()")
    tab.go(base)
    tab.until("!document.querySelector('#login').hidden")
    tab.js("document.querySelector('#token').value = 'wrong'")
    tab.click("#login-form button")
    tab.until(
        "/token/.test(document.querySelector('#login-problem').innerText)"
    )
    assert tab.js("document.querySelector('#machine').hidden")


def test_the_token_is_in_no_address_that_the_server_sees(shown: Shown) -> None:
    """Neither of the page nor of what it loads and opens; the page has it all
    the same.  A token in the query, as it was printed earlier, serves, too.
    """
    tab = shown.tab
    base, _, token = shown.address.partition("#token=")
    tab.go("about:blank")
    tab.do("Network.enable")
    tab.asked.clear()
    tab.go(shown.address)
    tab.until("document.querySelector('#status').innerText === 'live'")
    tab.do("Network.disable")
    assert any("/api/live" in address for address in tab.asked)
    assert any("/api/start" in address for address in tab.asked)
    sent = [address.partition("#")[0] for address in tab.asked]
    assert [address for address in sent if token in address] == []
    assert token not in str(tab.js("location.href"))
    tab.js("sessionStorage.clear()")
    tab.go(f"{base}?token={token}")
    tab.until("document.querySelector('#status').innerText === 'live'")
    assert token not in str(tab.js("location.href"))


def test_another_site_reaches_nothing(shown: Shown, tmp_path: Path) -> None:
    """A page of a foreign origin gets neither an answer nor a stream."""
    tab = shown.tab
    foreign = tmp_path / "foreign.html"
    foreign.write_text("<title>foreign</title>")
    tab.go(foreign.as_uri())
    base, _, token = shown.address.partition("/#token=")
    asked = (
        f"fetch('{base}/api/cells', {{headers: {{authorization:"
        f" 'Bearer {token}'}}}}).then(() => 'read', () => 'refused')"
    )
    assert tab.js(asked) == "refused"
    live = base.replace("http", "ws")
    stream = (
        f"new Promise(r => {{ const s = new WebSocket('{live}/api/live?cell="
        f"{shown.name}'); s.onopen = () => r('open'); s.onerror = () =>"
        " r('refused') })"
    )
    assert tab.js(stream) == "refused"


def test_a_recording_has_a_slider(shown: Shown, tmp_path: Path) -> None:
    """The same views at any time of the run, by the slider and by its keys."""
    tab, target = shown.tab, tmp_path / "run.arrow"
    tab.said.clear()
    part = tmp_path / "part.nc"
    part.write_text(
        "N10 G01 X50 F6000\nN20 G02 X60 Y10 I0 J10\nN30 G01 Y40\nM30\n"
    )
    with Cell() as cell:
        result = cell.run(part, record=target)
    assert result.end == "completed", result.errors
    with monitor_of(target) as address:
        tab.go(address)
        tab.until("!!player.columns")
        assert re.search(r"stands at|drives N10", tab.text("#story-cnc"))
        tab.js(
            f"(m => {{ m.value = {result.sim_time_s / 2}; m.dispatchEvent("
            "new Event('input')) })(document.querySelector('#moment'))"
        )
        assert "drives N" in tab.text("#story-cnc")
        tab.js("document.querySelector('#moment').focus()")
        before = float(tab.js("player.at"))
        tab.key("ArrowRight")
        assert float(tab.js("player.at")) > before
        now = "document.querySelector('#program-lines .now').textContent"
        assert "N" in str(tab.js(now))
        assert tab.said == []


def test_a_killed_cnc_is_told_and_its_return_shown(page: Shown) -> None:
    """The last test: the CNC dies and comes back under its name."""
    tab = page.tab
    page.end("cnc")
    tab.until(
        "/the CNC has died/.test(document.querySelector('#status').innerText)"
    )
    tab.until("/values are old/.test(document.querySelector('#age').innerText)")
    assert tab.text("#links") == ""
    page.late.write_bytes(b"")  # written behind the end of its run
    tab.until("/late.arrow/.test(document.querySelector('#links').innerText)")
    page.start("cnc")
    tab.until("document.querySelector('#status').innerText === 'live'")
    told = tab.text("#event-rows")
    assert "the CNC is there again" in told
    page.end("plc")
    tab.until(
        "/the PLC is gone/.test(document.querySelector('#event-rows').innerText)"
    )
    tab.until("document.querySelector('#set-feedhold').disabled")
    page.start("plc")
    tab.until("!document.querySelector('#set-feedhold').disabled")
    assert "the PLC is there" in tab.text("#event-rows")


def test_a_server_that_is_gone_is_told(page: Shown) -> None:
    """And its page waits for it."""
    page.end("monitor", signal.SIGTERM)
    assert page.processes["monitor"].returncode == 128 + signal.SIGTERM
    page.tab.until(
        "/server is gone/.test(document.querySelector('#status').innerText)"
    )
