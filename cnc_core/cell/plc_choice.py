"""The PLC program of a run, as arguments of the PLC process."""

from __future__ import annotations

import inspect
import json
import numbers
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from plc_client.inputs import inputs_of

from ..errors import CncError, Place

PLC_CHOICES = (
    "a file, a class of a file, or builtin:NAME"
    " (start_plc runs any class in this process)"
)


NO_PLC = "none"


def tables_of(inputs: Mapping[str, Any] | None) -> dict[str, Any]:
    """Simulated inputs as plain tables; CncError names the one that is wrong."""
    try:
        return {path: asdict(one) for path, one in inputs_of(inputs).items()}
    except ValueError as error:
        raise CncError(902001, str(error)) from None


@dataclass(frozen=True)
class PlcChoice:
    """Which PLC program runs: arguments of the PLC process."""

    arguments: tuple[str, ...]

    @classmethod
    def of(cls, plc: Any, args: dict[str, Any] | None = None) -> PlcChoice:
        """From None (acknowledge everything), ``builtin:NAME``, a file, or a
        task class of an importable file.
        """
        if plc is None:
            plc = "builtin:acknowledge"
        if plc == NO_PLC:
            return cls(())
        if isinstance(plc, type):
            return cls._of_class(plc)
        text = str(plc)
        if text.startswith("builtin:"):
            return cls(
                (
                    "--builtin",
                    text.removeprefix("builtin:"),
                    "--args",
                    json.dumps(args or {}),
                )
            )
        if not isinstance(plc, (str, Path)):
            raise CncError(902001, f"PLC {plc!r}: {PLC_CHOICES}")
        if not Path(text).is_file() and not Path(text).is_dir():
            raise CncError(901001, "PLC program not found", Place(text))
        return cls(("--file", str(Path(text).resolve())))

    def online(
        self, watch: Sequence[str] | str, force: dict[str, Any]
    ) -> PlcChoice:
        """The same PLC with a watch list (or one symbol) and forced symbols."""
        watch = [watch] if isinstance(watch, str) else watch
        for path, value in force.items():
            if not isinstance(value, (numbers.Real, str)):
                raise CncError(
                    902001,
                    f"force {path}={value!r}: a number, a BOOL or a text is needed",
                )
        if not self.arguments and (watch or force):
            raise CncError(
                902001,
                f"watch list and forced symbols need a PLC, not {NO_PLC!r}",
            )
        more = [part for path in watch for part in ("--watch", path)]
        more += [
            part
            for path, value in force.items()
            for part in ("--force", f"{path}={value}")
        ]
        return PlcChoice((*self.arguments, *more))

    def structured(self, words: Sequence[str]) -> PlcChoice:
        """The same PLC with options of Structured Text."""
        if words and "--file" not in self.arguments:
            raise CncError(
                902001, "options of Structured Text need its file as the PLC"
            )
        more = [part for word in words for part in ("--st", word)]
        return PlcChoice((*self.arguments, *more))

    def beside(self, inputs: dict[str, Any]) -> PlcChoice:
        """The same PLC beside simulated inputs; without a PLC there are none."""
        if not inputs or not self.arguments:
            return self
        return PlcChoice((*self.arguments, "--inputs", json.dumps(inputs)))

    @classmethod
    def _of_class(cls, plc: type) -> PlcChoice:
        if "<locals>" in plc.__qualname__:
            raise CncError(
                902001,
                f"PLC class {plc.__qualname__} is local to a function;"
                f" the PLC process needs {PLC_CHOICES}",
            )
        try:
            file = inspect.getfile(plc)
        except (TypeError, OSError):
            file = ""
        if not Path(file).is_file():
            raise CncError(
                902001,
                f"PLC class {plc.__name__} has no source file;"
                f" the PLC process needs {PLC_CHOICES}",
            )
        return cls(
            ("--file", str(Path(file).resolve()), "--class", plc.__qualname__)
        )
