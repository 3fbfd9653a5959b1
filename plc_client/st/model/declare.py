"""Declarations get their types, constants and places."""

from __future__ import annotations

import re

from ..errors import (
    CLASS,
    CONSTANT,
    NAME,
    RANGE,
    TWICE,
    TYPE,
    Origin,
    StopHere,
    refuse,
)
from ..lower import convert, expressions, places
from ..lower.context import Context
from ..lower.expressions import LoweringContext
from ..syntax import tree
from . import types
from .classes import Class, InterfaceType, Routine, Variable
from .declaration_rules import (
    broken,
    check_closed,
    constants_first,
    opening,
    retained,
)
from .world import Cascade, LazyPointer, VariableList, World

LARGEST = 1 << 28
"""Bytes of the largest type."""
_AREA = re.compile(r"%([IQM])([XBWDL]?)(\d+)(?:\.(\d+))?$")
_FIRST_FREE = 32768


class Declarations:
    """Resolves what the trees declare, when it is first needed."""

    def __init__(self, world: World) -> None:
        self._world = world
        world.resolve_type = self.typedef
        world.declare = self.declare
        self._free = dict.fromkeys("IQM", _FIRST_FREE)

    # -- types
    def _inherit_initial(self, declaration: tree.Decl) -> None:
        """``TYPE T : INT := 5``: a variable without a value takes the type's."""
        node = declaration.type
        seen: set[str] = set()
        if declaration.section == "VAR_IN_OUT":
            return
        while declaration.init is None and isinstance(node, tree.NamedType):
            key = node.name.upper().rpartition(".")[2]
            definition = self._world.typedefs.get(key)
            if definition is None or key in seen:
                return
            seen.add(key)
            node = definition.type
            if not isinstance(node, (tree.EnumType, tree.StructType)):
                declaration.init = definition.init

    def typedef(self, definition: tree.TypeDef) -> types.Type:
        """The type of a TYPE declaration."""
        origin = definition.origin
        assert origin is not None
        line = definition.pos[0]
        context = LoweringContext(self._world, origin, definition.name, line)
        try:
            return self._typedef(context, definition)
        except StopHere as stop:
            context.error(stop)
            raise Cascade(definition.pos) from None

    def _typedef(
        self, context: Context, definition: tree.TypeDef
    ) -> types.Type:
        node = definition.type
        if isinstance(node, tree.StructType):
            return self._structure(context, definition, node)
        if isinstance(node, tree.EnumType):
            return self._enumeration(context, definition, node)
        return self.type_of(context, node)

    def _enumeration(
        self, context: Context, definition: tree.TypeDef, node: tree.EnumType
    ) -> types.Type:
        base = self._world.type_named(node.base, node.pos)
        if not isinstance(base, types.Elementary) or not base.whole:
            text = f"{node.base} cannot be the base of an enumeration"
            raise StopHere(TYPE, text, node.pos)
        attributes = {a.name for a in definition.attributes}
        found = types.EnumType(definition.name, base)
        found.strict = "strict" in attributes
        found.qualified = "qualified_only" in attributes
        found.named = "to_string" in attributes
        self._world.types[definition.name.upper()] = found
        number = 0
        for name, value, pos in node.items:
            number = self._enumerator(context, found, name, value, number, pos)
        found.default = next(iter(found.values.values()))
        if definition.init is not None:
            found.default = self._default(context, found, definition.init)
        return found

    def _default(
        self, context: Context, found: types.EnumType, node: tree.Node
    ) -> int:
        """The initial value; a name of the enumeration stands alone here."""
        if isinstance(node, tree.Name) and node.name.upper() in found.values:
            return found.values[node.name.upper()]
        return self._constant_int(context, node)

    def _enumerator(
        self,
        context: Context,
        found: types.EnumType,
        name: str,
        value: tree.Node | None,
        number: int,
        pos: tuple[int, int],
    ) -> int:
        if name.upper() in found.values:
            raise StopHere(TWICE, f"{name} stands twice", pos)
        if value is not None:
            number = self._constant_int(context, value)
        found.values[name.upper()] = number
        found.spelled[name.upper()] = name
        return number + 1

    def _structure(
        self,
        context: Context,
        definition: tree.TypeDef,
        node: tree.StructType,
    ) -> types.Type:
        found = types.StructType(definition.name, union=node.union)
        for attribute in definition.attributes:
            if attribute.name == "pack_mode" and attribute.value.isdigit():
                found.pack = max(int(attribute.value), 1)
        if node.extends:
            self._inherit(context, found, node)
        bit_of: types.Member | None = None
        for declaration in node.members:
            bit_of = self._member(context, found, declaration, bit_of)
        found.close()
        if found.size > LARGEST:
            raise StopHere(RANGE, f"{found.name} is too large", definition.pos)
        found.initial = self._initial(found, node)
        return found

    def _inherit(
        self,
        context: Context,
        found: types.StructType,
        node: tree.StructType,
    ) -> None:
        base = self._world.type_named(node.extends, node.pos)
        if not isinstance(base, types.StructType):
            text = f"{node.extends} is no structure"
            raise StopHere(CLASS, text, node.pos)
        found.members = dict(base.members)
        found.size, found.align = base.size, base.align
        found.base = base

    def _member(
        self,
        context: Context,
        found: types.StructType,
        declaration: tree.Decl,
        before: types.Member | None,
    ) -> types.Member | None:
        if declaration.name.upper() in found.members:
            text = f"{declaration.name} is declared twice"
            raise StopHere(TWICE, text, declaration.pos)
        named = declaration.type
        if isinstance(named, tree.NamedType) and named.name.upper() == "BIT":
            return self._bit(found, declaration, before)
        self._inherit_initial(declaration)
        type_ = self.type_of(context, declaration.type)
        found.add(types.Member(declaration.name, type_))
        return None

    def _bit(
        self,
        found: types.StructType,
        declaration: tree.Decl,
        before: types.Member | None,
    ) -> types.Member:
        member = types.Member(declaration.name, types.BOOL, bit=0)
        if before is not None and before.bit < 7 and not found.union:
            member.offset, member.bit = before.offset, before.bit + 1
            found.members[member.name.upper()] = member
        else:
            found.add(member)
        return member

    def _initial(
        self, found: types.StructType, node: tree.StructType
    ) -> tree.StructType | None:
        from ..lower import initial  # noqa: PLC0415

        if any(d.init is not None for d in node.members):
            return node
        if any(initial.needed(m.type) for m in found.members.values()):
            return node
        return None

    def type_of(self, context: Context, node: tree.Node) -> types.Type:
        """The type that is written at a declaration."""
        if isinstance(node, tree.NamedType):
            return self._named(context, node)
        if isinstance(node, tree.ArrayType):
            return self._array(context, node)
        if isinstance(node, tree.PointerType):
            return self._pointer(context, node)
        if isinstance(node, tree.SubrangeType):
            return self._subrange(context, node)
        if isinstance(node, tree.EnumType):
            return self._anonymous(context, node)
        raise StopHere(TYPE, "a type is needed", node.pos)

    def _named(self, context: Context, node: tree.NamedType) -> types.Type:
        key = node.name.upper()
        if key in ("STRING", "WSTRING"):
            length = types.STRING_LENGTH
            if node.size is not None:
                length = self._constant_int(context, node.size)
            if not 1 <= length <= 1 << 24:
                text = f"{length} characters are not possible"
                raise StopHere(RANGE, text, node.pos)
            return types.StringType(length, key == "WSTRING")
        if key in types.ANY_NAMES:
            return types.ANY
        return self._world.type_named(node.name, node.pos)

    def _array(self, context: Context, node: tree.ArrayType) -> types.Type:
        element = self.type_of(context, node.element)
        if any(dim is None for dim in node.dims):
            return types.OpenArray(element, len(node.dims))
        dims = []
        for dim in node.dims:
            assert dim is not None
            low = self._constant_int(context, dim[0])
            high = self._constant_int(context, dim[1])
            if high < low:
                text = f"the bounds {low}..{high} are empty"
                raise StopHere(RANGE, text, dim[0].pos)
            dims.append((low, high))
        found = types.ArrayType(element, tuple(dims))
        if found.size > LARGEST:
            raise StopHere(RANGE, f"{found} is too large", node.pos)
        return found

    def _pointer(self, context: Context, node: tree.PointerType) -> types.Type:
        named = node.target
        if isinstance(named, tree.NamedType):
            key = named.name.upper()
            if key in self._world._open or opening(self._world, key):
                return LazyPointer(self._world, key, node.reference)
        return types.PointerType(
            self.type_of(context, node.target), node.reference
        )

    def _subrange(
        self, context: Context, node: tree.SubrangeType
    ) -> types.Type:
        base = self._world.type_named(node.name, node.pos)
        if not isinstance(base, types.Elementary) or not base.whole:
            text = f"{node.name} cannot have a subrange"
            raise StopHere(TYPE, text, node.pos)
        low = self._constant_int(context, node.low)
        high = self._constant_int(context, node.high)
        if not base.low <= low <= high <= base.high:
            text = f"{low}..{high} is no range of {base}"
            raise StopHere(RANGE, text, node.pos)
        return types.Subrange(base, low, high)

    def _anonymous(self, context: Context, node: tree.EnumType) -> types.Type:
        line, column = node.pos
        label = context.label.replace(".", "_").upper()
        name = f"ENUM_{line}_{column}_{label}"
        definition = tree.TypeDef(node.pos, name, node, None, context.origin)
        self._world.typedefs[name] = definition
        found = self._enumeration(context, definition, node)
        for key in found.values:  # type: ignore[attr-defined]
            self._world.enumerators.setdefault(key, name)
        return found

    def _constant_int(self, context: Context, node: tree.Node) -> int:
        found = expressions.value(context, node)
        base = found.base
        whole = isinstance(base, types.Elementary) and base.whole
        if found.constant is None or not whole:
            raise StopHere(CONSTANT, "a constant number is needed", node.pos)
        return int(found.constant)

    # -- POUs
    def declare(self, what: Class | Routine) -> None:
        """Types and places of a class's or routine's variables."""
        if what.declared:
            return
        if isinstance(what, Class):
            self._class(what)
        else:
            self._routine(what)

    def _class(self, cls: Class) -> None:
        if cls.base is not None:
            self.declare(cls.base)
        context = LoweringContext(
            self._world, cls.origin, cls.name, cls.pou.pos[0], None, cls
        )
        cls.opening = True
        for declaration in constants_first(cls.pou.variables):
            self._guarded(context, cls, declaration, cls.own)
        cls.declared, cls.opening = True, False
        for name, routine in cls.methods.items():
            self._declare_quietly(context, routine)
            if name.startswith(("GET__", "SET__")):
                self._note_property(cls, name, routine)

    def _note_property(self, cls: Class, name: str, routine: Routine) -> None:
        if name.startswith("GET__"):
            cls.properties[name[5:]] = routine.result
        else:
            inputs = routine.of("VAR_INPUT")
            if inputs:
                cls.properties.setdefault(name[5:], inputs[0].type)

    def _declare_quietly(self, context: Context, routine: Routine) -> None:
        try:
            self.declare(routine)
        except StopHere as stop:
            context.error(stop)
            routine.refused = True

    def _routine(self, routine: Routine) -> None:
        routine.declared = True
        origin = routine.origin
        assert origin is not None
        context = LoweringContext(
            self._world,
            origin,
            routine.label,
            routine.pou.pos[0],
            routine,
            routine.owner,
        )
        try:
            if routine.pou.result is not None:
                routine.result = self.type_of(context, routine.pou.result)
                self._add_result(routine)
        except StopHere as stop:
            context.error(stop)
            routine.refused = True
        for declaration in constants_first(routine.pou.variables):
            self._guarded(context, routine, declaration, routine.variables)

    def _add_result(self, routine: Routine) -> None:
        if routine.pou.kind == "setter":
            self._add_set_value(routine)
            return
        name = routine.name.removeprefix("GET__")
        routine.variables[name.upper()] = Variable(
            name, routine.result, "RESULT", storage="local", c="st_result"
        )

    def _add_set_value(self, routine: Routine) -> None:
        name = routine.name.removeprefix("SET__")
        found = Variable(name, routine.result, "VAR_INPUT", storage="local")
        found.c = f"v_{name.upper()}"
        routine.variables[name.upper()] = found
        routine.result = types.VOID

    def _guarded(
        self,
        context: Context,
        holder: Class | Routine,
        declaration: tree.Decl,
        into: dict[str, Variable],
    ) -> None:
        try:
            self._variable(context, holder, declaration, into)
        except StopHere as stop:
            context.error(stop)
            holder.refused = True
            if declaration.name.upper() not in into:
                into[declaration.name.upper()] = Variable(
                    declaration.name,
                    types.VOID,
                    declaration.section,
                    declaration,
                    storage="constant",
                    pending=broken(declaration),
                )

    def _variable(
        self,
        context: Context,
        holder: Class | Routine,
        declaration: tree.Decl,
        into: dict[str, Variable],
    ) -> None:
        key = declaration.name.upper()
        if declaration.section == "VAR_EXTERNAL":
            return
        if key in into and into[key].section != "RESULT":
            text = f"{declaration.name} is declared twice"
            raise StopHere(TWICE, text, declaration.pos)
        if isinstance(holder, Class) and holder.base is not None:  # noqa: SIM102
            if holder.base.variable(key) is not None:
                text = f"{declaration.name} is declared in {holder.base.name}"
                raise StopHere(TWICE, text, declaration.pos)
        self._inherit_initial(declaration)
        type_ = self.type_of(context, declaration.type)
        if declaration.section != "VAR_IN_OUT":
            check_closed(type_, declaration)
        if type_ is types.ANY and declaration.section != "VAR_INPUT":
            raise refuse("ANY outside of VAR_INPUT", declaration.pos)
        found = Variable(
            declaration.name, type_, declaration.section, declaration
        )
        found.read_only = "CONSTANT" in declaration.qualifiers
        found.retain = retained(declaration)
        self._place(context, holder, found)
        into[key] = found

    def _place(
        self, context: Context, holder: Class | Routine, found: Variable
    ) -> None:
        declaration = found.decl
        assert declaration is not None
        in_out = found.section == "VAR_IN_OUT"
        if found.read_only and not in_out:
            found.constant = self._constant(context, found)
        if declaration.address and not _of_each_instance(holder, declaration):
            self._at_address(found, declaration)
        elif isinstance(found.type, types.OpenArray) and not in_out:
            raise refuse("ARRAY [*] outside of VAR_IN_OUT", declaration.pos)
        elif isinstance(holder, Class):
            self._place_member(context, holder, found)
        else:
            self._place_local(context, holder, found)

    def _place_member(
        self, context: Context, cls: Class, found: Variable
    ) -> None:
        section = found.section
        if section == "VAR_STAT":
            self._static(context, found, f"S_{cls.name.upper()}")
        elif section == "VAR_TEMP":
            found.storage, found.c = "local", f"v_{found.name.upper()}"

    def _place_local(
        self, context: Context, routine: Routine, found: Variable
    ) -> None:
        section, owner = found.section, routine.owner
        found.c = f"v_{found.name.upper()}"
        if section == "VAR_INST" and owner is not None:
            found.storage = "member"
            hidden = f"{routine.name}__{found.name}".upper()
            found.name = hidden
            owner.own[hidden] = found
            if owner._layout is not None:
                owner._layout = None
        elif section == "VAR_STAT" or (
            found.read_only and section == "VAR" and found.constant is None
        ):
            self._static(context, found, f"S_{routine.c}")
        elif section in ("VAR_IN_OUT", "VAR_OUTPUT"):
            found.storage = "parameter"
        else:
            found.storage = "local"

    def _static(self, context: Context, found: Variable, area: str) -> None:
        lists = self._world.lists
        if area not in lists:
            lists[area] = VariableList(area, origin=context.origin)
        holder = lists[area]
        holder.variables[found.name.upper()] = found
        found.storage, found.area = "global", area
        member = types.Member(found.name, found.type)
        holder.layout.add(member)
        found.offset = member.offset

    # -- constants and addresses
    def _constant(self, context: Context, found: Variable) -> object:
        """The value of a constant that is known now, else None."""
        declaration = found.decl
        assert declaration is not None
        type_ = found.type
        if not type_.scalar or isinstance(
            type_, (types.PointerType, InterfaceType)
        ):
            return None
        if declaration.init is None:
            return 0
        value = expressions.value(context, declaration.init)
        value = convert.implicit(context, value, type_, declaration.init.pos)
        return value.constant

    def _at_address(self, found: Variable, declaration: tree.Decl) -> None:
        text = declaration.address
        if text.endswith("*"):
            letter = text[1]
            size = max(found.type.size, 1)
            offset = -(-self._free[letter] // 8) * 8
            self._free[letter] = offset + size
            if self._free[letter] > places.IMAGE_SIZE:
                text = f"the image {letter} is full"
                raise StopHere(RANGE, text, declaration.pos)
            bit = None
        else:
            match = _AREA.match(text)
            if match is None:
                text = f"{text} is no address; write %IX0.0 or %QW2"
                raise StopHere(NAME, text, declaration.pos)
            letter, offset, bit = match[1], int(match[3]), match[4]
        if offset + found.type.size > places.IMAGE_SIZE:
            text = f"{text} is outside of the image"
            raise StopHere(RANGE, text, declaration.pos)
        found.storage, found.area = "global", f"IMAGE_{letter}"
        found.offset, found.address = offset, text
        if found.type is types.BOOL and bit is not None:
            found.index = int(bit)

    # -- globals
    def globals(
        self, node: tree.Globals, holder: VariableList, qualified: bool
    ) -> None:
        """Register one list; types are found later."""
        assert node.origin is not None
        for declaration in node.variables:
            self._global(declaration, node.origin, holder, qualified)

    def _global(
        self,
        declaration: tree.Decl,
        origin: Origin,
        holder: VariableList,
        qualified: bool,
    ) -> None:
        world, key = self._world, declaration.name.upper()
        line = declaration.pos[0]
        context = LoweringContext(world, origin, holder.name, line)
        if key in holder.variables:
            text = f"{declaration.name} is declared twice"
            context.error(StopHere(TWICE, text, declaration.pos))
            return
        found = Variable(
            declaration.name, types.VOID, "VAR_GLOBAL", declaration
        )
        found.area = f"G_{holder.name.upper()}"
        found.storage, found.namespace = "global", holder.name
        found.pending = lambda: self._settle(context, found)
        holder.variables[key] = found
        if not qualified:
            if key in world.globals and not holder.library:
                before = world.globals[key].namespace
                if before != holder.name:
                    text = f"{declaration.name} is declared in {before}, too"
                    context.error(StopHere(TWICE, text, declaration.pos))
            world.globals[key] = found

    def _settle(self, context: Context, found: Variable) -> None:
        declaration = found.decl
        assert declaration is not None
        try:
            self._inherit_initial(declaration)
            found.type = self.type_of(context, declaration.type)
            check_closed(found.type, declaration)
            found.read_only = "CONSTANT" in declaration.qualifiers
            found.retain = retained(declaration)
            if found.read_only:
                found.constant = self._constant(context, found)
            if declaration.address:
                self._at_address(found, declaration)
        except StopHere as stop:
            context.error(stop)
            found.pending = broken(declaration)
            raise Cascade(declaration.pos) from None


def _of_each_instance(holder: Class | Routine, declaration: tree.Decl) -> bool:
    """``AT %I*`` of a function block: each instance has its own."""
    is_block = isinstance(holder, Class) and holder.kind == "function_block"
    return is_block and declaration.address.endswith("*")
