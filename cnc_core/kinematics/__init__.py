"""Kinematics: chains of machine axes, the tool tip, its inverse.

::

    from cnc_core.kinematics.chain import Chain, Joint, Step
    from cnc_core.kinematics.machine import Kinematics
    from cnc_core.kinematics.machine_types import Element, machine_chain

    # steps: offset mm, turns degrees (X, Y, Z order)
    elements = {"LI1": Element(1, Step(..)), ..}
    chain = machine_chain("TOL", "B12", elements, part=Step(..), tool=Step(..))
    # channel indices of X Y Z; limits (axes,)
    kin = Kinematics(chain, tip_axes=(0, 1, 2), low=low, high=high)
    # q (n, axes): pose.tip and .direction (n, 3), .rotation (n, 3, 3)
    pose = kin.forward(q, length)
    # linear axes that hold the tip for the rotary angles in q
    q = kin.axes_of_tip(tip, q, length)
    # rotary angles of a tool direction: nearest branch and turn within limits
    q = kin.orient(direction, near)
    # both, pose by pose
    q = kin.inverse(tips, directions, near, length)
    # all branches, with the axes that are free (singular)
    inverse.branches(chain, direction)
    # (n, 3, axes): axis positions with exact first and second derivatives
    kin.driven_jets(programmed_jets, length)

Errors are CncError.  910101: the direction is not reachable.  910102: it is
reachable beyond the limits only.  Mathematics, cell keys and the stage:
``docs/reference/kinematics.md``.
"""
