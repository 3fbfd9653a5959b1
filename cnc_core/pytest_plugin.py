"""pytest fixture ``cell``: the built-in machine, ended and removed from shared memory after each test."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from .cell import Cell


@pytest.fixture
def cell() -> Iterator[Cell]:
    """A co-simulation cell: ``cell.run("part.nc", plc=MyPlc)``."""
    with Cell() as value:
        yield value
