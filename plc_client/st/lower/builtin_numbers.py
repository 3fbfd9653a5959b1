"""Standard functions of numbers and bits."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

from ..errors import TYPE, Position, StopHere, refuse
from ..model import types
from ..syntax import tree
from . import convert, operators
from .builtin_arguments import Rule, count
from .context import Context
from .conversions import truncated
from .value import Value, constant

_FUNCTIONS = {
    "SQRT": "st_sqrt",
    "LN": "log",
    "LOG": "log10",
    "EXP": "exp",
    "SIN": "sin",
    "COS": "cos",
    "TAN": "tan",
    "ASIN": "asin",
    "ACOS": "acos",
    "ATAN": "atan",
}
_OPERATORS = {
    "ADD": "+",
    "SUB": "-",
    "MUL": "*",
    "DIV": "/",
    "MOD": "MOD",
    "GT": ">",
    "GE": ">=",
    "EQ": "=",
    "LE": "<=",
    "LT": "<",
    "NE": "<>",
    "AND": "AND",
    "OR": "OR",
    "XOR": "XOR",
    "EXPT": "**",
}
_CHAINS = frozenset({"GT", "GE", "EQ", "LE", "LT"})
_MANY = frozenset({"ADD", "MUL", "AND", "OR", "XOR"}) | _CHAINS


def _real(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    count(nodes, 1, 1, name, pos)
    value = real_value(context, nodes[0], name)
    base = value.base
    assert isinstance(base, types.Elementary)
    text = f"(({base.c}){_FUNCTIONS[name]}({value.text}))"
    found = value.with_text(text)
    found.weak = False
    return found


def real_value(context: Context, node: tree.Node, name: str) -> Value:
    """A number as REAL or LREAL."""
    value = context.value(node)
    base = value.base
    if not isinstance(base, types.Elementary) or base.family not in (
        "real",
        "int",
        "bit",
    ):
        text = f"{name} needs a number, not {value.type}"
        raise StopHere(TYPE, text, node.pos)
    if base.family != "real":
        goal = types.REAL if base.bits <= 16 and not value.weak else types.LREAL
        return convert.cast(value, goal)
    return value


def _two_reals(
    context: Context,
    nodes: list[tree.Node],
    pos: Position,
    *,
    name: str,
    function: str,
) -> Value:
    count(nodes, 2, 2, name, pos)
    left = real_value(context, nodes[0], name)
    right = real_value(context, nodes[1], name)
    both = types.REAL in (left.base, right.base)
    goal = (
        types.REAL
        if both
        and types.LREAL
        not in (
            left.base,
            right.base,
        )
        else types.LREAL
    )
    text = f"(({goal.c}){function}({left.text}, {right.text}))"
    return Value(goal, text, calls=left.calls or right.calls, bits=goal.bits)


def _abs(context: Context, nodes: list[tree.Node], pos: Position) -> Value:
    count(nodes, 1, 1, "ABS", pos)
    value = context.value(nodes[0])
    base = value.base
    if not isinstance(base, types.Elementary) or base.family not in (
        "int",
        "bit",
        "real",
    ):
        raise StopHere(TYPE, f"ABS needs a number, not {value.type}", pos)
    if value.constant is not None:
        number = abs(value.constant)
        if base.whole and not value.weak:
            number = base.wrap(number)  # as of a variable: the lowest one stays
        return constant(base, number, value.weak)
    if base.family == "real":
        return value.with_text(f"(({base.c})fabs({value.text}))")
    if not base.signed:
        return value
    return value.with_text(f"(({base.c})st_abs({value.text}))")


def _operator(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    count(nodes, 2, 2 if name not in _MANY else 10_000, name, pos)
    values = [context.value(node) for node in nodes]
    if name in _CHAINS and len(values) > 2:
        return _chain(context, values, pos, name)
    found = values[0]
    for value in values[1:]:
        found = operators.binary(context, _OPERATORS[name], found, value, pos)
    return found


def _chain(
    context: Context, values: list[Value], pos: Position, name: str
) -> Value:
    """``GT(a, b, c)`` is ``a > b AND b > c``."""
    if any(value.calls for value in values[1:-1]):
        raise refuse(f"a call inside of {name}", pos, "use a variable")
    sign = _OPERATORS[name]
    pairs = pairwise(values)
    parts = [operators.binary(context, sign, a, b, pos) for a, b in pairs]
    found = parts[0]
    for part in parts[1:]:
        found = operators.binary(context, "AND", found, part, pos)
    return found


def _expt(context: Context, nodes: list[tree.Node], pos: Position) -> Value:
    count(nodes, 2, 2, "EXPT", pos)
    left = real_value(context, nodes[0], "EXPT")
    right = real_value(context, nodes[1], "EXPT")
    goal = types.REAL if left.base is types.REAL else types.LREAL
    text = f"(({goal.c})pow({left.text}, {right.text}))"
    return Value(goal, text, calls=left.calls or right.calls, bits=goal.bits)


def _not(context: Context, nodes: list[tree.Node], pos: Position) -> Value:
    count(nodes, 1, 1, "NOT", pos)
    value = context.value(nodes[0])
    return operators.unary(context, "NOT", value, pos)


def _shift(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    count(nodes, 2, 2, name, pos)
    value = context.value(nodes[0])
    base = value.base
    if not isinstance(base, types.Elementary) or not base.whole:
        if not (isinstance(base, types.Elementary) and base.family == "bool"):
            text = f"{name} needs a bit string, not {value.type}"
            raise StopHere(TYPE, text, nodes[0].pos)
        base = types.BYTE
    if value.weak:
        base = _literal_width(value)
        value = convert.cast(value, base)
    number = context.value(nodes[1])
    places = number.base
    if not isinstance(places, types.Elementary) or not places.whole:
        text = f"{name}: the number of places is whole"
        raise StopHere(TYPE, text, nodes[1].pos)
    function = f"st_{name.lower()}"
    inside = f"(st_u{base.bits}){value.text}, {number.text}, {base.bits}"
    if name == "SHR" and base.signed:
        function, inside = (
            "st_sar",
            f"{value.text}, {number.text}, {base.bits}",
        )
    calls = value.calls or number.calls
    text = f"(({base.c}){function}({inside}))"
    return Value(base, text, calls=calls, bits=base.bits)


def _literal_width(value: Value) -> types.Elementary:
    for type_ in (types.BYTE, types.WORD, types.DWORD):
        if 0 <= value.constant <= type_.high:
            return type_
    return types.LWORD


def _trunc(
    context: Context, nodes: list[tree.Node], pos: Position, *, name: str
) -> Value:
    count(nodes, 1, 1, name, pos)
    value = context.value(nodes[0])
    goal = types.INT if name == "TRUNC_INT" else types.DINT
    return truncated(value, goal, pos)


def _same_real(
    context: Context,
    nodes: list[tree.Node],
    pos: Position,
    *,
    name: str,
    function: str,
) -> Value:
    count(nodes, 1, 1, name, pos)
    value = context.value(nodes[0], types.LREAL)
    return value.with_text(f"{function}({value.text})")


def _move(context: Context, nodes: list[tree.Node], pos: Position) -> Value:
    count(nodes, 1, 1, "MOVE", pos)
    found = context.value(nodes[0])
    found.writable = False
    return found


def _lmod(context: Context, nodes: list[tree.Node], pos: Position) -> Value:
    count(nodes, 2, 2, "LMOD", pos)
    values = [context.value(n, types.LREAL) for n in nodes]
    inside = ", ".join(v.text for v in values)
    return Value(types.LREAL, f"fmod({inside})", bits=64)


def _rules() -> dict[str, tuple[Rule, tuple[str, ...]]]:
    found: dict[str, tuple[Rule, tuple[str, ...]]] = {}
    for name in _FUNCTIONS:
        found[name] = (partial(_real, name=name), ("IN",))
    for name in _OPERATORS:
        found[name] = (partial(_operator, name=name), ("IN1", "IN2"))
    for name in ("SHL", "SHR", "ROL", "ROR"):
        found[name] = (partial(_shift, name=name), ("IN", "N"))
    for name in ("TRUNC", "TRUNC_INT"):
        found[name] = (partial(_trunc, name=name), ("IN",))
    for name, function in _SAME.items():
        rule = partial(_same_real, name=name, function=function)
        found[name] = (rule, ("IN",))
    atan2 = partial(_two_reals, name="ATAN2", function="atan2")
    found |= {
        "ABS": (_abs, ("IN",)),
        "NOT": (_not, ("IN",)),
        "EXPT": (_expt, ("IN1", "IN2")),
        "ATAN2": (atan2, ("Y", "X")),
        "MOVE": (_move, ("IN",)),
        "LMOD": (_lmod, ("LR_VALUE", "LR_ARG")),
        "MODABS": (_lmod, ("LR_VALUE", "LR_ARG")),
    }
    return found


_SAME = {
    "LTRUNC": "trunc",
    "F_LTRUNC": "trunc",
    "FLOOR": "floor",
    "CEIL": "ceil",
    "ROUND": "rint",
    "FRAC": "st_frac",
}
RULES = _rules()
