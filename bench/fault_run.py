"""One run of the fault matrix: its processes, its moments, and what must hold behind it.

``fault_matrix.py`` says which runs there are.
"""

from __future__ import annotations

import functools
import json
import mmap
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cnc_core.recording.parts import folder_of, recover
from cnc_core.recording.reading import Recording
from hli import layout

SHM = Path("/dev/shm")
SEGMENTS = "hli-cosim-*-*"
LIMIT_S = 5.0
MOMENT_S = 30.0
"""A run reaches each of its moments by then, and its end behind a stop."""
FUNCTIONS = 14
OF_A_CHANNEL = 100
"""Numbers of the functions of channel i begin behind i times that."""
RECORDING = "part.parquet"
LOOK_S = 0.005
"""Looked at without a pause for so long: a function may wait for one cycle only."""
GONE = (129, -signal.SIGHUP)
"""How a launcher ends whose terminal has gone; the signal: before it has begun."""


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
from hli import layout
from plc_client import AcknowledgeAll, ContourLookahead, task
SEEN = Path(__file__).with_name("seen")  # a restart reads this file anew
@task(interval=0.001)
class P:
    def setup(self, hli):
        self.channels = [hli.gpCh[i] for i in range(hli.gNrCh)]
        self.all, self.n = AcknowledgeAll(hli, self.keep), 0
        # in free run many cycles pass between two scans
        self.turn = 40 if hli.cnc.clock == layout.HLI_CLOCK_FREERUN else 400
        self.units = [ContourLookahead(ch) for ch in self.channels]
        with SEEN.open("a") as file:
            file.write("setup\\n")
    def keep(self, f):
        if f.kind == "M":
            word = "again" if f.again else "first"
            with SEEN.open("a") as file:
                file.write(f"{word} {f.area[5:-1]} {f.payload.add_value}\\n")
    def cyclic(self):
        self.all()
        self.n += 1
        back = BACK and self.n % self.turn > 0.87 * self.turn
        for ch, unit in zip(self.channels, self.units):
            ch.bahn_mc_control.backward_motion.command_w = back
            ch.bahn_mc_control.backward_motion.enable_w = True
            unit(start_position=ch.bahn_state.dist_prog_start, length=50_000.0)
    def finished(self):
        return all(ch.decoder_state.program_end_r for ch in self.channels)
    def result(self):
        lines = SEEN.read_text().splitlines()
        words = [line.split() for line in lines if line.startswith("first")]
        return {
            "seen": [[int(v) for _, i, v in words if i == str(k)]
                     for k in range(len(self.channels))],
            "setups": lines.count("setup"),
        }
"""
MOMENTS = (
    "start",
    "segment",
    "attached",
    "cycle 1",
    "recording",
    "motion",
    "request pending",
    "M pending",
    "backward",
    "end",
    "shutdown",
    "random",
)
DRIVING = MOMENTS[3:9]
"""Between attaching and the end; earlier a signal ends a PLC."""


@dataclass(frozen=True)
class Fault:
    """Who is hit, how, at which moment and under which clock."""

    who: str
    what: str
    when: str
    clock: str

    def __str__(self) -> str:
        return f"{self.what} {self.who} at {self.when}, {self.clock}"

    @property
    def orphans(self) -> bool:
        """The launcher is gone without a word."""
        return (self.who, self.what) == ("launcher", "KILL")


@dataclass(frozen=True)
class Setting:
    """What a run does beside its program."""

    channels: int = 1
    back: bool = False
    recorded: bool = False


def write_files(folder: Path, setting: Setting) -> list[str]:
    """Programs, PLC and cell; returns the programs' names."""
    names = [f"part{i}.nc" for i in range(setting.channels)]
    for i, name in enumerate(names):
        (folder / name).write_text(program(i))
    (folder / "seen").unlink(missing_ok=True)
    text = PLC.replace("BACK = False", f"BACK = {setting.back}")
    (folder / "plc.py").write_text(text)
    (folder / "cell.toml").write_text(config(setting.channels))
    return names


def hli_cosim(verb: str, *words: str) -> list[str]:
    """The command line of a command."""
    return [sys.executable, "-P", "-m", "cnc_core.cli", verb, *words]


def moment_of(seg: layout.HLI_SEGMENT, moment: str, channels: int = 1) -> bool:
    """Whether the segment shows it."""
    all_of, side = seg.channel[:channels], seg.sidecar
    looks: dict[str, Callable[[], bool]] = {
        "segment": lambda: True,
        "attached": lambda: bool(side.plc.attached),
        "cycle 1": lambda: side.cnc.cycle >= 1,
        "motion": lambda: side.cnc.cycle >= 300,
        "request pending": lambda: any(
            ch.contour_lookahead.semaphor_rw for ch in all_of
        ),
        "M pending": lambda: any(
            unit.please_rw for ch in all_of for unit in ch.techno_unit_std_sync
        ),
        "backward": lambda: any(
            ch.bahn_state.backward_active_r for ch in all_of
        ),
        "end": lambda: any(
            ch.bahn_state.program_end_r and ch.bahn_state.dist_prog_start > 0
            for ch in all_of
        ),
        "shutdown": lambda: side.cnc.phase == layout.HLI_PHASE_SHUTDOWN,
    }
    return looks[moment]()


