"""PLC tasks: the decorator, and finding the tasks of a user's file."""

from __future__ import annotations

import ast
import contextlib
import importlib.util
import inspect
import re
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, overload

_T = TypeVar("_T", bound=type)
_ATTRIBUTE = "__plc_task__"
WATCHDOG_S = 10.0
ST_SUFFIXES = (
    ".st",
    ".exp",
    ".tcpou",
    ".tcdut",
    ".tcgvl",
    ".tcio",
    ".plcproj",
    ".xml",
)
"""Files of a PLC program in Structured Text; a folder of them is one, too."""
_FRAMEWORK = Path(__file__).resolve().parent
_INSTALLED = tuple(
    Path(sysconfig.get_path(key)).resolve()
    for key in ("stdlib", "purelib", "platlib")
)


class PlcError(Exception):
    """The user's PLC program is wrong; the text says where (FILE:LINE) and why."""


class CellStartRefused(BaseException):
    """Raised by a cell that is started while the PLC process reads a task file:
    the file runs that cell itself.
    """


_loading: list[str] = []


@contextlib.contextmanager
def loading(path: Path) -> Iterator[None]:
    """While a task file is read; see ``refuse_cell_start``."""
    _loading.append(str(path))
    try:
        yield
    finally:
        _loading.pop()


def refuse_cell_start() -> None:
    """Called by whatever starts a cell: a script that holds both a task class
    and the call that runs it must not start further cells when the PLC process
    reads it for the class.
    """
    if _loading:
        raise CellStartRefused(
            f"a cell cannot be started while the PLC process reads {_loading[-1]}"
        )


@dataclass(frozen=True)
class TaskSpec:
    """Interval in seconds of the cell's clock; tasks due at the same time run
    in order of priority, lowest first.

    ``watchdog``: seconds of wall time one call may take; 0 switches it off.
    """

    interval: float = 0.001
    priority: int = 0
    watchdog: float = WATCHDOG_S


@overload
def task(interval: _T) -> _T: ...


@overload
def task(
    interval: float = 0.001, priority: int = 0, watchdog: float = WATCHDOG_S
) -> Callable[[_T], _T]: ...


def task(
    interval: Any = 0.001, priority: int = 0, watchdog: float = WATCHDOG_S
) -> Any:
    """Class decorator: an instance's ``cyclic()`` runs every ``interval``
    seconds of the cell's clock.

    ``setup(hli)`` runs once after each attachment, before the first scan.
    Optional: ``finished()`` (after the program's end: may the cell go?) and
    ``result()`` (any JSON value for the report).  A ``cyclic()`` that has not
    returned after ``watchdog`` seconds of wall time ends the PLC with an error
    that names the line (0: never). Without brackets: 1 ms.
    """
    if isinstance(interval, type):
        return task()(interval)
    _check_seconds("interval", interval)
    _check_seconds("watchdog", watchdog)
    if not isinstance(priority, int) or isinstance(priority, bool):
        raise TypeError(f"task priority={priority!r}: a whole number is needed")
    if not interval > 0.0:
        raise ValueError(f"task interval {interval} s: above 0")
    if not watchdog >= 0.0:
        raise ValueError(f"task watchdog {watchdog} s: 0 (off) or more")

    def mark(cls: _T) -> _T:
        if not callable(getattr(cls, "cyclic", None)):
            raise TypeError(f"task {cls.__name__} has no method cyclic()")
        check_methods(cls)
        setattr(cls, _ATTRIBUTE, TaskSpec(interval, priority, watchdog))
        return cls

    return mark


_TIME = re.compile(r"T(?:IME)?#([\d.]+)(ms|us|s)", re.I)
_IN_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}


