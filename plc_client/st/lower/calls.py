"""Calls of functions, methods, accessors and instances; arguments by place and by name."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..errors import ARGUMENT, CLASS, NAME, TARGET, Position, StopHere
from ..model import types
from ..model.classes import STANDARD_NAMES, Class, ClassType, Routine, Variable
from ..model.world import Cascade, nearest
from ..syntax import tree
from . import (
    convert,
    library_calls,
    places,
    store,
)
from .context import Context
from .value import PropertyRef, RoutineRef, Value, address, at


@dataclass
class Pieces:
    """A call while it is put together: what is done before and behind it."""

    before: list[str] = field(default_factory=list)
    behind: list[str] = field(default_factory=list)
    arguments: list[str] = field(default_factory=list)


# -- prototypes
def parameter_types(routine: Routine) -> list[str]:
    """C types of the parameters."""
    found = [] if routine.owner is None else ["st_ptr"]
    if not routine.result.scalar and routine.result is not types.VOID:
        found.append("st_ptr")
    for variable in routine.parameters:
        found += variable_types(variable)
    return found


def variable_types(variable: Variable) -> list[str]:
    """C types of one parameter."""
    if variable.section == "VAR_INPUT" and variable.type.scalar:
        return [types.c_type(variable.type)]
    if isinstance(variable.type, types.OpenArray):
        return ["st_ptr"] + ["st_i64"] * (2 * variable.type.rank)
    return ["st_ptr"]


def result_type(routine: Routine) -> str:
    """C type of the result."""
    if routine.result.scalar:
        return types.c_type(routine.result)
    return "void"


def prototype(routine: Routine) -> str:
    """The declaration for other C files."""
    inside = ", ".join(parameter_types(routine)) or "void"
    return f"{result_type(routine)} {routine.c}({inside}) ST_HIDDEN;"


def target(context: Context, base: RoutineRef, self_text: str) -> str:
    """The C expression that is called."""
    routine = base.routine
    if base.interface is not None:
        return _through_interface(context, base, self_text)
    if base.static or routine.owner is None or routine.pou.kind == "action":
        return context.prototype(routine.c, prototype(routine))
    assert routine.owner is not None
    cls = context.cls if base.instance == "self" else routine.owner
    slot = (cls or routine.owner).slots().index(routine.name.upper())
    inside = ", ".join(parameter_types(routine))
    kind = f"{result_type(routine)} (*)({inside})"
    return f"(({kind})st_method({self_text}, {slot}))"


def _through_interface(
    context: Context, base: RoutineRef, self_text: str
) -> str:
    interface = base.interface
    assert interface is not None
    name = f"N_{interface.name.upper()}"
    context.prototype(name, f"extern const char {name}[] ST_HIDDEN;")
    slot = interface.interface_methods().index(base.routine.name.upper())
    inside = ", ".join(parameter_types(base.routine))
    kind = f"{result_type(base.routine)} (*)({inside})"
    return f"(({kind})st_interface({self_text}, {name}, {slot}))"


# -- functions and methods
def call_routine(context: Context, base: RoutineRef, node: tree.Call) -> Value:
    """A call whose arguments stand in brackets."""
    base = library_calls.chosen(context, base, node)
    routine = base.routine
    _check_callable(context, base, node.pos)
    if routine.pou.kind == "action" and node.arguments:
        return _call_action(context, base, node)
    if routine.refused:
        raise Cascade(node.pos)
    given = matched(routine.parameters, node.arguments, routine.label)
    return _call(context, base, given, node.pos)


def _check_callable(context: Context, base: RoutineRef, pos: Position) -> None:
    routine = base.routine
    if routine.abstract and base.static and routine.owner is not None:
        text = f"{routine.label} is ABSTRACT and has no statements"
        raise StopHere(CLASS, text, pos)


def _call(
    context: Context,
    base: RoutineRef,
    given: dict[str, tree.Argument],
    pos: Position,
) -> Value:
    routine, pieces = base.routine, Pieces()
    if library_calls.is_one(routine):
        pieces.before.append(library_calls.site(context, pos))
    self_text = _instance(context, base, pieces, pos)
    if self_text:
        pieces.arguments.append(self_text)
    buffer = ""
    if not routine.result.scalar and routine.result is not types.VOID:
        buffer = context.buffer(routine.result.size)
        pieces.arguments.append(buffer)
    values = _inputs(context, routine, given, pos)
    _ordered_inputs(context, routine, values, pieces)
    for variable in routine.parameters:
        argument = given.get(variable.name.upper())
        _argument(context, variable, argument, values, pieces, pos)
    library_calls.check(routine, values, given)
    if routine.origin is not None and library_calls.notes(
        context, routine.origin
    ):
        pieces.before.append(library_calls.noted(context, routine.label, pos))
    function = target(context, base, self_text)
    text = f"{function}({', '.join(pieces.arguments)})"
    return _finished(context, routine, pieces, text, buffer)


def _instance(
    context: Context, base: RoutineRef, pieces: Pieces, pos: Position
) -> str:
    if base.routine.owner is None:
        return ""
    if not base.instance:
        text = f"{base.routine.label} needs an instance"
        raise StopHere(CLASS, text, pos)
    place = context.here(pos)
    if base.interface is not None:
        name = context.pointer()
        text = f"{name} = st_bound({base.instance}, {place})"
        pieces.before.append(text)
        return name
    if "(" in base.instance and not base.static:
        name = context.pointer()
        pieces.before.append(f"{name} = {base.instance}")
        return name
    return base.instance


def _inputs(
    context: Context,
    routine: Routine,
    given: dict[str, tree.Argument],
    pos: Position,
) -> dict[str, Value]:
    """The values of the inputs in the order of the declaration."""
    found = {}
    for variable in routine.of("VAR_INPUT"):
        key = variable.name.upper()
        argument = given.get(key)
        if argument is not None and argument.value is not None:
            found[key] = input_value(context, variable, argument.value)
        else:
            found[key] = _omitted(context, routine, variable, pos)
    return found


def input_value(context: Context, variable: Variable, node: tree.Node) -> Value:
    """An argument as the parameter's type; references bind to a place."""
    type_ = variable.type
    if isinstance(type_, types.PointerType) and type_.reference:
        return store.bound(context, type_, node)
    found = context.value(node)
    if isinstance(type_, types.OpenArray):
        raise StopHere(ARGUMENT, "ARRAY [*] needs VAR_IN_OUT", node.pos)
    if isinstance(type_, types.StringType):
        return convert.implicit(context, found, type_, node.pos)
    return convert.implicit(context, found, type_, node.pos)


