"""The routes: the page, what it reads, what it does."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import os
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route as Path_
from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket

from hli import bench
from hli.cells import running_cells
from hli.export import json_layout
from hli.segment import NAME_RULE
from hli.units import members_told
from plc_client.stats import EDGES_US

from ..observing.cores import keep_off
from ..observing.plc import RefusedError
from .hub import Hub, as_text
from .pages import Gate, Page
from .recorded import Recorded
from .security import App, Guard, bearer, body_of, same_token
from .source import Source

PAGES_MAX = 24
TIME_CHARACTERS = 32
RAW_BLOCKS = 50
RAW_FIRST_S, RAW_S = 0.02, 0.2  # a short look by itself; when it is asked for
RAW_PAUSE_S = 2.0  # between two measurements: they keep two processors busy
HUBS_MAX = 8
HUB_IDLE_S = 60.0
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".txt": "text/plain; charset=utf-8",
    ".svg": "image/svg+xml",
}


@dataclass
class Served:
    """What a server shows.

    ``name``: the cell; None: any cell of this user.
    ``source``: the program of the cell, where it is known.
    ``recordings``: files that pages may open.
    ``on_first_page``: called once.
    ``keep``: forces stay when their page is closed.
    """

    token: str
    name: str | None = None
    source: Source | None = None
    recordings: list[Path] = field(default_factory=list)
    keep: bool = False
    on_first_page: Callable[[], None] = lambda: None


class Monitor:
    """The application over what is served."""

    def __init__(self, served: Served) -> None:
        self._served = served
        self._files = page_files()
        self._cores = os.sched_getaffinity(0)
        self._hubs: dict[str, tuple[Hub, asyncio.Task[None]]] = {}
        self._pages: dict[str, tuple[Page, Hub]] = {}
        self._open = 0
        self._gate = Gate()
        self._seen = False
        self._measuring = asyncio.Lock()
        self._raw_found: dict[str, Any] = {}
        self._raw_at = 0.0
        self._recorded = Recorded(served.recordings)
        self._start_with = (
            "cell" if served.name else
            "recording" if served.recordings else "cells"
        )  # fmt: skip

    def app(self, hosts: set[str]) -> App:
        """With every check in front of it."""
        routes = [
            Path_("/", self._page),
            Path_("/page/{file:path}", self._file),
            Path_("/api/start", self._start),
            Path_("/api/cells", self._cells),
            Path_("/api/layout", self._layout),
            Path_("/api/route", self._route),
            Path_("/api/recording", self._recording),
            Path_("/api/recording/contour", self._recorded_contour),
            Path_("/api/act", self._act, methods=["POST"]),
            Path_("/api/raw", self._raw, methods=["POST"]),
            WebSocketRoute("/api/live", self._live),
        ]
        return Guard(Starlette(routes=routes, lifespan=self._lifespan), hosts)

    @contextlib.asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        sweeping = asyncio.create_task(self._sweep())
        if self._served.name is not None:
            self.hub(self._served.name)  # its events begin now
        yield
        sweeping.cancel()
        for name in [*self._hubs]:
            self._end(name)

    # -- cells
    def hub(self, name: str) -> Hub:
        """The hub of a cell.  RefusedError: not served, or too many."""
        only = self._served.name
        if not NAME_RULE.fullmatch(name) or only not in (None, name):
            raise RefusedError(f"cell {name[:64]!r} is not served here")
        if name not in self._hubs:
            if len(self._hubs) >= HUBS_MAX:
                raise RefusedError("too many cells are open")
            hub = Hub(name, self._served.source, keep=self._served.keep)
            hub.on_life = self._keep_off
            self._hubs[name] = hub, asyncio.create_task(hub.run())
        return self._hubs[name][0]

    def _keep_off(self) -> None:
        """Leave the processors of pinned CNCs alone."""
        hubs = [hub for hub, _ in self._hubs.values()]
        watched = [h.observer.pid for h in hubs if h.observer.sight]
        keep_off(watched, self._cores)

    def _end(self, name: str) -> None:
        _, task = self._hubs.pop(name)
        task.cancel()

    async def _sweep(self) -> None:
        """End hubs that no page has looked at for a while."""
        while True:
            await asyncio.sleep(HUB_IDLE_S / 4)
            now = time.monotonic()
            for name, (hub, _) in list(self._hubs.items()):
                idle = not hub.pages and now - hub.idle_since > HUB_IDLE_S
                if idle and name != self._served.name:
                    self._end(name)

    # -- the page itself: no secret is in it
    async def _page(self, request: Request) -> Response:
        given = request.query_params.get("token")
        if given is not None and not same_token(given, self._served.token):
            return PlainTextResponse("the token is wrong\n", 403)
        return self._content("index.html")

    async def _file(self, request: Request) -> Response:
        return self._content(request.path_params["file"])

    def _content(self, name: str) -> Response:
        found = self._files.get(name)
        if found is None:
            return PlainTextResponse("there is no such file\n", 404)
        kind = TYPES[Path(name).suffix]
        return Response(found, headers={"content-type": kind})

    # -- what it reads
    def _allowed(self, request: Request) -> bool:
        return same_token(bearer(request.headers), self._served.token)

    async def _answer(
        self, request: Request, content: Callable[[], Any]
    ) -> Response:
        if not self._allowed(request):
            return _problem(401, "the token is missing or wrong")
        try:
            return _json(await asyncio.to_thread(content))
        except RefusedError as error:
            return _problem(404, str(error))

    async def _start(self, request: Request) -> Response:
        """What the page begins with."""
        found = {
            "view": self._start_with,
            "cell": self._served.name,
            "recordings": self._recorded.names(),
        }
        return await self._answer(request, lambda: found)

    async def _cells(self, request: Request) -> Response:
        only = self._served.name

        def found() -> list[dict[str, Any]]:
            cells = [cell.as_json() for cell in running_cells()]
            return [c for c in cells if only in (None, c["name"])]

        return await self._answer(request, found)

    async def _layout(self, request: Request) -> Response:
        return await self._answer(request, layout_told)

    async def _route(self, request: Request) -> Response:
        name = request.query_params.get("cell", "")
        index = request.query_params.get("channel", "0")

        def found() -> Any:
            hub, number = self._hubs.get(name), as_index(index)
            channel = hub[0].channel(number) if hub else None
            if channel is None or channel.route is None:
                raise RefusedError("no program was read")
            return {"number": channel.route_number} | channel.route.as_json()

        return await self._answer(request, found)

    async def _recording(self, request: Request) -> Response:
        name, channel = _recording_of(request)
        return await self._answer(
            request, lambda: self._recorded.shown(name, channel)
        )

    async def _recorded_contour(self, request: Request) -> Response:
        """The request of the look-ahead that was the last one at a time, s."""
        name, channel = _recording_of(request)
        text = request.query_params.get("time", "")

        def found() -> Any:
            return self._recorded.contour(name, channel, as_time(text))

        return await self._answer(request, found)

    # -- what it does
    async def _act(self, request: Request) -> Response:
        try:
            given = await self._order(request)
            page, hub = self._page_of(given)
            who = _signed(given.get("who"), page.who)
            answer = await hub.desk.act(page.id, who, given.get("order"))
        except _NotTaken as error:
            return _problem(error.status, str(error))
        except RefusedError as error:
            return _problem(422, str(error))
        return _json(answer)

    async def _raw(self, request: Request) -> Response:
        """The raw exchange of this machine, us: as it was measured once, or,
        with ``again``, anew; one measurement at a time.
        """
        try:
            again = bool((await self._order(request)).get("again"))
        except _NotTaken as error:
            return _problem(error.status, str(error))
        async with self._measuring:
            return await self._answer(request, lambda: self._raw_now(again))

    def _raw_now(self, again: bool) -> dict[str, Any]:
        first = not self._raw_found
        late = time.monotonic() - self._raw_at > RAW_PAUSE_S
        if first or (again and late):
            seconds = RAW_S if again else RAW_FIRST_S
            self._raw_found = raw_exchange(seconds)
            self._raw_at = time.monotonic()
        return self._raw_found

    async def _order(self, request: Request) -> dict[str, Any]:
        """What a page wants done.  _NotTaken: it may not, or it is no order."""
        if not self._allowed(request):
            raise _NotTaken(401, "the token is missing or wrong")
        kind = request.headers.get("content-type", "").partition(";")[0]
        if kind.strip() != "application/json":
            raise _NotTaken(415, "application/json is needed")
        try:
            body = await body_of(request)
        except TimeoutError:
            raise _NotTaken(408, "the order did not come to its end") from None
        if body is None:
            raise _NotTaken(413, "the order is too long")
        try:
            given = json.loads(body)
        except (ValueError, RecursionError):
            given = None
        if not isinstance(given, dict):
            raise _NotTaken(400, "an order is a JSON object")
        return given

    def _page_of(self, given: dict[str, Any]) -> tuple[Page, Hub]:
        found = self._pages.get(str(given.get("page")))
        if found is None:
            raise _NotTaken(409, "no page of this name is open")
        return found

    async def _live(self, socket: WebSocket) -> None:
        if not await self._gate.pass_(socket, self._served.token):
            return
        if self._open >= PAGES_MAX:
            await socket.close(4503, "too many pages are open")
            return
        self._open += 1
        try:
            try:
                hub = self.hub(socket.query_params.get("cell", ""))
            except RefusedError as error:
                await socket.close(4404, str(error))
                return
            page = Page(socket, hub)
            self._pages[page.id] = page, hub
            if not self._seen:
                self._seen = True
                self._served.on_first_page()
            try:
                await page.serve()
            finally:
                del self._pages[page.id]
        finally:
            self._open -= 1


class _NotTaken(Exception):  # noqa: N818 (an answer, not a failure)
    """An order that goes no further, with the status of its answer."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status