def _check_seconds(name: str, value: Any) -> None:
    """TypeError for what is no number, with the number of a literal of ST."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return
    found = _TIME.fullmatch(value) if isinstance(value, str) else None
    hint = (
        f"write {name}={float(found[1]) * _IN_SECONDS[found[2].lower()]:g}"
        if found
        else "0.001 is a millisecond"
    )
    raise TypeError(
        f"task {name}={value!r}: a number of seconds is needed; {hint}"
    )


# what the runtime hands to each method
_METHODS = {
    "setup": ("self", "hli"),
    "cyclic": ("self",),
    "finished": ("self",),
    "result": ("self",),
}


def check_methods(cls: type) -> None:
    """TypeError with the place of a method that cannot be called as the runtime
    calls it.
    """
    _check_constructor(cls)
    for name, parameters in _METHODS.items():
        method = inspect.getattr_static(cls, name, None)
        if not inspect.isfunction(method):
            continue
        try:
            inspect.signature(method).bind(*parameters)
        except TypeError:
            code = method.__code__
            raise TypeError(
                f"{code.co_filename}:{code.co_firstlineno}: write"
                f" def {name}({', '.join(parameters)}):"
                f" not def {name}{inspect.signature(method)}"
            ) from None


def _check_constructor(cls: type) -> None:
    """TypeError with its place for a constructor that wants the HLI."""
    made = inspect.getattr_static(cls, "__init__", None)
    if not inspect.isfunction(made):
        return
    wanted = [
        name
        for name, parameter in inspect.signature(made).parameters.items()
        if parameter.default is parameter.empty
        and parameter.kind is parameter.POSITIONAL_OR_KEYWORD
    ]
    if wanted[1:] == ["hli"]:
        code = made.__code__
        raise TypeError(
            f"{code.co_filename}:{code.co_firstlineno}: write"
            " def setup(self, hli): not def __init__(self, hli); a task is made"
            " ahead of its CNC"
        )


def spec_of(cls: type) -> TaskSpec:
    """The class's interval and priority; 1 ms and 0 for a class that is not
    decorated.
    """
    return getattr(cls, _ATTRIBUTE, TaskSpec())


def load_tasks(path: str, qualname: str | None = None) -> list[type]:
    """The task classes of a Python file in the order of their text, or the one
    named (decorated or not).

    Raises PlcError: the file is missing, fails at import, or holds no such
    task.
    """
    module = _import(Path(path))
    if qualname is not None:
        return [_named(module, path, qualname)]
    found = [
        value
        for value in vars(module).values()
        if isinstance(value, type)
        and value.__module__ == module.__name__
        and _ATTRIBUTE in vars(value)
    ]
    if not found:
        raise PlcError(
            f"{path}: no task found; decorate a class that has a method "
            "cyclic() with @task(interval=...)"
        )
    return found


def is_st(path: str | Path) -> bool:
    """Whether a path names Structured Text: by its suffix, or a folder."""
    found = Path(path)
    return found.is_dir() or found.suffix.lower() in ST_SUFFIXES


def _named(module: ModuleType, path: str, qualname: str) -> type:
    value: Any = module
    for part in qualname.split("."):
        value = getattr(value, part, None)
    if not isinstance(value, type) or not callable(
        getattr(value, "cyclic", None)
    ):
        raise PlcError(f"{path}: no class {qualname} with a method cyclic()")
    return value


def _import(path: Path) -> ModuleType:
    if not path.is_file():
        raise PlcError(f"{path}: file not found")
    name = f"plc_program_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise PlcError(f"{path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    folder = str(path.resolve().parent)
    if folder not in sys.path:
        # behind everything installed: neighbours can be imported, nothing is
        # shadowed
        sys.path.append(folder)
    try:
        with loading(path):
            # never an older compiled file
            exec(compile(path.read_bytes(), str(path), "exec"), vars(module))
    except CellStartRefused as refused:
        # the file runs its own cell, and that cell is this one
        _define_below(path, module, refused)
    except (Exception, SystemExit) as error:
        text = describe(error).replace("<PLC program>", str(path))
        raise PlcError(text) from error
    return module


_DEFINITIONS = (
    ast.ClassDef,
    ast.FunctionDef,
    ast.AsyncFunctionDef,
    ast.Import,
    ast.ImportFrom,
    ast.Assign,
    ast.AnnAssign,
)


def _define_below(
    path: Path, module: ModuleType, refused: CellStartRefused
) -> None:
    """What a script defines below the statement that starts its cell.

    Assignments of the cell's results fail here, which is no error.
    """
    source = path.read_bytes()
    lines = [
        line
        for frame, line in traceback.walk_tb(refused.__traceback__)
        if frame.f_code.co_filename == str(path)
    ]
    tree = ast.parse(source, str(path))
    future = [
        one
        for one in tree.body
        if isinstance(one, ast.ImportFrom) and one.module == "__future__"
    ]
    for one in tree.body:
        if one.lineno <= lines[0] or not isinstance(one, _DEFINITIONS):
            continue
        assigned = isinstance(one, (ast.Assign, ast.AnnAssign))
        forgiven = (Exception, CellStartRefused) if assigned else ()
        code = compile(
            ast.Module([*future, one], []),
            str(path),
            "exec",
            dont_inherit=True,
        )
        with contextlib.suppress(*forgiven):
            exec(code, vars(module))


_PLACE_TOLD = re.compile(r"(?P<file>.+?):(?P<line>\d+): (?P<text>.+)")


def describe(error: BaseException) -> str:
    """``FILE:LINE: Type: text`` with the user's own frames below it; the
    framework's frames are left out.

    A text that begins with a place of a file tells a better one than frames do:
    Structured Text has none, a decorator tells of a method below it.
    """
    everything = traceback.extract_tb(error.__traceback__)
    frames = [f for f in everything if is_users(f.filename)]
    if isinstance(error, SyntaxError):
        file, line = error.filename or "<PLC program>", error.lineno or 1
        return f"{file}:{line}: {type(error).__name__}: {error.msg}"
    told = _PLACE_TOLD.match(str(error))
    if told and Path(told["file"]).is_file():
        place = f"{told['file']}:{told['line']}"
        return f"{place}: {type(error).__name__}: {told['text']}"
    text = " ".join(
        f"{type(error).__name__}: {_block_of(error)}{error}".split()
    )
    last = [*everything[-1:], *frames][-1]
    return f"{last.filename}:{last.lineno}: {text}" + "".join(
        f"\n{line}" for line in _trace(frames)
    )


def _block_of(error: BaseException) -> str:
    """The function block in which a TypeError came up, if its text does not
    name it.
    """
    step, name = error.__traceback__, ""
    while step is not None:
        owner = step.tb_frame.f_locals.get("self")
        if type(owner).__module__.startswith("plc_client.blocks"):
            name = type(owner).__name__
        step = step.tb_next
    told = not isinstance(error, TypeError) or name in str(error)
    return "" if told else f"{name}: "


def _trace(frames: list[traceback.FrameSummary]) -> list[str]:
    return [
        line.rstrip()
        for frame in frames
        for line in traceback.format_list([frame])
    ]


def is_users(filename: str) -> bool:
    """Whether a file of code is the user's, not of the framework or Python."""
    if filename.startswith("<frozen"):
        return False
    foreign = (_FRAMEWORK, _FRAMEWORK.parent / "hli", *_INSTALLED)
    return not any(
        folder in Path(filename).resolve().parents for folder in foreign
    )
