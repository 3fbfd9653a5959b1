"""Texts of the reference for each G and M function of the dialect.

``docs/generate.py`` joins these texts with the tables of the code. A line names
functions. The indented lines below it describe them.
"""

from __future__ import annotations

G_FUNCTIONS = r"""
0 1 2 3
    rapid, line, arcs; alone they select the motion for the lines behind them
4
    dwell, P in seconds
10
    L2 and L20 set work offsets; P1-P9, or P0 for the system in force; other L
    and R are refused
17 18 19
    plane XY, ZX, YZ
20 21
    inch, mm
90 91
    absolute, relative
90.1 91.1
    centre of circles absolute, relative
94
    F per minute
28 30
    by the programmed point to 5161.. or 5181.. with rapid; the named axes, all
    if none is named; home is the machine's start until it is set
28.1 30.1
    store the position
40 41 42
    tool radius compensation with the radius of D, or of the tool in the
    spindle; outer corners are arcs; change of plane, cycles and G28 meanwhile
    are errors
43 43.1 49
    tool length on Z, in every plane: of tool H, or of the tool in the spindle;
    G43.1 by the word Z; acts on the coordinates at once, moves nothing; without
    any tool in the cell the length is 0, with a warning; otherwise an unknown
    tool is 900014
53
    machine coordinates; with G0 or G1, for its line, always absolute
54-59 59.1-59.3
    work offsets
61 61.1
    stop at the end of every motion
64
    ends G61; with P the path may leave the contour by P
    ([smoothing](../explanation/smoothing.md)); without P it is driven exactly;
    Q is not used
73 81 82 83 85 86 89
    [drilling cycles](#cycles)
80
    ends the motion function
92 92.1 92.2 92.3
    offset: set, clear, suspend, restore
93
    F is 1/minutes, in every motion of G1-G3; cycles are refused; after G94 F
    has to be given again
96 97
    spindle modes; with G96 S gives no row, with a warning
98 99
    back to the level before the series of cycles, or to R
5 5.1 5.2 5.3 7 8 9 11 12 13 15 16
17.1 18.1 19.1 31 33 33.1 38.2-38.5
41.1 42.1 43.2 50 51 52 60 65-69 70 71 71.1 71.2 74 76 84 87 88 95
    known to controls of this family, refused by name
"""

M_FUNCTIONS = r"""
0 1
    stop, optional stop; behind the motion of the line
2 30
    program end, behind the motion; so are `%` and the end of the file
3 4 5
    spindle; before the motion
6
    tool change; before the motion
7 8 9
    coolant; before the motion
48 49
    accepted; M49 with a warning: the overrides stay enabled
"""
