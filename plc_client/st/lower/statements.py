"""Statements: one function for every kind of node."""

from __future__ import annotations

import bisect
from collections.abc import Callable

from ..errors import CONSTANT, RANGE, SYNTAX, TWICE, TYPE, StopHere, refuse
from ..model import types
from ..syntax import tree
from . import calls, convert, expressions, store
from .context import Context, Loop
from .value import PropertyRef, RoutineRef, Value, load


def block(context: Context, statements: list[tree.Node]) -> None:
    """Statements in order; an error ends one statement, not the others."""
    context.marks.append(_marks(context, statements))
    for node in statements:
        keep = context.taken
        try:
            _RULES[type(node)](context, node)
        except StopHere as stop:
            context.error(stop)
        context.statement_ends(keep)
    context.marks.pop()


def _assign(context: Context, node: tree.Assign) -> None:
    if node.operator == "REF=":
        _refer(context, node)
        return
    if node.operator in ("S=", "R="):
        _set_reset(context, node)
        return
    target = node.targets[-1]
    value = expressions.value(context, node.value)
    text = store.text(context, target, value, node.value.pos)
    context.put(f"{text};")
    for left in reversed(node.targets[:-1]):
        again = expressions.value(context, target)
        again.calls = False
        context.put(store.text(context, left, again, node.pos) + ";")


def _refer(context: Context, node: tree.Assign) -> None:
    found = expressions.entity(context, node.targets[0])
    if isinstance(found, PropertyRef):
        bound = store.bound(context, _reference(found.type, node), node.value)
        context.put(calls.set_property(context, found, bound, node.pos) + ";")
        return
    if not isinstance(found, Value):
        raise StopHere(TYPE, "REF= needs a reference", node.pos)
    type_ = _reference(found.type, node)
    store.check_writable(found, node.pos)
    bound = store.bound(context, type_, node.value)
    context.put(store.assignment(context, found, bound, node.pos) + ";")


def _reference(type_: types.Type, node: tree.Assign) -> types.PointerType:
    if isinstance(type_, types.PointerType) and type_.reference:
        return type_
    text = f"REF= needs a REFERENCE TO, this is {type_}"
    raise StopHere(TYPE, text, node.pos)


def _set_reset(context: Context, node: tree.Assign) -> None:
    condition = expressions.boolean(context, node.value)
    value = Value(types.BOOL, "1" if node.operator == "S=" else "0")
    text = store.text(context, node.targets[0], value, node.pos)
    context.put(f"if ({condition.text}) {text};")


def _evaluate(context: Context, node: tree.Evaluate) -> None:
    called = node.value
    if not isinstance(called, tree.Call):
        if not _is_action(context, called):
            _check_useful(context, node)
            return
        called = tree.Call(called.pos, called, [])
    found = expressions.entity(context, called)
    if isinstance(found, Value) and found.text != "(void)0":
        context.put(f"(void)({found.text});")


def _is_action(context: Context, node: tree.Node) -> bool:
    """An action may be called without brackets."""
    found = expressions.entity(context, node)
    return isinstance(found, RoutineRef) and found.routine.pou.kind == "action"


def _check_useful(context: Context, node: tree.Evaluate) -> None:
    """``x;`` does nothing, but must be right."""
    expressions.value(context, node.value)
    text = "a statement without effect; an assignment or a call is needed"
    raise StopHere(SYNTAX, text, node.pos)


def _if(context: Context, node: tree.If) -> None:
    for number, (condition, statements) in enumerate(node.branches):
        keep = context.taken
        if number:
            context.put("} else {")
        test = _tested(context, condition)
        context.put(f"if ({test}) {{")
        context.statement_ends(keep)
        block(context, statements)
    if node.otherwise:
        context.put("} else {")
        block(context, node.otherwise)
    context.put("}" * len(node.branches))


def _tested(context: Context, node: tree.Node) -> str:
    try:
        return expressions.boolean(context, node).text
    except StopHere as stop:
        context.error(stop)
        return "0"


