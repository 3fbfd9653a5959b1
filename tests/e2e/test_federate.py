"""A cell, a robot and a recorder in one HELICS federation."""

from __future__ import annotations

import itertools
import threading
from pathlib import Path
from typing import Any

import pytest

from cnc_core.errors import CncError
from cnc_core.federate import CellFederate, Coupling

helics = pytest.importorskip("helics")

PLC = """
from plc_client import AcknowledgeAll, task
from plc_client.blocks import FeedControl

@task(interval=0.001)
class Logic:
    limit: float = 100.0

    def setup(self, hli):
        self.functions = AcknowledgeAll(hli)
        self.feed = FeedControl(hli.gpCh[0])

    def cyclic(self):
        self.functions()
        self.feed(self.limit)
"""
STEPS, STEP_S = 30, 0.01
KEYS = ("cell.x", "robot.limit")
counter = itertools.count()


def federate(name: str, core: str, broker: str) -> Any:
    info = helics.helicsCreateFederateInfo()
    helics.helicsFederateInfoSetCoreTypeFromString(info, core)
    helics.helicsFederateInfoSetCoreName(info, f"{name}_core")
    words = "--timeout=20s" + (f" --broker={broker}" if broker else "")
    helics.helicsFederateInfoSetCoreInitString(info, words)
    helics.helicsFederateInfoSetTimeProperty(
        info, helics.HELICS_PROPERTY_TIME_DELTA, STEP_S
    )
    return helics.helicsCreateValueFederate(name, info)


def robot(core: str, broker: str) -> None:
    """Asks for less speed as soon as X is behind 5 mm."""
    one = federate("robot", core, broker)
    limit = helics.helicsFederateRegisterGlobalPublication(
        one, "robot.limit", helics.HELICS_DATA_TYPE_DOUBLE, ""
    )
    x = helics.helicsFederateRegisterSubscription(one, "cell.x", "")
    helics.helicsFederateEnterExecutingMode(one)
    helics.helicsPublicationPublishDouble(limit, 100.0)
    for i in range(1, STEPS + 1):
        helics.helicsFederateRequestTime(one, i * STEP_S)
        near = helics.helicsInputGetDouble(x) > 5.0
        helics.helicsPublicationPublishDouble(limit, 30.0 if near else 100.0)
    helics.helicsFederateDisconnect(one)


def recorder(core: str, broker: str, rows: list[list[float]]) -> None:
    one = federate("recorder", core, broker)
    seen = [
        helics.helicsFederateRegisterSubscription(one, key, "") for key in KEYS
    ]
    helics.helicsFederateEnterExecutingMode(one)
    for i in range(1, STEPS + 1):
        now = helics.helicsFederateRequestTime(one, i * STEP_S)
        rows.append([now, *map(helics.helicsInputGetDouble, seen)])
    helics.helicsFederateDisconnect(one)


def federation(folder: Path, core: str, broker: str) -> list[list[float]]:
    """What the recorder saw."""
    (folder / "plc.py").write_text(PLC)
    (folder / "part.nc").write_text("G1 F6000 X100\nM30\n")
    rows: list[list[float]] = []
    made = helics.helicsCreateBroker(core, broker, "-f 3 --timeout=20s")
    others = [
        threading.Thread(target=robot, args=(core, broker)),
        threading.Thread(target=recorder, args=(core, broker, rows)),
    ]
    for other in others:
        other.start()
    coupling = Coupling(
        publish={"cell.x": "gpAhead[0].state.position[0]"},
        subscribe={"Logic.limit": "robot.limit"},
        core=core,
        broker=broker,
        timeout_s=20.0,
    )
    with CellFederate(folder / "part.nc", folder / "plc.py", coupling) as cell:
        assert cell.run(STEPS * STEP_S) == pytest.approx(STEPS * STEP_S)
    for other in others:
        other.join()
    helics.helicsBrokerDisconnect(made)
    return rows


def test_three_federates_see_the_same_whatever_carries_them(
    tmp_path: Path,
) -> None:
    """The robot's limit slows the cell; memory and sockets give the same."""
    near = federation(tmp_path, "inproc", f"broker{next(counter)}")
    assert near == federation(tmp_path, "zmq", "")
    _, x, limit = near[-1]
    assert x > 5.0
    assert limit == 30.0


@pytest.mark.parametrize(
    ("coupling", "said"),
    [
        (Coupling(step_s=0.001), "0.01 s or more"),
        (Coupling(step_s=0.0105), "no multiple"),
        (Coupling(publish={"a": "gpCh[0].nothing"}), "nothing"),
    ],
)
def test_a_wrong_coupling_is_refused(
    coupling: Coupling, said: str, tmp_path: Path
) -> None:
    """Before the federation is joined; the cell ends."""
    (tmp_path / "plc.py").write_text(PLC)
    (tmp_path / "part.nc").write_text("G1 F6000 X100\nM30\n")
    with pytest.raises(CncError, match=said):
        CellFederate(tmp_path / "part.nc", tmp_path / "plc.py", coupling)
