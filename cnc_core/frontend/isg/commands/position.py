"""# commands about positions, offsets and feed."""

from __future__ import annotations

from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import fail

from ..state.offsets import EMPTY_KINDS, KINDS
from .base import CommandBase, Items, Run


class PositionCommands(CommandBase):
    """#PSET, #SUPPRESS OFFSETS, #OVERRIDE and the like."""

    def _pset(self) -> Run:
        """``#PSET X10 Y0``: the position gets these values."""
        words = self._axis_words()
        if not words or any(value is None for value in words.values()):
            raise fail(
                900010,
                "#PSET: axis words with values are expected",
                self._start,
            )

        def run() -> Items:
            channel = self._state.channel
            channel.not_compensated("#PSET", self._start)
            given = {
                axis: value()
                for axis, value in words.items()
                if value is not None
            }
            self._state.offsets.set_pset(given, self._start)
            return []

        return run

    def _preset(self) -> Run:
        """``#PRESET [X Y]``: ends #PSET, of all axes if none is named."""
        words = self._axis_words()

        def run() -> Items:
            self._state.channel.not_compensated("#PRESET", self._start)
            self._state.offsets.clear_pset(
                words or range(len(self._state.offsets.names))
            )
            return []

        return run

    def _suppress(self) -> Run:
        """``#SUPPRESS OFFSETS [ZERO ADD_ZERO PSET TOOL ..] X..``: for this block."""
        kinds = set(KINDS)
        if self._stream.is_op("["):
            kinds = set(
                self._keys(dict.fromkeys((*KINDS, *EMPTY_KINDS), False))
            )
        offsets = self._state.offsets

        def run() -> Items:
            self._state.channel.not_compensated(
                "#SUPPRESS OFFSETS", self._start
            )
            offsets.suppressed = frozenset(kinds)
            offsets.update()
            return []

        def behind() -> None:
            offsets.suppressed = frozenset()
            offsets.update()

        self._behind = behind
        return run

    def _channel_init(self) -> Run:
        """The decoder's positions are the machine's: waits until they are."""
        self._rest()
        self._drain = True
        return list

    def _get_position(self) -> Run:
        """``#GET CMDPOS [P1=X, P2=Y]``: programmed positions into variables."""
        stream, targets = self._stream, []
        if not stream.is_op("["):
            return list
        opened = self._formulas.open()
        while not stream.is_op("]"):
            target = self._formulas.reference()
            stream.expect("=", 900010)
            name = self._axis_name()
            if name is None:
                raise fail(
                    900010,
                    f"#GET CMDPOS: expected an axis, found {stream.describe()}",
                    stream.current.offset,
                )
            targets.append((target.store, self._axes[name]))
            stream.accept(",")
        self._formulas.close(opened)
        offsets = self._state.offsets

        def run() -> Items:
            position = self._modal.position
            for store, axis in targets:
                if store is not None:
                    store(offsets.programmed(axis, float(position[axis])))
            return []

        return run

    def _override(self) -> Run:
        """``#OVERRIDE [FEED_FACT=.. RAPID_FACT=..]``, percent."""
        keys = self._keys({"FEED_FACT": True, "RAPID_FACT": True})
        if not keys:
            raise fail(
                900010,
                "#OVERRIDE: FEED_FACT or RAPID_FACT is expected",
                self._start,
            )

        def percent(value: Formula, name: str) -> float:
            found = value()
            if isinstance(found, str) or not 0.1 <= found <= 200.0:
                raise fail(
                    900012,
                    f"#OVERRIDE: {name} {found} out of range 0.1..200 %",
                    self._start,
                )
            return found

        def run() -> Items:
            feed, rapid = keys.get("FEED_FACT"), keys.get("RAPID_FACT")
            if feed is not None:
                self._state.channel.feeds.set_factor(
                    percent(feed, "FEED_FACT") / 100.0
                )
            if rapid is not None:
                self._state.channel.dynamics.set_rapid_factor(
                    percent(rapid, "RAPID_FACT") / 100.0
                )
            return [*self._state.channel.dynamics.rows(self._modal.n)]

        return run

    def _fgroup(self) -> Run:
        """``#FGROUP [X,Y,Z]``: the axes that F refers to."""
        if self._stream.at_end:
            raise fail(900010, "#FGROUP: axes are expected", self._start)
        if not self._stream.is_op("["):
            words = " ".join(["FGROUP", *self._words(9)])
            raise fail(900003, f"#{words} is not supported", self._start)
        opened, axes = self._formulas.open(), set()
        while not self._stream.is_op("]"):
            name = self._axis_name()
            if name is None:
                raise fail(
                    900010,
                    f"#FGROUP: expected an axis, found {self._stream.describe()}",
                    self._start,
                )
            axes.add(self._axes[name])
            self._stream.accept(",")
        self._formulas.close(opened)
        if not axes:
            raise fail(900010, "#FGROUP: axes are expected", self._start)
        main = {axis for axis in self._state.machine.main if axis >= 0}

        def run() -> Items:
            self._state.channel.feeds.group = (
                None if axes == main else frozenset(axes)
            )
            return []

        return run

    def _tangfeed(self) -> Run:
        """``#TANGFEED [RMIN=..]``: arcs below this radius are driven slower.

        The feed falls in proportion to the radius.  0: off.
        """
        keys = self._keys({"RMIN": True}) if self._stream.is_op("[") else {}
        if self._stream.accept_name("RMIN"):  # the old form: RMIN [..]
            opened = self._formulas.open()
            keys = {"RMIN": self._formulas.expression()}
            self._formulas.close(opened)
        value = keys.get("RMIN")
        if value is None:
            raise fail(900010, "#TANGFEED: RMIN is expected", self._start)

        def run() -> Items:
            radius = value()
            if isinstance(radius, str) or not 0 <= radius <= 1e9:
                raise fail(
                    900012,
                    f"#TANGFEED: RMIN {radius} out of range",
                    self._start,
                )
            self._state.channel.feeds.tangential_radius_mm = (
                radius * self._modal.unit_mm
            )
            return []

        return run
