"""Literals and names of enumerators as values."""

from __future__ import annotations

import math

from ..errors import RANGE, TYPE, Position, StopHere
from ..model import literals, types
from ..syntax import tree
from . import convert
from .context import Context
from .value import Value, constant


def literal(context: Context, node: tree.Literal) -> Value:
    """A literal of the source."""
    text, pos = node.text, node.pos
    if node.kind in ("INT", "BASED"):
        number = literals.whole(text, pos)
        if number > types.ULINT.high:
            raise StopHere(TYPE, f"{text} has more than 64 bits", pos)
        found = constant(literals.whole_type(number), number, True)
        found.exact = node.kind == "BASED"
        return found
    if node.kind == "REAL":
        return constant(types.LREAL, _real(text, types.LREAL, pos), True)
    if node.kind in ("STRING", "WSTRING"):
        return text_literal(
            context, literals.text_of(text), text[0] == '"', pos
        )
    return _typed_literal(context, text, pos)


def _real(text: str, base: types.Elementary, pos: Position) -> float:
    """A finite number of a type."""
    number = float(text.replace("_", ""))
    if math.isinf(convert.cast_constant(number, types.LREAL, base)):
        raise StopHere(RANGE, f"{text} does not fit {base}", pos)
    return number


def text_literal(
    context: Context, text: str, wide: bool, pos: Position
) -> Value:
    """A text as C data, every character as a number or a letter."""
    if wide:
        codes = list(text.encode("utf-16-le"))
        pairs = zip(codes[::2], codes[1::2], strict=True)
        numbers = ", ".join(str(low + 256 * high) for low, high in pairs)
        name = f"w{context.number()}"
        inside = f"{numbers}, 0" if numbers else "0"
        context.statics.append(f"static const st_u16 {name}[] = {{{inside}}};")
        size = len(codes) // 2
        type_ = types.StringType(size, True)
        return Value(type_, f"((st_ptr){name})", constant=text)
    try:
        data = text.encode("cp1252")
    except UnicodeEncodeError:
        data = text.encode("utf-8")
    escaped = "".join(_escaped(byte) for byte in data)
    type_ = types.StringType(len(data))
    return Value(type_, f'((st_ptr)"{escaped}")', constant=text)


def _escaped(byte: int) -> str:
    character = chr(byte)
    if byte < 128 and (character.isalnum() or character == " "):
        return character
    return f"\\{byte:03o}"


def _typed_literal(context: Context, text: str, pos: Position) -> Value:
    prefix, _, rest = text.partition("#")
    key = prefix.upper()
    if literals.is_timed(key):
        return constant(*literals.timed(key, rest, pos))
    if key in ("STRING", "WSTRING"):
        inner = literals.text_of(rest)
        return text_literal(context, inner, key == "WSTRING", pos)
    type_ = context.world.type_named(prefix, pos)
    if isinstance(type_, types.EnumType):
        return enumerator(type_, rest, pos)
    if type_ is types.BOOL:
        return constant(type_, int(rest.upper() in ("TRUE", "1")))
    base = types.plain(type_)
    if isinstance(base, types.Elementary) and base.family == "real":
        return constant(type_, _real(rest, base, pos))
    if not isinstance(base, types.Elementary) or not base.whole:
        raise StopHere(TYPE, f"{prefix}# is no prefix of a literal", pos)
    number = literals.whole(rest, pos)
    bits = (1 << base.bits) - 1
    if not base.low <= number <= base.high and not (
        "#" in rest and 0 <= number <= bits
    ):
        raise StopHere(TYPE, f"{rest} does not fit {prefix}", pos)
    return constant(type_, base.wrap(number))


def enumerator(type_: types.EnumType, name: str, pos: Position) -> Value:
    """A value of an enumeration by its name."""
    key = name.upper()
    if key not in type_.values:
        known = ", ".join(list(type_.spelled.values())[:8])
        text = f"{type_} has no {name}; it has {known}"
        raise StopHere(TYPE, text, pos)
    return constant(type_, type_.values[key])
