"""What the reference says of each G function of the dialect.

``docs/generate.py`` joins these texts with the tables of the code: a line names
functions, the indented lines below it describe them.  (R) marks a decision of
ours where the guide's text does not say.
"""

from __future__ import annotations

G_FUNCTIONS = r"""
0 1
    rapid line, line at the feed
2 3
    arcs; I and J belong to the first and second axis of the plane; under G90
    absolute unless ARC_REL is 1; a missing word counts 0 (R); radii differing
    by more than SGLR: 900007
4
    dwell of F
10 11
    feed hold and override disabled, enabled from where the path passes the
    block; feed hold and override 0 of axes count all the same
17 18 19 70
    plane; arcs and compensation need two of X Y Z (909115)
20 21
    inch, mm
90 91
    absolute, relative; D words (`DX5`) are relative in both
22-28 120 121 50-52 1050 1051
    swap, mirror, scale, rotate; arcs need equal ratios in the plane and stay in
    it (909116)
30-35
    fillets and bevels, between G1 lines in the plane; a corner at an arc, at
    rapid or beside other axes stays (R)
36 86
    rotary mode; needs a rotary axis (909113)
40 41 42 47
    tool radius compensation; begins with the first G1-G3 in the plane; outer
    corners up to 45 degrees are mitred, beyond arcs (R); the side is as
    programmed, mirrors do not change it (R); meanwhile no change of T, D,
    plane, transformation or origin (906003)
43-46
    tool length; K1 adds to the sum beside the other length
48
    third axis of the filters; error 909114 if the axis lies in the plane
53-59 92-99 82 85 89 940
    origins and offsets, with OX, DOX, USER_ZERO, USER_OFFSET, P[n], DP[n]; the
    sum of origin, offset, head and length counts (R); G89 and G86 shift home:
    rows go on from where the axes are
62
    waits until everything before is executed
71
    [homing](#homing-and-probing)
80
    stops as M0, with the message
81
    chooses the limits of each named axis, primary or secondary, by 0 to 3
83 84
    accepted: nothing to do in one process
87 88
    offset of the head off, on; H chooses the head
100
    a row of type event; where the path passes it the PLC sees its number
    ([Shared with the PLC](#shared-with-the-plc)); `run` tells "event N at ..."
    among its messages
101
    brakes, leaves out what has been handed out, goes on from where the axes
    stand; without a machine nothing happens
102
    waits for standstill, drives to where an axis meets its `[probe]` position;
    not met: 909160 behind the motion
103 104 105
    RTCP, with a table `[kinematics.N]` of the cell, else 910106; G103 Z is the
    tool length, otherwise that of the tool; the other values are kept (R); no
    axis moves at G104 and G105; transformations and origins count for the tip;
    off at program start (R)
"""

PATH_FUNCTIONS = r"""
60 61
    without stops, below the corner rules; with a stop behind each motion
63 65
    F counts along all axes; 65 stops where an axis changes its direction by
    more than SGL3D thousandths (0: not tested)
64
    F counts along the axes of the plane, where these rest along all axes;
    corners by SGLP, SGLP_RED, MAX_RED: a turn over SGLP stops; from a0 = SGLP *
    SGLP_RED % on the feed at the corner is max(1 - MAX_RED %, a0 / turn)
67 75
    64 in the plane; outside 67 as 63 with a stop behind the motion, 75 as 65
68
    F counts along the plane; X limits the speed of the axis named by G69, over
    it F counts along all axes; X-1: it never transports; G69 without an axis: X
    holds for each axis outside the plane (R); needs G69 (909117)
69
    `G69 X axis`: X up to 20: filters, AFC and 68 off (A-15); the number bounds
    how far G66 with inertia looks ahead (65536 at the most); the filters need no
    bound; the axis turns with the filtered path: its way is filtered like that
    of the others (R)
73
    `G73 X Y Z A`: noise (1), fine noise (2), both (3); a vertex goes if its
    incoming segment is shorter than Z and the turn at least Y; A1: only cusps
72
    `G72 X Y Z A`: clamped uniform B-spline of order Z over segments up to Y,
    driven in segments of A; orders 1 and 2 keep the programmed segments, which
    are that curve (R)
74
    `G74 X Y`: a vertex nearer than Y to the one kept last goes; Y0: the way of F
    in TAU; the override has no effect on these motions
106
    `G106 [axis] X A B`: y += A (x - y) along the vertices; segments longer than
    B end the run, without B those longer than the way of F in TAU
66
    `G66 X Y Z A`: the feed falls where the speed of an axis would step by more
    than SGLAFC; average over X segments, inertia Y, dead band Z, floor A; the
    limits hold whatever these do: each corner has its own largest speed; corners
    stop by SGL3D
49
    corners are rounded as a lag of TAU * 1000 / MILD would round a right angle
    at F, by the smoothing stage (R); `G49 0`, `G49 1`, `G49`
"""