def _recording_of(request: Request) -> tuple[str, str]:
    """The recording and the channel that are asked for."""
    asked = request.query_params
    return asked.get("name", ""), asked.get("channel", "")


def as_time(text: str) -> float:
    """A finite time, s.  RefusedError."""
    try:
        found = float(text[:TIME_CHARACTERS])
    except ValueError:
        found = math.nan
    if not math.isfinite(found):
        raise RefusedError("a time is a number of seconds")
    return found


def as_index(text: str) -> int:
    """The index of a channel.  RefusedError."""
    if not (text.isdecimal() and text.isascii() and len(text) <= 2):
        raise RefusedError("a channel is a number, 0 for the first one")
    return int(text)


def _signed(name: Any, who: str) -> str:
    """The page, and the name that its user gives."""
    if isinstance(name, str) and name.strip():
        return f"{name.strip()[:40]} ({who})"
    return who


def raw_exchange(seconds: float) -> dict[str, Any]:
    """Histogram and quantiles of a measurement in C, us; ``two_cores``: each
    side had a processor of its own.
    """
    found = bench.measure_raw(RAW_BLOCKS, seconds)
    us = found.ns / 1e3
    ends = np.searchsorted(np.sort(us), EDGES_US, "right")
    return {
        "edges": EDGES_US,
        "counts": np.diff([0, *ends, len(us)]).tolist(),
        "n": len(us),
        "p50": float(np.quantile(us, 0.5)),
        "p99": float(np.quantile(us, 0.99)),
        "two_cores": found.pinned,
    }


