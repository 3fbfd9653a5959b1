"""Which C files of c_ext a run of tests has driven: ``driven_sources.py BUILD_FOLDER``.

The library is built with ``CFLAGS=--coverage LDFLAGS=--coverage``, then the tests run.
The command prints the share of executed lines of each C file.
It exits with 1 where no line of a C file was executed, or where a C file was not built.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
REPORT = re.compile(r"^File '(.+)'\nLines executed:([\d.]+)% of (\d+)", re.M)
NOT_JUDGED = {
    "c_ext/hli/bench.c",  # measures only, no test needs it
    "c_ext/hli/sync.c",  # in both modules under one object name: the counts collide
}
GENERATED = {"_engine.c", "_sync.c"}


def source_files() -> set[str]:
    """C files of the project, as paths below its folder."""
    found = (ROOT / "c_ext").rglob("*.c")
    return {
        path.relative_to(ROOT).as_posix()
        for path in found
        if path.name not in GENERATED
    }


def executed_percent(notes: Path) -> dict[str, float]:
    """Executed lines in percent of each C file that one object was built from."""
    done = subprocess.run(
        ["gcov", "-n", "-o", notes.parent, notes.with_suffix(".gcda")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    return {
        name: float(percent) for name, percent, _ in REPORT.findall(done.stdout)
    }


def driven(build: Path) -> dict[str, float]:
    """Share of executed lines of each source, in percent.

    A source that only includes its code has the share of its headers.
    """
    shares: dict[str, float] = {}
    for notes in sorted(build.rglob("c_ext/**/*.gcno")):
        found = executed_percent(notes)
        parts = notes.with_suffix(".c").parts
        name = "/".join(parts[parts.index("c_ext") :])
        share = found.get(name, max(found.values(), default=0.0))
        shares[name] = max(share, shares.get(name, 0.0))
    return shares


def main(build: Path) -> int:
    """Print the table; 1 where a source was not driven."""
    shares = driven(build)
    idle = []
    for name in sorted(source_files() - NOT_JUDGED):
        percent = shares.get(name, 0.0)
        print(f"{percent:6.1f} %  {name}")
        if percent == 0.0:
            idle.append(name)
    for name in idle:
        print(f"no line was executed: {name}", file=sys.stderr)
    return int(bool(idle))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
