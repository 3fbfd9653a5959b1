"""Random expressions of one integer type give what numpy gives."""

from __future__ import annotations

import random

import numpy as np
import pytest

from plc_client.st import build
from plc_client.st.machine.loader import StProgram

TYPES = {
    "SINT": np.int8,
    "INT": np.int16,
    "DINT": np.int32,
    "LINT": np.int64,
    "USINT": np.uint8,
    "UINT": np.uint16,
    "UDINT": np.uint32,
    "ULINT": np.uint64,
}
EXPRESSIONS = 40
NAMES = "abcd"


class _Random:
    """Pairs of ST text and numpy's value."""

    def __init__(self, kind: type, seed: int) -> None:
        self._rng = random.Random(seed)
        self._kind = kind
        limits = np.iinfo(kind)
        low, high = int(limits.min), int(limits.max)
        self.values = {n: kind(self._rng.randint(low, high)) for n in NAMES}

    def expression(self, depth: int) -> tuple[str, np.generic]:
        """A tree of operators."""
        rng = self._rng
        if depth == 0 or rng.random() < 0.15:
            name = rng.choice(NAMES)
            return name, self.values[name]
        left, a = self.expression(depth - 1)
        right, b = self.expression(depth - 1)
        sign = rng.choice(["+", "-", "*", "AND", "OR", "XOR", "/", "MOD"])
        if sign in ("/", "MOD") and int(b) in (0, -1):
            sign = "+"
        return f"({left} {sign} {right})", self._computed(sign, a, b)

    def _computed(self, sign: str, a: np.generic, b: np.generic) -> np.generic:
        x, y = int(a), int(b)
        results = {
            "+": lambda: x + y,
            "-": lambda: x - y,
            "*": lambda: x * y,
            "AND": lambda: x & y,
            "OR": lambda: x | y,
            "XOR": lambda: x ^ y,
            "/": lambda: _quotient(x, y),
            "MOD": lambda: x - _quotient(x, y) * y,
        }
        whole = np.array([results[sign]()], dtype=object)
        bits = np.iinfo(self._kind).bits
        unsigned = np.array([int(whole[0]) % (1 << bits)], dtype=np.uint64)
        return unsigned.astype(self._kind)[0]


def _quotient(x: int, y: int) -> int:
    found = abs(x) // abs(y)
    return found if (x < 0) == (y < 0) else -found


@pytest.mark.parametrize("name", list(TYPES))
def test_random_expressions_wrap_as_numpy_does(name: str) -> None:
    """Forty trees of operators of each type, seeded."""
    source = _Random(TYPES[name], seed=len(name) * 7 + ord(name[0]))
    pairs = [source.expression(4) for _ in range(EXPRESSIONS)]
    values = "; ".join(f"{n} : {name}" for n in NAMES)
    lines = "\n".join(f"r[{k}] := {t};" for k, (t, _) in enumerate(pairs))
    text = (
        f"PROGRAM MAIN VAR {values}; r : ARRAY [0..{EXPRESSIONS - 1}]"
        f" OF {name}; END_VAR\n{lines}\nEND_PROGRAM\n"
    )
    program = StProgram(build({"random.st": text}))
    program.start()
    for variable, value in source.values.items():
        setattr(program["MAIN"], variable, int(value))
    program.run(program.entry("MAIN"), 0)
    for k, (expression, value) in enumerate(pairs):
        assert program["MAIN"].r[k] == int(value), expression
