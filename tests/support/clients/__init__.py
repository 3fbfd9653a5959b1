"""Clients in JavaScript, installed once for each user from npm."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).resolve().parent
VERSIONS = {
    "ads-client": "2.1.0",
    "node-opcua-client": "2.186.4",
    "node-opcua-nodesets": "2.185.0",
}
INSTALL_S = 180.0
RUN_S = 60.0


def cache() -> Path:
    """Where packages are kept."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "hli-cosim" / "tests"


def installed(package: str) -> Path:
    """The folder of a package's modules; skips where there is none."""
    npm = shutil.which("npm")
    if npm is None or shutil.which("node") is None:
        pytest.skip(f"{package}: node and npm are not installed")
    folder = cache() / f"{package}-{VERSIONS[package]}"
    modules = folder / "node_modules"
    if not (modules / package).is_dir():
        folder.mkdir(parents=True, exist_ok=True)
        done = subprocess.run(
            [
                npm,
                "install",
                "--no-audit",
                "--no-fund",
                "--ignore-scripts",
                "--prefix",
                str(folder),
                f"{package}@{VERSIONS[package]}",
            ],
            capture_output=True,
            text=True,
            timeout=INSTALL_S,
            check=False,
        )
        if done.returncode:
            pytest.skip(f"{package} cannot be installed from npm")
    return modules


def run(package: str, script: str, *arguments: object) -> dict[str, Any]:
    """What a script beside this file prints last, as JSON."""
    modules = installed(package)
    done = subprocess.run(
        ["node", str(HERE / script), *map(str, arguments)],
        env={**os.environ, "NODE_PATH": str(modules)},
        capture_output=True,
        text=True,
        timeout=RUN_S,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found
