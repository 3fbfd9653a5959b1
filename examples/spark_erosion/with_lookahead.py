"""The parameter set is chosen by `length_min`, the element's length on the scaled contour, a set time ahead.

Short elements are details: with the roughing current the gap would be wider than they are. The generator is told so
early that the new set acts where the detail begins; this works for every part.
"""

from plc_client import ContourAhead, DistanceCam, task

CHANGES_AFTER_S = 0.120
DETAIL = (
    20_000.0  # 0.1 um: elements shorter than 2 mm are eroded with the fine set
)
INTERVAL_S = 0.004


@task(interval=INTERVAL_S)
class Generator:
    def setup(self, hli):
        self.ahead = ContourAhead(hli.gpCh[0])
        self.cam = DistanceCam(
            hli.gpCh[0], scan_s=INTERVAL_S, hysteresis=20_000.0
        )  # corners slow down
        self.fine = False

    def cyclic(self):
        elements = self.ahead()
        short = elements[elements["length_min"] < DETAIL]
        tracks = [
            (
                float(e["start_position"]),
                float(e["start_position"] + e["length"]),
            )
            for e in short
        ]
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
