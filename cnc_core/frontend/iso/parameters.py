"""Numbered and named parameters.

Offsets and home positions are parameters too and stand nowhere else.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from cnc_core.frontend.base.lexer import TokenStream, fail

NUMBER_MAX = 5602
PROBE = range(5061, 5071)
HOME_1, HOME_2, G92_ACTIVE, G92, SYSTEM, SYSTEMS = (
    5161,
    5181,
    5210,
    5211,
    5220,
    5221,
)
SYSTEM_COUNT, SYSTEM_STEP, ROTATION = 9, 20, 9
READ_ONLY = range(5400, NUMBER_MAX + 1)
REFERENCE = re.compile(r"#\s*(?:<([^<>]*)>|([0-9]+))")
Key = int | str


class Parameters:
    """Values by number or name.

    ``computed``: values of the numbers from 5400 on, None where there is none.
    """

    def __init__(self, computed: Callable[[int], float | None]) -> None:
        self._computed = computed
        self._numbered: dict[int, float] = {SYSTEM: 1.0}
        self._named: dict[str, float] = {}

    def __getitem__(self, number: int) -> float:
        return self._numbered.get(number, 0.0)

    def __setitem__(self, number: int, value: float) -> None:
        self._numbered[number] = value

    def read(self, stream: TokenStream) -> float:
        """Parameters are read by ``Expressions``, which counts their nesting."""
        raise fail(
            900004, "parameter outside an expression", stream.current.offset
        )

    def number(self, value: float, offset: int) -> int:
        """The number of a parameter, checked."""
        if (
            abs(value - round(value)) > 1e-4
            or not 1 <= round(value) <= NUMBER_MAX
        ):
            raise fail(
                900012,
                f"parameter #{value:g}: a whole number 1..{NUMBER_MAX} is expected",
                offset,
            )
        return round(value)

    def value(self, key: Key, offset: int) -> float:
        """A numbered parameter that was never set is 0, a named one an error."""
        if isinstance(key, int):
            computed = self._computed(key) if key in READ_ONLY else None
            return self[key] if computed is None else computed
        if key not in self._named:
            raise fail(908002, f"parameter #<{key}> is not defined", offset)
        return self._named[key]

    def exists(self, key: Key) -> bool:
        return isinstance(key, int) or key in self._named

    def check_assignable(self, key: Key, offset: int) -> None:
        if isinstance(key, int) and (
            key in READ_ONLY or key in PROBE or key == SYSTEM
        ):
            raise fail(
                900003,
                f"assignment to parameter #{key} is not supported",
                offset,
            )
        if isinstance(key, int) and _is_rotation(key):
            raise fail(
                900003,
                f"rotation of a coordinate system (#{key}) is not supported",
                offset,
            )

    def assign(self, key: Key, value: float) -> None:
        if isinstance(key, int):
            self._numbered[key] = value
        else:
            self._named[key] = value

    def substitute(self, text: str, offset: int) -> str:
        """The text with every ``#5`` and ``#<name>`` replaced by its value."""

        def value(found: re.Match[str]) -> str:
            name, number = found.groups()
            key = (
                self.number(float(number), offset)
                if name is None
                else "".join(name.split()).lower()
            )
            return f"{self.value(key, offset):.6f}"

        return REFERENCE.sub(value, text)


def _is_rotation(number: int) -> bool:
    place = number - SYSTEMS
    return (
        0 <= place < SYSTEM_COUNT * SYSTEM_STEP
        and place % SYSTEM_STEP == ROTATION
    )
