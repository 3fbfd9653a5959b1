"""The syntax tree.  ``pos`` is line and column in the file."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..errors import Origin, Position
from ..source.text import Attribute


# -- expressions
@dataclass(slots=True)
class Node:
    """Anything with a place."""

    pos: Position


@dataclass(slots=True)
class Name(Node):
    """``x``; ``everywhere`` for ``.x``, which skips local names."""

    name: str
    everywhere: bool = False


@dataclass(slots=True)
class This(Node):
    """``THIS``."""


@dataclass(slots=True)
class Super(Node):
    """``SUPER``."""


@dataclass(slots=True)
class Direct(Node):
    """``%IX0.1``."""

    address: str


@dataclass(slots=True)
class Literal(Node):
    """A number, text, time or date as it was written; see literals.py."""

    kind: str
    text: str


@dataclass(slots=True)
class Member(Node):
    """``base.name``."""

    base: Node
    name: str


@dataclass(slots=True)
class Bit(Node):
    """``base.3``; ``width`` above 1 for ``base.%B1``."""

    base: Node
    number: int
    width: int = 1


@dataclass(slots=True)
class Deref(Node):
    """``base^``."""

    base: Node


@dataclass(slots=True)
class Index(Node):
    """``base[i, k]``."""

    base: Node
    indices: list[Node]


@dataclass(slots=True)
class Argument:
    """``value``, ``name := value`` or, with ``out``, ``name => value``."""

    name: str
    value: Node | None
    out: bool
    pos: Position


@dataclass(slots=True)
class Call(Node):
    """``base(arguments)``."""

    base: Node
    arguments: list[Argument]


@dataclass(slots=True)
class Unary(Node):
    """``NOT x``, ``-x``, ``+x``."""

    operator: str
    operand: Node


@dataclass(slots=True)
class Binary(Node):
    """Two operands; the operator in capitals."""

    operator: str
    left: Node
    right: Node


@dataclass(slots=True)
class StructInit(Node):
    """``(a := 1, b := 2)``."""

    members: list[tuple[str, Node, Position]]


@dataclass(slots=True)
class ArrayInit(Node):
    """``[1, 2, 3(4)]``; a list without brackets is one, too."""

    items: list[Node]


# -- types as they are written
@dataclass(slots=True)
class NamedType(Node):
    """``INT``, ``FB_Valve``; with the arguments of FB_init or a length.

    ``each`` holds FB_init's arguments of an array's elements in their order.
    """

    name: str
    arguments: list[Argument] | None = None
    size: Node | None = None
    each: list[Node] | None = None


@dataclass(slots=True)
class SubrangeType(Node):
    """``INT (0..10)``."""

    name: str
    low: Node
    high: Node


@dataclass(slots=True)
class ArrayType(Node):
    """``ARRAY [0..3, *] OF element``; None is a star."""

    dims: list[tuple[Node, Node] | None]
    element: Node


@dataclass(slots=True)
class PointerType(Node):
    """``POINTER TO target`` or ``REFERENCE TO target``."""

    target: Node
    reference: bool


@dataclass(slots=True)
class EnumType(Node):
    """``(a, b := 5) INT``."""

    items: list[tuple[str, Node | None, Position]]
    base: str


@dataclass(slots=True)
class StructType(Node):
    """``STRUCT`` or ``UNION`` with its members."""

    members: list[Decl]
    union: bool
    extends: str = ""


# -- declarations
@dataclass(slots=True)
class Decl(Node):
    """One variable."""

    name: str
    type: Node
    init: Node | None
    address: str
    section: str = ""
    qualifiers: tuple[str, ...] = ()
    attributes: tuple[str, ...] = ()


@dataclass(slots=True)
class TypeDef(Node):
    """One named type."""

    name: str
    type: Node
    init: Node | None
    origin: Origin | None = None
    attributes: list[Attribute] = field(default_factory=list)
    namespace: str = ""


@dataclass(slots=True)
class Pou(Node):
    """Program, function, function block, interface, method, property, action.

    ``kind``: ``program``, ``function``, ``function_block``, ``interface``,
    ``method``, ``getter``, ``setter``, ``property``, ``action``.
    """

    kind: str
    name: str
    modifiers: frozenset[str]
    result: Node | None = None
    extends: list[str] = field(default_factory=list)
    implements: list[str] = field(default_factory=list)
    variables: list[Decl] = field(default_factory=list)
    children: list[Pou] = field(default_factory=list)
    statements: list[Node] = field(default_factory=list)
    origin: Origin | None = None
    attributes: list[Attribute] = field(default_factory=list)
    end: Position = (0, 0)
    unit: Any = None
    """The stretch of text it was read from, where its C is kept."""
    outlined: bool = False
    """Its statements were left out: its C is there already."""

    def has(self, attribute: str) -> bool:
        """Whether it carries ``{attribute 'name'}``."""
        return any(a.name == attribute for a in self.attributes)


@dataclass(slots=True)
class Globals(Node):
    """One list of global variables."""

    variables: list[Decl]
    namespace: str = ""
    origin: Origin | None = None
    attributes: list[Attribute] = field(default_factory=list)


@dataclass(slots=True)
class TaskDecl(Node):
    """``TASK name(INTERVAL := T#1ms, PRIORITY := 1)``."""

    name: str
    arguments: list[Argument]


@dataclass(slots=True)
class ProgramInstance(Node):
    """``PROGRAM name WITH task : type``."""

    name: str
    task: str
    type: str


@dataclass(slots=True)
class Configuration(Node):
    """``CONFIGURATION`` with its tasks and programs."""

    tasks: list[TaskDecl] = field(default_factory=list)
    programs: list[ProgramInstance] = field(default_factory=list)
    variables: list[Decl] = field(default_factory=list)
    origin: Origin | None = None


# -- statements
@dataclass(slots=True)
class Assign(Node):
    """``targets[0] := targets[1] := value``; operator ``:=``, ``S=``, ``R=``, ``REF=``."""

    targets: list[Node]
    value: Node
    operator: str = ":="


@dataclass(slots=True)
class Evaluate(Node):
    """An expression as a statement: a call."""

    value: Node


@dataclass(slots=True)
class If(Node):
    """Conditions with their statements, then ``ELSE``."""

    branches: list[tuple[Node, list[Node]]]
    otherwise: list[Node]


@dataclass(slots=True)
class CaseBranch:
    """Labels as (low, high or None) and their statements."""

    labels: list[tuple[Node, Node | None]]
    statements: list[Node]


@dataclass(slots=True)
class Case(Node):
    """``CASE value OF``."""

    value: Node
    branches: list[CaseBranch]
    otherwise: list[Node] | None


@dataclass(slots=True)
class For(Node):
    """``FOR variable := first TO last BY step DO``."""

    variable: Node
    first: Node
    last: Node
    step: Node | None
    statements: list[Node]


@dataclass(slots=True)
class While(Node):
    """``WHILE condition DO``; ``REPEAT`` when the test stands at the end."""

    condition: Node
    statements: list[Node]
    test_last: bool


@dataclass(slots=True)
class Leave(Node):
    """``EXIT``, ``CONTINUE``, ``RETURN``."""

    word: str


@dataclass(slots=True)
class Jump(Node):
    """``JMP name;``."""

    name: str


@dataclass(slots=True)
class Mark(Node):
    """``name:``."""

    name: str


Unit = Pou | Globals | Configuration | list[TypeDef]
