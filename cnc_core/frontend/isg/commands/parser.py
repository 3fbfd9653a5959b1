"""The # commands, compiled: parsed once, executed each time their block comes.

``cnc_core.frontend.isg.commands.table`` lists them all.  A command that is not
executed is stored or refused by name.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from cnc_core.blocks import (
    DISTANCE_RESET,
    EVENT,
    EVENT_DIST2GO_END,
    EVENT_EXPL_SYN,
    EVENT_STORAGE_CLEAR,
    FLUSH,
    HAS_PARAM,
    HAS_VALUE,
    MARKER,
    MARKER_CLEAR,
    MARKER_OFF,
    MARKER_ON,
    MARKER_PARAM,
    STANDSTILL,
    WAIT,
)
from cnc_core.frontend.base.formula import number_of
from cnc_core.frontend.base.guess import guess
from cnc_core.frontend.base.lexer import Kind, fail, shown
from cnc_core.frontend.port import Wait

from . import table
from .base import Items, Run
from .corner import CornerCommands
from .cycle import CycleCommands
from .exchange import ExchangeCommands
from .frame import FrameCommands
from .jobs import JobCommands
from .kinematic import KinematicCommands
from .orbit import OrbitCommands
from .path import PathCommands
from .position import PositionCommands
from .prediction import PredictionCommands
from .signals import SignalCommands
from .spline import SplineCommands
from .text import TextCommands
from .time import TimeCommands

MARKERS = {"ON": MARKER_ON, "OFF": MARKER_OFF, "CLEAR": MARKER_CLEAR}
NEAR = 0.8  # of long names; few letters tell short ones apart
FIRST_WORDS = frozenset(name.split()[0] for name in table.TABLE)


def _meant(words: list[str]) -> str:
    """``; did you mean #X?`` for the command that these words nearly begin."""
    for count in range(len(words), 0, -1):
        named = [n for n in table.TABLE if len(n.split()) == count]
        hint = guess(" ".join(words[:count]), named, NEAR, "#")
        if hint:
            return hint
    return ""


class Command(NamedTuple):
    """A compiled command.

    ``drain``: everything before is executed first.
    ``behind``: the action behind its block.
    ``last``: it comes behind the words of its block, wherever it stands.
    """

    run: Run
    drain: bool = False
    behind: Callable[[], None] | None = None
    last: bool = False


