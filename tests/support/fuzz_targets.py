"""Inputs of strangers as bytes, each through the reader that it is meant for.

A target either ends quietly or raises: an exception that is no error of the
project, an error without number, place or clear text, too much work.
``bench/fuzz.py`` runs them for hours, ``tests/fuzz/test_readers.py`` their corpus.
"""

from __future__ import annotations

import contextlib
import json
import random
import re
import shutil
import socket
import struct
import tempfile
import threading
import tomllib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cnc_core.config import CellConfig, load_config
from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.isg.cycles.registry import CYCLES
from cnc_core.frontend.operator import read_answers
from cnc_core.recording.golden import check_recording
from cnc_core.recording.reading import Recording
from hli.orders import CNC, OrdersAtOnce
from plc_client.golden import GoldenMismatchError
from plc_client.mock import script
from plc_client.mock.cnc import MockCnc
from support.fuzz_seeds import parts_of, programs
from support.mutated import (
    CELL,
    DIALECTS,
    LINES_MAX,
    ROWS_MAX,
    checked,
    mutated,
    unclear,
)
from support.osai_programs import SETUP_3
from support.paths import ROOT, TESTS

FRONT = "cnc_core/frontend"
CORPUS = TESTS / "fuzz" / "corpus"
TIMES_CPU_S = 10.0
SUBPROGRAMS = {
    "sub.nc": "G1 X1 F100\nM17\n",
    "c.cyc": "G1 X@P1 F100\nM17\n",
    "values.txt": "1\n2\n",
    "CONFIG1": SETUP_3,
    "cell.toml": "",
}
EXPRESSIONS = {
    "isg": "V.P.A = {}\n#VAR\nV.L.B = {}\n#ENDVAR\nG1 X[{}] F100\nM30\n",
    "iso": "#1 = {}\nG1 X[{}] F100\nM30\n",
    "isons": "$a = {}\nX = {}\nM30\n",
    "osai": "E1={}\nG1 X({}) F100\nM30\n",
}


@dataclass(frozen=True)
class Target:
    """``run`` takes an input, ``seeds`` begin the corpus, ``covers`` is what it is for."""

    run: Callable[[bytes], None]
    seeds: Callable[[], Iterable[bytes]]
    covers: tuple[str, ...]
    is_text: bool = True


class NotBoundedError(AssertionError):
    """More rows or lines than a check may take."""


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    folder = Path(tempfile.mkdtemp(prefix="hli-cosim-fuzz-"))
    try:
        yield folder
    finally:
        shutil.rmtree(folder)


def _text(data: bytes) -> str:
    return data.decode("utf-8", "replace")


