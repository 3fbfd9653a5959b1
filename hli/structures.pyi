"""The structures of the HLI: ``python docs/generate.py --write`` makes this file."""

from typing import Any

import numpy as np

from .view import ArrayView, View, ViewArray

class MC_CONTROL_BOOL_UNIT(View):
    """Level unit: the command counts while ``enable_w`` is TRUE."""

    request_r: bool
    """0: there is no graphical interface; written by: CNC."""
    enable_w: bool
    """TRUE: the PLC's command counts; written by: PLC."""
    command_w: bool
    """What the PLC wants; written by: PLC."""
    state_r: bool
    """What is in use; written by: CNC."""

class MC_CONTROL_UNS16_UNIT(View):
    """Level unit: the command counts while ``enable_w`` is TRUE."""

    request_r: int
    """0: there is no graphical interface; written by: CNC."""
    enable_w: bool
    """TRUE: the PLC's command counts; written by: PLC."""
    command_w: int
    """What the PLC wants; written by: PLC."""
    state_r: int
    """What is in use; written by: CNC."""

class MC_CONTROL_SGN32_UNIT(View):
    """Level unit: the command counts while ``enable_w`` is TRUE."""

    request_r: int
    """0: there is no graphical interface; written by: CNC."""
    enable_w: bool
    """TRUE: the PLC's command counts; written by: PLC."""
    command_w: int
    """What the PLC wants; written by: PLC."""
    state_r: int
    """What is in use; written by: CNC."""

class MC_CONTROL_UNS32_UNIT(View):
    """Level unit: the command counts while ``enable_w`` is TRUE."""

    request_r: int
    """0: there is no graphical interface; written by: CNC."""
    enable_w: bool
    """TRUE: the PLC's command counts; written by: PLC."""
    command_w: int
    """What the PLC wants; written by: PLC."""
    state_r: int
    """What is in use; written by: CNC."""

class MC_CONTROL_LREAL_UNIT(View):
    """Level unit: the command counts while ``enable_w`` is TRUE."""

    request_r: float
    """0: there is no graphical interface; written by: CNC."""
    enable_w: bool
    """TRUE: the PLC's command counts; written by: PLC."""
    command_w: float
    """What the PLC wants; written by: PLC."""
    state_r: float
    """What is in use; written by: CNC."""

class MC_WATCHDOG_UNIT(View):
    """Watchdog."""

    enable_w: bool
    """TRUE: the watchdog is watched; written by: PLC."""
    alive_rw: bool
    """The watched side sets it, the other one clears it; written by: both."""
    alive_state_r: bool
    """TRUE: alive; it falls for good; written by: CNC."""
    cycle_time_w: int
    """Longest time between two signs of life; 0: 1 s; unit: us; written by:
    PLC.
    """

class HLI_PROC_TRANS_TO_MODE_STATE(View):
    """A transition."""

    from_mode: int
    """Mode it begins in; a wrong one is counted; written by: PLC."""
    from_state: int
    """State it begins in; a wrong one is counted; written by: PLC."""
    to_mode: int
    """1 standby, 2 automatic, 3 MDI, 4 manual, 5 reference; written by: PLC."""
    to_state: int
    """See Operation modes; written by: PLC."""
    channel: int
    """Number of the channel; written by: PLC."""
    parameter: str
    """Name of the program, or the text of MDI; written by: PLC."""

class HLI_IMCM_MODE_STATE(View):
    """Mode and state."""

    mode: int
    """``HLI_IMCM_*_MODE``; written by: CNC."""
    state: int
    """``HLI_IMCM_PROCESS_*``; 7 to 15 are transient; written by: CNC."""

class MC_CONTROL_MCM_MODE_STATE_UNIT(View):
    """Transitions of mode and state."""

    request_r: HLI_PROC_TRANS_TO_MODE_STATE
    """0; written by: CNC."""
    enable_w: bool
    """TRUE: the PLC's commands count; written by: PLC."""
    command_w: HLI_PROC_TRANS_TO_MODE_STATE
    """The transition wanted; written by: PLC."""
    request_semaphor_rw: bool
    """0; written by: both."""
    command_semaphor_rw: bool
    """The PLC sets it behind the data, the CNC clears it; written by: both."""
    state_r: HLI_IMCM_MODE_STATE
    """Mode and state; written by: CNC."""

class HLI_INSERT_CMD_COMMAND(View):
    """A stop to be inserted."""

    dist_or_pos: float
    """Distance or position of the stop; unit: 0.1 um; written by: PLC."""
    rel_abs_mode: int
    """1 from program start, 2 once from here, 0 again and again; written by:
    PLC.
    """
    axis_nr: int
    """Logical number of an axis, for a position; written by: PLC."""
    m_function_nr: int
    """0 M00, 1 M01, else that M function; written by: PLC."""
    add_nr: int
    """Value that the function carries; written by: PLC."""

class HLI_INSERT_CMD_STATE(View):
    """The next inserted stop."""

    distance_of_next_stop: float
    """Distance; -1: none in sight; unit: 0.1 um; written by: CNC."""
    position_at_next_stop: ArrayView[int]
    """Position of each axis there; unit: 0.1 um; written by: CNC."""

class MC_CONTROL_INSERT_CMD_UNIT(View):
    """Inserted stops."""

    enable_w: bool
    """TRUE: the unit is used; written by: PLC."""
    command_semaphor_rw: bool
    """The PLC sets it behind the data, the CNC clears it; written by: both."""
    command_w: HLI_INSERT_CMD_COMMAND
    """The stop; written by: PLC."""
    state_r: HLI_INSERT_CMD_STATE
    """The next stop; written by: CNC."""
    semaphor_rw: bool
    """Alias of ``command_semaphor_rw``."""

class HLI_INTF_VERSION(View):
    """The text of a version or a name."""

    zeichen: str
    """Characters; written by: as its holder."""

class HLI_HEAD_CHANNEL(View):
    """Head of a channel."""

    version_w: HLI_INTF_VERSION
    """Not evaluated; written by: PLC."""
    version_r: HLI_INTF_VERSION
    """Version of the interface; written by: CNC."""
    sizeof_interface_r: int
    """Size of the channel's area; unit: bytes; written by: CNC."""
    channel_nr: int
    """Number of the channel, from 1; written by: CNC."""
    channel_type_r: int
    """0; written by: CNC."""
    plc_present_w: bool
    """TRUE: the PLC works on this channel; without it its units are dead;
    written by: PLC.
    """
    init_done_r: bool
    """TRUE: the area is ready; written by: CNC."""
    mc_watchdog: MC_WATCHDOG_UNIT
    """The PLC shows that it lives; written by: both."""
    lc_watchdog: MC_WATCHDOG_UNIT
    """The CNC shows that it lives; written by: both."""

