"""Kill and stop CNC, PLC and launcher at chosen and random moments; every run
must end and leave nothing.

    python bench/fault_matrix.py --runs 200 [--seed 1] [--clock freerun ...]
    python bench/fault_matrix.py --log faults.jsonl --from 1 --to 200

The runs take the clocks in turn (all three unless some are named).
The seed alone decides what run K is.  So the matrix may be run in parts, and
runs that the log has already are left out.  The counts are those of the whole log.
Each run is ``hli-cosim run`` in a temporary folder of its own (TMPDIR).  A
fault is (who, what, when): SIGKILL, or SIGSTOP and SIGCONT after a while, or
for the PLC three restarts (SIGUSR1).
Asserted per run: the launcher ends within 5 s of a kill (a killed launcher: its
children do), a stopped side goes on to a completed run, no process, segment or
folder is left but those of a killed launcher; the clean run behind each batch
completes and removes these too.  In a run that completes, the PLC has seen each M
function of the program in order and once.  In every second run the PLC also drives
back and forth: a function comes again where the path passes it again, twice more each time.
Functions that a PLC fetched and died before it acknowledged come again, marked.

``--channels N``: N channels with functions of their own.  Each channel shows its
functions alone, and CNC and PLC have counted the same for each of them.
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
from dataclasses import asdict, dataclass
from pathlib import Path

from hli import layout

SHM = Path("/dev/shm")
SEGMENTS = "hli-cosim-*-*"
LIMIT_S = 5.0
MOMENT_S = 30.0
"""A run reaches each of its moments by then, and its end behind a stop."""
BATCH = 20
FUNCTIONS = 14
OF_A_CHANNEL = 100
"""Numbers of the functions of channel i begin behind i times that."""


def program(channel: int = 0) -> str:
    """Motions with functions between them, which differ by channel."""
    base = channel * OF_A_CHANNEL
    return (
        f"N10 G01 X{10 + channel} F3000\n"
        f"N20 M20={base + 1}\n"
        f"N30 G03 X{channel} Y10 I-10 J0\n"
        f"N40 M20={base + 2}\n"
        "N50 #CONTOUR LOOKAHEAD LOG ON [PARAM=1]\n"
        + "".join(
            f"N{60 + k} G01 X{k % 5} Y{k % (7 + channel)} F5000\n"
            + (f"M20={base + k // 4 + 3}\n" if k % 4 == 0 else "")
            for k in range(4 * (FUNCTIONS - 2))
        )
    )


def config(channels: int) -> str:
    """One channel, or so many."""
    axes = "".join(
        f"[channels.c{i}.axes.X]\n[channels.c{i}.axes.Y]\n"
        f"[channels.c{i}.axes.Z]\n"
        for i in range(channels)
    )
    return CONFIG + (axes if channels > 1 else "")


CLOCKS = ("lockstep", "freerun", "realtime")
CONFIG = '[channel]\n[channel.m_synch]\n20 = "MVS_SVS"\n'
PLC = """
BACK = False
from pathlib import Path
from plc_client import AcknowledgeAll, ContourLookahead, task
SEEN = Path(__file__).with_name("seen")  # a restart reads this file anew
@task(interval=0.001)
class P:
    def setup(self, hli):
        self.channels = [hli.gpCh[i] for i in range(hli.gNrCh)]
        self.all, self.n = AcknowledgeAll(hli, self.keep), 0
        self.units = [ContourLookahead(ch) for ch in self.channels]
        with SEEN.open("a") as file:
            file.write("setup\\n")
    def keep(self, f):
        if f.kind == "M" and not f.again:
            with SEEN.open("a") as file:
                file.write(f"{f.area[5:-1]} {f.payload.add_value}\\n")
    def cyclic(self):
        self.all()
        self.n += 1
        for ch, unit in zip(self.channels, self.units):
            ch.bahn_mc_control.backward_motion.command_w = BACK and self.n % 400 > 350
            ch.bahn_mc_control.backward_motion.enable_w = True
            unit(start_position=ch.bahn_state.dist_prog_start, length=50_000.0)
    def finished(self):
        return all(ch.decoder_state.program_end_r for ch in self.channels)
    def result(self):
        lines = SEEN.read_text().splitlines()
        pairs = [line.split() for line in lines if line != "setup"]
        return {
            "seen": [[int(v) for i, v in pairs if i == str(k)]
                     for k in range(len(self.channels))],
            "setups": lines.count("setup"),
        }
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
# before it is attached a signal ends a process
RESTARTS_AT = ("cycle 1", "motion", "request pending", "M pending")


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
    seed: int, clocks: Sequence[str] = CLOCKS, restarts: bool = False
) -> Iterator[Fault]:
    """All chosen combinations in random order, over and over, without end.

    ``restarts``: those of the PLC are among them.
    """
    rng = random.Random(seed)
    kinds = [
        (a, b) for a in ("cnc", "plc", "launcher") for b in ("KILL", "STOP")
    ]
    kinds += [("plc", "RESTART")] if restarts else []
    table = [
        Fault(a, b, c, d)
        for a, b in kinds
        for c in (RESTARTS_AT if b == "RESTART" else MOMENTS)
        for d in clocks
    ]
    while True:
        rng.shuffle(table)
        yield from table


