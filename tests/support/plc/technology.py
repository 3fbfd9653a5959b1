"""PLC program of a test: fetches technology functions, acknowledges them late
and out of order, notes what it saw.
"""

import random

from plc_client import task


@task(interval=0.001)
class Techno:
    def setup(self, hli):
        self.hli, self.ch = hli, hli.gpCh[0]
        self.random = random.Random(5)
        self.seen, self.open = [], []

    def units(self):
        for name in ("techno_unit_std_sync", "techno_unit_late_sync"):
            array = getattr(self.ch, name)
            yield from ((name, i, array[i]) for i in range(len(array)))

    def cyclic(self):
        state = self.ch.bahn_state
        for name, _i, unit in self.units():
            if unit.please_rw and self.random.random() < 0.7:
                data = bytes(unit.attribut_r.data[k] for k in range(32))
                number, synch = (
                    int.from_bytes(data[0:4], "little"),
                    int.from_bytes(data[24:28], "little"),
                )
                block = int.from_bytes(data[8:12], "little")
                unit.please_rw = False
                self.seen.append(
                    (
                        number,
                        block,
                        synch,
                        state.dist_prog_start,
                        state.active_feed_r,
                        name[12:15],
                        self.hli.cycle,
                    )
                )
                self.open.append(
                    (self.hli.cycle + self.random.randrange(1, 40), unit)
                )
        for entry in [e for e in self.open if e[0] <= self.hli.cycle]:
            entry[1].done_w = True
            self.open.remove(entry)

    def finished(self):
        return not self.open

    def result(self):
        return self.seen


@task(interval=0.001)
class NeverFetches:
    def setup(self, hli):
        self.ch, self.waits, self.hli = hli.gpCh[0], 0, hli

    def cyclic(self):
        state = self.ch.bahn_state
        self.waits += bool(
            state.wait_techno_acknowledge_r and state.stop_condition_r & 64
        )
        if self.waits > 200:
            self.ch.techno_unit_std_sync[0].please_rw = False
            self.ch.techno_unit_std_sync[0].done_w = True

    def result(self):
        return self.waits