class HLI_HEAD_AXIS(View):
    """Head of an axis."""

    plc_present_w: bool
    """TRUE: the PLC works on this axis; written by: PLC."""
    error_r: bool
    """0; written by: CNC."""
    reset_error_locked_r: bool
    """0; written by: CNC."""
    log_ax_n_r: int
    """Logical axis number; written by: CNC."""
    axis_type_r: int
    """1 linear, 2 rotary, 4 spindle; written by: CNC."""
    sizeof_interface_r: int
    """Size of the axis's area; unit: bytes; written by: CNC."""

class HLI_DECODER_MC_CONTROL(View):
    """Control units of the decoder."""

    program_block_ignore: MC_CONTROL_UNS32_UNIT
    """Skip levels: bit n - 1 is level n; taken over at program start;
    written by: both.
    """
    single_block: MC_CONTROL_BOOL_UNIT
    """Not supported, as in the kernel; written by: both."""
    execution_mode: MC_CONTROL_SGN32_UNIT
    """0x2000: no M, H, T output; other values are refused (905021); written
    by: both.
    """

class HLI_BAHN_MC_CONTROL(View):
    """Control units of the path."""

    feedhold: MC_CONTROL_BOOL_UNIT
    """Brakes and stands on the path; written by: both."""
    override: MC_CONTROL_UNS16_UNIT
    """Of the feed, 0 to 2000; unit: 0.1 %; written by: both."""
    override_valid: MC_CONTROL_BOOL_UNIT
    """TRUE: the override counts; written by: both."""
    rapid_override: MC_CONTROL_UNS16_UNIT
    """Of rapid, by P-CHAN-00181; unit: 0.1 %; written by: both."""
    rapid_override_valid: MC_CONTROL_BOOL_UNIT
    """TRUE: the rapid override counts; written by: both."""
    single_block: MC_CONTROL_BOOL_UNIT
    """Stands ahead of each block with motion; written by: both."""
    continue_machining: MC_CONTROL_BOOL_UNIT
    """Its rising edge leaves M00, M01, single block and inserted stops;
    written by: both.
    """
    m01_stop_enable: MC_CONTROL_BOOL_UNIT
    """M01 stops; written by: both."""
    delete_distance_to_go: MC_CONTROL_BOOL_UNIT
    """Its rising edge leaves out the rest of the block; written by: both."""
    del_dist_to_go_end: MC_CONTROL_UNS32_UNIT
    """Mask of ``#DEL DIST2GO`` marks where the line may end; written by:
    both.
    """
    backward_motion: MC_CONTROL_BOOL_UNIT
    """TRUE: backward on the path; written by: both."""
    simulate_motion: MC_CONTROL_BOOL_UNIT
    """Functions ahead are put out as MOS; written by: both."""
    backward_storage_off: MC_CONTROL_BOOL_UNIT
    """Clears the store; written by: both."""
    rt_loop_enable: MC_CONTROL_BOOL_UNIT
    """``V.RTG.LOOP.ENABLED``: the real-time loop is driven, and once more at
    its end; written by: both.
    """
    ext_command_speed: MC_CONTROL_SGN32_UNIT
    """Path speed instead of feed, rapid and override; negative: backward;
    unit: 1 um/s; written by: both.
    """
    ext_command_speed_valid: MC_CONTROL_BOOL_UNIT
    """TRUE: the external speed counts; written by: both."""
    insert_cmd: MC_CONTROL_INSERT_CMD_UNIT
    """Inserted stops; written by: both."""
    feed_hold: MC_CONTROL_BOOL_UNIT
    """Alias of ``feedhold``."""

class HLI_CHANNEL_MC_CONTROL(View):
    """Operation mode."""

    mode_and_state: MC_CONTROL_MCM_MODE_STATE_UNIT
    """Transitions of mode and state; written by: both."""

class HLI_DECODER_STATE(View):
    """Status of the decoder."""

    program_end_r: bool
    """TRUE: the program is read to its end; written by: CNC."""
    syntax_check_r: bool
    """0; written by: CNC."""
    wait_after_error_r: bool
    """TRUE: stands behind an error; written by: CNC."""

class HLI_HB_DISPLAY(View):
    """Status of the manual mode of an axis; there is no manual mode."""

    state: int
    """0: not active; written by: CNC."""
    operation_mode: int
    """0: none; written by: CNC."""
    control_element: int
    """0: none; written by: CNC."""
    hr_aufloesung: int
    """0: no handwheel; unit: increments; written by: CNC."""
    tipp_geschw: int
    """0: no continuous jog; unit: 1 um/s; written by: CNC."""
    jog_geschw: int
    """0: no incremental jog (reconstructed name); unit: 1 um/s; written by:
    CNC.
    """
    jog_weg: int
    """0: no incremental jog (reconstructed name); unit: 0.1 um; written by:
    CNC.
    """

class HLI_ACHS_NAME(View):
    """The text of a version or a name."""

    zeichen: str
    """Characters; written by: as its holder."""

class HLI_COORD(View):
    """Status of one axis of the channel."""

    log_axis_nr_r: int
    """Logical axis number; written by: CNC."""
    axis_type_r: int
    """1 linear, 2 rotary; written by: CNC."""
    state_r: int
    """3 while the path moves, else 1; written by: CNC."""
    name: str
    """Name of the axis; written by: CNC."""
    cmd_position_r: int
    """Position at the end of the block; unit: 0.1 um; written by: CNC."""
    act_position_r: int
    """Present position; unit: 0.1 um; written by: CNC."""
    current_position_r: int
    """Present position; unit: 0.1 um; written by: CNC."""
    acs_position_r: int
    """Present position of the axis itself; unit: 0.1 um; written by: CNC."""
    dist_to_geom_end_r: int
    """0; unit: 0.1 um; written by: CNC."""
    hb_display_r: HLI_HB_DISPLAY
    """Status of the manual mode; written by: CNC."""
    axis_name_r: HLI_ACHS_NAME
    """Name of the axis; written by: CNC."""
    log_achs_nr_r: int
    """Alias of ``log_axis_nr_r``."""

