"""The server of the monitor: who gets in, what is refused, what pages get."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from cnc_core import Cell
from cnc_core.monitor import pages
from cnc_core.monitor.app import Monitor, Served
from cnc_core.monitor.security import host_names
from plc_client import FeedControl, task
from plc_client.mock import line, m
from plc_client.runner import PlcRunner
from support.fake_cnc import unique_name
from support.monitor_page import HERE, LIVE, OURS, TOKEN, Open, acted

READING = (
    "/api/start",
    "/api/cells",
    "/api/layout",
    "/api/route",
    "/api/recording",
    "/api/recording/contour",
)


@task()
class Program:
    """A variable to force, and an override."""

    def setup(self, hli: Any) -> None:
        self.gain = self.other = 1.0
        self.feed = FeedControl(hli.gpCh[0])

    def cyclic(self) -> None:
        self.feed(override=80.0)


def client_of(**served: Any) -> TestClient:
    app = Monitor(Served(TOKEN, **served)).app(host_names("127.0.0.1", 8765))
    return TestClient(app, HERE)


@pytest.fixture
def client() -> Iterator[TestClient]:
    """A server for any cell."""
    with client_of() as made:
        yield made


@pytest.mark.parametrize("route", READING)
@pytest.mark.parametrize("header", [{}, {"authorization": "Bearer wrong"}])
def test_nothing_is_told_without_the_token(
    client: TestClient, route: str, header: dict[str, str]
) -> None:
    """Status 401, and no fact in the answer."""
    answer = client.get(route, headers=header)
    assert answer.status_code == 401
    assert answer.json() == {"error": "the token is missing or wrong"}


def test_the_page_holds_no_secret_and_its_headers_keep_others_out(
    client: TestClient,
) -> None:
    """The page comes without a token; a wrong one in the address is refused."""
    answer = client.get("/")
    assert answer.status_code == 200
    assert TOKEN not in answer.text
    policy = answer.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert answer.headers["referrer-policy"] == "no-referrer"
    assert client.get(f"/?token={TOKEN}").status_code == 200
    assert client.get("/?token=wrong").status_code == 403


@pytest.mark.parametrize(
    "path",
    ["/page/none.js", "/page/../app.py", "/page/%2e%2e/app.py", "/etc/passwd"],
)
def test_no_file_beside_those_of_the_page(
    client: TestClient, path: str
) -> None:
    """A path never leads out of the package's folder."""
    assert client.get(path).status_code == 404


def test_every_file_of_the_page_is_served(client: TestClient) -> None:
    """Each import and link of the page leads to a file; none leads outside."""
    page = client.get("/").text
    names = [part.split('"')[0] for part in page.split('="/page/')[1:]]
    assert "main.js" in names
    main = client.get("/page/main.js").text
    names += [part.split('"')[0] for part in main.split('from "./')[1:]]
    for name in names:
        answer = client.get(f"/page/{name}")
        assert answer.status_code == 200, name
        assert "https://" not in answer.text or "vendor" in name, name
    licence = client.get("/page/vendor/uPlot.LICENSE.txt").text
    assert "MIT License" in licence


@pytest.mark.parametrize(
    "headers",
    [
        {"host": "evil.example"},
        {"host": "127.0.0.1:1"},
        {"origin": "https://evil.example"},
        {"origin": "null"},
    ],
)
def test_foreign_hosts_and_origins_are_refused(
    client: TestClient, headers: dict[str, str]
) -> None:
    """Whatever the token says, for reading, acting and the stream."""
    headers = {**OURS, **headers}
    assert client.get("/api/cells", headers=headers).status_code == 403
    answer = client.post("/api/act", headers=headers, json={})
    assert answer.status_code == 403
    refused = pytest.raises(WebSocketDisconnect)
    with (
        refused,
        client.websocket_connect(LIVE + "x", headers=headers),
    ):
        pass


@pytest.mark.parametrize("method", ["get", "put", "delete", "options"])
def test_only_post_acts(client: TestClient, method: str) -> None:
    """Another method changes nothing, even with the token."""
    for route in ("/api/act", "/api/raw"):
        answer = getattr(client, method)(route, headers=OURS)
        assert answer.status_code == 405


def test_the_raw_exchange_is_measured_once(client: TestClient) -> None:
    """Without being asked; again only on demand, and not at once again."""

    def asked(again: bool) -> Any:
        answer = client.post("/api/raw", headers=OURS, json={"again": again})
        assert answer.status_code == 200
        return answer.json()

    first = asked(again=False)
    assert sum(first["counts"]) == first["n"] > 0
    assert len(first["counts"]) == len(first["edges"]) + 1
    assert 0.0 < first["p50"] <= first["p99"]
    assert asked(again=False) == asked(again=True) == first


