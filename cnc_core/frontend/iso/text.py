"""One line of text: comments taken out, blanks removed, every character
traceable to its column.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from cnc_core.frontend.base.lexer import fail

# Names of parameters are one token; there are no comparison signs.
PATTERN = re.compile(
    r"""(?P<NUMBER>[0-9]+(?:\.[0-9]*)?|\.[0-9]+)
      | (?P<NAME>[A-Za-z_]+)
      | (?P<OP>\*\*|<[^<>]*>|\S)""",
    re.X,
)


@dataclass
class Line:
    """``columns``: offset in the file's line of each character of ``text``, and
    of its end.
    """

    text: str = ""
    columns: list[int] = field(default_factory=list)
    comments: list[tuple[str, int]] = field(default_factory=list)


def squeeze(raw: str) -> Line:
    """The line without comments and blanks, both allowed anywhere."""
    line, at, kept = Line(), 0, []
    while at < len(raw) and raw[at] != ";":
        if raw[at] == "(":
            text = _comment(raw, at)
            line.comments.append((text, at))
            at += len(text) + 1
        elif not raw[at].isspace():
            kept.append(raw[at])
            line.columns.append(at)
        at += 1
    line.text = "".join(kept)
    line.columns.append(at)
    return line


def _comment(raw: str, opened: int) -> str:
    """What stands between the brackets."""
    end = raw.find(")", opened)
    if end < 0:
        raise fail(900013, "comment is not closed", opened)
    nested = raw.find("(", opened + 1, end)
    if nested >= 0:
        raise fail(900013, "comments do not nest", nested)
    return raw[opened + 1 : end]
