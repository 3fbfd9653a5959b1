"""Right programs with a few signs, words or lines changed, and how a check of them is judged."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from pathlib import Path

from cnc_core.config import CellConfig, parse_config
from cnc_core.errors import ERRORS, CncError
from cnc_core.program import Program
from support.paths import GOLDEN

DIALECTS = ("isg", "iso", "isons", "osai")
CELL = """
[axes.X]
[axes.Y]
[axes.Z]
[axes.A]
kind = "rotary"
[tools.1]
radius_mm = 5.0
length_mm = 20.0
[external.GO]
type = "UNS32"
"""
# work: physical lines that are read, and rows
LINES_MAX, ROWS_MAX = 300_000, 300_000
SIGNS = "GXYZIJKRFMNTDLPV#$%@[](){}<>=+-*/\\\"';:,. 0123456789²٣é\t\x00\n"
VALUES = ("1e9", "-1", "0", "1e-12", "99999999999999999999", ".", "[", "''")
UNCLEAR = re.compile(
    r"found ''|Traceback|\bNone\b|0\.\.-1|\bnan\b|object at 0x"
)


def right_programs(dialect: str) -> list[Path]:
    """Golden programs without an error."""
    found = []
    for folder in sorted(GOLDEN.glob(f"{dialect}_*")):
        expected = (folder / "expected.blocks").read_text()
        if not re.search(r'^\{"line"', expected, re.M):
            found += sorted(folder.glob("program.*"))
    return found


def replaced_sign(rng: random.Random, text: str) -> str:
    at = rng.randrange(len(text))
    return text[:at] + rng.choice(SIGNS) + text[at + 1 :]


def inserted_sign(rng: random.Random, text: str) -> str:
    at = rng.randrange(len(text) + 1)
    return text[:at] + rng.choice(SIGNS) + text[at:]


def removed_part(rng: random.Random, text: str) -> str:
    at = rng.randrange(len(text))
    return text[:at] + text[at + rng.randint(1, 6) :]


def cut_off(rng: random.Random, text: str) -> str:
    return text[: rng.randrange(len(text))]


def changed_value(rng: random.Random, text: str) -> str:
    numbers = list(re.finditer(r"\d+(?:\.\d*)?", text))
    if not numbers:
        return text
    one = rng.choice(numbers)
    return text[: one.start()] + rng.choice(VALUES) + text[one.end() :]


def moved_line(rng: random.Random, text: str) -> str:
    lines = text.splitlines(keepends=True)
    line = lines.pop(rng.randrange(len(lines)))
    if rng.random() < 0.7:
        lines.insert(rng.randint(0, len(lines)), line)
    return "".join(lines)


def doubled_line(rng: random.Random, text: str) -> str:
    lines = text.splitlines(keepends=True)
    lines.insert(rng.randint(0, len(lines)), rng.choice(lines))
    return "".join(lines)


def swapped_words(rng: random.Random, text: str) -> str:
    words = list(re.finditer(r"\S+", text))
    if len(words) < 2:
        return text
    first, second = sorted(rng.sample(words, 2), key=re.Match.start)
    return (
        text[: first.start()]
        + second[0]
        + text[first.end() : second.start()]
        + first[0]
        + text[second.end() :]
    )


CHANGES: tuple[Callable[[random.Random, str], str], ...] = (
    replaced_sign,
    inserted_sign,
    removed_part,
    cut_off,
    changed_value,
    moved_line,
    doubled_line,
    swapped_words,
)


def mutated(rng: random.Random, text: str) -> str:
    """One to three changes; the text is never empty."""
    for _ in range(rng.randint(1, 3)):
        text = rng.choice(CHANGES)(rng, text) or "\n"
    return text


def checked(
    path: Path,
    dialect: str,
    cell: CellConfig | None = None,
    answers: Path | None = None,
) -> tuple[list[CncError], int, int]:
    """Errors, rows and lines of a check."""
    rows, program = 0, None
    try:
        program = Program(
            path,
            cell or parse_config(CELL),
            dialect,
            collect=True,
            answers=answers,
        )
        for batch in program.batches():
            rows += len(batch.rows)
            if rows > ROWS_MAX:
                break
        return program.errors, rows, program.reader.block_count
    except CncError as error:
        lines = 0 if program is None else program.reader.block_count
        return [error, *error.also], rows, lines
    finally:
        if program is not None:
            program.reader.close()


def unclear(error: CncError) -> str:
    """What is wrong with an error; nothing if it is clear."""
    if error.code not in ERRORS:
        return "unknown number"
    if not error.place.file or error.place.line < 1:
        return "no place"
    if not error.text.strip() or UNCLEAR.search(error.text):
        return "unclear text"
    return ""