@pytest.mark.parametrize(
    ("content", "kind", "status"),
    [
        (b"{}", "text/plain", 415),
        (b"{", "application/json", 400),
        (b"[]", "application/json", 400),
        (b"[" * 60_000, "application/json", 400),
        (b'{"page": "none"}', "application/json", 409),
        (b" " * 70_000, "application/json", 413),
    ],
)
def test_orders_that_are_none(
    client: TestClient, content: bytes, kind: str, status: int
) -> None:
    """Each has a status of its own, and an error in words."""
    headers = {**OURS, "content-type": kind}
    answer = client.post("/api/act", headers=headers, content=content)
    assert answer.status_code == status
    assert answer.json()["error"]


HALF = "\\ud800"  # in JSON: half a surrogate pair, which is no character


@pytest.mark.parametrize(
    "first",
    ['{"token": "wrong"}', "{", "[]", "1", f'{{"token": "{HALF}"}}', b"\xff{"],
)
def test_a_stream_needs_the_token_first(
    client: TestClient, first: str | bytes
) -> None:
    """Anything else ends it with code 4401."""
    with client.websocket_connect(LIVE + "x") as live:
        send = live.send_bytes if isinstance(first, bytes) else live.send_text
        send(first)
        with pytest.raises(WebSocketDisconnect) as refused:
            live.receive_text()
        assert refused.value.code == 4401


