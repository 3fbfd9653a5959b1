"""Operator dialogs (NsForms): one form at a time, its objects and properties,
what the operator does with it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from decimal import ROUND_DOWN, Decimal

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.guess import guess
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.operator import Answer, Question
from cnc_core.frontend.port import ChannelPort

from .colours import COLOURS

FORM, LABEL, BUTTON, INPUT = "form", "label", "button", "input"
NAME = re.compile(r"[A-Za-z0-9_]+")
FORMAT = re.compile(r"I|F([0-9]{1,2})", re.I)
HUGE = 1.79769313486232e308
MESSAGE_BUTTONS = (("OK",), ("YES", "NO"))
MESSAGE_RESULTS = {"OK": 0.0, "YES": 1.0, "NO": 2.0}
ICONS = 5


@dataclass(frozen=True)
class Property:
    """Kinds of objects that have it, and its range; ``variable``: it names
    variables, not values.
    """

    kinds: tuple[str, ...]
    low: float = -HUGE
    high: float = HUGE
    variable: bool = False


_ALL = (FORM, LABEL, BUTTON, INPUT)
_SHOWN = (LABEL, BUTTON, INPUT)
PROPERTIES: dict[str, Property] = {
    "VISIBLE": Property(_ALL),
    "ENABLED": Property(_SHOWN),
    "WIDTH": Property(_ALL, 1),
    "HEIGHT": Property((FORM, LABEL, BUTTON), 1),
    "LEFT": Property(_ALL, 0),
    "TOP": Property(_ALL, 0),
    "BACKCOLOR": Property(_ALL, 0, len(COLOURS) - 1),
    "FORECOLOR": Property(_SHOWN, 0, len(COLOURS) - 1),
    "DIMFONT": Property(_SHOWN, 6, 100),
    "STARTPOSITION": Property((FORM,)),
    "WINDOWSTATE": Property((FORM,)),
    "AUTOSIZE": Property((LABEL,)),
    "STYLE": Property((LABEL, BUTTON), 0, 3),
    "ALIGN": Property(_SHOWN, 0, 8),
    "BORDER": Property((LABEL,), 0, 2),
    "DEST": Property((BUTTON, INPUT), variable=True),
    "SOURCE": Property((BUTTON,), variable=True),
    "CLOSEFORM": Property((BUTTON,)),
    "MIN": Property((INPUT,)),
    "MAX": Property((INPUT,)),
    "INCREMENT": Property((INPUT,)),
    "NDECIMAL": Property((INPUT,), 0, 15),
    "AUTOSET": Property((INPUT,)),
}
SPELLINGS = {"BACKCLOR": "BACKCOLOR"}
COLOUR_NAMES = ("BACKCOLOR", "FORECOLOR")
INPUT_ALIGN_MAX = 2


@dataclass
class Item:
    """A form or an object of it.

    ``dest``: the variable it writes; ``source``: what a button copies there.
    """

    kind: str
    text: str = ""
    values: dict[str, float] = field(default_factory=dict)
    value: float = 0.0
    dest: Callable[[float], None] | None = None
    source: Callable[[], float] | None = None

    @property
    def number(self) -> str:
        """The value of an input with its decimals (NDECIMAL)."""
        places = self.values.get("NDECIMAL")
        return (
            f"{self.value:g}"
            if places is None
            else f"{self.value:.{int(places)}f}"
        )

    @property
    def usable(self) -> bool:
        """The operator can reach it: visible, and not disabled (the guide
        inverts ENABLED).
        """
        return (
            self.values.get("VISIBLE", 1.0) > 0
            and self.values.get("ENABLED", 0.0) <= 0
        )


def printed(form: str, value: float, offset: int) -> str:
    """A value by the format I or Fn; decimals beyond are cut off."""
    found = FORMAT.fullmatch(form)
    if not found:
        raise fail(
            909151,
            f"format {form!r}: I or F with a number of decimals is expected",
            offset,
        )
    places = int(found[1] or 0)
    return f"{Decimal(repr(value)).quantize(Decimal(1).scaleb(-places), rounding=ROUND_DOWN):f}"


class Forms:
    """The form being built or shown, and messages.

    ``result``: of the last LIB_MESSAGE ($_X13).
    """

    def __init__(self, port: ChannelPort) -> None:
        self._port = port
        self.result = 0.0
        self.shown = False
        self._form, self._items = Item(FORM), {}  # type: Item, dict[str, Item]

    # building

    def add(self, kind: str, name: str, offset: int) -> None:
        """LIB_ADDLABEL, LIB_ADDBUTTON, LIB_ADDINPUT."""
        if not NAME.fullmatch(name):
            raise fail(
                909150, f"{name!r}: names have letters and digits", offset
            )
        if name.upper() in self._items:
            raise fail(909150, f"the form has an object {name} already", offset)
        self._items[name.upper()] = Item(kind, name)

    def item(self, kind: str, name: str, offset: int) -> Item:
        if kind == FORM:
            return self._form
        found = self._items.get(name.upper())
        if found is None or found.kind != kind:
            raise fail(909150, f"the form has no {kind} {name}", offset)
        return found

    def property(
        self, kind: str, name: str, offset: int
    ) -> tuple[str, Property]:
        """A property by its name, for one kind of object."""
        key = SPELLINGS.get(name.upper(), name.upper())
        known = PROPERTIES.get(key)
        if known is None or kind not in known.kinds:
            raise fail(
                909150,
                f"{'an' if kind == INPUT else 'a'} {kind} has no property {name}"
                + guess(
                    name, (k for k, p in PROPERTIES.items() if kind in p.kinds)
                ),
                offset,
            )
        return key, known

    def set_property(
        self, kind: str, name: str, key: str, value: float, offset: int
    ) -> None:
        """LIB_FORMPROP, LIB_LABELPROP ..."""
        known = PROPERTIES[key]
        high = (
            INPUT_ALIGN_MAX if key == "ALIGN" and kind == INPUT else known.high
        )
        if not known.low <= value <= high:
            raise fail(
                909151,
                f"{key} {value:g} is not in {known.low:g}..{high:g}",
                offset,
            )
        if key in COLOUR_NAMES and value != int(value):
            raise fail(
                909151, f"{key} {value:g} is no number of a colour", offset
            )
        self.item(kind, name, offset).values[key] = value

    def print_text(self, kind: str, name: str, text: str, offset: int) -> None:
        """LIB_LABELTEXT, LIB_LABELPRINT ..."""
        self.item(kind, name, offset).text = text
        if self.shown:
            self._port.message(f"FORM {kind} {name}: {text}")

    # the operator

    def message(
        self, text: str, caption: str, button: float, icon: float, offset: int
    ) -> None:
        """LIB_MESSAGE: waits for the operator."""
        if button not in (0, 1) or icon not in range(ICONS):
            raise fail(
                909151,
                "LIB_MESSAGE: button 0 or 1 and icon 0..4 are expected",
                offset,
            )
        choices = MESSAGE_BUTTONS[int(button)]
        self._port.message(f"LIB_MESSAGE {caption}: {text}")
        answer = self._ask(Question(caption, text, choices), offset)
        pressed = answer.press.upper() or choices[0]
        if pressed not in choices:
            raise fail(
                909152,
                f"LIB_MESSAGE: the answer {answer.press!r} is none of {', '.join(choices)}",
                offset,
            )
        self.result = MESSAGE_RESULTS[pressed]

    def show(self, offset: int) -> None:
        """LIB_SHOWFORM."""
        for name, item in self._items.items():
            low = item.values.get("MIN", -HUGE)
            high = item.values.get("MAX", HUGE)
            if low > high:
                raise fail(
                    909151,
                    f"input {name}: MIN {low:g} is over MAX {high:g}",
                    offset,
                )
        self.shown = True
        self._port.message(self.described())
        self.poll(offset)

    def poll(self, offset: int) -> None:
        """Ask the operator, if the form is shown and has something to operate."""
        if not self.shown:
            return
        usable = {
            name: item for name, item in self._items.items() if item.usable
        }
        buttons = tuple(
            name for name, item in usable.items() if item.kind == BUTTON
        )
        inputs = {
            name: item.value
            for name, item in usable.items()
            if item.kind == INPUT
        }
        if not (buttons or inputs):
            return
        answer = self._ask(
            Question(self._form.text, self.described(), buttons, inputs), offset
        )
        for name, value in answer.values.items():
            self._enter(name, value, offset)
        if answer.press or (
            buttons and not self._port.answers and not answer.given
        ):
            self._press(answer.press or self._closing(buttons), offset)

    def _closing(self, buttons: tuple[str, ...]) -> str:
        """The button that is taken as pressed where nobody sits: one that
        closes the form.
        """
        closing = [
            name
            for name in buttons
            if self._items[name].values.get("CLOSEFORM", 0.0) > 0
        ]
        return (closing or list(buttons))[0]

    def _ask(self, question: Question, offset: int) -> Answer:
        answer = self._port.ask(question)
        if answer is None:
            text = (
                f"{question.title or 'form'}: {ERRORS[909152]}; answers "
                "come from a terminal, from --answers or from --monitor"
            )
            raise fail(909152, text, offset)
        return answer

    def _enter(self, name: str, value: float, offset: int) -> None:
        item = self._items.get(name.upper())
        if item is None or item.kind != INPUT or not item.usable:
            raise fail(
                909152, f"the form has no input {name} that can be used", offset
            )
        low = item.values.get("MIN", -HUGE)
        high = item.values.get("MAX", HUGE)
        item.value = max(min(value, high), low)
        if item.value != value:
            bound = (
                f"over MAX {high:g}" if value > high else f"below MIN {low:g}"
            )
            self._port.message(
                f"FORM input {name}: {value:g} is {bound}, taken is {item.value:g}"
            )
        if item.dest is not None:
            item.dest(item.value)

    def _press(self, name: str, offset: int) -> None:
        item = self._items.get(name.upper())
        if item is None or item.kind != BUTTON or not item.usable:
            raise fail(
                909152,
                f"the form has no button {name} that can be used",
                offset,
            )
        if item.dest is not None:
            item.dest(1.0 if item.source is None else item.source())
        if item.values.get("CLOSEFORM", 0.0) > 0:
            self.close()

    def close(self) -> None:
        """LIB_CLOSEFORM, a closing button, the program's end."""
        if self.shown:
            self._port.message(f"FORM {self._form.text} closed")
        self.shown = False
        self._form, self._items = Item(FORM), {}

    def described(self) -> str:
        """The form as text, one object a line."""
        lines = [f"FORM {self._form.text}{_properties(self._form)}"]
        for name, item in self._items.items():
            if item.values.get("VISIBLE", 1.0) > 0:
                shown = item.number if item.kind == INPUT else item.text
                lines.append(
                    f"  {item.kind} {name}: {shown}{_properties(item)}"
                )
        return "\n".join(lines)


def _properties(item: Item) -> str:
    found = []
    for key, value in item.values.items():
        found.append(
            f"{key} {COLOURS[int(value)] if key in COLOUR_NAMES else format(value, 'g')}"
        )
    return f" ({', '.join(found)})" if found else ""
