"""# commands with texts: messages, errors, files."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import datetime

from cnc_core import files
from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.lexer import Kind, fail

from ..language.messages import formatted
from .base import CommandBase, Items, Run

MESSAGE_FILE = "message.txt"


class TextCommands(CommandBase):
    """#MSG, #MSG SAVE, #ERROR, #FILE NAME."""

    def _error(self) -> Run:
        """``#ERROR [ID=.. RC=0|2|7 MID=.. PV1..5 PM1..5]``: 0 warns, 2 and 7 stop."""
        known = {"ID": True, "RC": True, "MID": True}
        known |= {
            f"{letters}{i}": True
            for letters in ("PV", "PM")
            for i in range(1, 6)
        }
        keys = self._keys(known)
        number = self._whole(keys.get("ID") or (lambda: 1.0), "ID", 1, 1000)
        reaction = self._whole(keys.get("RC") or (lambda: 2.0), "RC", 0, 7)
        others = {
            name: value
            for name, value in keys.items()
            if name not in ("ID", "RC") and value is not None
        }

        def run() -> Items:
            text = "".join(
                [
                    f"#ERROR ID={number()}",
                    *(f" {name}={_shown(v())}" for name, v in others.items()),
                ]
            )
            if reaction() not in (0, 2, 7):
                raise fail(
                    900012,
                    f"#ERROR: RC={reaction()} is not one of 0, 2, 7",
                    self._start,
                )
            if reaction():
                raise fail(907050, text, self._start)
            self._state.warn(907050, text, self._start)
            return []

        return run

    def _text(self) -> Callable[[], str]:
        """``["text %d", a, b]``."""
        stream, offset = self._stream, self._stream.current.offset
        opened = self._formulas.open()
        if stream.current.kind is not Kind.STRING:
            raise fail(
                900010,
                f"expected a quoted text, found {stream.describe()}",
                stream.current.offset,
            )
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
        while stream.is_op("[") and (
            found := bracket.match(stream.text, stream.current.offset)
        ):
            words.append(found[1].upper())
            stream.skip_to(found.end())
        text = self._text()
        self._drain = any(word in ("SYN", "SYN_ACK", "ACK") for word in words)

        def run() -> Items:
            self._state.port.message(text())
            return []

        return run

    def _msg_save(self) -> Run:
        """``#MSG SAVE [EXCLUSIVE] [CONTINUE] ["text", a]``: one line more in
        the message file.
        """
        stream, words = self._stream, []
        while word := stream.accept_name("EXCLUSIVE", "CONTINUE"):
            words.append(word.text.upper())
        text = self._text()

        def run() -> Items:
            line = text()
            if "EXCLUSIVE" not in words:
                line = f"{datetime.now():%Y-%m-%d %H:%M:%S} {line}"
            port, name = (
                self._state.port,
                self._state.programs.get("MSG", MESSAGE_FILE),
            )
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
                self._state.programs[key] = (
                    inside(name, offset) if key == "MSG" else name
                )
            return []

        return run

    def _file_key(self) -> str:
        """MSG, M6, or G and a number."""
        stream, token = self._stream, self._stream.current
        found = re.compile(r"MSG|M0?6(?![0-9])|G[0-9]+", re.I).match(
            stream.text, token.offset
        )
        if not found or token.kind is not Kind.NAME:
            raise fail(
                900010,
                f"#FILE NAME: unknown key {stream.describe()}",
                token.offset,
            )
        stream.skip_to(found.end())
        key = found[0].upper()
        return "M6" if key == "M06" else key


def inside(name: str, offset: int) -> str:
    """A file name that stays in the folder of the run; an error for any other."""
    try:
        return str(files.inside(name))
    except CncError as error:
        raise fail(error.code, error.text, offset) from None


def _shown(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.12g}"
