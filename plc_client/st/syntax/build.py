"""Lark's reductions become nodes of the tree; operators find their precedence here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lark import Token, Transformer, v_args

from ..errors import SYNTAX, Position, StopHere, refuse
from . import tree
from .build_units import UnitBuilder

PRECEDENCE = {
    "**": 9,
    "*": 8,
    "/": 8,
    "MOD": 8,
    "+": 7,
    "-": 7,
    "<": 6,
    ">": 6,
    "<=": 6,
    ">=": 6,
    "=": 5,
    "<>": 5,
    "AND": 4,
    "AND_THEN": 4,
    "XOR": 3,
    "OR": 2,
    "OR_ELSE": 2,
}
_WIDTHS = {"X": 1, "B": 8, "W": 16, "D": 32, "L": 64}


def climb(items: list[Any]) -> tree.Node:
    """Operands and operators in turn to a tree; all bind to the left."""
    operands: list[tree.Node] = [items[0]]
    waiting: list[tuple[str, Position]] = []

    def reduce() -> None:
        operator, pos = waiting.pop()
        right = operands.pop()
        operands[-1] = tree.Binary(pos, operator, operands[-1], right)

    for (operator, pos), operand in zip(items[1::2], items[2::2], strict=True):
        level = PRECEDENCE[operator]
        while waiting and PRECEDENCE[waiting[-1][0]] >= level:
            reduce()
        waiting.append((operator, pos))
        operands.append(operand)
    while waiting:
        reduce()
    return operands[0]


def _pos(token: Token) -> Position:
    return token.line or 0, token.column or 0


@v_args(inline=True)
class ExpressionBuilder(Transformer[Any, Any]):
    """Expressions."""

    place: Callable[[Token], Position]

    def binary(self, token: Token) -> tuple[str, Position]:
        word = token.value.upper()
        return ("AND" if word == "&" else word), self.place(token)

    def unary(self, token: Token) -> tuple[str, Position]:
        return token.value.upper(), self.place(token)

    def unary_op(self, operator: Any, operand: Any) -> tree.Node:
        word, pos = operator
        return tree.Unary(pos, word, operand)

    def expr(self, *items: Any) -> tree.Node:
        return items[0] if len(items) == 1 else climb(list(items))

    def name(self, token: Token) -> tree.Node:
        return tree.Name(self.place(token), token.value)

    def global_name(self, _: Token, token: Token) -> tree.Node:
        return tree.Name(self.place(token), token.value, True)

    def this(self, token: Token) -> tree.Node:
        return tree.This(self.place(token))

    def super(self, token: Token) -> tree.Node:
        return tree.Super(self.place(token))

    def direct(self, token: Token) -> tree.Node:
        return tree.Direct(self.place(token), token.value.upper())

    def literal(self, token: Token) -> tree.Node:
        return tree.Literal(self.place(token), token.type, token.value)

    def paren(self, _: Token, inner: tree.Node, __: Token) -> tree.Node:
        return inner

    def member(self, name: tree.Node, _: Token, value: tree.Node) -> Any:
        if not isinstance(name, tree.Name):
            raise StopHere(SYNTAX, "a member's name is needed", name.pos)
        return name.name, value, name.pos

    def struct_init(self, opening: Token, *items: Any) -> tree.Node:
        members = [i for i in items if not isinstance(i, Token)]
        return tree.StructInit(self.place(opening), members)

    def array_init(self, opening: Token, *items: Any) -> tree.Node:
        values = [i for i in items if not isinstance(i, Token)]
        return tree.ArrayInit(self.place(opening), values)

    def member_access(
        self, base: tree.Node, _: Token, name: Token
    ) -> tree.Node:
        return tree.Member(self.place(name), base, name.value)

    def bit_access(self, base: tree.Node, _: Token, number: Token) -> tree.Node:
        return tree.Bit(self.place(number), base, int(number.value))

    def partial_access(
        self, base: tree.Node, _: Token, part: Token
    ) -> tree.Node:
        text = part.value.upper()
        if not text.startswith("%"):
            return tree.Member(self.place(part), base, part.value)
        return tree.Bit(self.place(part), base, int(text[2:]), _WIDTHS[text[1]])

    def dereference(self, base: tree.Node, token: Token) -> tree.Node:
        return tree.Deref(self.place(token), base)

    def index(self, base: tree.Node, *items: Any) -> tree.Node:
        indices = [i for i in items if not isinstance(i, Token)]
        return tree.Index(base.pos, base, indices)

    def call(self, base: tree.Node, _: Token, args: Any, __: Any = None) -> Any:
        arguments = [] if isinstance(args, Token) else args
        return tree.Call(base.pos, base, arguments)

    def operator(self, word: Token) -> tree.Node:
        return tree.Name(self.place(word), word.value)

    operator_call = call

    # -- arguments
    def args(self, *items: Any) -> list[tree.Argument]:
        return [i for i in items if not isinstance(i, Token)]

    def positional(self, value: tree.Node) -> tree.Argument:
        return tree.Argument("", value, False, value.pos)

    def named(self, name: Any, _: Token, value: tree.Node) -> tree.Argument:
        return tree.Argument(_name_of(name), value, False, name.pos)

    def omitted(self, name: Any, _: Token) -> tree.Argument:
        return tree.Argument(_name_of(name), None, False, name.pos)

    def output(self, name: Any, _: Token, value: Any = None) -> tree.Argument:
        return tree.Argument(_name_of(name), value, True, name.pos)


def _name_of(node: tree.Node) -> str:
    if isinstance(node, tree.Name):
        return node.name
    raise StopHere(SYNTAX, "the name of a parameter is needed", node.pos)


@v_args(inline=True)
class StatementBuilder(Transformer[Any, Any]):
    """Statements."""

    place: Callable[[Token], Position]

    def nothing(self, _: Token) -> None:
        return None

    def call_stmt(self, value: tree.Node, _: Token) -> tree.Node:
        return tree.Evaluate(value.pos, value)

    def assign(self, *items: Any) -> tree.Node:
        values = [i for i in items if not isinstance(i, Token)]
        return tree.Assign(values[0].pos, values[:-1], values[-1])

    def set_reset(
        self, target: tree.Node, operator: Token, value: tree.Node, _: Token
    ) -> tree.Node:
        word = operator.value.upper().replace(" ", "")
        return tree.Assign(target.pos, [target], value, word)

    def body(self, *items: Any) -> list[tree.Node]:
        return [i for i in items if i is not None]

    def elsif(self, _: Token, condition: Any, __: Token, body: Any) -> Any:
        return "elsif", condition, body

    def by(self, _: Token, step: tree.Node) -> tree.Node:
        return step

    def if_stmt(self, token: Token, condition: Any, _: Any, *rest: Any) -> Any:
        parts = [i for i in rest if not isinstance(i, Token)]
        branches = [(condition, parts[0])]
        branches += [p[1:] for p in parts[1:] if p[0] == "elsif"]
        otherwise = [p[1] for p in parts[1:] if p[0] == "else"]
        return tree.If(
            self.place(token), branches, otherwise[0] if otherwise else []
        )

    def case_stmt(self, token: Token, value: Any, _: Any, *rest: Any) -> Any:
        parts = [i for i in rest if not isinstance(i, Token)]
        otherwise = None
        branches: list[tree.CaseBranch] = []
        for part in parts:
            if isinstance(part, tuple) and part[0] == "else":
                otherwise = part[1]
            elif isinstance(part, tree.CaseBranch):
                branches.append(part)
            elif part is not None:
                _behind_label(branches, part)
        return tree.Case(self.place(token), value, branches, otherwise)

    def case_labels(self, *items: Any) -> tree.CaseBranch:
        return tree.CaseBranch(
            [i for i in items if not isinstance(i, Token)], []
        )

    def label(self, low: Any, _: Any = None, high: Any = None) -> Any:
        return low, high

    def for_stmt(self, token: Token, *items: Any) -> tree.Node:
        parts = [i for i in items if not isinstance(i, Token)]
        variable, first, last = parts[:3]
        step = parts[3] if len(parts) == 5 else None
        return tree.For(
            self.place(token), variable, first, last, step, parts[-1]
        )

    def while_stmt(
        self, token: Token, condition: Any, _: Any, body: Any, __: Any
    ) -> tree.Node:
        return tree.While(self.place(token), condition, body, False)

    def repeat_stmt(
        self, token: Token, body: Any, _: Any, condition: Any, *__: Any
    ) -> tree.Node:
        return tree.While(self.place(token), condition, body, True)

    def exit_stmt(self, token: Token, _: Token) -> tree.Node:
        return tree.Leave(self.place(token), "EXIT")

    def continue_stmt(self, token: Token, _: Token) -> tree.Node:
        return tree.Leave(self.place(token), "CONTINUE")

    def return_stmt(self, token: Token, _: Token) -> tree.Node:
        return tree.Leave(self.place(token), "RETURN")

    def jump(self, token: Token, name: Token, _: Token) -> tree.Node:
        return tree.Jump(self.place(token), str(name))

    def mark(self, token: Token, _: Token) -> tree.Node:
        return tree.Mark(self.place(token), str(token))

    def guarded(self, token: Token) -> tree.Node:
        raise refuse("__TRY", self.place(token), "check before the access")


def _behind_label(branches: list[tree.CaseBranch], part: tree.Node) -> None:
    if not branches:
        raise StopHere(SYNTAX, "CASE begins with a label", part.pos)
    branches[-1].statements.append(part)


class Builder(ExpressionBuilder, StatementBuilder, UnitBuilder):
    """All of them; ``shift`` moves places to where the text stands in its file."""

    def __init__(self) -> None:
        super().__init__()
        self.line, self.column = 0, 0

    def shift(self, line: int, column: int) -> None:
        """The text begins at this line and column of its file."""
        self.line, self.column = line - 1, column - 1

    def place(self, token: Token) -> Position:
        line, column = token.line or 1, token.column or 1
        if line == 1:
            column += self.column
        return line + self.line, column


def _else(_self: Any, _token: Token, body: Any) -> Any:
    return "else", body


setattr(Builder, "else", v_args(inline=True)(_else))
