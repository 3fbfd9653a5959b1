"""The monitor in a real browser, beside a cell with three channels.

The browser is Debian's chromium.  Without it these tests are skipped.  One
cell serves all of them.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import hli
from cnc_core import Cell
from cnc_core.monitor.recorded import Recorded
from hli import orders
from support.browser import CHROMIUM, Browser, Tab
from support.command_line import command
from support.fake_cnc import unique_name
from support.monitor_page import monitor_of
from support.paths import ROOT

IMAGES = ROOT / "docs" / "images"
NAMES = ("mill", "loader", "saw")
PLACES = 300  # to and fro: they drive as long as the tests need
CELL = """cycle_s = 0.004
[channels.mill.axes.X]
[channels.mill.axes.Y]
[channels.loader.axes.X]
[channels.loader.axes.Z]
[channels.saw.axes.Y]
"""
PLC = """
from plc_client import ContourLookahead, task

@task(interval=0.012)
class Asks:
    def setup(self, hli):
        self.units = [ContourLookahead(hli.gpCh[i]) for i in range(3)]

    def cyclic(self):
        for i, unit in enumerate(self.units):
            unit(start_position=0.0, length=1e5 * (i + 1))
"""
FIGURES = {
    "mill": (
        "N{n} G01 X60 Y0 F3000\nN{m} G03 X60 Y30 I0 J15\n"
        "N{k} G01 X0\nN{l} X0 Y0\n"
    ),
    "loader": "N{n} G01 X400 Z80 F9000\nN{m} X0 Z0\n",
    "saw": "N{n} G01 Y250 F1200\nN{m} Y0 F6000\n",
}
CONTROL = "gpCh[{}]^.bahn_mc_control"

pytestmark = [
    pytest.mark.ci,
    pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed"),
]


def text_of(channel: str, passes: int = PLACES) -> str:
    """A program of the channel that is its own to look at."""
    figure = FIGURES[channel]
    each = (
        figure.format(
            n=40 * i + 10, m=40 * i + 20, k=40 * i + 30, l=40 * i + 40
        )
        for i in range(passes)
    )
    return "".join(each) + "M30\n"


def choose(tab: Tab, channel: int) -> None:
    """Choose a channel of the list, as a person does."""
    tab.js(
        f"(s => {{ s.value = '{channel}'; s.dispatchEvent(new Event('change')) "
        "})(document.querySelector('#channel'))"
    )


@dataclass
class Shown:
    """A cell, a tab at its page."""

    name: str
    address: str
    tab: Tab

    def read(self, path: str) -> Any:
        """What ``hli-cosim read`` shows."""
        order = {"do": "read", "symbols": [path]}
        return orders.send(self.name, order)["values"][path]

    def state(self, channel: int, member: str) -> float:
        """A member of ``bahn_state``."""
        return float(self.read(f"gpCh[{channel}].bahn_state.{member}"))

    def level(self, channel: int, unit: str) -> float:
        """What the CNC uses of a level unit."""
        return float(self.read(f"{CONTROL.format(channel)}.{unit}.state_r"))

    def choose(self, channel: int, program: str = "") -> None:
        """As a person does; then its values are there."""
        choose(self.tab, channel)
        self.shows(channel, program)

    def shows(self, channel: int, program: str = "") -> None:
        """Until the page has values and the program of a channel."""
        name = program or f"{NAMES[channel]}.nc"
        self.tab.until(
            f"machine.channels.index === {channel}"
            " && !document.querySelector('#set-feedhold').disabled"
            f" && document.querySelector('#program-name').innerText"
            f" === '{name}' && machine.path.trail.length > 3"
        )

    def events(self) -> str:
        return self.tab.text("#event-rows")


@pytest.fixture(scope="module")
def shown(
    tmp_path_factory: pytest.TempPathFactory, browser: Browser
) -> Iterator[Shown]:
    """Three channels in real time, beside a PLC that asks each for its contour."""
    folder = tmp_path_factory.mktemp("channels")
    (folder / "cell.toml").write_text(CELL)
    (folder / "asks.py").write_text(PLC)
    files = [folder / f"{name}.nc" for name in NAMES]
    for file in files:
        file.write_text(text_of(file.stem))
    name = unique_name()
    cell = folder / "cell.toml"
    commands = (
        command("cnc", *files, "--cell", cell, "--name", name),
        command("plc", folder / "asks.py", "--name", name),
        command("monitor", name, "--port", 0),
    )
    processes: list[subprocess.Popen[str]] = []
    try:
        for words in commands:
            pipe = subprocess.PIPE if "monitor" in words else None
            quiet = subprocess.DEVNULL
            processes.append(
                subprocess.Popen(words, stdout=pipe, stderr=quiet, text=True)
            )
        told = processes[-1].stdout
        assert told is not None
        yield Shown(name, told.readline().strip(), browser.tab())
    finally:
        for process in processes:
            process.terminate()
            process.communicate()
        hli.sweep()


@pytest.fixture
def page(shown: Shown) -> Iterator[Shown]:
    """The page, open and live, at the first channel; nothing is held behind it."""
    tab = shown.tab
    tab.size(1400, 1500)
    tab.said.clear()
    tab.go(shown.address)
    tab.until("!document.querySelector('#channel-choice').hidden")
    tab.until("document.querySelector('#channel').options[2].text === 'saw'")
    shown.shows(0)
    yield shown
    orders.send(shown.name, {"do": "unforce", "symbols": []})


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_every_view_is_of_the_chosen_channel(page: Shown, channel: int) -> None:
    """Numbers, axes, program, contour and path are those of this channel in the
    HLI; each heading names it.
    """
    tab = page.tab
    if channel:
        page.choose(channel)
    axes = ("XY", "XZ", "Y")[channel]
    rows = "[...document.querySelectorAll('#axis-rows tr')]"
    tab.until(f"{rows}.map(r => r.cells[0].innerText).join('') === '{axes}'")
    before = page.state(channel, "dist_prog_start") * 1e-4
    driven = (
        "(v => v > {} && v)(parseFloat([...document.querySelectorAll("
        "'#number-rows tr')][3].cells[1].innerText))"
    )
    seen = float(tab.until(driven.format(before)))
    assert before < seen <= page.state(channel, "dist_prog_start") * 1e-4 + 1e-3
    asked = f"mode 2, {10 * (channel + 1)}.000 mm from 0.000 mm"
    tab.until(
        f"document.querySelector('#contour-asked').innerText.includes('{asked}')"
    )
    length = tab.js("Math.max(...machine.path.route.map(p => p[3]))")
    assert length > 1000.0
    tab.until("!!document.querySelector('#program-lines .now')")
    now = str(tab.js("document.querySelector('#program-lines .now').innerText"))
    assert now.split("N")[1].split(" ", 1)[1] in text_of(NAMES[channel])
    for head in ("panel", "path", "numbers", "contour", "functions", "story"):
        assert f"({NAMES[channel]})" in tab.text(f"#{head}-head")
    assert tab.js("machine.scope.paths[0]").startswith(f"gpCh[{channel}].")
    assert tab.said == []
    if channel == 0 and os.environ.get("HLI_COSIM_GOLDEN") == "write":
        shot = Path(os.environ.get("HLI_COSIM_SHOTS", IMAGES))
        tab.until("machine.scope.t.length > 400")
        tab.until("document.querySelector('#status').innerText === 'live'")
        tab.screenshot(shot / "monitor_channels.png")


def test_keys_of_the_panel_act_on_the_chosen_channel_alone(page: Shown) -> None:
    """Override and feed hold of the second one; the others drive on as they did;
    who did what on which channel stands in the events.
    """
    tab = page.tab
    page.choose(1)
    tab.js("document.querySelector('#who').value = 'Ada'")
    tab.js(
        "(s => { s.value = 30; s.dispatchEvent(new Event('change')) })"
        "(document.querySelector('#set-override'))"
    )
    tab.until(
        "/30.0 %/.test(document.querySelector('#state-override').innerText)"
    )
    assert [page.level(i, "override") for i in range(3)] == [1000, 300, 1000]
    tab.click("#set-feedhold")
    tab.until(
        "/feed hold/.test(document.querySelector('#story-cnc').innerText)"
    )
    assert [page.level(i, "feedhold") for i in range(3)] == [0, 1, 0]
    stood = page.state(1, "dist_prog_start")
    others = [page.state(i, "dist_prog_start") for i in (0, 2)]
    time.sleep(0.2)
    assert page.state(1, "dist_prog_start") == stood
    for i, before in zip((0, 2), others, strict=True):
        assert page.state(i, "dist_prog_start") > before
    told = [row for row in page.events().splitlines() if "Ada (page" in row]
    assert any("channel loader: override 30" in row for row in told)
    assert any("channel loader: feedhold true" in row.lower() for row in told)
    page.choose(0)
    assert tab.text("#state-override") == "100.0 %"
    assert "held here" not in tab.text("#panel-state")
    assert tab.js("document.querySelector('#release-feedhold').disabled")
    page.choose(1)
    tab.until("!document.querySelector('#release-feedhold').disabled")
    tab.click("#release-feedhold")
    tab.click("#release-override")
    tab.until("document.querySelector('#release-override').disabled")
    assert [page.level(i, "override") for i in range(3)] == [1000, 1000, 1000]


def test_commands_and_mdi_reach_the_chosen_channel(page: Shown) -> None:
    """The saw is aborted, reset, driven by MDI and started again; the mill and
    the loader never leave their programs.
    """
    tab = page.tab
    page.choose(2)
    state = "document.querySelector('#panel-state').innerText"
    for key in ("abort", "reset"):
        tab.click(f"#do-{key}")
        tab.until(f"/{key}: done/.test({state})")
    tab.js("document.querySelector('#mdi').value = 'G01 Y-7 F6000'")
    tab.js("document.querySelector('#mdi-form').requestSubmit()")
    axes = "document.querySelector('#axis-rows').innerText"
    tab.until(f"/Y\\s*-7.0000 mm/.test({axes})")
    name = "document.querySelector('#program-name').innerText"
    block = str(tab.until(f"{name} !== 'saw.nc' && {name}"))
    numbers = "document.querySelector('#number-rows').innerText"
    for channel in (0, 1):
        page.choose(channel)
        tab.until(f"/automatic, active/.test({numbers})")
    page.choose(2, block)
    tab.js("document.querySelector('#start-program').value = 'saw.nc'")
    tab.click("#do-start")
    tab.until(f"/automatic, active/.test({numbers})")
    assert "channel saw: mdi G01 Y-7 F6000" in page.events()


def test_the_selector_serves_keyboard_and_screen_reader(page: Shown) -> None:
    """A labelled list in the head: its keys choose, and its name is told."""
    tab = page.tab
    tab.js("document.querySelector('#channel').focus()")
    tab.key("ArrowDown")
    page.shows(1)
    assert tab.js("document.activeElement.id") == "channel"
    nodes = tab.do("Accessibility.getFullAXTree")["nodes"]
    found = [
        (node["role"]["value"], node.get("value", {}).get("value"))
        for node in nodes
        if node.get("name", {}).get("value") == "channel"
    ]
    assert ("combobox", "loader") in found
    tab.size(390, 844, phone=True)
    tab.until("innerWidth === 390")
    assert tab.js("document.documentElement.scrollWidth") == 390
    assert tab.js("document.querySelector('#channel').offsetWidth") > 20


def test_the_cnc_tells_how_far_each_channel_is(page: Shown) -> None:
    """Its name and the line that was read last, also on the page."""
    order = {"do": "look", "since": 0}
    told = orders.send(page.name, order, side=orders.CNC)["prepared"]
    assert [one["name"] for one in told["channels"]] == [*NAMES]
    for channel in (1, 2):
        page.choose(channel)
        page.tab.until("!!document.querySelector('#program-lines .reached')")
        read = int(page.tab.js("machine.program.reached"))
        assert read >= told["channels"][channel]["line"] > 0


def test_a_recording_has_its_channels_and_its_contour(
    shown: Shown, tmp_path: Path
) -> None:
    """The list of channels changes every view at the same time of the run; the
    contour table is that of the last request, as the recording holds it.
    """
    tab, target = shown.tab, tmp_path / "run.arrow"
    (tmp_path / "cell.toml").write_text(CELL)
    (tmp_path / "asks.py").write_text(PLC)
    files = [tmp_path / f"{name}.nc" for name in NAMES]
    for file in files:
        file.write_text(text_of(file.stem, passes=1))
    with Cell(tmp_path / "cell.toml") as cell:
        plc = tmp_path / "asks.py"
        cell.run(files, plc=plc, record=target).check()
    served = Recorded([target])
    tab.said.clear()
    with monitor_of(target) as address:
        tab.go(address)
        tab.until("player.columns && player.columns.t.length > 0")
        tab.js(
            "(m => { m.value = 1.5; m.dispatchEvent(new Event('input')) })"
            "(document.querySelector('#moment'))"
        )
        for channel, name in enumerate(NAMES):
            choose(tab, channel)
            tab.until(f"player.found.channel === '{name}'")
            time_s = float(tab.js("player.at"))
            assert time_s == pytest.approx(1.5, abs=0.01)
            wanted = served.contour("run.arrow", name, time_s)
            asked = f"mode 2, {10 * (channel + 1)}.000 mm from"
            text = "document.querySelector('#contour-asked').innerText"
            tab.until(f"{text}.includes('{asked}')")
            rows = "document.querySelectorAll('#contour-rows tr').length"
            assert wanted["elements"]
            tab.until(f"{rows} === {len(wanted['elements'])}")
            assert f"({name})" in tab.text("#contour-head")
            assert tab.js("player.found.program") == f"{name}.nc"
        assert tab.said == []