def _omitted(
    context: Context, routine: Routine, variable: Variable, pos: Position
) -> Value:
    """The initial value of an input that is not given."""
    init = variable.decl.init if variable.decl is not None else None
    if init is not None and variable.type.scalar:
        return context.value(init, variable.type)
    if init is not None and isinstance(variable.type, types.StringType):
        return context.value(init, variable.type)
    text = (
        f"{routine.label} needs {variable.name}; its declaration has no value"
    )
    raise StopHere(ARGUMENT, text, pos)


def _ordered_inputs(
    context: Context,
    routine: Routine,
    values: dict[str, Value],
    pieces: Pieces,
) -> None:
    """Inputs beside one that runs the user's code are read from left to right."""
    texts, found = context.in_order(list(values.values()))
    if texts:
        pieces.before += texts
        values.update(zip(values, found, strict=True))
        return
    calling = [key for key, value in values.items() if value.calls]
    if len(calling) < 2 and not (calling and pieces.before):
        return
    for key in calling:
        text, values[key] = context.keep(values[key])
        pieces.before.append(text)


def _argument(
    context: Context,
    variable: Variable,
    argument: tree.Argument | None,
    values: dict[str, Value],
    pieces: Pieces,
    pos: Position,
) -> None:
    key = variable.name.upper()
    if variable.section == "VAR_INPUT":
        pieces.arguments.append(values[key].text)
    elif variable.section == "VAR_IN_OUT":
        if argument is None or argument.value is None:
            text = f"VAR_IN_OUT {variable.name} must be given"
            raise StopHere(ARGUMENT, text, pos)
        pieces.arguments += in_out(context, variable, argument.value)
    else:
        _output(context, variable, argument, pieces)


