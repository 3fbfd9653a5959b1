"""A PLC program: reads the marked section of the NC program by index (mode 1) and prints it once.

hli-cosim run examples/part.nc --config examples/cell.toml --plc examples/read_marked_log.py
"""

from plc_client import ContourLookahead, task

KINDS = {1: "line", 2: "circle", 3: "LOG ON", 4: "LOG PARAM", 5: "LOG OFF", 6: "polynomial"}


@task(interval=0.010)
class ReadMarkedLog:
    def setup(self, hli):
        self.state = hli.gpCh[0].contour_lookahead.state
        self.clah = ContourLookahead(hli.gpCh[0].contour_lookahead)
        self.entries = []

    def cyclic(self):
        self.entries += list(self.clah.read_log())

    def finished(self):
        return len(self.entries) >= self.state.count_logged_blocks

    def result(self):
        return [
            [KINDS[int(b["block_type"])], int(b["block_number"]), float(b["length"]) / 10_000.0] for b in self.entries
        ]
