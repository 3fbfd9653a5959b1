"""What a recording says of itself: program, cell, versions, units."""

from __future__ import annotations

import datetime
import hashlib
import json
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from ..config import CellConfig, ChannelPlace
from .schema import VERSION, units_of

TEXT_BYTES = 1 << 20  # longer texts are known by their hash alone
PACKAGES = ("hli-cosim", "numpy", "pyarrow")


def account(
    program: Path | None,
    cell: CellConfig,
    clock: str,
    config: Path | None,
    channel: ChannelPlace = ChannelPlace(),  # noqa: B008 - a constant
) -> dict[str, Any]:
    """The account of a run that begins, of one of its channels."""
    axes = {
        name: {
            "kind": axis.kind,
            "v_max": axis.v_max_mm_s,
            "a_max": axis.a_max_mm_s2,
            "j_max": axis.j_max_mm_s3,
        }
        for name, axis in cell.axes.items()
    }
    starts = zip(cell.axis_names, cell.axis_values("start_mm"), strict=True)
    place = {
        "index": channel.index,
        "name": channel.name,
        "numbers": axes_at_places(cell),
    }
    return {
        **({"channel": place} if channel.name else {}),
        "version": VERSION,
        "columns": units_of(cell),
        "clock": clock,
        "cycle_s": cell.cycle_s,
        "axes": axes,
        "start": {name: float(value) for name, value in starts},
        "program": document(program) if program else {},
        "cell": document(config) if config else {},
        "versions": versions(),
        "created": datetime.datetime.now(datetime.UTC).isoformat(),
    }


def axes_at_places(cell: CellConfig) -> list[int]:
    """Logical numbers of a channel's axes by their places, 0: for a guest."""
    own = len(cell.axes) - cell.guests
    return [*cell.axis_ids[:own], *[0] * cell.guests]


def document(path: Path) -> dict[str, Any]:
    """Name, hash and, if it is not too long, text of a file."""
    digest = hashlib.sha256()
    try:
        with path.open("rb") as file:
            first = file.read(TEXT_BYTES + 1)
            digest.update(first)
            while more := file.read(TEXT_BYTES):
                digest.update(more)
    except OSError:
        return {"file": path.name}
    text = first.decode(errors="replace") if len(first) <= TEXT_BYTES else ""
    return {"file": path.name, "sha256": digest.hexdigest(), "text": text}


def versions() -> dict[str, str]:
    """Versions of what records."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def as_bytes(value: dict[str, Any]) -> bytes:
    """The account as a schema holds it."""
    return json.dumps(value).encode()
