"""The PLC process: ``python -P -m plc_client --name NAME (--file FILE.py
[--class QUALNAME] | --builtin NAME)``.
"""

from __future__ import annotations

import argparse
import gc
import json
import math
import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hli._sync import lib

from hli import layout
from hli.errors import HliError, HliNotFound, HliNotReady
from hli.interrupts import take_interrupts
from hli.orders import Orders
from hli.symbol import SymbolError

from . import builtin, stats
from .client import DEFAULT_NAME, Hli, connect
from .guard import Guard
from .online import (
    UNFIT,
    Forces,
    TaskSymbol,
    Watch,
    force_warnings,
    parse_force,
)
from .scan import Ending, Program, Scanner, report
from .scan_record import (
    TABLES,
    ScanRecord,
    memory_of,
    missing_rows,
    program_of,
)
from .sources import load_tasks
from .task import PlcError

_FIRST_RETRY_S, _RETRY_S = 0.001, 0.05
_TELL_S, _GAP_S = 3.0, 4.0  # a wait for a CNC is told, and again
_FIRST_ATTACH_S = 30.0  # with --once: a CNC that starts at the same time
"""A launched PLC has no limit: its launcher ends it where the CNC has failed."""


class Process:
    """Attach, scan, and (unless ``once``) attach again, until the end or a signal."""

    def __init__(self, args: argparse.Namespace) -> None:
        self._args = args
        self._name: str = args.name
        self.programs: list[Program] = []
        self.warnings: list[str] = []  # of its arguments
        self._once: bool = args.once
        self._scanner: Scanner | None = None
        self.signal = 0
        self.watch = Watch()
        self._forces = Forces()  # they outlive the CNC
        self._orders = Orders()
        self._inputs: dict[str, Any] = args.inputs
        self._guard = Guard(self._give_up, self._say)

    def load(self) -> None:
        """Raises PlcError, ValueError: what the arguments name cannot be loaded."""
        self.programs = _programs(self._args)

    def on_restart(self, _number: int, _frame: Any) -> None:
        """SIGUSR1: PLC restart before the next scan, with the file read anew;
        the CNC runs on.
        """
        if self._scanner is not None:
            self._scanner.request_restart()

    def on_signal(self, number: int, _frame: Any) -> None:
        """Signal handler: end after the current scan; the second signal ends a
        scan that never returns.
        """
        if self.signal:
            raise KeyboardInterrupt
        self.signal = number
        if self._scanner is not None:
            self._scanner.stop()

    def run(self) -> None:
        """Raises PlcError (the user's code), HliError (cannot attach; with
        ``once`` also: the CNC died).
        """
        try:
            self._attach_and_scan()
        finally:
            self._orders.close()
            if self.watch.to is not None:
                self.watch.to.close()

    def _tell(self, text: str) -> None:
        """A line of the PLC's life with its time, unless a launcher tells."""
        if not self._once:
            now = time.strftime("%H:%M:%S")
            print(f"{now} {text}", file=sys.stderr, flush=True)

    def _say(self, text: str) -> None:
        """A line for the user; a launcher passes on standard output."""
        file = sys.stdout if self._once else sys.stderr
        print(text, file=file, flush=True)

    def _attach_and_scan(self) -> None:
        listening = False
        while not self.signal:
            hli = self._attach()
            if hli is None:
                return
            with hli:
                came = "CNC came back" if listening else "attached"
                self._tell(f"{came}: segment {self._name!r}")
                listening = listening or self._listen()
                ending = self._scan(hli)
            if ending is not Ending.STOPPED:
                gone = "lost" if ending is Ending.CNC_GONE else "has ended"
                self._tell(f"CNC {gone}: segment {self._name!r}")
            if self._once and ending is Ending.CNC_GONE:
                raise HliError(f"the CNC behind segment {self._name!r} died")
            if self._once or ending is Ending.STOPPED:
                return
            self._wait_gone()

    def _attach(self) -> Hli | None:
        lasts = _FIRST_ATTACH_S if self._args.parent is None else math.inf
        end = time.monotonic() + lasts
        pause = _FIRST_RETRY_S
        began = told = time.monotonic()
        gap = _TELL_S
        while not self.signal:
            now = time.monotonic()
            if now - told > gap and not self._once:
                told, gap = now, min(max(_GAP_S, 0.5 * (now - began)), 60.0)
                self._say(
                    f"waits for a CNC for {now - began:.1f} s;"
                    f" hli-cosim cnc FILE --name {self._name}"
                )
            try:
                return connect(self._name, present=False)
            except (HliNotFound, HliNotReady):
                if self._once and time.monotonic() > end:
                    raise
                time.sleep(pause)
                pause = min(1.2 * pause, _RETRY_S)
        return None

    def _listen(self) -> bool:
        """Take orders from now on; a PLC that cannot still does its work."""
        try:
            self._orders.open(self._name)
        except HliError as error:
            print(f"warning: {error}", file=sys.stderr, flush=True)
        return True

    def _scan(self, hli: Hli) -> Ending:
        first = self._scanner is None
        self._scanner = Scanner(
            hli,
            self.programs,
            watch=self.watch,
            forces=self._forces,
            guard=self._guard,
            inputs=self._inputs,
        )
        self._scanner.before_restart = self._read_anew
        self._scanner.orders = self._orders
        self._scanner.on_start = self._tell_warnings
        if first:
            self._add_symbols(self._scanner)
            self._begin_record(hli, self._scanner)
        if self.signal:
            self._scanner.stop()
        gc.freeze()  # what is there now stays: no scan waits for a look at it
        return self._scanner.run()

    def _tell_warnings(self) -> None:
        """On standard error, unless a launcher reads the report."""
        for text in (
            ()
            if self._once
            else [
                *self.warnings,
                *(text for p in self.programs for text in p.warnings),
            ]
        ):
            print(f"warning: {text}", file=sys.stderr, flush=True)

    def _read_anew(self) -> Sequence[Program] | None:
        """The tasks of the file as it is now; None, and the old ones run on, if
        it cannot be loaded.

        A task keeps its statistics by the name of its class, and takes interval
        and priority of the new text; one whose class is gone runs no longer and
        stays in the report.
        """
        if self._args.builtin:
            return self.programs
        old = {p.name: p for p in self.programs}
        try:
            found = [(c, Program.of(c)) for c in _classes(self._args)]
        except PlcError as error:
            print(
                f"restart refused, the old program runs on: {error}",
                file=sys.stderr,
                flush=True,
            )
            return None
        now = [
            old[fresh.name].become(cls) if fresh.name in old else fresh
            for cls, fresh in found
        ]
        self.programs = [*now, *(p for p in self.programs if p not in now)]
        return now

    def _add_symbols(self, scanner: Scanner) -> None:
        table = scanner.symbols
        for path in self._args.watch:
            self.watch.add(path, table[path])
        for text in self._args.force:
            path, value = parse_force(text)
            symbol = table[path]
            self.warnings += force_warnings(symbol.path)
            if isinstance(symbol, TaskSymbol):
                scanner.forces.hold(
                    symbol.path, symbol, value
                )  # there after setup()
                continue
            try:
                scanner.forces.force(symbol.path, symbol, value)
            except SymbolError:
                raise
            except UNFIT as error:
                raise SymbolError(f"force {path}={value!r}: {error}") from None

    def _begin_record(self, hli: Hli, scanner: Scanner) -> None:
        args = self._args
        if args.record is not None:
            tables = args.record_table or TABLES
            self.watch.record_to(
                ScanRecord(
                    args.record,
                    self.watch.paths,
                    {
                        "plc": program_of(args.file, args.builtin or "")
                        | {
                            "args": args.args,
                            "inputs": args.inputs,
                            "force": args.force,
                            "st": args.st,
                        },
                        "memory": memory_of(hli),
                    },
                    scanner.trace() if "exchange" in tables else None,
                    waits=hli.cnc.clock != layout.HLI_CLOCK_REALTIME,
                )
            )

    def _give_up(self, text: str) -> None:
        """A task hangs and nothing interrupts it: tell what is known and leave."""
        program = next((p for p in self.programs if p.has("cyclic")), None)
        error = f"task watchdog: {text}" + (
            f" ({', '.join(p.name for p in self.programs)})" if program else ""
        )
        print(error, file=sys.stderr, flush=True)
        if self._args.report is not None:
            _store(
                self._args.report,
                {**report([], 0, stats.HANDSHAKES.quantiles()), "error": error},
            )
        os._exit(1)

    def _wait_gone(self) -> None:
        """After a shutdown: do not attach to the CNC that is just leaving."""
        time.sleep(_RETRY_S)


