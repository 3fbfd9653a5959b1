"""Whether the package works with the lowest versions that it says it takes.

    python bench/lowest_bounds.py [--extra test] [--wheel FILE] [--folder DIR] [TEST ...]

Builds a wheel with the lowest setuptools and cffi of ``pyproject.toml``, installs it
beside the lowest version of each dependency and of each of the extra's, in an
environment of its own, and runs the tests there, away from the repository: those that
reach every dependency unless others are named.  Run it on the oldest CPython that the
package takes.  A bound whose version does not exist, or with which a test fails, ends
it with 1.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
OWN = re.compile(r"hli-cosim\[(.+)\]")
BOUND = re.compile(r"([A-Za-z0-9_-]+)>=([\w.]+)")
PACKAGES = ("cnc_core", "hli", "plc_client")
TESTS = (
    "tests/unit/config",
    "tests/unit/frontend/base/test_golden.py",
    "tests/unit/hli",
    "tests/unit/recording",
    "tests/unit/rows",
    "tests/unit/structured_text",
    "tests/unit/monitor",
    "tests/unit/bridges",
    "tests/e2e/test_output.py",
    "tests/test_licences.py::test_what_is_installed_carries_the_list",
)


def bounds(requirements: Iterable[str]) -> dict[str, str]:
    """The lowest version of each requirement, by name; ValueError: it has none."""
    found = {}
    for text in requirements:
        if not (match := BOUND.match(text)):
            raise ValueError(f"{text} has no lower bound")
        found[match[1]] = match[2]
    return found


def lowest(project: dict[str, Any], extra: str) -> dict[str, str]:
    """Of the dependencies, of an extra, and of those that it names."""
    told = list(project["optional-dependencies"][extra])
    found = bounds(project["dependencies"])
    for text in told:
        if own := OWN.fullmatch(text):
            for other in own[1].split(","):
                found |= lowest(project, other)
        else:
            found |= bounds([text])
    return found


def run(*words: object, cwd: Path = ROOT, check: bool = True) -> int:
    """A command; its words are printed first."""
    said = [str(word) for word in words]
    print("+", *said, flush=True)
    return subprocess.run(said, cwd=cwd, check=check).returncode


def environment(folder: Path, wanted: Iterable[str]) -> Path:
    """The interpreter of a new environment with these packages."""
    run(sys.executable, "-m", "venv", folder)
    own = folder / "bin" / "python"
    run(own, "-m", "pip", "install", "-q", *wanted)
    return own


def wheel(folder: Path, requires: Iterable[str]) -> Path:
    """A wheel from the clone, built with the lowest tools."""
    exact = [f"{name}=={at}" for name, at in bounds(requires).items()]
    own = environment(folder / "build", [*exact, "wheel"])
    words = ("wheel", "-q", "--no-deps", "--no-build-isolation")
    run(own, "-m", "pip", *words, "-w", folder / "made", folder / "tree")
    (made,) = (folder / "made").glob("*.whl")
    return made


def tested(
    folder: Path, extra: str, made: Path | None, tests: list[str]
) -> int:
    """The tests' exit code, with the packages of the wheel."""
    content = tomllib.loads((ROOT / "pyproject.toml").read_text())
    clone = folder / "tree"
    run("git", "clone", "-q", ROOT, clone)
    made = made or wheel(folder, content["build-system"]["requires"])
    found = lowest(content["project"], extra)
    limits = folder / "lowest.txt"
    limits.write_text("".join(f"{n}=={at}\n" for n, at in found.items()))
    own = environment(folder / "venv", ["-c", limits, f"{made}[{extra}]"])
    run(own, "-m", "pip", "freeze")
    for name in PACKAGES:
        shutil.rmtree(clone / name)
    words = ("-P", "-m", "pytest", "-q", "-p", "no:cacheprovider")
    # an old version may use what its own requirements deprecate by now
    words += ("-W", "ignore::DeprecationWarning")
    return run(own, *words, *tests, cwd=clone, check=False)


def main() -> None:
    """See the module's text."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--extra", default="test")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--wheel", type=Path, help="built already")
    parser.add_argument("tests", nargs="*", default=list(TESTS))
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = (args.folder or Path(scratch)).resolve()
        made = args.wheel and args.wheel.resolve()
        sys.exit(tested(folder, args.extra, made, args.tests))


if __name__ == "__main__":
    main()
