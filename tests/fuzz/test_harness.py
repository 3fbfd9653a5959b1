"""Inputs of the C fuzzers, replayed: what broke once, and one of each kind.

``bench/fuzz.py`` runs the same harnesses for hours.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from cnc_core._engine import ffi, lib

from support.fuzz_replay import TARGETS, Harness, build

pytestmark = pytest.mark.sanitize("engine", "rows", "stages", "jerk", "curve")

CORPUS = Path(__file__).with_name("corpus")


@pytest.fixture(scope="module")
def harness(tmp_path_factory: pytest.TempPathFactory) -> Harness:
    """The harnesses over the engine that is installed."""
    return Harness(build(tmp_path_factory.mktemp("harness")))


def test_inputs_of_the_c_code_keep_their_promises(harness: Harness) -> None:
    """Numbers stay finite, samples keep the limits, output has its room."""
    said, seen = [], 0
    for target in TARGETS:
        for path in sorted((CORPUS / target).iterdir()):
            seen += 1
            words = harness.broken(target, path.read_bytes())
            said += [f"{target}/{path.name}: {words}"] if words else []
    assert said == []
    assert seen >= 4 * len(TARGETS)


def test_a_broken_promise_is_told(harness: Harness) -> None:
    """A scanner that reads behind its text, put in the place of the right one."""

    def too_far(*words: Any) -> int:
        size, result = words[2], ffi.cast("nc_scan_result *", words[-1])
        result.consumed = size + 1
        return int(lib.NC_SCAN_MORE)

    text = bytes(8) + b"G1 X1 F100\n"
    assert harness.broken("scanner", text) == ""
    with harness.instead("nc_scan", too_far, "PPNiPNP"):
        assert harness.broken("scanner", text).startswith("12 of 11 bytes")
