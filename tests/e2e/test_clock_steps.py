"""Steps of the wall clock do not matter: nothing that decides reads it, and a
run beside a jumping clock is as any.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from support.command_line import T1, command
from support.paths import ROOT

WALL_CLOCK = re.compile(
    r"\btime\.(time|time_ns|localtime|gmtime|ctime)\(|\bdatetime\.(now|today|utcnow)|\bCLOCK_(REALTIME|TAI)"
    r"|\bgettimeofday|\btime\((NULL|0|&)|FUTEX_CLOCK_REALTIME|\bsem_timedwait|\bpthread_cond_timedwait|\btimer_settime"
)
STAMPS = {
    # the date and time a message file asks for
    "cnc_core/frontend/isg/commands/text.py",
    # when a recording was made
    "cnc_core/recording/account.py",
    # when something happened, on the page of the monitor
    "cnc_core/observing/events.py",
    # when a message of a program came
    "cnc_core/process/operator_desk.py",
    # stamps of the values that servers tell
    "cnc_core/bridges/ads/notifications.py",
    "cnc_core/bridges/opcua/entries.py",
}
JUMPING = r"""
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>
static _Atomic long calls;
static long step(void) { long k = ++calls; return (k % 2 ? -1 : 1) * (86400L * 365 + k * 977); }
__attribute__((constructor)) static void loaded(void) {
    FILE *f = fopen(getenv("JUMPING_LOG"), "a");
    if (f) { fprintf(f, "%d\n", (int)getpid()); fclose(f); }
}
int clock_gettime(clockid_t id, struct timespec *t) {
    int r = (int)syscall(SYS_clock_gettime, id, t);
    int wall = id == CLOCK_REALTIME || id == CLOCK_REALTIME_COARSE || id == CLOCK_TAI;
    if (r == 0 && wall) t->tv_sec += step();
    return r;
}
int gettimeofday(struct timeval *restrict t, void *restrict zone) {
    struct timespec now;
    (void)zone;
    clock_gettime(CLOCK_REALTIME, &now);
    t->tv_sec = now.tv_sec, t->tv_usec = now.tv_nsec / 1000;
    return 0;
}
time_t time(time_t *out) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (out) *out = now.tv_sec;
    return now.tv_sec;
}
"""


@pytest.mark.ci
def test_nothing_that_decides_reads_the_wall_clock() -> None:
    """Sources name the monotonic clock only; the one exception is the stamp in
    an NC program's message file.
    """
    found = {
        str(path.relative_to(ROOT))
        for folder, pattern in (
            ("cnc_core", "*.py"),
            ("hli", "*.py"),
            ("plc_client", "*.py"),
            ("c_ext", "*.[ch]"),
        )
        for path in (ROOT / folder).rglob(pattern)
        if WALL_CLOCK.search(path.read_text().replace("HLI_CLOCK_REALTIME", ""))
    }
    assert found == STAMPS


@pytest.fixture
def jumping(tmp_path: Path) -> dict[str, str]:
    """Environment in which each look at the wall clock is a year or two away
    from the one before.
    """
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler")
    source, library = tmp_path / "jumping.c", tmp_path / "jumping.so"
    source.write_text(JUMPING)
    subprocess.run(
        [compiler, "-shared", "-fPIC", "-O1", "-o", library, source], check=True
    )
    before = os.environ.get("LD_PRELOAD", "")
    preload = f"{before}:{library}".lstrip(
        ":"
    )  # a sanitizer's library comes first
    return {
        **os.environ,
        "LD_PRELOAD": preload,
        "JUMPING_LOG": str(tmp_path / "loaded"),
    }


def test_the_clock_really_jumps(jumping: dict[str, str]) -> None:
    """Python beside the library sees a day long gone and one to come."""
    text = "import time; print(abs(time.time() - time.time()))"
    done = subprocess.run(
        [sys.executable, "-c", text],
        env=jumping,
        capture_output=True,
        text=True,
        check=True,
    )
    assert float(done.stdout) > 86400.0 * 365


@pytest.mark.ci
@pytest.mark.parametrize("clock", ["lockstep", "freerun", "realtime"])
def test_a_run_beside_a_jumping_wall_clock(
    program: Callable[..., Path],
    tmp_path: Path,
    jumping: dict[str, str],
    clock: str,
) -> None:
    """Launcher, CNC and PLC complete in each clock; in lockstep the path is the same to the bit."""
    part, paths = program(T1), []
    for k, env in enumerate((jumping, None)[: 2 if clock == "lockstep" else 1]):
        record = tmp_path / f"{k}.npz"
        call = command("run", part, "--clock", clock, "--record", record)
        done = subprocess.run(
            call,
            env=env,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        paths.append(np.load(record)["pos"])
    assert (
        len(set((tmp_path / "loaded").read_text().split())) >= 3
    )  # each process had the library
    assert all(
        (p.shape, p.tobytes()) == (paths[0].shape, paths[0].tobytes())
        for p in paths
    )
