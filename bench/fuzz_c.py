"""The fuzzers of the C code: built by clang, run by libFuzzer, coverage by llvm-cov.

``tests/fuzz/harness`` holds the targets.  Everything is built in one folder and
kept there; a newer source is compiled again.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
HARNESS = ROOT / "tests/fuzz/harness"
CORPUS = ROOT / "tests/fuzz/corpus"
TARGETS = ("scanner", "words", "stages", "engine")
LONGEST = {"scanner": 2000, "words": 800, "stages": 1200, "engine": 600}
"""Bytes of an input: a longer one is slower and shows nothing more."""
OPTIONS = {"engine": ["-entropic=0"]}
"""Its many features make the choice of inputs as slow as an execution."""
SHORT = {"scanner": 64, "words": 64, "stages": 120, "engine": 100}
"""The same where the number of executions counts (``shake``)."""
HARNESS_FILES = (
    "verdict",
    "modal",
    "scanner",
    "words",
    "rows",
    "chain",
    "stages",
    "more_rows",
    "plc",
    "cell",
    "judge",
    "engine",
)
ROWS_FILES = ("verdict", "modal", "scanner", "words")
ROWS_ROOMS = ("rows/", "maths/")
"""All that scanner and words need: quickly built."""
SANITIZED = "address,undefined -fno-sanitize-recover=all"
KINDS = {
    "fuzz": f"-O1 -g -fsanitize=fuzzer-no-link,{SANITIZED}",
    "shake": "-O2 -g",
    "checked": f"-O2 -g -fsanitize={SANITIZED}",
    "cover": "-O1 -g -fprofile-instr-generate -fcoverage-mapping",
}
# as of c_ext/build_ffi.py
FLAGS = "-std=gnu11 -fno-fast-math -ffp-contract=off -pthread -w"
FLAGS += " -DENGINE_SMALL_RINGS"
NUMERIC = ("c_ext/jerk/", "c_ext/maths/", "c_ext/curve/")
COMPARED = ("c_ext/rows/", "tests/")
"""What compares bytes of an input; other numbers would only slow the fuzzer down."""
ASAN = {"ASAN_OPTIONS": "malloc_context_size=5:quarantine_size_mb=16"}
MAINS = {
    "fuzz": [],
    "shake": [HARNESS / "shake.c"],
    "checked": [HARNESS / "shake.c"],
    "cover": [HARNESS / "replay.c"],
}
DONE = re.compile(r"stat::number_of_executed_units:\s*(\d+)")


@dataclass(frozen=True)
class Ran:
    """Executions of a target and the inputs that broke it."""

    executions: int
    broken: tuple[Path, ...]
    said: str


def sources(targets: list[str]) -> list[Path]:
    """The C files of the engine module and of the harness that targets call."""
    sys.path.insert(0, str(ROOT / "c_ext"))
    from build_ffi import engine_sources  # noqa: PLC0415

    names = engine_sources()
    few = set(targets) <= set(ROWS_FILES)
    if few:
        names = [name for name in names if name.startswith(ROWS_ROOMS)]
    own = ROWS_FILES if few else HARNESS_FILES
    files = [HARNESS / f"{name}.c" for name in own]
    return [ROOT / "c_ext" / name for name in names] + files


def _run(*command: object) -> str:
    return subprocess.run(
        [str(word) for word in command],
        check=True,
        capture_output=True,
        text=True,
    ).stdout


def _includes() -> list[str]:
    return [f"-I{ROOT / 'c_ext'}", f"-I{HARNESS}"]


def _newest(depends: Path) -> float:
    """When the last of the files changed that a compiler has listed."""
    if not depends.exists():
        return float("inf")
    names = depends.read_text().replace("\\\n", " ").split(":", 1)[1].split()
    return max(
        Path(name).stat().st_mtime if Path(name).exists() else float("inf")
        for name in names
    )


class Build:
    """Objects and programs of one kind (``KINDS``) in ``folder``."""

    def __init__(self, folder: Path, kind: str) -> None:
        self.folder, self.kind = folder / kind, kind
        self.folder.mkdir(parents=True, exist_ok=True)
        self._flags = [*FLAGS.split(), *KINDS[kind].split(), *_includes()]

    def _more(self, source: Path) -> list[str]:
        name = source.relative_to(ROOT).as_posix()
        if self.kind != "fuzz" or name.startswith(COMPARED):
            return []
        faster = ["-O2"] if name.startswith(NUMERIC) else []
        return [*faster, "-fno-sanitize-coverage=trace-cmp"]

    def _object(self, source: Path) -> Path:
        name = str(source.relative_to(ROOT)).replace("/", "-")
        made, depends = self.folder / f"{name}.o", self.folder / f"{name}.d"
        if not made.exists() or made.stat().st_mtime < _newest(depends):
            how = ["-MMD", "-MF", depends, "-c", source, "-o", made]
            _run("clang", *self._flags, *self._more(source), *how)
        return made

    def objects(self, targets: list[str]) -> list[Path]:
        """Compiled as many at a time as there are processors."""
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return list(pool.map(self._object, sources(targets)))

    def _linked(self, objects: list[Path]) -> list[Path]:
        """All for coverage, which counts what is missed; else what is called:
        libFuzzer looks at every counter behind each execution.
        """
        if self.kind == "cover":
            return objects
        archive = self.folder / "all.a"
        archive.unlink(missing_ok=True)
        _run("ar", "rcs", archive, *objects)
        return [archive]

    def program(self, target: str, objects: list[Path]) -> Path:
        """The program of a target; without a fuzzer it runs the files it is given."""
        made = self.folder / target
        _run(
            "clang",
            *self._flags,
            f"-DFUZZ_TARGET=fuzz_{target}",
            "-include",
            HARNESS / "targets.h",
            HARNESS / ("fuzzer.c"),
            *self._linked(objects),
            *(["-fsanitize=fuzzer"] if self.kind == "fuzz" else []),
            *MAINS[self.kind],
            "-lm",
            "-lrt",
            "-o",
            made,
        )
        return made


def kept(found: Path) -> set[Path]:
    """Inputs that broke a promise; libFuzzer's slow ones did not."""
    return {p for p in found.iterdir() if not p.name.startswith("slow-unit")}


