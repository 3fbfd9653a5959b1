"""The path of a new user as a script: commands, five small PLC programs, and
typical mistakes, Ctrl-C among them.

``python bench/first_hour.py [--only WORD]`` prints a table: seconds, the longest
silence, the widest line, what was said last.  A step stumbles if it ends with
another status, shows a traceback or a line of a table above 80 columns, or
does not say what it should.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import selectors
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

COLUMNS = 80
SILENCE_S = 5.0
FILES = {
    "part.nc": "N10 G01 X60 Y0 F9000\nN20 G03 X62 Y2 I0 J2\nN30 G01 Y40\nN40 M30\n",
    "m50.nc": "N70 G01 X5 F6000\nN80 M50\nN90 G01 X10\nN100 M30\n",
    "bad.nc": "N10 G01 X60 F9000\nN20 G999\nN30 M30\n",
    "fanuc.nc": "%\nO1001\nN10 G01 X60 F9000\nN20 M30\n%\n",
    "corners.nc": "".join(
        f"N{i} G01 X{i % 20} Y{i % 3} F6000\n" for i in range(10, 150)
    )
    + "M30\n",
    "m0.nc": "N10 G01 X5 F6000\nN20 M0\nN30 M30\n",
    "cell.toml": '[channel.m_synch]\n50 = "MVS_SVS"\n',
    "wrong.toml": "[axes.X]\nv_max_mm_per_s = 100\n",
    # five small programs
    "override.py": """from plc_client import ContourAhead, FeedControl, Hli, task

@task(interval=0.001)
class Slow:
    def setup(self, hli: Hli):
        self.ahead, self.feed = ContourAhead(hli.gpCh[0]), FeedControl(hli.gpCh[0])

    def cyclic(self):
        self.ahead()
        near = self.ahead.window(50_000.0)
        self.feed(override=60.0 if (near["compensated_radius"] > 0).any() else 100.0)
""",
    "clamp.py": """from plc_client import TON, TechnoServer, task

@task()
class Clamp:
    def setup(self, hli):
        self.functions = TechnoServer(hli)
        self.clamp, self.closed = self.functions.on("M", 50), TON(PT=0.1)

    def cyclic(self):
        self.functions()
        self.clamp(done=self.closed(self.clamp.active))
""",
    "door.py": """from plc_client import FeedHold, Input, Step, task

@task()
class Door:
    shut = Input(True, steps=[Step(value=False, time_s=0.1), Step(value=True, time_s=0.3)])

    def setup(self, hli):
        self.hold = FeedHold(hli.gpCh[0])

    def cyclic(self):
        self.hold(not self.shut)
""",
    "count.py": """from plc_client import task

@task(interval=0.010)
class Count:
    def setup(self, hli):
        self.state, self.moving = hli.gpCh[0].bahn_state, 0

    def cyclic(self):
        self.moving += self.state.active_feed_r > 0

    def result(self):
        return {"moving": self.moving}
""",
    "logic.st": """PROGRAM MAIN
VAR
  clah : ContourLookahead;
  feed : FeedControl;
END_VAR
clah(start_position := gpCh[0]^.bahn_state.dist_prog_start, length := 50_000.0);
IF clah.done THEN
  feed(override := SEL(clah.blocks[0].compensated_radius > 0.0, 100.0, 60.0));
END_IF
END_PROGRAM
""",
    # mistakes
    "idle.py": "from plc_client import task\n@task()\nclass Idle:\n    def cyclic(self): pass\n",
    "head.py": """from plc_client import ContourLookahead, task
@task()
class Head:
    def setup(self, hli): self.c = ContourLookahead(hli)
    def cyclic(self): self.c()
""",
    "typo.py": """from plc_client import task
@task()
class Typo:
    def setup(self, hli): self.s = hli.gpCh[0].bahn_stat
    def cyclic(self): pass
""",
    "nohli.py": """from plc_client import task
@task()
class N:
    def setup(self): pass
    def cyclic(self): pass
""",
    "ms.py": """from plc_client import task
@task(interval=1)
class Ms:
    def cyclic(self): pass
""",
    "iec.py": """from plc_client import task
@task(interval="T#1ms")
class I:
    def cyclic(self): pass
""",
    "over.py": """from plc_client import Override, task
