"""Entry point of the CNC process."""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hli._sync import lib as sync

from hli.errors import HliError
from hli.interrupts import take_interrupts

from ..errors import CncError
from ..files import need_program
from .cnc_process import CncProcess
from .options import CncOptions

ASKED = (signal.SIGTERM, signal.SIGINT)  # also where the caller ignores them


def write_json(path: Path, value: Any) -> None:
    """Write beside the name, then rename: a reader sees the whole or nothing."""
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    part.write_text(json.dumps(value))
    part.replace(path)


def run_cnc(options: CncOptions) -> int:
    """Run one CNC process to its end; 0, 1 (program error or fault), 130
    (interrupted).
    """
    if options.core >= 0:
        os.sched_setaffinity(0, {options.core})
    for file in options.programs:
        if file is not None:
            need_program(file)
    process = CncProcess(options)
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN or number in ASKED:
            signal.signal(number, process.on_signal)
    take_interrupts()
    process.run()
    if options.report:
        write_json(options.report, process.report())
    if process.stop_signal == signal.SIGINT:
        return 130
    return 0 if process.end == "completed" or process.stop_signal else 1


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point of the launcher: options as one JSON object."""
    parser = argparse.ArgumentParser(prog="cnc_core.process")
    parser.add_argument("options", type=CncOptions.from_json)
    parser.add_argument("--parent", type=int)
    args = parser.parse_args(argv)
    if args.parent is not None and not _lives_with(args.parent):
        return 1
    try:
        return run_cnc(args.options)
    except (CncError, HliError) as error:
        print(error, file=sys.stderr)
        return 1


def _lives_with(parent: int) -> bool:
    """Ask for the parent's end as this process's; False if it has ended already."""
    return bool(sync.hs_die_with_parent(signal.SIGTERM, parent) == 0)


if __name__ == "__main__":
    sys.exit(main())
