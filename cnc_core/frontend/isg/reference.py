"""Texts of the reference for each G function and # command of the dialect.

``docs/generate.py`` joins these texts with the tables of the code. A line names
functions or commands. The indented lines below it describe them. (R) marks a
decision of ours where the sources are silent.
"""

from __future__ import annotations

G_FUNCTIONS = r"""
0
    rapid line; modal
1
    line at the feed; modal
2 3
    arc, clockwise and counter-clockwise; modal
4
    dwell in seconds: `G04 X4.5`, `G04 3.0`, an expression; `G04 S10` counts
    turns of the spindle; alone in its block
17 18 19
    plane XY, ZX, YZ
70 71
    inch, mm
90 91
    absolute, relative
161 162
    centre of circles absolute, relative
163
    programmed centre; always so here
20 21 22 23 351
    mirroring; the sense of circles and the side of compensation change with it
68 69
    contour rotation on (`G68 R30 X10 Y5`, as `#ROTATION`) and off; a missing
    centre word is the present position; the third axis: 22156
51 52
    diameter programming: words of the first main axis are diameters, also with
    G91 (R)
53-59 159 160
    zero offsets of the cell (`[zero_offsets.1]` is G54); each axis takes its
    offset at its next absolute word
92
    additive offset: sets with G90, adds with G91; moves nothing
60 359 360
    exact stop: for the block, off, on
5 10 11 25 26 40-42 138 139 237 239
    [tool radius compensation](#tool-radius-compensation)
93 94 95 194
    feed: seconds for the block, per minute, per turn of the spindle, percent of
    the largest axis velocity along the path
164 165
    centre correction off, on; with G164 the radii may differ by 0.01 mm (21758)
    (R)
74
    the axes are referenced, the channel comes to a stop
80-89 800-839
    calls of subprograms
33
    thread as a line: feed = S x pitch (I J K by axis, modal, unsigned); the
    spindle's angle is not followed (R)
63 331 332
    tapping as lines; G63 with F (20007, 20635, 20636, 907070, 907071); G331 and
    G332 with S and the pitch; G332 takes the last ones
96 97 196
    S in m/min, in rev/min, limit of the speed; with G96 the speed follows the
    diameter at the end of each G01-G03; an S row comes where it changes by more
    than 0.1 % (R)
98 99
    lowest and highest position in machine coordinates; with G91 from the
    machine's own limits (R); warning 21648, error 21649
301 302
    `G301 I5` chamfer, `G302 I5` rounding; in a block of its own between two
    blocks of the plane; I is modal (20351, 911004, 911005)
150 151
    `#SPLINE OFF`, `#SPLINE ON`
61 260 261
    [contouring](../explanation/contouring.md): corners are rounded; still on at
    the program's end: warning 120206; with `#HSC`: 120433
127 128 129-134 230 231 233
    weights of velocity, acceleration and ramp time in percent of the machine's
    limits; above 100 % (below, for ramp times): warning 50130, and 100 % holds
166
    the feed of its block holds as programmed, whatever #OVERRIDE and the
    operator's override say
8 9 12 117 135 140 202 900
    always so here; nothing changes
13 115 116 136 137 167 193 293 333 334 338 339 901
    kept without effect, said once in a warning 907042; G13 without #CORNER
    PARAM: 20795; G115 beyond 14: 20151
66 100-108 112 141 200 201 236 238 303 310
    refused by name
"""