def in_out(context: Context, variable: Variable, node: tree.Node) -> list[str]:
    """The address of an argument that is read and written; open arrays with bounds."""
    found = context.value(node)
    read_only = variable.read_only
    if not found.place and read_only:
        return [_copied(context, found, variable, node.pos)]
    if not found.place or found.bit is not None:
        text = f"VAR_IN_OUT {variable.name} needs a variable"
        raise StopHere(ARGUMENT, text, node.pos)
    if not found.writable and not read_only:
        text = f"VAR_IN_OUT {variable.name}: {found.spelled} is constant"
        raise StopHere(TARGET, text, node.pos)
    if isinstance(variable.type, types.OpenArray):
        return _open(found, variable.type, node.pos)
    _check_same(context, found, variable.type, node.pos)
    return [found.place]


def _copied(
    context: Context, found: Value, variable: Variable, pos: Position
) -> str:
    """A constant handed to ``VAR_IN_OUT CONSTANT``."""
    found = convert.implicit(context, found, variable.type, pos)
    if not variable.type.scalar:
        return found.text
    name = context.scalar(variable.type)
    return f"({name} = {found.text}, (st_ptr)&{name})"


def _open(found: Value, type_: types.OpenArray, pos: Position) -> list[str]:
    if isinstance(found.type, types.OpenArray):
        return [found.text, *found.bounds]
    actual = found.type
    if not isinstance(actual, types.ArrayType) or not types.same(
        actual.element, type_.element
    ):
        raise convert.mismatch(found.type, type_, pos)
    if len(actual.dims) != type_.rank:
        text = f"{type_.rank} dimensions are needed, not {len(actual.dims)}"
        raise StopHere(ARGUMENT, text, pos)
    bounds = [f"{b}" for dim in actual.dims for b in dim]
    return [found.text, *bounds]


def _check_same(
    context: Context, found: Value, type_: types.Type, pos: Position
) -> None:
    actual = found.type
    if types.same(actual, type_):
        return
    if isinstance(actual, types.StringType) and isinstance(
        type_, types.StringType
    ):
        if actual.wide == type_.wide and actual.length >= type_.length:
            return
        text = f"{actual} is shorter than {type_} of the VAR_IN_OUT"
        raise StopHere(ARGUMENT, text, pos)
    if (
        isinstance(actual, ClassType)
        and isinstance(type_, ClassType)
        and actual.cls.is_a(type_.cls)
    ):
        return
    a, b = types.plain(actual), types.plain(type_)
    if isinstance(a, types.Elementary) and isinstance(b, types.Elementary):  # noqa: SIM102
        if a.size == b.size and a.whole and b.whole:
            context.warn(f"{actual} is used as {type_}", pos)
            return
    raise convert.mismatch(actual, type_, pos)


def _output(
    context: Context,
    variable: Variable,
    argument: tree.Argument | None,
    pieces: Pieces,
) -> None:
    """An output goes to its variable, or to nowhere."""
    if argument is not None and argument.value is not None:
        node = argument.value
        found = context.value(node)
        direct = types.same(found.type, variable.type) and found.place
        if direct and found.bit is None and not found.flag:
            store.check_writable(found, node.pos)
            store.note(context, found, node.pos)
            pieces.arguments.append(found.place)
            return
    if variable.type.scalar:
        name = context.scalar(variable.type)
        pieces.arguments.append(f"(st_ptr)&{name}")
        kept = Value(variable.type, name, calls=True)
        kept.bits = getattr(types.plain(variable.type), "bits", 0)
    else:
        name = context.buffer(variable.type.size)
        pieces.arguments.append(name)
        kept = Value(variable.type, name)
    if argument is not None and argument.value is not None:
        text = store.text(context, argument.value, kept, argument.pos)
        pieces.behind.append(text)


