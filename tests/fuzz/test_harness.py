"""Inputs of the C fuzzers, replayed: what broke once, and one of each kind.

``bench/fuzz.py`` runs the same harnesses for hours.
"""

from __future__ import annotations

import signal
import subprocess
from pathlib import Path
from typing import Any

import pytest
from cnc_core._engine import ffi, lib

from plc_client.st.machine.compiler import compiler
from support.fuzz_replay import HARNESS, TARGETS, Harness, build

pytestmark = pytest.mark.sanitize("engine", "rows", "stages", "jerk", "curve")

CORPUS = Path(__file__).with_name("corpus")


@pytest.fixture(scope="module")
def harness(tmp_path_factory: pytest.TempPathFactory) -> Harness:
    """The harnesses over the engine that is installed."""
    return Harness(build(tmp_path_factory.mktemp("harness")))


INPUTS = [
    (target, path.name)
    for target in TARGETS
    for path in sorted((CORPUS / target).iterdir())
]
BROKE = ("crash", "timeout", "shaken")


def promises_kept(harness: Harness, target: str, name: str) -> None:
    words = harness.broken(target, (CORPUS / target / name).read_bytes())
    assert words == "", f"{target}/{name}"


def test_inputs_that_broke_a_promise_once(harness: Harness) -> None:
    """All of them, under the sanitizers too."""
    broke = [(at, name) for at, name in INPUTS if name.startswith(BROKE)]
    assert len(broke) >= 10
    for target, name in broke:
        promises_kept(harness, target, name)


@pytest.mark.parametrize(
    ("target", "name"),
    [(at, name) for at, name in INPUTS if not name.startswith(BROKE)],
)
def test_inputs_of_the_c_code_keep_their_promises(
    harness: Harness, target: str, name: str
) -> None:
    """Numbers stay finite, samples keep the limits, output has its room."""
    promises_kept(harness, target, name)


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


BREAKS = """
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    for (size_t i = 0; i < size; i++) {
        if (data[i] == 7) {
            abort();
        }
    }
    return 0;
}
"""


def test_what_is_shaken_is_counted_and_kept(tmp_path: Path) -> None:
    """A byte that breaks comes about by a change; its input is kept."""
    (tmp_path / "breaks.c").write_text(BREAKS)
    (tmp_path / "input").write_bytes(b"aaaaaaaa")
    (tmp_path / "list").write_text(f"{tmp_path / 'input'}\n")
    shake, kept = tmp_path / "shake", tmp_path / "kept"
    sources = [HARNESS / "shake.c", tmp_path / "breaks.c"]
    subprocess.run([compiler(), *sources, "-o", shake], check=True)
    words = [shake, tmp_path / "list", kept]
    few = subprocess.check_output([*words, "2", "1", "64"])
    assert few == b"executions 2\n"
    many = subprocess.run([*words, "100000", "1", "64"], check=False)
    assert many.returncode == 128 + signal.SIGABRT
    assert 7 in kept.read_bytes()