def _json(value: Any, status: int = 200) -> Response:
    """An answer in ASCII: a text may hold half a surrogate pair."""
    return Response(as_text(value), status, media_type="application/json")


def _problem(status: int, text: str) -> Response:
    return _json({"error": text}, status)


def page_files() -> dict[str, bytes]:
    """The files of the page by their names below ``page``."""
    found: dict[str, bytes] = {}

    def walk(folder: Any, prefix: str) -> None:
        for entry in folder.iterdir():
            if entry.is_dir():
                walk(entry, f"{prefix}{entry.name}/")
            elif Path(entry.name).suffix in TYPES:
                found[prefix + entry.name] = entry.read_bytes()

    walk(files("cnc_core.monitor") / "page", "")
    return found


def layout_told() -> dict[str, Any]:
    """The structures of the HLI with type, unit, writer and meaning."""
    told = members_told()
    structures = {
        name: [
            [
                member["name"],
                member["type"],
                member["dims"],
                *told.get(name, {}).get(member["name"], ("", "", "")),
            ]
            for member in structure["members"]
            if not member["name"].startswith("fill_")
        ]
        for name, structure in json_layout()["structures"].items()
    }
    roots = {
        "gpPform": "HLI_PLATFORM",
        "gpCh[0]": "HLI_CHANNEL",
        "gpAhead[0]": "HLI_AHEAD",
        "gpVECh[0]": "HLI_EXT_VAR",
        "gpVEGlobal": "HLI_EXT_VAR",
    }
    return {"roots": roots, "axis": "HLI_AXIS", "structures": structures}
