"""What every error number means, where it comes from and what helps.

The texts stand in ``cnc_core/data/errors_*.txt``: a number, below it indented
its cause, then behind ``>`` its cure; both may go on in further lines.  Numbers
of function blocks (``error_id``) carry their text beside the number.
"""

from __future__ import annotations

import difflib
import functools
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from importlib.resources import files
from typing import Any

from .errors import ERRORS, CncError

CURE = ">"
NEAR = 3  # numbers that an unknown one is compared with


@dataclass(frozen=True)
class Explanation:
    """An error number: its text, why it comes and what helps."""

    code: int
    text: str
    cause: str
    cure: str

    def as_json(self) -> dict[str, Any]:
        """``{code, text, cause, cure}``."""
        return asdict(self)


def meanings() -> dict[int, str]:
    """Number -> text: of the CNC, the cell, the HLI and Structured Text."""
    from plc_client.st.errors import ST_ERRORS  # noqa: PLC0415

    return ERRORS | ST_ERRORS


@functools.cache
def catalogue() -> Mapping[int, Explanation]:
    """Every number in ascending order."""
    texts = meanings()
    found = {
        code: Explanation(code, text or texts[code], cause, cure)
        for code, text, cause, cure in _entries()
    }
    return {code: found[code] for code in sorted(found | texts)}


def explain(code: int) -> Explanation:
    """What a number means.

    CncError 900012: there is no such number; the text names near ones.
    """
    found = catalogue().get(code)
    if found is None:
        raise CncError(900012, f"there is no error {code}{_near(code)}")
    return found


def _near(code: int) -> str:
    """Numbers that somebody may have meant."""
    close = sorted(catalogue(), key=lambda one: abs(one - code))
    begin = [one for one in close if str(one).startswith(str(code))]
    like = difflib.get_close_matches(str(code), map(str, close), 2)
    near = dict.fromkeys([*begin, *map(int, like), *close])
    said = [f"{n} ({catalogue()[n].text})" for n in list(near)[:NEAR]]
    return f"; near it: {', '.join(said)}"


def _entries() -> Iterator[tuple[int, str, str, str]]:
    for file in files("cnc_core").joinpath("data").iterdir():
        if file.name.startswith("errors_"):
            yield from entries(file.read_text(encoding="utf-8"))


def entries(text: str) -> Iterator[tuple[int, str, str, str]]:
    """(number, text, cause, cure) of one file."""
    head, said = "", ""
    for line in [*text.splitlines(), ""]:
        if line.startswith(" "):
            said += f" {line.strip()}"
            continue
        if head:
            number, _, own = head.partition(" ")
            cause, _, cure = said.partition(f" {CURE} ")
            yield int(number), own, cause.strip(), cure.strip()
        head, said = line, ""