@functools.lru_cache(maxsize=1)
def _mapped(path: Path, inode: int) -> layout.HLI_SEGMENT:
    """The segment in this file; what it shows follows what is written there."""
    with path.open("rb") as file:
        # private: ctypes asks for memory that it may write
        memory = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY)
    return layout.HLI_SEGMENT.from_buffer(memory)


def looked_at(path: Path) -> layout.HLI_SEGMENT | None:
    """The segment, None before it is there and behind its end."""
    try:
        return _mapped(path, path.stat().st_ino)
    except (OSError, ValueError):
        return None


class Run:
    """One run with its processes and the memory of its segment."""

    def __init__(
        self,
        folder: Path,
        clock: str = CLOCKS[0],
        setting: Setting = Setting(),
    ) -> None:
        self.folder, self.setting = folder, setting
        names = write_files(folder, setting)
        more = ["--config", "cell.toml", "--plc", "plc.py", "--clock", clock]
        self.recording = folder / RECORDING
        for old in folder.glob("part*.parquet"):
            old.unlink()
        if setting.recorded:
            more += ["--record", RECORDING]
        self.scratch = folder / "tmp"
        self.scratch.mkdir(exist_ok=True)
        self.launcher = subprocess.Popen(
            hli_cosim("run", *names, "--json", *more),
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=os.environ | {"TMPDIR": str(self.scratch)},
            start_new_session=True,  # a terminal of its own, which may go
        )
        self.pids: dict[str, int] = {"launcher": self.launcher.pid}
        self.seen = False
        self._path: Path | None = None
        self._head = 0  # bytes of the CNC's part when it was first seen

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

    def targets(self, who: str) -> list[int]:
        """The processes of a fault's ``who``; empty: not there yet."""
        if who == "machine":
            return list(self.pids.values()) if len(self.pids) == 3 else []
        if who == "terminal":
            return [-self.pids["launcher"]]
        return [self.pids[who]] if who in self.pids else []

    def segment(self) -> layout.HLI_SEGMENT | None:
        """The segment, None before it is there and behind its end."""
        if self._path is None:
            name = f"hli-cosim-{self.launcher.pid}-*"
            self._path = next(SHM.glob(name), None)
        return None if self._path is None else looked_at(self._path)

    def _records(self) -> bool:
        """The CNC's part has grown behind its head."""
        part = folder_of(self.recording) / "cnc.arrow"
        size = part.stat().st_size if part.exists() else 0
        self._head = self._head or size
        return size > self._head

    def reached(self, moment: str, random_at: float) -> bool:
        """Whether the moment has come."""
        if moment == "start":
            return True
        if moment == "random":
            return time.monotonic() > random_at
        if moment == "recording":
            return self._records()
        seg = self.segment()
        if seg is None:
            return moment == "shutdown" and self.seen
        self.seen = True
        return moment_of(seg, moment, self.setting.channels)


def alive(pid: int) -> bool:
    """Whether the process runs (a zombie does not)."""
    try:
        return (
            Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
            not in "ZX"
        )
    except OSError:
        return False


def seen_soon(what: Callable[[], bool]) -> bool:
    """Whether it is true at a moment of the next LOOK_S."""
    until = time.monotonic() + LOOK_S
    while not what():
        if time.monotonic() > until:
            return False
    return True


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
    setting: Setting = Setting(),
    launchers: set[int] | None = None,
) -> tuple[bool, float]:
    """(injected, seconds to the end) of one run with one fault.

    The launcher's process id is added to ``launchers``.
    """
    run = Run(folder, fault.clock, setting)
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
        targets = run.targets(fault.who)
        if not targets:
            time.sleep(LOOK_S)
        elif seen_soon(lambda: run.reached(fault.when, random_at)):
            hit = inject(targets, fault.what, rng)
            break
    limit = limit_s if fault.what in ("KILL", "HUP") else moment_s
    seconds = wait(lambda: run.launcher.poll() is not None, limit)
    text = run.launcher.communicate()[0]
    wait(lambda: not any(alive(pid) for pid in run.pids.values()), limit_s)
    _check_behind(run, fault if hit else None, text)
    return hit, seconds


