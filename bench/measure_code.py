"""How dense the code and the prose are: a table, and with --json its numbers.

Usage: ``measure_code.py [ROOT] [--json]``.
Python counts in cnc_core, hli and plc_client, C in c_ext and the ST run time,
prose in the README and docs.
Tokens of Python leave out comments, docstrings, newlines and indentation.
Tokens of C come from a small scanner.
The length of a function counts the lines from its first to its last.
A sentence ends with . : ? or ! before a blank; tables, code and headings are no prose.
"""

from __future__ import annotations

import ast
import io
import json
import re
import statistics
import sys
import tokenize
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

WIDTH = 100
TOKENS = 25
FILE_LINES = 600
SENTENCE_WORDS = 30
GENERATED = {"_engine.c", "_sync.c", "hli_layout.h"}
NO_TOKEN = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}
C_TOKEN = re.compile(
    r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])*\'|[A-Za-z_]\w*'
    r"|\.?\d[\w.]*(?:[eEpP][+-]?\d+)?|->|\+\+|--|<<=?|>>=?"
    r"|[-+*/%&|^=!<>]=|&&|\|\||[^\s\w]"
)
C_FUNCTION = re.compile(r"[A-Za-z_].*\)\s*\{")
NO_FUNCTION = ("#", "struct", "enum", "union", "typedef")
Documented = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Module


@dataclass
class Measured:
    """One source file: tokens a line, lines of its functions, names by their length."""

    tokens: dict[int, int] = field(default_factory=dict)
    functions: dict[str, int] = field(default_factory=dict)
    one_letter: int = 0
    longer: int = 0
    lines: int = 0
    wide: list[int] = field(default_factory=list)

    def name(self, word: str) -> None:
        """Count a name."""
        if len(word) == 1:
            self.one_letter += 1
        else:
            self.longer += 1


# ------------------------------------------------------------------ Python
def _docstring_line(node: ast.AST) -> int:
    """Line of a documentation string, 0 without one."""
    if not isinstance(node, Documented) or not node.body:
        return 0
    first = node.body[0]
    text = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    if text and isinstance(first.value.value, str):
        return first.lineno
    return 0


def python_file(text: str) -> Measured:
    """Measure a Python file."""
    out, tree = Measured(), ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            length = (node.end_lineno or node.lineno) - node.lineno + 1
            out.functions[f"{node.name}:{node.lineno}"] = length
    docs = {_docstring_line(node) for node in ast.walk(tree)}
    per_line: Counter[int] = Counter()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        line = token.start[0]
        documentation = token.type == tokenize.STRING and line in docs
        if token.type in NO_TOKEN or documentation:
            continue
        per_line[line] += 1
        if token.type == tokenize.NAME:
            out.name(token.string)
    out.tokens = dict(per_line)
    return out


# ----------------------------------------------------------------------- C
def _without_comments(text: str) -> str:
    def lines(match: re.Match[str]) -> str:
        return "\n" * match.group().count("\n")

    text = re.sub(r"/\*.*?\*/", lines, text, flags=re.S)
    return re.sub(r"//[^\n]*", "", text)


def _c_functions(lines: list[str]) -> Iterator[tuple[str, int]]:
    """(first line's text and number, lines) of every function."""
    depth, start = 0, 0
    for number, line in enumerate(lines, 1):
        begins = depth == 0 and C_FUNCTION.match(line)
        if begins and not line.startswith(NO_FUNCTION):
            start = number
        depth += line.count("{") - line.count("}")
        if start and depth == 0:
            yield f"{lines[start - 1].strip()}:{start}", number - start + 1
            start = 0


def c_file(text: str) -> Measured:
    """Measure a C file or header."""
    lines = _without_comments(text).splitlines()
    out = Measured(functions=dict(_c_functions(lines)))
    for number, line in enumerate(lines, 1):
        tokens = C_TOKEN.findall(line)
        if tokens:
            out.tokens[number] = len(tokens)
        for token in tokens:
            if re.match(r"[A-Za-z_]", token):
                out.name(token)
    return out


# ------------------------------------------------------------------- prose
def sentences(text: str) -> list[int]:
    """Words of every sentence of a page."""
    text = re.sub(r"```.*?```", " ", text, flags=re.S)
    plain = [
        line
        for line in text.splitlines()
        if not re.match(r"\s*(\||#|>|!\[)", line)
    ]
    text = re.sub(r"`[^`]*`", "x", "\n".join(plain))
    text = re.sub(r"^\s*[-*]\s+", ". ", text, flags=re.M)
    parts = re.split(r"(?<=[.:?!])\s+|\n\s*\n", text)
    words = [len(re.findall(r"[A-Za-z0-9'\-]+", part)) for part in parts]
    return [count for count in words if count > 2]


