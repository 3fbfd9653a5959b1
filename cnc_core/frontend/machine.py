"""What a program sees of the machine it is written for."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Tool:
    """Tool data set: lengths in mm."""

    radius_mm: float = 0.0
    length_mm: float = 0.0


@dataclass(frozen=True)
class ProgramMachine:
    """Axes of the channel in order, the three main axes, start position, tools, M functions.

    ``main``: channel index of the geometry's X, Y, Z axis, -1 where the machine has none.
    ``start``: (axes,) position at program start, mm or degrees.
    ``m_functions``: synchronisation type (P-CHAN-00041) by M number; what is absent is undefined.
    """

    axes: tuple[str, ...]
    rotary: tuple[bool, ...]
    main: tuple[int, int, int]
    start: npt.NDArray[np.float64]
    tools: dict[int, Tool] = field(default_factory=dict)
    m_functions: dict[int, str] = field(default_factory=dict)
