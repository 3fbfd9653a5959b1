"""One cell and one ADS server for all tests of a file."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from support.bridged import Bridged


@pytest.fixture(scope="module")
def bridged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bridged]:
    """A CNC that stands, a PLC that scans, a server of ADS."""
    found = Bridged(tmp_path_factory.mktemp("bridged"))
    yield found
    found.close()
