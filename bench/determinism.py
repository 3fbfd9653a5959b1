"""Whether builds of this tree drive the same bits: compilers, levels, interpreters, processors.

    python bench/determinism.py [--variant clang-O2 ...] [--folder DIR] [--wheel FILE]

A variant is a compiler and a level (``gcc-O2``, ``clang-O3``), a compiler and a
processor, or an interpreter (``python3.12``).  Each is built from a clone of what is
committed and drives the fifty programs of ``tests/support/sample_hashes.py``.  An
interpreter has an environment of its own, where ``--wheel`` names what is built already;
a compiler has the packages of this one.
``gcc-avx2`` and ``clang-avx2`` compile all for a processor with AVX2 and FMA.
``gcc-sse2`` is an engine that never takes its solver for AVX2.
``sse2`` and ``avx2`` are the build of this environment, where the C library, numpy and
its linear algebra are told of an older processor: one without AVX2 and FMA, and one
without AVX-512; ``gcc-sse2`` is told so, too.
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
    "gcc-sse2",
    "gcc-avx2",
    "clang-avx2",
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
FLAGS = {
    "O2": "-O2",
    "O3": "-O3",
    "sse2": "-O3 -march=x86-64",
    "avx2": "-O3 -march=x86-64-v3",
}
CHOICES = tuple(
    Path("c_ext/jerk", name)
    for name in (
        "solver/interior_point.c",
        "solver/projection.c",
        "window/verify.c",
    )
)
ASKED = '__builtin_cpu_supports("avx2")'
"""Where the engine chooses a build, and how it asks for the processor."""
PRINT = (
    "import json, sys; sys.path[:0] = ['tests'];"
    "from support.sample_hashes import now; from cnc_core import _engine;"
    "print(json.dumps([_engine.__file__, now()]))"
)


def hashes(
    python: Path | str, tree: Path, within: Path | None = None, **more: str
) -> dict[str, str]:
    """What the programs of ``tree`` drive; the engine has to lie ``within``."""
    done = subprocess.run(
        [str(python), "-P", "-c", PRINT],
        cwd=tree,
        env=os.environ | more,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    engine, found = json.loads(done.stdout.splitlines()[-1])
    if within and not Path(engine).is_relative_to(within):
        raise SystemExit(f"{engine} was driven, which is not what was built")
    typed: dict[str, str] = found
    return typed


def interpreted(
    variant: str, made: Path, wheel: Path | None
) -> dict[str, str] | None:
    """The hashes of another interpreter; None: it is not here."""
    python = shutil.which(variant)
    runs = python and subprocess.run(
        [python, "-c", ""], capture_output=True, check=False
    )
    if not runs or runs.returncode:
        return None
    tree = clone(made)
    _run(python, "-m", "venv", made / "venv")
    own = made / "venv" / "bin" / "python"
    _run(own, "-m", "pip", "install", "-q", wheel or tree)
    return hashes(own, tree, made)


def compiled(variant: str, made: Path) -> dict[str, str] | None:
    """The hashes of another compiler, level or processor; None: it is not here."""
    compiler, _, kind = variant.partition("-")
    if not shutil.which(compiler):
        return None
    tree, site = clone(made), made / "site"
    if kind == "sse2":
        for choice in CHOICES:
            forget_avx2(tree / choice)
    flags = {"CC": compiler, "HLI_COSIM_FLAGS": FLAGS[kind]}
    install = ("-m", "pip", "install", "-q", "--no-deps", "--target")
    _run(sys.executable, *install, site, tree, **flags)
    told = PROCESSORS.get(kind, {}) if kind == "sse2" else {}
    return hashes(sys.executable, tree, site, PYTHONPATH=str(site), **told)


def forget_avx2(source: Path) -> None:
    """The engine of a clone believes that no processor has AVX2."""
    text = source.read_text()
    if ASKED not in text:
        raise SystemExit(f"{source} does not ask for the processor any more")
    source.write_text(text.replace(ASKED, "0"))


def clone(made: Path) -> Path:
    """What is committed, in a folder of its own."""
    _run("git", "clone", "-q", ROOT, made / "tree")
    return made / "tree"


def driven(
    variant: str, folder: Path, wheel: Path | None
) -> dict[str, str] | None:
    """The hashes of a variant; None: its tools are not here."""
    if variant == "here":
        return hashes(sys.executable, ROOT)
    if variant in PROCESSORS:
        return hashes(sys.executable, ROOT, **PROCESSORS[variant])
    if variant.startswith("python"):
        return interpreted(variant, folder / variant, wheel)
    return compiled(variant, folder / variant)


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
    parser.add_argument("--wheel", type=Path)
    args = parser.parse_args()
    text = (ROOT / "tests/golden/sample_hashes.json").read_text()
    stored: dict[str, str] = json.loads(text)["programs"]
    different = False
    with tempfile.TemporaryDirectory() as scratch:
        wheel = args.wheel and args.wheel.resolve()
        folder = (args.folder or Path(scratch)).resolve()
        for variant in args.variant or VARIANTS:
            found = driven(variant, folder, wheel)
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
