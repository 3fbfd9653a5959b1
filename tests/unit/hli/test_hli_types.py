"""Views in editors and in the interpreter: types, ``dir()``, ``repr()``."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import cnc_core
import hli
from hli import Areas, layout
from hli.handshake import snapshot
from hli.view import path_of, view_class
from support.fake_cnc import unique_name
from support.paths import ROOT

RIGHT = """
from plc_client import ContourLookahead, FeedHold, Hli, connect, task
from hli.structures import HLI_CHANNEL


def far(channel: HLI_CHANNEL) -> float:
    return channel.bahn_state.dist_prog_start


@task(interval=0.001)
class Mine:
    def setup(self, hli: Hli) -> None:
        self.channel = hli.gpCh[0]
        self.ahead = ContourLookahead(hli.gpCh[0])
        self.unit = ContourLookahead(hli.gpCh[0].contour_lookahead)
        self.hold = FeedHold(hli.gpCh[0].bahn_mc_control.feedhold)

    def cyclic(self) -> None:
        self.channel.bahn_mc_control.override.command_w = 500
        names: list[str] = [c.name for c in self.channel.bahn_state.coord_r]
        numbers: list[int] = list(self.channel.bahn_state.g_function_r)
        assert far(self.channel) >= 0.0 and names and numbers
"""
WRONG = {
    "typo": ("hli.gpCh[0].bahn_state.dist_prog_strat", "dist_prog_strat"),
    "typo written": ("hli.gpCh[0].bahn_mc_control.feedhold.x = 1", '"x"'),
    "type": (
        'hli.gpCh[0].bahn_mc_control.override.command_w = "a"',
        "Incompatible types",
    ),
    "block": ("ContourLookahead(hli.gpCh[0].bahn_state)", "incompatible type"),
    "whole": ("FeedHold(hli)", "incompatible type"),
    "package": ("cnc_core.Cel", '"Cel"'),
}


def checked(path: Path, text: str) -> tuple[int, str]:
    """mypy's opinion of a user's file."""
    pytest.importorskip("mypy")
    path.write_text(text)
    done = subprocess.run(
        [
            *(sys.executable, "-m", "mypy", "--strict", "--config-file="),
            *("--follow-imports=silent", str(path)),
        ],
        capture_output=True,
        text=True,
        check=False,
        cwd=path.parent,
        # an editable installation is found by Python only
        env={**os.environ, "MYPYPATH": str(ROOT)},
    )
    return done.returncode, done.stdout


@pytest.mark.ci
def test_a_users_program_passes_the_type_checker(tmp_path: Path) -> None:
    """Members have the types of the memory."""
    assert checked(tmp_path / "user.py", RIGHT) == (
        0,
        "Success: no issues found in 1 source file\n",
    )


@pytest.mark.ci
def test_the_type_checker_finds_each_mistake(tmp_path: Path) -> None:
    """A typo, a wrong type and a wrong argument are told with their lines."""
    names = "ContourLookahead, FeedHold, connect"
    head = f"import cnc_core\nfrom plc_client import {names}\n\n"
    head += "hli = connect()\n"
    lines = [wrong for wrong, _ in WRONG.values()]
    code, said = checked(tmp_path / "user.py", head + "\n".join(lines) + "\n")
    assert code == 1
    for number, (_, text) in enumerate(WRONG.values(), head.count("\n") + 1):
        found = [
            one for one in said.splitlines() if f"user.py:{number}:" in one
        ]
        assert text in "".join(found), (number, said)


@pytest.fixture
def areas() -> Iterator[Areas]:
    """A segment with one channel and three axes."""
    segment = hli.create(unique_name(), 1, 3)
    yield Areas(segment)
    segment.close()
    segment.unlink()


def test_dir_names_the_members_once() -> None:
    """No gaps, no aliases, no inner names."""
    for structure in layout.structures():
        shown = dir(view_class(structure)(structure()))
        members = {
            name
            for name, *_ in structure._fields_  # type: ignore[misc]
            if not name.startswith("fill_")
        }
        assert set(shown) - members <= {"as_array"}
        assert members <= set(shown)
        assert len(shown) == len(set(shown))


def test_dir_of_the_packages() -> None:
    """What is imported late is named, too."""
    assert set(cnc_core.__all__) <= set(dir(cnc_core))
    assert all(hasattr(cnc_core, name) for name in cnc_core.__all__)
    assert "HLI_CHANNEL" in dir(hli.structures)


def test_repr_says_where_what_and_the_values(areas: Areas) -> None:
    """Few members stand in one line, many in a line each."""
    unit = areas.gpCh[0].contour_lookahead
    unit.request.length = 5.0
    assert repr(unit.request) == (
        "<hli.gpCh[0].contour_lookahead.request: "
        "HLI_CONTOUR_LOOKAHEAD_REQUEST\n"
        "  start_position = 0.0\n  length = 5.0>"
    )
    assert repr(areas.gpAx[1].lr_mc_control.drive_on) == (
        "<hli.gpAx[1].lr_mc_control.drive_on: MC_CONTROL_BOOL_UNIT\n"
        "  request_r = False\n  enable_w = False\n"
        "  command_w = False\n  state_r = False>"
    )
    shown = repr(areas.gpCh[0].bahn_state)
    assert "  g_function_r = [0, 0, 0, 0, 0, 0, 0, 0, ..]\n" in shown
    assert "  coord_r = HLI_COORD * " in shown
    assert "fill_" not in shown
    assert repr(areas.gpCh) == "<hli.gpCh[0..11]: 1 configured>"
    assert repr(areas.gpVEGlobal.value).startswith("<hli.gpVEGlobal.value: [0")


def test_repr_of_everything(areas: Areas) -> None:
    """Every structure shows itself, also one that nothing holds."""
    assert path_of(areas.gpCh[0].bahn_state.coord_r[2]) == (
        "hli.gpCh[0].bahn_state.coord_r[2]"
    )
    assert repr(snapshot(areas.gpCh[0].bahn_state)).startswith("<copy: ")
    for structure in layout.structures():
        assert structure.__name__ in repr(view_class(structure)(structure()))
