"""# commands: look-ahead marking, distance reset, flush.  Everything else is refused by name."""

from __future__ import annotations

import math
from collections.abc import Callable

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
from cnc_core.errors import CncError
from cnc_core.frontend.base.expression import ExpressionParser, VariableSource
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.port import Wait

Items = list[Row | Wait]

# First words of commands that the manual knows.
_KNOWN = """
    ACHSE ACHSTAUSCH ACS ADD AKIMA ANG AX BACKWARD BCS BLOCKSEARCH CACHE CALL CAX CAXTRACK CHANNEL CHF CHR CLEAR
    COMMAND COMMENT CONTOUR CONTROL CORNER CS CYL DEL DELETE DISABLE DIST DISTANCE DRIVE DYNAMIC ECS EDGE EDM ELSE
    ENABLE ENDIF ENDVAR ERROR EXPL EXPORT EXTCOMP FACE FF FGROUP FILE FILENAME FILTER FLUSH FRC FREE GANTRY GEAR GET
    HANDWHEEL HSC IDENT IF INIT JOG KIN LAH LIMIT LOAD LOCK MACHINE MAIN MANUAL MCS MEAS MICROJOINT MSG NIBBLE OPTIONAL
    ORI OTC OVERRIDE PRESET PSET PTP PUNCH PUT RETAIN RND ROTATION RT RTCP SAVE SCALE SEGMENTATION SET SIGNAL SINGLE
    SLOPE SPLINE STOP STROKE SUPPRESS SYNC TANGFEED TIME TIMER TLAX TLC TOOL TRACK TRAFO TRANSFORM TRANSVELMIN TRC TURN
    UNLOCK VAR VECTOR VECTORACC VECTORVEL VIB VOLCOMP WAIT WCS
"""
KNOWN = frozenset(_KNOWN.split())
MARKERS = {"ON": MARKER_ON, "OFF": MARKER_OFF, "CLEAR": MARKER_CLEAR}


