"""A cell file's text into its values, and the place of a mistake in it."""

from __future__ import annotations

import difflib
import json
import re
import tomllib
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from ..errors import CncError, ConfigError, Place
from ..files import DATA_BYTES, open_regular
from .axes import AxisConfig, SpindleConfig
from .cell import CellConfig
from .channel import ChannelConfig, HscsConfig, StartupConfig
from .channels import ChannelTable
from .external import ExternalConfig
from .inputs import InputConfig, StepConfig
from .isons import IsonsConfig
from .kinematics import KinematicsConfig
from .osai import OsaiConfig
from .setups import setups_of
from .toml import toml_of
from .tools import ToolConfig

NEAR = 0.6  # of a key: what may have been meant


def _known_keys(path: tuple[Any, ...]) -> list[str]:
    tables: dict[str, type[BaseModel]] = {
        "axes": AxisConfig,
        "tools": ToolConfig,
        "external": ExternalConfig,
        "spindles": SpindleConfig,
        "kinematics": KinematicsConfig,
        "inputs": StepConfig if "steps" in path else InputConfig,
        "isons": IsonsConfig,
    }
    if path[0] == "channels" and len(path) == 3:
        return list(ChannelTable.model_fields)
    if path[0] == "channels" and len(path) > 3:
        below = "channel" if path[2] == "hscs" else None
        return _known_keys((below, *path[2:]) if below else path[2:])
    if len(path) == 1:
        return list(CellConfig.model_fields)
    if path[0] in ("isons", "osai") and len(path) == 2:
        return list(
            (IsonsConfig if path[0] == "isons" else OsaiConfig).model_fields
        )
    if path[:2] == ("channel", "hscs") and len(path) == 4:
        return list(HscsConfig.model_fields)
    one: dict[str, type[BaseModel]] = {
        "channel": ChannelConfig,
        "startup": StartupConfig,
    }
    model = one.get(str(path[0])) or tables.get(str(path[0]))
    return list(model.model_fields) if model else []


def _message(error: Any) -> str:
    path = tuple(error["loc"])
    where = ".".join(str(p) for p in path)
    if error["type"] != "extra_forbidden":
        text = str(error["msg"]).removeprefix("Value error, ")
        return f"{where}: {text}" if where else text
    known = _known_keys(path)
    near = difflib.get_close_matches(str(path[-1]), known, n=1, cutoff=NEAR)
    if near:
        return f"{where}: unknown key; did you mean {near[0]!r}?"
    keys = f"; known: {', '.join(known)}" if known else ""
    return f"{where}: unknown key{keys}"


def _toml_place(file: str, text: str, message: str) -> Place:
    """Place of a TOML syntax error, which tomllib only tells in its message."""
    match = re.search(r"at line (\d+), column (\d+)", message)
    lines = text.splitlines() or [""]
    line, column = len(lines), 1
    if match:
        line, column = int(match[1]), int(match[2])
    return Place(file, line, column, lines[min(line, len(lines)) - 1])


def _line_of(text: str, key: str) -> int:
    """First line that mentions the key, 0 if none does."""
    lines = text.splitlines()
    return next(
        (
            i
            for i, line in enumerate(lines, 1)
            if line.strip().startswith((key, f"[{key}")) or f".{key}" in line
        ),
        0,
    )


def _line_of_table(text: str, message: str) -> int:
    """First line of the table that a message begins with, or of one around it;
    0: it names none.
    """
    path = message.split(":", maxsplit=1)[0].split(".")
    lines = [line.strip() for line in text.splitlines()]
    while path:
        header = ".".join(path)
        for i, line in enumerate(lines, 1):
            if line.startswith((f"[{header}]", f"[{header}.")):
                return i
        path.pop()
    return 0


def config_of(values: dict[str, Any] | CellConfig) -> CellConfig:
    """Validated configuration from the content of a cell file; ConfigError
    names the keys that are wrong.
    """
    if isinstance(values, CellConfig):
        setups_of(values)
        return values
    if not isinstance(values, dict):
        given = type(values).__name__
        raise ConfigError(
            f"a cell is a path, a dict or a CellConfig, not a {given}"
        )
    return _validated(_with_texts(values), "", "")


def _with_texts(values: Any) -> Any:
    """Numbers as keys, ``{50: "MVS_SVS"}``, are texts, as those of a file."""
    if isinstance(values, list | tuple):
        return [_with_texts(value) for value in values]
    if not isinstance(values, dict):
        return values
    return {
        str(key) if type(key) is int else key: _with_texts(value)
        for key, value in values.items()
    }


def config_text(cell: CellConfig) -> str:
    """The configuration as ``load_config`` reads it from a file ``.json``."""
    return json.dumps(cell.model_dump(exclude_unset=True, by_alias=True))


def parse_config(text: str, file: str = "") -> CellConfig:
    """Validated configuration from TOML text; ConfigError with the place of the
    first mistake.
    """
    try:
        values = toml_of(text, file)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(
            f"not TOML: {error}", _toml_place(file, text, str(error))
        ) from None
    return _validated(values, text, file)


def _validated(values: Any, text: str, file: str) -> CellConfig:
    try:
        cell = CellConfig.model_validate(values)
        setups_of(cell)  # to see that the channels fit together
    except ValidationError as error:
        first = error.errors()[0]
        named = re.search(r"machine parameter (\w+)", first["msg"])
        key = (
            named[1] if named else str(first["loc"][-1]) if first["loc"] else ""
        )
        line = _line_of(text, key) if key else 0
        said = "; ".join(_message(e) for e in error.errors())
    except ValueError as error:
        line, said = _line_of_table(text, str(error)), str(error)
    else:
        return cell
    source = text.splitlines()[line - 1] if line else ""
    raise ConfigError(said, Place(file, line, 1, source))


def load_config(path: str | Path | None) -> CellConfig:
    """Configuration of a file, or the built-in machine (X Y Z) for None."""
    if path is None:
        return CellConfig()
    try:
        with open_regular(Path(path)) as file:
            data = file.read(DATA_BYTES + 1)
        if len(data) > DATA_BYTES:
            raise ConfigError(
                f"configuration of more than {DATA_BYTES >> 20} MiB",
                Place(str(path)),
            )
        text = data.decode()
    except UnicodeDecodeError as error:
        raise ConfigError(
            f"configuration cannot be read: {error}", Place(str(path))
        ) from None
    except CncError as error:
        if isinstance(error, ConfigError):
            raise
        found = error.code != 901001
        raise ConfigError(
            f"configuration cannot be read: {error.text}"
            if found
            else "configuration file not found",
            Place(str(path)),
        ) from None
    if Path(path).suffix == ".json":
        return _validated(json.loads(text), text, str(path))
    return parse_config(text, str(path))
