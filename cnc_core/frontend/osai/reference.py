"""What the reference says of each G function and setup code of the dialect.

``docs/generate.py`` joins these texts with the tables of the code: a line names
functions or codes, the indented lines below it describe them.
"""

from __future__ import annotations

G_FUNCTIONS = r"""
0 1
    rapid line, line at the feed
2 3
    arcs: the specification knows lines and profiles only (900003)
60 61
    end and beginning of a profile
62 63 66 67
    transitions inside a profile
70 71
    inch, mm; setups have the unit of the cell
90 91
    absolute, relative; inside a profile for points only
"""

SETUP_CODES = r"""
PNT
    type of the points, degree, format of the profile
VER
    versors that the profile gives (PRG) or that are computed (REL);
    polynomials and B-splines need every versor programmed, whatever VER says
JRK
    see [Dynamics](#dynamics)
THR
    curves pass their points exactly; Tol bounds the rounding of an edge of G67,
    Chord that of G63 and of computed curves, TolV that of rotary axes
TOL
    the tool
TOD
    tool direction with all axes at 0; normalised
CRV
    marks changes of curvature, upwards and downwards; Ratio 0 switches it off
EDG
    marks edges; 0 switches an angle off
AXI
    the axes of the profile
AXP
    with a Pitch, programmed positions of rotary and additional axes are the
    equivalent nearest to the one before; computed rotary positions are taken by
    whole turns in any case (Pitch of WRK and TOL: a multiple of 360)
DIN
    limits of the machine's axes, in bends and along the path (`DYNAMICS` rows);
    more than the cell's limit counts as that limit; Jmax and Jrap need an axis
    with a limit of jerk
MAC
    chain and bed of the machine
CIN
    offsets and turns of one element of the chain
SMT
    tolerances of `optimize`; see [Path Optimizer](#path-optimizer)
SMS
    strategy of `optimize`; see [Path Optimizer](#path-optimizer); C1 ENA and
    Progr DIS are refused by it (900003)
"""
