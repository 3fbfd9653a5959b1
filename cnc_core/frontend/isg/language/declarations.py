"""The lines between #VAR and #ENDVAR."""

from __future__ import annotations

from collections.abc import Callable

from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import (
    Kind,
    TokenStream,
    digits,
    fail,
    shown,
)
from cnc_core.frontend.base.variables import (
    REAL64,
    TEXT_MAX,
    DataType,
    Variable,
    check_dimensions,
    text_type,
)

from ..state.store import TYPES, Store
from .formulas import OWN, Formulas

Run = Callable[[], None]


class DeclarationParser:
    """Compiles ``V.L.A : REAL64 = 5``, ``P10[3] = [1, 2, 3]``.

    The type is REAL64 or follows from the value.
    """

    def __init__(
        self, stream: TokenStream, formulas: Formulas, store: Store
    ) -> None:
        self._stream, self._formulas, self._store = stream, formulas, store

    def parse(self) -> list[Run]:
        """The declarations of one line."""
        found = []
        while not self._stream.at_end:
            found.append(self._one())
            self._stream.accept(",")
        return found

    def _one(self) -> Run:
        stream, token = self._stream, self._stream.next()
        family, name = self._name(token.text, token.kind, token.offset)
        title, offset, sizes = (
            f"V.{family}.{name}" if family else f"P{name}",
            token.offset,
            [],
        )
        while stream.is_op("["):
            sizes += self._formulas.arguments()
        kind = self._type() if stream.accept(":") else None
        values = self._values(bool(sizes)) if stream.accept("=") else []

        def run() -> None:
            dimensions = check_dimensions(
                title, [size() for size in sizes], offset
            )
            given = [value() for value in values]
            text = bool(given) and isinstance(given[0], str)
            variable = Variable(
                title,
                kind or (text_type(TEXT_MAX) if text else REAL64),
                dimensions,
            )
            variable.fill(given, offset)
            self._store.declare(family, name, variable, offset)

        return run

    def _name(self, text: str, kind: Kind, offset: int) -> tuple[str, str]:
        """Family and name; the family of a P parameter is empty."""
        parts = text.upper().split(".")
        if kind is Kind.VARIABLE and parts[1] in OWN and len(parts) > 2:
            return parts[1], ".".join(parts[2:])
        number = self._stream.current
        if kind is Kind.NAME and text.upper() == "P" and digits(number.text):
            self._stream.next()
            if int(number.text) == 0:
                raise fail(20400, "P0 is not allowed", offset)
            return "", str(int(number.text))
        raise fail(
            900010, f"#VAR: expected a variable, found {shown(text)}", offset
        )

    def _type(self) -> DataType:
        stream, token = self._stream, self._stream.next()
        digits = (
            stream.next().text if stream.current.kind is Kind.NUMBER else ""
        )
        name = (token.text + digits).upper()
        if name in TYPES:
            return TYPES[name]
        if name != "STRING":
            raise fail(900010, f"#VAR: unknown type {name}", token.offset)
        length = TEXT_MAX
        if stream.is_op("["):
            sizes = self._formulas.arguments()
            value = sizes[0]()
            if (
                len(sizes) != 1
                or isinstance(value, str)
                or not 0 <= value <= TEXT_MAX
            ):
                raise fail(
                    900012,
                    f"STRING[n]: n out of range 0..{TEXT_MAX}",
                    token.offset,
                )
            length = int(value)
        return text_type(length)

    def _values(self, array: bool) -> list[Formula]:
        if array and self._stream.is_op("["):
            return self._formulas.arguments()
        return [self._formulas.expression()]