class HLI_BAHN_STATE(View):
    """Status of the path."""

    dist_prog_start: float
    """Distance from program start; unit: 0.1 um; written by: CNC."""
    dist_to_go_r: float
    """Distance to the end of the block; unit: 0.1 um; written by: CNC."""
    eta_time_r: float
    """Motion time to the next change from rapid to feed (FCT_CALC_TIME);
    unit: us; written by: CNC.
    """
    dist_v_0_r: float
    """Way to standstill if the feed were held now (FCT_CALC_POS_V_0); unit:
    0.1 um; written by: CNC.
    """
    esa_vb: ArrayView[float]
    """Path speed to come (FCT_CALC_STATE_AT_T); -1: not known; unit: 1 um/s;
    written by: CNC.
    """
    covered_distance_r: int
    """Share of the block that is driven; unit: 0.1 %; written by: CNC."""
    block_count_r: int
    """Counted block; written by: CNC."""
    block_number_r: int
    """N of the block; written by: CNC."""
    command_feed_r: int
    """Programmed feed; unit: 1 um/s; written by: CNC."""
    active_feed_r: int
    """Path speed; negative while it drives backward; unit: 1 um/s; written
    by: CNC.
    """
    stop_condition_r: int
    """Why the path stands, bit by bit; written by: CNC."""
    error_id_r: int
    """Number of the error; written by: CNC."""
    tool_nr_r: int
    """Tool; written by: CNC."""
    file_offset_r: int
    """-1: not known; written by: CNC."""
    override_r: int
    """Override in use; unit: 0.1 %; written by: CNC."""
    block_search_state_r: int
    """0; written by: CNC."""
    program_end_r: bool
    """TRUE: no program is processed, ahead of the first one too; written by:
    CNC.
    """
    interpolation_active_r: bool
    """TRUE: the path is driven; written by: CNC."""
    axes_in_position_r: bool
    """TRUE: the path stands; written by: CNC."""
    wait_axes_in_position_r: bool
    """0; written by: CNC."""
    wait_techno_acknowledge_r: bool
    """TRUE: waits for the PLC's acknowledgement; written by: CNC."""
    wait_continue_r: bool
    """TRUE: waits for continue_machining; written by: CNC."""
    wait_error_removal_r: bool
    """TRUE: waits for the removal of an error; written by: CNC."""
    dwell_time_active_r: bool
    """TRUE: dwells; written by: CNC."""
    speed_limit_detect_r: bool
    """0; written by: CNC."""
    block_search_active_r: bool
    """0; written by: CNC."""
    delete_distance_to_go_active_r: bool
    """TRUE: distance to go is being left out; written by: CNC."""
    feedhold_active_r: bool
    """TRUE: the path is held, by feed hold, an axis or the mode; written by:
    CNC.
    """
    rapid_active_r: bool
    """TRUE: rapid motion; written by: CNC."""
    backward_active_r: bool
    """TRUE: drives backward; written by: CNC."""
    error_r: bool
    """TRUE: an error stands; written by: CNC."""
    eta_valid_r: bool
    """TRUE: eta_time_r counts; written by: CNC."""
    pos_v_0_valid_r: bool
    """TRUE: dist_v_0_r and the positions count; written by: CNC."""
    esa_data_valid: ArrayView[bool]
    """TRUE: esa_vb counts; written by: CNC."""
    inside_rt_loop_r: bool
    """TRUE: inside a real-time loop; written by: CNC."""
    g_function_r: ArrayView[int]
    """0; written by: CNC."""
    prog_name_r: str
    """Name of the program; written by: CNC."""
    rt_loop_count_r: int
    """``V.RTG.LOOP.COUNT``: passes of the real-time loop that are over;
    written by: CNC.
    """
    coord_r: ViewArray[HLI_COORD]
    """Status by axis; written by: CNC."""
    pos_v_0_pcs_r: ArrayView[int]
    """Positions of standstill, programmed coordinates; unit: 0.1 um; written
    by: CNC.
    """
    pos_v_0_acs_r: ArrayView[int]
    """Positions of standstill, axes; unit: 0.1 um; written by: CNC."""
    dist_prog_start_high: float
    """Alias of ``dist_prog_start``."""
    stop_conditions_r: int
    """Alias of ``stop_condition_r``."""

class HLI_ATTRIBUT(View):
    """Data of a function; the kind says which structure lies over it."""

    data: ArrayView[int]
    """Bytes of HLI_M_H_PROZESS, HLI_S_PROZESS or HLI_T_PROZESS; written by:
    CNC.
    """

class TECHNO_UNIT_CH(View):
    """An M, H or T function of the channel, or a spindle function."""

    please_rw: bool
    """The CNC sets it behind the data; the PLC clears it once it has fetched
    them; written by: both.
    """
    done_w: bool
    """The PLC sets it: the function is acknowledged; written by: PLC."""
    fkt_ctrl_r: int
    """Kind: 1 M, 2 H, 3 S, 4 T; written by: CNC."""
    attribut_r: HLI_ATTRIBUT
    """Its data; written by: CNC."""

class TECHNO_UNIT_AX(View):
    """An M, H or T function of the channel, or a spindle function."""

    please_rw: bool
    """The CNC sets it behind the data; the PLC clears it once it has fetched
    them; written by: both.
    """
    done_w: bool
    """The PLC sets it: the function is acknowledged; written by: PLC."""
    fkt_ctrl_r: int
    """Kind: 1 M, 2 H, 3 S, 4 T; written by: CNC."""
    attribut_r: HLI_ATTRIBUT
    """Its data; written by: CNC."""

class HLI_M_H_PROZESS(View):
    """Data of an M or H function."""

    nr: int
    """Number; written by: CNC."""
    zeit: int
    """0: no supervision of time; unit: us; written by: CNC."""
    satz_nr: int
    """N of the block; written by: CNC."""
    zeilen_nr: int
    """Counted block; written by: CNC."""
    add_value: int
    """Value of ``M52=-345``; written by: CNC."""
    nr_late_sync: int
    """Unit of the late synchronisation; written by: CNC."""
    synch_mode: int
    """Synchronisation type; written by: CNC."""

class HLI_S_PROZESS(View):
    """Data of a spindle function."""

    pos: int
    """Position; unit: 0.0001 degrees; written by: CNC."""
    rev: int
    """Speed; unit: 0.001 degrees/s; written by: CNC."""
    zeit: int
    """0: no supervision of time; unit: us; written by: CNC."""
    move_cmd: int
    """3, 4 or 5: M function; 0 for M19; written by: CNC."""
    pos_cmd: int
    """19 for M19, else 0; written by: CNC."""
    axis_nr: int
    """Logical axis number; written by: CNC."""
    nr_late_sync: int
    """Unit of the late synchronisation; written by: CNC."""
    synch_mode: int
    """Synchronisation type; written by: CNC."""
    satz_nr: int
    """N of the block; written by: CNC."""
    zeilen_nr: int
    """Counted block; written by: CNC."""

class HLI_TOOL_ID(View):
    """Name of a tool."""

    basic: int
    """Number; written by: CNC."""
    sister: int
    """Number of the sister tool; written by: CNC."""
    variant: int
    """Number of the variant; written by: CNC."""
    sister_valid: bool
    """TRUE: sister counts; written by: CNC."""
    variant_valid: bool
    """TRUE: variant counts; written by: CNC."""

