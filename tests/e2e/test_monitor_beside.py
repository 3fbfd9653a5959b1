"""Commands that start the monitor themselves: its page in a real browser.

The browser is Debian's chromium.  Without it these tests are skipped.
"""

from __future__ import annotations

import json
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from cnc_core import Recording
from support.browser import Browser, Tab
from support.command_line import command
from support.monitor_page import monitor_of
from support.seeds import few

pytestmark = pytest.mark.ci

LIVE = "document.querySelector('#status').innerText === 'live'"
DIALOG = (
    'G1X2F6000\nLIB_MESSAGE "Is the part clamped?" "Clamping" 1 3\n'
    "$A=$_X13\n"
    'LIB_FORMTEXT "Tool data"\nLIB_ADDINPUT R\nLIB_INPUTPROP R DEST $P\n'
    "LIB_ADDBUTTON DONE\nLIB_BUTTONPROP DONE CLOSEFORM 1\nLIB_SHOWFORM\n"
    "G1X[$A*10+$P]\n"
)

# the built-in PLC of ``run`` continues every stop by itself
LEAVES_STOPS = """from plc_client import AcknowledgeAll, task


@task(interval=0.001)
class Plc:
    def setup(self, hli):
        self.functions = AcknowledgeAll(hli)

    def cyclic(self):
        self.functions()
"""


@contextmanager
def started(
    *words: object, cwd: Path
) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A command, and the address that it prints."""
    process = subprocess.Popen(
        command(*words),
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith("monitor: "):
                break
        yield process, line.removeprefix("monitor: ").strip()
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)


def event(tab: Tab, text: str) -> str:
    """The row of the events that holds a text, once it is there."""
    rows = "[...document.querySelectorAll('#event-rows tr')]"
    return str(
        tab.until(f"{rows}.map(r => r.innerText).find(t => /{text}/.test(t))")
    )


def test_a_program_is_answered_on_the_page(
    browser: Browser, tmp_path: Path
) -> None:
    """``run --monitor``: a message and a form wait for the page; what was
    entered moves the axis; all of it stands in the events with who did it.
    """
    part = tmp_path / "part.isons"
    part.write_text(DIALOG)
    words = ("run", part, "--clock", "realtime", "--monitor", "--json")
    tab = browser.tab()
    with started(*words, "--record", "r.arrow", cwd=tmp_path) as (
        process,
        address,
    ):
        tab.go(address)
        tab.until("!document.querySelector('#dialog').hidden")
        assert "Clamping" in tab.text("#dialog-head")
        assert "Is the part clamped?" in tab.text("#dialog-text")
        assert tab.js("document.activeElement.id") == "dialog"
        tab.key("Tab")
        assert tab.text("#dialog-buttons button:focus") == "YES"
        tab.key("Enter")
        tab.until("!!document.querySelector('#dialog-input-R')")
        tab.js("document.querySelector('#dialog-input-R').value = 4.5")
        tab.js("document.querySelector('#dialog-buttons button').click()")
        assert process.wait(60) == 0
        assert process.stdout is not None
        result = json.loads(process.stdout.read())
    assert result["end"] == "completed"
    assert "FORM Tool data closed" in result["messages"]
    assert Recording(tmp_path / "r.arrow").cycles["X"][-1] == 14.5


KEYS = [
    ("reset", "realtime"),
    ("reset", "lockstep"),
    ("abort", "freerun"),
    ("abort", "realtime"),
]


@pytest.mark.parametrize(("key", "clock"), few(KEYS, 2))
def test_a_key_ends_a_program_that_asks(
    browser: Browser, tmp_path: Path, key: str, clock: str
) -> None:
    """Reset and abort while a dialog is open: it closes, and the program ends
    without an error of its own.  In virtual time no cycle runs beside a dialog
    but those that the command needs.
    """
    part = tmp_path / "part.isons"
    part.write_text(DIALOG)
    words = ("run", part, "--clock", clock, "--monitor", "--json")
    tab = browser.tab()
    with started(*words, cwd=tmp_path) as (process, address):
        tab.go(address)
        tab.until("!document.querySelector('#dialog').hidden")
        tab.until(f"!document.querySelector('#do-{key}').disabled")
        tab.click(f"#do-{key}")
        assert process.wait(60) == 1
        assert process.stdout is not None
        result = json.loads(process.stdout.read())
    assert result["end"] == "aborted"
    assert [error["code"] for error in result["errors"]] == [905023]


def test_the_page_goes_on_behind_a_programmed_stop(
    browser: Browser, tmp_path: Path
) -> None:
    """M00 waits for the key of the page if the PLC leaves it to the operator;
    behind it the program runs to its end.
    """
    part = tmp_path / "part.nc"
    part.write_text("G01 X2 F6000\nM00\nG01 X5\nM30\n")
    plc = tmp_path / "plc.py"
    plc.write_text(LEAVES_STOPS)
    words = ("run", part, "--plc", plc, "--clock", "realtime", "--monitor")
    tab = browser.tab()
    with started(*words, "--record", "r.arrow", cwd=tmp_path) as (
        process,
        address,
    ):
        tab.go(address)
        tab.until("document.querySelector('#do-continue')?.disabled === false")
        tab.until(
            "/2.0000 mm/.test(document.querySelector('#axis-rows').innerText)"
        )
        tab.click("#do-continue")
        assert process.wait(60) == 0
    assert Recording(tmp_path / "r.arrow").cycles["X"][-1] == 5.0


def test_a_page_ahead_of_its_cnc_waits(
    browser: Browser, tmp_path: Path
) -> None:
    """No CNC yet: the page says so, and calls no value old."""
    tab = browser.tab()
    with monitor_of(f"t{id(tmp_path)}") as address:
        tab.go(address)
        status = "document.querySelector('#status').innerText"
        tab.until(f"{status} === 'waiting for the CNC'")
        assert tab.text("#age") == "no values yet"
        assert "not there yet" in tab.text("#story-cnc")
        assert tab.said == []


def test_the_cnc_alone_has_its_page(browser: Browser, tmp_path: Path) -> None:
    """``cnc --monitor``: what the program says is told; without a PLC nobody
    takes orders, and the page says so.
    """
    part = tmp_path / "part.nc"
    part.write_text('#MSG ["hello from the part"]\nG01 X5 F60\nM30\n')
    words = ("cnc", part, "--no-wait", "--monitor", "--clock", "realtime")
    tab = browser.tab()
    name = f"t{id(tab)}"
    with started(*words, "--name", name, cwd=tmp_path) as (_, address):
        tab.go(address)
        tab.until(LIVE)
        assert "CNC" in event(tab, "hello from the part")
        tab.until("document.querySelector('#panel-state').innerText !== ''")
        assert "no PLC" in tab.text("#panel-state")
        tab.until("!!document.querySelector('#program-lines .reached')")
        tab.until("/window/.test(document.body.innerText)")
        assert tab.said == []


def test_the_demo_shows_its_recording_afterwards(
    browser: Browser, tmp_path: Path
) -> None:
    """``demo --monitor``: it starts with the first page; at its end a link
    opens the recording.
    """
    tab = browser.tab()
    with started("demo", "--monitor", "--seconds", 3, cwd=tmp_path) as (
        _,
        address,
    ):
        tab.go(address)
        tab.until("machine.path && machine.path.trail.length > 20", 60)
        tab.until("!!document.querySelector('#links a')", 60)
        tab.click("#links a")
        tab.until("!!window.player && !!player.columns")
        assert tab.said == []
