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
    new.spindle, new.tool, new.tables, new.diameter = (
        old.spindle,
        old.tool,
        old.tables,
        old.diameter,
    )
    new.rotary_modes, new.pause_mode, new.depth_axis = (
        dict(old.rotary_modes),
        old.pause_mode,
        old.depth_axis,
    )
    new.plane_pair, new.plane_code, new.plane_reversed = (
        old.plane_pair,
        old.plane_code,
        old.plane_reversed,
    )
    if old.plane_code:
        modal.apply(MotionWords(plane=old.plane_code))
    new.modes.mode, new.modes.transport_limit = (
        old.modes.mode,
        old.modes.transport_limit,
    )
    if old.completed:  # edge smoothing does not outlast a stop
        new.modes.mild, new.modes.mild_on = old.modes.mild, old.modes.mild_on
    corners, kept = new.output.corners, old.output.corners
    corners.fillet, corners.bevel, corners.factor = (
        replace(kept.fillet),
        replace(kept.bevel),
        kept.factor,
    )
    corners.plane, corners.code, corners.reversed = (
        kept.plane,
        kept.code,
        kept.reversed,
    )
    transform = copy.deepcopy(old.transform)
    transform.rotation.on = False
    transform.rebuild()
    new.transform = transform
    new.frame.take_over(old.frame)