class HLI_T_PROZESS(View):
    """Data of a T function."""

    id: HLI_TOOL_ID
    """The tool; written by: CNC."""
    add_info_r: ArrayView[int]
    """0; written by: CNC."""
    nr_late_sync: int
    """Unit of the late synchronisation; written by: CNC."""
    synch_mode: int
    """Synchronisation type; written by: CNC."""

class HLI_MODUL_NAME(View):
    """Name of a module."""

    zeichen: str
    """Characters; written by: who reports."""

class HLI_ERROR_KOPF(View):
    """Head of an error record."""

    error_id: int
    """Number; written by: who reports."""
    modul_name: HLI_MODUL_NAME
    """Module that reports; ``HLICOSIM`` from the CNC; written by: who
    reports.
    """
    line: int
    """Line of the program; written by: who reports."""
    util_error_id: int
    """0; written by: who reports."""
    util_modul_name: HLI_MODUL_NAME
    """0; written by: who reports."""
    util_line: int
    """0; written by: who reports."""
    multiple_id: int
    """0; written by: who reports."""
    function_type: int
    """0; written by: who reports."""
    channel: int
    """Number of the channel; written by: who reports."""
    sender: int
    """0; written by: who reports."""
    suppress: int
    """0; written by: who reports."""
    date: int
    """0; written by: who reports."""
    cycle: int
    """Cycle of the report; written by: who reports."""
    version: HLI_INTF_VERSION
    """0; written by: who reports."""
    recovery_class: int
    """What removes the error; written by: who reports."""
    reaction_class: int
    """What the CNC does; written by: who reports."""
    body_type: int
    """1: the body is HLI_RUMPF_NC_PROG; written by: who reports."""

class HLI_ERROR_MASKE(View):
    """Room of the body."""

    err_mask: ArrayView[int]
    """Bytes; written by: who reports."""

class HLI_ERROR_RUMPF(View):
    """Body of an error record."""

    maske: HLI_ERROR_MASKE
    """Bytes of HLI_RUMPF_NC_PROG for errors of NC programs; written by: who
    reports.
    """
    value: ArrayView[ArrayView[int]]
    """0; written by: who reports."""
    identifier: ArrayView[ArrayView[int]]
    """0; written by: who reports."""

class HLI_RUMPF_NC_PROG(View):
    """Body of an error of an NC program."""

    log_pfad_nr: int
    """0; written by: who reports."""
    prog_name: str
    """Name of the program; written by: who reports."""
    file_name: str
    """Name of the file; written by: who reports."""
    fileoffset: int
    """Place of the block in the file; -1: not known; written by: who
    reports.
    """
    satzoffset: int
    """0; written by: who reports."""
    tokenoffset: int
    """Column of the word; written by: who reports."""
    satz_nr: int
    """N of the block; written by: who reports."""

class HLI_ERROR_SATZ(View):
    """An error record."""

    kopf: HLI_ERROR_KOPF
    """Head; written by: who reports."""
    rumpf: HLI_ERROR_RUMPF
    """Body; written by: who reports."""

class MC_ERROR(View):
    """An error record."""

    satz_r: HLI_ERROR_SATZ
    """The record; written by: who reports."""
    semaphor_rw: bool
    """The writer sets it behind the record, the reader clears it; written
    by: both.
    """
    enable_w: bool
    """TRUE: the next record waits until this one is cleared; written by:
    PLC.
    """

class HLI_CONTOUR_LOOKAHEAD_BLOCK(View):
    """One element."""

    block_type: int
    """``HLI_CLAH_*``: 0 none, 1 line, 2 arc, 3 log on, 4 param, 5 log off, 6
    polynomial; written by: CNC.
    """
    block_number: int
    """N of the block; written by: CNC."""
    block_count_r: int
    """Counted block; written by: CNC."""
    circle_turns: int
    """Whole turns of a helix beyond circle_angle; not in the manual; written
    by: CNC.
    """
    rt_loop_pass: int
    """``HLI_CLAH_PASS_*``: 0 not in a real-time loop, 1 entering pass, 2
    loop to loop, 3 last pass; not in the manual; written by: CNC.
    """
    start_position: float
    """Distance from program start; unit: 0.1 um; written by: CNC."""
    length: float
    """Length of the element; unit: 0.1 um; written by: CNC."""
    programmed_radius: float
    """Radius as programmed; unit: 0.1 um; written by: CNC."""
    compensated_radius: float
    """Radius on the driven path; unit: 0.1 um; written by: CNC."""
    circle_angle: float
    """Swept angle, clockwise in [-2 pi, 0), else in (0, 2 pi]; unit: rad;
    written by: CNC.
    """
    length_min: float
    """Length on the scaled contour (FCT_EXTENSION_EQUIDIST); unit: 0.1 um;
    written by: CNC.
    """
    tangent_variation: float
    """Turn of the tangent at the start of the element; unit: rad; written
    by: CNC.
    """

class HLI_CONTOUR_LOOKAHEAD_REQUEST(View):
    """A request."""

    start_position: float
    """Where the contour wanted begins; for marked blocks their index; unit:
    0.1 um; written by: PLC.
    """
    length: float
    """Length of contour wanted; for marked blocks 0; unit: 0.1 um; written
    by: PLC.
    """

class HLI_CONTOUR_LOOKAHEAD_RESPONSE(View):
    """The answer: ends with the first block_type 0."""

    block: ViewArray[HLI_CONTOUR_LOOKAHEAD_BLOCK]
    """The elements; written by: CNC."""
    def as_array(self) -> np.ndarray[Any, Any]: ...

class HLI_CONTOUR_LOOKAHEAD_STATE(View):
    """What the CNC has."""

    max_dist_prog_start: float
    """How far the contour is known; unit: 0.1 um; written by: CNC."""
    count_logged_blocks: int
    """Marked blocks; written by: CNC."""
    f_log_is_active: bool
    """TRUE: blocks are being marked; written by: CNC."""

class HLI_CONTOUR_LOOKAHEAD(View):
    """The contour look-ahead unit."""

    request: HLI_CONTOUR_LOOKAHEAD_REQUEST
    """What is wanted; written by: PLC."""
    semaphor_rw: bool
    """The PLC sets it behind the request, the CNC clears it behind the
    answer; written by: both.
    """
    response: HLI_CONTOUR_LOOKAHEAD_RESPONSE
    """The answer; written by: CNC."""
    state: HLI_CONTOUR_LOOKAHEAD_STATE
    """What there is, every cycle, under the seqlock; written by: CNC."""

