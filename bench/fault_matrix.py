"""Kill and stop CNC, PLC and launcher at chosen and random moments; every run
must end and leave nothing.

    python bench/fault_matrix.py --runs 200 [--seed 1] [--clock freerun ...]

The runs take the clocks in turn (all three unless some are named).
Each run is ``hli-cosim run`` in a temporary folder of its own (TMPDIR).  A
fault is (who, what, when): SIGKILL, or SIGSTOP and SIGCONT after a while.
Asserted per run: the launcher ends within 5 s of a kill (a killed launcher: its
children do), a stopped side goes on to a completed run, no process, segment or
folder is left but those of a killed launcher; the clean run behind each batch
completes and removes these too.  In a run that completes, the PLC has seen each M
function of the program in order and once.  In every second run the PLC also drives
back and forth: a function comes again where the path passes it again, twice more each time.
Functions that a PLC fetched and died before it acknowledged come again, marked.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from hli import layout

SHM = Path("/dev/shm")
LIMIT_S = 5.0
FUNCTIONS = 14
PROGRAM = (
    "N10 G01 X10 F3000\n"
    "N20 M20=1\n"
    "N30 G03 X0 Y10 I-10 J0\n"
    "N40 M20=2\n"
    "N50 #CONTOUR LOOKAHEAD LOG ON [PARAM=1]\n"
    + "".join(
        f"N{60 + k} G01 X{k % 5} Y{k % 7} F5000\n"
        + (f"M20={k // 4 + 3}\n" if k % 4 == 0 else "")
        for k in range(4 * (FUNCTIONS - 2))
    )
)
CLOCKS = ("lockstep", "freerun", "realtime")
CONFIG = '[channel]\n[channel.m_synch]\n20 = "MVS_SVS"\n'
PLC = """
BACK = False
from plc_client import AcknowledgeAll, ContourLookahead, task
@task(interval=0.001)
class P:
    def setup(self, hli):
        self.ch = hli.gpCh[0]
        self.all, self.n, self.seen = AcknowledgeAll(hli), 0, []
        self.clah = ContourLookahead(self.ch.contour_lookahead)
    def cyclic(self):
        self.seen += [f.payload.add_value for f in self.all() if f.kind == "M" and not f.again]
        self.n += 1
        self.ch.bahn_mc_control.backward_motion.command_w = BACK and self.n % 400 > 350
        self.ch.bahn_mc_control.backward_motion.enable_w = True
        self.clah(start_position=self.ch.bahn_state.dist_prog_start, length=50_000.0)
    def result(self):
        return self.seen
