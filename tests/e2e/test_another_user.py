"""Another user of the machine attacks a cell that runs: SECURITY.md, row by row.

The attacker is a process of the user ``nobody`` with Python's own modules alone.
"""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest

import hli
from hli import orders
from hli.access import SHM_DIR
from plc_client import connect
from support.command_line import command, wait_for_cycle
from support.fake_cnc import unique_name
from support.processes import end, start_cnc, start_plc

NOBODY = 65534
PYTHON = "/usr/bin/python3"  # one that every user may start
pytestmark = [
    pytest.mark.usefixtures("leftovers"),
    pytest.mark.skipif(
        os.getuid() != 0 or not os.access(PYTHON, os.X_OK),
        reason="only root can be two users",
    ),
]

ATTACK = """
import errno, json, os, socket, sys
told = {}
def attempt(what, do, *words):
    try:
        told[what] = repr(do(*words))
    except OSError as error:
        told[what] = errno.errorcode.get(error.errno, str(error))
for file in sys.argv[2:]:
    attempt("read " + file, os.open, file, os.O_RDONLY)
    attempt("write " + file, os.open, file, os.O_RDWR)
    attempt("cut " + file, os.truncate, file, 0)
    attempt("mode " + file, os.chmod, file, 0o666)
    attempt("second name " + file, os.link, file, file + "-second")
    attempt("another name " + file, os.rename, file, file + "-other")
    attempt("remove " + file, os.unlink, file)
    attempt("list " + file, os.listdir, file)
def order(name):
    with socket.socket(socket.AF_UNIX) as one:
        one.settimeout(5.0)
        one.connect(chr(0) + name)
        one.sendall(b'{"do": "force", "values": [["T.gain", 7.0]]}' + bytes([10]))
        return one.recv(1000)
for line in open("/proc/net/unix", errors="replace"):
    if sys.argv[1] in line:
        attempt("order", order, line.split(maxsplit=7)[7].rstrip()[1:])
print(json.dumps(told))
"""
NOT_LET_IN = {"EACCES", "EPERM", "ENOTDIR", "EISDIR"}


def attacked(mark: str, *files: Path) -> dict[str, str]:
    """What each attempt on these files, and on sockets with ``mark`` in their
    names, has come to: an error's name or what it got.
    """
    done = subprocess.run(
        [PYTHON, "-c", ATTACK, mark, *map(str, files)],
        user=NOBODY,
        group=NOBODY,
        extra_groups=[],
        cwd="/",
        capture_output=True,
        text=True,
        check=True,
    )
    told: dict[str, str] = json.loads(done.stdout)
    return told


@pytest.mark.ci
def test_he_gets_neither_the_segment_nor_an_order(tmp_path: Path) -> None:
    """Opened, cut, linked, renamed, removed: nothing of it; his order to the PLC is
    not answered and not obeyed, and the cell runs on.
    """
    name, file = unique_name(), tmp_path / "p.py"
    file.write_text(
        "from plc_client import task\n@task()\nclass T:\n"
        "    def setup(self, hli): self.gain = 1.0\n"
        "    def cyclic(self): pass\n"
        "    def finished(self): return False\n"
    )
    cnc = start_cnc(name, lengths=[1e9])
    plc = start_plc(name, "--file", str(file))
    with connect(name, role="reader", wait_s=30.0) as reader:
        while reader.plc.scans < 5:
            pass
        told = attacked(orders.prefix(name), SHM_DIR / name)
        answer = told.pop("order")
        assert answer in ("b''", "ECONNRESET", "EPIPE")
        assert set(told.values()) <= NOT_LET_IN, told
        before = reader.plc.scans
        while reader.plc.scans < before + 5:
            pass
    value = orders.send(name, {"do": "read", "symbols": ["T.gain"]})["values"]
    assert value == {"T.gain": 1.0}
    end(plc)
    end(cnc)
    hli.sweep()


ST = """
PROGRAM MAIN
VAR n : DINT; END_VAR
n := n + 1;
END_PROGRAM
"""


@pytest.mark.ci
def test_he_gets_no_file_of_a_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Folders of a run and of compiled programs have mode 0700 under any umask, and
    those of the run are gone behind it.
    """
    scratch = Path(tempfile.mkdtemp(prefix="hli-test-", dir="/tmp"))
    scratch.chmod(0o1777)
    part, st = tmp_path / "part.nc", tmp_path / "p.st"
    part.write_text("N10 G01 X400 F2000\nN20 X0\n")
    st.write_text(ST)
    environment = os.environ | {
        "TMPDIR": str(scratch),
        "HLI_COSIM_CACHE": str(scratch / "cache"),
    }
    run = subprocess.Popen(
        command("run", part, "--plc", st, "--clock", "realtime"),
        env=environment,
        umask=0,
        stdout=subprocess.DEVNULL,
    )
    try:
        wait_for_cycle(run.pid, 10)
        folders = [path for path in scratch.iterdir() if path.is_dir()]
        assert len(folders) == 2, folders
        for path in folders:
            assert stat.S_IMODE(path.stat().st_mode) == 0o700
            below = [p for p in path.rglob("*") if p.is_file()]
            told = attacked("no socket", path, *below)
            assert set(told.values()) <= NOT_LET_IN, told
    finally:
        run.terminate()
        run.wait(60)
    assert [p.name for p in scratch.iterdir()] == ["cache"]
    subprocess.run(["rm", "-r", str(scratch)], check=True)


def _lay_cache(folder: Path, **what: Any) -> None:
    """A cache of compiled programs as somebody else may lay it."""
    (folder / "st").mkdir(parents=True)
    for path in (folder, folder / "st"):
        path.chmod(what.get("mode", 0o755))
        os.chown(path, what.get("user", 0), -1)


@pytest.mark.ci_cases
@pytest.mark.parametrize(
    ("what", "problem"),
    [
        ({"user": NOBODY}, f"belongs to user {NOBODY}"),
        ({"mode": 0o777}, "can be written by other users"),
        ({"mode": 0o1777}, "can be written by other users"),
    ],
)
def test_a_cache_that_he_can_write_is_not_loaded_from(
    tmp_path: Path, what: dict[str, int], problem: str
) -> None:
    """A compiled program in it would be code of his; the PLC says so and ends."""
    cache, st = tmp_path / "cache", tmp_path / "p.st"
    _lay_cache(cache, **what)
    st.write_text(ST)
    done = subprocess.run(
        [*(sys.executable, "-P", "-m", "plc_client"), "--file", str(st)],
        env=os.environ | {"HLI_COSIM_CACHE": str(cache)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert problem in done.stderr
    assert "Traceback" not in done.stderr
    assert not list((cache / "st").iterdir())


def test_his_draft_is_not_swept_by_root() -> None:
    """Only what belongs to this user is removed, also where more were permitted."""
    path = SHM_DIR / ".hli-new-4194304-1-7"
    path.write_bytes(b"")
    os.chown(path, NOBODY, NOBODY)
    try:
        hli.sweep()
        assert path.exists()
    finally:
        path.unlink()


def test_a_segment_with_a_second_name_is_refused() -> None:
    """Where links to foreign files are permitted, another user could lay a segment
    under the name of another cell.
    """
    name, other = unique_name(), unique_name()
    with hli.create(name):
        os.link(SHM_DIR / name, SHM_DIR / other)
        try:
            for each in (name, other):
                with pytest.raises(hli.HliAccessError, match="second name"):
                    hli.attach(each)
        finally:
            (SHM_DIR / other).unlink()
        hli.attach(name).close()