# -- CASE
def _case(context: Context, node: tree.Case) -> None:
    value = expressions.value(context, node.value)
    base = value.base
    if not isinstance(base, types.Elementary) or not (
        base.whole or base.family == "time"
    ):
        text = f"CASE needs a whole number, not {value.type}"
        raise StopHere(TYPE, text, node.value.pos)
    name = context.scalar(types.LINT)
    context.put(f"{name} = (st_i64){value.text};")
    context.put(f"switch ({name}) {{")
    taken: list[tuple[int, int]] = []
    for branch in node.branches:
        _labels(context, branch, value, taken)
        context.put("{")
        block(context, branch.statements)
        context.put("} break;")
    context.put("default: {")
    block(context, node.otherwise or [])
    context.put("} break; }")


def _labels(
    context: Context,
    branch: tree.CaseBranch,
    value: Value,
    taken: list[tuple[int, int]],
) -> None:
    for low_node, high_node in branch.labels:
        try:
            _label(context, low_node, high_node, value, taken)
        except StopHere as stop:
            context.error(stop)


def _label(
    context: Context,
    low_node: tree.Node,
    high_node: tree.Node | None,
    value: Value,
    taken: list[tuple[int, int]],
) -> None:
    low = _label_value(context, low_node, value)
    high = low if high_node is None else _label_value(context, high_node, value)
    if high < low:
        text = f"the range {low}..{high} is empty"
        raise StopHere(RANGE, text, low_node.pos)
    place = bisect.bisect(taken, (low, high))
    before = taken[place - 1][1] if place else low - 1
    behind = taken[place][0] if place < len(taken) else high + 1
    if before >= low or behind <= high:
        text = f"the label {low} stands twice"
        raise StopHere(RANGE, text, low_node.pos)
    taken.insert(place, (low, high))
    limits = f"{low}ll" if low == high else f"{low}ll ... {high}ll"
    if low == -(1 << 63):
        raise refuse("a label of -2**63", low_node.pos)
    context.put(f"case {limits}:")


def _label_value(context: Context, node: tree.Node, value: Value) -> int:
    found = expressions.value(context, node)
    base = found.base
    numbers = isinstance(base, types.Elementary) and base.family in (
        "int",
        "bit",
        "time",
    )
    if found.constant is None or not numbers:
        raise StopHere(CONSTANT, "a label is a constant number", node.pos)
    wanted = value.base
    assert isinstance(base, types.Elementary)
    assert isinstance(wanted, types.Elementary)
    if base.unit_ns != wanted.unit_ns:
        raise convert.mismatch(found.type, value.type, node.pos)
    return int(found.constant)


# -- loops
def _for(context: Context, node: tree.For) -> None:
    place = expressions.value(context, node.variable)
    store.check_writable(place, node.variable.pos)
    base = place.base
    if not isinstance(base, types.Elementary) or not base.whole:
        text = f"FOR needs a whole variable, not {place.type}"
        raise StopHere(TYPE, text, node.variable.pos)
    wide = types.ULINT if base is types.ULINT else types.LINT
    first = _limit(context, node.first, wide)
    last = _limit(context, node.last, wide, may_be_negative=True)
    step = _limit(context, node.step, types.LINT) if node.step else None
    if step is not None and step.constant == 0:
        raise StopHere(RANGE, "the step 0 never ends", node.pos)
    names = [f"{word}{context.number()}" for word in "kls"]
    _for_lines(context, node, place, (first, last, step), names, wide)


def _limit(
    context: Context,
    node: tree.Node,
    wide: types.Elementary,
    *,
    may_be_negative: bool = False,
) -> Value:
    """A whole number; with the flag it stays signed beside an unsigned counter."""
    found = expressions.value(context, node)
    base = found.base
    if not isinstance(base, types.Elementary) or not base.whole:
        text = f"FOR needs whole numbers, not {found.type}"
        raise StopHere(TYPE, text, node.pos)
    if may_be_negative and base.signed:
        wide = types.LINT
    return convert.cast(found, wide)


