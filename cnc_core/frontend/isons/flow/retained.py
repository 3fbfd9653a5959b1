"""What stays from program to program: modal functions, origins, offsets, heads,
tables of tools.
"""

from __future__ import annotations

import copy
from dataclasses import replace

from cnc_core.frontend.base.scanner import MotionWords

from ..motion.state import ChannelState


def take_over(new: ChannelState, old: ChannelState) -> None:
    """Go on with what the program before has left: all but rotation (G50),
    compensation and secondary limits.
    """
    old.follow_scanner()
    modal, before = new.modal, old.modal
    modal.set_absolute(before.absolute)
    modal.apply(
        MotionWords(
            motion=before.motion,
            inch=before.unit_mm != 1.0,
            exact_stop=before.exact_stop,
        )
    )
    modal.feed = before.feed
    new.spindle = old.spindle
    new.tool = old.tool
    new.tables = old.tables
    new.diameter = old.diameter
    new.rotary_modes = dict(old.rotary_modes)
    new.pause_mode = old.pause_mode
    new.depth_axis = old.depth_axis
    new.plane_pair = old.plane_pair
    new.plane_code = old.plane_code
    new.plane_reversed = old.plane_reversed
    if old.plane_code:
        modal.apply(MotionWords(plane=old.plane_code))
    new.modes.mode = old.modes.mode
    new.modes.transport_limit = old.modes.transport_limit
    if old.completed:  # edge smoothing does not outlast a stop
        new.modes.mild = old.modes.mild
        new.modes.mild_on = old.modes.mild_on
    corners, kept = new.output.corners, old.output.corners
    corners.fillet = replace(kept.fillet)
    corners.bevel = replace(kept.bevel)
    corners.factor = kept.factor
    corners.plane = kept.plane
    corners.code = kept.code
    corners.reversed = kept.reversed
    transform = copy.deepcopy(old.transform)
    transform.rotation.on = False
    transform.rebuild()
    new.transform = transform
    new.frame.take_over(old.frame)
