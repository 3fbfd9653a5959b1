"""Axes and spindles of a cell."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from .values import Finite, Moving, NotNegative, Table

# mm/s3: motions with less last so long that positions round to more than that
LEAST_JERK = 1.0
SPINDLE_SYNCH = Literal["NO_SYNCH", "MOS", "MVS_SVS", "MVS_SNS", "MNS_SNS"]


class AxisConfig(Table):
    """One axis; for ``kind = "rotary"`` read degrees for mm in every name."""

    kind: Literal["linear", "rotary"] = "linear"
    v_max_mm_s: Moving = 300.0
    a_max_mm_s2: Moving = 3000.0
    j_max_mm_s3: NotNegative = 50000.0
    min_mm: Finite = -100000.0
    max_mm: Finite = 100000.0
    start_mm: Finite = 0.0
    id: Annotated[int, Field(ge=1, le=65535)] | None = None

    @model_validator(mode="after")
    def _ordered(self) -> AxisConfig:
        if 0.0 < self.j_max_mm_s3 < LEAST_JERK:
            raise ValueError(
                f"j_max_mm_s3 {self.j_max_mm_s3:g} is below {LEAST_JERK:g} mm/s3 (0: no limit)"
            )
        if self.min_mm >= self.max_mm:
            raise ValueError(
                f"min_mm {self.min_mm:g} is not below max_mm {self.max_mm:g}"
            )
        if not self.min_mm <= self.start_mm <= self.max_mm:
            raise ValueError(
                f"start_mm {self.start_mm:g} lies outside min_mm..max_mm"
            )
        return self


class SpindleConfig(Table):
    """A spindle: an axis area behind those of the channel's axes, with the
    synchronisation of its functions.
    """

    id: Annotated[int, Field(ge=1, le=65535)]
    m3_synch: SPINDLE_SYNCH = "NO_SYNCH"
    m4_synch: SPINDLE_SYNCH = "NO_SYNCH"
    m5_synch: SPINDLE_SYNCH = "NO_SYNCH"
    m19_synch: SPINDLE_SYNCH = "NO_SYNCH"
    s_synch: SPINDLE_SYNCH = "NO_SYNCH"

    @property
    def functions(self) -> dict[int, str]:
        """Synchronisation by M number; 0: an S word alone."""
        return {
            3: self.m3_synch,
            4: self.m4_synch,
            5: self.m5_synch,
            19: self.m19_synch,
            0: self.s_synch,
        }