def run(
    target: str, program: Path, corpus: Path, seconds: float, seed: int
) -> Ran:
    """Fuzz until the time is over or an input breaks a promise; that input is
    kept beside the corpus.
    """
    corpus.mkdir(parents=True, exist_ok=True)
    found = corpus.parent / f"{target}-broken"
    found.mkdir(exist_ok=True)
    before = kept(found)
    seeds = CORPUS / target
    command = [
        program,
        corpus,
        *([seeds] if seeds.is_dir() else []),
        f"-max_total_time={max(1, int(seconds))}",
        f"-max_len={LONGEST[target]}",
        "-timeout=30",
        "-rss_limit_mb=2048",
        f"-seed={seed}",
        "-print_final_stats=1",
        "-verbosity=1",
        *OPTIONS.get(target, []),
        f"-artifact_prefix={found}/",
    ]
    words = list(map(str, command))
    done = subprocess.run(
        words,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
        env=os.environ | ASAN,
    )
    said = done.stderr
    executed = DONE.search(said)
    told = [
        line
        for line in said.splitlines()
        if line.startswith(("broken", "==", "SUMMARY"))
        or "runtime error" in line
    ]
    broken = tuple(sorted(kept(found) - before))
    return Ran(int(executed[1]) if executed else 0, broken, "\n".join(told))


def shake(
    target: str, program: Path, corpus: Path, times: int, seed: int
) -> Ran:
    """So many executions of inputs that are changed blindly."""
    found = corpus.parent / f"{target}-broken"
    for folder in (corpus, found):
        folder.mkdir(parents=True, exist_ok=True)
    inputs = [*corpus.iterdir(), *(CORPUS / target).glob("*")]
    listed = corpus.parent / f"{target}-inputs"
    listed.write_text("".join(f"{path}\n" for path in sorted(inputs)))
    kept_as = found / f"shaken-{seed}"
    words = [program, listed, kept_as, times, seed, SHORT[target]]
    done = subprocess.run(
        list(map(str, words)),
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    broken = (kept_as,) if done.returncode else ()
    executed = re.search(r"executions (\d+)", done.stdout)
    return Ran(int(executed[1]) if executed else 0, broken, done.stderr)


def coverage(
    programs: dict[str, Path], corpora: dict[str, list[Path]]
) -> dict[str, dict[str, tuple[int, int]]]:
    """Per C file the lines and edges (regions) that the corpora reach, of how many."""
    with tempfile.TemporaryDirectory() as folder:
        raw = []
        for target, program in programs.items():
            profile = Path(folder) / f"{target}.raw"
            raw.append(profile)
            names = [
                p for path in corpora[target] for p in sorted(path.iterdir())
            ]
            listed = Path(folder) / "inputs"
            listed.write_text("\n".join(map(str, names)))
            subprocess.run(
                [str(program), str(listed)],
                env=os.environ | {"LLVM_PROFILE_FILE": str(profile)},
                stdout=subprocess.DEVNULL,
                check=True,
            )
        merged = Path(folder) / "merged"
        _run("llvm-profdata", "merge", "-sparse", *raw, "-o", merged)
        first, *others = programs.values()
        more = [word for path in others for word in ("-object", path)]
        text = _run(
            "llvm-cov",
            "export",
            "-summary-only",
            f"-instr-profile={merged}",
            first,
            *more,
        )
    found = {}
    for file in json.loads(text)["data"][0]["files"]:
        path = Path(file["filename"])
        if path.is_relative_to(ROOT / "c_ext"):
            figures = file["summary"]
            found[str(path.relative_to(ROOT))] = {
                name: (figures[name]["covered"], figures[name]["count"])
                for name in ("lines", "regions", "branches")
            }
    return found


def missing_tools() -> str:
    """Programs that are needed and not there, "" if all are."""
    missing = [
        name
        for name in ("clang", "llvm-profdata", "llvm-cov")
        if not shutil.which(name)
    ]
    return f"not on the path: {', '.join(missing)}" if missing else ""
