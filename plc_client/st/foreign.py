"""Names out of TwinCAT's libraries that are not here: refused, not merely unknown."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import replace

from .errors import REFUSED, Problem

PROJECT = ".plcproj"
_HERE = frozenset(
    [
        "STANDARD",
        "TC2_STANDARD",
        "TC2_SYSTEM",
        "TC2_UTILITIES",
        "TC2_MATH",
        "TC3_MODULE",
        "TCUNIT",
    ]
)
_INCLUDE = re.compile(
    r'<(?:Placeholder|Library)Reference\s+Include="([^",]+)', re.I
)
_UNKNOWN = re.compile(
    r"(?:type|name) ([\w.]+) is unknown|([\w.]+) is no (?:interface|function block);"
)
_FORMS = re.compile(
    r"(?:Tc\d_\w+\.|S?MC_|A(?:XIS|XES)_REF$|ADS|T_Ams|NT_|PlcAppSystemInfo"
    r"|PlcTaskSystemInfo|TwinCAT_SystemInfoVarList|F_CheckMemoryArea"
    r"|FB_(?:ADS|File|EcCoE|EcGet|EcSet|Json|Iot|Socket|SQL|Xml|TcEvent|TcAlarm))",
    re.I,
)


def libraries_of(sources: dict[str, str]) -> list[str]:
    """Libraries that the projects take and that are not here."""
    found: dict[str, None] = {}
    for name, text in sources.items():
        if name.lower().endswith(PROJECT):
            found |= dict.fromkeys(_INCLUDE.findall(text))
    return [name for name in found if name.upper() not in _HERE]


def refused(
    errors: Iterable[Problem],
    libraries: list[str],
    declared: Callable[[str], bool],
) -> list[Problem]:
    """The errors; a name that a missing library may hold is refused by name."""
    return [_one(error, libraries, declared) for error in errors]


def _one(
    error: Problem, libraries: list[str], declared: Callable[[str], bool]
) -> Problem:
    match = _UNKNOWN.match(error.text)
    if match is None:
        return error
    name = match[1] or match[2]
    if declared(name.rpartition(".")[2].upper()):
        return error
    if _FORMS.match(name):
        text = f"{name} of a TwinCAT library is not supported"
    elif libraries:
        few = ", ".join(libraries[:3])
        text = f"{name} is unknown; libraries of the project are not supported: {few}"
    else:
        return error
    return replace(error, code=REFUSED, text=text, construct=name)
