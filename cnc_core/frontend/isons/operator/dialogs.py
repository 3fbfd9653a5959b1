"""The LIB_ instructions: messages and forms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.base.scanner import Row
from cnc_core.frontend.port import Wait

from ..base.text import word_or_text
from ..language.formulas import Formulas
from .forms import BUTTON, FORM, INPUT, LABEL, Forms, printed

Run = Callable[[], Sequence[Row | Wait]]
KINDS = {"FORM": FORM, "LABEL": LABEL, "BUTTON": BUTTON, "INPUT": INPUT}


class Dialogs:
    """Compiles one LIB_ instruction behind its name."""

    def __init__(
        self,
        forms: Forms,
        stream: TokenStream,
        formulas: Formulas,
        start: int,
    ) -> None:
        self._forms, self._stream = forms, stream
        self._formulas, self._start = formulas, start

    def parse(self, name: str) -> Run | None:
        """What it does; None if there is no such instruction."""
        make = self._whole(name) or self._of_kind(name)
        return make() if make else None

    def _whole(self, name: str) -> Callable[[], Run] | None:
        forms = self._forms
        table: dict[str, Callable[[], Run]] = {
            "LIB_MESSAGE": self._message,
            "LIB_SHOWFORM": lambda: self._simple(
                lambda: forms.show(self._start)
            ),
            "LIB_CLOSEFORM": lambda: self._simple(forms.close),
            "LIB_INPUTSETVALUE": self._value,
        }
        return table.get(name)

    def _of_kind(self, name: str) -> Callable[[], Run] | None:
        """LIB_ADDLABEL, LIB_LABELPROP, LIB_LABELTEXT ..."""
        word = name.removeprefix("LIB_")
        added = (
            KINDS.get(word.removeprefix("ADD"))
            if word.startswith("ADD")
            else None
        )
        if added and added != FORM:
            return lambda: self._add(added)
        for ending, make in (
            ("PROP", self._property),
            ("TEXT", self._text),
            ("PRINT", self._print),
        ):
            if name in KNOWN and word.endswith(ending):
                return partial(make, KINDS[word.removesuffix(ending)])
        return None

    def _simple(self, act: Callable[[], None]) -> Run:
        def run() -> Sequence[Row | Wait]:
            act()
            return ()

        return run

    def _comma(self) -> None:
        self._stream.accept(",")

    def _text_word(self, what: str) -> str:
        self._comma()
        return word_or_text(self._stream, what)

    def _name(self, kind: str) -> str:
        return "" if kind == FORM else self._text_word("a name")

    def _message(self) -> Run:
        text = self._text_word("a text").replace("\\N", "\n")
        caption = self._text_word("a caption")
        self._comma()
        button = self._formulas.argument("button")
        self._comma()
        icon = self._formulas.argument("icon")
        return self._simple(
            lambda: self._forms.message(
                text, caption, button(), icon(), self._start
            )
        )

    def _add(self, kind: str) -> Run:
        name = self._text_word("a name")
        return self._simple(lambda: self._forms.add(kind, name, self._start))

    def _text(self, kind: str) -> Run:
        name = self._name(kind)
        text = self._text_word("a text").replace("\\N", "\n")
        return self._simple(
            lambda: self._forms.print_text(kind, name, text, self._start)
        )

    def _print(self, kind: str) -> Run:
        name, form = self._name(kind), self._text_word("a format")
        printed(form, 0.0, self._start)
        self._comma()
        value = self._formulas.argument("value")
        return self._simple(
            lambda: self._forms.print_text(
                kind, name, printed(form, value(), self._start), self._start
            )
        )

    def _value(self) -> Run:
        name = self._text_word("a name")
        self._comma()
        value = self._formulas.argument("value")
        return self._simple(
            lambda: setattr(
                self._forms.item(INPUT, name, self._start), "value", value()
            )
        )

    def _whole_source(self, value: Callable[[], float], offset: int) -> None:
        """SOURCE copies a variable or an integer constant."""
        if value() != round(value()):
            raise fail(
                909151,
                "SOURCE: a variable or a whole number is expected, "
                f"not {value():g}",
                offset,
            )

    def _property(self, kind: str) -> Run:
        name = self._name(kind)
        key, known = self._forms.property(
            kind, self._text_word("a property"), self._start
        )
        self._comma()
        if key == "DEST":
            if self._stream.current.kind is not Kind.VARIABLE:
                raise fail(
                    909151,
                    "DEST: a variable is expected",
                    self._stream.current.offset,
                )
            target = self._formulas.target()
            return self._simple(
                lambda: setattr(
                    self._forms.item(kind, name, self._start), "dest", target
                )
            )
        start = self._stream.current
        value = self._formulas.argument(key)
        if key == "SOURCE" and (
            start.kind is Kind.NUMBER or start.text in ("+", "-")
        ):
            self._whole_source(value, start.offset)
        if known.variable:
            return self._simple(
                lambda: setattr(
                    self._forms.item(kind, name, self._start), "source", value
                )
            )
        return self._simple(
            lambda: self._forms.set_property(
                kind, name, key, value(), self._start
            )
        )


KNOWN = frozenset(
    f"LIB_{kind}{ending}"
    for kind, endings in {
        "FORM": ("PROP", "TEXT"),
        "LABEL": ("PROP", "TEXT", "PRINT"),
        "BUTTON": ("PROP", "TEXT", "PRINT"),
        "INPUT": ("PROP",),
    }.items()
    for ending in endings
)
# every instruction, for guesses
WORDS = KNOWN | {
    "LIB_MESSAGE",
    "LIB_SHOWFORM",
    "LIB_CLOSEFORM",
    "LIB_INPUTSETVALUE",
    "LIB_ADDLABEL",
    "LIB_ADDBUTTON",
    "LIB_ADDINPUT",
}