def _for_lines(
    context: Context,
    node: tree.For,
    place: Value,
    limits: tuple[Value, Value, Value | None],
    names: list[str],
    wide: types.Elementary,
) -> None:
    first, last, step = limits
    counter, end, by = names
    context.put(f"{{ {wide.c} {counter} = {first.text};")
    assert isinstance(last.base, types.Elementary)
    context.put(f"const {last.base.c} {end} = {last.text};")
    text = step.text if step is not None else "1"
    context.put(f"const st_i64 {by} = {text};")
    up, down = f"{counter} <= {end}", f"{counter} >= {end}"
    if last.base is types.LINT and wide is types.ULINT:
        up = f"({end} >= 0 && {counter} <= (st_u64){end})"
        down = f"({end} < 0 || {counter} >= (st_u64){end})"
    inside = f"{by} > 0 ? {up} : {down}"
    if step is None or (step.constant or 0) > 0:
        inside = up
    elif step.constant is not None:
        inside = down
    number = Value(wide, counter, bits=wide.bits)
    stored = convert.cast(number, place.base)
    writing = store.assignment(context, place, stored, node.pos) + ";"
    context.put(writing)
    context.put(f"while ({inside}) {{")
    context.put(f"ST_LOOP({context.here(node.pos)});")
    _body(context, node.statements)
    now = f"({wide.c}){load_again(place)}"
    context.put(f"if (ST_ADD({now}, {by}, &{counter})) break;")
    if isinstance(place.type, types.Subrange):
        low, high = place.type.low, place.type.high
        context.put(f"if ({counter} < {low} || {counter} > {high}) break;")
    context.put(f"{writing} }}")
    _leave_label(context)
    context.put("}")


def load_again(place: Value) -> str:
    """The C text that reads a place."""
    if place.local or place.bit is not None:
        return place.text
    return load(place.type, place.place)


def _body(context: Context, statements: list[tree.Node]) -> None:
    loop = Loop(context.number())
    context.loops.append(loop)
    block(context, statements)
    if loop.continues:
        context.put(f"c{loop.number}: ;")


def _leave_label(context: Context) -> None:
    loop = context.loops.pop()
    if loop.exits:
        context.put(f"x{loop.number}: ;")


def _while(context: Context, node: tree.While) -> None:
    context.put("for (;;) {")
    context.put(f"ST_LOOP({context.here(node.pos)});")
    if not node.test_last:
        _leave_unless(context, node.condition, "!")
    _body(context, node.statements)
    if node.test_last:
        _leave_unless(context, node.condition, "")
    context.put("}")
    _leave_label(context)


def _leave_unless(context: Context, node: tree.Node, sign: str) -> None:
    keep = context.taken
    test = _tested(context, node)
    context.put(f"if ({sign}({test})) break;")
    context.statement_ends(keep)


def _leave(context: Context, node: tree.Leave) -> None:
    if node.word == "RETURN":
        context.jumps_out = True
        context.put("goto st_return;")
        return
    if not context.loops:
        text = f"{node.word} stands outside of a loop"
        raise StopHere(SYNTAX, text, node.pos)
    loop = context.loops[-1]
    if node.word == "EXIT":
        loop.exits = True
        context.put(f"goto x{loop.number};")
    else:
        loop.continues = True
        context.put(f"goto c{loop.number};")


# -- JMP
def _marks(context: Context, statements: list[tree.Node]) -> dict[str, str]:
    """The labels of a list of statements and their names in C."""
    found: dict[str, str] = {}
    for node in statements:
        if not isinstance(node, tree.Mark):
            continue
        if any(node.name.upper() in m for m in (found, *context.marks)):
            text = f"the label {node.name} stands twice"
            context.error(StopHere(TWICE, text, node.pos))
        found[node.name.upper()] = f"m{context.number()}"
    return found


def _mark(context: Context, node: tree.Mark) -> None:
    context.put(f"{context.marks[-1][node.name.upper()]}: ;")


def _jump(context: Context, node: tree.Jump) -> None:
    """Out of blocks and within one, never into a block."""
    for marks in reversed(context.marks):
        name = marks.get(node.name.upper())
        if name is not None:
            context.put(f"ST_LOOP({context.here(node.pos)});")
            context.put(f"goto {name};")
            return
    raise refuse(
        f"JMP to {node.name}, which is not around it",
        node.pos,
        "a label stands in the same list of statements or in one around it",
    )


_RULES: dict[type, Callable[..., None]] = {
    tree.Assign: _assign,
    tree.Evaluate: _evaluate,
    tree.If: _if,
    tree.Case: _case,
    tree.For: _for,
    tree.While: _while,
    tree.Leave: _leave,
    tree.Mark: _mark,
    tree.Jump: _jump,
}