class HLI_HB_ACTIVATION(View):
    """A control element for an axis."""

    log_achs_nr: int
    """Logical axis number; written by: as its holder."""
    control_element: int
    """Logical number of a button pair or handwheel; written by: as its
    holder.
    """
    operation_mode: int
    """0 none, 1 handwheel, 2 continuous jog, 3 incremental jog; written by:
    as its holder.
    """
    param_index: int
    """Parameter set, 0 to 2 (reconstructed name); written by: as its holder."""

class HLI_HB_TIP_PARAMETER(View):
    """Continuous jog."""

    log_achs_nr: int
    """Logical axis number; written by: as its holder."""
    speed: int
    """Path velocity; unit: 1 um/s; written by: as its holder."""

class HLI_HB_JOG_PARAMETER(View):
    """Incremental jog."""

    log_achs_nr: int
    """Logical axis number; written by: as its holder."""
    distance: int
    """Way of one press; unit: 0.1 um; written by: as its holder."""
    speed: int
    """Path velocity; unit: 1 um/s; written by: as its holder."""

class HLI_HB_HR_PARAMETER(View):
    """Handwheel."""

    log_achs_nr: int
    """Logical axis number; written by: as its holder."""
    resolution: int
    """Way of one revolution; unit: 0.1 um; written by: as its holder."""

class HLI_HB_RAPID_KEY(View):
    """Rapid traverse of a button."""

    log_key_nr: int
    """Logical button number; written by: as its holder."""
    key_pressed: int
    """TRUE: rapid; written by: as its holder."""

class HLI_HB_KEY(View):
    """Press of a button."""

    log_key_nr: int
    """Logical button number; written by: as its holder."""
    direction: int
    """-1, 0 or 1: begins negative, ends, begins positive; written by: as its
    holder.
    """
    life_time: int
    """The press ends by itself then; 0: it does not; unit: cycles; written
    by: as its holder.
    """
    f_refresh: bool
    """TRUE: the time begins again (reconstructed name); written by: as its
    holder.
    """

class MC_CONTROL_HB_ACTIVATION_UNIT(View):
    """Unit with usage check of the manual mode."""

    request_r: HLI_HB_ACTIVATION
    """0; written by: CNC."""
    enable_w: bool
    """TRUE: the CNC looks at the semaphore; written by: PLC."""
    command_w: HLI_HB_ACTIVATION
    """Not evaluated; written by: PLC."""
    request_semaphor_rw: bool
    """0; written by: both."""
    command_semaphor_rw: bool
    """The PLC sets it behind the data; the CNC clears it; written by: both."""

class MC_CONTROL_HB_TIP_PARAM_UNIT(View):
    """Unit with usage check of the manual mode."""

    request_r: HLI_HB_TIP_PARAMETER
    """0; written by: CNC."""
    enable_w: bool
    """TRUE: the CNC looks at the semaphore; written by: PLC."""
    command_w: HLI_HB_TIP_PARAMETER
    """Not evaluated; written by: PLC."""
    request_semaphor_rw: bool
    """0; written by: both."""
    command_semaphor_rw: bool
    """The PLC sets it behind the data; the CNC clears it; written by: both."""

class MC_CONTROL_HB_JOG_PARAM_UNIT(View):
    """Unit with usage check of the manual mode."""

    request_r: HLI_HB_JOG_PARAMETER
    """0; written by: CNC."""
    enable_w: bool
    """TRUE: the CNC looks at the semaphore; written by: PLC."""
    command_w: HLI_HB_JOG_PARAMETER
    """Not evaluated; written by: PLC."""
    request_semaphor_rw: bool
    """0; written by: both."""
    command_semaphor_rw: bool
    """The PLC sets it behind the data; the CNC clears it; written by: both."""

class MC_CONTROL_HB_HR_PARAM_UNIT(View):
    """Unit with usage check of the manual mode."""

    request_r: HLI_HB_HR_PARAMETER
    """0; written by: CNC."""
    enable_w: bool
    """TRUE: the CNC looks at the semaphore; written by: PLC."""
    command_w: HLI_HB_HR_PARAMETER
    """Not evaluated; written by: PLC."""
    request_semaphor_rw: bool
    """0; written by: both."""
    command_semaphor_rw: bool
    """The PLC sets it behind the data; the CNC clears it; written by: both."""

class MC_CONTROL_HB_RAPID_KEY_UNIT(View):
    """Unit with usage check of the manual mode."""

    request_r: HLI_HB_RAPID_KEY
    """0; written by: CNC."""
    enable_w: bool
    """TRUE: the CNC looks at the semaphore; written by: PLC."""
    command_w: HLI_HB_RAPID_KEY
    """Not evaluated; written by: PLC."""
    request_semaphor_rw: bool
    """0; written by: both."""
    command_semaphor_rw: bool
    """The PLC sets it behind the data; the CNC clears it; written by: both."""

class MC_CONTROL_HB_KEY_UNIT(View):
    """Unit with usage check of the manual mode."""

    request_r: HLI_HB_KEY
    """0; written by: CNC."""
    enable_w: bool
    """TRUE: the CNC looks at the semaphore; written by: PLC."""
    command_w: HLI_HB_KEY
    """Not evaluated; written by: PLC."""
    request_semaphor_rw: bool
    """0; written by: both."""
    command_semaphor_rw: bool
    """The PLC sets it behind the data; the CNC clears it; written by: both."""

class HLI_HB_MC_CONTROL(View):
    """Units of the manual mode; commands are taken, counted as bad and not
    done.
    """

    activation: MC_CONTROL_HB_ACTIVATION_UNIT
    """Not supported: commands are refused; written by: both."""
    tip_parameter: MC_CONTROL_HB_TIP_PARAM_UNIT
    """Not supported: commands are refused; written by: both."""
    jog_parameter: MC_CONTROL_HB_JOG_PARAM_UNIT
    """Not supported: commands are refused; written by: both."""
    hr_parameter: MC_CONTROL_HB_HR_PARAM_UNIT
    """Not supported: commands are refused; written by: both."""
    rapid_key: MC_CONTROL_HB_RAPID_KEY_UNIT
    """Not supported: commands are refused; written by: both."""
    key: ViewArray[MC_CONTROL_HB_KEY_UNIT]
    """Not supported: commands are refused; written by: both."""
    handwheel_incs: ViewArray[MC_CONTROL_SGN32_UNIT]
    """Not supported: not evaluated; unit: increments; written by: both."""