class CommandParser:
    """Reads and executes one # command; the stream stands behind ``#``."""

    def __init__(self, stream: TokenStream, modal: Modal, variables: VariableSource, n: int) -> None:
        self._stream = stream
        self._modal = modal
        self._expressions = ExpressionParser(stream, variables)
        self._n = n
        self._start = stream.current.offset

    def execute(self) -> Items:
        """Rows and waits of the command."""
        stream, start = self._stream, self._stream.current.offset
        for words, method in self._commands():
            if self._matches(words):
                for _ in words:
                    stream.next()
                return self._alone(method())
        raise self._refusal(start)

    def _commands(self) -> tuple[tuple[tuple[str, ...], Callable[[], Items]], ...]:
        return (
            (("CONTOUR", "LOOKAHEAD"), self._lookahead),
            (("DISTANCE", "PROG"), self._distance),
            (("DISTANCE", "PROGRAM"), self._distance),
            (("FLUSH",), self._flush),
            (("EXPL", "SYN"), self._expl_syn),
            (("BACKWARD", "STORAGE"), self._backward_storage),
            (("DEL", "DIST"), self._dist2go_end),
        )

    def _matches(self, words: tuple[str, ...]) -> bool:
        first, second = self._stream.current, self._stream.following
        return all(token.text.upper() == word for token, word in zip((first, second), words, strict=False))

    def _alone(self, items: Items) -> Items:
        if not self._stream.at_end:
            raise fail(
                900010, f"unexpected {self._stream.current.text!r} behind the command", self._stream.current.offset
            )
        return items

    def _refusal(self, offset: int) -> CncError:
        token = self._stream.current
        if token.kind is not Kind.NAME:
            return fail(900010, "# without a command", offset)
        name = token.text.upper()
        if name in KNOWN:
            return fail(900003, f"#{self._full_name()} is not supported", offset)
        return fail(900002, f"unknown command #{name}", offset)

    def _full_name(self) -> str:
        """The command's words as they stand there, for the message."""
        names = []
        while self._stream.current.kind is Kind.NAME:
            names.append(self._stream.next().text.upper())
        return " ".join(names)

    # commands

    def _lookahead(self) -> Items:
        """``LOG [ON | OFF | CLEAR] [[PARAM=x]]``; also ``#CONTOUR LOOKAHEAD CLEAR``."""
        stream = self._stream
        log = stream.accept_name("LOG")
        word = stream.accept_name(*MARKERS)
        action = MARKERS[word.text.upper()] if word else MARKER_PARAM
        if not log and action != MARKER_CLEAR:
            raise fail(900010, "#CONTOUR LOOKAHEAD: expected LOG", stream.current.offset)
        bracket = stream.current.offset
        param = self._param()
        if action == MARKER_CLEAR and param is not None:
            raise fail(900010, "LOG CLEAR takes no PARAM", bracket)
        if action == MARKER_CLEAR:
            self._not_compensated("LOG CLEAR")
        flags = 0 if param is None else HAS_PARAM
        row = self._modal.row(MARKER, self._n, code=action, value=param or 0.0, flags=flags)
        return [Wait.DRAINED, row] if action == MARKER_CLEAR else [row]

    def _expl_syn(self) -> Items:
        """Wait here for the functions of type MVS_SLP."""
        return [self._modal.row(EVENT, self._n, code=EVENT_EXPL_SYN)]

    def _backward_storage(self) -> Items:
        """``#BACKWARD STORAGE CLEAR``: backward motion does not go behind this place."""
        if not self._stream.accept_name("CLEAR"):
            raise fail(900010, "#BACKWARD STORAGE: expected CLEAR", self._stream.current.offset)
        return [self._modal.row(EVENT, self._n, code=EVENT_STORAGE_CLEAR)]

    def _dist2go_end(self) -> Items:
        """``#DEL DIST2GO [END = mask]``: a deleted distance to go may end here if the PLC has set a bit of the mask."""
        stream = self._stream
        if stream.current.text != "2" or stream.following.text.upper() != "GO":
            raise self._refusal(self._start)
        stream.next(), stream.next()
        stream.expect("[", 900010)
        if not stream.accept_name("END"):
            raise fail(900010, f"#DEL DIST2GO: expected END, found {stream.describe()}", stream.current.offset)
        stream.expect("=", 900010)
        at = stream.current.offset
        mask = self._expressions.expression()
        if mask != round(mask) or not 0 < mask < 2**32:
            raise fail(900012, "#DEL DIST2GO: END is a mask of 32 bits, not 0", at)
        stream.expect("]", 900010)
        return [self._modal.row(EVENT, self._n, code=EVENT_DIST2GO_END, value=mask, flags=HAS_VALUE)]

    def _not_compensated(self, name: str) -> None:
        if self._modal.compensated:
            raise fail(20651, f"{name} during tool radius compensation: deselect it with G40", self._start)

    def _param(self) -> float | None:
        """``[PARAM=<expression>]`` if it stands there."""
        stream = self._stream
        opened = stream.accept("[")
        if not opened:
            return None
        if not stream.accept_name("PARAM"):
            raise fail(900010, f"expected PARAM, found {stream.describe()}", stream.current.offset)
        stream.expect("=", 900010)
        at = stream.current.offset
        value = self._expressions.expression()
        if not math.isfinite(value):
            raise fail(900012, "PARAM out of range", at)
        if stream.at_end:
            raise fail(900013, "bracket is not closed", opened.offset)
        stream.expect("]", 900010)
        return value

    def _distance(self) -> Items:
        """``#DISTANCE PROG START CLEAR``."""
        for word in ("START", "CLEAR"):
            if not self._stream.accept_name(word):
                raise fail(900010, f"#DISTANCE PROG: expected {word}", self._stream.current.offset)
        return [self._modal.row(DISTANCE_RESET, self._n)]

    def _flush(self) -> Items:
        """``#FLUSH`` stops the motion, CONTINUE does not, WAIT stops preparation too."""
        self._not_compensated("#FLUSH")
        if self._stream.accept_name("CONTINUE"):
            return [self._modal.row(FLUSH, self._n)]
        if self._stream.accept_name("WAIT"):
            return [self._modal.row(FLUSH, self._n, flags=STANDSTILL | WAIT), Wait.DRAINED]
        return [self._modal.row(FLUSH, self._n, flags=STANDSTILL)]