def _finished(
    context: Context,
    routine: Routine,
    pieces: Pieces,
    text: str,
    buffer: str,
) -> Value:
    """One C expression of all pieces."""
    type_ = routine.result
    bits = getattr(types.plain(type_), "bits", 0)
    parts = [*pieces.before, text, *pieces.behind]
    if buffer:
        parts.append(buffer)
    elif pieces.behind and type_.scalar:
        name = context.scalar(type_)
        parts[len(pieces.before)] = f"{name} = {text}"
        parts.append(name)
    whole = parts[0] if len(parts) == 1 else f"({', '.join(parts)})"
    result = Value(type_, whole, calls=True, bits=bits)
    if isinstance(type_, types.PointerType) and type_.reference:
        result.spelled = routine.label
    elif buffer and isinstance(type_, (types.StructType, types.ArrayType)):
        result.place = ""
    return result


# -- matching arguments
def matched(
    parameters: list[Variable], arguments: list[tree.Argument], label: str
) -> dict[str, tree.Argument]:
    """Arguments by the parameter's name in capitals."""
    names = {v.name.upper(): v for v in parameters}
    inputs = list(parameters)
    found: dict[str, tree.Argument] = {}
    place = 0
    for argument in arguments:
        if argument.name:
            key = argument.name.upper()
            if key not in names and STANDARD_NAMES.get(key, "") in names:
                key = STANDARD_NAMES[key]
            _check_named(names, key, argument, label)
        else:
            if place >= len(inputs):
                text = f"{label} takes {len(inputs)} arguments"
                raise StopHere(ARGUMENT, text, argument.pos)
            key = inputs[place].name.upper()
            place += 1
        if key in found:
            text = f"{argument.name or key} is given twice"
            raise StopHere(ARGUMENT, text, argument.pos)
        found[key] = argument
    return found


def _check_named(
    names: dict[str, Variable],
    key: str,
    argument: tree.Argument,
    label: str,
) -> None:
    if key not in names:
        raise _no_parameter(names, argument, label)
    section = names[key].section
    if argument.out and section == "VAR_INPUT":
        text = f"{argument.name} is an input; write :="
        raise StopHere(ARGUMENT, text, argument.pos)
    if not argument.out and section == "VAR_OUTPUT":
        text = f"{argument.name} is an output; write =>"
        raise StopHere(ARGUMENT, text, argument.pos)


def _no_parameter(
    names: dict[str, Variable], argument: tree.Argument, label: str
) -> StopHere:
    """The error for a name that is no parameter: the nearest one, and all."""
    sections = ("VAR_OUTPUT",) if argument.out else ("VAR_INPUT", "VAR_IN_OUT")
    what = "outputs" if argument.out else "inputs"
    known = [v.name for v in names.values() if v.section in sections]
    text = f"parameter of {label}: {argument.name} is unknown; "
    near = nearest(argument.name, known, 0.6)
    text += f"did you mean {near}? " if near else ""
    text += f"{what}: {', '.join(known) or 'none'}"
    return StopHere(NAME, text, argument.pos)


# -- properties
def get_property(context: Context, found: PropertyRef, pos: Position) -> Value:
    """Call the getter."""
    routine = found.cls.method(f"GET__{found.name}")
    if routine is None:
        text = f"property {found.name} has no GET"
        raise StopHere(CLASS, text, pos)
    value = _call(context, _accessor(found, routine), {}, pos)
    value.spelled = found.name
    return places.follow(context, value, pos)


def set_property(
    context: Context, found: PropertyRef, value: Value, pos: Position
) -> str:
    """C text that calls the setter."""
    routine = found.cls.method(f"SET__{found.name}")
    if routine is None:
        text = f"property {found.name} has no SET"
        raise StopHere(TARGET, text, pos)
    value = convert.implicit(context, value, found.type, pos)
    base, pieces = _accessor(found, routine), Pieces()
    self_text = _instance(context, base, pieces, pos)
    if pieces.before and value.calls:
        text, value = context.keep(value)
        pieces.before.insert(0, text)
    function = target(context, base, self_text)
    pieces.before.append(f"{function}({self_text}, {value.text})")
    return ", ".join(pieces.before)


def _accessor(found: PropertyRef, routine: Routine) -> RoutineRef:
    cls: Class | None = found.cls
    if cls is not None and cls.kind != "interface":
        cls = None
    return RoutineRef(routine, found.instance, found.static, cls)


