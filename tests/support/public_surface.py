"""The public surface as lines of text: names, signatures, commands, JSON keys,
keys of cell.toml.
"""

from __future__ import annotations

import hashlib
import importlib
import inspect
import json
from collections.abc import Callable, Iterator
from enum import Enum
from itertools import pairwise
from pathlib import Path
from typing import Any, get_args

import typer

from support.command_line import T1, Outcome

MODULES = ("cnc_core", "hli", "plc_client", "plc_client.blocks")
PLAIN = (int, float, str, bool, bytes, type(None))
WRONG = "N10 G01 X10 F1000\nN20 G01 QQ\n"
RUNS = {
    "check": ("check", "part.nc"),
    "check of a wrong program": ("check", "wrong.nc"),
    "blocks": ("blocks", "part.nc"),
    "plan": ("plan", "part.nc"),
    "plan with tolerance": ("plan", "part.nc", "--tolerance", "0.01"),
    "run": ("run", "part.nc"),
    "run of a wrong program": ("run", "wrong.nc"),
    "lookahead from an element": (
        "lookahead",
        "part.nc",
        "--index",
        "0",
        "--at",
        "start",
    ),
    "lookahead over a distance": (
        "lookahead",
        "part.nc",
        "--distance",
        "0",
        "500000",
    ),
}


# ------------------------------------------------------------------- names
def _default(value: Any) -> str:
    if value is inspect.Parameter.empty:
        return ""
    if isinstance(value, Enum):
        return f"={value.name}"
    return f"={value!r}" if isinstance(value, PLAIN) else "=..."


def _signature(function: Callable[..., Any]) -> str:
    """Parameters with kinds and plain defaults; annotations may be reworded."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return "(...)"
    marks = {
        inspect.Parameter.VAR_POSITIONAL: "*",
        inspect.Parameter.VAR_KEYWORD: "**",
        inspect.Parameter.KEYWORD_ONLY: "KEYWORD ",
        inspect.Parameter.POSITIONAL_ONLY: "POSITION ",
    }
    words = [
        f"{marks.get(p.kind, '')}{p.name}{_default(p.default)}"
        for p in parameters
    ]
    return f"({', '.join(words)})"


def _members(kind: type) -> Iterator[str]:
    """Public members of a class of the project, and of its project bases."""
    own = ("cnc_core", "hli", "plc_client")
    for name, member in inspect.getmembers(kind):
        home = next((c for c in kind.__mro__ if name in vars(c)), object)
        if name.startswith("_") and name not in ("__call__", "__enter__"):
            continue
        if not home.__module__.startswith(own):
            continue
        yield name + (_signature(member) if callable(member) else "")


def _described(name: str, value: Any) -> Iterator[str]:
    if inspect.isclass(value):
        yield f"class {name}{_signature(value)}"
        yield from (f"    {name}.{member}" for member in _members(value))
    elif callable(value):
        yield f"def {name}{_signature(value)}"
    else:
        yield f"{name}: {type(value).__name__}"


def python_names() -> list[str]:
    """What the packages export, with parameters and their plain defaults."""
    lines = []
    for module in MODULES:
        package = importlib.import_module(module)
        for name in sorted(package.__all__):
            lines += _described(f"{module}.{name}", getattr(package, name))
    return lines


def pytest_names() -> list[str]:
    """Fixtures and options of the plugin for users' tests."""
    plugin = importlib.import_module("cnc_core.pytest_plugin")
    lines = inspect.getsource(plugin).splitlines()
    fixtures = [
        after.partition("def ")[2].partition("(")[0]
        for line, after in pairwise(lines)
        if line.startswith("@pytest.fixture")
    ]
    options: list[str] = []

    class Options:
        """Takes the place of pytest's parser and notes what is added."""

        def getgroup(self, _name: str) -> Options:
            return self

        def addoption(self, *names: str, **_: Any) -> None:
            options.extend(names)

    plugin.pytest_addoption(Options())
    return sorted(f"fixture {name}" for name in fixtures) + sorted(
        f"option {name}" for name in options
    )


# ---------------------------------------------------------------- commands
KINDS = {"Path": "path", "int": "integer", "str": "text", "bool": "boolean"}


