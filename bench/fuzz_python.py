"""One reader of strangers' inputs under atheris, and what its corpus covers.

    python bench/fuzz_python.py fuzz TARGET FOLDER SECONDS SEED
    python bench/fuzz_python.py cover FOLDER TARGET...

Each runs in a process of its own: atheris changes what is imported and ends the
process.  ``support/fuzz_targets.py`` has the targets.
"""

from __future__ import annotations

import importlib
import json
import os
import random
import resource
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PACKAGES = ("cnc_core", "hli", "plc_client")
LONGEST = 4000
SLOW_S = 8.0  # of processor time; the largest check of the goldens takes 1.5 s


def _targets() -> dict[str, Any]:
    sys.path.insert(0, str(ROOT / "tests"))
    found: dict[str, Any] = importlib.import_module(
        "support.fuzz_targets"
    ).TARGETS
    return found


class Judge:
    """Runs inputs, counts them, keeps the smallest of each kind that breaks."""

    def __init__(self, run: Callable[[bytes], None], broken: Path) -> None:
        self._run, self._broken = run, broken
        self.executions, self.slowest_s = 0, 0.0

    def one(self, data: bytes) -> None:
        """An input that breaks is kept under the place where it broke."""
        self.executions += 1
        began = time.process_time()
        try:
            self._run(data)
        except Exception as error:
            frames = traceback.extract_tb(error.__traceback__)
            own = [f for f in frames if "fuzz" not in Path(f.filename).name]
            last = (own or frames)[-1]
            where = f"{Path(last.filename).stem}-{last.lineno}"
            self._keep(f"{type(error).__name__}-{where}", data)
        took = time.process_time() - began
        self.slowest_s = max(self.slowest_s, took)
        if took > SLOW_S:
            self._keep("slow", data)

    def _keep(self, name: str, data: bytes) -> None:
        path = self._broken / name
        if not path.exists() or path.stat().st_size > len(data):
            path.write_bytes(data)


def fuzz(name: str, folder: Path, seconds: float, seed: int) -> None:
    """Until the time is over; the figures go to ``NAME.json`` of the folder."""
    import atheris  # noqa: PLC0415

    with atheris.instrument_imports(include=list(PACKAGES)):
        target = _targets()[name]
    corpus, broken = folder / name, folder / f"{name}-broken"
    for path in (corpus, broken):
        path.mkdir(parents=True, exist_ok=True)
    seeds = list(target.seeds())
    for k, data in enumerate(seeds):
        (corpus / f"seed{k}").write_bytes(data)
    judge = Judge(target.run, broken)
    targets = importlib.import_module("support.fuzz_targets")
    changed = targets.Changing(seeds).changed

    def change(data: bytes, longest: int, at: int) -> bytes:
        rng = random.Random(at)
        if rng.random() < 0.3:
            made: bytes = atheris.Mutate(data, longest)
            return made
        out: bytes = changed(data, rng)
        return out[:longest]

    def told() -> None:
        figures = {
            "executions": judge.executions,
            "slowest_s": round(judge.slowest_s, 2),
            "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            >> 10,
        }
        (folder / f"{name}.json").write_text(json.dumps(figures))

    def one(data: bytes) -> None:
        judge.one(data)
        if judge.executions % 50 == 0:
            told()

    words = [sys.argv[0], str(corpus), f"-max_total_time={int(seconds)}"]
    words += [f"-max_len={LONGEST}", f"-seed={seed}", "-timeout=120"]
    words += ["-rss_limit_mb=3000", f"-artifact_prefix={broken}/"]
    more = {"custom_mutator": change} if target.is_text else {}
    atheris.Setup(words, one, **more)
    try:
        atheris.Fuzz()
    finally:
        told()


def cover(folder: Path, names: list[str]) -> None:
    """Lines per file that the corpora reach, of how many, as JSON."""
    import coverage  # noqa: PLC0415

    watch = coverage.Coverage(
        source=[str(ROOT / name) for name in PACKAGES],
        data_file=None,
        config_file=False,
    )
    watch.start()
    targets = _targets()
    for name in names:
        judge = Judge(targets[name].run, folder / f"{name}-broken")
        (folder / f"{name}-broken").mkdir(parents=True, exist_ok=True)
        for data in targets[name].seeds():
            judge.one(data)
        if (folder / name).is_dir():
            for path in sorted((folder / name).iterdir()):
                judge.one(path.read_bytes())
    watch.stop()
    wanted = {place for name in names for place in targets[name].covers}
    found = {}
    for place in sorted(wanted):
        path = ROOT / place
        for file in [path] if path.is_file() else sorted(path.rglob("*.py")):
            _, lines, _, missing, _ = watch.analysis2(str(file))
            found[str(file.relative_to(ROOT))] = {
                "lines": (len(lines) - len(missing), len(lines)),
                "missing": missing,
            }
    print(json.dumps(found))


def main() -> None:
    """See the module's text."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    if sys.argv[1] == "fuzz":
        name, folder, seconds, seed = sys.argv[2:6]
        fuzz(name, Path(folder), float(seconds), int(seed))
    else:
        cover(Path(sys.argv[2]), sys.argv[3:])


if __name__ == "__main__":
    main()