# ------------------------------------------------------------------ programs
def _merged(table: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """Keys of ``other`` go before, tables are merged."""
    out = dict(table)
    for key, value in other.items():
        mine = out.get(key)
        both = isinstance(mine, dict) and isinstance(value, dict)
        out[key] = _merged(mine, value) if both else value
    return out


def _cell(text: str) -> CellConfig:
    """The cell of all programs with what a text adds, if the two make a cell."""
    table = tomllib.loads(CELL)
    with contextlib.suppress(ValueError, RecursionError):
        return CellConfig.model_validate(_merged(table, tomllib.loads(text)))
    return CellConfig.model_validate(table)


def _written(folder: Path, data: bytes) -> dict[str, Path]:
    """The parts of an input as files: ``support/fuzz_seeds.py``."""
    main, files = parts_of(_text(data))
    found = {}
    for name, text in {**SUBPROGRAMS, **files, "main.nc": main}.items():
        if name.strip("."):
            found[name] = folder / name
            found[name].write_text(text, "utf-8", "replace", newline="")
    return found


def check_program(dialect: str, data: bytes) -> None:
    """A program as it comes, between files that it may call."""
    with _folder() as folder:
        files = _written(folder, data)
        cell = _cell(files["cell.toml"].read_text("utf-8"))
        path, answers = files["main.nc"], files.get("answers.json")
        errors, rows, lines = checked(path, dialect, cell, answers)
    if rows > ROWS_MAX + 10_000 or lines > LINES_MAX:
        raise NotBoundedError(f"{rows} rows, {lines} lines")
    for error in errors:
        if words := unclear(error):
            raise AssertionError(f"{words}: {error.code} {error.text!r}")


def _program_seeds(dialect: str) -> list[bytes]:
    kept = sorted((CORPUS / dialect).glob("*"))
    found = [text.encode("utf-8", "replace") for text in programs(dialect)]
    return found + [path.read_bytes() for path in kept]


def check_expression(data: bytes) -> None:
    """The first byte chooses the dialect, the text is one expression in three places."""
    dialect = DIALECTS[data[0] % len(DIALECTS)] if data else DIALECTS[0]
    text = _text(data[1:]).replace("\n", " ")
    form = EXPRESSIONS[dialect]
    check_program(dialect, form.replace("{}", text).encode())


def _expression_seeds() -> Iterator[bytes]:
    texts = (
        "1+2*3",
        "[1+2]*3 MOD 4",
        "SIN[30]**2",
        "ATAN2[1,2]",
        "(1 + 2) / 3",
        "sqrt(2) + abs(-1)",
        "2 ** 3 ** 2",
        "1 < 2 AND 3 >= 2",
        "ROUND[1.5]+INT[2.5]",
        "#1+#2",
        "V.A.ABS.X",
        "E1*2",
    )
    for text in texts:
        for k in range(len(DIALECTS)):
            yield bytes([k]) + text.encode()


def check_cycle(data: bytes) -> None:
    """The first byte chooses the cycle, the text its parameters."""
    names = sorted(cycle.name for cycle in CYCLES)
    name = names[data[0] % len(names)] if data else names[0]
    text = _text(data[1:]).replace("\n", " ")
    program = f"G0 X0 Y0 Z0 F500\nT1 D1\nL CYCLE [NAME={name} {text}]\nM30\n"
    check_program("isg", program.encode())


CALLED = re.compile(r"CYCLE *\[ *NAME *= *\"?(\w+)[\w.]*\"?([^\n]*)\]")


def _cycle_seeds() -> Iterator[bytes]:
    """Every cycle that a golden program or a test calls, with its parameters."""
    names = sorted(cycle.name for cycle in CYCLES)
    places = {name.upper(): k for k, name in enumerate(names)}
    for k in range(len(names)):
        for text in ("", "@P1=1 @P2=2", "@P1=10 @P2=5 @P3=3 @P4=1 @P5=2"):
            yield bytes([k]) + text.encode()
    for program in programs("isg"):
        for name, text in CALLED.findall(program):
            if name.upper() in places:
                yield bytes([places[name.upper()]]) + text.encode()


# --------------------------------------------------------------------- files
def _is_refused(read: Callable[[Path], object], data: bytes, name: str) -> None:
    """Read, or refused by number with words."""
    with _folder() as folder:
        path = folder / name
        path.write_bytes(data)
        try:
            read(path)
        except CncError as error:
            if error.code not in ERRORS or not error.text.strip():
                raise AssertionError(f"{error.code} {error.text!r}") from None


def check_cell(data: bytes) -> None:
    """A cell file."""
    _is_refused(load_config, data, "cell.toml")


def check_answers(data: bytes) -> None:
    """A script of answers to dialogs."""
    _is_refused(read_answers, data, "answers.json")


def _read_recording(path: Path) -> None:
    recording = Recording(path)
    for name in recording.tables:
        table = recording.table(name)
        len(table)
        for column in table.types:
            table[column]
    with contextlib.suppress(GoldenMismatchError):
        check_recording(path, recording)


RECORDINGS = ("a.npz", "a.parquet", "a.arrow")


def check_recorded(data: bytes) -> None:
    """A recording, and the same as a golden file; the first byte chooses its kind."""
    kind = data[0] % len(RECORDINGS) if data else 0
    _is_refused(_read_recording, data[1:], RECORDINGS[kind])


def _recording_seeds() -> Iterator[bytes]:
    for kind, name in enumerate(RECORDINGS):
        ending = Path(name).suffix
        for path in sorted(ROOT.glob(f"tests/**/*{ending}"))[:3]:
            if path.stat().st_size < 100_000:
                yield bytes([kind]) + path.read_bytes()
        yield bytes([kind]) + b"PK\x03\x04PAR1ARROW1"


def _cell_seeds() -> Iterator[bytes]:
    for path in ROOT.glob("examples/**/*.toml"):
        yield path.read_bytes()
    for path in ROOT.glob("tests/**/*.toml"):
        if path.stat().st_size < 4000:
            yield path.read_bytes()


def _answer_seeds() -> Iterator[bytes]:
    yield b'["YES", {"set": {"A": 1.0}, "press": "OK"}]'
    yield b'[{"set": {"A": 1' + b"0" * 320 + b"}}]"
    yield b"[[[]]]"


# ------------------------------------------------------------- other processes
class _Listening(OrdersAtOnce):
    """Takes an order from a socket that is there, and answers what it was given."""

    def __init__(self) -> None:
        super().__init__(CNC, lambda order: {"keys": sorted(order)})

    def take(self, listening: socket.socket) -> None:
        """Until the socket is closed."""
        self._listen(listening)


def check_orders(data: bytes) -> None:
    """Bytes of a client to the socket of the online functions: an answer of JSON, or none."""
    with _folder() as folder, socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(folder / "orders"))
        listening.listen(1)
        thread = threading.Thread(target=_Listening().take, args=(listening,))
        thread.start()
        try:
            with socket.socket(socket.AF_UNIX) as client:
                client.connect(str(folder / "orders"))
                client.settimeout(TIMES_CPU_S)
                with contextlib.suppress(BrokenPipeError, ConnectionError):
                    client.sendall(data)
                    client.shutdown(socket.SHUT_WR)
                    said = client.makefile("rb").readline()
                    if said:
                        json.loads(said)
        finally:
            alive = thread.is_alive()
            listening.shutdown(socket.SHUT_RDWR)
            thread.join(TIMES_CPU_S)
    if not alive or thread.is_alive():
        raise AssertionError(
            "the listening thread has not lived as long as it has to"
        )


