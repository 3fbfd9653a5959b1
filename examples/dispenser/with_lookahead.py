"""The valve is told a set time ahead.

The beads are read from the marked log before the tool gets there (mode 1).
"""

from hli.layout import HLI_CLAH_LOG_PARAM
from plc_client import ContourLookahead, DistanceCam, Hli, task

OPENS_AFTER_S = 0.035
CLOSES_AFTER_S = 0.020
INTERVAL_S = 0.002


@task(interval=INTERVAL_S)
class Valve:
    def setup(self, hli: Hli):
        self.log = ContourLookahead(hli.gpCh[0])
        self.cam = DistanceCam(hli.gpCh[0], scan_s=INTERVAL_S)
        self.marks = []  # distances where a bead begins, ends, begins ...
        self.open = False

    def cyclic(self):
        for entry in self.log.read_log():
            if entry["block_type"] == HLI_CLAH_LOG_PARAM:
                self.marks.append(float(entry["start_position"]))
        begins, ends = self.marks[::2], self.marks[1::2]
        beads = list(zip(begins, ends, strict=False))
        self.open = self.cam(
            beads, on_lead_s=OPENS_AFTER_S, off_lead_s=CLOSES_AFTER_S
        )
