"""The command line ``hli-cosim``; every command and every JSON field is named
in the README and the docs.

Exit status: 0 success, 1 program or user error, 2 wrong usage, 130 interrupted.
"""

from __future__ import annotations

import ctypes
import signal
import sys
from typing import Any, NoReturn, Protocol, runtime_checkable

import typer

from hli.errors import HliError

from . import commands  # noqa: F401  (registers them)
from .commands.console import (
    INTERRUPTED,
    app,
    emit,
    emitted,
    say_error,
    told_interrupts,
)
from .errors import CncError


@runtime_checkable
class WrongUsage(Protocol):
    """An error of the command-line parser, whichever package it comes from."""

    exit_code: int

    def show(self) -> None:
        """Print the error and the usage."""
        ...


def main() -> None:
    """Entry point: runs a command and turns every expected failure into its
    exit status.
    """
    # also where the caller had it ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # so that what runs is ended and the recording kept
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # nohup
        signal.signal(signal.SIGHUP, lambda *_: sys.exit(129))
    try:
        code = app(standalone_mode=False, prog_name="hli-cosim")
        # the parser has made a status of Ctrl-C
        if code == INTERRUPTED:
            _interrupted()
        sys.exit(code if isinstance(code, int) else 0)
    except (KeyboardInterrupt, typer.Abort):
        _interrupted()
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)
    except Exception as error:
        sys.exit(_failed(error))


def _interrupted() -> NoReturn:
    """Ctrl-C: a line, unless the command has told of it, and the status."""
    if not told_interrupts:
        sys.stderr.write("interrupted\n")
    # Python ends itself by the signal, whatever the status, where Ctrl-C fell
    # into code that a library makes at run time.  The next text that is executed
    # lets it forget that.
    ctypes.pythonapi.PyRun_SimpleString(b"pass")
    sys.exit(INTERRUPTED)


def _numbered(error: Exception) -> CncError:
    """An expected failure as an error with a number."""
    if isinstance(error, CncError):
        return error
    if isinstance(error, HliError):
        return CncError(error.code, str(error))
    if isinstance(error, OSError):
        return CncError(
            901004 if error.filename else 901002,
            f"{error.filename or ''}: {error.strerror}",
        )
    return CncError(
        905015 if "segment name" in str(error) else 900012, str(error)
    )


def _failed(error: Exception) -> int:
    """Print an expected failure and give its status; anything else is a bug and
    keeps its traceback.

    With --json standard output gets one object all the same, unless the command
    has printed something already.
    """
    # wrong usage, found by the command-line parser
    if isinstance(error, WrongUsage):
        error.show()
        return error.exit_code
    if not isinstance(error, CncError | HliError | OSError | ValueError):
        raise error
    numbered = _numbered(error)
    for each in (numbered, *numbered.also):
        say_error(each)
    if "--json" in sys.argv and not emitted:
        emit(_empty_result(numbered))
    return 1


def _empty_result(error: CncError) -> dict[str, Any]:
    """What --json prints when a command ends before it has a result:
    ``errors``, for ``run`` the whole run object.
    """
    if "run" in sys.argv[1:2]:
        from .cell import RunResult  # noqa: PLC0415

        return RunResult(
            end="error", errors=[e.as_json() for e in (error, *error.also)]
        ).as_json()
    return {"errors": [e.as_json() for e in (error, *error.also)]}


if __name__ == "__main__":
    main()
