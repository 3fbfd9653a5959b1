"""Reductions of declarations, types and whole units."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lark import Token, Transformer, v_args

from ..errors import SYNTAX, Position, StopHere
from . import tree


@v_args(inline=True)
class UnitBuilder(Transformer[Any, Any]):
    """Declarations, types, units."""

    place: Callable[[Token], Position]

    # -- names
    def qname(self, *items: Token) -> tuple[str, Position]:
        text = ".".join(t.value for t in items if t.type == "NAME")
        return text, self.place(items[0])

    def names(self, *items: Token) -> list[Token]:
        return [t for t in items if t.type == "NAME"]

    def modifier(self, token: Token) -> tuple[str, str]:
        return "modifier", token.value.upper()

    def extends(self, *items: Any) -> tuple[str, list[str]]:
        return "extends", [i[0] for i in items if not isinstance(i, Token)]

    def implements(self, *items: Any) -> tuple[str, list[str]]:
        return "implements", [i[0] for i in items if not isinstance(i, Token)]

    # -- types
    def named_type(self, name: Any) -> tree.Node:
        return tree.NamedType(name[1], name[0])

    def sized_type(self, name: Any, _: Token, *rest: Any) -> tree.Node:
        arguments = rest[0] if len(rest) == 2 else []
        if name[0].upper() in ("STRING", "WSTRING") and arguments:
            return tree.NamedType(name[1], name[0], None, arguments[0].value)
        return tree.NamedType(name[1], name[0], arguments)

    def subrange_type(
        self, name: Any, _: Any, low: Any, __: Any, high: Any, ___: Any
    ) -> tree.Node:
        return tree.SubrangeType(name[1], name[0], low, high)

    def bracketed_type(self, name: Any, *items: Any) -> tree.Node:
        values = [i for i in items if not isinstance(i, Token)]
        if name[0].upper() in ("STRING", "WSTRING") and len(values) == 1:
            return tree.NamedType(name[1], name[0], None, values[0])
        return tree.NamedType(name[1], name[0], each=values)

    def array_type(self, token: Token, *items: Any) -> tree.Node:
        parts = [i for i in items if not isinstance(i, Token)]
        dims = [d[0] for d in parts[:-1]]
        return tree.ArrayType(self.place(token), dims, parts[-1])

    def dim(self, low: Any, _: Any = None, high: Any = None) -> Any:
        return [None if isinstance(low, Token) else (low, high)]

    def pointer_type(self, token: Token, _: Token, target: Any) -> tree.Node:
        return tree.PointerType(self.place(token), target, False)

    def ref_to_type(self, token: Token, target: Any) -> tree.Node:
        return tree.PointerType(self.place(token), target, False)

    def reference_type(self, token: Token, _: Token, target: Any) -> tree.Node:
        return tree.PointerType(self.place(token), target, True)

    def enumerator(self, name: Token, _: Any = None, value: Any = None) -> Any:
        return ["enumerator", name.value, value, self.place(name)]

    def enum_type(self, opening: Token, *items: Any) -> tree.Node:
        found = [tuple(i[1:]) for i in items if isinstance(i, list)]
        base = [i[0] for i in items if isinstance(i, tuple)]
        return tree.EnumType(
            self.place(opening), found, base[0] if base else "INT"
        )

    # -- declarations
    def init(self, *items: Any) -> tree.Node:
        values = [i for i in items if not isinstance(i, Token)]
        if len(values) == 1:
            return values[0]  # type: ignore[no-any-return]
        return tree.ArrayInit(values[0].pos, values)

    def decl(self, names: list[Token], *items: Any) -> list[tree.Decl]:
        address = [
            t.value.upper()
            for t in items
            if isinstance(t, Token) and t.type == "DIRECT"
        ]
        nodes = [i for i in items if not isinstance(i, Token)]
        init = nodes[1] if len(nodes) > 1 else None
        where = address[0] if address else ""
        return [
            tree.Decl(self.place(t), t.value, nodes[0], init, where)
            for t in names
        ]

    def section(self, kind: Token, *items: Any) -> tuple[str, list[tree.Decl]]:
        word = kind.value.upper()
        qualifiers = tuple(
            t.value.upper()
            for t in items
            if isinstance(t, Token) and t.type == "QUALIFIER"
        )
        found = [d for item in items if isinstance(item, list) for d in item]
        for declaration in found:
            declaration.section, declaration.qualifiers = word, qualifiers
        return "section", found

    def struct(self, token: Token, *items: Any) -> tree.Node:
        return self._members(token, items, False)

    def union(self, token: Token, *items: Any) -> tree.Node:
        return self._members(token, items, True)

    def _members(self, token: Token, items: Any, union: bool) -> tree.Node:
        found = [d for item in items if isinstance(item, list) for d in item]
        base = [i[1][0] for i in items if isinstance(i, tuple)]
        return tree.StructType(
            self.place(token), found, union, base[0] if base else ""
        )

    def typedef(self, name: Token, *items: Any) -> tree.TypeDef:
        nodes = [i for i in items if isinstance(i, tree.Node)]
        base = [i[1][0] for i in items if isinstance(i, tuple)]
        if base and isinstance(nodes[0], tree.StructType):
            nodes[0].extends = base[0]
        init = nodes[1] if len(nodes) > 1 else None
        return tree.TypeDef(self.place(name), name.value, nodes[0], init)

    def types(self, *items: Any) -> list[tree.TypeDef]:
        return [i for i in items if isinstance(i, tree.TypeDef)]

    def global_vars(self, section: Any) -> tree.Globals:
        variables = section[1]
        pos = variables[0].pos if variables else (1, 1)
        return tree.Globals(pos, variables)

    # -- configuration
    def task(self, _: Token, name: Token, *items: Any) -> tree.Node:
        arguments = next(i for i in items if isinstance(i, list))
        return tree.TaskDecl(self.place(name), name.value, arguments)

    def program_instance(self, _: Token, name: Token, *items: Any) -> tree.Node:
        task = [
            t.value for t in items if isinstance(t, Token) and t.type == "NAME"
        ]
        kind = next(i for i in items if isinstance(i, tuple))
        return tree.ProgramInstance(
            self.place(name), name.value, task[0] if task else "", kind[0]
        )

    def resource(self, *items: Any) -> list[Any]:
        return [i for i in items if not isinstance(i, Token)]

    def configuration(
        self, token: Token, _: Token, *items: Any
    ) -> tree.Configuration:
        found = tree.Configuration(self.place(token))
        for item in _flat(items):
            if isinstance(item, tree.TaskDecl):
                found.tasks.append(item)
            elif isinstance(item, tree.ProgramInstance):
                found.programs.append(item)
            elif isinstance(item, tuple):
                found.variables += item[1]
        return found

    # -- heads
    def program_head(self, _: Token, *items: Any) -> tree.Pou:
        return self._head("program", items)

    def function_head(self, _: Token, *items: Any) -> tree.Pou:
        return self._head("function", items)

    def block_head(self, _: Token, *items: Any) -> tree.Pou:
        return self._head("function_block", items)

    def interface_head(self, _: Token, *items: Any) -> tree.Pou:
        return self._head("interface", items)

    def method_head(self, _: Token, *items: Any) -> tree.Pou:
        return self._head("method", items)

    def property_head(self, _: Token, *items: Any) -> tree.Pou:
        return self._head("property", items)

    def action_head(self, _: Token, name: Any, *__: Any) -> tree.Pou:
        return tree.Pou(name[1], "action", name[0], frozenset())

    def _head(self, kind: str, items: Any) -> tree.Pou:
        name = next(
            i for i in items if isinstance(i, Token) and i.type == "NAME"
        )
        pairs = [i for i in items if isinstance(i, tuple)]
        modifiers = frozenset(v for k, v in pairs if k == "modifier")
        result = [i for i in items if isinstance(i, tree.Node)]
        pou = tree.Pou(
            self.place(name),
            kind,
            name.value,
            modifiers,
            result[0] if result else None,
        )
        for key, value in pairs:
            if key in ("extends", "implements"):
                setattr(pou, key, value)
        return pou

    # -- whole units
    def _filled(self, pou: tree.Pou, *items: Any) -> tree.Pou:
        for item in items:
            if isinstance(item, tuple):
                pou.variables += item[1]
            elif isinstance(item, tree.Pou):
                pou.children.append(item)
            elif isinstance(item, Token):
                pou.end = self.place(item)
            elif item is not None:
                pou.statements.append(item)
        return pou

    program = function = function_block = method = _filled
    interface = property = action = _filled

    def getter(self, token: Token, *items: Any) -> tree.Pou:
        pou = tree.Pou(self.place(token), "getter", "GET", frozenset())
        return self._filled(pou, *items)

    def setter(self, token: Token, *items: Any) -> tree.Pou:
        pou = tree.Pou(self.place(token), "setter", "SET", frozenset())
        return self._filled(pou, *items)

    def unit(self, item: Any) -> Any:
        return item

    def head(self, first: tree.Pou, *items: Any) -> tree.Pou:
        return self._filled(first, *items)

    def accessor(self, *items: Any) -> tree.Pou:
        pairs = [i for i in items if isinstance(i, tuple)]
        modifiers = frozenset(v for k, v in pairs if k == "modifier")
        accessor = tree.Pou((1, 1), "accessor", "", modifiers)
        rest = (i for i in items if not _is_modifier(i))
        return self._filled(accessor, *rest)


def _is_modifier(item: Any) -> bool:
    return isinstance(item, tuple) and item[0] == "modifier"


def _flat(items: Any) -> list[Any]:
    found: list[Any] = []
    for item in items:
        if isinstance(item, list):
            found += _flat(item)
        else:
            found.append(item)
    return found


def misplaced(pos: Position, what: str) -> StopHere:
    """The error for a part that stands where it does not belong."""
    return StopHere(SYNTAX, f"{what} does not belong here", pos)
