"""Kinematics: machine axes and tool tip, software limits, the stage that turns
tip rows into axis rows.

::

    from cnc_core.kinematics.chain import Chain, Joint, Step        # steps:
    offset mm, turns degrees (X, Y, Z order)
    from cnc_core.kinematics.osai import Element, machine_chain     # OSAI: MAC,
    bed, CIN codes -> Chain
    from cnc_core.kinematics.machine import Kinematics

    chain = machine_chain("TOL", "B12", {"LI1": Element(1, Step(..)), ..},
    part=Step(..), tool=Step(..))
    kin = Kinematics(chain, tip_axes=(0, 1, 2), low=low, high=high)  # channel
    indices of X Y Z; limits (axes,)
    pose = kin.forward(q, length)            # q (n, axes): pose.tip, .direction
    (n, 3), .rotation (n, 3, 3)
    q = kin.axes_of_tip(tip, q, length)      # linear axes that hold the tip for
    the rotary angles in q
    q = kin.orient(direction, near)          # rotary angles of a tool
    direction: nearest branch and turn within limits
    q = kin.inverse(tips, directions, near, length)   # both, pose by pose
    inverse.branches(chain, direction)       # all branches, with the axes that
    are free (singular)
    kin.driven_jets(programmed_jets, length) # (n, 3, axes): axis positions with
    exact first and second derivatives

Errors are CncError: 910101 direction not reachable, 910102 reachable beyond the
limits only.  Mathematics, cell keys and the stage: ``docs/kinematics.md``.
"""
