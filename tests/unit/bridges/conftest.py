"""One cell and one server of each kind for all tests of a file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from support.bridged import Bridged


@pytest.fixture(scope="module")
def bridged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bridged]:
    """A CNC that stands, a PLC that scans, a server of ADS."""
    found = Bridged(tmp_path_factory.mktemp("bridged"))
    yield found
    found.close()


@pytest.fixture(scope="module")
def served(bridged: Bridged) -> Iterator[Any]:
    """The cell with a server of OPC UA; ``url`` is its address."""
    pytest.importorskip("asyncua")
    from cnc_core.bridges.opcua.server import Door  # noqa: PLC0415
    from support.opcua_served import Served  # noqa: PLC0415

    found = Served(bridged, Door(port=0, passwords={"op": "secret"}))
    yield found
    found.close()