class HLI_CHANNEL(View):
    """``gpCh[i]``."""

    head: HLI_HEAD_CHANNEL
    """Identity, watchdogs; written by: both."""
    decoder_mc_control: HLI_DECODER_MC_CONTROL
    """Control units of the decoder; written by: both."""
    bahn_mc_control: HLI_BAHN_MC_CONTROL
    """Control units of the path; written by: both."""
    channel_mc_control: HLI_CHANNEL_MC_CONTROL
    """Operation mode and state; written by: both."""
    decoder_state: HLI_DECODER_STATE
    """Status of the decoder; written by: CNC."""
    bahn_state: HLI_BAHN_STATE
    """Status of the path, every cycle, under the seqlock; written by: CNC."""
    used_units_std_sync_r: int
    """Technology units in use; written by: CNC."""
    used_units_late_sync_r: int
    """Late technology units in use; written by: CNC."""
    techno_unit_std_sync: ViewArray[TECHNO_UNIT_CH]
    """M, H, T functions; written by: both."""
    techno_unit_late_sync: ViewArray[TECHNO_UNIT_CH]
    """Functions of late synchronisation, with gaps; written by: both."""
    mc_error: MC_ERROR
    """Errors of the CNC; written by: both."""
    lc_error: MC_ERROR
    """Errors of the PLC; written by: both."""
    contour_lookahead: HLI_CONTOUR_LOOKAHEAD
    """The contour look-ahead unit; begins on a cache line; written by: both."""
    hb_mc_control: HLI_HB_MC_CONTROL
    """Units of the manual mode; there is none; written by: both."""

class HLI_IPO_MC_CONTROL(View):
    """Control units of an axis."""

    feedhold: MC_CONTROL_BOOL_UNIT
    """Holds the path while this axis moves; written by: both."""
    override: MC_CONTROL_UNS16_UNIT
    """Shown; acts on independent axes only; unit: 0.1 %; written by: both."""
    override_valid: MC_CONTROL_BOOL_UNIT
    """TRUE: the override counts; written by: both."""
    dyn_pos_limit_low: MC_CONTROL_SGN32_UNIT
    """Not supported: no limit, ``state_r`` stays 0; unit: 0.1 um; written
    by: both.
    """
    dyn_pos_limit_high: MC_CONTROL_SGN32_UNIT
    """Not supported: no limit, ``state_r`` stays 0; unit: 0.1 um; written
    by: both.
    """
    feed_hold: MC_CONTROL_BOOL_UNIT
    """Alias of ``feedhold``."""

class HLI_ADD_CMD_VALUE(View):
    """Values that a PLC adds to those of the interpolator."""

    m_add_pos_value: int
    """Not evaluated; unit: 0.1 um; written by: as its holder."""
    m_add_speed_value: int
    """Not evaluated; unit: 1 um/s; written by: as its holder."""
    sgn32_free_1: int
    """Not evaluated; written by: as its holder."""
    sgn32_free_2: int
    """Not evaluated; written by: as its holder."""
    sgn32_free_3: int
    """Not evaluated; written by: as its holder."""
    sgn32_free_4: int
    """Not evaluated; written by: as its holder."""
    sgn32_free_5: int
    """Not evaluated; written by: as its holder."""
    sgn32_free_6: int
    """Not evaluated; written by: as its holder."""

class MC_CONTROL_ADD_CMD_VALUE_UNIT(View):
    """Added values; not supported."""

    request_r: HLI_ADD_CMD_VALUE
    """0; written by: CNC."""
    enable_w: bool
    """Not evaluated; written by: PLC."""
    command_w: HLI_ADD_CMD_VALUE
    """Not evaluated; written by: PLC."""
    state_r: HLI_ADD_CMD_VALUE
    """0; written by: CNC."""

class HLI_LR_MC_CONTROL(View):
    """Releases of an axis."""

    release_feedhold: MC_CONTROL_BOOL_UNIT
    """TRUE or not enabled, or the path stands; written by: both."""
    drive_on: MC_CONTROL_BOOL_UNIT
    """TRUE or not enabled, or the path stands; written by: both."""
    torque_permission: MC_CONTROL_BOOL_UNIT
    """TRUE or not enabled, or the path stands; written by: both."""
    add_cmd_values: MC_CONTROL_ADD_CMD_VALUE_UNIT
    """Not supported: nothing is added; written by: both."""

class HLI_LR_STATE(View):
    """Status of an axis."""

    end_position_acs_r: int
    """Position at the end of the block; unit: 0.1 um; written by: CNC."""
    active_position_acs_r: int
    """Present position; unit: 0.1 um; written by: CNC."""
    current_position_acs_r: int
    """Present position; unit: 0.1 um; written by: CNC."""
    position_offset_r: int
    """0; unit: 0.1 um; written by: CNC."""
    axis_state_r: int
    """3 while the path moves, else 1; written by: CNC."""
    cmd_rev_r: int
    """Spindle: speed of the last function that is output; unit: 0.001 deg/s;
    written by: CNC.
    """
    active_rev_r: int
    """Spindle: speed now, negative for M4; unit: 0.001 deg/s; written by:
    CNC.
    """
    current_rev_r: int
    """Spindle: speed now; unit: 0.001 deg/s; written by: CNC."""

class HLI_IPO_STATE(View):
    """Identity of an axis."""

    log_achs_nr_r: int
    """Logical axis number; written by: CNC."""
    type_r: int
    """1 linear, 2 rotary, 4 spindle; written by: CNC."""
    spindle_axis_r: bool
    """TRUE: a spindle; written by: CNC."""

class HLI_AXIS(View):
    """``gpAx[i]``."""

    head: HLI_HEAD_AXIS
    """Identity; written by: both."""
    ipo_mc_control: HLI_IPO_MC_CONTROL
    """Control units of the interpolation; written by: both."""
    lr_mc_control: HLI_LR_MC_CONTROL
    """Releases; written by: both."""
    lr_state: HLI_LR_STATE
    """Status; written by: CNC."""
    used_units_std_sync_r: int
    """Technology units in use; written by: CNC."""
    used_units_late_sync_r: int
    """0; written by: CNC."""
    techno_unit_std_sync: ViewArray[TECHNO_UNIT_AX]
    """Spindle functions; written by: both."""
    techno_unit_late_sync: ViewArray[TECHNO_UNIT_AX]
    """0; written by: both."""
    ipo_state: HLI_IPO_STATE
    """Identity, again; written by: CNC."""

class HLI_NC_CONFIG(View):
    """Versions of both sides."""

    hli_version_w: HLI_INTF_VERSION
    """Not evaluated; written by: PLC."""
    hli_version_r: HLI_INTF_VERSION
    """Version of the interface; written by: CNC."""
    nc_kernel_version_r: HLI_INTF_VERSION
    """Version of the CNC; written by: CNC."""

class HLI_PLATFORM(View):
    """``gpPform``."""

    plc_present_w: bool
    """Not evaluated; written by: PLC."""
    nc_config: HLI_NC_CONFIG
    """Versions; written by: both."""
    channel_count_r: int
    """Configured channels; written by: CNC."""
    axis_count_r: int
    """Configured axes; written by: CNC."""
    customer_val_r: ArrayView[int]
    """0; written by: CNC."""

