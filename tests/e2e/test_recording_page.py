"""What ``show`` draws: the page in a browser's DOM, the picture on disk.

The browser is Debian's chromium.  Without it the tests of the DOM are skipped.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from cnc_core import Cell
from support.command_line import Outcome
from support.paths import ROOT

Cli = Callable[..., Outcome]
Write = Callable[..., Path]
PART = "F6000\nM8\nG1 X50 Y20\nG2 X60 Y30 I0 J10\nM9\nG1 X0 Y0\nM30\n"
CELL = """[axes.X]
[axes.Y]
[axes.Z]
[channel.m_synch]
8 = "MVS_SVS"
9 = "MVS_SVS"
"""
POSITION = "gpCh[0]^.bahn_state.dist_prog_start"
CHROMIUM = shutil.which("chromium")
SHOT = "1200,860"
PICTURE = ROOT / "docs" / "images" / "recording_page.png"


@pytest.fixture
def recording(program: Write, tmp_path: Path) -> Path:
    """A run with two functions and a watched symbol."""
    target = tmp_path / "run.arrow"
    with Cell(program(CELL, "cell.toml")) as cell:
        result = cell.run(program(PART), record=target, watch=(POSITION,))
    assert result.end == "completed", result.errors
    return target


def browser(page: Path, *options: str) -> str:
    """What the browser prints."""
    assert CHROMIUM is not None
    done = subprocess.run(
        [
            CHROMIUM,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            *options,
            f"--user-data-dir={page.parent / 'browser'}",
            page.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    return done.stdout


def dom_of(page: Path) -> str:
    """The document behind its script."""
    return browser(page, "--dump-dom")


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
@pytest.mark.ci
def test_the_page_draws_what_was_recorded(recording: Path, cli: Cli) -> None:
    """Curves with their names and units, functions as marks, limits, the path,
    the program with the line beside the cursor.
    """
    page = recording.with_suffix(".html")
    assert cli("show", recording, "-o", page).status == 0
    dom = dom_of(page)
    names = set(re.findall(r'<polyline[^>]*data-name="([^"]+)"', dom))
    wanted = {"v", "feed", "acceleration", "jerk", "override", POSITION}
    assert wanted <= names
    for title in ("Speed, mm/s", "Jerk along the path, mm/s3", "Override, %"):
        assert f">{title}</text>" in dom
    marks = re.findall(r'class="axis marktext">(\w+)<', dom)
    assert marks == ["M8", "M9"]
    assert 'class="limit"' in dom
    assert 'class="curve path"' in dom
    assert 'class="tool"' in dom
    speed = re.search(r'<polyline points="([^"]+)"[^>]*data-name="v"', dom)
    assert speed is not None
    heights = {point.split(",")[1] for point in speed[1].split()}
    assert len(heights) > 20  # it accelerates: no straight line
    assert "G2 X60 Y30" in dom
    shot = page.with_suffix(".png")
    browser(page, f"--screenshot={shot}", f"--window-size={SHOT}")
    if os.environ.get("HLI_COSIM_GOLDEN") == "write":
        shutil.copy(shot, PICTURE)
    # the picture of the docs: same size, and the curves' colours are in it
    for picture in (shot, PICTURE):
        pixels = (plt.imread(picture)[:, :, :3] * 255).round().astype(int)
        assert pixels.shape[:2] == (860, 1200)
        blue = np.abs(pixels - (0x00, 0x72, 0xB2)).sum(axis=2) < 120
        assert blue.sum() > 1000


def test_the_page_needs_no_network(recording: Path, cli: Cli) -> None:
    """No address but the name of the SVG format, and no text of the program ends
    the script.
    """
    page = recording.with_suffix(".html")
    assert cli("show", recording, "-o", page).status == 0
    text = page.read_text()
    addresses = set(re.findall(r"https?://[^\"' ]+", text))
    assert addresses == {"http://www.w3.org/2000/svg"}
    assert text.count("</script>") == 1


@pytest.mark.ci
def test_the_picture_is_drawn(recording: Path, cli: Cli) -> None:
    """A PNG of one run, and of two over each other."""
    picture = recording.with_suffix(".png")
    done = cli("show", recording, recording, "-o", picture)
    assert done.status == 0, done.err
    assert picture.read_bytes()[:4] == b"\x89PNG"
    wrong = cli("show", recording, "-o", recording.with_suffix(".gif"))
    assert wrong.status == 1
    assert ".html" in wrong.err
