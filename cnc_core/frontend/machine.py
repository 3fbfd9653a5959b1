"""The machine as a program sees it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, Protocol, TypeVar

from ..units import FloatArray

Settings = TypeVar("Settings")


@dataclass(frozen=True)
class Tool:
    """Tool data set: lengths in mm."""

    radius_mm: float = 0.0
    length_mm: float = 0.0
    kin_id: int | None = None


@dataclass(frozen=True)
class HscSetting:
    """One state of SysHscSettings: subprogram of the manufacturer, tolerance in mm."""

    program: str = ""
    tolerance_mm: float = 0.0


@dataclass(frozen=True)
class External:
    """A variable shared with the PLC.

    ``number``: its first 24-byte block, from 1.  ``size``: None or elements.
    ``type``: BOOLEAN, SGN08 .. UNS32, REAL64 or STRING. A text has at most 23
    characters a block.
    """

    name: str
    type: str
    number: int
    size: int | None = None
    scope: Literal["channel", "global"] = "channel"
    synchronised: bool = True
    characters: int = 23

    @property
    def blocks(self) -> int:
        """24-byte blocks it takes."""
        return (self.size or 1) * self.blocks_per_element

    @property
    def blocks_per_element(self) -> int:
        return -(-(self.characters + 1) // 24) if self.type == "STRING" else 1

    def place(self, element: int) -> int:
        """Byte of the area where an element begins."""
        return 24 * (self.number - 1 + element * self.blocks_per_element)


class TipMachine(Protocol):
    """A kinematic transformation as a front end sees it.

    It is one of ``cnc_core.kinematics.machine``. Positions are (axes,) or (n,
    axes) in channel order, mm and degrees. ``length`` is that of the tool.
    """

    @property
    def rotary_axes(self) -> tuple[int, ...]:
        """Channel index of the rotary axes, part to tool."""
        ...

    def orient(self, direction: FloatArray, near: FloatArray) -> FloatArray:
        """(axes,) ``near`` with the rotary axes turned so that the tool points
        into ``direction``.
        """
        ...

    def directions(self, q: FloatArray) -> FloatArray:
        """(n, 3) tool directions, tip to spindle, in the part frame."""
        ...

    def programmed(self, q: FloatArray, length: float) -> FloatArray:
        """(n, axes) the tip in place of the linear axes."""
        ...

    def driven(self, programmed: FloatArray, length: float) -> FloatArray:
        """(n, axes) axis positions of programmed ones."""
        ...


class Transformation(TipMachine, Protocol):
    """A kinematic transformation of the cell."""

    def length_correction(self) -> TipMachine:
        """The same machine with the axes programmed: they are lifted by
        ``length`` along the tool.
        """
        ...


@dataclass(frozen=True)
class OsaiCell:
    """Settings of the 10-Series dialect.

    ``feed_by_length``: polynomials' feed counts along the arc.
    ``centre``: location points are in the tool's centre.
    ``setup_mm``: per unit of lengths in setups.
    """

    feed_by_length: bool = False
    centre: bool = False
    setup_mm: float = 1.0


@dataclass(frozen=True)
class ProgramMachine:
    """Axes of the channel in order, tools, functions, offsets, limits.

    ``main``: channel index of the geometry's X, Y, Z axis.  -1: no such axis.
    ``start``: (axes,) position at program start, mm or degrees.
    ``m_functions``: synchronisation type (P-CHAN-00041) by M number. Other
    numbers are undefined.
    ``externals``: variables shared with the PLC by name in capitals.
    ``zero_offsets``: by number (1 is G54) and axis name, mm or degrees.
    ``g_programs``: subprograms of G80-G89 and G800-G839.
    ``m6_program``: of M06.
    ``velocity``, ``acceleration``: (axes,) largest, mm/s or degrees/s, mm/s2.
    ``limits``: lowest and highest position, (axes,) each.
    ``probe``: machine position by axis where the probe trips, mm or degrees.
    ``hsc_settings``: by state, ``deselect`` to ``finish``.
    ``equidistant``: FCT_EXTENSION_EQUIDIST is configured.
    ``kinematics``: transformations by number.  ``kin_id``: the first one.
    ``dialects``: settings of single dialects (see ``settings``).
    ``axis_ids``: logical axis numbers.  Empty: 1, 2, ..
    ``guests``: how many of the axes, the last ones, are places without an axis,
    where axes of other channels may come.
    ``repeated_blocks_max``: with motions, executed again, where no machine
    answers.  0: any number.
    """

    axes: tuple[str, ...]
    rotary: tuple[bool, ...]
    main: tuple[int, int, int]
    start: FloatArray
    tools: dict[int, Tool] = field(default_factory=dict)
    m_functions: dict[int, str] = field(default_factory=dict)
    externals: dict[str, External] = field(default_factory=dict)
    zero_offsets: dict[int, dict[str, float]] = field(default_factory=dict)
    g_programs: dict[int, str] = field(default_factory=dict)
    m6_program: str = ""
    velocity: FloatArray | None = None
    acceleration: FloatArray | None = None
    limits: tuple[FloatArray, FloatArray] | None = None
    probe: dict[str, float] = field(default_factory=dict)
    hsc_settings: dict[str, HscSetting] = field(default_factory=dict)
    equidistant: bool = False
    kinematics: Mapping[int, Transformation] = field(default_factory=dict)
    kin_id: int | None = None
    dialects: tuple[object, ...] = ()
    axis_ids: tuple[int, ...] = ()
    guests: int = 0
    repeated_blocks_max: int = 0

    def copy(self) -> ProgramMachine:
        """The same, with values of the axes that may change apart."""
        low_high = self.limits
        return replace(
            self,
            velocity=_copied(self.velocity),
            acceleration=_copied(self.acceleration),
            limits=low_high and (low_high[0].copy(), low_high[1].copy()),
        )

    @property
    def programs(self) -> tuple[str, ...]:
        """Subprograms that the cell names."""
        settings = (setting.program for setting in self.hsc_settings.values())
        named = (*self.g_programs.values(), self.m6_program, *settings)
        return tuple(name for name in named if name)

    @property
    def ids(self) -> tuple[int, ...]:
        """Logical axis numbers in channel order."""
        return self.axis_ids or tuple(range(1, len(self.axes) + 1))

    def settings(self, kind: type[Settings]) -> Settings:
        """The settings of one dialect: the entry of ``dialects``."""
        for found in self.dialects:
            if isinstance(found, kind):
                return found
        return kind()


def _copied(values: FloatArray | None) -> FloatArray | None:
    return None if values is None else values.copy()