"""
MOMENTS = (
    "start",
    "segment",
    "attached",
    "cycle 1",
    "motion",
    "request pending",
    "M pending",
    "end",
    "shutdown",
    "random",
)


@dataclass(frozen=True)
class Fault:
    """Who is hit, how, at which moment and under which clock."""

    who: str
    what: str
    when: str
    clock: str

    def __str__(self) -> str:
        return f"{self.what} {self.who} at {self.when}, {self.clock}"


def faults(
    runs: int, seed: int, clocks: Sequence[str] = CLOCKS
) -> Iterator[Fault]:
    """All chosen combinations in random order, over and over."""
    rng = random.Random(seed)
    table = [
        Fault(a, b, c, d)
        for a in ("cnc", "plc", "launcher")
        for b in ("KILL", "STOP")
        for c in MOMENTS
        for d in clocks
    ]
    while runs > 0:
        rng.shuffle(table)
        yield from table[:runs]
        runs -= len(table)


class Run:
    """One run with its processes and the memory of its segment."""

    def __init__(
        self, folder: Path, clock: str = CLOCKS[0], back: bool = False
    ) -> None:
        self.folder, self.back = folder, back
        (folder / "part.nc").write_text(PROGRAM)
        (folder / "plc.py").write_text(
            PLC.replace("BACK = False", f"BACK = {back}")
        )
        (folder / "cell.toml").write_text(CONFIG)
        command = [
            sys.executable,
            "-P",
            "-m",
            "cnc_core.cli",
            "run",
            "part.nc",
            "--json",
        ]
        command += ["--config", "cell.toml", "--plc", "plc.py"]
        command += ["--clock", clock]
        scratch = folder / "tmp"
        scratch.mkdir(exist_ok=True)
        self.launcher = subprocess.Popen(
            command,
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=os.environ | {"TMPDIR": str(scratch)},
        )
        self.pids: dict[str, int] = {"launcher": self.launcher.pid}
        self.seen = False

    def find(self) -> None:
        """Process ids of the children, as they appear."""
        try:
            pid = self.launcher.pid
            listed = Path(f"/proc/{pid}/task/{pid}/children").read_text()
        except OSError:
            return
        for pid in map(int, listed.split()):
            try:
                words = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
            except OSError:
                continue
            for name, module in (
                ("cnc", b"cnc_core.process"),
                ("plc", b"plc_client"),
            ):
                if module in words:
                    self.pids[name] = pid

    def segment(self) -> layout.HLI_SEGMENT | None:
        """A copy of the segment, None before it is there and behind its end."""
        for path in SHM.glob(f"hli-cosim-{self.launcher.pid}-*"):
            try:
                return layout.HLI_SEGMENT.from_buffer_copy(path.read_bytes())
            except (OSError, ValueError):
                return None
        return None

    def reached(self, moment: str, since: float, delay: float) -> bool:
        """Whether the moment has come."""
        if moment in ("start", "random"):
            return time.monotonic() - since > (
                0.0 if moment == "start" else delay
            )
        seg = self.segment()
        if seg is None:
            return moment == "shutdown" and self.seen
        self.seen = True
        ch, side = seg.channel[0], seg.sidecar
        return {
            "segment": lambda: True,
            "attached": lambda: bool(side.plc.attached),
            "cycle 1": lambda: side.cnc.cycle >= 1,
            "motion": lambda: side.cnc.cycle >= 300,
            "request pending": lambda: bool(ch.contour_lookahead.semaphor_rw),
            "M pending": lambda: any(
                unit.please_rw for unit in ch.techno_unit_std_sync
            ),
            "end": lambda: bool(ch.bahn_state.program_end_r),
            "shutdown": lambda: side.cnc.phase == layout.HLI_PHASE_SHUTDOWN,
        }[moment]()


def alive(pid: int) -> bool:
    """Whether the process runs (a zombie does not)."""
    try:
        return (
            Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
            not in "ZX"
        )
    except OSError:
        return False


def wait(what: Callable[[], object], seconds: float = LIMIT_S) -> float:
    """Seconds until ``what()`` is true; AssertionError after the limit."""
    begin = time.monotonic()
    while not what():
        assert time.monotonic() - begin < seconds, "it does not end"
        time.sleep(0.01)
    return time.monotonic() - begin


def one(
    fault: Fault,
    folder: Path,
    rng: random.Random,
    limit_s: float = LIMIT_S,
    back: bool = False,
) -> tuple[bool, float]:
    """(injected, seconds to the end) of one run with one fault."""
    run, since = Run(folder, fault.clock, back), time.monotonic()
    delay = rng.uniform(0, 1.6)
    hit = False
    while run.launcher.poll() is None and time.monotonic() - since < 30.0:
        run.find()
        if fault.who in run.pids and run.reached(fault.when, since, delay):
            hit = inject(run.pids[fault.who], fault.what, rng)
            break
        time.sleep(0.0005)
    limit = limit_s if fault.what == "KILL" else 30.0
    seconds = wait(lambda: run.launcher.poll() is not None, limit)
    text = run.launcher.communicate()[0]
    wait(lambda: not any(alive(pid) for pid in run.pids.values()))
    if fault.who != "launcher" or fault.what != "KILL" or not hit:
        assert json.loads(text)["end"] in ("completed", "aborted", "error"), (
            text
        )
        if fault.what == "STOP":
            check_functions(text, run.back)
        assert not list((folder / "tmp").iterdir()), "temporary folder left"
        assert not list(SHM.glob(f"hli-cosim-{run.launcher.pid}-*")), (
            "segment left"
        )
    return hit, seconds


def inject(pid: int, what: str, rng: random.Random) -> bool:
    """Kill, or stop and go on after a while; False if it was gone already."""
    try:
        if what == "KILL":
            os.kill(pid, signal.SIGKILL)
        else:
            os.kill(pid, signal.SIGSTOP)
            time.sleep(rng.uniform(0.01, 0.3))
            os.kill(pid, signal.SIGCONT)
    except ProcessLookupError:
        return False
    return True


def check_functions(text: str, back: bool) -> None:
    """The run has completed, and no function is lost, doubled or out of order.

    ``back``: the path may have passed one again, back and forth.
    """
    said = json.loads(text)
    assert said["end"] == "completed", text
    seen = said["plc"]["result"]
    once = list(range(1, FUNCTIONS + 1))
    if back:
        odd = all(times % 2 for times in Counter(seen).values())
        assert odd, f"functions {seen}"
        seen = list(dict.fromkeys(seen))
    assert seen == once, f"functions {seen}"


def clean(folder: Path) -> None:
    """A run without a fault completes and leaves nothing, of its own or of
    those before.
    """
    run = Run(folder)
    text = run.launcher.communicate(timeout=60)[0]
    check_functions(text, run.back)
    assert not list((folder / "tmp").iterdir()), list(
        (folder / "tmp").iterdir()
    )
    wait(lambda: not left_segments(), 1.0)


def left_segments() -> list[str]:
    """Segments of runs whose launcher is gone."""
    return [
        p.name
        for p in SHM.glob("hli-cosim-*-*")
        if not alive(int(p.name.split("-")[2]))
    ]


def matrix(
    runs: int,
    seed: int = 1,
    batch: int = 20,
    clocks: Sequence[str] = CLOCKS,
    limit_s: float = LIMIT_S,
) -> Counter[str]:
    """Counts of injected and missed faults; AssertionError names the fault that
    broke a promise.
    """
    rng, counts = random.Random(seed), Counter[str]()
    with tempfile.TemporaryDirectory() as root:
        folder = Path(root)
        for k, fault in enumerate(faults(runs, seed, clocks), 1):
            try:
                hit, seconds = one(fault, folder, rng, limit_s, k % 2 == 0)
                if k % batch == 0 or k == runs:
                    clean(folder)
                    counts["clean runs"] += 1
                    print(k, dict(counts), file=sys.stderr, flush=True)
            except AssertionError as error:
                raise AssertionError(f"run {k}, {fault}: {error}") from error
            counts[f"{fault.what} {fault.who}" if hit else "missed"] += 1
            counts["slowest end, ms"] = max(
                counts["slowest end, ms"],
                round(1000 * seconds) * (fault.what == "KILL"),
            )
    return counts


def main() -> None:
    """Print the counts as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--clock", action="append", choices=CLOCKS)
    parser.add_argument(
        "--limit",
        type=float,
        default=LIMIT_S,
        help="s to the end of a killed run; more where others use the processors",
    )
    args = parser.parse_args()
    clocks = args.clock or CLOCKS
    found = matrix(args.runs, args.seed, clocks=clocks, limit_s=args.limit)
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
