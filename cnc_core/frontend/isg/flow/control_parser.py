"""Control statements compiled: their operands, then the run that ``Control``
makes of them.
"""

from __future__ import annotations

from collections.abc import Callable

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.flow import Mark
from cnc_core.frontend.base.formula import number_of
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.base.variables import Value

from ..language.formulas import Formulas
from .control import Control, Run

TRUE_FROM = 0.5  # $IF, $WHILE, $UNTIL


def parse(
    control: Control, stream: TokenStream, formulas: Formulas, mark: Mark
) -> Run:
    """The statement at the stream, which stands behind ``$``.

    ``mark``: the place where its block begins.
    """
    token = stream.current
    word = token.text.upper() if token.kind is Kind.NAME else ""
    if word not in _STATEMENTS:
        name = f"${word}" if word else f"$ and {stream.describe()}"
        raise fail(900002, f"unknown control statement {name}", token.offset)
    stream.next()
    parser = _Parser(control, stream, formulas, mark, token.offset)
    run = _STATEMENTS[word](parser)
    if not stream.at_end:
        raise fail(
            900010,
            f"unexpected {stream.current.text!r} behind ${word}",
            stream.current.offset,
        )
    return run


def parse_old(
    control: Control, stream: TokenStream, formulas: Formulas, mark: Mark
) -> Run:
    """#IF, #ELSE, #ENDIF; the stream stands at the word."""
    token = stream.next()
    word, offset = token.text.upper(), token.offset
    if word == "IF":
        run = control.if_(_truth(formulas, offset), mark, offset, "#IF")
    else:
        run = (
            control.else_("#IF", offset)
            if word == "ELSE"
            else control.endif("#IF", offset)
        )
    if not stream.at_end:
        raise fail(
            900010,
            f"unexpected {stream.current.text!r} behind #{word}",
            stream.current.offset,
        )
    return run


def _truth(formulas: Formulas, offset: int) -> Callable[[], bool]:
    value = formulas.expression()

    def test() -> bool:
        found = value()
        if isinstance(found, str):
            raise fail(907011, f"condition: {ERRORS[907011]}", offset)
        return abs(found) >= TRUE_FROM

    return test


class _Parser:
    """One statement: its operands, then the run that ``Control`` makes of them."""

    def __init__(
        self,
        control: Control,
        stream: TokenStream,
        formulas: Formulas,
        mark: Mark,
        offset: int,
    ) -> None:
        self._control, self._stream, self._formulas = control, stream, formulas
        self._mark, self._offset = mark, offset

    def _test(self) -> Callable[[], bool]:
        return _truth(self._formulas, self._offset)

    def _if(self) -> Run:
        test = self._test()
        if not self._stream.is_op("$"):
            return self._control.if_(test, self._mark, self._offset)
        self._stream.next()
        if not self._stream.accept_name("GOTO"):
            raise fail(
                900010,
                "only $GOTO may follow a condition",
                self._stream.current.offset,
            )
        return self._goto(test)

    def _elseif(self) -> Run:
        return self._control.elseif(self._test(), self._offset)

    def _else(self) -> Run:
        return self._control.else_("IF", self._offset)

    def _endif(self) -> Run:
        return self._control.endif("IF", self._offset)

    def _switch(self) -> Run:
        """``$SWITCH e`` or ``$SWITCH P1=e``, which assigns first."""
        stream, formulas = self._stream, self._formulas
        if not formulas.is_variable():
            return self._control.switch(
                formulas.expression(), self._mark, self._offset
            )
        start = stream.place
        target = formulas.reference()
        if not stream.accept("="):
            stream.go_to(start)
            return self._control.switch(
                formulas.expression(), self._mark, self._offset
            )
        value, store = formulas.expression(), target.store
        assert store is not None

        def assigned() -> Value:
            found = value()
            store(found)
            return found

        return self._control.switch(assigned, self._mark, self._offset)

    def _case(self) -> Run:
        return self._control.case(self._formulas.expression(), self._offset)

    def _default(self) -> Run:
        return self._control.default(self._offset)

    def _endswitch(self) -> Run:
        return self._control.endswitch(self._offset)

    def _for(self) -> Run:
        stream, formulas = self._stream, self._formulas
        if not formulas.is_variable():
            raise fail(
                900010,
                f"$FOR: expected a variable, found {stream.describe()}",
                stream.current.offset,
            )
        target = formulas.reference()
        stream.expect("=", 900010)
        bounds = [formulas.number("$FOR", self._offset)]
        while stream.accept(","):
            bounds.append(formulas.number("$FOR", self._offset))
        if len(bounds) == 2:
            bounds.append(lambda: 1.0)
        if len(bounds) != 3:
            raise fail(
                900010,
                "$FOR takes a first value, a last value and a step",
                self._offset,
            )
        assert target.store is not None
        return self._control.for_(
            target.load, target.store, bounds, self._mark, self._offset
        )

    def _while(self) -> Run:
        return self._control.while_(self._test(), self._mark, self._offset)

    def _do(self) -> Run:
        return self._control.loop("DO", self._mark, self._offset)

    def _repeat(self) -> Run:
        return self._control.loop("REPEAT", self._mark, self._offset)

    def _endfor(self) -> Run:
        return self._control.endloop("FOR", "$ENDFOR", self._offset)

    def _endwhile(self) -> Run:
        return self._control.endloop("WHILE", "$ENDWHILE", self._offset)

    def _enddo(self) -> Run:
        return self._control.endloop("DO", "$ENDDO", self._offset)

    def _until(self) -> Run:
        return self._control.until(self._test(), self._offset)

    def _break(self) -> Run:
        return self._control.break_(self._offset)

    def _continue(self) -> Run:
        return self._control.continue_(self._offset)

    def _goto(self, test: Callable[[], bool] | None = None) -> Run:
        stream, offset = self._stream, self._stream.current.offset
        if stream.is_op("["):
            end = stream.text.find("]", offset)
            if end < 0:
                raise fail(900013, "bracket is not closed", offset)
            label = stream.text[offset + 1 : end].strip().upper()
            stream.skip_to(end + 1)
            return self._control.goto(None, label, test, offset)
        if stream.current.kind is Kind.NAME and stream.current.text[0] in "nN":
            stream.take_letters(1)
            number = number_of(self._formulas.expression(), "N", offset)
            stream.accept(":")
            return self._control.goto(number, "", test, offset)
        raise fail(
            900010,
            f"$GOTO: expected N or [label], found {stream.describe()}",
            offset,
        )


_STATEMENTS: dict[str, Callable[[_Parser], Run]] = {
    "IF": _Parser._if,
    "ELSEIF": _Parser._elseif,
    "IFELSE": _Parser._elseif,
    "ELSE": _Parser._else,
    "ENDIF": _Parser._endif,
    "SWITCH": _Parser._switch,
    "CASE": _Parser._case,
    "DEFAULT": _Parser._default,
    "ENDSWITCH": _Parser._endswitch,
    "FOR": _Parser._for,
    "WHILE": _Parser._while,
    "DO": _Parser._do,
    "REPEAT": _Parser._repeat,
    "ENDFOR": _Parser._endfor,
    "ENDWHILE": _Parser._endwhile,
    "ENDDO": _Parser._enddo,
    "UNTIL": _Parser._until,
    "BREAK": _Parser._break,
    "CONTINUE": _Parser._continue,
    "GOTO": _Parser._goto,
}