# ----------------------------------------------------------------- figures
def share(values: list[int], limit: int) -> float:
    """Values above a limit, in percent."""
    above = sum(value > limit for value in values)
    return 100.0 * above / max(1, len(values))


def percentile_95(values: list[int]) -> int:
    """The value that 5 % of the values exceed."""
    ordered = sorted(values)
    return ordered[int(0.95 * (len(ordered) - 1))] if ordered else 0


Names = tuple[str, ...]
LANGUAGES: dict[str, tuple[Names, Names, Callable[[str], Measured]]] = {
    "python": (("cnc_core", "hli", "plc_client"), (".py",), python_file),
    "c": (("c_ext", "plc_client/st/runtime"), (".c", ".h"), c_file),
}


def measured_files(root: Path, language: str) -> dict[str, Measured]:
    """Every file of a language, by its path below the root."""
    folders, suffixes, read = LANGUAGES[language]
    out = {}
    for folder in folders:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix not in suffixes or path.name in GENERATED:
                continue
            text = path.read_text(encoding="utf-8", errors="replace")
            found = read(text)
            found.lines = text.count("\n")
            found.wide = [
                number
                for number, line in enumerate(text.splitlines(), 1)
                if len(line) > WIDTH
            ]
            out[path.relative_to(root).as_posix()] = found
    return out


def folder_sizes(files: dict[str, Measured]) -> Counter[str]:
    """Files of every folder."""
    return Counter(path.rpartition("/")[0] for path in files)


def language_figures(files: dict[str, Measured]) -> dict[str, Any]:
    """The figures of one language's files."""
    tokens = [n for f in files.values() for n in f.tokens.values()]
    functions = [n for f in files.values() for n in f.functions.values()]
    sizes = {path: f.lines for path, f in files.items()}
    letters = sum(f.one_letter for f in files.values())
    names = letters + sum(f.longer for f in files.values())
    return {
        "tokens_a_line": round(statistics.mean(tokens), 2),
        "lines_over_25_tokens_percent": round(share(tokens, TOKENS), 2),
        "lines_over_100_columns": sum(len(f.wide) for f in files.values()),
        "one_letter_names_percent": round(100.0 * letters / max(1, names), 1),
        "function_lines": [
            statistics.median(functions),
            percentile_95(functions),
            max(functions),
        ],
        "longest_file": max(sizes.items(), key=lambda item: item[1]),
        "files_over_600": sum(n > FILE_LINES for n in sizes.values()),
        "fullest_folder": folder_sizes(files).most_common(1)[0],
        "lines": sum(sizes.values()),
    }


def prose_figures(root: Path) -> dict[str, Any]:
    """The figures of the README and the pages below docs."""
    pages = [root / "README.md", *sorted((root / "docs").rglob("*.md"))]
    said = {
        page.relative_to(root).as_posix(): sentences(
            page.read_text(encoding="utf-8")
        )
        for page in pages
    }
    every = [count for counts in said.values() for count in counts]
    means = {page: statistics.mean(n) for page, n in said.items() if n}
    rounded = [(round(mean, 1), page) for page, mean in means.items()]
    longest = sorted(rounded, reverse=True)
    return {
        "words_a_sentence": round(statistics.mean(every), 1),
        "over_30_percent": round(share(every, SENTENCE_WORDS), 1),
        "longest_pages": longest[:5],
    }


def measure(root: Path) -> dict[str, dict[str, Any]]:
    """All figures of a source tree."""
    out = {
        language: language_figures(measured_files(root, language))
        for language in LANGUAGES
    }
    return out | {"prose": prose_figures(root)}


def main(arguments: list[str]) -> None:
    """Print the table, or the numbers as JSON."""
    folders = [word for word in arguments if word != "--json"]
    result = measure(Path(folders[0] if folders else "."))
    if "--json" in arguments:
        print(json.dumps(result))
        return
    for kind, figures in result.items():
        print(kind)
        for name, value in figures.items():
            print(f"  {name:32} {value}")


if __name__ == "__main__":
    main(sys.argv[1:])
