"""The file of a study."""

from __future__ import annotations

import hashlib
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from ..config.toml import toml_of
from ..errors import CncError, ConfigError, Place
from ..files import open_regular

STUDY_BYTES = 1 << 20
RUNS_MAX = 1_000_000
# what a parameter's name begins with, and what it sets
FAMILIES = {
    "cell": "a member of the cell file, as cell.channel.tolerance_mm",
    "run": "an option of the run, as run.tolerance",
    "force": "a symbol that is held, as force.Logic.gain",
}
# options that a study sets by itself, or that decide nothing about a run
OWN_OPTIONS = ("name", "record", "record_only", "out", "clock")
Measure = Literal["run", "plan"]


class Closed(BaseModel):
    """A table that knows its members."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Span(Closed):
    """A range: ``count`` steps of a grid, any value of a random study."""

    low: float = Field(allow_inf_nan=False)
    high: float = Field(allow_inf_nan=False)
    count: Annotated[int, Field(ge=1, le=RUNS_MAX)] = 1
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _in_order(self) -> Span:
        if self.low > self.high:
            raise ValueError("low is above high")
        if self.scale == "log" and self.low <= 0.0:
            raise ValueError("a logarithmic range begins above 0")
        return self


class Figure(Closed):
    """A column of the table, taken from a symbol or column of the run."""

    symbol: str
    of: Literal["last", "max", "min", "mean", "max_abs"] = "last"


class Study(Closed):
    """What is run; every path is relative to the study's file.

    ``mode``: ``grid`` takes every combination, ``random`` draws ``count`` of
    them from ``seed``.  ``measure``: ``run`` co-simulates, ``plan`` plans
    without a PLC; both together are allowed.  ``parameters``: lists or ranges
    by name; a name begins with one of ``FAMILIES``.  ``rows``: parameters that
    go together, each row one alternative.  ``recordings``: keep each run's.
    """

    mode: Literal["grid", "random"] = "grid"
    count: Annotated[int, Field(ge=1, le=RUNS_MAX)] = 1
    seed: int = 0
    measure: Annotated[list[Measure], Field(min_length=1)] = ["run"]
    clock: Literal["lockstep", "freerun"] = "lockstep"
    programs: Annotated[list[str], Field(min_length=1)]
    cells: Annotated[list[str], Field(min_length=1)] = [""]
    plcs: Annotated[list[str], Field(min_length=1)] = ["none"]
    recordings: bool = False
    parameters: dict[str, list[Any] | Span] = Field(default_factory=dict)
    rows: list[dict[str, Any]] = Field(default_factory=list)
    figures: dict[str, Figure] = Field(default_factory=dict)

    @field_validator("parameters")
    @classmethod
    def _families(cls, value: dict[str, Any]) -> dict[str, Any]:
        for name, values in value.items():
            _check_name(name)
            if values == []:
                raise ValueError(f"{name} has no value")
        return value

    @field_validator("rows")
    @classmethod
    def _rows(cls, value: list[dict[str, Any]]) -> list[dict[str, Any]]:
        names = {frozenset(row) for row in value}
        if len(names) > 1:
            raise ValueError("each row names the same parameters")
        for name in next(iter(names), ()):
            _check_name(name)
        return value

    @model_validator(mode="after")
    def _told_once(self) -> Study:
        for row in self.rows[:1]:
            for name in set(row) & set(self.parameters):
                raise ValueError(f"{name} is a parameter and stands in a row")
        if "run" not in self.measure and self.figures:
            raise ValueError("figures are taken from a run: add it to measure")
        return self

    @classmethod
    def read(cls, path: Path) -> Study:
        """The study of a file; CncError tells the member and the reason."""
        with open_regular(path) as file:
            data = file.read(STUDY_BYTES + 1)
        place = Place(str(path))
        if len(data) > STUDY_BYTES:
            raise CncError(902001, "a study of more than 1 MiB", place)
        try:
            return cls.model_validate(toml_of(data.decode(), str(path)))
        except ConfigError as error:
            text = f"study: {error.text}"
            raise CncError(902001, text, error.place) from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise CncError(902001, f"study: {error}", place) from None
        except ValidationError as error:
            texts = "; ".join(_said(item) for item in error.errors())
            raise CncError(902001, f"study: {texts}", place) from None


def _check_name(name: str) -> None:
    family, _, rest = name.partition(".")
    if family not in FAMILIES or not rest:
        known = "; ".join(f"{k}.NAME: {v}" for k, v in FAMILIES.items())
        raise ValueError(f"{name!r} is no parameter; there are {known}")
    if family == "run" and rest in OWN_OPTIONS:
        raise ValueError(f"{name}: the study sets it itself")


def _said(item: Any) -> str:
    where = ".".join(str(part) for part in item["loc"])
    text = str(item["msg"]).removeprefix("Value error, ")
    return f"{where}: {text}" if where else text


def fingerprint(study: Path, files: list[Path]) -> str:
    """A hash of the study's text and of the files that it names."""
    found = hashlib.sha256()
    for file in (study, *files):
        found.update(hashlib.sha256(file.read_bytes()).digest())
    return found.hexdigest()
