"""C functions of POUs: head, locals with initial values, statements, end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ..errors import Origin, StopHere
from ..model import types
from ..model.classes import Class, Routine, Variable
from ..model.world import World
from ..syntax import tree
from . import calls, initial, statements
from .context import HERE, Context
from .expressions import LoweringContext


@dataclass
class CText:
    """C of one POU: what it needs of others and its functions."""

    prototypes: dict[str, str] = field(default_factory=dict)
    functions: list[str] = field(default_factory=list)

    def text(self) -> str:
        """Prototypes and functions."""
        return "\n".join([*self.prototypes.values(), *self.functions, ""])


def finish(
    context: Context, head: str, into: CText, locals_: list[str]
) -> None:
    """Put the pieces of one function together."""
    into.prototypes |= context.prototypes
    lines = [f"{head} {{"]
    lines.append(f'static const char {HERE}[] = "{_label(context.label)}";')
    lines.append(f"(void){HERE};")
    lines += context.statics
    lines += locals_
    lines += context.declared
    lines += context.lines
    into.functions.append("\n".join(lines) + "\n}")


def _label(label: str) -> str:
    """Names hold letters, digits and _ alone; the rest is left out."""
    return "".join(
        c for c in label if c.isascii() and (c.isalnum() or c in "_.")
    )


def routine(world: World, found: Routine, into: CText) -> None:
    """The C function of a function, method, accessor or action."""
    assert found.origin is not None
    context = LoweringContext(
        world,
        found.origin,
        found.label,
        found.pou.pos[0],
        found,
        found.owner,
    )
    locals_ = ["ST_ENTER();"]
    parameters = _parameters(context, found, locals_)
    _locals(context, found, locals_)
    statements.block(context, found.pou.statements)
    context.put(_leaving(context, found))
    name = found.c
    head = f"{calls.result_type(found)} {name}({parameters or 'void'})"
    into.prototypes[name] = calls.prototype(found)
    finish(context, head, into, locals_)


def _leaving(context: Context, found: Routine) -> str:
    label = "st_return: ST_LEAVE();" if context.jumps_out else "ST_LEAVE();"
    if found.result.scalar:
        return f"{label} return st_result;"
    return f"{label} return;"


def _parameters(context: Context, found: Routine, locals_: list[str]) -> str:
    parts = [] if found.owner is None else ["st_ptr self"]
    if found.owner is not None:
        locals_.append("(void)self;")
    if not found.result.scalar and found.result is not types.VOID:
        parts.append("st_ptr st_result")
        locals_.append(f"memset(st_result, 0, {found.result.size});")
        initial.default(context, found.result, "st_result")
    for variable in found.parameters:
        parts += _parameter(context, variable, locals_)
    return ", ".join(parts)


def _parameter(
    context: Context, variable: Variable, locals_: list[str]
) -> list[str]:
    name, type_ = variable.c, variable.type
    kinds = calls.variable_types(variable)
    if variable.section != "VAR_INPUT":
        locals_.append(f"(void){name};")
        if variable.section == "VAR_OUTPUT":
            _clear_output(context, variable)
        extra = [f"{k} {name}_{i}" for i, k in enumerate(kinds[1:])]
        locals_ += [f"(void){name}_{i};" for i in range(len(kinds) - 1)]
        return [f"st_ptr {name}", *extra]
    if type_.scalar:
        locals_.append(f"(void){name};")
        return [f"{kinds[0]} {name}"]
    locals_.append(f"ST_LOCAL({name}, {type_.size});")
    if isinstance(type_, types.StringType):
        copy = "st_wcopy" if type_.wide else "st_copy"
        locals_.append(f"{copy}({name}, {type_.length}, p{name});")
    else:
        locals_.append(f"memcpy({name}, p{name}, {type_.size});")
    return [f"st_ptr p{name}"]


def _clear_output(context: Context, variable: Variable) -> None:
    type_ = variable.type
    context.put(f"memset({variable.c}, 0, {type_.size});")
    _initialised(context, variable, variable.c)


def _initialised(context: Context, variable: Variable, where: str) -> None:
    declaration = variable.decl
    init = declaration.init if declaration is not None else None
    written = declaration.type if declaration is not None else None
    try:
        initial.variable(context, variable.type, where, init, written)
    except StopHere as stop:
        context.error(stop)


def _locals(context: Context, found: Routine, locals_: list[str]) -> None:
    if found.result.scalar:
        kind = types.c_type(found.result)
        locals_.append(f"{kind} st_result = 0; (void)&st_result;")
        initial.default(context, found.result, "((st_ptr)&st_result)")
    temporaries = list(found.variables.values())
    if found.owner is not None and found.pou.kind == "body":
        temporaries += [
            v for c in found.owner.ancestors() for v in c.own.values()
        ]
    for variable in temporaries:
        if variable.storage == "local" and variable.section not in (
            "VAR_INPUT",
            "RESULT",
        ):
            _local(context, variable, locals_)


def _local(context: Context, variable: Variable, locals_: list[str]) -> None:
    name, type_ = variable.c, variable.type
    if variable.constant is not None:
        return
    if type_.scalar:
        kind = types.c_type(type_)
        locals_.append(f"{kind} {name} = 0; (void)&{name};")
        where = f"((st_ptr)&{name})"
    else:
        locals_.append(f"ST_LOCAL({name}, {type_.size});")
        context.put(f"memset({name}, 0, {type_.size});")
        where = name
    _initialised(context, variable, where)


# -- classes
def class_text(world: World, cls: Class) -> CText:
    """All functions of a class with its table of methods."""
    into = CText()
    cls.layout()
    if cls.body is not None:
        routine(world, cls.body, into)
    for found in cls.methods.values():
        if not found.abstract:
            routine(world, found, into)
    _constructor(world, cls, into)
    _descriptor(cls, into)
    return into


def _constructor(world: World, cls: Class, into: CText) -> None:
    """Initial values of an instance in memory of zeros."""
    name = f"I_{cls.name.upper()}"
    context = LoweringContext(
        world, cls.origin, cls.name, cls.pou.pos[0], None, cls
    )
    if cls.base is not None:
        base = f"I_{cls.base.name.upper()}"
        context.prototype(base, f"void {base}(st_ptr) ST_HIDDEN;")
        context.put(f"{base}(self);")
    table = f"D_{cls.name.upper()}"
    context.put(f"*(const void **)self = &{table};")
    for variable in cls.own.values():
        if variable.storage == "member" and variable.section != "VAR_IN_OUT":
            where = f"(self + {variable.offset})"
            _initialised(context, variable, where)
    prototype = f"extern const st_class {table} ST_HIDDEN;"
    context.prototype(table, prototype)
    into.prototypes[name] = f"void {name}(st_ptr) ST_HIDDEN;"
    finish(context, f"void {name}(st_ptr self)", into, ["(void)self;"])


def _descriptor(cls: Class, into: CText) -> None:
    """The class's table: its body, its methods, its interfaces."""
    key = cls.name.upper()
    methods = [cls.method(name) for name in cls.slots()]
    names = [_entry(into, m) for m in methods]
    lines = []
    if names:
        inside = ", ".join(names)
        lines.append(f"static void *const m_{key}[] = {{{inside}}};")
    tables = []
    for interface in cls.all_interfaces():
        tables.append(_interface_table(cls, interface, into, lines))  # noqa: PERF401
    inside = ", ".join([*tables, "{0, 0}"])
    lines.append(f"static const st_interface_of i_{key}[] = {{{inside}}};")
    body = "0"
    if cls.body is not None:
        body = f"(void *){cls.body.c}"
    table = f"m_{key}" if names else "0"
    prototype = f"extern const st_class D_{key} ST_HIDDEN;"
    into.prototypes[f"D_{key}"] = prototype
    value = f'{{"{key}", {body}, {table}, i_{key}}}'
    lines.append(f"const st_class D_{key} = {value};")
    into.functions += lines


