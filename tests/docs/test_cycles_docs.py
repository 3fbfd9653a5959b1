"""The page of the cycles names every number that a call is refused with."""

import re
from pathlib import Path

from cnc_core.frontend.isg.cycles.preview import CODES

PAGE = (
    Path(__file__).parents[2] / "docs" / "reference" / "cycles.md"
).read_text()


def test_every_code_stands_in_the_docs():
    """The numbers that a call may be refused with."""
    assert {str(code) for code in CODES} <= set(re.findall(r"\d+", PAGE))