def _check_behind(run: Run, fault: Fault | None, text: str) -> None:
    """What holds behind a run that a fault has hit; None: it came too late."""
    if fault is not None and fault.orphans:
        _check_recovered(run)
        return
    if fault is not None and fault.what == "HUP":
        status = run.launcher.returncode
        # it may have come when all was done
        assert status in (*GONE, 0), f"status {status}: {text}"
    else:
        end = json.loads(text)["end"]
        assert end in ("completed", "aborted", "error"), text
    stopped = fault is not None and fault.what in ("KILL", "HUP")
    if not stopped:
        check_functions(text, run.setting)
    _check_recording(run, whole=not stopped)
    left = list(run.scratch.iterdir())
    assert not left, f"temporary folder left: {left}"
    assert not list(SHM.glob(f"hli-cosim-{run.launcher.pid}-*")), "segment left"


def inject(pids: list[int], what: str, rng: random.Random) -> bool:
    """Kill, take the terminal, restart three times, or stop and go on after a
    while; False if it was gone already.  A negative number: its group.
    """
    try:
        if what in ("KILL", "HUP"):
            _signal(pids, signal.SIGKILL if what == "KILL" else signal.SIGHUP)
        elif what == "RESTART":
            for _ in range(3):
                _signal(pids, signal.SIGUSR1)
                time.sleep(rng.uniform(0.0, 0.1))
        else:
            _signal(pids, signal.SIGSTOP)
            time.sleep(rng.uniform(0.01, 0.3))
            _signal(pids, signal.SIGCONT)
    except ProcessLookupError:
        return False
    return True


def _signal(pids: list[int], number: signal.Signals) -> None:
    for pid in pids:
        os.kill(pid, number)


def is_walk(seen: list[int], base: int) -> bool:
    """Whether a path that turns back and forth puts these functions out.

    It passes neighbours one behind the other.  A turn while a function waits
    leaves it ahead: it comes again when the path comes back to it.
    """
    places = {base}  # number of the last function behind the tool
    for number in seen:
        forward = {number - 1, number} if number - 1 in places else set()
        backward = {number - 1} if number in places else set()
        places = forward | backward
    return base + FUNCTIONS in places


def check_functions(text: str, setting: Setting) -> None:
    """The run has completed, and no function is lost, doubled, out of order or
    shown by another channel; CNC and PLC have counted the same for each.

    Backward: the path may have passed one again, back and forth (``is_walk``).
    """
    said = json.loads(text)
    assert said["end"] == "completed", text
    lists = said["plc"]["result"]["seen"]
    assert len(lists) == setting.channels, text
    for i, seen in enumerate(lists):
        base = i * OF_A_CHANNEL
        once = list(range(base + 1, base + FUNCTIONS + 1))
        told = f"functions of channel {i}: {seen}"
        put_out = said["channels"][i]["techno_functions"]
        assert put_out == len(seen), f"{told}, {put_out} put out"
        if setting.back:
            assert is_walk(seen, base), told
        assert list(dict.fromkeys(seen)) == once, told
        assert setting.back or len(seen) == len(once), told


def _check_recovered(run: Run) -> None:
    """The parts of a killed launcher become a recording, if there is a row."""
    if not run.setting.recorded or not folder_of(run.recording).exists():
        return
    found = recover(run.recording)
    if found is not None:
        check_cycles(Recording(found))
    assert not folder_of(run.recording).exists(), "parts left"


def _check_recording(run: Run, whole: bool) -> None:
    """It can be read; ``whole``: it has each cycle and each function."""
    if not run.setting.recorded:
        return
    assert not folder_of(run.recording).exists(), "parts left"
    if not whole and not run.recording.exists():
        return  # nothing had been recorded
    found = Recording(run.recording)
    check_cycles(found)
    assert not whole or "cycles" in found.tables
    if whole:
        values = list(dict.fromkeys(_channel_of(found).functions["value"]))
        assert values == list(range(1, FUNCTIONS + 1)), f"recorded {values}"


def _channel_of(found: Recording) -> Recording:
    return found.channel(found.channels[0]) if found.channels else found


def check_cycles(found: Recording) -> None:
    """One row for each cycle, one behind the other; none, where the CNC has died
    before it recorded.
    """
    if "cycles" not in found.tables:
        return
    cycles = [int(k) for k in _channel_of(found).cycles["cycle"]]
    first = cycles[0] if cycles else 0
    assert cycles == list(range(first, first + len(cycles)))


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
    run = Run(folder, setting=Setting(channels))
    text = run.launcher.communicate(timeout=max(60.0, limit_s))[0]
    check_functions(text, run.setting)
    left = list(run.scratch.iterdir())
    assert not left, left
    wait(lambda: not left_segments(launchers), limit_s)


def left_segments(launchers: set[int] | None) -> list[str]:
    """Segments of runs whose launcher is gone."""
    found = {p.name: int(p.name.split("-")[2]) for p in SHM.glob(SEGMENTS)}
    return [
        name
        for name, pid in found.items()
        if (launchers is None or pid in launchers) and not alive(pid)
    ]
