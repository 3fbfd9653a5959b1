"""PLC of ``test_isons_run.py``: answers an output with an input, and a generic
variable with another one.
"""

from __future__ import annotations

from typing import Any

from plc_client import task

INPUT, OUTPUT, GENERIC = (
    0,
    256,
    512,
)  # first blocks of 24 bytes, in words of four bytes times six
WORDS = 6


@task(interval=0.001)
class Answers:
    """Input 2 follows output 5; $_K1 becomes twice $_K0."""

    def setup(self, hli: Any) -> None:
        self.area = hli.gpVEGlobal

    def cyclic(self) -> None:
        self.area[(INPUT + 2) * WORDS] = self.area[(OUTPUT + 5) * WORDS]
        self.area[(GENERIC + 1) * WORDS] = 2 * self.area[GENERIC * WORDS]
