"""The federate: the cell's symbols, published and subscribed."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hli import segment
from hli.areas import Areas
from hli.segment import Segment
from hli.symbol import Symbol, SymbolError
from plc_client.runner import PlcRunner, Tasks

from ..cell.stepping import start_plc
from ..errors import CncError

STEP_MIN_S = 0.01
TIMEOUT_S = 30.0
LEAVE_S = 2.0  # for leaving a federation in order
PROMPT_S, PAUSE_S = 2e-3, 2e-4  # of a look whether an answer is there


@dataclass(frozen=True)
class Coupling:
    """How the cell stands in the federation.

    ``publish``: symbols of HLI and PLC by the key of their publication.
    ``subscribe``: keys of others' publications by the PLC symbol that they set.
    ``step_s``: coupling step, a multiple of the cell's cycle.  ``core``: HELICS
    core type.  ``broker``: address of the broker; empty: on this machine.
    ``interface``: own address, where the broker is on another machine.
    ``timeout_s``: wall time after which a wait for others ends with an error.
    """

    name: str = "cell"
    publish: Mapping[str, str] = field(default_factory=dict)
    subscribe: Mapping[str, str] = field(default_factory=dict)
    step_s: float = STEP_MIN_S
    core: str = "zmq"
    broker: str = ""
    interface: str = ""
    timeout_s: float = TIMEOUT_S

    def cycles(self, cycle_s: float) -> int:
        """Cycles of a step; CncError: too short, or no multiple."""
        cycles = round(self.step_s / cycle_s)
        if self.step_s < STEP_MIN_S:
            text = f"coupling step {self.step_s:g} s: {STEP_MIN_S:g} s or more"
            raise CncError(902001, text)
        if abs(cycles * cycle_s - self.step_s) > 1e-9:
            raise CncError(
                902001,
                f"coupling step {self.step_s:g} s is no multiple of the"
                f" cell's cycle, {cycle_s:g} s",
            )
        return cycles


class CellFederate:
    """One cell in a federation, from its start to its end.

    ``program``, ``plc``, ``config``: as ``start_plc`` takes them.
    CncError: something is wrong with them, with the coupling, or with the
    federation: nobody answers within the time-out.
    """

    def __init__(
        self,
        program: str | Path,
        plc: Tasks,
        coupling: Coupling,
        *,
        config: str | Path | None = None,
    ) -> None:
        self.coupling = coupling
        self._helics = _helics()
        self.runner: PlcRunner = start_plc(program, plc, config=config)
        self._federate: Any = None
        self._is_lost = False
        self._segment: Segment | None = None
        try:
            self._segment = segment.observe(self.runner.hli.name)
            cycle_s = self.runner.hli.cnc.cycle_ns * 1e-9
            self._cycles = coupling.cycles(cycle_s)
            self._areas: Areas | None = Areas(self._segment)
            self._shown = {
                key: self._symbol(path)
                for key, path in coupling.publish.items()
            }
            self._set = {
                path: self.runner.symbol(path) for path in coupling.subscribe
            }
            self._join()
        except BaseException as error:
            self.close()
            if isinstance(error, SymbolError):
                raise CncError(902001, str(error)) from None
            raise

    def __enter__(self) -> CellFederate:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def run(self, until_s: float) -> float:
        """Steps until this time of the federation; the time that it came to."""
        try:
            return self._run(until_s)
        except self._helics.HelicsException as error:
            raise _failed(error) from None

    def _run(self, until_s: float) -> float:
        helics, step = self._helics, self.coupling.step_s
        begin = helics.helicsFederateEnterExecutingModeAsync
        begin(self._federate)
        self._await("the start of the federation")
        helics.helicsFederateEnterExecutingModeComplete(self._federate)
        now, steps = 0.0, math.floor(until_s / step + 1e-6)
        self._publish()
        for count in range(1, steps + 1):
            now = self._granted(count * step)
            if now > count * step + 1e-9:
                raise CncError(905001, "the federation has ended")
            self._take()
            self._drive()
            if count < steps:
                self._publish()
        return now

    def _granted(self, time_s: float) -> float:
        helics = self._helics
        helics.helicsFederateRequestTimeAsync(self._federate, time_s)
        self._await(f"time {time_s:g} s")
        return float(helics.helicsFederateRequestTimeComplete(self._federate))

    def _await(self, what: str) -> None:
        """Waits for what has been asked for; CncError behind the time-out."""
        is_done = self._helics.helicsFederateIsAsyncOperationCompleted
        begin = time.monotonic()
        while not is_done(self._federate):
            waited = time.monotonic() - begin
            if waited > self.coupling.timeout_s:
                text = (
                    f"federation: no answer of the others for {what}"
                    f" within {self.coupling.timeout_s:g} s"
                )
                self._is_lost = True
                raise CncError(905001, text)
            time.sleep(0.0 if waited < PROMPT_S else PAUSE_S)

    def close(self) -> None:
        """Leave the federation and end the cell; never waits for others."""
        if self._federate is not None:
            federate, self._federate = self._federate, None
            # it may wait for partners that are dead
            leaving = threading.Thread(
                target=self._leave, args=(federate,), daemon=True
            )
            leaving.start()
            leaving.join(LEAVE_S)
        self._areas, self._shown = None, {}
        if self._segment is not None:
            self._segment.close()
        self.runner.close()

    def _leave(self, federate: Any) -> None:
        helics = self._helics
        if self._is_lost:  # an answer that never comes holds the library
            with contextlib.suppress(helics.HelicsException):
                core = helics.helicsFederateGetCore(federate)
                helics.helicsCoreDisconnect(core)
        with contextlib.suppress(helics.HelicsException):
            helics.helicsFederateDisconnect(federate)
        with contextlib.suppress(helics.HelicsException):
            helics.helicsFederateFree(federate)

    def _join(self) -> None:
        helics, coupling = self._helics, self.coupling
        info = helics.helicsCreateFederateInfo()
        helics.helicsFederateInfoSetCoreTypeFromString(info, coupling.core)
        helics.helicsFederateInfoSetCoreName(info, f"{coupling.name}_core")
        helics.helicsFederateInfoSetCoreInitString(info, self._core_words())
        helics.helicsFederateInfoSetTimeProperty(
            info, helics.HELICS_PROPERTY_TIME_DELTA, coupling.step_s
        )
        helics.helicsFederateInfoSetTimeProperty(
            info, helics.HELICS_PROPERTY_TIME_GRANT_TIMEOUT, coupling.timeout_s
        )
        helics.helicsFederateInfoSetFlagOption(
            info, helics.HELICS_FLAG_TERMINATE_ON_ERROR, True
        )
        try:
            self._federate = helics.helicsCreateValueFederate(
                coupling.name, info
            )
            self._publications = {
                key: helics.helicsFederateRegisterGlobalPublication(
                    self._federate, key, helics.HELICS_DATA_TYPE_DOUBLE, ""
                )
                for key in self._shown
            }
            self._inputs = {
                path: helics.helicsFederateRegisterSubscription(
                    self._federate, key, ""
                )
                for path, key in coupling.subscribe.items()
            }
        except helics.HelicsException as error:
            raise _failed(error) from None
        finally:
            helics.helicsFederateInfoFree(info)

    def _core_words(self) -> str:
        coupling = self.coupling
        words = [f"--timeout={coupling.timeout_s:g}s", "--networkretries=1"]
        if coupling.broker:
            words.append(f"--broker={coupling.broker}")
        if coupling.interface:
            words.append(f"--local_interface={coupling.interface}")
        return " ".join(words)

    def _symbol(self, path: str) -> Symbol:
        """Of the HLI as it is behind a step, or of the PLC."""
        assert self._areas is not None
        try:
            return self._areas.symbol(path)
        except SymbolError:
            return self.runner.symbol(path)

    def _take(self) -> None:
        helics = self._helics
        for path, found in self._inputs.items():
            if helics.helicsInputIsUpdated(found):
                symbol = self._set[path]
                value = helics.helicsInputGetDouble(found)
                symbol.value = type(symbol.value)(value)

    def _drive(self) -> None:
        end = self.runner.cycle + self._cycles
        while self.runner.cycle < end and not self.runner.ended:
            self.runner.step()

    def _publish(self) -> None:
        for key, symbol in self._shown.items():
            self._helics.helicsPublicationPublishDouble(
                self._publications[key], float(symbol.value)
            )


def _helics() -> Any:
    try:
        import helics  # noqa: PLC0415  (an extra)
    except ImportError:
        text = 'HELICS is not installed: pip install "hli-cosim[federate]"'
        raise CncError(902001, text) from None
    return helics


def _failed(error: Exception) -> CncError:
    return CncError(905001, f"federation: {error}")