class Run:
    """One run with its processes and the memory of its segment."""

    def __init__(
        self,
        folder: Path,
        clock: str = CLOCKS[0],
        back: bool = False,
        channels: int = 1,
    ) -> None:
        self.folder, self.back, self.channels = folder, back, channels
        names = [f"part{i}.nc" for i in range(channels)]
        for i, name in enumerate(names):
            (folder / name).write_text(program(i))
        (folder / "seen").unlink(missing_ok=True)
        (folder / "plc.py").write_text(
            PLC.replace("BACK = False", f"BACK = {back}")
        )
        (folder / "cell.toml").write_text(config(channels))
        command = [
            sys.executable,
            "-P",
            "-m",
            "cnc_core.cli",
            "run",
            *names,
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

    def reached(self, moment: str, random_at: float) -> bool:
        """Whether the moment has come."""
        if moment == "start":
            return True
        if moment == "random":
            return time.monotonic() > random_at
        seg = self.segment()
        if seg is None:
            return moment == "shutdown" and self.seen
        self.seen = True
        channels, side = seg.channel[: self.channels], seg.sidecar
        return {
            "segment": lambda: True,
            "attached": lambda: bool(side.plc.attached),
            "cycle 1": lambda: side.cnc.cycle >= 1,
            "motion": lambda: side.cnc.cycle >= 300,
            "request pending": lambda: any(
                ch.contour_lookahead.semaphor_rw for ch in channels
            ),
            "M pending": lambda: any(
                unit.please_rw
                for ch in channels
                for unit in ch.techno_unit_std_sync
            ),
            "end": lambda: any(ch.bahn_state.program_end_r for ch in channels),
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
    launchers: set[int] | None = None,
    channels: int = 1,
) -> tuple[bool, float]:
    """(injected, seconds to the end) of one run with one fault.

    The launcher's process id is added to ``launchers``.
    """
    run = Run(folder, fault.clock, back, channels)
    since = time.monotonic()
    if launchers is not None:
        launchers.add(run.launcher.pid)
    delay = rng.uniform(0, 1.6)
    try:
        return _through(run, fault, since + delay, rng, limit_s)
    finally:
        for pid in run.pids.values():  # none, but where a promise was broken
            if alive(pid):
                os.kill(pid, signal.SIGKILL)


def _through(
    run: Run, fault: Fault, random_at: float, rng: random.Random, limit_s: float
) -> tuple[bool, float]:
    hit, moment_s = False, max(MOMENT_S, limit_s)
    until = time.monotonic() + moment_s
    while run.launcher.poll() is None and time.monotonic() < until:
        run.find()
        if fault.who in run.pids and run.reached(fault.when, random_at):
            hit = inject(run.pids[fault.who], fault.what, rng)
            break
        time.sleep(0.0005)
    limit = limit_s if fault.what == "KILL" else moment_s
    seconds = wait(lambda: run.launcher.poll() is not None, limit)
    text = run.launcher.communicate()[0]
    wait(lambda: not any(alive(pid) for pid in run.pids.values()), limit_s)
    if fault.who != "launcher" or fault.what != "KILL" or not hit:
        assert json.loads(text)["end"] in ("completed", "aborted", "error"), (
            text
        )
        if fault.what != "KILL":
            check_functions(text, run.back, run.channels)
        assert not list((run.folder / "tmp").iterdir()), "temporary folder left"
        assert not list(SHM.glob(f"hli-cosim-{run.launcher.pid}-*")), (
            "segment left"
        )
    return hit, seconds


def inject(pid: int, what: str, rng: random.Random) -> bool:
    """Kill, restart three times, or stop and go on after a while; False if it
    was gone already.
    """
    try:
        if what == "KILL":
            os.kill(pid, signal.SIGKILL)
        elif what == "RESTART":
            for _ in range(3):
                os.kill(pid, signal.SIGUSR1)
                time.sleep(rng.uniform(0.0, 0.1))
        else:
            os.kill(pid, signal.SIGSTOP)
            time.sleep(rng.uniform(0.01, 0.3))
            os.kill(pid, signal.SIGCONT)
    except ProcessLookupError:
        return False
    return True


def check_functions(text: str, back: bool, channels: int = 1) -> None:
    """The run has completed, and no function is lost, doubled, out of order or
    shown by another channel; CNC and PLC have counted the same for each.

    ``back``: the path may have passed one again, back and forth.
    """
    said = json.loads(text)
    assert said["end"] == "completed", text
    lists = said["plc"]["result"]["seen"]
    assert len(lists) == channels, text
    for i, seen in enumerate(lists):
        base = i * OF_A_CHANNEL
        once = list(range(base + 1, base + FUNCTIONS + 1))
        told = f"functions of channel {i}: {seen}"
        put_out = said["channels"][i]["techno_functions"]
        assert put_out == len(seen), f"{told}, {put_out} put out"
        if back:
            assert all(times % 2 for times in Counter(seen).values()), told
        assert list(dict.fromkeys(seen)) == once, told
        assert back or len(seen) == len(once), told


def clean(
    folder: Path,
    limit_s: float = LIMIT_S,
    launchers: set[int] | None = None,
    channels: int = 1,
) -> None:
    """A run without a fault completes and leaves nothing, of its own or of
    those before.

    ``launchers``: process ids of the runs before it; None: those of everybody.
    """
    run = Run(folder, channels=channels)
    text = run.launcher.communicate(timeout=max(60.0, limit_s))[0]
    check_functions(text, run.back, channels)
    assert not list((folder / "tmp").iterdir()), list(
        (folder / "tmp").iterdir()
    )
    wait(lambda: not left_segments(launchers), limit_s)


def left_segments(launchers: set[int] | None) -> list[str]:
    """Segments of runs whose launcher is gone."""
    found = {p.name: int(p.name.split("-")[2]) for p in SHM.glob(SEGMENTS)}
    return [
        name
        for name, pid in found.items()
        if (launchers is None or pid in launchers) and not alive(pid)
    ]


@dataclass(frozen=True)
class Outcome:
    """What run ``k`` of a seed came to; ``broken``: the promise it broke, or ""."""

    seed: int
    k: int
    fault: Fault | None  # None: the clean run behind a batch
    hit: bool
    seconds: float
    broken: str = ""

    @property
    def name(self) -> str:
        """What it is counted as."""
        if self.broken:
            return "broken"
        if self.fault is None:
            return "clean runs"
        return f"{self.fault.what} {self.fault.who}" if self.hit else "missed"


class Matrix:
    """The runs of a seed, any part of them, in a folder of its own."""

    def __init__(
        self,
        folder: Path,
        seed: int,
        clocks: Sequence[str],
        limit_s: float,
        channels: int = 1,
    ) -> None:
        self._channels = channels
        self._folder, self._seed, self._limit_s = folder, seed, limit_s
        self._clocks = clocks
        self._launchers: set[int] = set()

    def runs(self, ks: range, done: set[int]) -> Iterator[Outcome]:
        """The runs with these numbers but those that are done."""
        several = self._channels > 1
        table = faults(self._seed, self._clocks, several)
        for k, fault in enumerate(table, 1):
            if k >= ks.stop:
                return
            if k not in ks or k in done:
                continue
            yield self._one(k, fault)
            if k % BATCH == 0 or k == ks.stop - 1:
                yield self._clean(k)

    def _one(self, k: int, fault: Fault) -> Outcome:
        rng = random.Random(f"{self._seed} {k}")
        try:
            hit, seconds = one(
                fault,
                self._folder,
                rng,
                self._limit_s,
                k % 2 == 0,
                self._launchers,
                self._channels,
            )
        except AssertionError as error:
            return Outcome(self._seed, k, fault, True, 0.0, str(error))
        return Outcome(self._seed, k, fault, hit, seconds)

    def _clean(self, k: int) -> Outcome:
        began = time.monotonic()
        try:
            clean(self._folder, self._limit_s, self._launchers, self._channels)
        except AssertionError as error:
            return Outcome(self._seed, k, None, True, 0.0, str(error))
        took = time.monotonic() - began
        return Outcome(self._seed, k, None, True, took)


class Log:
    """Outcomes as lines of JSON, and their counts."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self.outcomes: list[Outcome] = []
        if path and path.exists():
            lines = path.read_text().splitlines()
            self.outcomes = [self._read(line) for line in lines]

    def _read(self, line: str) -> Outcome:
        said = json.loads(line)
        fault = said["fault"] and Fault(**said["fault"])
        return Outcome(**(said | {"fault": fault}))

    def done(self, seed: int) -> set[int]:
        """Numbers of the runs of a seed that are there."""
        return {
            one.k for one in self.outcomes if one.fault and one.seed == seed
        }

    def add(self, outcome: Outcome) -> None:
        """Keep it, on the disk at once."""
        self.outcomes.append(outcome)
        if self._path:
            with self._path.open("a") as file:
                file.write(json.dumps(asdict(outcome)) + "\n")

    def counts(self) -> dict[str, int]:
        """How often each outcome, and the slowest end behind a kill in ms."""
        slowest = [
            outcome.seconds
            for outcome in self.outcomes
            if outcome.fault and outcome.fault.what == "KILL" and outcome.hit
        ]
        found = Counter(outcome.name for outcome in self.outcomes)
        return dict(sorted(found.items())) | {
            "slowest end, ms": round(1000 * max(slowest, default=0.0))
        }


def main() -> None:
    """Print the counts as JSON; 1 where a promise was broken."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--clock", action="append", choices=CLOCKS)
    parser.add_argument("--log", type=Path, help="a line of JSON a run")
    parser.add_argument("--from", type=int, default=1, dest="first")
    parser.add_argument("--to", type=int, help="instead of --runs")
    parser.add_argument(
        "--limit",
        type=float,
        default=LIMIT_S,
        help="s to the end of a killed run; more where others use the processors",
    )
    parser.add_argument("--channels", type=int, default=1)
    args = parser.parse_args()
    last = args.to or args.first + args.runs - 1
    log = Log(args.log)
    with tempfile.TemporaryDirectory() as root:
        clocks = args.clock or CLOCKS
        matrix = Matrix(
            Path(root), args.seed, clocks, args.limit, args.channels
        )
        ks = range(args.first, last + 1)
        for outcome in matrix.runs(ks, log.done(args.seed)):
            log.add(outcome)
            if outcome.broken:
                print(f"run {outcome.k}, {outcome.fault}: {outcome.broken}")
            if outcome.fault is None:
                counts = log.counts()
                print(outcome.k, counts, file=sys.stderr, flush=True)
    print(json.dumps(log.counts(), indent=2))
    sys.exit(any(outcome.broken for outcome in log.outcomes))


if __name__ == "__main__":
    main()
