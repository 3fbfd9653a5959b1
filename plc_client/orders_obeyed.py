"""Orders of other processes that a PLC obeys between two scans."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hli.symbol import Symbol, SymbolError

from . import listing
from .online import (
    UNFIT,
    Forces,
    SymbolTable,
    check,
    check_kind,
    force_warnings,
)


class Online:
    """Obeys the orders of other processes (``hli.orders``): ``force``,
    ``unforce``, ``read``, ``list``, ``operate``, ``statistics``, ``symbols``,
    ``fetch``, ``assign``, ``halt``.

    ``operate``: what the operator's panel of a channel does; ``statistics``: what the PLC
    has measured; ``symbols``, ``fetch``, ``assign``: ``plc_client.listing``;
    ``halt``: scans go on without the tasks' logic, or with it again.
    """

    def __init__(
        self,
        table: SymbolTable,
        forces: Forces,
        operate: Callable[[str, Any, Any], dict[str, Any]] | None = None,
        statistics: Callable[[], dict[str, Any]] = dict,
        halt: Callable[[bool], bool] = bool,
    ) -> None:
        self._halt = halt
        self._table = table
        self._forces = forces
        self._operate = operate
        self._statistics = statistics

    def __call__(self, order: dict[str, Any]) -> dict[str, Any]:
        """The answer: always ``forced``, for ``read`` also ``values``, for
        ``force`` also ``warnings`` where there are some.  Raises what makes an
        order impossible.
        """
        what = order.get("do")
        answer: dict[str, Any] = {}
        if what == "force":
            warned = self._force(
                [(str(path), value) for path, value in order["symbols"]]
            )
            answer |= {"warnings": warned} if warned else {}
        elif what == "unforce":
            self._unforce([str(path) for path in order["symbols"]])
        elif what == "read":
            answer["values"] = {
                path: self._read(str(path)) for path in order["symbols"]
            }
        elif what == "symbols":
            answer |= listing.described(self._table.programs)
        elif what == "fetch":
            answer["values"] = [
                listing.plain(path, self._symbol(str(path)).value)
                for path in order["symbols"]
            ]
        elif what == "assign":
            self._assign(order["symbols"])
        elif what == "halt":
            answer["halted"] = self._halt(bool(order["value"]))
        elif what == "operate" and self._operate is not None:
            key, value = str(order["what"]), order.get("value")
            channel = order.get("channel", 0)
            answer["panel"] = self._operate(key, value, channel)
        elif what == "statistics":
            answer |= self._statistics()
        elif what != "list":
            known = (
                "force, unforce, read, list, operate, statistics,"
                " symbols, fetch, assign, halt"
            )
            raise ValueError(f"order {what!r} is unknown: {known}")
        return {**answer, "forced": dict(self._forces.items())}

    def _symbol(self, path: str) -> Symbol:
        symbol = self._table[path]
        check(symbol)
        return symbol

    def _force(self, given: list[tuple[str, Any]]) -> list[str]:
        """All of them, or none if one cannot be.  Returns warnings."""
        before = dict(self._forces._forced)
        symbols = [(path, self._symbol(path), value) for path, value in given]
        for path, symbol, value in symbols:
            check_kind(path, symbol, value)
        for path, symbol, value in symbols:
            try:
                self._forces.force(symbol.path, symbol, value)
            except UNFIT as error:
                self._forces._forced = before
                self._forces.any = bool(before)
                raise SymbolError(f"force {path}={value!r}: {error}") from None
        return [
            text
            for _, symbol, _ in symbols
            for text in force_warnings(symbol.path)
        ]

    def _assign(self, given: list[tuple[str, Any]]) -> None:
        """In this order; none is set if one is unknown or has the wrong kind."""
        symbols = [(path, self._symbol(str(path)), v) for path, v in given]
        for path, symbol, value in symbols:
            if not isinstance(value, list):
                check_kind(path, symbol, value)
        for path, symbol, value in symbols:
            try:
                listing.assign(symbol, value)
            except UNFIT as error:
                raise SymbolError(f"assign {path}: {error}") from None

    def _unforce(self, paths: list[str]) -> None:
        """These, or all without one."""
        if not paths:
            self._forces.unforce()
        self._forces.let_go([(path, self._symbol(path).path) for path in paths])

    def _read(self, path: str) -> Any:
        value = self._symbol(path).value
        if isinstance(value, np.generic):
            value = value.item()
        if value is None or isinstance(value, (bool, int, float, str)):
            return value
        raise SymbolError(
            f"symbol {path!r}: only single values can be read; name a member"
        )
