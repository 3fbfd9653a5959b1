"""The tables of the reference, printed from the code into its pages, and the
types of the HLI's structures for editors.

A page keeps a table between ``<!-- generated: NAME ARGUMENT -->`` and
``<!-- end -->``.  ``python docs/generate.py`` names the pages that differ from
the code; with ``--write`` it writes them.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path

from tables import (
    cell,
    command_line,
    dialects,
    errors,
    members,
    statements,
    stub,
    units,
)

DOCS = Path(__file__).resolve().parent
UNITS = DOCS / "reference" / "hli"
STRUCTURES = DOCS.parent / "hli" / "structures.pyi"
REGION = re.compile(
    r"(<!-- generated: (\S+)(?: (\S+))? -->\n).*?(<!-- end -->)", re.DOTALL
)

TABLES: dict[str, Callable[[str], str]] = {
    "isg-g-functions": dialects.isg_g_functions,
    "isg-commands": dialects.isg_command_table,
    "iso-g-functions": dialects.iso_g_functions,
    "iso-m-functions": dialects.iso_m_functions,
    "osai-g-functions": dialects.osai_g_functions,
    "osai-setup-codes": dialects.osai_setup_codes,
    "isons-g-functions": dialects.isons_functions,
    "isons-parameters": dialects.isons_parameters,
    "cycle": dialects.cycle,
    "cell-keys": cell.cell_tables,
    "errors": errors.error_table,
    "hli-members": units.index_table,
    "hli-structure": members.structure_table,
    "hli-aliases": members.hli_aliases,
    "command-line": command_line.command_line,
    "statements": statements.statement_table,
}


def generated(text: str) -> str:
    """The page's text with its regions as the code has them."""

    def fill(region: re.Match[str]) -> str:
        body = TABLES[region[2]](region[3] or "")
        return f"{region[1]}\n{body}\n{region[4]}"

    return REGION.sub(fill, text)


def pages() -> list[Path]:
    """Those that are written by hand and hold tables."""
    found = sorted((DOCS / "reference").rglob("*.md"))
    found.append(DOCS / "measurements" / "statements.md")
    return [page for page in found if page.parent != UNITS]


def files() -> dict[Path, str]:
    """Every generated file with the text that the code gives."""
    found = {
        page: generated(page.read_text(encoding="utf-8")) for page in pages()
    }
    made = {UNITS / name: text for name, text in units.pages().items()}
    return found | made | {STRUCTURES: stub.stub()}


def main() -> int:
    differ = []
    for page, new in files().items():
        text = page.read_text(encoding="utf-8") if page.exists() else ""
        if new != text:
            differ.append(page)
            if "--write" in sys.argv:
                page.parent.mkdir(exist_ok=True)
                page.write_text(new, encoding="utf-8")
    for page in differ:
        print(page.relative_to(DOCS.parent))
    return 0 if "--write" in sys.argv else len(differ)


if __name__ == "__main__":
    sys.exit(main())
