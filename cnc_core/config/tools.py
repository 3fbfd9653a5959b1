"""Tools of a cell."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from .values import Finite, Table


class ToolConfig(Table):
    """Tool data set ``D``."""

    radius_mm: Finite = 0.0
    length_mm: Finite = 0.0
    kin_id: Annotated[int, Field(ge=1, le=999)] | None = None
