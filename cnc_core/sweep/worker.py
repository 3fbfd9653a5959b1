"""A process that makes runs of a study: a number in, a line out.

``STUDY FOLDER PARENT``: the study's file, the sweep's folder, who started it.
Answers are ``done NUMBER`` and ``failed NUMBER REASON``: the row could not be
kept.  It ends with its standard input, and with its parent.
"""

from __future__ import annotations

import signal
import sys
from pathlib import Path

from hli._sync import lib

from .ledger import leave
from .one import make, recording_of
from .points import points
from .study import Study


def serve(study_file: Path, folder: Path) -> None:
    """Answer every number of standard input."""
    study = Study.read(study_file)
    runs = points(study)
    for line in sys.stdin:
        number = int(line)
        try:
            record = recording_of(study, folder, number)
            row = make(study, study_file.parent, runs[number], record)
            leave(folder, number, row)
            _say(f"done {number}")
        except OSError as error:
            _say(f"failed {number} {error}")


def _say(text: str) -> None:
    sys.__stdout__.write(text.replace("\n", " ") + "\n")  # type: ignore[union-attr]
    sys.__stdout__.flush()  # type: ignore[union-attr]


def _leave(*_: object) -> None:
    """The run under way takes its processes, segment and files with it."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # one is enough
    sys.exit(143)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends it
    signal.signal(signal.SIGTERM, _leave)
    if lib.hs_die_with_parent(signal.SIGTERM, int(sys.argv[3])) == 0:
        serve(Path(sys.argv[1]), Path(sys.argv[2]))
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # on the way out already
