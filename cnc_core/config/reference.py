"""What the reference says of each key of a cell file.

``docs/generate.py`` joins these texts with the models: type, default and range
come from there.  ``[TABLE]`` begins a table of the file; ``KEY | UNIT`` names a
key, the indented lines below it describe it.
"""

from __future__ import annotations

KEYS = r"""
[]
name |
    name in reports
cycle_s | s
    GEO cycle
[axes.NAME]
    One table for each of the 1 to 9 axes, in the order of the channel.  Names
    begin with X Y Z U V W Q A B C; without any table the axes are X Y Z.
kind |
    for rotary axes read degrees wherever a name says mm
v_max_mm_s | mm/s
    limit of rapid and feed
a_max_mm_s2 | mm/s2
    limit of the acceleration
j_max_mm_s3 | mm/s3
    limit of the jerk, at least 1; 0: none; without one on any axis the planner
    is acceleration-limited ([planner](../explanation/planner.md))
min_mm | mm
    lower software limit, checked before motion (error 903001)
max_mm | mm
    upper software limit, above min_mm
start_mm | mm
    position at program start, within the limits
id |
    logical axis number; default: the place in the file
[startup]
    Start-up parameters.  A key of `[channel]` replaces the one of its name.
interpolator_function |
    P-STUP-00070, `configuration.channel[i].interpolator.function`: as
    interpolator_function of `[channel]`
contour_lookahead_log_max | entries
    P-STUP-00076,
    `configuration.channel[i].interpolator.contour_lookahead_log_max`: as
    contour_lookahead_log_max of `[channel]`
[channel]
interpolator_function |
    P-CHAN-00650: functions joined by `\|`; a warning names unknown identifiers
    and those without effect here ([HLI](hli.md))
fct_enable |
    alias of interpolator_function; both are joined
build_generation |
    sizes LOW/STANDARD/HIGH of the look-ahead: 30/120/190, or 30/70/120
lookahead_blocks_max | blocks
    P-CHAN-00653: bound of lookahead_blocks
lookahead_blocks | blocks
    the window with `FCT_LOOK_AHEAD_CUSTOM`
tolerance_mm | mm
    path deviation that is allowed where the program commands none; 0: the path
    is exact and the axes nearly stand at corners. `--tolerance` overrules it
contour_lookahead_log_max | entries
    P-CHAN-00658; 0: nothing is logged, mode 2 is off; a warning if it is less
    than the blocks of the look-ahead
fb_storage_size | bytes
    P-STUP-00033, 176 bytes a block; 0: mode 1, backward motion and deleted
    distance to go are off; a value below 65536 is raised to it with a warning
service |
    how look-ahead requests are answered: once a cycle, or at once
rapid_override_mode |
    P-CHAN-00181: 0 feed override acts on rapid too, 1 the smaller of both, 2
    and 3 rapid override only
m_synch |
    P-CHAN-00041: synchronisation type by M number, e.g. `50 = "MOS"`; M0-M11,
    M17, M19, M29, M30, M40-M45 have `NO_SYNCH`; other M functions are errors
h_synch |
    P-CHAN-00027: the same by H number; default `NO_SYNCH`
tool_synch |
    P-CHAN-00086: the same for T
m_pre_outp | 0.1 um, us
    P-CHAN-00070 by M number: distance of `MEP_SVS`, time of `MET_SVS`
g_programs |
    P-CHAN-00160, 00187: subprogram files of user G functions 80 to 89 and 800
    to 839, e.g. `80 = "drill.nc"`
m6_program |
    P-CHAN-00118: subprogram file of M06; empty: a plain M function
esa_time | s
    P-CHAN-00324: times of FCT_CALC_STATE_AT_T
kin_id |
    kinematic that `#KIN ID` and `#TRAFO ON` choose without a number; default:
    the first table; 0 without such a table: none
repeated_blocks_max |
    blocks with motions or functions that `plan` and `blocks` execute again
    before a program counts as endless (907001); 0: any number
skip_levels |
    block skip levels that are on, taken over at program start
state_after_program |
    state of the operation mode behind a program's end
[channels.NAME]
    One table for each of 2 to 12 channels, in the order of `gpCh`
    ([channels](../channels.md)).  It takes the keys of `[channel]`, which it
    replaces for this channel, and tables of its own: `axes`, `spindles`,
    `tools`, `external`, `zero_offsets`, `probe`, `kinematics`, `isons`, `osai`.
program |
    what the channel executes where the command line names none, relative to the
    cell file
dialect |
    dialect of its programs; default: found by the program
guest_axes |
    logical numbers of axes of other channels that may come into this one by
    `#CALL AX`; each makes a place of its kind behind the channel's own axes
[channel.hscs.STATE]
    STATE is deselect, rough, prefinish or finish: what SysHscSettings calls
    ([cycles](cycles.md)), and V.G.HSCS.
prog |
    file name of the subprogram
prg |
    accepted for prog, with a warning
tolerance | 0.1 um
    tolerance of the state
[tools.N]
    Tool data set D.
radius_mm | mm
    radius
length_mm | mm
    length
kin_id |
    P-TOOL-00011: kinematic that the tool is for
[external.NAME]
    A variable `V.E.NAME` that programs share with the PLC; a name with dots
    stands in quotes: `[external."S.A"]`.
type |
    type of the variable
scope |
    area `gpVECh[0]` or `gpVEGlobal`
block |
    first 24-byte block; default: the next free one of its scope
size | elements
    of an array; default: no array
characters |
    of a STRING; more than 23 take several blocks
synchronised |
    reading and writing waits until all earlier blocks are executed
[]
zero_offsets | mm, degrees
    `[zero_offsets.N]`, N from 1 (G54) to 96: offsets by axis name, e.g. `X =
    120.0`
probe | mm, degrees
    `[probe]`: machine positions by axis name at which the simulated probe trips
[isons]
    The [IsoNs dialect](isons.md#machine-parameters); its machine parameters are
    keys in capitals.
parameters |
    the machine parameters; each may stand in `[isons]` under its own name
origins | mm, degrees
    `[isons.origins.N]`, N from 0 to 255: origin slots by axis name
offsets | mm, degrees
    `[isons.offsets.N]`, N from 0 to 255: offset slots by axis name
canopen |
    `[isons.canopen.NODE]`, NODE from 0 to 127: objects `"INDEX:SUBINDEX" =
    value`
events |
    number of the M function by event, -1: none; M_START, M_END, M_ERROR, M_STOP, M_PAUSE,
    M_GOPAUSE, M_GOBLOCK, M_GORETRACE
macro_folder |
    where macros are looked for behind the program's folder; a relative path
    begins at the program's folder
app_path |
    value of `$APPPATH` in IMPORT; a relative path begins at the program's
    folder
pauses |
    text of the message of G80 by its code; another code gives NO CODE PAUSE
positioners |
    number of simulated positioners
passes_max |
    jumps back that `plan` and `blocks` follow; 0: any number
io_block |
    first block of inputs and outputs in the global external variables
[isons.heads.N]
    Heads, N from 0 to 255.
offset | mm, degrees
    by axis name, from home
sensor | mm, degrees
    by axis name, from head 0
user |
    values of the user
[isons.tools.N]
    Tools, N from 0 to 65535.
diameter | mm
    diameter
length | mm
    length
max_rpm | rev/min
    largest speed of the spindle
user |
    values of the user
[isons.homing.AXIS]
    Simulated sensors of an axis, in machine positions.
negative | mm, degrees
    where the sensor of the negative direction switches on; default: no sensor
positive | mm, degrees
    where the sensor of the positive direction switches on; default: no sensor
release | mm, degrees
    how far back a sensor switches off
index | mm, degrees
    distance of the encoder's index marks; 0: none
index_offset | mm, degrees
    position of one index mark
absolute | mm, degrees
    what an absolute encoder says where the axis stands; default: no encoder
limit_negative | mm, degrees
    where the limit switch of DS402 methods 1 and 17 switches on
limit_positive | mm, degrees
    where the limit switch of DS402 methods 2 and 18 switches on
[inputs.SYMBOL]
    Simulated inputs of the PLC: variables of its tasks that the machine writes
    ([how-to](../howto/simulated_inputs.md)).  `[inputs.Clamp.closed]` is the
    variable `closed` of the task `Clamp`.
start | -
    first value, a BOOL or a number
follows |
    a symbol that the input repeats; without a dot one of its own task
above | -
    a BOOL, TRUE while the followed number is above
below | -
    a BOOL, TRUE while the followed number is below
inverted |
    the opposite of what it follows
on_delay_s | s
    how long it takes to become TRUE
off_delay_s | s
    how long it takes to become FALSE
lag_s | s
    time constant of a number that follows
[inputs.SYMBOL.steps]
    What an input becomes instead of following: a list, each with one of
    time_s, distance_mm and m.
value | -
    what it becomes
time_s | s
    at this cell time
distance_mm | mm
    whenever the path passes this distance forward
m |
    whenever the CNC hands over this M function
delay_s | s
    how much later
[osai]
    What the manual of the [HSM dialect](osai.md) leaves open.
feed |
    of polynomials and B-splines: that of their parameter, or along the arc
location |
    where a cutter location point lies on a ball or toroidal tool
setup_unit |
    unit of the lengths in setup files
[kinematics.N]
    Kinematic transformations, N from 0 to 999: [kinematics](kinematics.md).
type |
    chain of the machine
bed |
    where the bed stands; BC1 and BC2 only with auxiliary rotary axes
linear |
    three axes, from the part to the tool
rotary |
    two axes, the one nearer to the part first
directions |
    direction by axis name; tables and slides that carry the part: that in which
    the part moves
points | mm
    a point on the axis, by name of the rotary axis
part | mm
    origin of the part's coordinates
spindle | mm
    where the tool is attached
tool_direction |
    from the tip to the spindle
cin | mm, degrees
    instead of the five above: `NAME = [OffX, OffY, OffZ, RotX, RotY, RotZ]` of
    every axis, `t` (tool) and `w` (part)
[spindles.NAME]
    One spindle; its axis area follows those of the channel's axes.
id |
    logical axis number
m3_synch |
    synchronisation type of M3
m4_synch |
    synchronisation type of M4
m5_synch |
    synchronisation type of M5
m19_synch |
    synchronisation type of M19
s_synch |
    synchronisation type of an S word alone
"""
