"""What passes in silence and should not: warnings with the mend.

They cost a scan nothing: the text of a task is looked at before it runs, times
and blocks when it has run.
"""

from __future__ import annotations

import ast
import functools
import inspect
import sys
import textwrap
import time
from collections.abc import Iterator
from typing import Any

from hli import layout
from hli.owners import cnc_writes, status_names

from .blocks.base import FunctionBlock
from .blocks.feed_control import FeedControl
from .blocks.level import Override
from .program import Program

LONG_INTERVAL_S = 1.0
MEASURED_SCANS = 3
WAITS = "a scan must not wait: no sleep or input, TON for times"
NOT_EACH_SCAN = ("__init__", "setup", "finished", "result")
AREAS = tuple(
    (area, {field[0] for field in structure._fields_})
    for area, structure in (
        ("gpCh", layout.HLI_CHANNEL),
        ("gpAx", layout.HLI_AXIS),
    )
)
WAITING: tuple[Any, ...] = (time.sleep, input)
Function = ast.FunctionDef | ast.AsyncFunctionDef


def of_class(program: Program) -> list[str]:
    """Warnings of a task's interval and text."""
    cls, interval = type(program.instance), program.spec.interval
    bodies = _bodies(cls)
    if not bodies:  # no Python: Structured Text writes times with units
        return _of_compiled(program, "st_warnings")
    found = []
    if interval >= LONG_INTERVAL_S:
        found.append(
            f"task {program.name}: interval {interval:g} s; intervals are in s:"
            f" for ms write interval={interval / 1000.0:g}"
        )
    found += [
        f"task {program.name}: assigns {name}, which the CNC writes in each"
        " cycle; write command_w or another _w member"
        for name in sorted(set(_written(bodies)))
    ]
    found += [f"task {program.name}: {text}" for text in _unheard(bodies, cls)]
    found += [
        f"task {program.name}: {name}() calls {called}(); {WAITS}"
        for name, called in _waits(bodies, _globals(cls))
    ][:1]
    return found


def of_run(program: Program) -> list[str]:
    """Warnings of what a task has done: its time, inputs that blocks refused."""
    return [
        *_of_times(program),
        *_of_blocks(program),
        *_of_fractions(program),
        *(
            f"task {program.name}: {text}"
            for text in _of_compiled(program, "st_findings")
        ),
    ]


def _of_compiled(program: Program, method: str) -> list[str]:
    """What a program in Structured Text tells itself."""
    tell = getattr(type(program.instance), method, None)
    return list(tell(program.instance)) if tell is not None else []


def _of_times(program: Program) -> list[str]:
    """A warning where ``cyclic()`` takes longer than its interval."""
    times, interval = program.times, program.spec.interval
    if times.n < MEASURED_SCANS or times.total <= times.n * interval * 1e9:
        return []
    if any(WAITS in text for text in program.warnings):
        return []
    return [
        f"task {program.name}: cyclic() takes {times.total / times.n / 1e6:.3g}"
        f" ms, its interval is {interval * 1e3:g} ms; {WAITS}"
    ]


def _of_blocks(program: Program) -> list[str]:
    """A warning for each block whose inputs were out of range."""
    attributes = getattr(program.instance, "__dict__", {})
    return [
        f"task {program.name}: {name} ({type(block).__name__}) got an input out"
        f" of range in {block.refused} scans, and nothing was sent; its error"
        " tells it"
        for name, block in attributes.items()
        if isinstance(block, FunctionBlock) and block.refused
    ]


def _of_fractions(program: Program) -> list[str]:
    """A warning for an override below 1 %: a factor was meant."""
    attributes = getattr(program.instance, "__dict__", {})
    commanded = {
        name: block._commanded()
        for name, block in attributes.items()
        if isinstance(block, FeedControl | Override)
    }
    return [
        f"task {program.name}: {name} commands an override of {percent:g} %;"
        f" overrides are in percent: {100.0 * percent:g} for {percent:g}"
        for name, percent in commanded.items()
        if 0.0 < percent < 1.0
    ]


def _globals(cls: type) -> dict[str, Any]:
    module = sys.modules.get(cls.__module__)
    return dict(vars(module)) if module else {}


