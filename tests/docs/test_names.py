"""Pages name files and functions that exist.

Architecture and CONTRIBUTING are held whole: every file and every function with
``()``.  On all other pages and in the README every path is held.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

pytestmark = pytest.mark.source

ROOT = Path(__file__).resolve().parents[2]
CODE = ("cnc_core", "hli", "plc_client", "c_ext", "tests", "bench")
WALKS = [
    ROOT / "CONTRIBUTING.md",
    ROOT / "docs" / "explanation" / "architecture.md",
]
PAGES = sorted(
    {
        *WALKS,
        ROOT / "README.md",
        *(ROOT / "docs").rglob("*.md"),
    }
)
FENCE = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)
SPAN = re.compile(r"`([^`\n]+)`")
FUNCTION = re.compile(r"^[\w.]*?(\w+)\(\)$")
PLACE = re.compile(r"`[\w.]*?(\w+)\(\)`,? (?:in|of)\s+`([\w/.-]+\.(?:py|c|h))`")
FILE = re.compile(r"^[\w./-]+\.(?:py|c|h|pml|toml|md)$")
FOLDER = re.compile(rf"^(?:{'|'.join(CODE)}|docs|examples)(?:/[\w.-]+)*/?$")


def spans(page: Path) -> list[str]:
    """The texts in backticks outside of code blocks."""
    return SPAN.findall(FENCE.sub("", page.read_text()))


@cache
def sources() -> dict[str, str]:
    """Text of every source file of the project by its path."""
    return {
        str(path.relative_to(ROOT)): path.read_text()
        for folder in CODE
        for suffix in ("*.py", "*.c", "*.h")
        for path in (ROOT / folder).rglob(suffix)
    }


@cache
def files() -> tuple[str, ...]:
    """Paths of sources, pages and models."""
    pages = (ROOT / "docs").rglob("*.*")
    return (*sources(), *(str(path.relative_to(ROOT)) for path in pages))


def exists(name: str) -> bool:
    """A path from the root, or the end of the path of some file."""
    if (ROOT / name).exists():
        return True
    return any(path.endswith(f"/{name}") for path in files())


def c_functions(text: str) -> list[str]:
    """Names ahead of a bracket on the lines that begin at the margin."""
    heads = re.findall(r"^[A-Za-z_].*\(.*", text, re.MULTILINE)
    return [name for head in heads for name in re.findall(r"(\w+)\(", head)]


@cache
def defined_in(path: str) -> list[str]:
    """Functions and classes of Python, functions of C."""
    text = sources()[path]
    if path.endswith(".py"):
        pattern = r"^\s*(?:async )?(?:def|class) (\w+)"
        return re.findall(pattern, text, re.MULTILINE)
    return c_functions(text)


@cache
def functions() -> frozenset[str]:
    """All names that the code defines."""
    return frozenset(name for path in sources() for name in defined_in(path))


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_path_on_the_page_exists(page: Path) -> None:
    """Files and folders that stand in backticks, and tests that commands name."""
    named = {s for s in spans(page) if FOLDER.match(s)}
    if page in WALKS or page.parent.name == "explanation":
        named |= {s for s in spans(page) if FILE.match(s)}
    named |= set(re.findall(r"\btests/[\w/]+\.py", page.read_text()))
    assert not sorted(name for name in named if not exists(name))


@pytest.mark.parametrize("page", WALKS, ids=lambda p: p.name)
def test_every_function_on_the_page_exists(page: Path) -> None:
    """A name in backticks that ends with ``()`` is defined in the code."""
    named = {m[1] for s in spans(page) if (m := FUNCTION.match(s))}
    assert len(named) > 5
    assert not sorted(named - functions())


@pytest.mark.parametrize("page", WALKS, ids=lambda p: p.name)
def test_a_function_stands_in_the_file_that_the_page_names(page: Path) -> None:
    """``name()`` in ``path``: the file defines the function."""
    places = PLACE.findall(FENCE.sub("", page.read_text()))
    assert places
    wrong = [
        (name, path)
        for name, path in places
        if not any(
            name in defined_in(source)
            for source in sources()
            if f"/{source}".endswith(f"/{path}")
        )
    ]
    assert not wrong


def test_pages_that_the_code_names_exist() -> None:
    """A text or comment of the code sends nobody to a missing page."""
    files = [
        path
        for folder in ("cnc_core", "hli", "plc_client", "c_ext", "examples")
        for kind in ("*.py", "*.c", "*.h")
        for path in (ROOT / folder).rglob(kind)
    ]
    named = re.compile(r"\bdocs/[\w/]+\.md")
    missing = {
        f"{path.relative_to(ROOT)}: {page}"
        for path in files
        for page in named.findall(path.read_text(encoding="utf-8"))
        if not (ROOT / page).exists()
    }
    assert not missing
