"""Checking a call of a built-in cycle: everything that is wrong with it, before
anything is done.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

from cnc_core.frontend.base.variables import Value
from cnc_core.frontend.isg.cycles.declaration import (
    INVALID,
    MISSING,
    UNKNOWN,
    Cycle,
    Given,
    Parameter,
    Problem,
    Surroundings,
)


def check(
    cycle: Cycle, arguments: Mapping[int, Value], around: Surroundings
) -> tuple[Given, list[Problem]]:
    """The parameters as numbers, and all problems."""
    known = {p.number: p for p in cycle.parameters}
    problems = _names(cycle, arguments)
    values: dict[int, float] = {}
    for number, value in arguments.items():
        if number in known:
            found = _number(known[number], value)
            if isinstance(found, Problem):
                problems.append(found)
            else:
                values[number] = found
    given = Given(values, cycle.parameters, arguments)
    for rule in cycle.rules:
        problems += rule(given, around)
    return given, problems


def glance(
    cycle: Cycle, arguments: Mapping[int, Value | None]
) -> list[Problem]:
    """Problems of a call that is not executed.

    None: a value that is not known yet.
    """
    known = {p.number: p for p in cycle.parameters}
    problems = _names(cycle, arguments)
    for number, value in arguments.items():
        found = (
            _number(known[number], value)
            if number in known and value is not None
            else 0.0
        )
        if isinstance(found, Problem):
            problems.append(found)
    return problems


def _names(cycle: Cycle, arguments: Collection[int]) -> list[Problem]:
    """Parameters that the cycle does not have, and required ones that miss."""
    known = {p.number for p in cycle.parameters}
    unknown = [
        Problem(
            UNKNOWN,
            f"{cycle.name} has no @P{number}, only "
            f"{_ranges([p.number for p in cycle.parameters])}",
            number,
        )
        for number in arguments
        if number not in known
    ]
    return unknown + [
        Problem(
            MISSING,
            f"CYC_PARAM_MISSING: @P{p.number} ({p.text}) is not given",
            p.number,
        )
        for p in cycle.parameters
        if p.required and p.number not in arguments
    ]


def _ranges(numbers: list[int]) -> str:
    """``@P1-8, 13`` for 1 to 8 and 13."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return "@P" + ", ".join(
        f"{first}" if first == last else f"{first}-{last}"
        for first, last in runs
    )


def _number(parameter: Parameter, value: Value) -> float | Problem:
    """The value in its range, or the problem."""
    name = f"@P{parameter.number} ({parameter.text})"
    if isinstance(value, str):
        if value.strip().upper() in parameter.names:
            return parameter.names[value.strip().upper()]
        known = ", ".join(f'"{n}"' for n in parameter.names) or "a number"
        return Problem(
            INVALID,
            f'CYC_PARAM_INVALID: {name} is "{value}", allowed: {known}',
            parameter.number,
        )
    if not math.isfinite(value) or not _in_range(parameter, value):
        wanted = parameter.range_text or "-1e9..1e9"
        return Problem(
            INVALID,
            f"CYC_PARAM_INVALID: {name} is {value:g}, allowed: {wanted}",
            parameter.number,
        )
    return float(round(value)) if parameter.whole else value


def _in_range(parameter: Parameter, value: float) -> bool:
    if parameter.whole and abs(value - round(value)) > 1e-9:
        return False
    if value > parameter.high or value < parameter.low:
        return False
    return not (parameter.above and value <= parameter.low)