class CommandParser(
    FrameCommands,
    KinematicCommands,
    PositionCommands,
    PathCommands,
    SplineCommands,
    CornerCommands,
    TextCommands,
    TimeCommands,
    SignalCommands,
    ExchangeCommands,
    JobCommands,
    CycleCommands,
    OrbitCommands,
    PredictionCommands,
):
    """Compiles one # command; the stream stands behind ``#``."""

    def parse(self) -> Command:
        stream, start = self._stream, self._start
        for words, method in self._commands():
            if self._matches(words):
                for _ in words:
                    stream.next()
                self._old_name(" ".join(words), start)
                return Command(method(), self._drain, self._behind, self._last)
        return Command(self._by_table(start))

    def _commands(
        self,
    ) -> tuple[tuple[tuple[str, ...], Callable[[], Run]], ...]:
        return (
            (("CONTOUR", "LOOKAHEAD"), self._lookahead),
            (("DISTANCE", "PROG"), self._distance),
            (("DISTANCE", "PROGRAM"), self._distance),
            (("FLUSH",), self._flush),
            (("EXPL", "SYN"), self._expl_syn),
            (("DELETE",), self._delete),
            (("INIT", "MACRO", "TAB"), self._init_macros),
            (("INIT", "V"), self._init_external),
            (("PSET",), self._pset),
            (("PRESET",), self._preset),
            (("SUPPRESS", "OFFSETS"), self._suppress),
            *self._frame_commands(),
            *self._kinematic_commands(),
            (("CHANNEL", "INIT"), self._channel_init),
            (("CHANNEL", "SET"), self._channel_set),
            (("SET", "DEC", "LR", "SOLL"), self._channel_init),
            (("SET", "IPO", "SOLLPOS"), self._get_position),
            (("GET", "CMDPOS"), self._get_position),
            (("OVERRIDE",), self._override),
            (("VECTOR", "LIMIT", "ON"), self._vector_limit),
            (("VECTOR", "LIMIT", "OFF"), self._vector_limit_off),
            (("VECTORVEL",), lambda: self._old_vector("VEL")),
            (("VECTORACC",), lambda: self._old_vector("ACC")),
            (("SPLINE", "TYPE"), self._spline_type),
            (("SPLINE", "ON"), self._spline_on),
            (("SPLINE", "OFF"), self._spline_off),
            (("SET", "SPLINETYPE"), self._spline_type),
            (("SET", "SPLINE", "ON"), self._spline_on),
            (("SET", "SPLINE", "OFF"), self._spline_off),
            (("AKIMA", "TRANS"), self._akima_trans),
            (("AKIMA", "STARTVECTOR"), lambda: self._spline_vector(0)),
            (("AKIMA", "ENDVECTOR"), lambda: self._spline_vector(1)),
            (("SET", "ASPLINE", "MODE"), self._old_trans),
            (("SET", "ASPLINE", "STARTTANG"), lambda: self._spline_vector(0)),
            (("SET", "ASPLINE", "ZIELTANG"), lambda: self._spline_vector(1)),
            (("CONTOUR", "MODE"), self._contour_mode),
            *(
                ((name,), partial(self._corner, name))
                for name in ("CHF", "CHR", "RND", "FRC")
            ),
            (("HSC",), self._hsc),
            (("FILTER",), self._filter),
            (("SLOPE",), self._slope),
            (("SET", "SLOPE", "PROFIL"), self._old_slope),
            (("FGROUP",), self._fgroup),
            (("TANGFEED",), self._tangfeed),
            (("SET", "TANGFEED"), self._tangfeed),
            (("TIME",), self._time),
            (("TIMER",), self._timer),
            (("MC_MOVEPATH",), self._move_path),
            (("MCV_GRPRESETFORCED",), self._reset_forced),
            (("WAIT", "MC_STATUS"), self._wait_status),
            (("WAIT",), self._wait),
            (("SIGNAL",), self._signal),
            (("CALL", "AX"), self._call_ax),
            (("AX", "REQUEST"), self._call_ax),
            (("PUT", "AX"), self._put_ax),
            (("AX", "RELEASE"), self._put_ax),
            (("SET", "AX"), self._set_ax),
            (("AX", "DEF"), self._set_ax),
            (("ERROR",), self._error),
            (("MSG", "SAVE"), self._msg_save),
            (("MSG", "INFO"), self._stored_rest),
            (("MSG",), self._msg),
            (("FILE", "NAME"), self._file_name),
            (("FILENAME",), self._file_name),
            (("BACKWARD", "STORAGE"), self._backward_storage),
            (("DEL", "DIST"), self._dist2go_end),
            (("RT", "WHILE"), self._rt_while),
            (("RT", "ENDWHILE"), self._rt_endwhile),
            (("PATTERN",), self._pattern),
            (("AT",), self._at),
            (("DISABLE", "MODAL", "CYCLE"), self._disable_modal),
            (("TRACK", "CHAN", "ON"), self._track_on),
            (("TRACK", "CHAN", "OFF"), self._track_off),
        )

    def _matches(self, words: tuple[str, ...]) -> bool:
        found = self._words(len(words))
        if words == ("INIT", "V"):
            return (
                found[:1] == ["INIT"]
                and self._stream.following.text.upper() == "V.E"
            )
        if words == ("SET", "AX") and self._words(3)[2:] == ["LINK"]:
            return False
        if words == ("WAIT",) and self._words(2)[1:] == ["INDP"]:
            return False
        return found == list(words)

    # by table: stored, without effect, refused, unknown

    def _by_table(self, offset: int) -> Run:
        stream = self._stream
        if stream.current.kind is not Kind.NAME:
            raise fail(900010, "# without a command", offset)
        words = self._words(table.LONGEST)
        for count in range(len(words), 0, -1):
            effect = table.TABLE.get(" ".join(words[:count]))
            if effect is not None and effect != table.REFUSED:
                for _ in range(count):
                    stream.next()
                self._old_name(" ".join(words[:count]), offset)
                self._rest()
                return self._stored(" ".join(words[:count]), effect, offset)
            if effect is not None:
                break
        name = " ".join(self._words(99))
        hint = _meant(words) if effect is None else ""
        if words[0] in FIRST_WORDS and not hint:
            raise fail(900003, f"#{name} is not supported", offset)
        if words[0] in FIRST_WORDS or not self._state.lenient:
            wrong = name if hint else words[0]
            raise fail(900002, f"unknown command #{wrong}{hint}", offset)
        self._rest()
        self._state.warn(
            907041, f"unknown command #{name} is skipped{hint}", offset
        )
        return list

    def _old_name(self, name: str, offset: int) -> None:
        if name in table.OLD_NAMES:
            self._state.warn(907040, f"#{name} is an old name", offset)

    def _stored(self, name: str, effect: str, offset: int) -> Run:
        def run() -> Items:
            if name.endswith("CORNER PARAM"):
                self._state.channel.corner_param = True
            if effect == table.STORED:
                self._state.channel.stored_without_effect(f"#{name}", offset)
            return []

        return run

    def _stored_rest(self) -> Run:
        self._rest()
        return self._stored("MSG INFO", table.STORED, self._start)

    # look-ahead

    def _lookahead(self) -> Run:
        """``LOG [ON | OFF | CLEAR] [[PARAM=x]]``; also ``#CONTOUR LOOKAHEAD CLEAR``."""
        stream = self._stream
        log = stream.accept_name("LOG")
        word = stream.accept_name(*MARKERS)
        action = MARKERS[word.text.upper()] if word else MARKER_PARAM
        if not log and action != MARKER_CLEAR:
            raise fail(
                900010,
                "#CONTOUR LOOKAHEAD: expected LOG",
                stream.current.offset,
            )
        bracket = stream.current.offset
        param = self._param()
        if action == MARKER_CLEAR and param is not None:
            raise fail(900010, "LOG CLEAR takes no PARAM", bracket)

        def run() -> Items:
            if action == MARKER_CLEAR:
                self._not_compensated("LOG CLEAR")
            value, flags = (0.0, 0) if param is None else (param(), HAS_PARAM)
            row = self._modal.row(
                MARKER, self._modal.n, code=action, value=value, flags=flags
            )
            return [Wait.DRAINED, row] if action == MARKER_CLEAR else [row]

        return run

    def _param(self) -> Callable[[], float] | None:
        """``[PARAM=<expression>]`` if it stands there; the ``=`` may be missing."""
        stream = self._stream
        if not stream.is_op("["):
            return None
        opened = self._formulas.open()
        if not stream.accept_name("PARAM"):
            raise fail(
                900010,
                f"expected PARAM, found {stream.describe()}",
                stream.current.offset,
            )
        offset = stream.current.offset
        value = number_of(self._key_value("PARAM"), "PARAM", offset)
        if stream.at_end:
            raise fail(900013, "bracket is not closed", opened)
        stream.expect("]", 900010)
        return value

    def _distance(self) -> Run:
        """``#DISTANCE PROG START CLEAR``."""
        for word in ("START", "CLEAR"):
            if not self._stream.accept_name(word):
                raise fail(
                    900010,
                    f"#DISTANCE PROG: expected {word}",
                    self._stream.current.offset,
                )
        return lambda: [self._modal.row(DISTANCE_RESET, self._modal.n)]

    # flow

    def _expl_syn(self) -> Run:
        """Wait here for the functions of type MVS_SLP."""
        return lambda: [
            self._modal.row(EVENT, self._modal.n, code=EVENT_EXPL_SYN)
        ]

    def _backward_storage(self) -> Run:
        """``#BACKWARD STORAGE CLEAR``: backward motion does not go behind this
        place.
        """
        if not self._stream.accept_name("CLEAR"):
            raise fail(
                900010,
                "#BACKWARD STORAGE: expected CLEAR",
                self._stream.current.offset,
            )
        return lambda: [
            self._modal.row(EVENT, self._modal.n, code=EVENT_STORAGE_CLEAR)
        ]

    def _dist2go_end(self) -> Run:
        """``#DEL DIST2GO [END = mask]``: a deleted distance to go may end here
        if the PLC has set a bit of the mask.
        """
        stream = self._stream
        if stream.current.text != "2" or stream.following.text.upper() != "GO":
            raise fail(900003, "#DEL is not supported", self._start)
        stream.next()
        stream.next()
        stream.expect("[", 900010)
        if not stream.accept_name("END"):
            raise fail(
                900010,
                f"#DEL DIST2GO: expected END, found {stream.describe()}",
                stream.current.offset,
            )
        stream.expect("=", 900010)
        at = stream.current.offset
        mask = self._formulas.number("END", at)
        stream.expect("]", 900010)

        def run() -> Items:
            value = mask()
            if value != round(value) or not 0 < value < 2**32:
                raise fail(
                    900012, "#DEL DIST2GO: END is a mask of 32 bits, not 0", at
                )
            return [
                self._modal.row(
                    EVENT,
                    self._modal.n,
                    code=EVENT_DIST2GO_END,
                    value=value,
                    flags=HAS_VALUE,
                )
            ]

        return run

    def _rt_while(self) -> Run:
        """``#RT WHILE [[MODULO]]``."""
        stream, start, loop = self._stream, self._start, self._state.loop
        bracket = stream.accept("[")
        modulo = stream.accept_name("MODULO") is not None
        if bracket:
            if not modulo:
                raise fail(
                    900010,
                    f"#RT WHILE: expected MODULO, found {stream.describe()}",
                    stream.current.offset,
                )
            stream.expect("]", 900010)
        return lambda: [loop.begin(modulo, start)]

    def _rt_endwhile(self) -> Run:
        start, loop = self._start, self._state.loop
        return lambda: [loop.end(start)]

    def _flush(self) -> Run:
        """``#FLUSH`` stops the motion, CONTINUE does not, WAIT stops
        preparation too.
        """
        word = self._stream.accept_name("CONTINUE", "WAIT")
        kind = word.text.upper() if word else ""

        def run() -> Items:
            self._not_compensated("#FLUSH")
            if kind == "CONTINUE":
                return [self._modal.row(FLUSH, self._modal.n)]
            if kind == "WAIT":
                return [
                    self._modal.row(
                        FLUSH, self._modal.n, flags=STANDSTILL | WAIT
                    ),
                    Wait.DRAINED,
                ]
            return [self._modal.row(FLUSH, self._modal.n, flags=STANDSTILL)]

        return run

    # data

    def _delete(self) -> Run:
        """``#DELETE V.P.A, V.L.B, P1``."""
        stream, store, names = self._stream, self._state.store, []
        while True:
            token = stream.next()
            parts = token.text.upper().split(".")
            if (
                token.kind is Kind.VARIABLE
                and len(parts) > 2
                and parts[1] in ("P", "S", "L", "CYC", "I")
            ):
                name = ".".join(parts[2:])
                names.append((parts[1], name, token.offset))
            elif (
                token.text.upper() == "P" and stream.current.kind is Kind.NUMBER
            ):
                names.append(("", stream.next().text, token.offset))
            else:
                raise fail(
                    900010,
                    f"#DELETE: expected a variable, found {shown(token.text)}",
                    token.offset,
                )
            if stream.is_op("["):
                self._formulas.arguments()
            if not stream.accept(","):
                break

        def run() -> Items:
            for family, name, offset in names:
                store.delete(family, name, offset)
            return []

        return run

    def _init_macros(self) -> Run:
        def run() -> Items:
            self._state.macros.clear()
            return []

        return run

    def _init_external(self) -> Run:
        """``#INIT V.E``: initial values, 0 and empty texts."""
        self._stream.next()
        self._drain = True

        def run() -> Items:
            self._state.store.init_external()
            return []

        return run