# -- instances
def call_instance(context: Context, base: Value, node: tree.Call) -> Value:
    """``fb(IN := a, Q => b)``: inputs, body, outputs; lines of their own."""
    assert isinstance(base.type, ClassType)
    cls = base.type.cls
    if cls.body is None:
        raise StopHere(CLASS, f"{cls.name} cannot be called", node.pos)
    given = _given(cls, node)
    instance = base.text
    if "(" in instance and ("st_" in instance or base.calls):
        instance = _kept(context, base.text)
    _check_in_outs(cls, given, node)
    body = _body_call(context, base, cls, instance)
    if library_calls.notes(context, cls.origin):
        body = f"{library_calls.noted(context, cls.name, node.pos)}; {body}"
    return _with_arguments(context, cls, given, instance, body)


def _call_action(context: Context, base: RoutineRef, node: tree.Call) -> Value:
    """``fb.Act(IN := a, Q => b)``: inputs of the block, the action, outputs."""
    cls = base.routine.owner
    assert cls is not None
    given = _given(cls, node)
    instance = base.instance
    if "(" in instance:
        instance = _kept(context, instance)
    body = f"{target(context, base, instance)}({instance})"
    if library_calls.notes(context, cls.origin):
        body = f"{library_calls.noted(context, cls.name, node.pos)}; {body}"
    return _with_arguments(context, cls, given, instance, body)


def _kept(context: Context, text: str) -> str:
    name = context.pointer()
    context.put(f"{name} = {text};")
    return name


def _given(cls: Class, node: tree.Call) -> dict[str, tree.Argument]:
    cls.layout()
    if cls.uncertain:
        raise Cascade(node.pos)
    return matched(cls.parameters(), node.arguments, cls.name)


def _with_arguments(
    context: Context,
    cls: Class,
    given: dict[str, tree.Argument],
    instance: str,
    body: str,
) -> Value:
    for variable in cls.parameters():
        argument = given.get(variable.name.upper())
        if argument is not None and argument.value is not None:
            _give(context, variable, argument.value, instance)
    context.put(body + ";")
    for variable in cls.parameters():
        argument = given.get(variable.name.upper())
        if variable.section == "VAR_OUTPUT" and argument is not None:
            _fetch(context, variable, argument, instance)
    return Value(types.VOID, "(void)0", calls=True)


def _check_in_outs(
    cls: Class, given: dict[str, tree.Argument], node: tree.Call
) -> None:
    for variable in cls.parameters():
        if variable.section != "VAR_IN_OUT":
            continue
        argument = given.get(variable.name.upper())
        if argument is None or argument.value is None:
            text = f"VAR_IN_OUT {variable.name} of {cls.name} must be given"
            raise StopHere(ARGUMENT, text, node.pos)


def _give(
    context: Context, variable: Variable, node: tree.Node, instance: str
) -> None:
    where = address(instance, variable.offset)
    if variable.section == "VAR_INPUT":
        found = input_value(context, variable, node)
        place = at(variable.type, where)
        context.put(store.assignment(context, place, found, node.pos) + ";")
    elif variable.section == "VAR_IN_OUT":
        texts = in_out(context, variable, node)
        context.put(f"*(st_ptr *)({where}) = {texts[0]};")
        for k, bound in enumerate(texts[1:], 1):
            context.put(f"*(st_i64 *)({address(where, 8 * k)}) = {bound};")


def _body_call(context: Context, base: Value, cls: Class, instance: str) -> str:
    body = cls.body
    assert body is not None
    exact = base.exact or ("st_" not in base.text and base.text != "self")
    if exact:
        name = context.prototype(body.c, f"void {body.c}(st_ptr) ST_HIDDEN;")
        return f"{name}({instance})"
    return f"st_body({instance})"


def _fetch(
    context: Context,
    variable: Variable,
    argument: tree.Argument,
    instance: str,
) -> None:
    if argument.value is None:
        return
    found = at(variable.type, address(instance, variable.offset))
    text = store.text(context, argument.value, found, argument.pos)
    context.put(text + ";")
