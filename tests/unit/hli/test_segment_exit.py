"""A creator that is interrupted at any point leaves no name."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from support.fake_cnc import unique_name

SHM = Path("/dev/shm")
INTERRUPTED = """
import sys
from hli import segment
take = getattr(segment, sys.argv[2])
def then_stop(*arguments):
    result = take(*arguments)
    raise KeyboardInterrupt
setattr(segment, sys.argv[2], then_stop)
segment.create(sys.argv[1])
"""


@pytest.mark.ci_cases
@pytest.mark.parametrize("step", ["_open_draft", "_take_name", "_map_new"])
def test_interrupted_between_two_steps(step: str) -> None:
    """Ctrl-C behind the step, before anybody holds the segment."""
    name = unique_name()
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", INTERRUPTED, name, step],
        stderr=subprocess.PIPE,
        text=True,
    )
    _, told = process.communicate()
    assert "KeyboardInterrupt" in told
    assert not (SHM / name).exists()
    begin = f".hli-new-{process.pid}-"
    drafts = [p.name for p in SHM.iterdir() if p.name.startswith(begin)]
    assert drafts == [] or step == "_open_draft"
