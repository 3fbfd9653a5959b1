"""Seeds and cases of which a plain run takes the first, and ``-m long`` the others."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def few(cases: Iterable[Any], plain: int) -> list[Any]:
    """The cases for ``parametrize``; those behind the first ``plain`` carry the mark ``long``."""
    return [
        case if k < plain else as_long(case) for k, case in enumerate(cases)
    ]


def as_long(case: Any) -> Any:
    """One case behind the mark ``long``; a tuple stays the arguments of one case."""
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.long)
