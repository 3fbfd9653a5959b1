"""An instance of an FMU 2.0 in fmpy, its variables by name."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fmpy import extract, read_model_description
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)


class Driven:
    """``one["X.position"]`` reads, ``one["override"] = 50`` writes, ``step()``
    makes a step of 1 ms.  ``said``: what the importer's logger was told.
    """

    def __init__(self, file: Path, folder: Path) -> None:
        model = read_model_description(str(file))
        self.said: list[str] = []
        self._known = {v.name: v for v in model.modelVariables}
        self.slave = FMU2Slave(
            guid=model.guid,
            unzipDirectory=extract(str(file), str(folder)),
            modelIdentifier=model.coSimulation.modelIdentifier,
            instanceName="driven",
        )
        calls = fmi2CallbackFunctions()
        calls.logger = fmi2CallbackLoggerTYPE(self._log)
        self._calls = calls
        self.slave.instantiate(callbacks=calls)
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()

    def _log(self, *words: Any) -> None:
        self.said.append(words[-1].decode())

    def begin(self) -> Driven:
        self.slave.exitInitializationMode()
        return self

    def __getitem__(self, name: str) -> Any:
        found = self._known[name]
        get = getattr(self.slave, f"get{found.type}")
        value = get([found.valueReference])[0]
        return value.decode() if isinstance(value, bytes) else value

    def __setitem__(self, name: str, value: Any) -> None:
        found = self._known[name]
        put = getattr(self.slave, f"set{found.type}")
        put([found.valueReference], [value])

    def step(self, steps: int = 1) -> None:
        for _ in range(steps):
            self.slave.doStep(0.0, 1e-3)


@contextmanager
def driven(file: Path, folder: Path) -> Iterator[Driven]:
    """It stands in front of the end of its initialization; see ``begin``."""
    one = Driven(file, folder)
    try:
        yield one
    finally:
        one.slave.terminate()
        one.slave.freeInstance()
