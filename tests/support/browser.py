"""A real browser for tests: Debian's chromium, driven by its DevTools protocol."""

from __future__ import annotations

import base64
import itertools
import json
import shutil
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from urllib.request import urlopen

from websockets.sync.client import ClientConnection, connect

CHROMIUM = shutil.which("chromium")
START_S, ANSWER_S, TRUE_S = 60.0, 30.0, 30.0


class PageLeftError(Exception):
    """The page was left for another one before it had answered."""


class Tab:
    """One tab: go to an address, ask its script, press keys."""

    def __init__(self, address: str) -> None:
        self._opened = ExitStack()
        self._socket: ClientConnection = self._opened.enter_context(
            # no pings: while nobody reads, events fill the queue and the pong
            # waits behind them.  Each answer has its time limit.
            connect(address, max_size=None, proxy=None, ping_interval=None)
        )
        self._numbers = itertools.count(1)
        self.said: list[str] = []  # errors on the console of this page
        self.asked: list[str] = []  # addresses, while "Network" is enabled
        self.answer_s = ANSWER_S  # more on a machine that does much else
        for domain in ("Page", "Runtime", "Log"):
            self.do(f"{domain}.enable")

    def close(self) -> None:
        self._opened.close()

    def do(self, method: str, **parameters: Any) -> Any:
        """One command of the protocol."""
        number = next(self._numbers)
        order = {"id": number, "method": method, "params": parameters}
        self._socket.send(json.dumps(order))
        while True:
            message = json.loads(self._socket.recv(self.answer_s))
            if message.get("id") == number:
                if "navigated" in message.get("error", {}).get("message", ""):
                    raise PageLeftError(method)
                assert "error" not in message, message
                return message["result"]
            self._note(message)

    def _note(self, message: dict[str, Any]) -> None:
        method = message.get("method")  # none: an answer that came too late
        if method == "Runtime.exceptionThrown":
            self.said.append(json.dumps(message["params"])[:600])
        if method == "Network.requestWillBeSent":
            self.asked.append(message["params"]["request"]["url"])
        if method == "Network.webSocketCreated":
            self.asked.append(message["params"]["url"])
        if method == "Log.entryAdded":
            entry = message["params"]["entry"]
            if entry["level"] == "error":
                self.said.append(f"{entry['text']} {entry.get('url', '')}")

    def go(self, address: str) -> None:
        """Load it, also where it differs by what stands behind # alone.

        What the page before has said, which may come late, is forgotten.
        """
        if "#" in address:
            self.go("about:blank")
            self.said.clear()
        self.do("Page.navigate", url=address)
        self.until("document.readyState === 'complete'")

    def js(self, expression: str) -> Any:
        """The value of an expression; a promise is awaited."""
        found = self.do(
            "Runtime.evaluate",
            expression=expression,
            returnByValue=True,
            awaitPromise=True,
        )
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def _here(self, expression: str) -> Any:
        """The value of an expression; None while another page comes."""
        try:
            return self.js(expression)
        except PageLeftError:
            return None

    def until(self, expression: str, seconds: float = TRUE_S) -> Any:
        """The value of an expression once it is true."""
        end = time.monotonic() + seconds
        while not (value := self._here(expression)):
            late = time.monotonic() > end
            assert not late, (expression, self.text("body")[:1500])
            time.sleep(0.05)
        return value

    def text(self, selector: str) -> str:
        """What a person reads there."""
        return str(self.js(f"document.querySelector('{selector}').innerText"))

    def click(self, selector: str) -> None:
        self.js(f"document.querySelector('{selector}').click()")

    def key(self, key: str, text: str = "") -> None:
        """A key of the keyboard, pressed and let go."""
        codes = {"Tab": 9, "Enter": 13, "ArrowLeft": 37, "ArrowUp": 38}
        codes |= {"ArrowRight": 39, "ArrowDown": 40}
        code = codes.get(key, ord(key[0].upper()))
        common = {"key": key, "code": key, "windowsVirtualKeyCode": code}
        text = "\r" if key == "Enter" else text
        more = {"text": text} if text else {}
        self.do("Input.dispatchKeyEvent", type="keyDown", **common, **more)
        self.do("Input.dispatchKeyEvent", type="keyUp", **common)

    def size(self, width: int, height: int, *, phone: bool = False) -> None:
        self.do(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=phone,
        )

    def screenshot(self, target: Path) -> None:
        shot = self.do("Page.captureScreenshot", format="png")
        target.write_bytes(base64.b64decode(shot["data"]))


class Browser:
    """Headless chromium with a profile of its own."""

    def __init__(self, folder: Path) -> None:
        assert CHROMIUM is not None
        self._process = subprocess.Popen(
            [
                CHROMIUM,
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--no-first-run",
                "--disable-background-networking",
                "--remote-debugging-port=0",
                f"--user-data-dir={folder}",
                "about:blank",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        told = folder / "DevToolsActivePort"
        end = time.monotonic() + START_S
        while not (told.exists() and "\n" in told.read_text()):
            assert time.monotonic() < end
            time.sleep(0.05)
        self._port = int(told.read_text().split()[0])
        self._tabs: list[Tab] = []

    @property
    def pid(self) -> int:
        """Its first process."""
        return self._process.pid

    def tab(self) -> Tab:
        """The one tab, empty."""
        if self._tabs:
            self._tabs[0].go("about:blank")
            self._tabs[0].said.clear()
            return self._tabs[0]
        address = f"http://127.0.0.1:{self._port}/json/list"
        with urlopen(address, timeout=ANSWER_S) as answer:
            pages = json.load(answer)
        page = next(p for p in pages if p["type"] == "page")
        tab = Tab(page["webSocketDebuggerUrl"])
        self._tabs.append(tab)
        return tab

    def close(self) -> None:
        for tab in self._tabs:
            tab.close()
        self._process.terminate()
        self._process.wait(ANSWER_S)
