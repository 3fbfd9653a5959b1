"""Declaration of a cycle's parameters, and its view of the channel."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field

MISSING, INVALID, CONFLICT, DEGENERATE = 13320, 13320, 907101, 907102
NO_TRAFO, NO_TOOL, UNKNOWN = 907103, 907107, 907110
CODE_NAMES = {
    CONFLICT: "CYC_PARAM_CONFLICT",
    DEGENERATE: "CYC_DEGENERATE",
    NO_TRAFO: "CYC_NO_TRAFO",
}

LENGTH, ANGLE, FEED, SPEED, PLAIN = "length", "degrees", "feed", "rev/min", ""


@dataclass(frozen=True)
class Parameter:
    """One @P of a cycle.

    ``low``, ``high``: allowed range.  ``above``: ``low`` itself is not allowed.
    ``whole``: whole numbers only.
    ``names``: texts that stand for numbers, in capitals.
    ``default``: None if the default depends on the call.
    """

    number: int
    text: str
    unit: str = LENGTH
    required: bool = False
    default: float | None = None
    low: float = -1e9
    high: float = 1e9
    above: bool = False
    whole: bool = False
    names: Mapping[str, float] = field(default_factory=dict)
    default_text: str = ""

    @property
    def range_text(self) -> str:
        """The range for messages and documents."""
        if self.names or (self.whole and self.high - self.low < 20):
            return ", ".join(
                f"{v}" for v in range(int(self.low), int(self.high) + 1)
            )
        low = (
            ""
            if self.low <= -1e9
            else f"{'>' if self.above else '>='} {self.low:g}"
        )
        high = "" if self.high >= 1e9 else f"<= {self.high:g}"
        return " and ".join(part for part in (low, high) if part)


@dataclass(frozen=True)
class Problem:
    """A problem of a call.

    ``number``: the parameter concerned.  0: none.
    """

    code: int
    text: str
    number: int = 0


class Given:
    """The parameters of one call: numbers, checked against their declarations.

    A missing ``@P`` has its default.
    ``programmed``: parameters that the call names, wrong ones included.
    ``in``: the parameter has a right value.
    """

    def __init__(
        self,
        values: dict[int, float],
        parameters: Sequence[Parameter],
        programmed: Collection[int] = (),
    ) -> None:
        self.values = values
        self.programmed = frozenset(programmed) | frozenset(values)
        self._defaults = {p.number: p.default for p in parameters}

    def __contains__(self, number: int) -> bool:
        return number in self.values

    def __getitem__(self, number: int) -> float:
        found = self.get(number)
        if found is None:
            raise KeyError(f"@P{number} has no value")
        return found

    def get(self, number: int) -> float | None:
        return self.values.get(number, self._defaults.get(number))


@dataclass(frozen=True)
class Surroundings:
    """The channel as a cycle sees it; lengths in programmed units.

    ``axes``: names of the three main axes.  None: the machine has no such axis.
    ``position``: their programmed position.
    ``tool_radius``: of the active tool data.  NaN: #SCALE has different factors
    along X and Y.
    ``feed``: F in force, 0 for none.
    ``trafo``: a complete kinematic transformation is active.
    ``absolute``: G90.
    ``programs``: texts of the channel's lists (``hscs.*``).
    """

    axes: tuple[str | None, str | None, str | None]
    position: tuple[float, float, float]
    unit_mm: float
    tool_radius: float
    feed: float
    trafo: bool = False
    compensated: bool = False
    absolute: bool = True
    programs: Mapping[str, str] = field(default_factory=dict)


@dataclass
class Work:
    """The result of a cycle: a program, V.CYC variables by name, files,
    warnings.
    """

    lines: list[str] = field(default_factory=list)
    outputs: dict[str, float] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)
    warnings: list[tuple[int, str]] = field(default_factory=list)


class CycleError(Exception):
    """A cycle that cannot be carried out although each of its parameters is right."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code, self.text = code, text


Rule = Callable[[Given, Surroundings], list[Problem]]


@dataclass(frozen=True)
class Cycle:
    """A built-in cycle.

    ``rules``: exclusions and dependencies.  ``outputs``: V.CYC variables that
    it fills.
    """

    name: str
    text: str
    parameters: tuple[Parameter, ...]
    build: Callable[[Given, Surroundings], Work]
    rules: tuple[Rule, ...] = ()
    outputs: tuple[str, ...] = ()
    moves: bool = False


def number_text(value: float) -> str:
    """A number as programs write it: no exponent, no digit lost."""
    text = f"{value:.17g}"
    if "e" in text:
        text = f"{value:.20f}".rstrip("0").rstrip(".") or "0"
    return "0" if text in ("-0", "") else text


def clean(value: float) -> float:
    """Without the sign of a zero."""
    return value + 0.0
