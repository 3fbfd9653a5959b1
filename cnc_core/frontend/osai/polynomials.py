"""Polynomial programming (PNT.Format = POL, specification 7)."""

from __future__ import annotations

import re

import numpy as np

from cnc_core import plain
from cnc_core.blocks.profile_columns import PASS, SMOOTH, STOP, ProfileChunk
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.osai.profile import VERSOR_LETTERS, Context, Profile
from cnc_core.frontend.osai.variables import FIELD, variable_number
from cnc_core.frontend.osai.words import EXPRESSION_VALUE, VALUE_MAX, shortened
from cnc_core.units import FloatArray

SHORTEST = 1e-9
REACH_MAX = 1e12  # of a coefficient at the polynomial's end
NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?$")
SUM = re.compile(r"[+-]?(?:[EL][0-9]+|[0-9.]+)\s*[-+*/]")
HEADER = ("length", "block number", "feed", "transition")
GAP_MAX = 1e-6  # mm, degrees; versors without a unit
ENDS = {1: STOP, 2: PASS}


class Group:
    """One polynomial: header and the axis lines read so far."""

    def __init__(self, header: list[float], place: Place) -> None:
        self.span = header[0]
        self.number = int(header[1])
        self.feed = header[2]
        self.after = ENDS.get(int(header[3]), SMOOTH)
        self.place, self.line = place, place.line
        self.axes: dict[str, FloatArray] = {}


