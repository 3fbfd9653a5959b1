"""A text of TOML into its values, with a bound for the depth of its keys."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from ..errors import ConfigError, Place

DOTTED_PARTS = 100
"""Of a key or a header; tomllib's memory grows with their square."""
PART = r"""(?:[\w-]++|"[^"\\\n]*+(?:\\.[^"\\\n]*+)*+"|'[^'\n]*+')"""
# where a key begins: a line, a header, an inline table
LONG_KEY = re.compile(
    r"(?:^|[{,])[ \t]*+\[{0,2}[ \t]*+"
    rf"(?:{PART}[ \t]*+\.[ \t]*+){{{DOTTED_PARTS}}}",
    re.MULTILINE,
)


def toml_of(text: str, file: str = "") -> dict[str, Any]:
    """The values of a text; ConfigError: nested too deeply; TOMLDecodeError."""
    long_key = LONG_KEY.search(text)
    if long_key:
        line = text.count("\n", 0, long_key.start()) + 1
        raise ConfigError("nested too deeply", Place(file, line))
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ConfigError("nested too deeply", Place(file)) from None
