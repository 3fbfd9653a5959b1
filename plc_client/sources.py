"""Task classes of a user's file, be it Python or Structured Text."""

from __future__ import annotations

from collections.abc import Sequence

from .task import is_st
from .task import load_tasks as load_python


def load_tasks(
    path: str,
    qualname: str | None = None,
    words: Sequence[str] = (),
    tell_on: int = 2,
) -> list[type]:
    """The task classes of a file, or the one class that is named.

    ``words``: options of Structured Text, as docs/st.md has them.
    ``tell_on``: descriptor for lines of a running program in Structured Text.

    PlcError: the file is missing, is wrong, or holds no such task.
    """
    if is_st(path) and qualname is None:
        # a Python task never loads the compiler
        from .st.machine.tasks import load_st, options_of  # noqa: PLC0415

        return load_st(path, options_of(words), tell_on)
    return load_python(path, qualname)
