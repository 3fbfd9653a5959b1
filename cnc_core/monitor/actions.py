"""What people do: orders to the PLC, answers to dialogs of the CNC's program,
and who gave them.
"""

from __future__ import annotations

import asyncio
import contextlib
import sys
from collections.abc import Callable
from typing import Any

from plc_client.online import parse_force
from plc_client.panel import COMMANDS, LEVELS

from ..observing.events import Events
from ..observing.plc import PlcLine, RefusedError

SYMBOLS_MAX = 64
TEXT_MAX = 400


class Desk:
    """Gives orders to the PLC of one cell, one after the other.

    What a page has forced is let go when it is closed, unless ``keep``.
    """

    def __init__(self, name: str, events: Events, *, keep: bool) -> None:
        self._events, self._keep = events, keep
        line = PlcLine(name)
        self.ask, self.look = line.ask, line.look
        self._open: set[str] = set()
        self._forced: dict[str, dict[str, str]] = {}
        self._leaving: set[asyncio.Future[None]] = set()
        self.cell_s: Callable[[], float | None] = lambda: None
        # the channel that an order is for, ahead of its text
        self.title: Callable[[dict[str, Any]], str] = lambda _: ""

    async def act(self, page: str, who: str, given: Any) -> dict[str, Any]:
        """Do what a page asks for; it stands in the events, done or refused.

        RefusedError: with the reason.
        """
        order, text = order_of(given)
        text = self.title(order) + text
        try:
            answer = await self.ask(order)
        except RefusedError as error:
            self._tell("refused", f"{text}: {error}", who)
            raise
        self._note(page, order, answer)
        self._tell("action", text, who)
        await self._give_cycles(order)
        if page not in self._open:  # closed while the PLC obeyed
            await self.leave(page, who)
        return answer

    async def _give_cycles(self, order: dict[str, Any]) -> None:
        """A command needs cycles, also while a dialog of the program is open."""
        if order["do"] == "operate" and order["what"] in COMMANDS:
            with contextlib.suppress(RefusedError):
                await self.look({"do": "cycles"})

    def _note(
        self, page: str, order: dict[str, Any], answer: dict[str, Any]
    ) -> None:
        """Which symbols a page holds forced, as the PLC spells them."""
        if "forced" not in answer:
            return
        held = self._forced.setdefault(page, {})
        if order["do"] == "force":
            now = list(answer["forced"])
            for spelled, _ in order["symbols"]:
                held[spelled] = next(
                    (path for path in now if _same(path, spelled)), spelled
                )
        for path in [*held]:
            if held[path] not in answer["forced"]:
                del held[path]

    def enter(self, page: str) -> None:
        """A page is open."""
        self._open.add(page)

    async def leave(self, page: str, who: str) -> None:
        """A page is closed; a server that ends does not stop this half way."""
        leaving = asyncio.ensure_future(self._let_go(page, who))
        self._leaving.add(leaving)
        leaving.add_done_callback(self._leaving.discard)
        await asyncio.shield(leaving)

    async def _let_go(self, page: str, who: str) -> None:
        self._open.discard(page)
        held = [*self._forced.pop(page, {}).values()]
        if not held or self._keep:
            return
        text = f"let go with the page: {', '.join(held)}"
        try:
            await self.ask({"do": "unforce", "symbols": held})
            self._tell("action", text, who)
        except RefusedError as error:
            self._tell("refused", f"{text}: {error}", who)

    def _tell(self, kind: str, text: str, who: str) -> None:
        self._events.add(kind, text, who, self.cell_s())


def _same(path: str, spelled: str) -> bool:
    """Two spellings of one symbol."""
    return _bare(path) == _bare(spelled)


def _bare(path: str) -> str:
    name = path.upper().replace("^", "").replace(" ", "")
    return name.removeprefix("HLI_GLOBAL_VARIABLES.").removeprefix("HLI.")


Order = dict[str, Any]


def order_of(given: Any) -> tuple[Order, str]:
    """The order for the PLC, and its text for the events.

    RefusedError: it is no order.
    """
    if not isinstance(given, dict):
        raise RefusedError("an order is an object")
    what = given.get("do")
    if what == "operate":
        return _operation(given)
    if what == "force":
        pairs = [_pair(one) for one in _list(given.get("symbols"))]
        text = ", ".join(f"{path}={value}" for path, value in pairs)
        order: Order = {
            "do": "force",
            "symbols": [list(pair) for pair in pairs],
        }
        return order, f"force {text}"
    if what == "unforce":
        paths = [_text(path) for path in _list(given.get("symbols"))]
        return {
            "do": "unforce",
            "symbols": paths,
        }, f"unforce {', '.join(paths)}"
    if what == "answer":
        return _answer(given)
    raise RefusedError("do: operate, force, unforce or answer")


def _operation(given: dict[str, Any]) -> tuple[Order, str]:
    """What the panel of a channel does."""
    name, value = _text(given.get("what")), given.get("value")
    channel = given.get("channel", 0)
    if type(channel) is not int or channel < 0:
        raise RefusedError("a channel is a number, 0 for the first one")
    if isinstance(value, str):
        value = _text(value)
    elif value not in (None, True, False) and not _is_number(value):
        raise RefusedError("a value is a number, a text, true, false or null")
    shown = "released" if value is None and name in LEVELS else value
    order = {"do": "operate", "what": name, "value": value, "channel": channel}
    return order, name if shown is None else f"{name} {shown}"


def _answer(given: dict[str, Any]) -> tuple[Order, str]:
    """What somebody enters in a dialog of the program, and presses."""
    number, values = given.get("number"), given.get("set") or {}
    press = _text(given.get("press") or "")
    if type(number) is not int or not isinstance(values, dict):
        raise RefusedError("an answer has number, set and press")
    if len(values) > SYMBOLS_MAX:
        raise RefusedError(f"set: at most {SYMBOLS_MAX} inputs")
    for name, value in values.items():
        if len(name) > TEXT_MAX or not _is_number(value):
            raise RefusedError("set: numbers by the names of inputs")
    shown = [f"{name}={value:g}" for name, value in values.items()]
    order = {"do": "answer", "number": number, "set": values, "press": press}
    return (
        order,
        f"answered the dialog: {', '.join([*shown, press or 'Enter'])}",
    )


def _is_number(value: Any) -> bool:
    """A finite number; a whole one of JSON may be too large to be one."""
    if type(value) not in (int, float):
        return False
    most = sys.float_info.max
    return bool(-most <= value <= most)


def _list(value: Any) -> list[Any]:
    if not isinstance(value, list) or not 1 <= len(value) <= SYMBOLS_MAX:
        raise RefusedError(f"symbols: a list of 1 to {SYMBOLS_MAX}")
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str) or len(value) > TEXT_MAX:
        raise RefusedError(f"a text of at most {TEXT_MAX} characters is needed")
    return value


def _pair(value: Any) -> tuple[str, Any]:
    """``SYMBOL=VALUE``, as on the command line, or the two of them."""
    if isinstance(value, str):
        try:
            return parse_force(_text(value))
        except ValueError as error:
            raise RefusedError(str(error)) from None
    if isinstance(value, list) and len(value) == 2:
        path, wanted = value
        if isinstance(wanted, (bool, str)) or _is_number(wanted):
            return _text(path), wanted
    raise RefusedError("a force is SYMBOL=VALUE")