COMMANDS = r"""
CONTOUR LOOKAHEAD
    `LOG ON\|OFF [PARAM=x]`, `LOG [PARAM=x]`; `LOG CLEAR` and `CLEAR` wait until
    all earlier blocks are executed; in a full log (`contour_lookahead_log_max`)
    later elements are dropped, with a warning, and the entry that closes the
    area takes the last place (R)
DISTANCE PROG; DISTANCE PROGRAM
    `START CLEAR`: the displayed distance begins anew
FLUSH; FLUSH CONTINUE; FLUSH WAIT
    earlier blocks are executed first
EXPL SYN
    waits for functions of type MVS_SLP
RT WHILE; RT ENDWHILE
    [real-time loop](control.md), `[MODULO]`; inside only G00-G03, #SPLINE ON
    and OFF (22128, 22129 across its ends) and look-ahead markers (22073); ends
    where it begins (50991); does not nest and is closed (22181); not during
    radius compensation (22158)
RT CYCLE
    [real-time cycle](control.md): `$IF` and assignments, in every cycle of the
    interpolator
BACKWARD STORAGE CLEAR; DEL DIST2GO
    `[END = mask]`
VAR; ENDVAR; DELETE
    declare and delete variables
INIT V.E
    sets zeros and empty texts
INIT MACRO TAB
    forgets all macros
IF; ELSE; ENDIF
    conditional text
COMMENT BEGIN; COMMENT END
    comment over several lines
PSET; PRESET
    `#PSET X10` gives the position this value at once; `#PRESET [axes]` ends it
    (R); 20612 while mirrored
CS DEF; CS ON; CS OFF
    `DEF [id][v1,v2,v3,f1,f2,f3]`; `ON`, `ON [id]`, `ON [values]`, `ON
    [id][values]`; `OFF`, `OFF ALL`; see [Coordinates](#coordinates)
ACS DEF; ACS ON; ACS OFF
    as `#CS`, outside of all `#CS` and offsets
CS ADD; CS SET; CS SELECT; CS DEL
    named stack: `ADD [NAME][values]`, `SET [NAME][values]`, `SELECT [NAME]`,
    `SELECT [MCS]`, `DEL`, `DEL ALL`; 21601
CS MODE ON; CS MODE OFF
    `[ROTATION_SEQUENCE=XYZ ROTATION_MODE_FIXED]` for the definitions that
    follow: the six sequences of three different axes; about fixed axes instead
    of turned ones
ROTATION ON; ROTATION OFF
    `[ANGLE=30 CENTER1=10 CENTER2=5]`, degrees and programmed coordinates; ends
    with the plane (warning 910110); warned of in cycles (910111)
MCS ON; MCS OFF
    transformation, coordinate systems and all offsets off and on again; `[EX
    TOOL]`; 20802, 21531
KIN ID
    `[n]` chooses a table `[kinematics.n]` of the cell; without it `kin_id` of
    the channel or the first table holds; 0 without such a table: none; not
    while a kinematic is active (20687); `kin_id` of a tool chooses with D
    (20990)
TRAFO ON; TRAFO OFF; TRAFO
    the tool tip is programmed; `[id]`, `[id, OFF]` with OFF, ON, NONE, DEFAULT;
    a second step is refused; 292005, 21552
RTCP ON; RTCP OFF
    old names of `#TRAFO ON`, `#TRAFO OFF`
TLC ON; TLC OFF
    `[dl]`: the axes are programmed for a tool that is dl shorter; the tip stays
    on their path; the kinematic of `#KIN ID` gives the tool direction; not with
    `#TRAFO` (20669)
PTP ON; PTP OFF
    lines of the axes to ends programmed as before; F acts along the axes; 21525,
    21527, circles 910105
ORI MODE
    `[ANGLE]`, which is always so; other modes are refused
TOOL ORI CS
    the rotary axes alone turn, at rapid, to the nearest position, also without
    `#TRAFO`; 910101, 910102, 292005
SUPPRESS OFFSETS
    `[ZERO ADD_ZERO PSET TOOL]` for its block; all if none is named
CHANNEL INIT; SET DEC LR SOLL
    waits until all earlier blocks are executed
GET CMDPOS; SET IPO SOLLPOS
    `[P1=X, ..]`: programmed positions
OVERRIDE
    `[FEED_FACT=50 RAPID_FACT=20]` on all later feeds and rapids, 0.1..200 %;
    rapid at most as fast as the axes
VECTOR LIMIT ON; VECTOR LIMIT OFF; VECTORVEL; VECTORACC
    limits of the path for all later feed motions, with the key RAPID for rapid
    ones too (R): VEL mm/min; ACC, DEC (the smaller of both holds), RADIAL_ACC,
    TRANS_ACC mm/min^2; JERK, RADIAL_JERK mm/min^3
CONTOUR MODE; CONTOUR MODE ON; CONTOUR MODE OFF
    [contouring](../explanation/contouring.md)
HSC; HSC ON; HSC OFF; FILTER ON; FILTER OFF
    [smoothing](../explanation/smoothing.md) within PATH_DEV (0.2 mm), TRACK_DEV
    (5 degrees), AX_DEV (0.01 mm (R));
    [contouring](../explanation/contouring.md)
SPLINE TYPE; SPLINE ON; SPLINE OFF; AKIMA TRANS; AKIMA STARTVECTOR; AKIMA ENDVECTOR; SET SPLINETYPE
SET SPLINE ON; SET SPLINE OFF; SET ASPLINE MODE; SET ASPLINE STARTTANG; SET ASPLINE ZIELTANG
    splines through the programmed points;
    [contouring](../explanation/contouring.md)
CHR; CHF; RND; FRC
    at the end of their block, wherever it lies: chamfer by the distance from the
    corner, chamfer by its length, rounding by its radius, feed of the new
    element (R)
SLOPE; SET SLOPE PROFIL
    `[TYPE=STEP\|TRAPEZ\|SIN2\|HSC]`, `DEFAULT`; limits of jerk of the machine
    hold with every type (R)
FGROUP
    F is the speed of these axes; circles need all main axes or none (21209);
    ROT and WAXIS are refused
TANGFEED; SET TANGFEED
    `[RMIN=..]`: an arc with a smaller radius is driven slower, in the ratio of
    its radius to RMIN (R)
TIME; TIMER
    dwell; `START\|STOP\|READ\|CLEAR [SYN ID=1]`, ms of machine time as it was
    when the last wait came true
CALL AX; AX REQUEST
    `[FAST] [name,number,index]..`: axes come into the channel, at the places
    that the indices say ([channels](../channels.md)); the block stands alone
    and waits until everything before it is executed; options for offsets and
    NAM, NBR, IDX are refused
PUT AX; AX RELEASE
    `[name,..]`, `ALL`, `NBR [number,..]`: axes leave the channel; an axis that
    is not there is no error
SET AX; AX DEF
    `[name,number,index]..`: these axes alone; others leave the channel.
    `#AX DEF DEFAULT`: the axes of the cell file
WAIT; WAIT FOR; SIGNAL; SIGNAL READ; SIGNAL REMOVE
    `[SYN] [ID COUNT P CH AHEAD IDMIN IDMAX]` between [channels](../channels.md); in a cell
    with one a wait for a signal that has not been sent is error 907052,
    lenient a warning
MC_MOVEPATH; MCV_GRPRESETFORCED; WAIT MC_STATUS
    `[SYN] [CH JobID FileName="x.nc" @PL1=..]`: a program in another
    [channel](../channels.md#starting-a-channel), and waits for it
ERROR
    RC=0 a warning; 2 and 7 error 907050
MSG
    `%d %f %s %%` with widths; SYN, ACK wait until all earlier blocks are
    executed; 20726, 907051
MSG SAVE
    one line in `message.txt` or the file of `#FILE NAME [MSG=..]`, below the
    folder of the run (907053); EXCLUSIVE without time, CONTINUE without line
    end; only `run` writes
FILE NAME; FILENAME
    keys MSG, M6, G80 to G839
PATTERN; AT; DISABLE MODAL CYCLE
    [cycles](cycles.md)
SCALE ON; SCALE OFF
    `[X2 Y2 Z2]`: factors of the words of main axes about the zero of the
    workpiece, from the next absolute word on, and of the lengths of corners
    (#CHR, G302); circles, corners and pockets need equal factors in their plane
    (910113) (R)
CAXTRACK OFF
    it is never on
CHANNEL SET
    `[ESA_TIME0=.. ESA_TIME1=.. ESA_TIME2=..]`, s, until the program ends
    ([HLI](hli.md)); other keys are stored
TRACK CHAN ON; TRACK CHAN OFF
    `[EXTEND=1 MAX_SCALE=.. MAX_EQUID=..]`; see [Die sinking](#die-sinking);
    DYN_CS is refused
LAH; TRANSVELMIN; CORNER PARAM; SET CORNER PARAM; FF
DYNAMIC WEIGHT; LIMIT REFRESH; LIMIT LOAD; VIB GUARD
    motion: keys and brackets are not looked into
KIN DATA; TLAX; MEAS MODE; DIST TO GO; EXPORT VE; BCS DEF; TRC; SEGMENTATION
    geometry and positions: keys and brackets are not looked into
CACHE; ADD; MSG INFO; LOCK; UNLOCK; BLOCKSEARCH; SINGLE STEP; OPTIONAL EXECUTION
STOP REVERSIBLE; RETAIN CYCLE CHANGES
    program run: keys and brackets are not looked into
MACHINE DATA; SAVE CONFIG; LOAD CONFIG; CLEAR CONFIG; TOOL DATA; TOOL PREP; TOOL REFRESH; TOOL LIFE
FREE TOOL CHANGE; COMMAND; IDENT; DRIVE; HANDWHEEL; JOG; MANUAL LIMITS
    machine and tools: keys and brackets are not looked into
CS; CS TRACK; CS SHIFT Z; ACS; BCS ON; BCS OFF; ECS; ROTATION; SCALE; TRACK CS
TRANSFORM; MCS TO WCS; WCS TO MCS; KIN TCP; TRAFO STACK; TRAFO PCS; CYL; FACE; CAX
    coordinates and kinematics
CHANNEL INTERFACE; SYNC IN; SYNC OUT; WAIT INDP; RT
    several channels, waits
ANG; CONTROL AREA; AX; SET AX LINK; ACHSE; ACHSTAUSCH; ENABLE AX LINK; DISABLE AX LINK
GANTRY; GEAR LINK; CAXTRACK ON; DIST CTRL; EXTCOMP; OTC; VOLCOMP; MAIN SPINDLE; TURN; EDM
    axes, couplings, compensations
GET ACTPOS; GET AX; GET MANUAL OFFSETS; GET WCS POSLIMIT; MEAS
    actual positions, an axis of another channel, measuring
FILE RENAME; FILE DELETE; FILE EXIST; PUNCH; NIBBLE; STROKE DEF; EDGE MACHINING; MICROJOINT
    files, sheet metal
"""
