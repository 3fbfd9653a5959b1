"""The cell: a CNC process and a PLC process side by side, started, supervised
and ended together.

>>> with Cell("cell.toml") as cell:                                            #
doctest: +SKIP
...     result = cell.run("part.nc", plc=OverrideFromContour)
"""

from __future__ import annotations

import inspect
import json
import numbers
import os
import re
import secrets
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

from hli._sync import lib as sync

from hli import segment
from hli.errors import HliError
from plc_client.task import refuse_cell_start

from ..config import CellConfig, load_config
from ..errors import CncError, Place
from ..frontend.operator import read_answers
from ..process import recording as recorder
from ..process.__main__ import CLOCKS, CncOptions
from ..process.preparation import OUT_FOLDER
from ..program.restart import Restart

SCRATCH = "hli-cosim-run-"
POLL_S = 0.005
GRACE_S = 3.5  # after one side ended: how long the other may take to notice
PLC_CHOICES = "a file, a class of a file, or builtin:NAME (start_plc runs any class in this process)"
NO_PLC = "none"
# without a PLC: how long the program may stand at a stop that nobody will leave
STALL_S = 0.5


@dataclass
class RunResult:
    """Outcome of one co-simulation (the contract's run object)."""

    cycles: int = 0
    sim_time_s: float = 0.0
    wall_time_s: float = 0.0
    requests: dict[str, int] = field(
        default_factory=lambda: {"mode1": 0, "mode2": 0}
    )
    handshake_us: dict[str, float | None] = field(default_factory=dict)
    overruns: int = 0
    end: str = "aborted"
    messages: list[str] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    errors: list[dict[str, Any]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    plc: dict[str, Any] = field(default_factory=dict)
    blocks: int = 0
    recorded: int = 0
    error_text: str = ""
    dialect: str | None = None
    peak_mb: float = 0.0

    @property
    def realtime_factor(self) -> float:
        return (
            self.sim_time_s / self.wall_time_s if self.wall_time_s > 0 else 0.0
        )

    def as_json(self) -> dict[str, Any]:
        return {
            "cycles": self.cycles,
            "sim_time_s": self.sim_time_s,
            "wall_time_s": self.wall_time_s,
            "realtime_factor": self.realtime_factor,
            "requests": self.requests,
            "handshake_us": self.handshake_us,
            "overruns": self.overruns,
            "end": self.end,
            "messages": self.messages,
            "files": self.files,
            "errors": self.errors,
            "warnings": self.warnings,
            "blocks": self.blocks,
            "recorded": self.recorded,
            "dialect": self.dialect,
            "plc": self.plc,
        }


@dataclass(frozen=True)
class PlcChoice:
    """Which PLC program runs: arguments of the PLC process."""

    arguments: tuple[str, ...]

    @classmethod
    def of(cls, plc: Any, args: dict[str, Any] | None = None) -> PlcChoice:
        """From None (acknowledge everything), ``builtin:NAME``, a file, or a
        task class of an importable file.
        """
        if plc is None:
            plc = "builtin:acknowledge"
        if plc == NO_PLC:
            return cls(())
        if isinstance(plc, type):
            return cls._of_class(plc)
        text = str(plc)
        if text.startswith("builtin:"):
            return cls(
                (
                    "--builtin",
                    text.removeprefix("builtin:"),
                    "--args",
                    json.dumps(args or {}),
                )
            )
        if not isinstance(plc, (str, Path)):
            raise CncError(902001, f"PLC {plc!r}: {PLC_CHOICES}")
        if not Path(text).is_file():
            raise CncError(901001, "PLC program not found", Place(text))
        return cls(("--file", str(Path(text).resolve())))

    def online(
        self, watch: Sequence[str] | str, force: dict[str, Any]
    ) -> PlcChoice:
        """The same PLC with a watch list (or one symbol) and forced symbols."""
        watch = [watch] if isinstance(watch, str) else watch
        for path, value in force.items():
            if not isinstance(value, (numbers.Real, str)):
                raise CncError(
                    902001,
                    f"force {path}={value!r}: a number, a BOOL or a text is needed",
                )
        if not self.arguments and (watch or force):
            raise CncError(
                902001,
                f"watch list and forced symbols need a PLC, not {NO_PLC!r}",
            )
        more = [part for path in watch for part in ("--watch", path)]
        more += [
            part
            for path, value in force.items()
            for part in ("--force", f"{path}={value}")
        ]
        return PlcChoice((*self.arguments, *more))

    @classmethod
    def _of_class(cls, plc: type) -> PlcChoice:
        if "<locals>" in plc.__qualname__:
            raise CncError(
                902001,
                f"PLC class {plc.__qualname__} is local to a function; the PLC process needs {PLC_CHOICES}",
            )
        try:
            file = inspect.getfile(plc)
        except (TypeError, OSError):
            raise CncError(
                902001,
                f"PLC class {plc.__name__} has no source file; the PLC process needs {PLC_CHOICES}",
            ) from None
        if not Path(file).is_file():
            raise CncError(
                902001,
                f"PLC class {plc.__name__} has no source file; the PLC process needs {PLC_CHOICES}",
            )
        return cls(
            ("--file", str(Path(file).resolve()), "--class", plc.__qualname__)
        )


class _Child:
    """One process with its report and what it says on standard error."""

    def __init__(
        self,
        title: str,
        module: str,
        arguments: Sequence[str],
        folder: Path,
        terminal: bool = False,
    ) -> None:
        self.title = title
        self.report_file = folder / f"{title}.json"
        self.log_file = folder / f"{title}.log"
        command = [
            sys.executable,
            "-P",
            "-m",
            module,
            *arguments,
            "--parent",
            str(os.getpid()),
        ]
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
        # what user code prints goes to our standard error, as it comes
        with self.log_file.open("wb") as log:
            stdin = None if terminal else subprocess.DEVNULL
            self.process = subprocess.Popen(
                command,
                stdin=stdin,
                stdout=sys.__stderr__,
                stderr=log,
                env=environment,
            )

    @property
    def ended(self) -> bool:
        return self.process.poll() is not None

    def end(self, seconds: float) -> None:
        """Wait, then kill: our own child only."""
        for insist in (False, True):
            if insist:
                self.process.kill()
            try:
                self.process.wait(seconds)
                return
            except subprocess.TimeoutExpired:
                continue

    def report(self) -> dict[str, Any]:
        try:
            out: dict[str, Any] = json.loads(self.report_file.read_text())
        except (OSError, ValueError):
            return {}
        return out

    def said(self) -> str:
        return self.log_file.read_text(errors="replace").strip()


@dataclass
class _Job:
    """One run on its way."""

    cnc: _Child
    plc: _Child | None
    folder: Path
    name: str
    started: float
    stalled: bool = False

    @property
    def children(self) -> list[_Child]:
        return [child for child in (self.cnc, self.plc) if child is not None]


class Cell:
    """A machine from a configuration file (None: the built-in one, X Y Z) that
    runs programs beside a PLC.
    """

    def __init__(
        self,
        config: str | Path | None = None,
        *,
        clock: str = "lockstep",
        service: str | None = None,
    ) -> None:
        self.config_path = (
            Path(config).resolve() if config is not None else None
        )
        self.config: CellConfig = load_config(self.config_path)
        self.clock, self.service = clock, service
        self._job: _Job | None = None

    def __enter__(self) -> Cell:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End what still runs and remove it from shared memory."""
        if self._job is not None:
            job, self._job = self._job, None
            _stop(job)
            segment.remove(job.name)
            shutil.rmtree(job.folder, ignore_errors=True)

    def run(
        self,
        program: str | Path,
        plc: Any = None,
        *,
        plc_args: dict[str, Any] | None = None,
        clock: str | None = None,
        dialect: str | None = None,
        out: str | Path | None = None,
        record: str | Path | None = None,
        hold_start: bool = False,
        lenient: bool = False,
        autostart: bool = True,
        watch: Sequence[str] | str = (),
        force: dict[str, Any] | None = None,
        answers: str | Path | None = None,
        start_line: int | None = None,
        start_pass: int = 1,
        start_marker: str | None = None,
    ) -> RunResult:
        """Run the program to its end.

        ``plc``: a file, a task class, ``builtin:NAME``, None (acknowledges
        everything), or ``"none"``: no PLC process at all, in virtual time;
        functions count as acknowledged, a stop that waits for "continue" ends
        the run with an error.  ``out``: folder for files the program writes, by
        default ``hli-cosim-out``.  ``lenient``: as for ``Program``.
        ``autostart=False``: the program stands ready, the PLC starts it by
        ``mode_and_state``. ``watch``: symbols of the HLI or of a task, recorded
        at every scan (``result.plc["watch"]``); ``force``: symbols held at a
        value.  ``answers``: file with answers to the program's dialogs
        (``operator_answers``). ``start_line`` with ``start_pass``,
        ``start_marker``: where the program is taken up (``Restart``).

        CncError if something is wrong before the start (files, names); what
        goes wrong later is in the result.
        """
        refuse_cell_start()
        program, target = Path(program), Path(record) if record else None
        if not program.exists():
            raise CncError(901001, "file not found", Place(str(program)))
        if target:
            recorder.check_target(target)
        script = Path(answers) if answers else None
        if script:
            read_answers(script)
        Restart.of(start_line, start_pass, start_marker)
        choice = PlcChoice.of(plc, plc_args).online(watch, force or {})
        clock = _clock(clock or self.clock)
        segment.sweep()
        _sweep_folders()
        folder = Path(out) if out else OUT_FOLDER
        before = _files(folder)
        options = {
            "dialect": dialect,
            "hold_start": hold_start,
            "lenient": lenient,
            "out": folder,
        }
        self._job = self._start(
            program,
            choice,
            clock,
            bool(target),
            options
            | {
                "autostart": autostart,
                "answers": script,
                "start_line": start_line,
                "start_pass": start_pass,
                "start_marker": start_marker,
            },
        )
        try:
            _supervise(self._job)
        except BaseException:
            _stop(self._job)
            if target:
                recorder.finish(
                    self._job.folder / "samples.f64", target, self.config
                )
            raise
        else:
            _stop(self._job)
            result = self._collect(self._job, target)
            result.files = [
                name
                for name, stamp in _files(folder).items()
                if before.get(name) != stamp
            ]
            return result
        finally:
            self.close()

    def _start(
        self,
        program: Path,
        choice: PlcChoice,
        clock: str,
        record: bool,
        options: dict[str, Any],
    ) -> _Job:
        folder = _scratch_folder()
        name = f"hli-cosim-{os.getpid()}-{secrets.token_hex(4)}"
        alone = not choice.arguments
        chosen = CncOptions(
            program,
            name,
            config=self.config_path,
            # the same cycles, and nobody to wait for
            clock="freerun" if alone and clock == "lockstep" else clock,
            wait_plc=not alone,
            service=self.service,
            report=folder / "cnc.json",
            record=folder / "samples.f64" if record else None,
            once=True,
            terminal=sys.stdin is not None and sys.stdin.isatty(),
            **options,
        )
        started = time.monotonic()
        cnc = _Child(
            "cnc",
            "cnc_core.process",
            [chosen.as_json()],
            folder,
            chosen.terminal,
        )
        arguments = [
            "--name",
            name,
            *choice.arguments,
            "--report",
            str(folder / "plc.json"),
            "--once",
        ]
        plc = None if alone else _Child("plc", "plc_client", arguments, folder)
        return _Job(cnc, plc, folder, name, started)

    def _collect(self, job: _Job, target: Path | None) -> RunResult:
        cnc, plc = (
            job.cnc.report(),
            job.plc.report() if job.plc is not None else {},
        )
        result = RunResult(
            wall_time_s=time.monotonic() - job.started, plc=plc, warnings=[]
        )
        for key in (
            "cycles",
            "sim_time_s",
            "wall_time_s",
            "requests",
            "end",
            "messages",
            "errors",
            "warnings",
            "blocks",
            "dialect",
            "peak_mb",
        ):
            if key in cnc:
                setattr(result, key, cnc[key])
        result.warnings = [*result.warnings, *plc.get("warnings", [])]
        result.overruns = int(cnc.get("overruns", 0)) + int(
            plc.get("overruns", 0)
        )
        result.handshake_us = _handshake_us(plc)
        _judge(result, job, cnc)
        if target:
            try:
                result.recorded = recorder.finish(
                    job.folder / "samples.f64", target, self.config
                )
            except OSError as error:
                result.end = "error"
                result.errors.append(
                    CncError(
                        901004, f"recording {target}: {error.strerror}"
                    ).as_json()
                )
        return result


def _clock(name: str) -> str:
    if name not in CLOCKS:
        raise CncError(902001, f"clock {name!r}: {', '.join(CLOCKS)}")
    return name


def _scratch_folder() -> Path:
    """A folder named after this process and its start, so that the next start
    knows when nobody needs it.
    """
    me = os.getpid()
    return Path(
        tempfile.mkdtemp(prefix=f"{SCRATCH}{me}-{sync.hs_process_start(me)}-")
    )


def _sweep_folders() -> None:
    """Remove this user's folders whose launcher was killed."""
    for path in Path(tempfile.gettempdir()).glob(f"{SCRATCH}*"):
        match = re.fullmatch(rf"{SCRATCH}(\d+)-(\d+)-.+", path.name)
        try:
            ours = (
                path.lstat().st_uid == os.getuid()
                and path.is_dir()
                and not path.is_symlink()
            )
        except OSError:
            continue
        if (
            match
            and ours
            and not sync.hs_process_alive(int(match[1]), int(match[2]))
        ):
            shutil.rmtree(path, ignore_errors=True)


def _files(folder: Path | None) -> dict[str, int]:
    """Files below the folder with their time of change; none without a folder."""
    if folder is None or not folder.is_dir():
        return {}
    return {
        str(p.relative_to(folder)): p.stat().st_mtime_ns
        for p in sorted(folder.rglob("*"))
        if p.is_file()
    }


def _supervise(job: _Job) -> None:
    """Until both have ended; when one has, the other gets a short time to follow."""
    alone_since = 0.0
    if job.plc is None:
        _supervise_alone(job)
        return
    while not (job.cnc.ended and job.plc.ended):
        time.sleep(POLL_S)
        if job.cnc.ended or job.plc.ended:
            alone_since = alone_since or time.monotonic()
            # a PLC that ended well (status 0) leaves the CNC to finish;
            # anything else ends the run
            if time.monotonic() - alone_since > GRACE_S:
                return


def _supervise_alone(job: _Job) -> None:
    """Without a PLC: until the CNC has ended, or stands where only a PLC could help."""
    view: segment.Segment | None = None
    since = 0.0
    while not job.cnc.ended:
        time.sleep(POLL_S)
        try:
            view = view or segment.attach(job.name)
        except HliError:
            continue
        since = (
            (since or time.monotonic())
            if view.root.channel[0].bahn_state.wait_continue_r
            else 0.0
        )
        if since and time.monotonic() - since > STALL_S:
            job.stalled = True
            break
    if view is not None:
        view.close()


def _stop(job: _Job) -> None:
    """End both processes: ask, then insist."""
    for child in job.children:
        if not child.ended:
            child.process.terminate()
    for child in job.children:
        child.end(1.0)


def _handshake_us(plc: dict[str, Any]) -> dict[str, float | None]:
    ns = plc.get("handshake_ns") or {}
    return {
        k: ns[k] / 1000.0 if ns.get(k) is not None and ns.get("n") else None
        for k in ("p50", "p99", "p999", "max")
    }


def _judge(result: RunResult, job: _Job, cnc: dict[str, Any]) -> None:
    """The end of the run as the user should see it."""
    if job.stalled:
        result.end = "error"
        result.errors.append(CncError(905024).as_json())
    if job.plc is None:
        if not cnc:
            result.end = "aborted"
            result.errors.append(_died("CNC", job.cnc))
        elif result.errors and cnc.get("source"):
            result.error_text = cnc["source"]
        return
    plc_failed = job.plc.process.poll() != 0 and (
        not result.plc or bool(result.plc.get("error"))
    )
    if cnc.get("source") and result.errors:
        result.error_text = cnc["source"]
    plc_error = result.plc.get("error") or (
        job.plc.said() if plc_failed else ""
    )
    if plc_failed and plc_error and "died" not in plc_error:
        result.end = "error"
        result.errors.append(_plc_error(plc_error))
    elif cnc.get("aborted_by_plc") and not plc_failed:
        result.errors = result.errors or [CncError(905023).as_json()]
    elif not cnc or plc_failed or result.end == "aborted":
        result.end = "aborted"
        who, child = ("CNC", job.cnc) if not cnc else ("PLC", job.plc)
        result.errors.append(_died(who, child))


def _died(who: str, child: _Child) -> dict[str, Any]:
    last = child.said().splitlines()
    detail = f": {last[-1]}" if last and "Killed" not in last[-1] else ""
    return CncError(905001, f"the {who} process died{detail}").as_json()


def _plc_error(text: str) -> dict[str, Any]:
    """An error of the PLC program: ``FILE:LINE: Type: text`` with the user's
    frames below.
    """
    first, *frames = text.splitlines()
    match = re.match(r"(.+?):(\d+): (.*)", first)
    place = (
        Place(match[1], int(match[2]), 1, frames[-1].strip() if frames else "")
        if match
        else Place()
    )
    return CncError(
        905003, f"PLC program: {match[3] if match else first}", place
    ).as_json()
