"""What ``optimize`` reports."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass
class OptimizeResult:
    """The contract's object and what else the report tells."""

    points_in: int = 0
    polynomials: int = 0
    max_deviation_mm: float = 0.0
    points_dropped: int = 0
    polyline_points: int = 0
    edges: int = 0
    groups: int = 0
    joints: int = 0
    profiles: int = 0
    kept: int = 0
    max_path_deviation_mm: float = 0.0
    time_before_s: float | None = None
    time_after_s: float | None = None
    continuity: dict[str, float] = field(default_factory=dict)
    setup: str = ""
    input_kept: bool = False
    warnings: list[str] = field(default_factory=list)
    comparison: dict[str, Any] | None = None

    def as_json(self) -> dict[str, Any]:
        out = dict(self.__dict__)
        if self.comparison is None:
            del out["comparison"]
        return out
