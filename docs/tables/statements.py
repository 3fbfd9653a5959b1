"""The table of statements, from the cases that tests run."""

from __future__ import annotations

import tomllib
from pathlib import Path

STATEMENTS = Path(__file__).resolve().parents[2] / "tests" / "statements"
HEAD = "| Statement | Program | Gives | Oracle |\n|---|---|---|---|"


def statement_table(dialect: str) -> str:
    """A table of each section; rows of profiles name the lines of the setup
    that differ from the sample.
    """
    text = (STATEMENTS / f"{dialect}.toml").read_text(encoding="utf-8")
    guide = tomllib.loads(
        (STATEMENTS / "words.toml").read_text(encoding="utf-8")
    )
    kinds = {kind: len(all_.split()) for kind, all_ in guide[dialect].items()}
    told = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    tables = tomllib.loads(text)
    count = sum(len(table["rows"]) for table in tables.values())
    out = [
        f"{count} programs for {sum(kinds.values())} statements of the guide: {told}.\n"
    ]
    for section, table in tables.items():
        rows = "\n".join(_row(row) for row in table["rows"])
        out.append(f"**Section {section}**\n\n{HEAD}\n{rows}\n")
    return "\n".join(out)


def _row(row: list[str]) -> str:
    name, *setup, program, expected, oracle = row
    lines = [line for line in program.split("\n") if line]
    shown = " ".join(f"`{line}`" for line in lines)
    if setup and setup[0] not in ("", "NO"):
        shown += f"; setup `{setup[0]}`"
    cells = (name, shown, expected, oracle)
    return "| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |"
