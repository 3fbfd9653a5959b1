"""The models of ``docs/explanation/model`` hold, and each fence, store order and lock in
them is needed (checked by spin).
"""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from support.seeds import few

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "explanation" / "model"
MODELS = sorted(
    path.stem for path in FOLDER.glob("*.pml") if path.stem != "memory"
)
DEPTH = 200_000


def mutations(model: str) -> list[str]:
    """Names of what the model can be built without."""
    return sorted(
        set(re.findall(r"\bMUTATE_\w+", (FOLDER / f"{model}.pml").read_text()))
    )


def check(folder: Path, model: str, *defines: str) -> tuple[int, int]:
    """(errors, states stored) of an exhaustive search."""
    spin = [
        "spin",
        "-a",
        *(f"-D{d}" for d in defines),
        str(FOLDER / f"{model}.pml"),
    ]
    subprocess.run(spin, cwd=folder, check=True, capture_output=True)
    build = [
        "cc",
        "-O0" if defines else "-O1",
        "-w",
        "-DSAFETY",
        "-DVECTORSZ=2048",
        "-o",
        "pan",
        "pan.c",
    ]
    subprocess.run(build, cwd=folder, check=True, capture_output=True)
    done = subprocess.run(
        ["./pan", f"-m{DEPTH}"],
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert "search depth too small" not in done.stdout
    errors, states = (
        re.search(r"errors: (\d+)", done.stdout),
        re.search(r"(\d+) states, stored", done.stdout),
    )
    assert errors, done.stdout
    assert states, done.stdout
    return int(errors[1]), int(states[1])


pytestmark = [
    pytest.mark.ci,
    pytest.mark.skipif(
        not (shutil.which("spin") and shutil.which("cc")),
        reason="spin or a C compiler is not installed",
    ),
]


@pytest.mark.parametrize("model", MODELS)
def test_a_model_holds(tmp_path: Path, model: str) -> None:
    """No reachable state breaks a property, and nobody is stuck."""
    errors, states = check(tmp_path, model)
    print(f"{model}: {states} states")
    assert not errors
    assert states > 100


@pytest.mark.parametrize(
    ("model", "mutation"),
    [
        case
        for model in MODELS
        for case in few([(model, name) for name in mutations(model)], 2)
    ],
)
def test_a_mutation_is_caught(
    tmp_path: Path, model: str, mutation: str
) -> None:
    """Without this fence, order or lock a property fails."""
    errors, _ = check(tmp_path, model, mutation)
    assert errors
