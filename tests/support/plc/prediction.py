"""PLC program of a test: notes what the CNC foresees, cycle by cycle, and holds
the feed for a while.
"""

from plc_client import task


@task(interval=0.001)
class Note:
    hold_at = 10**9

    def setup(self, hli):
        self.ch = hli.gpCh[0]
        self.seen = []

    def cyclic(self):
        b, hold = self.ch.bahn_state, self.ch.bahn_mc_control.feedhold
        self.seen.append(
            {
                "eta": float(b.eta_time_r) / 1000.0 if b.eta_valid_r else None,
                "rapid": bool(b.rapid_active_r),
                "feed": int(b.active_feed_r),
                "esa": [
                    float(v) if ok else None
                    for v, ok in zip(b.esa_vb, b.esa_data_valid, strict=True)
                ],
                "way": float(b.dist_v_0_r) if b.pos_v_0_valid_r else None,
                "rest": [int(b.pos_v_0_pcs_r[i]) for i in range(3)],
                "acs": [int(b.pos_v_0_acs_r[i]) for i in range(3)],
                "at": [int(b.coord_r[i].act_position_r) for i in range(3)],
                "dist": float(b.dist_prog_start),
                "held": bool(hold.state_r),
            }
        )
        hold.enable_w = True
        hold.command_w = self.hold_at <= len(self.seen) < self.hold_at + 600

    def result(self):
        return self.seen


class Hold300(Note):
    hold_at = 300


class Hold520(Note):
    hold_at = 520
