"""Shared fixtures: the command line as a user runs it, programs on disk,
nothing left in shared memory.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from hli import layout
from support.browser import CHROMIUM, Browser
from support.command_line import SHM, Outcome
from support.osai_programs import shop
from support.paths import EVERY, SHARE, SHARES
from support.processes import leftovers
from support.rewriting import share_rewriting
from support.warm_commands import Server

__all__ = ["leftovers", "shop"]
BEFORE = pytest.StashKey[set[str]]()
FIRST_CASES = pytest.StashKey[dict[str, str]]()


@pytest.fixture(scope="session")
def warm_commands(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[Server]:
    """``hli-cosim`` without the start of Python; see support/warm_commands.py."""
    server = Server(tmp_path_factory.mktemp("warm"))
    yield server
    server.close()


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Debian's chromium; a test without it is skipped."""
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    found = Browser(tmp_path_factory.mktemp("browser") / "profile")
    yield found
    found.close()


@pytest.fixture
def cli(tmp_path: Path, warm_commands: Server) -> Callable[..., Outcome]:
    """Run ``hli-cosim`` in a folder of its own; ``cli("plan", path, "--json")``."""

    def call(*arguments: object, timeout: float = 300.0) -> Outcome:
        done = subprocess.run(
            warm_commands.command(*arguments),
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )
        return Outcome(done.returncode, done.stdout, done.stderr)

    return call


@pytest.fixture
def program(tmp_path: Path) -> Callable[..., Path]:
    """Write a text to a file below the test's folder."""

    def write(text: str, name: str = "part.nc") -> Path:
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


@pytest.fixture(autouse=True)
def nothing_left_in_shared_memory() -> Iterator[None]:
    """Every test leaves /dev/shm without segments of its own making, and
    without those of its children where no other tests run beside it.
    """
    begin = (f"t{os.getpid()}",)
    if "PYTEST_XDIST_WORKER" not in os.environ:
        begin += ("hli-",)
    before = set(os.listdir(SHM))
    yield
    left = _left_since(before, begin)
    assert not left, f"left in shared memory: {left}"


def pytest_configure(config: pytest.Config) -> None:
    share_rewriting(config)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """-n auto: one more than there are cores; many tests wait for processes."""
    return len(os.sched_getaffinity(0)) + 1


@pytest.hookimpl(tryfirst=True)
def pytest_itemcollected(item: pytest.Item) -> None:
    """``ci_cases``: the first case of such a test runs always, the others have
    the mark ``ci``.
    """
    if item.get_closest_marker("ci_cases"):
        name = item.nodeid.partition("[")[0]
        seen = item.session.stash.setdefault(FIRST_CASES, {})
        if seen.setdefault(name, item.nodeid) != item.nodeid:
            item.add_marker("ci")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(
    config: pytest.Config, items: list[pytest.Item]
) -> None:
    """HLI_COSIM_EVERY=N: of the cases of one test the first, and every Nth.
    HLI_COSIM_SHARE=K/N: of the files with tests that CI alone runs each Nth.
    """
    seen: Counter[str] = Counter()
    kept, left = [], []
    files: dict[Path, int] = {}  # of a file all: its tests may share a cell
    for item in items:
        name = item.nodeid.partition("[")[0]
        whole = item.get_closest_marker("ci")
        if whole and not item.get_closest_marker("long"):
            number = files.setdefault(item.path, len(files))
            (kept if number % SHARES == SHARE else left).append(item)
            continue
        (left if seen[name] % EVERY else kept).append(item)
        seen[name] += 1
    if left:
        items[:] = kept
        config.hook.pytest_deselected(items=left)


def pytest_sessionstart(session: pytest.Session) -> None:
    session.stash[BEFORE] = set(os.listdir(SHM))


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Tests that run beside each other leave no segment either."""
    if hasattr(session.config, "workerinput"):
        return
    if left := _left_since(session.stash[BEFORE], ("hli-",)):
        sys.stderr.write(f"\nleft in shared memory: {sorted(left)}\n")
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def _left_since(before: set[str], begin: tuple[str, ...]) -> set[str]:
    names = {n for n in os.listdir(SHM) if n.startswith(begin)}
    return {n for n in names - before if _owner_is_gone(n)}


def _owner_is_gone(name: str) -> bool:
    """Whether a segment stays behind its owner (other sessions on this machine
    have living ones).
    """
    for _ in range(50):
        try:
            head = layout.HLI_SEGMENT_HEAD.from_buffer_copy(
                (SHM / name).read_bytes()
            )
        except (OSError, ValueError):
            return False
        if (
            Path(f"/proc/{head.owner_pid}").exists()
            and head.owner_pid != os.getpid()
        ):
            return False
        time.sleep(0.02)
    return True
