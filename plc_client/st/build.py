"""From source files to a program that can be loaded; the result is kept by content."""

from __future__ import annotations

import functools
import gc
import json
import re
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from hli import layout

from . import foreign
from .errors import REFUSED, UNHEARD, Log, Problem, StError
from .machine import compiler
from .options import Built, Options
from .source import files
from .syntax import tree

DEEPEST = 8000
"""Calls of Python in each other: an operand takes about five."""
VERSION = 1
"""Part of every key of the cache; it grows when the compiler's output changes."""


@dataclass
class Checked:
    """What a check found."""

    log: Log
    pous: int = 0
    program: Any = None
    world: Any = None

    def as_json(self) -> dict[str, Any]:
        """``{errors, pous, refused}`` of the contract, and the warnings."""
        errors = self.log.errors
        return {
            "errors": [e.as_json() for e in errors],
            "pous": self.pous,
            "refused": [e.refused() for e in errors if e.code == REFUSED],
            "warnings": [w.as_json() for w in self.log.warnings],
        }


Sources = dict[str, str]


def sources_of(paths: Sequence[str | Path]) -> Sources:
    """Texts by file name.  StError: a file cannot be read."""
    log, found = Log(), {}
    for given in paths:
        path = Path(given)
        if not path.exists():
            raise StError([Problem(951003, "file not found", str(path))])
        for file in files.files_of(path, log):
            text = files.text_of(file, log)
            if text is not None:
                found[str(file)] = text
    if log.errors:
        raise StError(log.errors)
    return found


@functools.cache
def _own_hash() -> str:
    """The compiler's own sources and the HLI: another one, another result."""
    folder = Path(str(resources.files(__package__)))
    texts = [p.read_text() for p in sorted(folder.rglob("*")) if _is_source(p)]
    texts.append(Path(layout.__file__).read_text())
    return compiler.digest("".join(texts))


def _is_source(path: Path) -> bool:
    return path.suffix in (".py", ".lark", ".st", ".c", ".h")


def check(
    sources: Sources, options: Options | None = None, keeps: bool = False
) -> Checked:
    """Parse, check and lower a program without compiling its C.

    ``keeps``: the C of units is kept for the next time; a unit whose C is
    there already has no statements in the tree.
    """
    limit, collecting = sys.getrecursionlimit(), gc.isenabled()
    sys.setrecursionlimit(max(limit, DEEPEST))
    gc.disable()  # trees only grow here: a quarter of the time
    try:
        return _check(sources, options, keeps)
    except RecursionError:
        text = "an expression or a statement is nested too deeply"
        return Checked(Log([Problem(REFUSED, text, next(iter(sources), ""))]))
    finally:
        sys.setrecursionlimit(limit)
        if collecting:
            gc.enable()


def _check(sources: Sources, options: Options | None, keeps: bool) -> Checked:
    from .lower.program import Lowering  # noqa: PLC0415
    from .model import collect, hli_types  # noqa: PLC0415
    from .model.collect import Collector  # noqa: PLC0415
    from .model.world import World  # noqa: PLC0415
    from .source import library  # noqa: PLC0415
    from .syntax.parser import parse  # noqa: PLC0415

    options = options or Options()
    log = Log()
    world = World(log, options.short_circuit, offered=library.spelled())
    collector = Collector(world)
    protected = hli_types.declare(world)
    of_library = library.units_for(sources.values())
    own_units = _units(sources, log, options)
    kept = None
    if keeps:
        from .machine.lowered import LoweredUnits  # noqa: PLC0415

        about = f"{VERSION} {_own_hash()} {options!r}"
        kept = LoweredUnits([*of_library, *own_units], about)
    collector.library = True
    for unit in of_library:
        collector.take(unit, _tree(unit, parse, log, kept))
    collector.library, collector.protected = False, protected
    for unit in own_units:
        collector.take(unit, _tree(unit, parse, log, kept))
    collect.connect(world)
    program = Lowering(world, kept).run()
    if kept is not None and not log.errors:
        kept.save()
    own = [c for c in world.classes.values() if _own(c.origin.file)]
    functions = [
        f
        for f in world.functions.values()
        if f.origin is not None and _own(f.origin.file)
    ]
    told = [w for w in log.warnings if _own(w.file)]
    log.warnings = _unheard(told, sources.values())
    libraries = foreign.libraries_of(sources)
    log.errors = foreign.refused(log.errors, libraries, world.declares)
    return Checked(log, len(own) + len(functions), program, world)


def _unheard(
    warnings: Iterable[Problem], texts: Iterable[str]
) -> list[Problem]:
    """The warnings that hold for a program of these texts; each name that is
    missing is told once.
    """
    whole = "\n".join(texts)
    found, told = [], set()
    for warning in warnings:
        name = warning.construct
        if warning.code == UNHEARD:
            if name in told or re.search(rf"\b{name}\b", whole, re.I):
                continue
            told.add(name)
        found.append(warning)
    return found


def _own(file: str) -> bool:
    return not file.startswith("<library>")


def _units(sources: Sources, log: Log, options: Options) -> list[Any]:
    declared = files.declared_names(sources.values())
    found: list[Any] = []
    for name, text in sources.items():
        found += files.units_of(name, text, log, options.defines, declared)
    return found


def _tree(unit: Any, parse: Any, log: Log, kept: Any) -> Any:
    """The tree of a unit; of one whose C is kept only its declarations."""
    seen = kept.outline(unit) if kept is not None else None
    if seen is None:
        found = assembled(unit, parse, log)
    else:
        found = assembled(seen, parse, Log())
        if not isinstance(found, tree.Pou):  # the words stood otherwise
            return assembled(unit, parse, log)
        found.outlined = True
    if kept is not None and isinstance(found, tree.Pou):
        found.unit = unit
    return found


def assembled(unit: Any, parse: Any, log: Log) -> Any:
    """The tree of a unit; the parts of a TwinCAT object are put together."""
    found = parse(unit, log)
    if unit.body is None and not unit.children:
        return found
    from .source.assemble import assemble  # noqa: PLC0415

    return assemble(unit, found, parse, log)


def build(sources: Sources, options: Options | None = None) -> Built:
    """The compiled program.  StError: the sources are wrong."""
    options = options or Options()
    folder = compiler.cache_folder()
    key = _key(sources, options)
    program, notes = folder / f"{key}.so", folder / f"{key}.json"
    if program.exists() and notes.exists():
        program.touch()
        description = json.loads(notes.read_text())
        warnings = [Problem(**w) for w in description["warnings"]]
        return Built(program, description, warnings)
    return _built(sources, options, program, notes)


def _key(sources: Sources, options: Options) -> str:
    parts = [str(VERSION), _own_hash(), repr(options), compiler.runtime_hash()]
    parts += [f"{name}\n{text}" for name, text in sorted(sources.items())]
    return compiler.digest("\0".join(parts))


def _built(
    sources: Sources, options: Options, program: Path, notes: Path
) -> Built:
    from .machine.describe import describe  # noqa: PLC0415

    found = check(sources, options, keeps=True)
    if found.log.errors:
        raise StError(found.log.errors)
    objects = compiler.Objects()
    description = describe(found.world, found.program, options)
    description["warnings"] = [vars(w) for w in found.log.warnings]
    objects.build(found.program.texts, program)
    part = notes.with_suffix(f".{id(objects)}.part")
    part.write_text(json.dumps(description))
    part.replace(notes)
    return Built(program, description, found.log.warnings, objects.compiled)
