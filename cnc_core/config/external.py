"""Variables that a program shares with the PLC."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from .values import Table

EXTERNAL_BLOCKS = 1000  # 24-byte blocks of one area of external variables


class ExternalConfig(Table):
    """A variable ``V.E.<name>`` that the program shares with the PLC, in
    24-byte blocks.

    ``block``: the first one, counted from 1; by default the next free one of
    its scope, in the order of the file.
    """

    type: Literal[
        "BOOLEAN",
        "SGN08",
        "UNS08",
        "SGN16",
        "UNS16",
        "SGN32",
        "UNS32",
        "REAL64",
        "STRING",
    ] = "REAL64"
    scope: Literal["channel", "global"] = "channel"
    block: Annotated[int, Field(ge=1, le=1000)] | None = None
    size: Annotated[int, Field(ge=1, le=1000)] | None = None
    characters: Annotated[int, Field(ge=1, le=126)] = 23
    synchronised: bool = True
