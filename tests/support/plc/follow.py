"""PLC program of a test: follows the contour by the manual's new-element rule
and notes every element it gets.
"""

from plc_client import ContourLookahead, task


@task(interval=0.004)
class Follow:
    def setup(self, hli):
        self.ch = hli.gpCh[0]
        self.clah = ContourLookahead(self.ch.contour_lookahead)
        self.seen = []

    def cyclic(self):
        new = self.clah.follow(200_000.0)
        self.seen += [
            (
                int(b["block_number"]),
                float(b["start_position"]),
                float(b["length"]),
            )
            for b in new
        ]

    def result(self):
        return self.seen


@task(interval=0.001)
class FollowByHand:
    """The same rule written out on the bare control unit, as a PLC programmer would."""

    def setup(self, hli):
        self.unit = hli.gpCh[0].contour_lookahead
        self.seen, self.end, self.pending = [], 0.0, False

    def cyclic(self):
        unit = self.unit
        if unit.semaphor_rw:
            return
        if self.pending:
            for i in range(128):
                block = unit.response.block[i]
                if block.block_type == 0:
                    break
                self.seen.append(
                    (block.block_number, block.start_position, block.length)
                )
                self.end = block.start_position + block.length
            self.pending = False
        if self.end < unit.state.max_dist_prog_start:
            unit.request.start_position = self.end
            unit.request.length = 100_000.0
            unit.semaphor_rw = True
            self.pending = True

    def result(self):
        return self.seen
