"""The built-in PLC programs as processes against the fake CNC process."""

import json
from pathlib import Path
from typing import Any

import pytest

from hli.view import BLOCK_FIELDS
from support.fake_cnc import unique_name
from support.processes import run_plc, start_cnc

pytestmark = pytest.mark.usefixtures("leftovers")


def report_of(
    tmp_path: Path,
    builtin: str,
    arguments: dict[str, Any],
    **cnc_arguments: Any,
) -> dict[str, Any]:
    """The report of a built-in PLC program that ran to its end."""
    name, report = unique_name(), tmp_path / "report.json"
    cnc = start_cnc(name, **cnc_arguments)
    options = (
        "--builtin",
        builtin,
        "--args",
        json.dumps(arguments),
        "--once",
        "--report",
        str(report),
    )
    status, text = run_plc(name, *options)
    assert (status, text) == (0, "")
    cnc.communicate(timeout=60)
    content: dict[str, Any] = json.loads(report.read_text())
    return content


@pytest.mark.ci
def test_acknowledge_runs_to_the_end(tmp_path: Path) -> None:
    """Nothing to do, nothing wrong."""
    assert report_of(tmp_path, "acknowledge", {}, lengths=[5.0])["result"] == {
        "acknowledged": 0,
        "continued": 0,
    }


@pytest.mark.parametrize("at", ["start", "end"])
@pytest.mark.ci
def test_query_mode_1_pages_until_the_answer_ends(
    tmp_path: Path, at: str
) -> None:
    """300 entries in three pages, in order, with the HLI's field names."""
    result = report_of(
        tmp_path,
        "query",
        {"mode": 1, "start": 5, "at": at},
        lengths=[5.0],
        log=[1.0] * 300,
    )["result"]
    assert [b["block_number"] for b in result["response"]] == [
        10 * n for n in range(6, 301)
    ]
    assert tuple(result["response"][0]) == BLOCK_FIELDS
    assert result["request"] == {"start_position": 5.0, "length": 0.0}
    assert result["state"]["count_logged_blocks"] == 300


@pytest.mark.ci
def test_query_mode_2_pages_through_its_range(tmp_path: Path) -> None:
    """Whole elements that touch [S, S+L), page by page."""
    arguments = {"mode": 2, "start": 15.0, "length": 1500.0, "at": "end"}
    content = report_of(
        tmp_path, "query", arguments, lengths=[10.0] * 300, speed=500.0
    )
    starts = [b["start_position"] for b in content["result"]["response"]]
    assert starts == [10.0 * n for n in range(1, 152)]
    assert content["requests"] == 2
    assert content["result"]["state"]["max_dist_prog_start"] == 3000.0


@pytest.mark.ci
def test_query_can_be_held_to_one_page(tmp_path: Path) -> None:
    """page false: the answer as it came."""
    result = report_of(
        tmp_path,
        "query",
        {"mode": 1, "page": False},
        lengths=[5.0],
        log=[1.0] * 300,
    )["result"]
    assert len(result["response"]) == 128


@pytest.mark.ci
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"mod": 1}, "did you mean mode?"),
        ({"mode": 3}, "1 or 2"),
        ({"mode": 2}, "range"),
        ({"at": "middle"}, "middle"),
        ({"page": 1}, "page"),
        ({"start": "0"}, "start"),
    ],
)
def test_wrong_arguments_are_named(
    arguments: dict[str, Any], message: str
) -> None:
    """One line on stderr, exit 1."""
    status, text = run_plc(
        unique_name(), "--builtin", "query", "--args", json.dumps(arguments)
    )
    assert status == 1
    assert message in text
    assert len(text.splitlines()) == 1


@pytest.mark.ci
def test_demo_reads_contour_and_log_and_lowers_the_override(
    tmp_path: Path,
) -> None:
    """Both modes in one run; the record is bounded."""
    content = report_of(
        tmp_path,
        "demo",
        {"records": 100, "window": 50.0},
        lengths=[10.0] * 60,
        log=[1.0] * 150,
    )
    result = content["result"]
    assert (result["elements_followed"], result["log_entries"]) == (60, 150)
    assert 0 < len(result["rows"]) <= 100
    assert all(len(row) == len(result["columns"]) for row in result["rows"])
    assert content["requests"] == content["handshake_ns"]["n"] > 0
