"""B-spline programming (PNT.Format = BSP, specification 8)."""

from __future__ import annotations

import numpy as np

from cnc_core.blocks.profile_columns import SMOOTH, ProfileChunk
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.osai.profile import Context, Profile
from cnc_core.frontend.osai.words import Words
from cnc_core.units import FloatArray

SEPARATORS = (62, 66, 67)
SHORTEST = 1e-9  # distance of knots that are not equal
JUNCTION = (
    1e-6  # mm by which a spline may begin elsewhere than the one before ends
)


class BsplineProfile(Profile):
    """Control points with knots in reading order; ``G62 G66 G67`` separate splines."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        spec = self.spec
        self.required = tuple(
            a.name
            for a in spec.axes
            if not (a.kinematic and "ijk" in spec.versors)
        )
        self.required += tuple("".join(spec.versors))
        self._now = np.array(
            [spec.start[a.channel] / a.factor for a in spec.axes]
            + [np.nan] * (len(self.columns) - len(self.names))
        )
        self._programmed = False
        self._clear()
        self._left_out = False  # a line of the present spline was wrong
        self._done: list[ProfileChunk] = []
        self._end: FloatArray | None = None

    def _clear(self) -> None:
        self._points: list[FloatArray] = []
        self._knots: list[float] = []
        self._feeds: list[float] = []
        self._lines: list[int] = []
        self._numbers: list[int] = []

    def go_on(self) -> None:
        """The spline with the wrong line is left out, and with it whether its
        neighbours meet.
        """
        super().go_on()
        self._left_out, self._programmed, self._end = True, True, None
        self._now = np.where(np.isnan(self._now), 1.0, self._now)
        if not self.context.feed > 0:
            self.context.feed = 1.0

    def line(self, text: str) -> None:
        plain = self.plain_text(text)
        if plain.lstrip().startswith("<"):
            raise fail(
                909224, "polynomials need the format POL", plain.index("<")
            )
        words = self.words(plain, self.letters + "FK")
        if 63 in words.g:
            raise fail(
                909245, "G63 cannot stand between B-splines", words.g[63]
            )
        code = self.function(words, SEPARATORS)
        if code is not None:
            self._close(code, words.g[code])
            return
        if self._left_out:
            return
        self._no_small_knot(words)
        self.ignore(words)
        self.take_feed(words)
        if "K" in words.values:
            self._knot(words.values["K"], words.offsets["K"])
        if any(name in words.values for name in self.columns):
            self._point(words)

    def _no_small_knot(self, words: Words) -> None:
        """``k`` is a component of the tool direction; alone, it is a knot with
        a small letter.
        """
        given = words.values
        if "k" not in given or any(letter in given for letter in "Kij"):
            return
        point = any(name in given for name in self.names)
        if point and "ijk" in self.spec.versors:
            return
        raise fail(
            909226,
            "k is the z component of the tool direction: a knot is K",
            words.offsets["k"],
        )

    def _knot(self, value: float, offset: int) -> None:
        if self._knots and value < self._knots[-1]:
            raise fail(
                909242,
                f"knot {value:g} is smaller than the one before, {self._knots[-1]:g}",
                offset,
            )
        self._knots.append(value)

    def _point(self, words: Words) -> None:
        offset = min(words.offsets.values())
        if not self._programmed:
            missing = next(
                (name for name in self.required if name not in words.values),
                None,
            )
            if missing and missing in "".join(self.spec.versors):
                raise fail(
                    909251,
                    f"the first point must program every versor: {missing} is missing",
                    offset,
                )
            if missing:
                raise fail(
                    909225,
                    f"the first point of a profile must program axis {missing}",
                    offset,
                )
        self._programmed = True
        for i, name in enumerate(self.columns):
            if name in words.values:
                self._now[i] = words.values[name]
        self.need_feed(offset)
        if not self._points and self._end is not None:
            gap = np.abs(self._now - self._end)
            worst = int(gap.argmax())
            if gap[worst] > JUNCTION:
                text = (
                    "the first control point is not the last one of the "
                    f"spline before: {self.columns[worst]}"
                )
                raise fail(
                    909244, f"{text} differs by {gap[worst]:.6g}", offset
                )
        self._points.append(self._now.copy())
        self._feeds.append(self.feed_mm_s)
        self._lines.append(self.context.line)
        self._numbers.append(self.context.number)

    def _close(self, code: int, offset: int) -> None:
        """The spline is complete; 60 ends the profile."""
        self.ended = code == 60
        if self._left_out:
            self._left_out = False
            self._clear()
            return
        if not self._points and not self._knots:
            if code == 60 and self._end is not None:
                self._done[-1].last = True
                return
            text = (
                "the profile has no control point"
                if code == 60
                else f"G{code} without a B-spline before it"
            )
            raise fail(909225 if code == 60 else 909228, text, offset)
        self._check(offset)
        spec = self.spec
        after = np.full(len(self._points), SMOOTH, np.int64)
        after[-1] = SMOOTH if code == 60 else code
        chunk = ProfileChunk(
            spec,
            line=np.array(self._lines),
            number=np.array(self._numbers),
            feed=np.array(self._feeds),
            after=after,
            values=np.array(self._points) * self.factor,
            knots=np.array(self._knots),
            last=code == 60,
        )
        self._done.append(chunk)
        self._end = self._points[-1]
        self._clear()

    def _check(self, offset: int) -> None:
        degree = self.spec.degree
        points = len(self._points)
        knots = self._knots
        if points < degree + 1:
            raise fail(
                909243,
                f"{points} control points, degree {degree} needs {degree + 1}",
                offset,
            )
        if len(knots) != points + degree + 1:
            text = (
                f"{len(knots)} knots, {points} control points of degree "
                f"{degree} need {points + degree + 1}"
            )
            raise fail(909240, text, offset)
        if knots[0] != knots[degree] or knots[-1] != knots[-degree - 1]:
            raise fail(
                909241,
                f"the first and the last {degree + 1} knots must be equal",
                offset,
            )
        if not knots[-1] > knots[0]:
            raise fail(909242, "all knots are equal", offset)
        all_knots = np.array(knots)
        steps = np.diff(all_knots)
        if (steps[steps > 0.0] < SHORTEST).any():
            raise fail(
                909242,
                f"knots stand closer than {SHORTEST:g}, but are not equal",
                offset,
            )
        inner = all_knots[1:-1]
        repeated = inner[degree:] == inner[:-degree]
        if (
            repeated[1:-1].any()
            or (all_knots[degree + 1 :] == all_knots[: -degree - 1]).any()
        ):
            raise fail(
                909242,
                f"an inner knot stands more than {degree} times: the curve would break there",
                offset,
            )

    @property
    def waiting(self) -> int:
        """Splines stay whole: one chunk each. The last waits, because it may
        turn out to be the profile's last.
        """
        return sum(
            len(c) for c in self._done if self.ended or c is not self._done[-1]
        )

    def chunk(self) -> ProfileChunk | None:
        return self._done.pop(0) if self.waiting else None