class HLI_EXT_VAR(View):
    """An area of external variables."""

    value: ArrayView[int]
    """24-byte blocks, six words each; written by: both."""
    def __getitem__(self, index: int) -> int: ...
    def __setitem__(self, index: int, value: int) -> None: ...

class HLI_SEGMENT_HEAD(View):
    """First bytes of the segment."""

    magic: int
    """The bytes ``HLICOSIM``; written by: CNC."""
    abi_version: int
    """1; written by: CNC."""
    channel_count: int
    """Configured channels (``gNrCh``); pointers behind them are NULL: an
    index raises ``HliNotConfigured``, iteration gives None; written by:
    CNC.
    """
    axis_count: int
    """Configured axes (``gNrAx``); written by: CNC."""
    ready: int
    """1: published; written last, with release order; written by: CNC."""
    segment_size: int
    """Size of the whole; unit: bytes; written by: CNC."""
    owner_pid: int
    """Process that created the segment; written by: CNC."""
    owner_start: int
    """Its start time since boot: a recycled process id has another one;
    unit: ticks; written by: CNC.
    """
    layout_hash: ArrayView[int]
    """SHA-256 of ``layout.describe()``; written by: CNC."""

class HLI_SIDE_CNC(View):
    """Identity and clock of the CNC process."""

    pid: int
    """Process; written by: CNC."""
    start: int
    """Start time since boot; unit: ticks; written by: CNC."""
    cycle: int
    """Completed cycles; written by: CNC."""
    cell_time_ns: int
    """The cell's clock; unit: ns; written by: CNC."""
    cycle_ns: int
    """Cycle time; unit: ns; written by: CNC."""
    clock: int
    """``HLI_CLOCK_*``; written by: CNC."""
    service: int
    """``HLI_SERVICE_*``; written by: CNC."""
    generation: int
    """Changes with every start; written by: CNC."""
    phase: int
    """``HLI_PHASE_*``; written by: CNC."""

class HLI_SIDE_PLC(View):
    """Identity and life of the PLC process."""

    pid: int
    """Process; written by: PLC."""
    start: int
    """Start time since boot; unit: ticks; written by: PLC."""
    heartbeat: int
    """Scans done; written by: PLC."""
    generation: int
    """Grows with every attachment; written by: PLC."""
    attached: int
    """1: attached; written by: PLC."""
    finished: int
    """1: the cell may end; written by: PLC."""
    scans_due: int
    """Scans that are due; written by: PLC."""
    scans: int
    """Scans done; written by: PLC."""

class HLI_SIDE_WORD(View):
    """One futex word, alone on its cache line."""

    word: int
    """The word; written by: as its holder."""
    waiters: int
    """Processes that sleep on it; written by: both."""
    core: int
    """Processor that the last one to ring was on, from 1; 0: unknown;
    written by: as its holder.
    """

class HLI_SIDE_STATS(View):
    """Counters of the CNC."""

    requests_mode1: int
    """Requests for marked blocks; written by: CNC."""
    requests_mode2: int
    """Requests for the coming contour; written by: CNC."""
    requests_bad: int
    """Requests that are not usable; written by: CNC."""
    overruns: int
    """Intervals missed entirely; unit: cycles; written by: CNC."""
    bad_commands: int
    """Commands that are not usable; written by: CNC."""
    planner_late_cycles: int
    """Cycles of the path that this took; unit: cycles; written by: CNC."""
    techno_busy: int
    """1 while a technology function is put out; written by: CNC."""
    planner_late: int
    """Times the path braked or stood because no motion was planned in time;
    written by: CNC.
    """

class HLI_SIDE_TECHNO(View):
    """Functions that a PLC before this one has fetched: its lines, then the
    CNC's.
    """

    shown: ArrayView[int]
    """Of each channel, units that showed a function when it attached: 20, 20
    late; written by: PLC.
    """
    axis_shown: ArrayView[int]
    """Of each axis, the same of its 8 units; written by: PLC."""
    again: ArrayView[int]
    """Of each channel, units whose function is offered again, bits as
    ``shown``; written by: CNC.
    """
    axis_again: ArrayView[int]
    """Of each axis, the same, bits as ``axis_shown``; written by: CNC."""

class HLI_SIDE_PLANNER(View):
    """CPU time of a planner for each ms of motion, over all commits."""

    p50: float
    """Of half of them at most; unit: us; written by: CNC."""
    p99: float
    """Of 99 in 100 at most; unit: us; written by: CNC."""
    most: float
    """Of any; unit: us; written by: CNC."""

class HLI_SIDECAR(View):
    """Not public; one writer and one cache line each."""

    cnc: HLI_SIDE_CNC
    """Identity and clock of the CNC process; written by: CNC."""
    plc: HLI_SIDE_PLC
    """Identity and life of the PLC process; written by: PLC."""
    cnc_turn: HLI_SIDE_WORD
    """Low 32 bits of the completed cycles; written by: CNC."""
    plc_turn: HLI_SIDE_WORD
    """Cycle up to which the CNC may run before the PLC scans again; written
    by: PLC.
    """
    clah_bell: HLI_SIDE_WORD
    """Counts requests; wakes the service thread; written by: PLC."""
    clah_answer: HLI_SIDE_WORD
    """Counts answers; wakes a waiting PLC; written by: CNC."""
    channel_seq: HLI_SIDE_WORD
    """Generation of the seqlock; odd while the CNC writes; written by: CNC."""
    stats: HLI_SIDE_STATS
    """Counters; written by: CNC."""
    techno: HLI_SIDE_TECHNO
    """Functions that a PLC before this one has fetched; written by: both."""
    planner: ViewArray[HLI_SIDE_PLANNER]
    """Of each channel: what its planner takes; written by: CNC."""

class HLI_AHEAD_REQUEST(View):
    """A request of the queue."""

    start_position: float
    """From where on; unit: index or 0.1 um; written by: PLC."""
    length: float
    """How far; 0 for the log; unit: 0.1 um; written by: PLC."""
    mode: int
    """``HLI_AHEAD_MODE_LOG`` or ``HLI_AHEAD_MODE_CONTOUR``; written by: PLC."""
    flags: int
    """Sum of ``HLI_AHEAD_BEYOND``, ``_EVENTS``, ``_DETAILS``; written by:
    PLC.
    """
    epoch: int
    """Epoch that start_position counts in; 0: the present one; written by:
    PLC.
    """
    tag: int
    """Any number; the answer bears it; written by: PLC."""

