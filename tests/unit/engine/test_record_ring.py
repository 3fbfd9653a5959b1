"""What is taken from the rings of the recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from support.inside import Inside


def test_what_was_taken_keeps_only_itself(tmp_path: Path) -> None:
    """A taken sample holds its own bytes alive, not the room it came through."""
    with Inside(tmp_path, "G1 X10 F1000\n") as cnc:
        cnc.run(1)
        for array in (cnc.parts[-1], cnc.paths[-1]):
            kept = array
            while isinstance(kept.base, np.ndarray):
                kept = kept.base
            assert len(array) == 1
            assert kept.nbytes <= 1024
