"""A cell, a robot and a recorder in one HELICS federation, in three ways.

``python federation.py threads`` runs them in one process, ``processes`` in
three, ``namespaces`` in three network namespaces (as root).  Each writes what
the recorder saw, the same in all three: ``federation.csv``.
"""

import argparse
import csv
import os
import subprocess
import sys
import threading
from pathlib import Path

import helics

from cnc_core.federate import CellFederate, Coupling

HERE = Path(__file__).parent
STEPS, STEP_S = 40, 0.01
SLOW_FROM, SLOW = 5.0, 30.0  # mm of X, % of the speed
KEYS = ("cell.x", "cell.speed", "robot.limit")
TIMEOUT_S = 20.0
NETWORK = "10.77.31"  # of the namespaces
PORT = 23404


def joined(name, core, broker, interface=""):
    """A federate that is no cell."""
    info = helics.helicsCreateFederateInfo()
    helics.helicsFederateInfoSetCoreTypeFromString(info, core)
    helics.helicsFederateInfoSetCoreName(info, f"{name}_core")
    words = [f"--timeout={TIMEOUT_S:g}s"]
    words += [f"--broker={broker}"] if broker else []
    words += [f"--local_interface={interface}"] if interface else []
    helics.helicsFederateInfoSetCoreInitString(info, " ".join(words))
    helics.helicsFederateInfoSetTimeProperty(
        info, helics.HELICS_PROPERTY_TIME_DELTA, STEP_S
    )
    helics.helicsFederateInfoSetFlagOption(
        info, helics.HELICS_FLAG_TERMINATE_ON_ERROR, True
    )
    return helics.helicsCreateValueFederate(name, info)


def robot(*where):
    """It comes near as soon as X is behind SLOW_FROM, and asks for less speed."""
    one = joined("robot", *where)
    limit = helics.helicsFederateRegisterGlobalPublication(
        one, "robot.limit", helics.HELICS_DATA_TYPE_DOUBLE, "%"
    )
    x = helics.helicsFederateRegisterSubscription(one, "cell.x", "")
    helics.helicsFederateEnterExecutingMode(one)
    helics.helicsPublicationPublishDouble(limit, 100.0)
    for i in range(1, STEPS):
        helics.helicsFederateRequestTime(one, i * STEP_S)
        is_near = helics.helicsInputGetDouble(x) > SLOW_FROM
        helics.helicsPublicationPublishDouble(limit, SLOW if is_near else 100.0)
    helics.helicsFederateRequestTime(one, STEPS * STEP_S)
    helics.helicsFederateDisconnect(one)


def recorder(out, *where):
    one = joined("recorder", *where)
    seen = [
        helics.helicsFederateRegisterSubscription(one, key, "") for key in KEYS
    ]
    helics.helicsFederateEnterExecutingMode(one)
    with Path(out).open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["time", *KEYS])
        for i in range(1, STEPS + 1):
            now = helics.helicsFederateRequestTime(one, i * STEP_S)
            rows.writerow([now, *map(helics.helicsInputGetDouble, seen)])
    helics.helicsFederateDisconnect(one)


def cell(core, broker, interface=""):
    coupling = Coupling(
        publish={
            "cell.x": "gpAhead[0].state.position[0]",
            "cell.speed": "gpAhead[0].state.speed",
        },
        subscribe={"Logic.limit": "robot.limit"},
        step_s=STEP_S,
        core=core,
        broker=broker,
        interface=interface,
        timeout_s=TIMEOUT_S,
    )
    with CellFederate(HERE / "part.nc", HERE / "logic.py", coupling) as one:
        one.run(STEPS * STEP_S)


def broker_of(core, name="", words=""):
    return helics.helicsCreateBroker(
        core, name, f"-f 3 --timeout={TIMEOUT_S:g}s {words}"
    )


def in_threads(out):
    """All in this process: nothing goes over a network."""
    where = ("inproc", "broker")
    broker = broker_of(*where)
    others = [
        threading.Thread(target=robot, args=where, daemon=True),
        threading.Thread(target=recorder, args=(out, *where), daemon=True),
    ]
    for other in others:
        other.start()
    cell(*where)
    for other in others:
        other.join(TIMEOUT_S)
    helics.helicsBrokerDisconnect(broker)


def in_processes(out, prefixes=((), (), ()), places=(("", ""),) * 3):
    """A process each; ``places``: broker and own interface of each."""
    words = (["cell"], ["robot"], ["recorder", "--out", str(out)])
    running = [
        subprocess.Popen(
            [
                *(*prefix, sys.executable, __file__, *own),
                *("--broker", broker, "--interface", interface),
            ]
        )
        for prefix, own, (broker, interface) in zip(
            prefixes, words, places, strict=True
        )
    ]
    status = [one.wait() for one in running]
    if any(status):
        raise SystemExit(f"a federate ended with {status}")


def processes(out):
    broker = broker_of("zmq", words=f"--port={PORT}")
    in_processes(out, places=((f"tcp://127.0.0.1:{PORT}", ""),) * 3)
    helics.helicsBrokerDisconnect(broker)


def namespaces(out):
    """A network of its own for each, joined by a bridge; the broker is here."""
    if os.geteuid() != 0:
        raise SystemExit("network namespaces need root")
    bridge = f"hli{os.getpid() % 10**6}"
    names = [f"{bridge}-{i}" for i in range(3)]
    try:
        ip("link", "add", bridge, "type", "bridge")
        ip("addr", "add", f"{NETWORK}.1/24", "dev", bridge)
        ip("link", "set", bridge, "up")
        for i, name in enumerate(names):
            add(name, bridge, f"{bridge}v{i}", f"{NETWORK}.{i + 2}")
        here = f"tcp://{NETWORK}.1"
        words = f"--port={PORT} --local_interface={here}"
        broker = broker_of("zmq", words=words)
        places = [
            (f"{here}:{PORT}", f"tcp://{NETWORK}.{i + 2}") for i in range(3)
        ]
        prefixes = [("ip", "netns", "exec", name) for name in names]
        in_processes(out, prefixes, places)
        helics.helicsBrokerDisconnect(broker)
    finally:
        for name in names:
            ip("netns", "del", name, check=False)
        ip("link", "del", bridge, check=False)


def add(name, bridge, link, address):
    """A namespace with one interface."""
    ip("netns", "add", name)
    ip("link", "add", link, "type", "veth", "peer", "eth0", "netns", name)
    ip("link", "set", link, "master", bridge, "up")
    ip("-n", name, "addr", "add", f"{address}/24", "dev", "eth0")
    ip("-n", name, "link", "set", "eth0", "up")
    ip("-n", name, "link", "set", "lo", "up")


def ip(*words, check=True):
    subprocess.run(["ip", *words], check=check, stderr=None if check else -3)


def main():
    take = argparse.ArgumentParser(description=__doc__)
    forms = ("threads", "processes", "namespaces")
    roles = ("cell", "robot", "recorder")
    take.add_argument("what", choices=(*forms, *roles))
    take.add_argument("--out", default="federation.csv")
    take.add_argument("--broker", default="")
    take.add_argument("--interface", default="")
    given = take.parse_args()
    where = ("zmq", given.broker, given.interface)
    {
        "threads": lambda: in_threads(given.out),
        "processes": lambda: processes(given.out),
        "namespaces": lambda: namespaces(given.out),
        "cell": lambda: cell(*where),
        "robot": lambda: robot(*where),
        "recorder": lambda: recorder(given.out, *where),
    }[given.what]()


if __name__ == "__main__":
    main()
