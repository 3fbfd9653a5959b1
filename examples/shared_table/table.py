"""A PLC that sees who turns the table, by the logical axis numbers of the
channels' places.
"""

from __future__ import annotations

from plc_client import AutoContinue, task

TABLE = 10  # logical axis number


@task(interval=0.002)
class Table:
    """Counts the changes of the table's channel, and sees that nothing turns it
    while it is nobody's.
    """

    def setup(self, hli):
        self.hli = hli
        self.flows = [AutoContinue(hli.gpCh[i]) for i in range(hli.gNrCh)]
        self.axis = next(
            axis
            for axis in (hli.gpAx[i] for i in range(hli.gNrAx))
            if axis.head.log_ax_n_r == TABLE
        )
        self.holders = []
        self.at_rest = None  # where it stands while it is nobody's
        self.moved_alone = 0

    def cyclic(self):
        for flow in self.flows:
            flow()
        holder = self.holder()
        here = self.axis.lr_state.active_position_acs_r
        if holder is None and self.at_rest is not None:
            self.moved_alone += here != self.at_rest
        self.at_rest = here if holder is None else None
        if holder is not None and self.holders[-1:] != [holder]:
            self.holders.append(holder)

    def holder(self):
        """Index of the channel that has the table; None: nobody."""
        for i in range(self.hli.gNrCh):
            for coord in self.hli.gpCh[i].bahn_state.coord_r[:3]:
                if coord.log_axis_nr_r == TABLE:
                    return i
        return None

    def finished(self):
        states = [self.hli.gpCh[i] for i in range(self.hli.gNrCh)]
        return all(state.decoder_state.program_end_r for state in states)

    def result(self):
        degrees = self.axis.lr_state.active_position_acs_r / 10_000
        return {
            "degrees": degrees,
            "holders": self.holders,
            "moved_alone": self.moved_alone,
        }
