"""Simulated inputs of the PLC."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, model_validator

from .values import Finite, NotNegative, Table

Number = bool | int | Finite
"""A BOOL stays one."""


class StepConfig(Table):
    """What an input becomes, and when."""

    value: Number
    time_s: NotNegative | None = None
    distance_mm: Finite | None = None
    m: Annotated[int, Field(ge=0)] | None = None
    delay_s: NotNegative = 0.0


class InputConfig(Table):
    """A variable of a PLC task that the machine writes (``plc_client.Input``)."""

    start: Number = False
    steps: list[StepConfig] = Field(default_factory=list)
    follows: str = ""
    above: Finite | None = None
    below: Finite | None = None
    inverted: bool = False
    on_delay_s: NotNegative = 0.0
    off_delay_s: NotNegative = 0.0
    lag_s: NotNegative = 0.0

    @model_validator(mode="after")
    def _fits(self) -> InputConfig:
        from plc_client.inputs import input_of  # noqa: PLC0415

        input_of(self.model_dump(exclude_none=True))
        return self


def by_symbol(tables: Any, prefix: str = "") -> Any:
    """``{"Clamp": {"closed": {..}}}`` as ``{"Clamp.closed": {..}}``.

    A table whose values are all tables is a part of a name.
    """
    if not isinstance(tables, dict):
        return tables
    found: dict[str, Any] = {}
    for name, value in tables.items():
        path = f"{prefix}{name}"
        nested = isinstance(value, dict) and value
        if nested and all(isinstance(one, dict) for one in value.values()):
            found |= by_symbol(value, f"{path}.")
        else:
            found[path] = value
    return found