def _kind(parameter: Any) -> str:
    """Type of an option: from typer's own parser since 0.29, before from click's."""
    if not hasattr(parameter, "type_descriptor"):
        kind = parameter.type
        choices = getattr(kind, "choices", None)
        return "|".join(choices) if choices else kind.name.split()[0]
    kind = parameter.type_descriptor.annotation
    while arguments := [a for a in get_args(kind) if a is not type(None)]:
        kind = arguments[0]  # of a list, a tuple of equal ones, an optional one
    if isinstance(kind, type) and issubclass(kind, Enum):
        return "|".join(str(choice.value) for choice in kind)
    name = getattr(kind, "__name__", str(kind))
    return KINDS.get(name, name)


def _parameter(parameter: Any) -> str:
    names = "/".join([*parameter.opts, *parameter.secondary_opts])
    words = [
        names if parameter.param_type_name == "option" else parameter.name,
        _kind(parameter),
        *(["required"] if parameter.required else []),
        *(["repeated"] if parameter.multiple or parameter.nargs == -1 else []),
        *([f"values {parameter.nargs}"] if parameter.nargs > 1 else []),
    ]
    default = parameter.default
    plain = default is not None and isinstance(default, PLAIN)
    return " ".join(words + ([f"default {default!r}"] if plain else []))


def _command(name: str, found: Any) -> Iterator[str]:
    yield f"command {name}"
    for parameter in found.params:
        kind = parameter.param_type_name
        yield f"    {name} {kind} {_parameter(parameter)}"
    for child, each in sorted(getattr(found, "commands", {}).items()):
        yield from _command(f"{name} {child}", each)


def commands() -> list[str]:
    """Every console command with its arguments and options."""
    app = importlib.import_module("cnc_core.cli").app
    return list(_command("hli-cosim", typer.main.get_command(app)))


# -------------------------------------------------------------------- JSON
def _paths(value: Any, path: str = "") -> Iterator[str]:
    """Key paths of a JSON value with the kinds of their leaves."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _paths(item, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        yield f"{path}[]"
        for item in value:
            yield from _paths(item, f"{path}[]")
    else:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        yield f"{path}: {'number' if number else type(value).__name__}"


def json_keys(folder: Path, cli: Callable[..., Outcome]) -> list[str]:
    """Keys that the commands print in a folder; ``types`` as a digest of the
    whole layout.
    """
    (folder / "part.nc").write_text(T1)
    (folder / "wrong.nc").write_text(WRONG)
    lines = []
    for name, arguments in RUNS.items():
        found = {
            path
            for line in cli(*arguments, "--json").out.splitlines()
            for path in _paths(json.loads(line))
        }
        assert found, name
        lines += [f"{name}: {path}" for path in sorted(found)]
    layout = cli("types", "--json").json
    text = json.dumps(layout, sort_keys=True).encode()
    return [*lines, f"types: sha256 {hashlib.sha256(text).hexdigest()}"]


# --------------------------------------------------------------- cell.toml
def _keys(schema: Any, known: Any, path: str = "") -> Iterator[str]:
    """Key paths of a JSON schema; references are followed, names of classes not told."""
    while "$ref" in schema:
        schema = known[schema["$ref"].rpartition("/")[2]]
    for each in schema.get("anyOf", schema.get("oneOf", ())):
        yield from _keys(each, known, path)
    for name, inner in schema.get("properties", {}).items():
        yield from _keys(inner, known, f"{path}.{name}" if path else name)
    if isinstance(inner := schema.get("additionalProperties"), dict):
        yield from _keys(inner, known, f"{path}.*")
    if isinstance(inner := schema.get("items"), dict):
        yield from _keys(inner, known, f"{path}[]")
    if "type" in schema and "properties" not in schema:
        bounds = [
            f"{word} {schema[word]}"
            for word in (
                "minimum",
                "maximum",
                "exclusiveMinimum",
                "exclusiveMaximum",
                "minLength",
                "maxLength",
                "minItems",
                "maxItems",
                "enum",
                "pattern",
                "default",
            )
            if word in schema
        ]
        yield " ".join([f"{path}: {schema['type']}", *bounds])


def cell_keys() -> list[str]:
    """Keys of cell.toml with type, bounds and default."""
    config = importlib.import_module("cnc_core.config").CellConfig
    schema = config.model_json_schema()
    return sorted(set(_keys(schema, schema.get("$defs", {}))))
