"""The monitor for tests: its process, and a page as its script sees it."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from starlette.testclient import TestClient

from plc_client.runner import PlcRunner
from support.command_line import command

TOKEN = "a-token-of-tests"
HERE = "http://127.0.0.1:8765"
LIVE = "ws://127.0.0.1:8765/api/live?cell="
OURS = {"authorization": f"Bearer {TOKEN}"}


@contextmanager
def monitor_of(target: object) -> Iterator[str]:
    """``hli-cosim monitor`` of a cell or a recording; the address that it prints."""
    with subprocess.Popen(
        command("monitor", target, "--port", 0),
        stdout=subprocess.PIPE,
        text=True,
    ) as server:
        try:
            assert server.stdout is not None
            yield server.stdout.readline().strip()
        finally:
            server.terminate()


class Open:
    """A page that is open, as its script sees it."""

    def __init__(self, live: Any, client: TestClient) -> None:
        self._live, self._client = live, client
        live.send_json({"token": TOKEN})
        self.page = live.receive_json()["hello"]["page"]

    def frame(self, until: Any = bool) -> dict[str, Any]:
        """The first frame that fulfils a condition."""
        for _ in range(200):
            found: dict[str, Any] = self._live.receive_json()
            if until(found):
                return found
        raise AssertionError(found)

    def want(self, *paths: str, **more: Any) -> None:
        self._live.send_json({"subscribe": paths, "scope": paths[:1], **more})

    def act(self, **order: Any) -> Any:
        given = {"page": self.page, "who": "Ada", "order": order}
        return self._client.post("/api/act", headers=OURS, json=given)


def acted(cell: PlcRunner, page: Open, **order: Any) -> Any:
    """The answer to an order while the PLC scans."""
    with ThreadPoolExecutor(1) as pool:
        answer = pool.submit(page.act, **order)
        while not answer.done():
            cell.step()
        return answer.result()