def _order_seeds() -> Iterator[bytes]:
    yield b'{"order": "force", "path": "P.x", "value": 1}\n'
    yield b"[]\n"
    yield b'{"a": NaN}\n'
    yield b"[" * 3000 + b"\n"


STEPS = (
    script.line,
    script.rapid,
    script.polynomial,
    script.dwell,
    script.log_on,
    script.log_param,
    script.log_off,
)
NUMBERED = (script.m, script.h, script.s, script.t, script.cnc_error)
CYCLES_MAX = 200


def check_mock(data: bytes) -> None:
    """A script of a mock CNC of any numbers runs, or is refused by ValueError."""
    steps = []
    for at in range(0, len(data) - 9, 9):
        kind, number = struct.unpack_from("<Bd", data, at)
        try:
            if kind % 13 < len(STEPS):
                steps.append(STEPS[kind % 13](number))
            elif kind % 13 == 12:
                steps.append(script.arc(number, kind / 50))
            elif abs(number) < 2**70:
                steps.append(NUMBERED[kind % len(NUMBERED)](int(number)))
        except ValueError:
            return
    try:
        mock = MockCnc(steps)
    except ValueError:
        return
    with mock:
        for _ in range(CYCLES_MAX):
            mock.cycle()


def _mock_seeds() -> Iterator[bytes]:
    rng = random.Random(1)
    for _ in range(20):
        yield b"".join(
            struct.pack("<Bd", rng.randrange(256), rng.choice([0.01, 1, 8, 30]))
            for _ in range(rng.randrange(1, 10))
        )


NUMBER = re.compile(r"(?<![.\d])\d+(?:\.\d*)?")
EXTREMES = ("0", "0.000001", "0.001", "65535", "1000000", "1000000000000")


class Changing:
    """Texts with one to three changes of their signs, words and lines; in some a
    line of another text comes or goes before, in some a number is extreme.
    """

    def __init__(self, seeds: Iterable[bytes]) -> None:
        lines = (line for seed in seeds for line in _text(seed).splitlines())
        self._lines = list(dict.fromkeys(lines)) or ["G1 X1"]

    def _spliced(self, rng: random.Random, text: str) -> str:
        lines = text.split("\n")
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(lines))
            lines[at : at + rng.randint(0, 1)] = [rng.choice(self._lines)]
        return "\n".join(lines)

    def _extreme(self, rng: random.Random, text: str) -> str:
        numbers = list(NUMBER.finditer(text))
        if not numbers:
            return text
        one = rng.choice(numbers)
        return text[: one.start()] + rng.choice(EXTREMES) + text[one.end() :]

    def changed(self, data: bytes, rng: random.Random) -> bytes:
        """The text changed; it is never empty."""
        text = _text(data)
        if text and rng.random() < 0.3:
            return self._extreme(rng, text).encode("utf-8", "replace")
        if not text or rng.random() < 0.4:
            text = self._spliced(rng, text)
            if rng.random() < 0.5:
                return text.encode("utf-8", "replace")
        return mutated(rng, text or "G1 X1").encode("utf-8", "replace")


def _of(dialect: str) -> Target:
    return Target(
        lambda data: check_program(dialect, data),
        lambda: _program_seeds(dialect),
        (f"{FRONT}/base", f"{FRONT}/{dialect}"),
    )


TARGETS: dict[str, Target] = {
    **{dialect: _of(dialect) for dialect in DIALECTS},
    "expressions": Target(
        check_expression, _expression_seeds, (f"{FRONT}/base",)
    ),
    "cycles": Target(check_cycle, _cycle_seeds, (f"{FRONT}/isg/cycles",)),
    "cell": Target(check_cell, _cell_seeds, ("cnc_core/config",)),
    "answers": Target(check_answers, _answer_seeds, (f"{FRONT}/operator.py",)),
    "recordings": Target(
        check_recorded,
        _recording_seeds,
        ("cnc_core/recording/reading.py", "cnc_core/recording/source.py"),
        is_text=False,
    ),
    "orders": Target(check_orders, _order_seeds, ("hli/orders.py",)),
    "mock": Target(
        check_mock, _mock_seeds, ("plc_client/mock",), is_text=False
    ),
}
