"""Fuzz what reads the input of strangers, and print what it covers.

    python bench/fuzz.py --hours 8 [--target engine ...] [--folder DIR] [--seed 1]
    python bench/fuzz.py --hours 0.1 --shake 50e6 --target scanner --target words

Two kinds of targets share the time, as many at once as ``--jobs`` says.  Those in
C run under libFuzzer with ASan and UBSan (``bench/fuzz_c.py``), those in Python
under atheris (``bench/fuzz_python.py``, ``pip install ".[fuzz]"``).  With ``--shake``
each target in C then runs so many inputs of its corpus that are changed blindly,
without sanitizers and counters, and a tenth as many with sanitizers.  Corpora grow in
the folder from run to run.  At the end each corpus is replayed: lines and edges
of C by clang's source coverage, lines of Python by coverage.  Inputs that break a
promise are kept in ``DIR/TARGET-broken``; the command ends with 1 if there is one.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fuzz_c

ROOT = Path(__file__).parents[1]
PYTHON_TARGETS = (
    "isg",
    "iso",
    "isons",
    "osai",
    "expressions",
    "cycles",
    "cell",
    "answers",
    "recordings",
    "orders",
    "mock",
)
Figures = dict[str, dict[str, tuple[int, int]]]


@dataclass(frozen=True)
class Done:
    """What a target did: executions, seconds, inputs that broke a promise."""

    target: str
    executions: int
    seconds: float
    broken: list[str]
    said: str = ""


class CFuzzing:
    """The targets in C, built once."""

    def __init__(self, folder: Path, targets: list[str]) -> None:
        self._folder, self._targets = folder, targets
        self._programs: dict[str, dict[str, Path]] = {}

    def build(self) -> None:
        """The fuzzers, and the programs that measure coverage."""
        for kind in fuzz_c.KINDS:
            build = fuzz_c.Build(self._folder / "build", kind)
            objects = build.objects(self._targets)
            self._programs[kind] = {
                target: build.program(target, objects)
                for target in self._targets
            }

    def run(self, target: str, seconds: float, seed: int) -> Done:
        """One target for so long."""
        began = time.monotonic()
        program = self._programs["fuzz"][target]
        corpus = self._folder / target
        ran = fuzz_c.run(target, program, corpus, seconds, seed)
        took = time.monotonic() - began
        broken = [path.name for path in ran.broken]
        return Done(target, ran.executions, took, broken, ran.said)

    def shake(self, target: str, times: int, seed: int) -> Done:
        """So many executions of changed inputs, and a tenth of them under the
        sanitizers.
        """
        began = time.monotonic()
        corpus = self._folder / target
        ran = [
            fuzz_c.shake(target, self._programs[kind][target], corpus, n, at)
            for kind, n, at in (
                ("shake", times, seed),
                ("checked", times // 10, seed + 1),
            )
        ]
        took = time.monotonic() - began
        executions = sum(one.executions for one in ran)
        broken = [path.name for one in ran for path in one.broken]
        said = "".join(one.said for one in ran)
        return Done(target, executions, took, broken, said)

    def coverage(self) -> Figures:
        """Per file, of all targets together."""
        corpora = {
            target: [
                path
                for path in (self._folder / target, fuzz_c.CORPUS / target)
                if path.is_dir()
            ]
            for target in self._targets
        }
        return fuzz_c.coverage(self._programs["cover"], corpora)


class PythonFuzzing:
    """The targets in Python, each in a process of its own."""

    def __init__(self, folder: Path, targets: list[str]) -> None:
        self._folder, self._targets = folder, targets

    def _call(self, *words: object) -> str:
        script = ROOT / "bench" / "fuzz_python.py"
        done = subprocess.run(
            [sys.executable, str(script), *map(str, words)],
            cwd=ROOT,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
            env=os.environ | {"OMP_NUM_THREADS": "1"},
        )
        if done.returncode and words[0] == "cover":
            raise SystemExit(done.stderr)
        return done.stdout

    def run(self, target: str, seconds: float, seed: int) -> Done:
        """One target for so long."""
        began = time.monotonic()
        found = self._folder / f"{target}-broken"
        found.mkdir(parents=True, exist_ok=True)
        before = fuzz_c.kept(found)
        self._call("fuzz", target, self._folder, int(seconds), seed)
        told = self._folder / f"{target}.json"
        figures = json.loads(told.read_text()) if told.exists() else {}
        took = time.monotonic() - began
        said = f"slowest {figures.get('slowest_s', 0)} s, {figures.get('memory_mb', 0)} MB"
        broken = sorted(path.name for path in fuzz_c.kept(found) - before)
        return Done(target, figures.get("executions", 0), took, broken, said)

    def coverage(self) -> Figures:
        """Per file; the lines that are missed stay in ``missing.json``."""
        out = self._call("cover", self._folder, *self._targets)
        found: dict[str, dict[str, Any]] = json.loads(out.splitlines()[-1])
        missing = {name: f["missing"] for name, f in found.items()}
        (self._folder / "missing.json").write_text(json.dumps(missing))
        return {name: {"lines": f["lines"]} for name, f in found.items()}


def print_coverage(found: Figures) -> None:
    """Shares of lines, and of edges where there are, per file and folder."""
    totals: dict[str, list[int]] = {}
    for name, figures in sorted(found.items()):
        shares = [
            f"{what} {reached}/{count} {100 * reached / max(count, 1):.1f} %"
            for what, (reached, count) in figures.items()
        ]
        print(f"{name:58} {'  '.join(shares)}")
        for what, (reached, count) in figures.items():
            key = f"{'/'.join(name.split('/')[:-1])} {what}"
            total = totals.setdefault(key, [0, 0])
            total[0] += reached
            total[1] += count
    for key, (reached, count) in totals.items():
        share = 100 * reached / max(count, 1)
        print(f"all of {key}: {reached}/{count} {share:.1f} %")


def share_time(
    targets: dict[str, Callable[[str, float, int], Done]],
    seconds: float,
    jobs: int,
    seed: int,
) -> list[Done]:
    """Each target for its share of the time, ``jobs`` at once."""
    each = max(5.0, seconds * jobs / len(targets))
    done = []
    with ThreadPoolExecutor(jobs) as pool:
        running = [
            pool.submit(run, target, each, seed)
            for target, run in targets.items()
        ]
        for one in running:
            done.append(one.result())
            print(json.dumps(done[-1].__dict__), flush=True)
    return done


def main() -> None:
    """See the module's text."""
    every = (*fuzz_c.TARGETS, *PYTHON_TARGETS)
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--hours", type=float, default=0.1)
    parser.add_argument("--target", action="append", choices=every)
    parser.add_argument("--folder", type=Path, default=Path("hli-cosim-fuzz"))
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--shake", type=float, default=0, metavar="TIMES")
    args = parser.parse_args()
    chosen = args.target or list(every)
    args.folder.mkdir(parents=True, exist_ok=True)
    folder = args.folder.resolve()
    of_c = [target for target in fuzz_c.TARGETS if target in chosen]
    of_python = [target for target in PYTHON_TARGETS if target in chosen]
    if of_c and (missing := fuzz_c.missing_tools()):
        raise SystemExit(f"the targets in C need clang: {missing}")
    c, python = CFuzzing(folder, of_c), PythonFuzzing(folder, of_python)
    if of_c:
        c.build()
    runs = dict.fromkeys(of_c, c.run)
    runs |= dict.fromkeys(of_python, python.run)
    done = share_time(runs, args.hours * 3600, args.jobs, args.seed)
    for target in of_c if args.shake else ():
        done.append(c.shake(target, int(args.shake), args.seed))
        print(json.dumps(done[-1].__dict__), flush=True)
    if of_c:
        print_coverage(c.coverage())
    if of_python:
        print_coverage(python.coverage())
    print("executions", sum(one.executions for one in done))
    if any(one.broken for one in done):
        sys.exit(1)


if __name__ == "__main__":
    main()