class HLI_AHEAD_ANSWER(View):
    """An answer beside its elements."""

    count: int
    """Elements that it holds; written by: CNC."""
    empty: int
    """Why it holds none: ``HLI_AHEAD_EMPTY_*``; written by: CNC."""
    end: int
    """What ends that which is known: ``HLI_AHEAD_END_*``; written by: CNC."""
    mode: int
    """1 marked log, 2 contour; written by: CNC."""
    epoch: int
    """The present epoch; written by: CNC."""
    tag: int
    """As in the request; written by: CNC."""
    more: bool
    """TRUE: there are more elements in the range than fit; written by: CNC."""
    start_position: float
    """As in the request; unit: index or 0.1 um; written by: CNC."""
    length: float
    """As in the request; unit: 0.1 um; written by: CNC."""
    dist_prog_start: float
    """Where the path was; unit: 0.1 um; written by: CNC."""
    dist_prog_start_high: float
    """Alias of ``dist_prog_start``."""

class HLI_AHEAD_DETAIL(View):
    """An element beside its block."""

    flags: int
    """Sum of ``HLI_AHEAD_RAPID`` and of ``HLI_AHEAD_HAS_*``: which members
    count; written by: CNC.
    """
    epoch: int
    """The epoch that the block's start_position counts in; written by: CNC."""
    code: int
    """M, H, T: number; written by: CNC."""
    value: float
    """Dwell s, S rev/min, additional value of M and H; written by: CNC."""
    way: float
    """From the present place to its start, over epochs; unit: 0.1 um;
    written by: CNC.
    """
    feed: float
    """As programmed; 0: rapid; unit: 1 um/s; written by: CNC."""
    driven_length: float
    """Of the driven path; differs under smoothing; unit: 0.1 um; written by:
    CNC.
    """
    speed_start: float
    """Planned path speed at its start; unit: 1 um/s; written by: CNC."""
    speed_end: float
    """Planned path speed at its end; unit: 1 um/s; written by: CNC."""
    time_start: float
    """Motion time until its start is reached; unit: us; written by: CNC."""
    time_end: float
    """Motion time until its end is reached; unit: us; written by: CNC."""
    start: ArrayView[float]
    """Axis positions at its start; unit: 0.1 um; written by: CNC."""
    end: ArrayView[float]
    """Axis positions at its end; unit: 0.1 um; written by: CNC."""
    direction_start: ArrayView[float]
    """Direction of the main axes at its start, a unit vector; written by:
    CNC.
    """
    direction_end: ArrayView[float]
    """Direction of the main axes at its end; written by: CNC."""

class HLI_AHEAD_SLOT(View):
    """A slot of the queue."""

    request: HLI_AHEAD_REQUEST
    """The PLC's from claiming to asking; written by: PLC."""
    answer: HLI_AHEAD_ANSWER
    """How many, whether more, why none; written by: CNC."""
    block: ViewArray[HLI_CONTOUR_LOOKAHEAD_BLOCK]
    """Elements, as of the manual; with ``HLI_AHEAD_EVENTS`` functions and
    dwells too (types 16 to 20); written by: CNC.
    """
    detail: ViewArray[HLI_AHEAD_DETAIL]
    """One for each of ``block``, with ``HLI_AHEAD_DETAILS``; written by:
    CNC.
    """

class HLI_AHEAD_STATE(View):
    """Of this cycle."""

    motion_time: float
    """Motion time; stands while the path waits for the PLC; unit: us;
    written by: CNC.
    """
    epoch: int
    """The present epoch; written by: CNC."""
    edition: int
    """Changes with the plan; written by: CNC."""
    plan_valid: bool
    """TRUE: the plan holds; written by: CNC."""
    speed: float
    """Path speed as interpolated; unit: mm/s; written by: CNC."""
    position: ArrayView[float]
    """Of the channel's axes as interpolated, not rounded to 0.1 um; unit:
    mm, degrees; written by: CNC.
    """

class HLI_AHEAD_KNOT(View):
    """A place in time."""

    motion_time: float
    """As ``state.motion_time``; unit: us; written by: CNC."""
    distance: float
    """Runs on over epochs; only differences mean something; unit: 0.1 um;
    written by: CNC.
    """
    rate: float
    """Change of the distance; unit: 0.1 um/s; written by: CNC."""
    speed: float
    """Of the driven path; unit: 1 um/s; written by: CNC."""

class HLI_AHEAD_PLAN(View):
    """The plan of the coming motion."""

    seq: int
    """Seqlock; odd while the CNC writes; written by: CNC."""
    edition: int
    """Changes with the plan; written by: CNC."""
    count: int
    """Knots; written by: CNC."""
    complete: bool
    """TRUE: at its end the path rests; written by: CNC."""
    override: float
    """That it was made with; 1 is 100 %; written by: CNC."""
    knot: ViewArray[HLI_AHEAD_KNOT]
    """Places in time; between two of them the distance is a cubic of the
    time; written by: CNC.
    """

class HLI_AHEAD(View):
    """``gpAhead[i]``: the look-ahead extension of a channel; not of the
    manual.
    """

    version_r: int
    """Version of the extension, 2; written by: CNC."""
    sizeof_r: int
    """Its size; unit: bytes; written by: CNC."""
    answer: HLI_AHEAD_ANSWER
    """What the last answer of ``contour_lookahead`` is, beside its elements;
    written by: CNC.
    """
    slot_rw: ArrayView[int]
    """Of each slot: phase (``HLI_AHEAD_FREE`` ..) in the low byte, above it
    the generation of the PLC; written by: both.
    """
    plan_enable_w: bool
    """TRUE: the CNC shows its plan; written by: PLC."""
    state: HLI_AHEAD_STATE
    """Every cycle, under the seqlock of the channel; written by: CNC."""
    plan: HLI_AHEAD_PLAN
    """The plan of the coming motion, under a seqlock of its own; written by:
    CNC.
    """
    slot: ViewArray[HLI_AHEAD_SLOT]
    """The queue; written by: both."""

class HLI_SEGMENT(View):
    """The shared-memory object of one cell."""

    segment_head: HLI_SEGMENT_HEAD
    """Identity of the segment; written by: CNC."""
    platform: HLI_PLATFORM
    """``gpPform``; written by: both."""
    channel: ViewArray[HLI_CHANNEL]
    """``gpCh[i]``; written by: both."""
    axis: ViewArray[HLI_AXIS]
    """``gpAx[i]``; written by: both."""
    ext_var_channel: ViewArray[HLI_EXT_VAR]
    """``gpVECh[i]``: external variables of a channel; written by: both."""
    ext_var_global: HLI_EXT_VAR
    """``gpVEGlobal``: external variables of all channels; written by: both."""
    sidecar: HLI_SIDECAR
    """Turns, bells, seqlock and life of both processes; not public; written
    by: both.
    """
    ahead: ViewArray[HLI_AHEAD]
    """``gpAhead[i]``: the look-ahead extension, behind all other areas;
    written by: both.
    """
