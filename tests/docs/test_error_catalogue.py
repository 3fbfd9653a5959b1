"""The catalogue of error numbers: cause and cure of each, ``explain``."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

import hli.errors
from cnc_core.catalogue import catalogue, entries, explain, meanings
from cnc_core.commands.console import app
from cnc_core.errors import CncError
from plc_client.blocks import interface
from plc_client.blocks.ahead import EmptyReason
from support.paths import ROOT

pytestmark = pytest.mark.source

TEXTS = sorted((ROOT / "cnc_core" / "data").glob("errors_*.txt"))
PACKAGES = ("cnc_core", "plc_client", "hli")
RAISED = {"CncError", "fail", "Problem", "StopHere", "Mistake"}
OF_C = re.compile(r"#define \w*(?:ERROR|WARNING|ENGINE)_\w+ -?(\d{4,6})\b")


def raised_in_python() -> set[int]:
    """Numbers that stand as the first argument of an error."""
    found = set()
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.Call) and node.args:
                    name = ast.unparse(node.func).split(".")[-1]
                    first = node.args[0]
                    if name in RAISED and isinstance(first, ast.Constant):
                        found.add(first.value)
    return {number for number in found if isinstance(number, int) and number}


def raised_in_c() -> set[int]:
    """Numbers that C gives names to."""
    headers = (ROOT / "c_ext").rglob("*.h")
    return {int(n) for path in headers for n in OF_C.findall(path.read_text())}


def test_every_number_has_cause_and_cure() -> None:
    """All tables of numbers together are the catalogue; no text is empty."""
    assert meanings().keys() <= catalogue().keys()
    for one in catalogue().values():
        assert one.text, one
        assert one.cause.endswith("."), one
        assert one.cure.endswith((".", ">.")), one


def test_every_number_that_is_raised_is_explained() -> None:
    """Python, C, errors on attaching, function blocks."""
    python, c = raised_in_python(), raised_in_c()
    assert len(python) > 150
    assert len(c) > 20
    attaching = {
        one.code
        for one in vars(hli.errors).values()
        if isinstance(one, type) and issubclass(one, hli.errors.HliError)
    }
    blocks = {
        value
        for name, value in vars(interface).items()
        if name.startswith("ERR_PLC_") and value
    } | {reason for reason in EmptyReason if reason}
    missing = (python | c | attaching | blocks) - catalogue().keys()
    assert missing == set()


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: path.stem)
def test_no_number_is_told_twice(path: Path) -> None:
    """In one file or in two, and the numbers of a file are in order."""
    own = [number for number, *_ in entries(path.read_text())]
    others = [
        number
        for other in TEXTS
        if other != path
        for number, *_ in entries(other.read_text())
    ]
    assert own == sorted(set(own))
    assert not set(own) & set(others)


def test_explain_tells_what_a_number_means() -> None:
    """By the number, as it is shown, and as vendors write it; in 80 columns."""
    run = CliRunner().invoke
    said = run(app, ["explain", "907001", "P-ERR-270053", "20131:"])
    assert said.exit_code == 0
    lines = said.output.splitlines()
    assert lines[0].startswith("907001: the program does not end")
    assert lines[1].startswith("  why: ")
    assert sum(line.startswith("  what helps: ") for line in lines) == 3
    listed = run(app, ["explain"]).output.splitlines()
    assert max(map(len, lines + listed)) <= 80
    assert sum(bool(re.match(r" +\d+ ", line)) for line in listed) == len(
        catalogue()
    )


def test_an_unknown_number_names_near_ones() -> None:
    """One digit more or less, or the next number; words are wrong usage."""
    for wrong, meant in ((907003, 907002), (97010, 907010), (201311, 20131)):
        with pytest.raises(CncError, match=f"no error {wrong}; .*{meant} "):
            explain(wrong)
    assert CliRunner().invoke(app, ["explain", "feed"]).exit_code == 2
