"""A PLC program that reads the marked section of the NC program by index (mode 1).

Every entry is printed once.

hli-cosim run examples/part.nc --config examples/cell.toml --plc examples/read_marked_log.py
"""

from plc_client import ContourLookahead, Hli, task

KINDS = {
    1: "line",
    2: "circle",
    3: "LOG ON",
    4: "LOG PARAM",
    5: "LOG OFF",
    6: "polynomial",
}


@task(interval=0.010)
class ReadMarkedLog:
    def setup(self, hli: Hli):
        self.state = hli.gpCh[0].contour_lookahead.state
        self.clah = ContourLookahead(hli.gpCh[0])
        self.count = 0

    def cyclic(self):
        for b in self.clah.read_log():
            self.count += 1
            kind = KINDS[int(b["block_type"])]
            # the length of a marker is the PARAM of its command, without unit
            marker = kind.startswith("LOG")
            value = b["length"] if marker else b["length"] / 10_000.0
            unit = "" if marker else " mm"
            print(
                f"N{b['block_number']:<5} {kind:<10} {value:10.4f}{unit}",
                flush=True,
            )

    def finished(self):
        return self.count >= self.state.count_logged_blocks
