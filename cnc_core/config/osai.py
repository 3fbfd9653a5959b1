"""The table ``[osai]`` of a cell file."""

from __future__ import annotations

from typing import Literal

from .values import Table


class OsaiConfig(Table):
    """10-Series programs: what the manual leaves open (docs/reference/osai.md).

    ``feed``: of polynomials and B-splines, that of their parameter or along the
    arc.  ``location``: where a cutter location point lies on a ball or toroidal
    tool.  ``setup_unit``: of lengths in setup files.
    """

    feed: Literal["parameter", "arc"] = "parameter"
    location: Literal["tip", "centre"] = "tip"
    setup_unit: Literal["mm", "inch"] = "mm"
