"""Checked numbers, and the table that every part of a cell file is."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field


def _ends_motions(limit: float) -> float:
    if limit < 1e-6:
        raise ValueError("no motion ends with less than 0.000001")
    return limit


Moving = Annotated[
    float,
    Field(gt=0, lt=1e12, allow_inf_nan=False),
    AfterValidator(_ends_motions),
]
Finite = Annotated[float, Field(gt=-1e12, lt=1e12, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, lt=1e12, allow_inf_nan=False)]
Uns32 = Annotated[int, Field(ge=0, le=0xFFFFFFFF)]


class Table(BaseModel):
    """A table that refuses unknown keys and converts no types."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
