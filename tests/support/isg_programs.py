"""Running ISG programs in tests: a machine, and program text to rows."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cnc_core.blocks import NC_BLOCK
from cnc_core.frontend.isg import IsgFrontEnd
from cnc_core.frontend.machine import External, ProgramMachine, Tool
from cnc_core.frontend.offline import read_all
from cnc_core.frontend.port import OfflinePort, Wait

MACHINE = ProgramMachine(
    axes=("X", "Y", "Z", "A"),
    rotary=(False, False, False, True),
    main=(0, 1, 2),
    start=np.zeros(4),
    tools={1: Tool(5.0, 20.0), 2: Tool(1.5, 7.0)},
    m_functions={
        3: "MOS",
        5: "MOS",
        6: "MOS",
        8: "MVS_SVS",
        19: "MOS",
        52: "MOS",
    },
    externals={
        "GO": External("GO", "UNS32", 1),
        "A.B": External("A.B", "REAL64", 2, 3),
        "TEXT": External("TEXT", "STRING", 5),
    },
    zero_offsets={1: {"X": 100.0, "Y": 10.0}, 2: {"X": -50.0, "Z": 5.0}},
    velocity=np.array([300.0, 200.0, 100.0, 50.0]),
    limits=(np.full(4, -1000.0), np.full(4, 1000.0)),
)


ITEMS_MAX = 6_000


class Run:
    """What one program gave: rows, waits, errors, warnings, messages."""

    def __init__(
        self,
        text: str,
        folder: Path,
        *,
        name: str = "program.nc",
        skip: int = 0,
        **options,
    ) -> None:
        path = folder / name
        path.write_text(text)
        self.port = OfflinePort(MACHINE.start, skip)
        idle = options.pop("idle", None)
        self.reader = IsgFrontEnd(
            path, MACHINE, self.port, collect=True, **options
        )
        if idle:
            self.reader.idle_blocks_max = idle
        items, count = [], 0
        for item in read_all(self.reader, 256):
            items.append(item)
            count += 1 if isinstance(item, Wait) else len(item)
            if count > ITEMS_MAX:  # a program that moves for ever
                break
        self.reader.close()
        self.waits = [item for item in items if isinstance(item, Wait)]
        batches = [item.rows for item in items if not isinstance(item, Wait)]
        self.rows = (
            np.concatenate(batches) if batches else np.empty(0, NC_BLOCK)
        )
        self.codes = [error.code for error in self.reader.errors]
        self.warned = [warning.code for warning in self.reader.warnings]
        self.messages = [
            m for m in self.port.messages if not m.startswith(str(path))
        ]

    @property
    def ends(self):
        """(n, 4) end points of the motions."""
        return self.rows["end"][self.rows["type"] <= 3][:, :4]

    def x(self):
        """X of every motion."""
        return self.ends[:, 0].tolist()
