"""The structures of the HLI as types: ``from hli.structures import HLI_CHANNEL``.

The classes are those of ``hli.view.view_class``.  Editors and type checkers read
``structures.pyi``, which ``docs/generate.py --write`` makes from the layout.
"""

from __future__ import annotations

from typing import Any

from . import layout
from .view import view_class

_STRUCTURES = {one.__name__: one for one in layout.structures()}
__all__ = list(_STRUCTURES)


def __getattr__(name: str) -> Any:
    if name in _STRUCTURES:
        return view_class(_STRUCTURES[name])
    raise AttributeError(f"module {__name__!r} has no structure {name!r}")


def __dir__() -> list[str]:
    return __all__