def test_a_stream_that_is_late_may_come_again(
    client: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No token in time is not a wrong one: the page tries again."""
    monkeypatch.setattr(pages, "HELLO_S", 0.05)
    with client.websocket_connect(LIVE + "x") as live:
        with pytest.raises(WebSocketDisconnect) as refused:
            live.receive_text()
        assert refused.value.code == 4408


def test_a_server_of_one_cell_shows_no_other() -> None:
    """Neither in the list nor in a stream."""
    with client_of(name=unique_name()) as client:
        assert client.get("/api/cells", headers=OURS).json() == []
        with client.websocket_connect(LIVE + "other") as live:
            live.send_json({"token": TOKEN})
            with pytest.raises(WebSocketDisconnect) as refused:
                live.receive_text()
            assert refused.value.code == 4404


@pytest.fixture
def cell() -> Iterator[PlcRunner]:
    """A mock CNC and a PLC that takes orders whenever it scans."""
    with PlcRunner.on_mock(Program, [line(100)]) as runner:
        runner._scanner.orders.open(runner.hli.name)
        runner.step(20)
        yield runner
        runner._scanner.orders.close()


def test_a_frame_holds_what_the_memory_holds(cell: PlcRunner) -> None:
    """Speed, distance, override, axes; symbols by name; no symbol of nobody."""
    with (
        client_of(name=cell.hli.name) as client,
        client.websocket_connect(LIVE + cell.hli.name) as live,
    ):
        page = Open(live, client)
        path = "gpCh[0].bahn_state.dist_prog_start"
        page.want(path)
        frame = page.frame(lambda f: f.get("samples"))
        state = cell.ch._c.bahn_state
        assert frame["values"][path] == state.dist_prog_start
        assert frame["samples"][0][1] == state.dist_prog_start
        motion = frame["motion"]
        assert motion["distance"] == state.dist_prog_start * 1e-4
        assert motion["override"] == 80.0
        assert motion["v"] == state.active_feed_r * 1e-3
        assert frame["cell"]["there"]
        assert frame["age_ms"] < 1000.0
        told = [event["text"] for event in page.frame()["events"]]
        assert told == []  # all came with the first frame


@pytest.mark.ci
def test_the_death_and_the_return_of_a_cnc_are_told() -> None:
    """While it is gone the page is told so; a new one is shown by itself."""
    name = unique_name()
    with (
        client_of(name=name) as client,
        client.websocket_connect(LIVE + name) as live,
    ):
        page = Open(live, client)
        frame = page.frame()
        assert not frame["cell"]["there"]
        assert "does not exist" in frame["cell"]["problem"]
        for life in (1, 2):
            with PlcRunner.on_mock(Program, [line(1)], name=name) as runner:
                runner.step(3)
                found = page.frame(lambda f: f.get("motion"))
                assert found["cell"]["life"] == life
            page.frame(lambda f: not f["cell"]["there"])


def test_oversized_and_many_messages_end_the_stream(cell: PlcRunner) -> None:
    """A page that says too much is left."""
    with (
        client_of(name=cell.hli.name) as client,
        client.websocket_connect(LIVE + cell.hli.name) as live,
    ):
        page = Open(live, client)
        page.want(*["x" * 1000] * 100)
        for _ in range(40):
            live.send_text(json.dumps({"nothing": 1}))
        with pytest.raises(WebSocketDisconnect) as left:
            page.frame(lambda _: False)
        assert left.value.code == 4429


def test_a_message_that_is_not_understood_leaves_the_page() -> None:
    """Bytes, symbols that are no text, more symbols than there are: the frames
    go on, and problems are told once.
    """
    name = unique_name()
    with (
        PlcRunner.on_mock(Program, [line(100)], name=name),
        client_of(name=name) as client,
        client.websocket_connect(LIVE + name) as live,
    ):
        page = Open(live, client)
        live.send_bytes(b"\xff\xfe")
        live.send_text(f'{{"subscribe": [1, null, {{}}, "{HALF}"]}}')
        told = page.frame(lambda f: f.get("problems"))["problems"]
        assert [*told] == ["\ud800"]
        assert "problems" not in page.frame()
        page.want(*[f"none{k}" for k in range(3000)])
        page.frame(lambda f: len(f.get("problems", ())) == pages.PATHS_MAX)


@pytest.mark.parametrize(
    "order",
    [
        {"do": "answer", "number": 1, "set": {"x": 10**400}, "press": ""},
        {"do": "operate", "what": "override", "value": 10**400},
        {"do": "force", "symbols": [["Program.gain", 10**400]]},
        {"do": "operate", "what": "none", "value": 1},
    ],
)
def test_numbers_and_texts_that_are_none_are_refused(
    cell: PlcRunner, order: dict[str, Any]
) -> None:
    """In words, by status 422."""
    name = cell.hli.name
    with (
        client_of(name=name) as client,
        client.websocket_connect(LIVE + name) as live,
    ):
        answer = acted(cell, Open(live, client), **order)
        assert answer.status_code == 422
        assert answer.json()["error"]


def test_orders_go_to_the_plc_and_stand_in_the_events(cell: PlcRunner) -> None:
    """An override is held, a wrong one refused; both are told with who it was."""
    name = cell.hli.name
    with (
        client_of(name=name) as client,
        client.websocket_connect(LIVE + name) as live,
    ):
        page = Open(live, client)
        order = {"do": "operate", "what": "override"}
        answer = acted(cell, page, **order, value=60)
        assert answer.status_code == 200, answer.text
        assert answer.json()["panel"]["held"] == {"override": 60}
        cell.step(3)
        assert cell.ch.bahn_mc_control.override.state_r == 600
        answer = acted(cell, page, **order, value=900)
        assert answer.status_code == 422
        assert "0..200" in answer.json()["error"]
        seen: list[dict[str, Any]] = []

        def both(frame: dict[str, Any]) -> bool:
            seen.extend(frame["events"])
            return seen[-1]["kind"] == "refused"

        page.frame(both)
        done, refused = seen[-2:]
        assert (done["kind"], done["text"]) == ("action", "override 60")
        assert done["who"].startswith("Ada (page ")
        assert refused["text"].startswith("override 900: ")


@pytest.mark.parametrize("keep", [False, True])
def test_forces_go_with_their_page_unless_they_are_kept(
    cell: PlcRunner, keep: bool
) -> None:
    """The PLC lists what a page forced; closing it lets that go, and only that."""
    name = cell.hli.name
    symbol = cell._scanner.symbols["Program.other"]
    cell._scanner.forces.force("Program.other", symbol, 1.0)
    with client_of(name=name, keep=keep) as client:
        with client.websocket_connect(LIVE + name) as live:
            page = Open(live, client)
            answer = acted(cell, page, do="force", symbols=["program.gain=2.5"])
            assert answer.json()["forced"]["Program.gain"] == 2.5
        end = time.monotonic() + (0.2 if keep else 10.0)
        while (
            len(list(cell._scanner.forces.items())) > 1
            and time.monotonic() < end
        ):
            cell.step()
    left = {"Program.other", "Program.gain"} if keep else {"Program.other"}
    assert set(dict(cell._scanner.forces.items())) == left


@pytest.mark.ci
def test_a_recording_is_shown_and_no_other_file(
    program: Callable[..., Path], tmp_path: Path
) -> None:
    """Columns over the same instants, in mm; functions, events, the program."""
    target = tmp_path / "run.arrow"
    with Cell({"channel": {"m_synch": {"5": "MVS_SVS"}}}) as cell:
        part = program("G1 X10 F6000\nM5\nX0\nM30\n")
        result = cell.run(part, record=target)
    assert result.end == "completed", result.errors
    with client_of(recordings=[target, tmp_path / "gone.npz"]) as client:
        begin = client.get("/api/start", headers=OURS).json()
        assert (begin["view"], begin["recordings"]) == (
            "recording",
            ["run.arrow"],
        )
        ask = "/api/recording?name="
        found = client.get(ask + "run.arrow", headers=OURS).json()
        columns = found["columns"]
        assert found["complete"]
        assert len({len(column) for column in columns.values()}) == 1
        assert columns["X"][-1] == 0.0
        assert columns["dist_prog_start"][-1] == pytest.approx(20.0)
        assert found["lines"][0] == "G1 X10 F6000"
        assert [f["code"] for f in found["functions"]] == [5]
        contour = "/api/recording/contour"
        given = {"name": "run.arrow", "time": "0.1"}
        answer = client.get(contour, headers=OURS, params=given)
        assert answer.status_code == 200
        for time_text in ("", "x", "nan", "inf", "1e999"):
            given["time"] = time_text
            answer = client.get(contour, headers=OURS, params=given)
            assert answer.status_code == 404, time_text
        for name in ("gone.npz", "../run.arrow", "/etc/passwd", ""):
            answer = client.get(ask + name, headers=OURS)
            assert answer.status_code == 404, name


def test_functions_that_the_plc_has_not_acknowledged_are_in_flight() -> None:
    """M, S and T with number, unit and what the PLC has done so far."""

    @task()
    class Silent:
        def cyclic(self) -> None:
            pass

    script = [line(1), m(8), line(5)]
    with PlcRunner.on_mock(Silent, script) as cell:
        cell.step(100)
        name = cell.hli.name
        with (
            client_of(name=name) as client,
            client.websocket_connect(LIVE + name) as live,
        ):
            page = Open(live, client)
            frame = page.frame(lambda f: f.get("functions"))
            (found,) = frame["functions"]
            assert (found["kind"], found["number"]) == ("M", 8)
            assert found["unit"].startswith("gpCh[0] std")
            assert found["offered"]
            assert not found["acknowledged"]


@pytest.mark.ci
def test_more_symbols_than_a_page_gets_are_told(cell: PlcRunner) -> None:
    """64 symbols are read; each further one has a problem, not an empty value."""
    name = cell.hli.name
    paths = [f"gpCh[0].bahn_state.coord_r[{k}].name" for k in range(3)]
    paths += [
        f"gpVECh[0].data[{k}]" for k in range(62)
    ]  # one more than fits, and one that is long
    with (
        client_of(name=name) as client,
        client.websocket_connect(LIVE + name) as live,
    ):
        page = Open(live, client)
        page.want(*paths, "x" * 300)
        frame = page.frame(lambda f: f.get("problems"))
    assert "64 symbols" in frame["problems"][paths[-1]]
    assert set(frame["problems"]) & set(paths[:64]) == set()


@pytest.mark.ci
def test_a_page_is_told_that_a_force_does_not_move_the_machine(
    cell: PlcRunner,
) -> None:
    """What the CNC writes can be forced for the PLC alone, and that is said."""
    name = cell.hli.name
    path = "gpCh[0].bahn_state.active_feed_r"
    with (
        client_of(name=name) as client,
        client.websocket_connect(LIVE + name) as live,
    ):
        page = Open(live, client)
        answer = acted(cell, page, do="force", symbols=[f"{path}=5"])
        assert answer.status_code == 200, answer.text
        assert "not what the CNC does" in answer.json()["warnings"][0]
        own = acted(cell, page, do="force", symbols=["Program.gain=2"])
        assert "warnings" not in own.json()


def test_a_cnc_that_runs_no_cycle_is_told(cell: PlcRunner) -> None:
    """The memory can be read, but its numbers are of the last cycle."""
    name = cell.hli.name
    with (
        client_of(name=name) as client,
        client.websocket_connect(LIVE + name) as live,
    ):
        page = Open(live, client)
        page.frame(lambda f: f.get("cycle_age_ms", 0.0) > 300.0)

        def young(frame: dict[str, Any]) -> bool:
            cell.step()
            return float(frame["cycle_age_ms"]) < 300.0

        page.frame(young)
