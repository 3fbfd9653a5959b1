"""The documentation does what it says: every command and code block of every
page is executed, page by page.

Blocks of a page run in their order in one folder. ``python``: a script;
``bash`` and ``sh``: commands; ``file=NAME`` behind the language: the block is
written to that file instead; ``in=NAME``: run in a copy of that folder of the
project. A comment ``<!-- docs-test: skip, REASON -->`` on the line before leaves
a block out.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from plc_client import blocks
from plc_client.blocks import FunctionBlock, ProcessState
from support.warm_commands import SCRIPT, Server

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
RUNS = ("python", "bash", "sh")
KNOWN = (*RUNS, "text", "toml", "mermaid", "nc", "c", "js", "json", "")
FENCE = re.compile(
    r"^```(\{?\w*\}?)([^\n]*)\n(.*?)^```[ \t]*$", re.DOTALL | re.MULTILINE
)
SKIP = re.compile(r"<!-- docs-test: skip, (.+?) -->\n$")
PART = (
    "N10 G01 X40 Y0 F6000\nN20 G03 X42 Y2 I0 J2\nN30 G01 Y30\nN40 X0\nN50 M30\n"
)


@dataclass(frozen=True)
class Block:
    """One fenced block."""

    line: int
    language: str
    options: dict[str, str]
    text: str
    skip: str


def blocks_of(page: Path) -> Iterator[Block]:
    text = page.read_text()
    for match in FENCE.finditer(text):
        if match[1].startswith("{"):
            continue  # a directive of the site (toctree): nothing to run
        options = dict(item.split("=", 1) for item in match[2].split())
        skip = SKIP.search(text[: match.start()])
        line = text[: match.start()].count("\n") + 1
        yield Block(line, match[1], options, match[3], skip[1] if skip else "")


def run(block: Block, folder: Path, programs: Path, warm: Server) -> None:
    """Execute one block; fails with its output."""
    python = Path(sys.executable).parent
    environment = os.environ | {
        "PATH": f"{programs}:{python}:{os.environ['PATH']}",
        "MPLBACKEND": "Agg",
        "PYTHONPATH": str(folder),
        "PYTEST_ADDOPTS": "-p no:cacheprovider",
    }
    where = folder / block.options.get("in", "")
    if block.language == "python":
        script = folder / f"block_{block.line}.py"
        script.write_text(block.text)
        command = warm.command(SCRIPT, script)
    else:
        command = [
            "bash",
            "-euo",
            "pipefail",
            "-c",
            block.text.replace(".venv/bin/", ""),
        ]
    done = subprocess.run(
        command,
        cwd=where,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, (
        f"block at line {block.line}:\n{block.text}\n{done.stdout}\n{done.stderr}"
    )


def executable(page: Path) -> bool:
    return any(
        b.language in RUNS or "file" in b.options for b in blocks_of(page)
    )


@pytest.mark.ci
@pytest.mark.parametrize(
    "page",
    [p for p in PAGES if executable(p)],
    ids=lambda p: str(p.relative_to(ROOT)),
)
def test_every_block_of_the_page_works(
    page: Path,
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    warm_commands: Server,
) -> None:
    """In the page's order, in one folder that holds a small part.nc and the project's examples."""
    programs = tmp_path_factory.mktemp("programs")
    warm_commands.programs(programs)
    (tmp_path / "part.nc").write_text(PART)
    shutil.copytree(
        ROOT / "examples",
        tmp_path / "examples",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    for block in blocks_of(page):
        if block.skip:
            continue
        if "file" in block.options:
            (tmp_path / block.options["file"]).write_text(block.text)
        elif block.language in RUNS:
            run(block, tmp_path, programs, warm_commands)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_pictures_and_languages_exist(page: Path) -> None:
    """Relative links lead somewhere; no block has a language this runner does not know."""
    text = page.read_text()
    for target in re.findall(
        r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", FENCE.sub("", text)
    ):
        assert (page.parent / target).exists(), f"{page.name}: {target}"
    assert {b.language for b in blocks_of(page)} <= set(KNOWN)


def diagrams() -> dict[str, set[str]]:
    """State names of the diagrams of docs/reference/plc.md by the name of their Enum."""
    found: dict[str, set[str]] = {}
    text = (ROOT / "docs" / "reference" / "plc.md").read_text()
    section = re.compile(
        r"^### [^\n]*`(\w+)`\n(?:(?!^###).)*?```mermaid\n(.*?)```",
        re.DOTALL | re.MULTILINE,
    )
    for title, body in section.findall(text):
        names = re.findall(r"^\s*(\S+) --> ([\w\[\]*]+)", body, re.MULTILINE)
        found[title] = {name for pair in names for name in pair} - {"[*]"}
    return found


def test_every_state_of_every_block_is_drawn() -> None:
    """Each Enum of block states has a diagram with exactly its states."""
    drawn = diagrams()
    enums = {
        value.__name__: {member.value for member in value}
        for name in blocks.__all__
        if isinstance(value := getattr(blocks, name), type)
        and name.endswith("State")
        and value is not ProcessState
    }
    assert enums
    for name, states in enums.items():
        assert drawn[name] == states, name
    assert drawn["ProcessState"] == {
        s.name.lower() for s in ProcessState if s <= ProcessState.ERROR
    }


def test_every_block_is_in_the_table() -> None:
    """docs/reference/plc.md names every function block."""
    text = (ROOT / "docs" / "reference" / "plc.md").read_text()
    for name in set(blocks.__all__) - {"FunctionBlock", "ExecuteBlock"}:
        value = getattr(blocks, name)
        if isinstance(value, type) and issubclass(value, FunctionBlock):
            assert f"`{name}" in text, name


def test_ten_lines_from_import_to_the_plot() -> None:
    """The notebook snippet of the tutorial has ten lines."""
    snippet = [
        b.text
        for b in blocks_of(ROOT / "docs" / "tutorial" / "ten_minutes.md")
        if b.language == "python"
    ][-1]
    assert len(snippet.strip().splitlines()) == 10
