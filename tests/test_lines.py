"""Lines, functions, files and folders stay small enough to read.

``bench/measure_code.py`` measures; the bounds stand here.
``tests/open_edges.txt`` lists what is not within them yet.
"""

from __future__ import annotations

from functools import cache

import pytest

from measure_code import (
    FILE_LINES,
    Measured,
    folder_sizes,
    language_figures,
    measured_files,
)
from support.open_edges import held
from support.paths import ROOT

pytestmark = pytest.mark.source

LANGUAGES = ("python", "c")
FUNCTION_LINES = 80
FOLDER_FILES = 25
BOUNDS = {
    "tokens_a_line": 8.0,
    "lines_over_25_tokens_percent": 0.6,
}
ONE_LETTER_NAMES_PERCENT = {"python": 5.0, "c": 12.0}
MEDIAN_LINES, P95_LINES = 10, 40
# one table of data each, read from top to bottom
TABLES = {"hli/layout.py", "c_ext/jerk/state/tuning.h"}


@cache
def measured(language: str) -> dict[str, Measured]:
    return measured_files(ROOT, language)


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_code_is_found(language: str) -> None:
    """The measure sees the folders of the project."""
    assert len(measured(language)) > 100
    assert sum(len(f.functions) for f in measured(language).values()) > 600


@pytest.mark.parametrize("language", LANGUAGES)
def test_lines_carry_few_tokens(language: str) -> None:
    """A line has 8 tokens in the mean, and rarely more than 25."""
    figures = language_figures(measured(language))
    over = [
        f"{language} -> {name}"
        for name, bound in BOUNDS.items()
        if figures[name] > bound
    ]
    held(f"figure of {language}", over)


@pytest.mark.parametrize("language", LANGUAGES)
def test_lines_are_narrow(language: str) -> None:
    """No line is longer than 100 columns."""
    wide = [path for path, f in measured(language).items() if f.wide]
    held(f"wide line of {language}", wide)


@pytest.mark.parametrize("language", LANGUAGES)
def test_functions_are_short(language: str) -> None:
    """A function has 10 lines in the median, 40 at the 95th percentile, 80 at most."""
    median, p95, _ = language_figures(measured(language))["function_lines"]
    assert median <= MEDIAN_LINES
    assert p95 <= P95_LINES
    long = [
        f"{path} -> {name.rpartition(':')[0]}"
        for path, f in measured(language).items()
        for name, lines in f.functions.items()
        if lines > FUNCTION_LINES
    ]
    held(f"long function of {language}", long)


@pytest.mark.parametrize("language", LANGUAGES)
def test_files_hold_one_idea(language: str) -> None:
    """A file has 600 lines at most, a table of data may be longer."""
    long = [
        path for path, f in measured(language).items() if f.lines > FILE_LINES
    ]
    held(f"long file of {language}", sorted(set(long) - TABLES))


@pytest.mark.parametrize("language", LANGUAGES)
def test_folders_are_surveyed_at_a_glance(language: str) -> None:
    """A folder holds 25 files at most."""
    sizes = folder_sizes(measured(language))
    assert {name: n for name, n in sizes.items() if n > FOLDER_FILES} == {}


@pytest.mark.parametrize("language", LANGUAGES)
def test_names_say_what_they_name(language: str) -> None:
    """Few names have one letter: those of mathematics."""
    figures = language_figures(measured(language))
    percent = figures["one_letter_names_percent"]
    assert percent <= ONE_LETTER_NAMES_PERCENT[language]
