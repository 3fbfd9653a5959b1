"""pytest fixtures for users: ``cell``, ``plc``, ``golden``; everything is ended
and removed after each test.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from plc_client.golden import check
from plc_client.mock import Step
from plc_client.runner import PlcRunner, Tasks

from .cell import Cell
from .cell.programs import Programs
from .cell.stepping import start_plc
from .recording.reading import Recording


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--golden-update``."""
    group = parser.getgroup("hli-cosim")
    group.addoption(
        "--golden-update",
        action="store_true",
        help="write the golden runs anew instead of comparing",
    )


def pytest_collect_file(
    file_path: Path, parent: pytest.Collector
) -> pytest.Collector | None:
    """``test_*.st``, ``.TcPOU``, ``.plcproj``: tests in Structured Text."""
    kinds = (".st", ".tcpou", ".plcproj")
    name = file_path.name.lower()
    if not name.startswith("test_") or not name.endswith(kinds):
        return None
    from plc_client.st.pytest_items import StFile  # noqa: PLC0415

    found: pytest.Collector = StFile.from_parent(parent, path=file_path)
    return found


@pytest.fixture
def cell(request: pytest.FixtureRequest) -> Iterator[Cell]:
    """A co-simulation cell: ``cell.run("part.nc", plc=MyPlc)``.

    ``@pytest.mark.cell("cell.toml")`` gives it a configuration: a path, a dict
    or a CellConfig.  A path may be relative to the test's file.
    ``indirect=True`` of ``parametrize`` gives it several.
    """
    mark = request.node.get_closest_marker("cell")
    config = mark.args[0] if mark else None
    with contextlib.suppress(AttributeError):  # not parametrized
        config = request.param
    if isinstance(config, (str, Path)) and not Path(config).exists():
        config = request.path.parent / config
    with Cell(config) as value:
        yield value


def pytest_configure(config: pytest.Config) -> None:
    """The mark ``cell``."""
    config.addinivalue_line(
        "markers", "cell(config): configuration of the fixture cell"
    )


class PlcFactory:
    """Makes runners: ``plc(MyPlc, script=[line(30)])`` on a mock CNC,
    ``plc(MyPlc, "part.nc")`` beside the real one.

    A cell with several channels takes a list of programs, the mock a list of
    scripts.  Both stand until the test steps them; ``config=`` is the cell of the real
    one, ``inputs=`` are simulated inputs, ``watch=`` symbols to watch from the
    first scan on.  ``record=`` is the recording of the real one, which
    ``close()`` of the runner writes.  Other options are those of ``MockCnc``.
    """

    def __init__(self) -> None:
        self._runners: list[PlcRunner] = []

    def __call__(
        self,
        tasks: Tasks,
        program: Programs | None = None,
        *,
        script: Sequence[Step] | Sequence[Sequence[Step]] | None = None,
        config: str | Path | None = None,
        dialect: str | None = None,
        autostart: bool = True,
        inputs: Mapping[str, Any] | None = None,
        watch: str | Sequence[str] = (),
        record: str | Path | None = None,
        record_only: str | Sequence[str] = (),
        **mock: Any,
    ) -> PlcRunner:
        """A fresh runner: ``setup()`` done, no scan yet."""
        if (program is None) == (script is None):
            raise ValueError(
                "plc(): give either an NC program or script=[...] for the mock CNC"
            )
        if program is not None:
            runner = start_plc(
                program,
                tasks,
                config=config,
                dialect=dialect,
                autostart=autostart,
                inputs=inputs,
                watch=watch,
                record=record,
                record_only=record_only,
            )
        else:
            if record is not None:
                raise ValueError("plc(): the mock CNC has nothing to record")
            runner = PlcRunner.on_mock(
                tasks,
                script or (),
                inputs=inputs,
                watch=watch,
                auto_start=autostart,
                **mock,
            )
        self._runners.append(runner)
        return runner

    def close(self) -> None:
        """End all of them, the last one first."""
        while self._runners:
            self._runners.pop().close()


@pytest.fixture
def plc() -> Iterator[PlcFactory]:
    """A PLC in the test's own process, stepped by the test: ``plc(MyPlc,
    "part.nc").run_to_distance(1e5)``.
    """
    factory = PlcFactory()
    yield factory
    factory.close()


class Golden:
    """Compares columns with the golden file of this test: ``golden({"t": t,
    "power": p}, tolerance=1e-6)``.
    """

    def __init__(self, folder: Path, stem: str, update: bool) -> None:
        self._folder, self._stem, self._update = folder, stem, update

    def __call__(
        self,
        columns: Mapping[str, Any] | Recording | str | Path,
        name: str = "",
        tolerance: float | Mapping[str, float] = 1e-9,
    ) -> None:
        """Raises GoldenMismatchError; with ``--golden-update`` writes the file
        instead.

        ``columns``: arrays by name, or a recording, of which every table is
        compared.
        """
        if isinstance(columns, Mapping):
            check(self.path(name), columns, tolerance, update=self._update)
            return
        from .recording.golden import check_recording  # noqa: PLC0415

        check_recording(
            self.path(name, ".parquet"), columns, tolerance, self._update
        )

    def path(self, name: str = "", suffix: str = ".csv") -> Path:
        """The golden file."""
        return self._folder / f"{name or self._stem}{suffix}"


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Golden:
    """Golden runs in a folder ``golden`` beside the test file, one file per test."""
    stem = re.sub(r"[^\w.-]+", "_", request.node.name).strip("_")
    return Golden(
        request.path.parent / "golden",
        stem,
        bool(request.config.getoption("--golden-update")),
    )