class PolynomialProfile(Profile):
    """``<*,S,number,feed,transition`` and one ``<axis,c0,..`` line for each
    axis and versor component.
    """

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        spec = self.spec
        self.required = tuple(
            a.name
            for a in spec.axes
            if not (a.kinematic and "ijk" in spec.versors)
        )
        self.required += tuple("".join(spec.versors))
        self._group: Group | None = None
        self._left_out = False  # the rest of a polynomial with a wrong line
        self._done: list[tuple[Group, FloatArray]] = []
        self._end: FloatArray | None = None  # where the polynomial before ends

    def line(self, text: str) -> None:
        plain = self.plain_text(text)
        if not plain.strip():
            return
        if plain.lstrip().startswith("<"):
            self._polynomial_line(plain)
            return
        words = self.words(plain, self.letters + "FK")
        code = self.function(words, ())
        if code is None:
            raise fail(
                909224,
                "only polynomials may stand here: the format is POL",
                len(plain) - len(plain.lstrip()),
            )
        self.ended = True
        self._finish()
        if not self._done and self._end is None and not self.failed:
            raise fail(909225, "the profile has no polynomial", words.g[60])

    def _polynomial_line(self, plain: str) -> None:
        begin = plain.index("<")
        parts, at = [], begin + 1
        for part in plain[begin + 1 :].split(","):
            parts.append(
                (
                    part.strip(),
                    at + len(part) - len(part.lstrip()),
                )
            )
            at += len(part) + 1
        name, offset = parts[0]
        if name == "*":
            self._finish()
            self._left_out = False
            self._header(parts[1:], begin, plain.rstrip())
        else:
            self._axis(name, offset, parts[1:])

    def _numbers(self, parts: list[tuple[str, int]]) -> list[float]:
        out = []
        for text, offset in parts:
            value = self._number(text, offset)
            if not abs(value) < 1e30:
                raise fail(900012, f"{shortened(text)}: out of range", offset)
            out.append(value)
        return out

    def _number(self, text: str, offset: int) -> float:
        """A number, or the value of an E or L variable."""
        if NUMBER.match(text):
            return float(text)
        if EXPRESSION_VALUE.match(text) or SUM.match(text):
            raise fail(909227, ERRORS[909227], offset)
        found = FIELD.match(text)
        if not found:
            raise fail(
                900004,
                f"{shortened(text)!r} is neither a number nor an E or L variable",
                offset,
            )
        sign, letter, digits = found.groups()
        number = variable_number(digits, letter, offset)
        value = self.read_variable(letter, number)
        return -value if sign == "-" else value

    def _header(
        self, parts: list[tuple[str, int]], begin: int, text: str
    ) -> None:
        if len(parts) != 4:
            raise fail(
                909232, f"a polynomial's header has {', '.join(HEADER)}", begin
            )
        header = self._numbers(parts)
        if not SHORTEST <= header[0] <= VALUE_MAX:
            text_ = (
                "is not positive"
                if not header[0] > 0
                else f"lies outside {SHORTEST:g} to {VALUE_MAX:g}"
            )
            raise fail(909232, f"the length {header[0]:g} {text_}", parts[0][1])
        number = header[1]
        if number != int(number) or not 0 <= number < 2**31:
            raise fail(
                909232,
                f"the block number {header[1]:g} is no whole number from 0 on",
                parts[1][1],
            )
        if not header[2] > 0:
            raise fail(900006, "the feed is not positive", parts[2][1])
        if header[2] > VALUE_MAX:
            raise fail(
                900012, f"the feed {header[2]:g} is out of range", parts[2][1]
            )
        if header[3] != int(header[3]):
            raise fail(
                909232,
                f"the transition {header[3]:g} is no whole number",
                parts[3][1],
            )
        self._group = Group(
            header, Place(self.context.path, self.context.line, 1, text)
        )

    def _axis(
        self, name: str, offset: int, parts: list[tuple[str, int]]
    ) -> None:
        if self._group is None and self._left_out:
            return
        if self._group is None:
            raise fail(
                909232, "a line of coefficients without a header <*,..", offset
            )
        if (name not in self.names and name not in VERSOR_LETTERS) or not name:
            raise fail(909226, f"unknown axis {name!r}", offset)
        if name in self._group.axes:
            raise fail(900005, f"{name} twice in one polynomial", offset)
        wanted = self.spec.degree + 1
        if len(parts) != wanted:
            raise fail(
                909230,
                f"{name}: {len(parts)} coefficients, degree {self.spec.degree} has {wanted}",
                offset,
            )
        self._group.axes[name] = np.array(self._numbers(parts))

    def go_on(self) -> None:
        """The polynomial with the wrong line is left out, and with it whether
        its neighbours meet.
        """
        super().go_on()
        self._left_out, self._group, self._end = True, None, None

    def _finish(self) -> None:
        """The group is complete: required lines, continuity."""
        group, self._group = self._group, None
        if group is None:
            return
        for name in self.required:
            if name not in group.axes:
                number = 909251 if name in VERSOR_LETTERS else 909231
                raise CncError(
                    number,
                    f"the polynomial has no line for {name}",
                    group.place,
                )
        if (
            self.spec.five_axes
            and self.spec.point == "AXI"
            and any(c in group.axes for c in "ijk")
        ):
            raise CncError(909252, ERRORS[909252], group.place)
        coef = np.zeros((len(self.columns), self.spec.degree + 1))
        for i, name in enumerate(self.columns):
            coef[i] = group.axes.get(name, 0.0)
            if name not in group.axes:
                coef[i, 0] = (
                    self.spec.start[self.spec.axes[i].channel] / self.factor[i]
                )
        reach = (
            np.abs(coef) * plain.powers(group.span, np.arange(coef.shape[1]))
        ).max(axis=1)
        if not reach.max() <= REACH_MAX:
            name = self.columns[int(reach.argmax())]
            raise CncError(
                900012, f"{name}: the polynomial runs out of range", group.place
            )
        self._check_continuity(coef, group)
        self._end = plain.product(
            coef, plain.powers(group.span, np.arange(coef.shape[1]))
        )
        self._done.append((group, coef * self.factor[:, None]))

    def _check_continuity(self, coef: FloatArray, group: Group) -> None:
        if self._end is None:
            return
        gap = np.abs(coef[:, 0] - self._end)
        worst = int(gap.argmax())
        if gap[worst] <= GAP_MAX:
            return
        text = (
            "does not begin where the polynomial before ends: "
            f"{self.columns[worst]} differs by {gap[worst]:.6g}"
        )
        if self.context.strict:
            raise CncError(909233, text, group.place)
        self.context.warn(909233, text)

    @property
    def waiting(self) -> int:
        """The last one waits, because it may turn out to be the profile's last."""
        return len(self._done) if self.ended else max(0, len(self._done) - 1)

    def chunk(self) -> ProfileChunk | None:
        keep = self.waiting
        done = self._done[:keep]
        self._done = self._done[keep:]
        if not done:
            return None
        groups = [group for group, _ in done]
        return ProfileChunk(
            self.spec,
            line=np.array([g.line for g in groups]),
            number=np.array([g.number for g in groups]),
            feed=np.array([g.feed for g in groups])
            * self.context.unit_mm
            / 60.0,
            after=np.array([g.after for g in groups]),
            coef=np.stack([coef for _, coef in done]),
            span=np.array([g.span for g in groups]),
            last=self.ended,
        )
