"""The parameter set is chosen by `length_min`, a set time ahead.

`length_min` is the element's length on the scaled contour.
Short elements are details: the gap of the roughing current is wider than they are.
The generator is told so early that the new set acts where the detail begins.
This works for every part.
"""

from plc_client import ContourAhead, DistanceCam, Hli, task

CHANGES_AFTER_S = 0.120
# 0.1 um: elements shorter than 2 mm are eroded with the fine set
DETAIL = 20_000.0
INTERVAL_S = 0.004


@task(interval=INTERVAL_S)
class Generator:
    def setup(self, hli: Hli):
        self.ahead = ContourAhead(hli.gpCh[0])
        # the hysteresis: corners slow down
        self.cam = DistanceCam(
            hli.gpCh[0], scan_s=INTERVAL_S, hysteresis=20_000.0
        )
        self.fine = False

    def cyclic(self):
        elements = self.ahead()
        short = elements[elements["length_min"] < DETAIL]
        begins = short["start_position"]
        ends = begins + short["length"]
        tracks = list(zip(begins.tolist(), ends.tolist(), strict=True))
        self.fine = self.cam(
            joined(tracks),
            on_lead_s=CHANGES_AFTER_S,
            off_lead_s=CHANGES_AFTER_S,
        )


def joined(tracks):
    """Neighbours become one track: no change of the set between two details."""
    out = []
    for begin, end in tracks:
        if out and begin - out[-1][1] < 1.0:
            out[-1] = (out[-1][0], end)
        else:
            out.append((begin, end))
    return out
