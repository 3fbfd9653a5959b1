"""``hli-cosim new``: a folder that works at once, or nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from cnc_core.commands import new
from cnc_core.errors import CncError
from support.command_line import Outcome

Cli = Callable[..., Outcome]


@pytest.mark.ci_cases
@pytest.mark.parametrize("kind", ["python", "st"])
def test_its_test_passes_at_once(kind: str, tmp_path: Path) -> None:
    """From any working folder, beside a project with settings of its own."""
    (tmp_path / "pyproject.toml").write_text(
        "[tool.pytest.ini_options]\naddopts = '--no-such-option'\n"
    )
    new.make(tmp_path / "my-cell", kind)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", tmp_path / "my-cell"],
        cwd=tmp_path.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert "2 passed" in done.stdout


@pytest.mark.parametrize("kind", ["python", "st"])
def test_every_file_can_be_read(kind: str, tmp_path: Path) -> None:
    """No placeholder is left, and settings are what their tools read."""
    folder = tmp_path / "x"
    new.make(folder, kind)
    files = [path for path in folder.rglob("*") if path.is_file()]
    names = {str(path.relative_to(folder)) for path in files}
    assert {".gitignore", ".vscode/settings.json", "README.md"} < names
    for path in files:
        text = path.read_text()
        assert "$" not in text, path
        assert all(len(line) <= 100 for line in text.splitlines()), path
        if path.suffix == ".json":
            json.loads(text)
        if path.suffix == ".toml":
            tomllib.loads(text)


def test_the_command_tells_what_comes_next(cli: Cli, tmp_path: Path) -> None:
    """The lines it prints are commands."""
    done = cli("new", tmp_path / "a", "--st")
    assert (done.status, done.err) == (0, "")
    assert f"  cd {tmp_path / 'a'}\n" in done.out
    assert "  hli-cosim run part.nc --config cell.toml --plc machine.st" in (
        done.out
    )


def test_what_is_there_stays(tmp_path: Path) -> None:
    """A folder with anything in it, and a file, are refused by name."""
    folder = tmp_path / "a"
    folder.mkdir()
    (folder / "mine").write_text("1")
    with pytest.raises(CncError, match=r"a: .*not empty; choose another"):
        new.make(folder, "python")
    with pytest.raises(CncError, match=r"mine: .*a file is there"):
        new.make(folder / "mine", "python")
    with pytest.raises(CncError, match=r"none: .*make it first"):
        new.make(tmp_path / "none" / "a", "python")
    assert os.listdir(folder) == ["mine"]
    assert os.listdir(tmp_path) == ["a"]


def test_an_empty_folder_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also the one where the user stands."""
    (tmp_path / "a").mkdir()
    monkeypatch.chdir(tmp_path / "a")
    new.make(Path("."), "python")
    assert Path("part.nc").is_file()
    assert "# a\n" in Path("README.md").read_text()


@pytest.mark.parametrize("there", [False, True])
def test_nothing_half_written_is_left(
    there: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wherever it fails, the folder is as it was."""
    folder = tmp_path / "a"
    if there:
        folder.mkdir()
    real, calls = os.rename, [0]

    def rename(*args: Path) -> None:
        calls[0] += 1
        if calls[0] == 3 or not there:
            raise KeyboardInterrupt
        real(*args)

    monkeypatch.setattr(os, "rename", rename)
    with pytest.raises(KeyboardInterrupt):
        new.make(folder, "python")
    left = [path.name for path in tmp_path.rglob("*")]
    assert left == (["a"] if there else [])


def test_a_full_disk_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither does an error while the draft is written."""

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", fail)
    with pytest.raises(OSError, match="No space"):
        new.make(tmp_path / "a", "st")
    assert not os.listdir(tmp_path)
