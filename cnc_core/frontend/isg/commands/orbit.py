"""# commands of die sinking: #TRACK CHAN."""

from __future__ import annotations

from cnc_core.blocks import EXTENSION
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import fail

from .base import CommandBase, Items, Run

NOT_CONFIGURED, WRONG_RADII = 907120, 50917
CHANNELS = 12


class OrbitCommands(CommandBase):
    """Compiled like all other commands."""

    def _track_on(self) -> Run:
        """``#TRACK CHAN ON [EXTEND=1 MAX_SCALE=..

        MAX_EQUID=..]``: the contour that follows is orbited.
        """
        stream, start = self._stream, self._start
        opened = stream.current.offset
        stream.expect("[", 900010)
        if not stream.is_name("EXTEND"):
            raise fail(
                900003,
                f"#TRACK CHAN ON [{stream.current.text.upper()}..] is not supported",
                start,
            )
        stream.go_to(stream.place - 1)
        keys = self._keys(
            {"EXTEND": True, "MAX_SCALE": True, "MAX_EQUID": True}
        )
        channel = self._whole(
            keys["EXTEND"] or (lambda: 0.0), "EXTEND", 1, CHANNELS
        )
        for key in ("MAX_SCALE",):
            if key not in keys:
                raise fail(900010, f"#TRACK CHAN ON: {key} is missing", opened)

        def radius(formula: Formula | None, name: str) -> float:
            value = 0.0 if formula is None else formula()
            if isinstance(value, str) or not abs(value) <= 1e9:
                raise fail(
                    900012,
                    f"#TRACK CHAN ON: {name} {value} out of range",
                    start,
                )
            return value * self._modal.unit_mm

        def run() -> Items:
            if not self._state.machine.equidistant:
                raise fail(NOT_CONFIGURED, ERRORS[NOT_CONFIGURED], start)
            self._state.channel.not_compensated("#TRACK CHAN", start)
            channel()
            scale, equid = (
                radius(keys["MAX_SCALE"], "MAX_SCALE"),
                radius(keys.get("MAX_EQUID"), "MAX_EQUID"),
            )
            if scale < 0 or (equid != 0 and equid < scale):
                raise fail(
                    WRONG_RADII,
                    f"{ERRORS[WRONG_RADII]}: MAX_SCALE {scale:g}, MAX_EQUID {equid:g} mm",
                    start,
                )
            return self._extension(1, scale, equid)

        return run

    def _track_off(self) -> Run:
        self._rest()
        return lambda: self._extension(0, 0.0, 0.0)

    def _extension(self, code: int, scale: float, equid: float) -> Items:
        row = self._modal.row(EXTENSION, self._modal.n, code=code, value=scale)
        row["radius"] = equid
        return [row]