def main(argv: Sequence[str] | None = None) -> int:
    """Exit status: 0, 1 (error in the PLC program or at the segment), 2
    (usage), 130 (interrupted).
    """
    args = _arguments(argv)
    if (
        args.parent is not None
        and lib.hs_die_with_parent(signal.SIGTERM, args.parent) != 0
    ):
        return 1
    process = Process(args)
    error = ""
    interrupted = False
    try:
        take_interrupts()
        process.load()
        signal.signal(signal.SIGTERM, process.on_signal)
        signal.signal(signal.SIGINT, process.on_signal)
        signal.signal(signal.SIGUSR1, process.on_restart)
        process.run()
        interrupted = process.signal == signal.SIGINT
    except (PlcError, HliError, ValueError, OSError) as problem:
        error = str(problem)
    except KeyboardInterrupt:
        interrupted = process.signal != signal.SIGTERM
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1):
        # what is left takes no time and ends by itself
        signal.signal(number, signal.SIG_IGN)
    error = _write_report(args.report, process, error)
    if error:
        print(error, file=sys.stderr)
        return 1
    return 130 if interrupted else 0


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="plc_client", description="PLC process of a co-simulation cell"
    )
    parser.add_argument(
        "--name", default=DEFAULT_NAME, help="segment of the CNC"
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument(
        "--file", help="Python file with classes decorated by @task"
    )
    what.add_argument(
        "--builtin", choices=builtin.NAMES, help="built-in PLC program"
    )
    parser.add_argument(
        "--st",
        action="append",
        default=[],
        metavar="WORD",
        help="an option of Structured Text",
    )
    parser.add_argument("--class", dest="qualname", help="one class of --file")
    parser.add_argument(
        "--args", type=json.loads, default={}, help="JSON object for --builtin"
    )
    parser.add_argument(
        "--report", type=Path, help="write a JSON report here at the end"
    )
    parser.add_argument(
        "--record", type=Path, help="write the PLC's part of a recording here"
    )
    parser.add_argument(
        "--record-table",
        action="append",
        choices=TABLES,
        help="record this table alone; repeatable",
    )
    parser.add_argument(
        "--once",
        action="store_true",
        help="end with the CNC instead of waiting for the next one",
    )
    parser.add_argument(
        "--watch",
        action="append",
        default=[],
        metavar="SYMBOL",
        help="record a symbol at every scan",
    )
    parser.add_argument(
        "--force",
        action="append",
        default=[],
        metavar="SYMBOL=VALUE",
        help="hold a symbol at a value",
    )
    parser.add_argument(
        "--inputs",
        type=json.loads,
        default={},
        help="JSON object of simulated inputs",
    )
    parser.add_argument(
        "--parent", type=int, help="end when this parent process dies"
    )
    return parser.parse_args(argv)


def _programs(args: argparse.Namespace) -> list[Program]:
    if args.builtin:
        return [
            Program.of(builtin.load(args.builtin), args.args, name=args.builtin)
        ]
    return [Program.of(cls) for cls in _classes(args)]


def _classes(args: argparse.Namespace) -> list[type]:
    tell_on = sys.stdout if args.once else sys.stderr  # as Process._say
    return load_tasks(args.file, args.qualname, args.st, tell_on.fileno())


def _write_report(path: Path | None, process: Process, error: str) -> str:
    """Write the report beside its name, then rename; returns the error text,
    with that of ``result()`` added.
    """
    if path is None:
        return error
    counts = (stats.HANDSHAKES.n, stats.HANDSHAKES.quantiles())
    try:
        content = {
            **report(process.programs, *counts, process.watch),
            "error": error or None,
        }
    except PlcError as problem:
        error = error or str(problem)
        content = {
            **report(process.programs, *counts, process.watch, results=False),
            "error": error,
        }
    content["warnings"] = [*process.warnings, *content["warnings"]]
    if process.watch.to is not None:
        content["recording"] = missing_rows(process.watch.to)
    _store(path, content)
    return error


def _store(path: Path, content: dict[str, Any]) -> None:
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    part.write_text(json.dumps(content))
    part.replace(path)


if __name__ == "__main__":
    sys.exit(main())