@task()
class O:
    def setup(self, hli): self.o = Override(hli)
    def cyclic(self): self.o(path=100)
""",
    "high.py": """from plc_client import Override, task
@task()
class O:
    def setup(self, hli): self.o = Override(hli.gpCh[0])
    def cyclic(self): self.o(path=300.0)
""",
    "sleep.py": """import time
from plc_client import task
@task()
class S:
    def cyclic(self): time.sleep(0.005)
""",
    "hold.py": """from plc_client import FeedHold, task
@task()
class H:
    def setup(self, hli): self.h = FeedHold(hli.gpCh[0])
    def cyclic(self): self.h(True)
""",
    "zero.py": """from plc_client import FeedControl, task
@task()
class Z:
    def setup(self, hli): self.f = FeedControl(hli.gpCh[0])
    def cyclic(self): self.f(override=0.0)
""",
    "raises.py": """from plc_client import task
@task()
class R:
    def cyclic(self): self.x += 1
""",
    "hang.py": """from plc_client import task
@task()
class Hang:
    def cyclic(self):
        while True: pass
""",
    "setup.py": """from plc_client import task
@task()
class Late:
    def setup(self, hli):
        while True: pass
    def cyclic(self): pass
""",
    "axis.nc": "N10 G01 X60 W5 F9000\nN20 W2\nN30 W7\nN40 M30\n",
    "guess.nc": "N10 G01 X60 F9000\nN20 #5 = 3\nN30 G0 X[#5]\nN40 M30\n",
    "late.st": """PROGRAM MAIN
VAR wait : TON; END_VAR
wait(IN := TRUE, PT := 500);
END_PROGRAM
""",
    "trap.st": """PROGRAM MAIN
VAR
  n, none : INT;
