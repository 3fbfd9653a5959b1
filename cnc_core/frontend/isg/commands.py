"""# commands, compiled: parsed once, executed each time their block comes.

``cnc_core.frontend.isg.command_table`` says which there are; what is not executed is stored or refused by name.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import datetime
from pathlib import PurePosixPath
from typing import NamedTuple

from cnc_core.blocks import (
    DISTANCE_RESET,
    DWELL,
    EVENT,
    EVENT_EXPL_SYN,
    FLUSH,
    HAS_PARAM,
    MARKER,
    MARKER_CLEAR,
    MARKER_OFF,
    MARKER_ON,
    MARKER_PARAM,
    STANDSTILL,
    WAIT,
)
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.expression import round_half_away
from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.base.scanner import Row
from cnc_core.frontend.isg import command_table as table
from cnc_core.frontend.isg.context import Context
from cnc_core.frontend.isg.execute import DWELL_MAX_S
from cnc_core.frontend.isg.formulas import Formulas
from cnc_core.frontend.isg.messages import formatted
from cnc_core.frontend.isg.offsets import EMPTY_KINDS, KINDS
from cnc_core.port import Wait

Items = list[Row | Wait]
Run = Callable[[], Items]
MARKERS = {"ON": MARKER_ON, "OFF": MARKER_OFF, "CLEAR": MARKER_CLEAR}
SIGNALS_MAX = 12
MESSAGE_FILE = "message.txt"
FIRST_WORDS = frozenset(name.split()[0] for name in table.TABLE)


class Command(NamedTuple):
    """A compiled command.  ``drain``: everything before is executed first.  ``behind``: what follows its block."""

    run: Run
    drain: bool = False
    behind: Callable[[], None] | None = None


class CommandParser:
    """Compiles one # command; the stream stands behind ``#``."""

    def __init__(self, stream: TokenStream, formulas: Formulas, context: Context, axes: dict[str, int]) -> None:
        self._stream, self._formulas, self._context, self._axes = stream, formulas, context, axes
        self._modal = context.modal
        self._start = stream.current.offset
        self._drain = False
        self._behind: Callable[[], None] | None = None

    def parse(self) -> Command:
        stream, start = self._stream, self._start
        for words, method in self._commands():
            if self._matches(words):
                for _ in words:
                    stream.next()
                return Command(method(), self._drain, self._behind)
        return Command(self._by_table(start))

    def _commands(self) -> tuple[tuple[tuple[str, ...], Callable[[], Run]], ...]:
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
            (("MCS", "ON"), self._mcs_on),
            (("MCS", "OFF"), self._mcs_off),
            (("SUPPRESS", "OFFSETS"), self._suppress),
            (("CHANNEL", "INIT"), self._channel_init),
            (("SET", "DEC", "LR", "SOLL"), self._channel_init),
            (("SET", "IPO", "SOLLPOS"), self._get_position),
            (("GET", "CMDPOS"), self._get_position),
            (("OVERRIDE",), self._override),
            (("FGROUP",), self._fgroup),
            (("TIME",), self._time),
            (("TIMER",), self._timer),
            (("WAIT",), self._wait),
            (("SIGNAL",), self._signal),
            (("ERROR",), self._error),
            (("MSG", "SAVE"), self._msg_save),
            (("MSG", "INFO"), self._stored_rest),
            (("MSG",), self._msg),
            (("FILE", "NAME"), self._file_name),
            (("FILENAME",), self._file_name),
        )

    def _matches(self, words: tuple[str, ...]) -> bool:
        found = self._words(len(words))
        if words == ("INIT", "V"):
            return found[:1] == ["INIT"] and self._stream.following.text.upper() == "V.E"
        if words in (("WAIT",), ("SIGNAL",)) and self._words(2)[1:] in (["FOR"], ["INDP"], ["READ"]):
            return False
        return found == list(words)

    def _words(self, count: int) -> list[str]:
        """The next words in capitals, up to ``count``; the stream stays."""
        stream, place = self._stream, self._stream.place
        found: list[str] = []
        while len(found) < count and stream.current.kind is Kind.NAME:
            found.append(stream.next().text.upper())
        stream.go_to(place)
        return found

    # by table: stored, without effect, refused, unknown

    def _by_table(self, offset: int) -> Run:
        stream = self._stream
        if stream.current.kind is not Kind.NAME:
            raise fail(900010, "# without a command", offset)
        words = self._words(table.LONGEST)
        for count in range(len(words), 0, -1):
            state = table.TABLE.get(" ".join(words[:count]))
            if state is not None and state != table.REFUSED:
                for _ in range(count):
                    stream.next()
                self._rest()
                return self._stored(" ".join(words[:count]), state, offset)
            if state is not None:
                break
        name = " ".join(self._words(99))
        if words[0] in FIRST_WORDS:
            raise fail(900003, f"#{name} is not supported", offset)
        if not self._context.lenient:
            raise fail(900002, f"unknown command #{words[0]}", offset)
        self._rest()
        self._context.warn(907041, f"unknown command #{name} is skipped", offset)
        return list

    def _stored(self, name: str, state: str, offset: int) -> Run:
        def run() -> Items:
            if state == table.STORED:
                self._context.executor.stored_without_effect(f"#{name}", offset)
            return []

        return run

    def _stored_rest(self) -> Run:
        self._rest()
        return self._stored("MSG INFO", table.STORED, self._start)

    def _rest(self) -> None:
        """Keys and brackets of a command that is not executed: checked for brackets only."""
        stream, depth, opened = self._stream, 0, 0
        while not stream.at_end:
            token = stream.next()
            if token.text == "[":
                opened, depth = token.offset if not depth else opened, depth + 1
            depth -= token.text == "]"
            if depth < 0:
                raise fail(900010, "] without [", token.offset)
        if depth:
            raise fail(900013, "bracket is not closed", opened)

    # brackets

    def _keys(self, known: dict[str, bool]) -> dict[str, Formula | None]:
        """``[KEY KEY=value KEY value]``; ``known``: whether a key has a value."""
        stream, found = self._stream, {}
        opened = self._formulas.open()
        while not stream.is_op("]"):
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            if stream.accept(","):
                continue
            key, offset = self._key(known), self._start
            if key in found:
                raise fail(900005, f"{key} twice in one command", offset)
            found[key] = self._key_value(key) if known[key] else None
        self._formulas.close(opened)
        return found

    def _key(self, known: dict[str, bool]) -> str:
        stream, token = self._stream, self._stream.current
        names = sorted(known, key=len, reverse=True)
        rest = stream.text[token.offset :].upper()
        name = next((k for k in names if rest.startswith(k)), None)
        if name is None or token.kind is not Kind.NAME:
            raise fail(900010, f"expected {', '.join(known)}, found {stream.describe()}", token.offset)
        stream.skip_to(token.offset + len(name))
        return name

    def _key_value(self, key: str) -> Formula:
        stream, offset = self._stream, self._stream.current.offset
        if not stream.accept("="):
            self._context.warn(907040, f"{key} without = before its value", offset)
        if not self._formulas.starts_here():
            raise fail(900004, f"{key} without a value", offset)
        return self._formulas.expression()

    def _whole(self, value: Formula, name: str, lowest: int, highest: int) -> Callable[[], int]:
        offset = self._start

        def whole() -> int:
            found = value()
            if isinstance(found, str) or not lowest - 0.5 < found < highest + 0.5:
                raise fail(900012, f"{name}: a number {lowest}..{highest} is expected, not {found}", offset)
            return round_half_away(found)

        return whole

    def _axis_words(self) -> dict[int, Callable[[], float] | None]:
        """Axis names with or without values, to the end of the block."""
        stream, found = self._stream, {}
        while not stream.at_end:
            token = stream.current
            if stream.accept(","):
                continue
            name = self._axis_name()
            if name is None:
                break
            has_value = stream.is_op("=") or self._formulas.starts_here()
            stream.accept("=")
            axis = self._axes[name]
            if axis in found:
                raise fail(900005, f"{name} twice in one block", token.offset)
            found[axis] = self._formulas.number(name, token.offset) if has_value else None
        return found

    def _axis_name(self) -> str | None:
        stream, token = self._stream, self._stream.current
        if token.kind is not Kind.NAME:
            return None
        rest = stream.text[token.offset :].upper()
        for name in self._axes:
            if len(name) > 1 and rest.startswith(name) and rest[len(name) :].lstrip().startswith("="):
                stream.skip_to(token.offset + len(name))
                return name
        letter = token.text[0].upper()
        if letter in self._axes:
            stream.take_letters(1)
            return letter
        return None

    # look-ahead

    def _lookahead(self) -> Run:
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

        def run() -> Items:
            if action == MARKER_CLEAR:
                self._not_compensated("LOG CLEAR")
            value, flags = (0.0, 0) if param is None else (param(), HAS_PARAM)
            row = self._modal.row(MARKER, self._modal.n, code=action, value=value, flags=flags)
            return [Wait.DRAINED, row] if action == MARKER_CLEAR else [row]

        return run

    def _param(self) -> Callable[[], float] | None:
        """``[PARAM=<expression>]`` if it stands there."""
        stream = self._stream
        if not stream.is_op("["):
            return None
        opened = self._formulas.open()
        if not stream.accept_name("PARAM"):
            raise fail(900010, f"expected PARAM, found {stream.describe()}", stream.current.offset)
        stream.expect("=", 900010)
        value = self._formulas.number("PARAM", stream.current.offset)
        if stream.at_end:
            raise fail(900013, "bracket is not closed", opened)
        stream.expect("]", 900010)
        return value

    def _distance(self) -> Run:
        """``#DISTANCE PROG START CLEAR``."""
        for word in ("START", "CLEAR"):
            if not self._stream.accept_name(word):
                raise fail(900010, f"#DISTANCE PROG: expected {word}", self._stream.current.offset)
        return lambda: [self._modal.row(DISTANCE_RESET, self._modal.n)]

    # flow

    def _expl_syn(self) -> Run:
        """Wait here for the functions of type MVS_SLP."""
        return lambda: [self._modal.row(EVENT, self._modal.n, code=EVENT_EXPL_SYN)]

    def _not_compensated(self, name: str) -> None:
        if self._modal.compensated:
            raise fail(20651, f"{name} during tool radius compensation: deselect it with G40", self._start)

    def _flush(self) -> Run:
        """``#FLUSH`` stops the motion, CONTINUE does not, WAIT stops preparation too."""
        word = self._stream.accept_name("CONTINUE", "WAIT")
        kind = word.text.upper() if word else ""

        def run() -> Items:
            self._not_compensated("#FLUSH")
            if kind == "CONTINUE":
                return [self._modal.row(FLUSH, self._modal.n)]
            if kind == "WAIT":
                return [self._modal.row(FLUSH, self._modal.n, flags=STANDSTILL | WAIT), Wait.DRAINED]
            return [self._modal.row(FLUSH, self._modal.n, flags=STANDSTILL)]

        return run

    def _time(self) -> Run:
        """``#TIME 2.5`` or ``#TIME [2.5]``: dwell, s."""
        seconds = self._formulas.number("#TIME", self._start)

        def run() -> Items:
            value = seconds()
            if not 0 <= value <= DWELL_MAX_S:
                raise fail(20752, f"#TIME: {value:g} s out of range 0..{DWELL_MAX_S:g} s", self._start)
            return [self._modal.row(DWELL, self._modal.n, value=value)]

        return run

    def _timer(self) -> Run:
        """``START | STOP | READ | CLEAR [SYN ID=1]``; READ puts ms into V.G.TIMER[ID]."""
        stream = self._stream
        word = stream.accept_name("START", "STOP", "READ", "CLEAR")
        if not word:
            raise fail(900010, f"#TIMER: expected START, STOP, READ or CLEAR, found {stream.describe()}", self._start)
        keys = self._keys({"SYN": False, "ID": True}) if stream.is_op("[") else {}
        timer = self._whole(keys.get("ID") or (lambda: 1.0), "ID", 0, 127)
        self._drain = "SYN" in keys
        act = {
            "START": self._context.system.timers.start,
            "STOP": self._context.system.timers.stop,
            "READ": self._context.system.timers.read,
            "CLEAR": self._context.system.timers.clear,
        }[word.text.upper()]

        def run() -> Items:
            act(timer(), self._context.port.now_s())
            return []

        return run

    def _signal_keys(self, name: str) -> tuple[Callable[[], int], list[Formula]]:
        """``[SYN ID=.. P[1]=.. CH=.. AHEAD]``: the number, and the values of P[i]."""
        stream, values = self._stream, []
        number: Formula | None = None
        opened = self._formulas.open()
        while not stream.is_op("]"):
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            token = stream.current
            if stream.accept(",") or stream.accept_name("SYN", "AHEAD"):
                continue
            if stream.accept_name("ID"):
                number = self._key_value("ID")
            elif stream.accept_name("CH"):
                self._key_value("CH")
            elif stream.accept_name("P") and stream.is_op("["):
                self._formulas.arguments()
                values.append(self._key_value("P"))
            else:
                raise fail(900010, f"#{name}: unexpected {token.text!r}", token.offset)
        self._formulas.close(opened)
        if len(values) > SIGNALS_MAX:
            raise fail(21549, ERRORS[21549], self._start)
        if number is None:
            raise fail(900010, f"#{name} without ID", self._start)
        return self._whole(number, "ID", 0, 2**31 - 1), values

    def _signal(self) -> Run:
        """``#SIGNAL [ID=..]``, ``#SIGNAL REMOVE [ID=..]``."""
        remove = self._stream.accept_name("REMOVE") is not None
        number, _ = self._signal_keys("SIGNAL")
        signals = self._context.signals

        def run() -> Items:
            if remove:
                signals.pop(number(), None)
            else:
                signals[number()] = signals.get(number(), 0) + 1
            return []

        return run

    def _wait(self) -> Run:
        """``#WAIT [ID=..]`` uses up one signal; in one channel nobody else could send it."""
        number, _ = self._signal_keys("WAIT")
        signals = self._context.signals

        def run() -> Items:
            wanted = number()
            if not signals.get(wanted, 0):
                text = f"#WAIT: no signal {wanted} has been sent, and no other channel can send it"
                if not self._context.lenient:
                    raise fail(907052, text, self._start)
                self._context.warn(907052, text, self._start)
                return []
            signals[wanted] -= 1
            return []

        return run

    # data

    def _delete(self) -> Run:
        """``#DELETE V.P.A, V.L.B, P1``."""
        stream, store, names = self._stream, self._context.store, []
        while True:
            token = stream.next()
            parts = token.text.upper().split(".")
            if token.kind is Kind.VARIABLE and len(parts) > 2 and parts[1] in ("P", "S", "L", "CYC", "I"):
                names.append((parts[1], ".".join(parts[2:]), token.offset))
            elif token.text.upper() == "P" and stream.current.kind is Kind.NUMBER:
                names.append(("", stream.next().text, token.offset))
            else:
                raise fail(900010, f"#DELETE: expected a variable, found {token.text!r}", token.offset)
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
            self._context.macros.clear()
            return []

        return run

    def _init_external(self) -> Run:
        """``#INIT V.E``: initial values, 0 and empty texts."""
        self._stream.next()
        self._drain = True

        def run() -> Items:
            self._context.store.init_external()
            return []

        return run

    # positions

    def _pset(self) -> Run:
        """``#PSET X10 Y0``: the position gets these values."""
        words = self._axis_words()
        if not words or any(value is None for value in words.values()):
            raise fail(900010, "#PSET: axis words with values are expected", self._start)

        def run() -> Items:
            executor = self._context.executor
            executor.not_compensated("#PSET", self._start)
            given = {axis: value() for axis, value in words.items() if value is not None}
            self._context.offsets.set_pset(given, self._start)
            return []

        return run

    def _preset(self) -> Run:
        """``#PRESET [X Y]``: ends #PSET, of all axes if none is named."""
        words = self._axis_words()

        def run() -> Items:
            self._context.executor.not_compensated("#PRESET", self._start)
            self._context.offsets.clear_pset(words or range(len(self._context.offsets.names)))
            return []

        return run

    def _mcs_on(self) -> Run:
        """All offsets off; EX TOOL keeps the tool."""
        if self._stream.accept("["):
            for word in ("EX", "TOOL"):
                if not self._stream.accept_name(word):
                    raise fail(900010, f"#MCS ON: expected {word}", self._stream.current.offset)
            raise fail(900003, "#MCS ON [EX TOOL] is not supported", self._start)
        return lambda: self._set_mcs(True)

    def _mcs_off(self) -> Run:
        return lambda: self._set_mcs(False)

    def _set_mcs(self, on: bool) -> Items:
        self._context.executor.not_compensated("#MCS", self._start)
        self._context.offsets.machine_coordinates = on
        self._context.offsets.update()
        return []

    def _suppress(self) -> Run:
        """``#SUPPRESS OFFSETS [ZERO ADD_ZERO PSET TOOL ..] X..``: for this block."""
        kinds = set(KINDS)
        if self._stream.is_op("["):
            kinds = set(self._keys(dict.fromkeys((*KINDS, *EMPTY_KINDS), False)))
        offsets = self._context.offsets

        def run() -> Items:
            self._context.executor.not_compensated("#SUPPRESS OFFSETS", self._start)
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
                raise fail(900010, f"#GET CMDPOS: expected an axis, found {stream.describe()}", stream.current.offset)
            targets.append((target.store, self._axes[name]))
            stream.accept(",")
        self._formulas.close(opened)
        offsets = self._context.offsets

        def run() -> Items:
            position = self._modal.position
            for store, axis in targets:
                if store is not None:
                    store(offsets.programmed(axis, float(position[axis])))
            return []

        return run

    # feed

    def _override(self) -> Run:
        """``#OVERRIDE [FEED_FACT=.. RAPID_FACT=..]``, percent."""
        keys = self._keys({"FEED_FACT": True, "RAPID_FACT": True})
        if not keys:
            raise fail(900010, "#OVERRIDE: FEED_FACT or RAPID_FACT is expected", self._start)

        def percent(value: Formula, name: str) -> float:
            found = value()
            if isinstance(found, str) or not 0.1 <= found <= 200.0:
                raise fail(900012, f"#OVERRIDE: {name} {found} out of range 0.1..200 %", self._start)
            return found

        def run() -> Items:
            feed, rapid = keys.get("FEED_FACT"), keys.get("RAPID_FACT")
            if feed is not None:
                self._context.executor.feeds.set_factor(percent(feed, "FEED_FACT") / 100.0)
            if rapid is not None and percent(rapid, "RAPID_FACT") != 100.0:
                self._context.executor.stored_without_effect("#OVERRIDE [RAPID_FACT]", self._start)
            return []

        return run

    def _fgroup(self) -> Run:
        """``#FGROUP [X,Y,Z]``: the main axes, as always; others are refused."""
        if self._stream.at_end:
            raise fail(900010, "#FGROUP: axes are expected", self._start)
        if not self._stream.is_op("["):
            words = " ".join(["FGROUP", *self._words(9)])
            raise fail(900003, f"#{words} is not supported", self._start)
        opened, axes = self._formulas.open(), set()
        while not self._stream.is_op("]"):
            name = self._axis_name()
            if name is None:
                raise fail(900010, f"#FGROUP: expected an axis, found {self._stream.describe()}", self._start)
            axes.add(self._axes[name])
            self._stream.accept(",")
        self._formulas.close(opened)
        if axes != {axis for axis in self._context.machine.main if axis >= 0}:
            raise fail(900003, "#FGROUP of other axes than the main axes is not supported", self._start)
        return list

    # texts

    def _error(self) -> Run:
        """``#ERROR [ID=.. RC=0|2|7 MID=.. PV1..5 PM1..5]``: 0 warns, 2 and 7 stop."""
        known = {"ID": True, "RC": True, "MID": True}
        known |= {f"{letters}{i}": True for letters in ("PV", "PM") for i in range(1, 6)}
        keys = self._keys(known)
        number = self._whole(keys.get("ID") or (lambda: 1.0), "ID", 1, 1000)
        reaction = self._whole(keys.get("RC") or (lambda: 2.0), "RC", 0, 7)
        others = {name: value for name, value in keys.items() if name not in ("ID", "RC") and value is not None}

        def run() -> Items:
            text = "".join([f"#ERROR ID={number()}", *(f" {name}={_shown(v())}" for name, v in others.items())])
            if reaction() not in (0, 2, 7):
                raise fail(900012, f"#ERROR: RC={reaction()} is not one of 0, 2, 7", self._start)
            if reaction():
                raise fail(907050, text, self._start)
            self._context.warn(907050, text, self._start)
            return []

        return run

    def _text(self) -> Callable[[], str]:
        """``["text %d", a, b]``."""
        stream, offset = self._stream, self._stream.current.offset
        opened = self._formulas.open()
        if stream.current.kind is not Kind.STRING:
            raise fail(900010, f"expected a quoted text, found {stream.describe()}", stream.current.offset)
        text = self._formulas.expression()
        values = []
        while stream.accept(","):
            values.append(self._formulas.expression())
        self._formulas.close(opened)

        def made() -> str:
            found = text()
            if not isinstance(found, str):
                raise fail(907012, ERRORS[907012], offset)
            return formatted(found, [value() for value in values], offset)

        return made

    def _msg(self) -> Run:
        """``#MSG [SYN|SYN_ACK|ACK] [HMI|PLC|..] ["text %d", a]``."""
        stream, words = self._stream, []
        while stream.current.kind is Kind.NAME:
            words.append(stream.next().text.upper())
        bracket = re.compile(r"\[\s*([A-Za-z_]+)\s*\]")
        while stream.is_op("[") and (found := bracket.match(stream.text, stream.current.offset)):
            words.append(found[1].upper())
            stream.skip_to(found.end())
        text = self._text()
        self._drain = any(word in ("SYN", "SYN_ACK", "ACK") for word in words)

        def run() -> Items:
            self._context.port.message(text())
            return []

        return run

    def _msg_save(self) -> Run:
        """``#MSG SAVE [EXCLUSIVE] [CONTINUE] ["text", a]``: one line more in the message file."""
        stream, words = self._stream, []
        while word := stream.accept_name("EXCLUSIVE", "CONTINUE"):
            words.append(word.text.upper())
        text = self._text()

        def run() -> Items:
            line = text()
            if "EXCLUSIVE" not in words:
                line = f"{datetime.now():%Y-%m-%d %H:%M:%S} {line}"
            port, name = self._context.port, self._context.programs.get("MSG", MESSAGE_FILE)
            port.append_file(name, line if "CONTINUE" in words else line + "\n")
            port.message(line)
            return []

        return run

    def _file_name(self) -> Run:
        """``#FILE NAME [MSG="f" M6="p" G80="p"]``."""
        stream, found = self._stream, {}
        opened = self._formulas.open()
        while not stream.is_op("]"):
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            if stream.accept(","):
                continue
            key = self._file_key()
            stream.expect("=", 900010)
            found[key] = self._formulas.expression()
        self._formulas.close(opened)
        offset = self._start

        def run() -> Items:
            for key, value in found.items():
                name = value()
                if not isinstance(name, str):
                    raise fail(907012, f"#FILE NAME: {ERRORS[907012]}", offset)
                self._context.programs[key] = inside(name, offset) if key == "MSG" else name
            return []

        return run

    def _file_key(self) -> str:
        """MSG, M6, or G and a number."""
        stream, token = self._stream, self._stream.current
        found = re.compile(r"MSG|M0?6(?!\d)|G\d+", re.I).match(stream.text, token.offset)
        if not found or token.kind is not Kind.NAME:
            raise fail(900010, f"#FILE NAME: unknown key {stream.describe()}", token.offset)
        stream.skip_to(found.end())
        key = found[0].upper()
        return "M6" if key == "M06" else key


def inside(name: str, offset: int) -> str:
    """A file name that stays in the folder of the run; an error for any other."""
    path = PurePosixPath(name.replace("\\", "/"))
    if not name.strip() or path.is_absolute() or ".." in path.parts or ":" in name or "\0" in name:
        raise fail(907053, f"{name!r}: {ERRORS[907053]}", offset)
    return str(path)


def _shown(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.12g}"
