"""What the reference says of each member of the HLI.

``docs/generate.py`` joins these texts with ``hli.layout``.  Names in capitals
begin structures with the same members; the indented line below describes them.
``member | unit | writer | meaning`` describes a member and may go on in indented
lines.  Without a writer the ending of the name decides: ``_r`` CNC, ``_w`` PLC,
``_rw`` both.
"""

from __future__ import annotations

from .reference_ahead import AHEAD

_MEMBERS = r"""
HLI_SEGMENT
    the shared-memory object of one cell
segment_head | | CNC | identity of the segment
platform | | both | `gpPform`
channel | | both | `gpCh[i]`
axis | | both | `gpAx[i]`
ext_var_channel | | both | `gpVECh[i]`: external variables of a channel
ext_var_global | | both | `gpVEGlobal`: external variables of all channels
sidecar | | both | turns, bells, seqlock and life of both processes; not public
ahead | | both | `gpAhead[i]`: the look-ahead extension, behind all other areas
HLI_SEGMENT_HEAD
    first bytes of the segment
magic | | CNC | the bytes `HLICOSIM`
abi_version | | CNC | 1
channel_count | | CNC | configured channels (`gNrCh`); pointers behind them are
    NULL: an index raises `HliNotConfigured`, iteration gives None
axis_count | | CNC | configured axes (`gNrAx`)
ready | | CNC | 1: published; written last, with release order
segment_size | bytes | CNC | size of the whole
owner_pid | | CNC | process that created the segment
owner_start | ticks | CNC | its start time since boot: a recycled process id has another one
layout_hash | | CNC | SHA-256 of `layout.describe()`
HLI_PLATFORM
    `gpPform`
plc_present_w | | | not evaluated
nc_config | | both | versions
channel_count_r | | | configured channels
axis_count_r | | | configured axes
customer_val_r | | | 0
HLI_NC_CONFIG
    versions of both sides
hli_version_w | | | not evaluated
hli_version_r | | | version of the interface
nc_kernel_version_r | | | version of the CNC
HLI_INTF_VERSION HLI_ACHS_NAME
    the text of a version or a name
zeichen | | as its holder | characters
HLI_CHANNEL
    `gpCh[i]`
head | | both | identity, watchdogs
decoder_mc_control | | both | control units of the decoder
bahn_mc_control | | both | control units of the path
channel_mc_control | | both | operation mode and state
decoder_state | | CNC | status of the decoder
bahn_state | | CNC | status of the path, every cycle, under the seqlock
used_units_std_sync_r | | | technology units in use
used_units_late_sync_r | | | late technology units in use
techno_unit_std_sync | | both | M, H, T functions
techno_unit_late_sync | | both | functions of late synchronisation, with gaps
mc_error | | both | errors of the CNC
lc_error | | both | errors of the PLC
contour_lookahead | | both | the contour look-ahead unit; begins on a cache line
hb_mc_control | | both | units of the manual mode; there is none
HLI_HEAD_CHANNEL
    head of a channel
version_w | | | not evaluated
version_r | | | version of the interface
sizeof_interface_r | bytes | | size of the channel's area
channel_nr | | CNC | number of the channel, from 1
channel_type_r | | | 0
plc_present_w | | | TRUE: the PLC works on this channel; without it its units are dead
init_done_r | | | TRUE: the area is ready
mc_watchdog | | both | the PLC shows that it lives
lc_watchdog | | both | the CNC shows that it lives
MC_WATCHDOG_UNIT
    watchdog
enable_w | | | TRUE: the watchdog is watched
alive_rw | | | the watched side sets it, the other one clears it
alive_state_r | | | TRUE: alive; it falls for good
cycle_time_w | us | | longest time between two signs of life; 0: 1 s
HLI_HEAD_AXIS
    head of an axis
plc_present_w | | | TRUE: the PLC works on this axis
error_r | | | 0
reset_error_locked_r | | | 0
log_ax_n_r | | | logical axis number
axis_type_r | | | 1 linear, 2 rotary, 4 spindle
sizeof_interface_r | bytes | | size of the axis's area
MC_CONTROL_BOOL_UNIT MC_CONTROL_UNS16_UNIT
MC_CONTROL_SGN32_UNIT MC_CONTROL_UNS32_UNIT
MC_CONTROL_LREAL_UNIT
    level unit: the command counts while `enable_w` is TRUE
request_r | | | 0: there is no graphical interface
enable_w | | | TRUE: the PLC's command counts
command_w | | | what the PLC wants
state_r | | | what is in use
HLI_DECODER_MC_CONTROL
    control units of the decoder
program_block_ignore | | both | skip levels: bit n - 1 is level n; taken over at
    program start
single_block | | both | not supported, as in the kernel
execution_mode | | both | 0x2000: no M, H, T output; other values are refused (905021)
HLI_BAHN_MC_CONTROL
    control units of the path
feedhold | | both | brakes and stands on the path
override | 0.1 % | both | of the feed, 0 to 2000
override_valid | | both | TRUE: the override counts
rapid_override | 0.1 % | both | of rapid, by P-CHAN-00181
rapid_override_valid | | both | TRUE: the rapid override counts
single_block | | both | stands ahead of each block with motion
continue_machining | | both | its rising edge leaves M00, M01, single block and
    inserted stops
m01_stop_enable | | both | M01 stops
delete_distance_to_go | | both | its rising edge leaves out the rest of the block
del_dist_to_go_end | | both | mask of `#DEL DIST2GO` marks where the line may end
backward_motion | | both | TRUE: backward on the path
simulate_motion | | both | functions ahead are put out as MOS
backward_storage_off | | both | clears the store
rt_loop_enable | | both | `V.RTG.LOOP.ENABLED`: the real-time loop is driven,
    and once more at its end
ext_command_speed | 1 um/s | both | path speed instead of feed, rapid and
    override; negative: backward
ext_command_speed_valid | | both | TRUE: the external speed counts
insert_cmd | | both | inserted stops
MC_CONTROL_INSERT_CMD_UNIT
    inserted stops
enable_w | | | TRUE: the unit is used
command_semaphor_rw | | | the PLC sets it behind the data, the CNC clears it
command_w | | | the stop
state_r | | | the next stop
HLI_INSERT_CMD_COMMAND
    a stop to be inserted
dist_or_pos | 0.1 um | PLC | distance or position of the stop
rel_abs_mode | | PLC | 1 from program start, 2 once from here, 0 again and again
axis_nr | | PLC | logical number of an axis, for a position
m_function_nr | | PLC | 0 M00, 1 M01, else that M function
add_nr | | PLC | value that the function carries
HLI_INSERT_CMD_STATE
    the next inserted stop
distance_of_next_stop | 0.1 um | CNC | distance; -1: none in sight
position_at_next_stop | 0.1 um | CNC | position of each axis there
HLI_CHANNEL_MC_CONTROL
    operation mode
mode_and_state | | both | transitions of mode and state
MC_CONTROL_MCM_MODE_STATE_UNIT
    transitions of mode and state
request_r | | | 0
enable_w | | | TRUE: the PLC's commands count
command_w | | | the transition wanted
request_semaphor_rw | | | 0
command_semaphor_rw | | | the PLC sets it behind the data, the CNC clears it
state_r | | | mode and state
HLI_PROC_TRANS_TO_MODE_STATE
    a transition
from_mode | | PLC | mode it begins in; a wrong one is counted
from_state | | PLC | state it begins in; a wrong one is counted
to_mode | | PLC | 1 standby, 2 automatic, 3 MDI, 4 manual, 5 reference
to_state | | PLC | see [Operation modes](control.md)
channel | | PLC | number of the channel
parameter | | PLC | name of the program, or the text of MDI
HLI_IMCM_MODE_STATE
    mode and state
mode | | CNC | `HLI_IMCM_*_MODE`
state | | CNC | `HLI_IMCM_PROCESS_*`; 7 to 15 are transient
HLI_DECODER_STATE
    status of the decoder
program_end_r | | | TRUE: the program is read to its end
syntax_check_r | | | 0
wait_after_error_r | | | TRUE: stands behind an error
HLI_BAHN_STATE
    status of the path
dist_prog_start | 0.1 um | CNC | distance from program start
dist_to_go_r | 0.1 um | | distance to the end of the block
eta_time_r | us | | motion time to the next change from rapid to feed (FCT_CALC_TIME)
dist_v_0_r | 0.1 um | | way to standstill if the feed were held now (FCT_CALC_POS_V_0)
esa_vb | 1 um/s | CNC | path speed to come (FCT_CALC_STATE_AT_T); -1: not known
covered_distance_r | 0.1 % | | share of the block that is driven
block_count_r | | | counted block
block_number_r | | | N of the block
command_feed_r | 1 um/s | | programmed feed
active_feed_r | 1 um/s | | path speed; negative while it drives backward
stop_condition_r | | | why the path stands, [bit by bit](control.md)
error_id_r | | | number of the error
tool_nr_r | | | tool
file_offset_r | | | -1: not known
override_r | 0.1 % | | override in use
block_search_state_r | | | 0
program_end_r | | | TRUE: no program is processed, ahead of the first one too
interpolation_active_r | | | TRUE: the path is driven
axes_in_position_r | | | TRUE: the path stands
wait_axes_in_position_r | | | 0
wait_techno_acknowledge_r | | | TRUE: waits for the PLC's acknowledgement
wait_continue_r | | | TRUE: waits for continue_machining
wait_error_removal_r | | | TRUE: waits for the removal of an error
dwell_time_active_r | | | TRUE: dwells
speed_limit_detect_r | | | 0
block_search_active_r | | | 0
delete_distance_to_go_active_r | | | TRUE: distance to go is being left out
feedhold_active_r | | | TRUE: the path is held, by feed hold, an axis or the mode
rapid_active_r | | | TRUE: rapid motion
backward_active_r | | | TRUE: drives backward
error_r | | | TRUE: an error stands
eta_valid_r | | | TRUE: eta_time_r counts
pos_v_0_valid_r | | | TRUE: dist_v_0_r and the positions count
esa_data_valid | | CNC | TRUE: esa_vb counts
inside_rt_loop_r | | | TRUE: inside a real-time loop
g_function_r | | | 0
prog_name_r | | | name of the program
rt_loop_count_r | | | `V.RTG.LOOP.COUNT`: passes of the real-time loop that are over
coord_r | | | status by axis
pos_v_0_pcs_r | 0.1 um | | positions of standstill, programmed coordinates
pos_v_0_acs_r | 0.1 um | | positions of standstill, axes
HLI_COORD
    status of one axis of the channel
log_axis_nr_r | | | logical axis number
axis_type_r | | | 1 linear, 2 rotary
state_r | | | 3 while the path moves, else 1
name | | CNC | name of the axis
cmd_position_r | 0.1 um | | position at the end of the block
act_position_r | 0.1 um | | present position
current_position_r | 0.1 um | | present position
acs_position_r | 0.1 um | | present position of the axis itself
dist_to_geom_end_r | 0.1 um | | 0
hb_display_r | | CNC | status of the manual mode
axis_name_r | | | name of the axis
HLI_HB_DISPLAY
    status of the manual mode of an axis; there is no manual mode
state | | CNC | 0: not active
operation_mode | | CNC | 0: none
control_element | | CNC | 0: none
hr_aufloesung | increments | CNC | 0: no handwheel
tipp_geschw | 1 um/s | CNC | 0: no continuous jog
jog_geschw | 1 um/s | CNC | 0: no incremental jog (reconstructed name)
jog_weg | 0.1 um | CNC | 0: no incremental jog (reconstructed name)
TECHNO_UNIT_CH TECHNO_UNIT_AX
    an M, H or T function of the channel, or a spindle function
please_rw | | | the CNC sets it behind the data; the PLC clears it once it has fetched them
done_w | | | the PLC sets it: the function is acknowledged
fkt_ctrl_r | | | kind: 1 M, 2 H, 3 S, 4 T
attribut_r | | | its data
HLI_ATTRIBUT
    data of a function; the kind says which structure lies over it
data | | CNC | bytes of HLI_M_H_PROZESS, HLI_S_PROZESS or HLI_T_PROZESS
HLI_M_H_PROZESS
    data of an M or H function
nr | | CNC | number
zeit | us | CNC | 0: no supervision of time
satz_nr | | CNC | N of the block
zeilen_nr | | CNC | counted block
add_value | | CNC | value of `M52=-345`
nr_late_sync | | CNC | unit of the late synchronisation
synch_mode | | CNC | synchronisation type
HLI_S_PROZESS
    data of a spindle function
pos | 0.0001 degrees | CNC | position
rev | 0.001 degrees/s | CNC | speed
zeit | us | CNC | 0: no supervision of time
move_cmd | | CNC | 3, 4 or 5: M function; 0 for M19
pos_cmd | | CNC | 19 for M19, else 0
axis_nr | | CNC | logical axis number
nr_late_sync | | CNC | unit of the late synchronisation
synch_mode | | CNC | synchronisation type
satz_nr | | CNC | N of the block
zeilen_nr | | CNC | counted block
HLI_TOOL_ID
    name of a tool
basic | | CNC | number
sister | | CNC | number of the sister tool
variant | | CNC | number of the variant
sister_valid | | CNC | TRUE: sister counts
variant_valid | | CNC | TRUE: variant counts
HLI_T_PROZESS
    data of a T function
id | | CNC | the tool
add_info_r | | | 0
nr_late_sync | | CNC | unit of the late synchronisation
synch_mode | | CNC | synchronisation type
MC_ERROR
    an error record
satz_r | | who reports | the record
semaphor_rw | | | the writer sets it behind the record, the reader clears it
enable_w | | | TRUE: the next record waits until this one is cleared
HLI_ERROR_SATZ
    an error record
kopf | | who reports | head
rumpf | | who reports | body
HLI_ERROR_KOPF
    head of an error record
error_id | | who reports | number
modul_name | | who reports | module that reports; `HLICOSIM` from the CNC
line | | who reports | line of the program
util_error_id | | who reports | 0
util_modul_name | | who reports | 0
util_line | | who reports | 0
multiple_id | | who reports | 0
function_type | | who reports | 0
channel | | who reports | number of the channel
sender | | who reports | 0
suppress | | who reports | 0
date | | who reports | 0
cycle | | who reports | cycle of the report
version | | who reports | 0
recovery_class | | who reports | what removes the error
reaction_class | | who reports | what the CNC does
body_type | | who reports | 1: the body is HLI_RUMPF_NC_PROG
HLI_MODUL_NAME
    name of a module
zeichen | | who reports | characters
HLI_ERROR_RUMPF
    body of an error record
maske | | who reports | bytes of HLI_RUMPF_NC_PROG for errors of NC programs
value | | who reports | 0
identifier | | who reports | 0
HLI_ERROR_MASKE
    room of the body
err_mask | | who reports | bytes
HLI_RUMPF_NC_PROG
    body of an error of an NC program
log_pfad_nr | | who reports | 0
prog_name | | who reports | name of the program
file_name | | who reports | name of the file
fileoffset | | who reports | place of the block in the file; -1: not known
satzoffset | | who reports | 0
tokenoffset | | who reports | column of the word
satz_nr | | who reports | N of the block
HLI_CONTOUR_LOOKAHEAD
    the contour look-ahead unit
request | | PLC | what is wanted
semaphor_rw | | | the PLC sets it behind the request, the CNC clears it behind the answer
response | | CNC | the answer
state | | CNC | what there is, every cycle, under the seqlock
HLI_CONTOUR_LOOKAHEAD_REQUEST
    a request
start_position | 0.1 um | PLC | where the contour wanted begins; for marked
    blocks their index
length | 0.1 um | PLC | length of contour wanted; for marked blocks 0
HLI_CONTOUR_LOOKAHEAD_RESPONSE
    the answer: ends with the first block_type 0
block | | CNC | the elements
HLI_CONTOUR_LOOKAHEAD_BLOCK
    one element
block_type | | CNC | `HLI_CLAH_*`: 0 none, 1 line, 2 arc, 3 log on, 4 param, 5
    log off, 6 polynomial
block_number | | CNC | N of the block
block_count_r | | | counted block
circle_turns | | CNC | whole turns of a helix beyond circle_angle; not in the manual
rt_loop_pass | | CNC | `HLI_CLAH_PASS_*`: 0 not in a real-time loop, 1 entering
    pass, 2 loop to loop, 3 last pass; not in the manual
start_position | 0.1 um | CNC | distance from program start
length | 0.1 um | CNC | length of the element
programmed_radius | 0.1 um | CNC | radius as programmed
compensated_radius | 0.1 um | CNC | radius on the driven path
circle_angle | rad | CNC | swept angle, clockwise in [-2 pi, 0), else in (0, 2 pi]
length_min | 0.1 um | CNC | length on the scaled contour (FCT_EXTENSION_EQUIDIST)
tangent_variation | rad | CNC | turn of the tangent at the start of the element
HLI_CONTOUR_LOOKAHEAD_STATE
    what the CNC has
max_dist_prog_start | 0.1 um | CNC | how far the contour is known
count_logged_blocks | | CNC | marked blocks
f_log_is_active | | CNC | TRUE: blocks are being marked
HLI_AXIS
    `gpAx[i]`
head | | both | identity
ipo_mc_control | | both | control units of the interpolation
lr_mc_control | | both | releases
lr_state | | CNC | status
used_units_std_sync_r | | | technology units in use
used_units_late_sync_r | | | 0
techno_unit_std_sync | | both | spindle functions
techno_unit_late_sync | | both | 0
ipo_state | | CNC | identity, again
HLI_HB_MC_CONTROL
    units of the manual mode; commands are taken, counted as bad and not done
activation | | both | not supported: commands are refused
tip_parameter | | both | not supported: commands are refused
jog_parameter | | both | not supported: commands are refused
hr_parameter | | both | not supported: commands are refused
rapid_key | | both | not supported: commands are refused
key | | both | not supported: commands are refused
handwheel_incs | increments | both | not supported: not evaluated
MC_CONTROL_HB_ACTIVATION_UNIT MC_CONTROL_HB_TIP_PARAM_UNIT
MC_CONTROL_HB_JOG_PARAM_UNIT MC_CONTROL_HB_HR_PARAM_UNIT
MC_CONTROL_HB_RAPID_KEY_UNIT MC_CONTROL_HB_KEY_UNIT
    unit with usage check of the manual mode
request_r | | | 0
enable_w | | | TRUE: the CNC looks at the semaphore
command_w | | | not evaluated
request_semaphor_rw | | | 0
command_semaphor_rw | | | the PLC sets it behind the data; the CNC clears it
HLI_HB_ACTIVATION
    a control element for an axis
log_achs_nr | | as its holder | logical axis number
control_element | | as its holder | logical number of a button pair or handwheel
operation_mode | | as its holder | 0 none, 1 handwheel, 2 continuous jog, 3 incremental jog
param_index | | as its holder | parameter set, 0 to 2 (reconstructed name)
HLI_HB_TIP_PARAMETER
    continuous jog
log_achs_nr | | as its holder | logical axis number
speed | 1 um/s | as its holder | path velocity
HLI_HB_JOG_PARAMETER
    incremental jog
log_achs_nr | | as its holder | logical axis number
distance | 0.1 um | as its holder | way of one press
speed | 1 um/s | as its holder | path velocity
HLI_HB_HR_PARAMETER
    handwheel
log_achs_nr | | as its holder | logical axis number
resolution | 0.1 um | as its holder | way of one revolution
HLI_HB_RAPID_KEY
    rapid traverse of a button
log_key_nr | | as its holder | logical button number
key_pressed | | as its holder | TRUE: rapid
HLI_HB_KEY
    press of a button
log_key_nr | | as its holder | logical button number
direction | | as its holder | -1, 0 or 1: begins negative, ends, begins positive
life_time | cycles | as its holder | the press ends by itself then; 0: it does not
f_refresh | | as its holder | TRUE: the time begins again (reconstructed name)
HLI_IPO_MC_CONTROL
    control units of an axis
feedhold | | both | holds the path while this axis moves
override | 0.1 % | both | shown; acts on independent axes only
override_valid | | both | TRUE: the override counts
dyn_pos_limit_low | 0.1 um | both | not supported: no limit, `state_r` stays 0
dyn_pos_limit_high | 0.1 um | both | not supported: no limit, `state_r` stays 0
HLI_ADD_CMD_VALUE
    values that a PLC adds to those of the interpolator
m_add_pos_value | 0.1 um | as its holder | not evaluated
m_add_speed_value | 1 um/s | as its holder | not evaluated
sgn32_free_1 | | as its holder | not evaluated
sgn32_free_2 | | as its holder | not evaluated
sgn32_free_3 | | as its holder | not evaluated
sgn32_free_4 | | as its holder | not evaluated
sgn32_free_5 | | as its holder | not evaluated
sgn32_free_6 | | as its holder | not evaluated
MC_CONTROL_ADD_CMD_VALUE_UNIT
    added values; not supported
request_r | | | 0
enable_w | | | not evaluated
command_w | | | not evaluated
state_r | | | 0
HLI_LR_MC_CONTROL
    releases of an axis
release_feedhold | | both | TRUE or not enabled, or the path stands
drive_on | | both | TRUE or not enabled, or the path stands
torque_permission | | both | TRUE or not enabled, or the path stands
add_cmd_values | | both | not supported: nothing is added
HLI_LR_STATE
    status of an axis
end_position_acs_r | 0.1 um | | position at the end of the block
active_position_acs_r | 0.1 um | | present position
current_position_acs_r | 0.1 um | | present position
position_offset_r | 0.1 um | | 0
axis_state_r | | | 3 while the path moves, else 1
cmd_rev_r | 0.001 deg/s | | spindle: speed of the last function that is output
active_rev_r | 0.001 deg/s | | spindle: speed now, negative for M4
current_rev_r | 0.001 deg/s | | spindle: speed now
HLI_IPO_STATE
    identity of an axis
log_achs_nr_r | | | logical axis number
type_r | | | 1 linear, 2 rotary, 4 spindle
spindle_axis_r | | | TRUE: a spindle
HLI_EXT_VAR
    an area of external variables
value | | both | 24-byte blocks, six words each
HLI_SIDECAR
    not public; one writer and one cache line each
cnc | | CNC | identity and clock of the CNC process
plc | | PLC | identity and life of the PLC process
cnc_turn | | CNC | low 32 bits of the completed cycles
plc_turn | | PLC | cycle up to which the CNC may run before the PLC scans again
clah_bell | | PLC | counts requests; wakes the service thread
clah_answer | | CNC | counts answers; wakes a waiting PLC
channel_seq | | CNC | generation of the seqlock; odd while the CNC writes
stats | | CNC | counters
techno | | both | functions that a PLC before this one has fetched
planner | | CNC | of each channel: what its planner takes
HLI_SIDE_PLANNER
    CPU time of a planner for each ms of motion, over all commits
p50 | us | CNC | of half of them at most
p99 | us | CNC | of 99 in 100 at most
most | us | CNC | of any
HLI_SIDE_CNC
    identity and clock of the CNC process
pid | | CNC | process
start | ticks | CNC | start time since boot
cycle | | CNC | completed cycles
cell_time_ns | ns | CNC | the cell's clock
cycle_ns | ns | CNC | cycle time
clock | | CNC | `HLI_CLOCK_*`
service | | CNC | `HLI_SERVICE_*`
generation | | CNC | changes with every start
phase | | CNC | `HLI_PHASE_*`
HLI_SIDE_PLC
    identity and life of the PLC process
pid | | PLC | process
start | ticks | PLC | start time since boot
heartbeat | | PLC | scans done
generation | | PLC | grows with every attachment
attached | | PLC | 1: attached
finished | | PLC | 1: the cell may end
scans_due | | PLC | scans that are due
scans | | PLC | scans done
HLI_SIDE_WORD
    one futex word, alone on its cache line
word | | as its holder | the word
waiters | | both | processes that sleep on it
core | | as its holder | processor that the last one to ring was on, from 1; 0: unknown
HLI_SIDE_STATS
    counters of the CNC
requests_mode1 | | CNC | requests for marked blocks
requests_mode2 | | CNC | requests for the coming contour
requests_bad | | CNC | requests that are not usable
overruns | cycles | CNC | intervals missed entirely
bad_commands | | CNC | commands that are not usable
techno_busy | | CNC | 1 while a technology function is put out
planner_late | | CNC | times the path braked or stood because no motion was planned in time
planner_late_cycles | cycles | CNC | cycles of the path that this took
HLI_SIDE_TECHNO
    functions that a PLC before this one has fetched: its lines, then the CNC's
shown | | PLC | of each channel, units that showed a function when it attached: 20, 20 late
axis_shown | | PLC | of each axis, the same of its 8 units
again | | CNC | of each channel, units whose function is offered again, bits as `shown`
axis_again | | CNC | of each axis, the same, bits as `axis_shown`
"""

MEMBERS = _MEMBERS + AHEAD
