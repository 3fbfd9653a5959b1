"""Programs that begin the corpus of a dialect, with the files that lie beside them.

One input is a text of parts, as ``head`` prints several files: the program, then
``==> NAME`` and the text of each other file.  ``cell.toml`` is added to the cell,
``answers.json`` answers the dialogs.  Programs come from the golden files, the
tables of statements, the examples, and from the texts that stand in the tests.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from support.osai_programs import CELL_5_TEXT, SETUP_3, SETUP_5, changed
from support.paths import GOLDEN, ROOT, TESTS
from support.statements import Statement, statements

PART = re.compile(r"^==> ([A-Za-z0-9_.]{1,30})\n", re.MULTILINE)
CELL, ANSWERS, SETUP = "cell.toml", "answers.json", "CONFIG1"
LONGEST = 4000
"""Bytes of a program: one that is longer makes each of its changes slow."""
TABLE = re.compile(r"^\s*\[[a-z]+[.\w\]]", re.MULTILINE)
CODE = re.compile(r"[A-Z$#@(%]")
MARKS = {
    "isg": re.compile(
        r"^\s*#[A-Z]{2}|\bV\.[AELPSG]\.|\$IF|\$FOR", re.MULTILINE
    ),
    "isons": re.compile(r"^LIB_|^LOOP |^END_|\$_[A-Z]", re.MULTILINE),
    "osai": re.compile(r"^G6[01]$|^\([A-Z]{3},", re.MULTILINE),
}
"""Signs of a dialect's program in a test of something else."""


def parts_of(text: str) -> tuple[str, dict[str, str]]:
    """The program, and the files beside it by name."""
    main, *others = PART.split(text)
    return main, dict(zip(others[::2], others[1::2], strict=True))


def joined(main: str, files: dict[str, str]) -> str:
    """The input that ``parts_of`` takes apart."""
    parts = [main if main.endswith("\n") else f"{main}\n"]
    for name, text in files.items():
        parts += [f"==> {name}\n", text if text.endswith("\n") else f"{text}\n"]
    return "".join(parts)


# ------------------------------------------------------------- goldens, tables
def _files_beside(program: Path) -> dict[str, str]:
    found = {}
    for path in sorted(program.parent.iterdir()):
        other = path != program and not path.name.startswith("expected")
        if other and path.is_file() and path.stat().st_size < LONGEST:
            name = CELL if path.suffix == ".toml" else path.name
            found[name] = path.read_text("utf-8", "replace")
    return found


def of_goldens(dialect: str) -> Iterator[str]:
    """Right programs and wrong ones, those of the examples too."""
    golden = GOLDEN.glob(f"{dialect}_*/program.*")
    example = (ROOT / "examples").rglob(f"*.{dialect}")
    for path in sorted([*golden, *example]):
        if path.stat().st_size < LONGEST:
            text = path.read_text("utf-8", "replace")
            yield joined(text, _files_beside(path))


def setup_of(case: Statement) -> str:
    """The sample setup with the lines of the case (``5;``: of five axes)."""
    five, _, lines = case.setup.rpartition("5;")
    given = [one.partition("=") for one in lines.split(";") if one]
    changes = {key: line or None for key, _, line in given}
    is_five = bool(five) or "5;" in case.setup
    return changed(SETUP_5 if is_five else SETUP_3, **changes)


def of_statements(dialect: str) -> Iterator[str]:
    """The programs of the table of statements, if the dialect has one."""
    if dialect not in {"isons", "osai"}:
        return
    for case in statements(dialect):
        if dialect == "isons" or case.setup == "NO":
            yield joined(case.program, {})
        else:
            text, setup = f"(HSM,{SETUP})\n{case.program}", setup_of(case)
            rotary = "(AXI,A,5" in setup
            cell = {CELL: CELL_5_TEXT} if rotary else {}
            yield joined(text, {SETUP: setup, **cell})


# --------------------------------------------------------- texts of the tests
def _text_of(node: ast.AST) -> str:
    """A text as it stands; what a test puts into it is 1."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        return "".join(_text_of(value) or "1" for value in node.values)
    return ""


def _texts(node: ast.AST) -> Iterator[str]:
    """Texts that are no documentation, each once."""
    inner = [
        value
        for one in ast.walk(node)
        if isinstance(one, ast.JoinedStr)
        for value in one.values
    ]
    notes = [one.value for one in ast.walk(node) if isinstance(one, ast.Expr)]
    for one in ast.walk(node):
        if one not in inner and one not in notes:
            text = _text_of(one)
            if 1 < len(text) < LONGEST:
                yield text


def _of_test(test: ast.AST) -> Iterator[str]:
    """Each program of a test in the cell that the test writes."""
    texts = list(dict.fromkeys(_texts(test)))
    cells = [text for text in texts if TABLE.search(text)]
    files = {CELL: cells[0]} if cells else {}
    for text in texts:
        if text not in cells and CODE.search(text):
            yield joined(text, files)


def _of_file(path: Path) -> Iterator[str]:
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.Assign):
            yield from _of_test(node)


def of_tests(dialect: str) -> Iterator[str]:
    """Programs that stand in the tests of the dialect, or in others with its marks."""
    mark = MARKS.get(dialect)
    for path in sorted(TESTS.rglob("test_*.py")):
        own = path.parent.name == dialect or f"_{dialect}_" in path.name
        if own or mark:
            for text in _of_file(path):
                if own or (mark and mark.search(text)):
                    yield text


def programs(dialect: str) -> list[str]:
    """All of them, each once."""
    found = (of_goldens, of_statements, of_tests)
    return list(dict.fromkeys(text for of in found for text in of(dialect)))