def _bodies(cls: type) -> list[Function]:
    """The methods of a class and of its bases, and the functions of its module
    that they call by name; none where there is no source.
    """
    found: list[Function] = []
    for base in cls.__mro__[:-1]:
        if base.__module__.startswith("plc_client."):
            continue
        tree = _tree(base)
        if tree is not None:
            found += [n for n in ast.walk(tree) if isinstance(n, Function)]
    called = {
        node.func.id
        for body in found
        for node in ast.walk(body)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    for name in sorted(called):
        function = _globals(cls).get(name)
        if (
            inspect.isfunction(function)
            and function.__module__ == cls.__module__
        ):
            tree = _tree(function)
            body = tree.body if tree is not None else []
            found += [node for node in body if isinstance(node, Function)]
    return found


@functools.lru_cache(maxsize=64)
def _tree(thing: Any) -> ast.Module | None:
    try:
        return ast.parse(textwrap.dedent(inspect.getsource(thing)))
    except (OSError, TypeError, SyntaxError):
        return None


def _written(bodies: list[Function]) -> Iterator[str]:
    """Names that the CNC writes and the bodies assign, or assign below."""
    symbols = dict(_symbols(bodies))
    for target in _targets(bodies):
        chain = list(_chain(target))
        status = [part for part in chain if part in status_names()]
        member = _in_area(chain)
        if status:
            yield status[0]
        elif member and cnc_writes(member):
            yield member.partition(".")[2]
        if isinstance(target, ast.Attribute) and target.attr == "value":
            path = _path_of(target.value) or symbols.get(
                ast.unparse(target.value)
            )
            if path and cnc_writes(path):
                yield path


def _in_area(chain: list[str]) -> str:
    """The symbol path of ``a.b[0].c`` below the channel or axis that has a
    member of the name ``a``; empty if none has.
    """
    for area, names in AREAS:
        for k, name in enumerate(chain):
            if name in names:
                return ".".join([area, *reversed(chain[: k + 1])])
    return ""


def _unheard(bodies: list[Function], cls: type) -> Iterator[str]:
    """Commands that the CNC does not look at, for what must be set with them is
    named nowhere in the module.
    """
    text = _text_of(sys.modules.get(cls.__module__))
    chains = [list(_chain(target)) for target in _targets(bodies)]
    # of channel.bahn_mc_control.override.command_w: override
    units = {"".join(c[1:2]) for c in chains if c[:1] == ["command_w"]}
    if units and "enable_w" not in text:
        yield (
            "writes command_w, and never enable_w; the CNC looks at a unit while"
            " its enable_w is TRUE"
        )
    for name in sorted(units & {"override", "rapid_override"}):
        if f"{name}_valid" not in text:
            yield (
                f"writes {name}.command_w, and never {name}_valid; the CNC looks"
                f" at {name} while {name}_valid is TRUE"
            )


@functools.lru_cache(maxsize=64)
def _text_of(module: Any) -> str:
    """The source of a module; empty where there is none."""
    try:
        return inspect.getsource(module)
    except (OSError, TypeError):
        return ""


def _targets(bodies: list[Function]) -> Iterator[ast.expr]:
    for body in bodies:
        for node in ast.walk(body):
            if (
                isinstance(node, ast.Attribute | ast.Subscript)
                and isinstance(node.ctx, ast.Store)
                and not _is_own(node)
            ):
                yield node


def _is_own(node: ast.Attribute | ast.Subscript) -> bool:
    """``self.name``: the task's own attribute, whatever it is called."""
    return isinstance(node.value, ast.Name) and node.value.id == "self"


def _chain(node: ast.expr) -> Iterator[str]:
    """Attribute names of ``a.b[0].c``, the last one first."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        if isinstance(node, ast.Attribute):
            yield node.attr
        node = node.value


def _symbols(bodies: list[Function]) -> Iterator[tuple[str, str]]:
    """(variable, path) of ``variable = hli.symbol("path")``."""
    for body in bodies:
        for node in ast.walk(body):
            if isinstance(node, ast.Assign):
                path = _path_of(node.value)
                if path:
                    yield ast.unparse(node.targets[0]), path


def _path_of(node: ast.expr) -> str:
    """The path of ``x.symbol("path")``."""
    if (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "symbol"
        and node.args
        and isinstance(node.args[0], ast.Constant)
    ):
        return str(node.args[0].value)
    return ""


def _waits(
    bodies: list[Function], known: dict[str, Any]
) -> Iterator[tuple[str, str]]:
    """(function, what it calls) where a function of each scan waits."""
    known = {"input": input} | known
    for body in bodies:
        if body.name in NOT_EACH_SCAN:
            continue
        for node in ast.walk(body):
            if isinstance(node, ast.Call):
                target = _resolved(node.func, known)
                if any(target is one for one in WAITING):
                    yield body.name, ast.unparse(node.func)


def _resolved(node: ast.expr, known: dict[str, Any]) -> Any:
    """What ``name`` or ``module.name`` means."""
    if isinstance(node, ast.Name):
        return known.get(node.id)
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        module = known.get(node.value.id)
        return (
            getattr(module, node.attr, None)
            if inspect.ismodule(module)
            else None
        )
    return None
