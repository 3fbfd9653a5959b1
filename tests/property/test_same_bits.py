"""The same program drives the same bits, on every interpreter and compiler.

``HLI_COSIM_GOLDEN=write`` writes the hashes anew, where a planner drives otherwise
on purpose; ``bench/determinism.py`` compares builds.
"""

from __future__ import annotations

import os

import pytest

from support.sample_hashes import (
    PROGRAMS,
    library,
    now,
    stored,
    stored_library,
    write,
)


def test_fifty_programs_drive_the_bits_that_are_stored() -> None:
    """Positions, ways and speeds of all their cycles."""
    if os.environ.get("HLI_COSIM_GOLDEN") == "write":
        write()
    if library() != stored_library():
        pytest.skip("another mathematics library, or another kind of processor")
    before = stored()
    assert len(before) == PROGRAMS
    after = now()
    assert {name for name in before if before[name] != after[name]} == set()
