"""Which channel of a cell executes which program."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..config import CellConfig, setups_of
from ..errors import CncError
from ..process.options import RunOptions

Programs = str | Path | Sequence[str | Path]
"""A program, or one a channel in the order of the channels."""


def programs_of(
    cell: CellConfig, given: Programs, config: Path | None = None
) -> tuple[Path | None, ...]:
    """One program a channel; None: it has none until the PLC selects one.

    Channels behind the given programs take what the cell file names, relative
    to ``config``.  CncError: more programs than channels, or none at all.
    """
    listed = [given] if isinstance(given, (str, Path)) else given
    files = [Path(file) for file in listed]
    setups = setups_of(cell)
    if len(files) > len(setups):
        raise CncError(
            902001,
            f"{len(files)} programs ({', '.join(map(str, files))}) for"
            f" {len(setups)} channel{'s' if len(setups) > 1 else ''}: a channel"
            " executes one; [channels.NAME] in the cell file makes further ones",
        )
    folder = config.parent if config else Path()
    named: list[Path | None] = [
        folder / setup.program if setup.program else None
        for setup in setups[len(files) :]
    ]
    programs = (*files, *named)
    if not any(programs):
        raise CncError(
            902001,
            "no program: name one, or give the channels one in the cell file"
            " ([channels.NAME] program)",
        )
    return programs


def refuse_for_several(options: RunOptions) -> None:
    """CncError: a choice that is of one channel, in a cell with several."""
    for name, chosen in (
        ("--start-line", options.start_line),
        ("--start-marker", options.start_marker),
    ):
        if chosen:
            raise CncError(
                902001,
                f"{name} is for cells with one channel; this one has several",
            )
    refuse_mcap(options.record)


def refuse_mcap(target: Path | None) -> None:
    """CncError: an export that shows one channel, for a cell with several."""
    if target is not None and target.suffix == ".mcap":
        raise CncError(
            902001,
            f"recording {target}: .mcap is for cells with one channel; this one"
            " has several; record .parquet",
        )
