"""The commands and their options, from typer.

Only members that every version of typer has are used.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from typing import Any

import typer

from cnc_core.cli import app

from .texts import table


def command_line(_: str) -> str:
    """Every command with its arguments and options."""
    out = []
    for name, command in commands(typer.main.get_command(app)):
        rows = [parameter_row(one) for one in filter(shown, command.params)]
        rows.sort(key=lambda row: row[0] if row[0].startswith("`-") else "")
        said = " ".join((command.help or "").split("\f")[0].split())
        purpose, _, example = said.partition(" Example: ")
        purpose += f"\n\nExample: `{example}`" if example else ""
        body = table(("Argument or option", "Default", "Meaning"), rows)
        out.append(f"## {name}\n\n{purpose}\n\n{body}")
    return "\n".join(out)


def commands(group: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every command by its full name; groups are unfolded."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, f"{prefix}{name} ")
        elif not command.hidden:
            yield prefix + name, command


def shown(one: Any) -> bool:
    return one.name != "help" and not getattr(one, "hidden", False)


def parameter_row(one: Any) -> list[str]:
    """Names, default, help text."""
    flag = getattr(one, "is_flag", False)
    names = [*one.opts, *one.secondary_opts]
    if not names[0].startswith("-"):
        spelled = f"`{one.metavar or one.name.upper()}`"
    elif flag:
        spelled = ", ".join(f"`{name}`" for name in names)
    else:
        spelled = ", ".join(f"`{name} VALUE`" for name in names)
    said = " ".join((getattr(one, "help", None) or "-").split())
    return [spelled, default_of(one), said.replace("|", "\\|")]


def default_of(one: Any) -> str:
    """The default's text; typer and click have several words for none."""
    value = one.default.value if isinstance(one.default, Enum) else one.default
    if one.required:
        return "required"
    if value in (None, False, (), [], "") or not isinstance(
        value, str | int | float | tuple | list
    ):
        return str(value) if hasattr(value, "parts") else "-"
    return str(value)
