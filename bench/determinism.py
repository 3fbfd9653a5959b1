"""Whether builds of this tree drive the same bits: compilers, levels, interpreters, processors.

    python bench/determinism.py [--variant clang-O2 ...] [--folder DIR]

A variant is a compiler and a level (``gcc-O2``, ``clang-O3``), or an interpreter
(``python3.12``).  Each is built from a clone of what is committed, in an environment
of its own, and drives the fifty programs of ``tests/support/sample_hashes.py``.
``sse2`` and ``avx2`` are the build of this environment, where the C library, numpy and
its linear algebra are told of an older processor: one without AVX2 and FMA, and one
without AVX-512.
Prints one line a variant and ends with 1 if one of them differs.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
VARIANTS = (
    "here",
    "sse2",
    "avx2",
    "gcc-O2",
    "gcc-O3",
    "clang-O2",
    "clang-O3",
    "python3.11",
    "python3.12",
    "python3.13",
    "python3.14",
)
PROCESSORS = {
    "sse2": {
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-AVX2_Usable,-FMA,-FMA_Usable,-FMA4,-AVX512F",
        "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
        "OPENBLAS_CORETYPE": "Nehalem",
    },
    "avx2": {
        "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
        "OPENBLAS_CORETYPE": "Haswell",
    },
}
PRINT = (
    "import json, sys; sys.path[:0] = ['tests'];"
    "from support.sample_hashes import now; print(json.dumps(now()))"
)


def hashes(python: Path | str, tree: Path, **more: str) -> dict[str, str]:
    """What the programs of ``tree`` drive."""
    done = subprocess.run(
        [str(python), "-P", "-c", PRINT],
        cwd=tree,
        env=os.environ | more,
        check=True,
        capture_output=True,
        text=True,
    )
    found: dict[str, str] = json.loads(done.stdout.splitlines()[-1])
    return found


def built(variant: str, folder: Path) -> dict[str, str] | None:
    """The hashes of a variant that is built here; None: its tools are missing."""
    compiler, _, level = variant.partition("-")
    python = sys.executable
    flags = {}
    if variant.startswith("python"):
        python = shutil.which(variant) or ""
        runs = python and subprocess.run(
            [python, "-c", ""], capture_output=True, check=False
        )
        if not runs or runs.returncode:
            return None
    else:
        if not shutil.which(compiler):
            return None
        flags = {"CC": compiler, "HLI_COSIM_FLAGS": f"-{level}"}
    made = folder / variant
    _run(python, "-m", "venv", made / "venv")
    _run("git", "clone", "-q", ROOT, made / "tree")
    own = made / "venv" / "bin" / "python"
    _run(own, "-m", "pip", "install", "-q", made / "tree", **flags)
    return hashes(own, made / "tree")


def _run(*words: object, **more: str) -> None:
    subprocess.run(
        [str(word) for word in words], env=os.environ | more, check=True
    )


def main() -> None:
    """See the module's text."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--variant", action="append", choices=VARIANTS)
    parser.add_argument("--folder", type=Path)
    args = parser.parse_args()
    text = (ROOT / "tests/golden/sample_hashes.json").read_text()
    stored: dict[str, str] = json.loads(text)["programs"]
    different = False
    with tempfile.TemporaryDirectory() as scratch:
        folder = (args.folder or Path(scratch)).resolve()
        for variant in args.variant or VARIANTS:
            found: dict[str, str] | None
            if variant == "here":
                found = hashes(sys.executable, ROOT)
            elif variant in PROCESSORS:
                told = PROCESSORS[variant]
                found = hashes(sys.executable, ROOT, **told)
            else:
                found = built(variant, folder)
            if found is None:
                print(f"{variant:12} not here, left out", flush=True)
                continue
            other = [name for name in stored if stored[name] != found[name]]
            different |= bool(other)
            said = ", ".join(other[:5]) if other else "the same bits"
            print(
                f"{variant:12} {len(stored) - len(other)} of {len(stored)}: {said}",
                flush=True,
            )
    sys.exit(different)


if __name__ == "__main__":
    main()
