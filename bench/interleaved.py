"""Planner and GEO switched at every atomic access, run after run, each of another seed.

    python bench/interleaved.py --runs 300 [--first 1000] [--log runs.jsonl]
    python bench/interleaved.py --runs 40 --undo tail

Builds the engine from a clone of what is committed with HLI_COSIM_INTERLEAVE=1 and
drives random programs under random commands (``tests/support/commanded.py``).  No sample
may exceed a limit: a jump is many times the jerk limit.  ``--undo NAME`` takes back what
once mended a jump that the threads had shown, to see whether these runs would find it.
``--threads`` drives what ``tests/unit/engine/test_threads.py`` drives instead.
The log has a line of JSON a run; runs that it has already are left out.
Ends with 1 if a run is broken (``--undo``: if none is).
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
OPTIONS = ("", "n", "nc", "c", "f", "nf")
UNDONE = {
    "tail": (
        "c_ext/engine/geo/interpolate.c",
        "tails[index].first + (uint32_t)beyond;",
        "tails[index].first + 0 * (uint32_t)beyond;",
    ),
    "shorten": (
        "c_ext/engine/run/run_ring.c",
        "piece_position(engine, piece, s, end);",
        "piece_position(engine, piece, s, end); store_f64_release(&piece->length, s);",
    ),
}
"""Motion that was taken back after it was driven began again; a piece that was
shortened under GEO had its length before its end."""


def build(folder: Path, undo: str | None) -> Path:
    """Where the packages of a clone lie, with places to switch at."""
    tree, site = folder / "tree", folder / "site"
    subprocess.run(["git", "clone", "-q", ROOT, tree], check=True)
    if undo:
        name, old, new = UNDONE[undo]
        text = (tree / name).read_text()
        if text.count(old) != 1:
            raise SystemExit(f"{name} has no longer what {undo} takes back")
        (tree / name).write_text(text.replace(old, new))
    words = ("-m", "pip", "install", "-q", "--no-deps", "--target", site, tree)
    subprocess.run(
        [sys.executable, *map(str, words)],
        env=os.environ | {"HLI_COSIM_INTERLEAVE": "1"},
        check=True,
    )
    return site


def driven(seed: int, folder: Path, threads: bool) -> dict[str, Any]:
    """One run: what it came to, and the words of the test that it breaks."""
    import numpy as np  # noqa: PLC0415 of the environment that was built
    from cnc_core._engine import lib  # noqa: PLC0415

    from cnc_core.engine import Event  # noqa: PLC0415
    from hli import layout  # noqa: PLC0415
    from support import threaded  # noqa: PLC0415
    from support.commanded import config, drive, program  # noqa: PLC0415
    from support.inside import Inside  # noqa: PLC0415
    from support.limits import legal, shares  # noqa: PLC0415

    rng = np.random.default_rng(seed)
    options, rehearse = OPTIONS[seed % 6], seed % 4 == 3
    geo_first, more = seed // 6 % 2, {}
    if threads:
        options, rehearse = "threads", seed // 8 % 2 > 0
        geo_first = seed // 4 % 2
        more = {"service": layout.HLI_SERVICE_IMMEDIATE}
        text, cell = threaded.PROGRAM, threaded.CONFIG % threaded.FUNCTIONS
    else:
        text = program(rng)
        cell = config(rng, options)
    told: dict[str, Any] = {"seed": seed, "options": options, "broken": ""}
    with Inside(folder, text, cell, **more) as cnc:

        def cycles(n: int, turn: int) -> Event:
            ran = lib.engine_interleaved(
                cnc.engine._handle,
                n,
                seed * 100_003 + turn,
                geo_first,
                rehearse,
            )
            return Event(ran)

        try:
            if threads:
                threaded.drive_in_turns(cnc, rng, cycles)
                pos = cnc.pos
            else:
                pos, _ = drive(cnc, rng, cycles)
            found = shares(pos, cnc.cell, ended=False)
            told |= {"cycles": len(pos), **found._asdict()}
            legal(pos, cnc.cell)
        except AssertionError as error:
            told["broken"] = str(error).splitlines()[0][:200]
    return told


def drive_all(seeds: list[int], threads: bool) -> None:
    """In a process of the engine that was built: a line of JSON a run."""
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:
            print(json.dumps(driven(seed, Path(folder), threads)), flush=True)


def runs(site: Path, seeds: list[int], threads: bool, log: Path) -> None:
    """The seeds in a process of their own, their lines behind the log."""
    code = f"import interleaved; interleaved.drive_all({seeds}, {threads})"
    paths = [site, ROOT / "tests", ROOT / "bench"]
    with log.open("a") as out:
        subprocess.run(
            [sys.executable, "-P", "-c", code],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(map(str, paths))},
            stdout=out,
            check=True,
        )


def judged(lines: list[dict[str, Any]]) -> int:
    """Print what the runs came to; how many are broken."""
    broken = [line for line in lines if line["broken"]]
    whole = [line for line in lines if "jerk" in line]
    most = {
        name: max((line[name] for line in whole), default=0.0)
        for name in ("velocity", "acceleration", "jerk")
    }
    cycles = sum(line["cycles"] for line in whole)
    print(f"{len(lines)} runs, {cycles} cycles, {len(broken)} broken;", most)
    for line in broken[:10]:
        print(f"  seed {line['seed']} {line['options']!r}: {line['broken']}")
    return len(broken)


def series(args: argparse.Namespace, undo: str | None, folder: Path) -> int:
    """All seeds of one build; how many runs are broken."""
    log = args.log if args.log and not undo else folder / "runs.jsonl"
    done = log.read_text().splitlines() if log.exists() else []
    known = {json.loads(line)["seed"] for line in done}
    wanted = range(args.first, args.first + args.runs)
    site = args.site or build(folder, undo)
    left = [seed for seed in wanted if seed not in known]
    runs(site, left, args.threads, log)
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    print(f"{undo} taken back: " if undo else "", end="")
    return judged(lines)


def main() -> None:
    """See the module's text."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--first", type=int, default=1000)
    parser.add_argument("--log", type=Path)
    parser.add_argument("--undo", action="append", choices=UNDONE, default=[])
    parser.add_argument("--threads", action="store_true")
    parser.add_argument("--site", type=Path, help="built already")
    args = parser.parse_args()
    bad = False
    for undo in args.undo or [None]:
        with tempfile.TemporaryDirectory() as scratch:
            broken = series(args, undo, Path(scratch))
        bad |= broken == 0 if undo else broken > 0
    sys.exit(bad)


if __name__ == "__main__":
    main()