def _entry(into: CText, found: Routine | None) -> str:
    if found is None or found.abstract:
        return "0"
    into.prototypes.setdefault(found.c, calls.prototype(found))
    return f"(void *){found.c}"


def _interface_table(
    cls: Class, interface: Class, into: CText, lines: list[str]
) -> str:
    name = f"N_{interface.name.upper()}"
    into.prototypes.setdefault(name, f"extern const char {name}[] ST_HIDDEN;")
    wanted = interface.interface_methods()
    entries = [_entry(into, cls.method(n)) for n in wanted] or ["0"]
    table = f"t_{cls.name.upper()}_{len(lines)}"
    lines.append(f"static void *const {table}[] = {{{', '.join(entries)}}};")
    return f"{{{name}, {table}}}"


def struct_text(
    world: World, type_: types.StructType, node: tree.StructType, origin: Origin
) -> CText:
    """The function that gives a structure its initial values."""
    into = CText()
    context = LoweringContext(world, origin, type_.name, node.pos[0])
    if type_.base is not None:
        initial.default(context, type_.base, "self")
    for declaration in node.members:
        member = type_.members[declaration.name.upper()]
        where = f"(self + {member.offset})"
        found = Variable(member.name, member.type, "VAR", declaration)
        if member.bit < 0:
            _initialised(context, found, where)
    name = initial.struct_name(type_)
    into.prototypes[name] = f"void {name}(st_ptr) ST_HIDDEN;"
    finish(context, f"void {name}(st_ptr self)", into, ["(void)self;"])
    return into


def list_text(
    world: World, name: str, variables: list[Variable], origin: Origin
) -> CText:
    """The function that gives global variables their initial values."""
    into = CText()
    context = LoweringContext(world, origin, name, 0)
    for variable in variables:
        if variable.constant is not None or variable.pending is not None:
            continue
        if variable.index >= 0:
            _initial_bit(context, variable)
            continue
        where = f"({context.area(variable.area)} + {variable.offset})"
        _initialised(context, variable, where)
    head = f"void L_{name.upper()}(void)"
    into.prototypes[head] = f"{head} ST_HIDDEN;"
    finish(context, head, into, [])
    return into


def _initial_bit(context: Context, variable: Variable) -> None:
    init = variable.decl.init if variable.decl is not None else None
    if init is None:
        return
    value = context.value(init, types.BOOL)
    where = f"{context.area(variable.area)} + {variable.offset}"
    context.put(f"st_set_bit({where}, {variable.index}, {value.text});")


Emit = Callable[[], CText]
