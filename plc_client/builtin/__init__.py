"""Built-in PLC programs; each module holds one task class ``Plc`` that takes
its arguments as a dict.
"""

from __future__ import annotations

import importlib

NAMES = ("acknowledge", "demo", "query")


def load(name: str) -> type:
    """The task class of a built-in program; ValueError for an unknown name."""
    if name not in NAMES:
        raise ValueError(f"built-in PLC {name!r}: {', '.join(NAMES)}")
    cls: type = importlib.import_module(f"{__name__}.{name}").Plc
    return cls
