"""The commands ``ads`` and ``opcua``: what they refuse, and how they end."""

from __future__ import annotations

import signal
import socket
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from support.bridged import ADS_HOST
from support.command_line import Outcome, command

Cli = Callable[..., Outcome]


@pytest.mark.ci
def test_an_open_address_needs_the_clients_ids(cli: Cli) -> None:
    """Nobody opens a cell to the network by one option."""
    outcome = cli("ads", "none", "--host", "0.0.0.0")
    assert outcome.status == 2
    assert "--allow" in outcome.err


@pytest.mark.ci
@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--allow", "1.2.3"),
        ("--net-id", "1.2.3.4.5.x"),
        ("--allow", "256.0.0.0.0.0"),
    ],
)
def test_wrong_net_ids_are_wrong_usage(
    cli: Cli, option: str, value: str
) -> None:
    """They are six numbers."""
    assert cli("ads", "none", option, value).status == 2


def test_passwords_that_others_can_read_are_refused(
    cli: Cli, tmp_path: Path
) -> None:
    """With the cure."""
    pytest.importorskip("asyncua")
    users = tmp_path / "users"
    users.write_text("op:secret\n")
    users.chmod(0o644)
    outcome = cli("opcua", "none", "--users", users)
    assert outcome.status == 1
    assert "chmod 600" in outcome.err


def test_an_address_in_use_is_told(cli: Cli) -> None:
    """An error with its reason, no traceback."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        outcome = cli("ads", "none", "--port", port)
    assert outcome.status == 1
    assert f"127.0.0.1:{port}" in outcome.err
    assert "Traceback" not in outcome.err


@pytest.mark.ci
def test_the_server_waits_for_a_cell_and_ends_by_a_signal() -> None:
    """It says that the cell is not there yet; its status tells the signal."""
    process = subprocess.Popen(
        command("ads", "no-such-cell", "--host", ADS_HOST, "--port", 0),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert "not there yet" in process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in err
