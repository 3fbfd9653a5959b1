"""pytest collects ``test_*.st``: one item a test method, with its line."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ..task import PlcError
from .testing import StTestFailedError, run_test, tests_of


class StFile(pytest.File):
    """A file of tests in Structured Text."""

    def collect(self) -> Iterator[pytest.Item]:
        """One item a method."""
        for block, method, line in tests_of(self.path):
            item = StItem.from_parent(self, name=f"{block}.{method}")
            item.place = (block, method, line)
            yield item

    def repr_failure(  # type: ignore[override]
        self, excinfo: Any
    ) -> Any:
        """Errors of the source stand for themselves."""
        if isinstance(excinfo.value, PlcError):
            return str(excinfo.value)
        return super().repr_failure(excinfo)


class StItem(pytest.Item):
    """One test method."""

    place: tuple[str, str, int] = ("", "", 0)

    def runtest(self) -> None:
        """A fresh program, one call of the method."""
        run_test(self.path, *self.place[:2])

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """The assertions with their lines."""
        if isinstance(excinfo.value, (StTestFailedError, PlcError)):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """File and line for reports."""
        return self.path, self.place[2] - 1, self.name
