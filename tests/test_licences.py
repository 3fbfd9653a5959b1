"""The licences of whatever a wheel ships are listed in a file that it carries."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import distribution
from pathlib import Path

import pytest

from support.paths import ROOT

LIST = "THIRD_PARTY.md"
SHIPPED = ("cnc_core", "hli", "plc_client", "c_ext", "examples", "docs")
NOTICE = re.compile(
    rb"copyright \(c\)|@license|^/\*!|spdx-license", re.I | re.M
)
"""What the work of others says of itself."""
MADE = {".so", ".pyc"}


def of_others() -> set[str]:
    """Files that are not the project's own, by their folder or their words."""
    found = (path for room in SHIPPED for path in (ROOT / room).rglob("*"))
    return {
        path.relative_to(ROOT).as_posix()
        for path in found
        if path.is_file()
        and path.suffix not in MADE
        and ("vendor" in path.parts or NOTICE.search(path.read_bytes()))
    }


def listed() -> set[str]:
    """The files that the list names in its rows."""
    rows = re.findall(r"^\|.*\|$", (ROOT / LIST).read_text(), re.M)
    names = {
        name for row in rows for name in re.findall(r"`([^`]+/[^`]+)`", row)
    }
    return {name for name in names if Path(name).suffix not in MADE}


@pytest.mark.ci
def test_each_file_of_others_is_listed_and_no_other() -> None:
    """A file beside `vendor` or with a notice stands in the list; all listed exist."""
    assert "cnc_core/monitor/page/vendor/uPlot.iife.min.js" in of_others()
    assert listed() == of_others()


def test_the_version_that_is_listed_is_shipped() -> None:
    """The head of the file of others names the version of its row."""
    rows = (ROOT / LIST).read_text().splitlines()
    (row,) = [row for row in rows if row.startswith("| uPlot")]
    version = row.split("|")[3].strip()
    script = ROOT / "cnc_core/monitor/page/vendor/uPlot.iife.min.js"
    assert f"(v{version})" in script.read_text()[:200]


def test_the_list_and_the_texts_are_files_of_licence() -> None:
    """A build puts the list, the licence and the texts into the wheel's metadata."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    carried = {
        path.relative_to(ROOT).as_posix()
        for name in project["license-files"]
        for path in ROOT.glob(name)
    }
    texts = {name for name in listed() if "LICENSE" in name}
    assert carried == {"LICENSE", LIST} | texts


@pytest.mark.ci
def test_what_is_installed_carries_the_list() -> None:
    """The metadata of the installed package have the list, word for word."""
    installed = distribution("hli-cosim")
    assert installed.read_text(f"licenses/{LIST}") == (ROOT / LIST).read_text()
