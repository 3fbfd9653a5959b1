"""docs/reference/hli.md tells the truth about bytes and names."""

import ctypes
import re
from pathlib import Path

import pytest

from hli import layout

TEXT = (
    Path(__file__).resolve().parents[2] / "docs" / "reference" / "hli.md"
).read_text()


def test_byte_map_of_the_segment_is_the_layouts() -> None:
    """The drawn areas begin where the layout says, and every area is drawn."""
    drawn = [int(n) for n in re.findall(r"^ *(\d+)  \+-{60}\+", TEXT, re.M)]
    offsets = [
        getattr(layout.HLI_SEGMENT, name).offset
        for name, _ in layout.HLI_SEGMENT._fields_
    ]
    assert drawn == [*offsets, ctypes.sizeof(layout.HLI_SEGMENT)]


@pytest.mark.parametrize(
    "name",
    [
        n
        for n in dir(__import__("hli"))
        if n.startswith("Hli") and n != "HliError"
    ],
)
def test_every_error_is_in_the_table(name: str) -> None:
    """Attach errors by name."""
    assert f"`{name}`" in TEXT
