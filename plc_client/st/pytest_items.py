"""pytest collects ``test_*.st``: one item a test method, with its line."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ..task import PlcError
from .testing import StTest, StTestFailedError, run_test, tests_of


class StFile(pytest.File):
    """A file of tests in Structured Text."""

    def collect(self) -> Iterator[pytest.Item]:
        """One item a method."""
        for test in tests_of(self.path):
            name = f"{test.block}.{test.method}"
            item = StItem.from_parent(self, name=name)
            item.test = test
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

    test: StTest

    def runtest(self) -> None:
        """A fresh program; one call of the method, or calls until it has finished."""
        test = self.test
        run_test(self.path, test.block, test.method, test.lasts)

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """The assertions with their lines."""
        if isinstance(excinfo.value, (StTestFailedError, PlcError)):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """File and line for reports."""
        return self.path, self.test.line - 1, self.name