END_VAR
n := 100 / none;
END_PROGRAM
""",
    "key.toml": "[channel]\nlookahed_blocks = 100\n",
    "many.nc": "".join(
        f"N{i} G01 X{i % 20} Y{i % 3} F6000\n" for i in range(10, 90_000)
    ),
    "bad.st": "PROGRAM MAIN\nVAR x : INT; END_VAR\nx := y + 1;\nEND_PROGRAM\n",
}


@dataclass
class Step:
    """A command, its status, and a text that it must say.

    ``ctrl_c``: s, Ctrl-C comes so long after the start; 0: never.
    """

    title: str
    command: str
    status: int = 0
    says: str = ""
    ctrl_c: float = 0.0


RUN = "run part.nc --plc"
STEPS = [
    Step("version", "--version", 0, "hli-cosim 0"),
    Step("help", "-h", 0, "Commands:"),
    Step("demo", "demo --seconds 3", 0, "Next:"),
    Step("check", "check part.nc", 0),
    Step("plan", "plan corners.nc", 0, "--tolerance"),
    Step("plan with tolerance", "plan corners.nc --tolerance 0.01", 0),
    Step(
        "look ahead",
        "lookahead part.nc --distance 0 700000 --at start",
        0,
        "circle",
    ),
    Step("new", "new my-cell", 0, "pytest -q"),
    Step("new, ST", "new st-cell --st", 0, "machine.st"),
    Step(
        "its cell",
        "run my-cell/part.nc --config my-cell/cell.toml --plc my-cell/machine.py",
    ),
    Step("its test", "pytest -q my-cell", 0, "2 passed"),
    Step("program 1: override", f"{RUN} override.py --record run.parquet"),
    Step("program 2: clamp", "run m50.nc --config cell.toml --plc clamp.py"),
    Step("program 3: door", f"{RUN} door.py --watch Door.shut", 0, "Door.shut"),
    Step("program 4: counter", f"{RUN} count.py"),
    Step("program 5: ST", f"{RUN} logic.st --watch MAIN.clah.count"),
    Step("recording", "inspect run.parquet"),
    Step("picture of it", "show run.parquet -o run.html"),
    Step("explain", "explain 901001", 0, "file"),
    Step(
        "nobody acknowledges",
        "run m50.nc --config cell.toml --plc idle.py --max-time 3",
        1,
        "N80: waits for acknowledgement of M50",
    ),
    Step(
        "nobody continues M0", "run m0.nc --plc idle.py --max-time 3", 1, "M0"
    ),
    Step("feed hold for ever", f"{RUN} hold.py --max-time 3", 1, "feed hold"),
    Step("override 0", f"{RUN} zero.py --max-time 3", 1, "override above 0"),
    Step("M50 is not known", "run m50.nc", 1, "m_synch"),
    Step("block takes the channel", f"{RUN} head.py", 1, "hli.gpCh[0]"),
    Step("misspelt member", f"{RUN} typo.py", 1, "did you mean bahn_state"),
    Step("setup(self)", f"{RUN} nohli.py", 1, "def setup(self, hli)"),
    Step("interval in ms", f"{RUN} ms.py", 0, "interval=0.001"),
    Step('interval="T#1ms"', f"{RUN} iec.py", 1, "interval=0.001"),
    Step("Override(hli)", f"{RUN} over.py", 1, "hli.gpCh[0]"),
    Step("override 300 %", f"{RUN} high.py", 0, "out of range"),
    Step("sleep in a task", f"{RUN} sleep.py", 0, "must not wait"),
    Step("--strict", f"{RUN} sleep.py --strict", 1, "must not wait"),
    Step("an error in cyclic", f"{RUN} raises.py", 1, "raises.py:4"),
    Step(
        "force maybe", f"{RUN} count.py --force Count.moving=maybe", 1, "number"
    ),
    Step(
        "misspelt watch",
        f"{RUN} count.py --watch Count.movng",
        1,
        "did you mean moving",
    ),
    Step("no such file", "run prat.nc", 1, "not found"),
    Step("no such PLC", f"{RUN} override2.py", 1, "not found"),
    Step("wrong key", "check part.nc --config wrong.toml", 1, "did you mean"),
    Step("error in the part", "check bad.nc", 1, "bad.nc:2"),
    Step(
        "the same with cnc",
        "cnc bad.nc --name first-hour --max-wall 2",
        1,
        "bad.nc:2",
    ),
    Step("error in ST", "check bad.st", 1, "bad.st:3"),
    Step("a TIME without unit", "check late.st", 1, "late.st:3"),
    Step("a trap in ST", "run part.nc --plc trap.st", 1, "trap.st:5"),
    Step("a task hangs", f"{RUN} hang.py", 1, "hang.py:5: cyclic() of Hang"),
    Step("setup() hangs", f"{RUN} setup.py --max-wall 5", 1, "--max-wall"),
    Step("missing axis", "check axis.nc", 1, "W is no axis of the cell"),
    Step("dialect guessed", "check guess.nc", 0, "dialect: iso"),
    Step("misspelt key", "check part.nc --config key.toml", 1, "did you mean"),
    Step("a PLC as the part", "run idle.py", 1, "--plc"),
    Step("a cell as the part", "plan cell.toml", 1, "--config"),
    Step("a part as the PLC", f"{RUN} part.nc", 1, "part.nc"),
    Step("a part as the cell", "check part.nc --config part.nc", 1, "TOML"),
    Step("Fanuc's O number", "run fanuc.nc"),
    Step("a binary", "check a.out", 1),
    Step("new over an old folder", "new my-cell", 1, "not empty"),
    Step("misspelt command", "rnu part.nc", 2, "No such command"),
    Step("misspelt option", "run part.nc --plcs x", 2, "No such option"),
    Step(
        "inputs, misspelt",
        "run part.nc --plc door.py --config inputs.toml",
        1,
        "did you mean shut",
    ),
    Step("nobody runs", "watch gpCh[0].bahn_state", 1),
    Step("nothing to force", "force Count.moving=1", 1),
    *(
        Step(f"Ctrl-C: {words.split()[0]}", words, 130, says, 4.0)
        for words, says in (
            ("run m0.nc --plc idle.py", "waits for"),
            ("cnc part.nc --name first-hour-cnc", "interrupted"),
            ("plc idle.py --name first-hour-plc", "waits for a CNC"),
            ("demo --seconds 60", "interrupted"),
            ("blocks many.nc", "interrupted"),
            ("plan many.nc", "interrupted"),
            ("bench handshake --seconds 30", "interrupted"),
            ("bench cycle --seconds 30", "interrupted"),
        )
    ),
]


@dataclass
class Seen:
    """What a step showed."""

    status: int
    seconds: float
    cpu: float
    silence: float
    out: str
    err: str
    problems: list[str] = field(default_factory=list)


def run(step: Step, folder: Path) -> Seen:
    """Run it and look at what it says while it lasts."""
    words = step.command.split()
    module = "pytest" if words[0] == "pytest" else "cnc_core"
    words = words[1:] if words[0] == "pytest" else words
    begin = last = time.monotonic()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    ours, theirs = os.openpty()  # standard error is a terminal, with progress
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", module, *words],
        stdout=subprocess.PIPE,
        stderr=theirs,
        cwd=folder,
        env=os.environ | {"COLUMNS": "80", "TERM": "xterm"},
    )
    os.close(theirs)
    silence, texts = 0.0, {"out": b"", "err": b""}
    chosen = selectors.DefaultSelector()
    assert process.stdout is not None
    chosen.register(process.stdout, selectors.EVENT_READ, "out")
    chosen.register(ours, selectors.EVENT_READ, "err")
    to_come = step.ctrl_c
    while chosen.get_map():
        ready = chosen.select(0.1)
        if to_come and time.monotonic() - begin > to_come:
            process.send_signal(signal.SIGINT)
            to_come = 0.0
        for key, _ in ready:
            try:
                data = os.read(key.fd, 1 << 16)
            except OSError:  # a terminal that nobody holds any more
                data = b""
            silence, last = (
                max(silence, time.monotonic() - last),
                time.monotonic(),
            )
            texts[key.data] += data
            if not data:
                chosen.unregister(key.fileobj)
    status = process.wait()
    os.close(ours)
    now = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime
    out, err = (plain(texts[name]) for name in ("out", "err"))
    seen = Seen(status, time.monotonic() - begin, cpu, silence, out, err)
    seen.problems = list(problems(step, seen))
    return seen


def plain(data: bytes) -> str:
    """Lines as they stay on the terminal: without colours and progress."""
    text = data.decode(errors="replace").replace("\r\n", "\n")
    # a bar goes up a line and clears it
    text = re.sub(r"[^\n]*\n?\r?\x1b\[1A", "", text)
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text)
    return "\n".join(line.rpartition("\r")[2] for line in text.split("\n"))


def problems(step: Step, seen: Seen) -> Iterator[str]:
    """What a user would stumble over."""
    if seen.status != step.status:
        yield f"status {seen.status}, not {step.status}"
    text = seen.out + seen.err
    if "Traceback" in text:
        yield "traceback"
    if seen.silence > SILENCE_S:
        yield f"silent for {seen.silence:.1f} s"
    if step.says not in " ".join(text.split()):
        yield f"does not say {step.says!r}"
    widest = max(
        (len(line.rstrip()) for line in seen.out.splitlines()), default=0
    )
    if widest > COLUMNS:
        yield f"{widest} columns"


def message(seen: Seen) -> str:
    """What was said last on standard error, or on standard output."""
    told = [
        line.strip()
        for line in seen.err.splitlines()
        if line.strip() and not line.startswith("dialect:")
    ]
    shown = [line for line in seen.out.splitlines() if line.strip(" ─└┘┴")]
    return (told or shown or [""])[-1].strip().replace("|", "\\|")


def main() -> int:
    """1: something stumbled."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="steps with this word")
    only = parser.parse_args().only
    stumbled = 0
    print("| step | s | CPU s | longest silence, s | says | stumbles |")
    print("| --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in FILES.items():
            (folder / file).write_text(text)
        (folder / "a.out").write_bytes(bytes(range(256)) * 40)
        (folder / "inputs.toml").write_text(
            "[inputs.Door.shutt]\nstart = true\n"
        )
        for step in STEPS:
            if only not in step.title:
                continue
            seen = run(step, folder)
            stumbled += bool(seen.problems)
            row = [
                step.title,
                f"{seen.seconds:.1f}",
                f"{seen.cpu:.1f}",
                f"{seen.silence:.1f}",
                message(seen)[:110],
                "; ".join(seen.problems) or "-",
            ]
            print(f"| {' | '.join(row)} |", flush=True)
    print(f"\n{stumbled} steps stumble")
    return int(stumbled > 0)


if __name__ == "__main__":
    sys.exit(main())
