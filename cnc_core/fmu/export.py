"""Packing an FMU: description, compiled shim, program, cell and PLC."""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

from ..config import CellConfig, load_config
from ..errors import CncError, Place
from ..program import Program
from .description import Model, description
from .description3 import description3
from .instance import Acknowledging
from .symbols import chosen_of
from .variables import (
    ARRAY,
    ARRAYS,
    MODEL,
    Variable,
    check_names,
    externals,
    inputs,
    outputs,
    parameters,
    told_apart,
)
from .wire import HLI_SIZE

PARTS = ("wire.c", "instance.c")
FLAGS = ("-std=c11", "-O2", "-fPIC", "-shared", "-fvisibility=hidden")
STRICT = ("-Wall", "-Wextra", "-Werror")
PLATFORMS = {2: "linux64", 3: "x86_64-linux"}
DESCRIPTIONS = {2: description, 3: description3}


def export_fmu(
    program: str | Path,
    target: str | Path,
    *,
    config: str | Path | None = None,
    plc: str | Path | None = None,
    input_symbols: Sequence[str] = (),
    output_symbols: Sequence[str] = (),
    fmi: int = 2,
) -> Path:
    """Write the FMU of a cell, for co-simulation.

    ``fmi``: 2 for FMI 2.0; 3 for FMI 3.0, which has arrays for the contour
    ahead and the HLI as Binary.

    ``config``: cell file.  ``plc``: a file of Python tasks or of Structured
    Text; None acknowledges everything.  ``input_symbols``, ``output_symbols``:
    symbols of PLC or HLI that become inputs and outputs.
    CncError: a file is missing or wrong, there is no C compiler.
    """
    if fmi not in DESCRIPTIONS:
        raise CncError(902001, f"FMI {fmi}: there are 2 and 3")
    program, target = Path(program), Path(target)
    cell = load_config(config)
    _check(program, cell, plc)
    files = (program, Path(config) if config else None, tasks_of(plc))
    more = chosen_of(files, cell, (input_symbols, output_symbols))
    given = [*inputs(), *externals(cell), *more[0]]
    variables = [
        *parameters(cell, program.name),
        *given,
        *outputs(cell),
        *told_apart(more[1], given),
    ]
    check_names(variables)
    sources = [program, *(Path(file) for file in (config, plc) if file)]
    _check_files(sources)
    model = Model(
        target.stem,
        _guid(sources, variables),
        cell.cycle_s,
        program.name,
        variables,
    )
    about = {
        "program": program.name,
        "cell": Path(config).name if config else "",
        "plc": Path(plc).name if plc else "",
        "cycle_s": cell.cycle_s,
        "variables": [asdict(variable) for variable in variables],
    }
    with tempfile.TemporaryDirectory() as folder:
        shim = compiled(Path(folder), model, fmi)
        _pack(target, model, about, sources, shim, fmi)
    return target


def tasks_of(plc: str | Path | None) -> list[Any]:
    return [Path(plc)] if plc else [Acknowledging]


def _check(program: Path, cell: CellConfig, plc: str | Path | None) -> None:
    """Refuse what is wrong before anything is written."""
    for file in (program, plc):
        if file is not None and not Path(file).is_file():
            raise CncError(901001, "file not found", Place(str(file)))
    checked = Program(program, cell, collect=True)
    for _ in checked.batches():
        pass
    checked.reader.close()
    if checked.errors:
        raise checked.errors[0]


def _check_files(files: Sequence[Path]) -> None:
    """CncError: two of them would be one file of the FMU."""
    seen = {MODEL}
    for file in files:
        if file.name in seen:
            raise CncError(
                902001, f"FMU: two files {file.name!r}: rename one of them"
            )
        seen.add(file.name)


def _guid(sources: Sequence[Path], variables: Sequence[Variable]) -> str:
    """The same for the same files and variables."""
    found = hashlib.sha256(repr(list(variables)).encode())
    for file in sources:
        found.update(hashlib.sha256(file.read_bytes()).digest())
    return "{" + found.hexdigest()[:32] + "}"


def compiled(folder: Path, model: Model, fmi: int) -> Path:
    """The shim as a shared library; CncError with the compiler's words."""
    # CC may hold arguments, as "ccache gcc" does
    found = shutil.which("cc") or shutil.which("gcc") or ""
    compiler = shlex.split(os.environ.get("CC") or found)
    if not compiler:
        raise CncError(
            902001, "an FMU needs a C compiler: install gcc or clang"
        )
    shim = files(__package__) / "shim"
    names = [name.name for name in shim.iterdir()]
    for name in names:
        (folder / name).write_text((shim / name).read_text())
    (folder / "model.h").write_text(header(model, fmi))
    out = folder / f"{model.identifier}.so"
    sources = [str(folder / name) for name in PARTS] + [
        str(folder / f"fmi{fmi}.c")
    ]
    command = [*compiler, *FLAGS, *STRICT, "-o", str(out), *sources, "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise CncError(902001, f"the shim does not compile: {done.stderr}")
    return out


def header(model: Model, fmi: int) -> str:
    """Counts, kinds and start values for C."""
    variables = model.variables
    counts = {
        kind: sum(v.causality == kind for v in variables)
        for kind in ("parameter", "input")
    }
    first_array = next(i for i, v in enumerate(variables) if v.array)
    lines = {
        "MODEL_FMI": fmi,
        "MODEL_VALUES": len(variables),
        "MODEL_FIRST_INPUT": counts["parameter"],
        "MODEL_FIRST_OUTPUT": counts["parameter"] + counts["input"],
        "MODEL_HLI_SIZE": HLI_SIZE,
        "MODEL_CYCLE": repr(model.cycle_s),
        "MODEL_GUID": json.dumps(model.guid),
        "MODEL_PYTHON": json.dumps(sys.executable, ensure_ascii=False),
        "MODEL_PROGRAM": json.dumps(model.program, ensure_ascii=False),
        "MODEL_KINDS": json.dumps("".join(v.kind[0] for v in variables)),
        "MODEL_START": f"{{{', '.join(repr(v.start) for v in variables)}}}",
        "MODEL_FIRST_ARRAY": first_array,
        "MODEL_ARRAY_SIZE": ARRAY,
        "MODEL_ARRAYS": len(ARRAYS) if fmi == 3 else 0,
    }
    return "".join(f"#define {k} {v}\n" for k, v in lines.items())


def _pack(
    target: Path,
    model: Model,
    about: dict[str, object],
    sources: Sequence[Path],
    shim: Path,
    fmi: int,
) -> None:
    """The archive, whole or not at all."""
    part = target.with_name(f"{target.name}.part")
    try:
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
            tool = f"hli-cosim {version('hli-cosim')}"
            archive.writestr(
                "modelDescription.xml", DESCRIPTIONS[fmi](model, tool)
            )
            archive.writestr(f"resources/{MODEL}", json.dumps(about))
            for file in sources:
                archive.write(file, f"resources/{file.name}")
            archive.write(shim, f"binaries/{PLATFORMS[fmi]}/{shim.name}")
        part.replace(target)
    except OSError as error:
        part.unlink(missing_ok=True)
        text = f"cannot be written: {error.strerror}"
        raise CncError(901004, text, Place(str(target))) from None
