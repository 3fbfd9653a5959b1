"""The launcher's scratch folders."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ENDED_WITHIN = """
import os, sys, tempfile
from cnc_core.cell.scratch import scratch_folder
make = tempfile.mkdtemp

def hung_up(**words):
    made = make(**words)
    open(os.path.join(made, "report.json"), "w").close()
    sys.exit(129)

tempfile.mkdtemp = hung_up
scratch_folder()
"""


def test_a_signal_while_a_folder_is_made_leaves_none(tmp_path: Path) -> None:
    """A terminal that was gone just then left its folder to the next run: nobody
    had its name yet.
    """
    ended = subprocess.run(
        [sys.executable, "-P", "-c", ENDED_WITHIN],
        env=os.environ | {"TMPDIR": str(tmp_path)},
        check=False,
    )
    assert ended.returncode == 129
    assert list(tmp_path.iterdir()) == []


FORKED = """
import os, sys
from cnc_core.cell.scratch import scratch_folder
folder = scratch_folder()
child = os.fork()
if child == 0:
    sys.exit(0)
os.waitpid(child, 0)
sys.exit(not folder.is_dir())
"""


def test_a_child_takes_no_folder_away(tmp_path: Path) -> None:
    """A process that was forked from the launcher ends, and its folder stays."""
    ended = subprocess.run(
        [sys.executable, "-P", "-c", FORKED],
        env=os.environ | {"TMPDIR": str(tmp_path)},
        check=False,
    )
    assert ended.returncode == 0
    assert list(tmp_path.iterdir()) == []
