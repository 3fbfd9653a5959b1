"""The entry of ``hli-cosim``: Ctrl-C is one line from the first moment on."""

from __future__ import annotations

import os
import signal
from typing import Any

INTERRUPTED = 130


def _leave(*_: Any) -> None:
    """Nothing has begun yet, so nothing is left behind."""
    os.write(2, b"interrupted\n")
    os._exit(INTERRUPTED)


def main() -> None:
    """Read the packages, which takes a while; then the command line."""
    signal.signal(signal.SIGINT, _leave)
    from .cli import main as run  # noqa: PLC0415

    run()


if __name__ == "__main__":
    main()
