"""The bytes of the emulated HLI: the only truth about the shared memory.

Every structure is little-endian, every member stands at a multiple of its size
(8 at the most), every gap is an explicit ``fill_*`` member and every structure
is padded to a multiple of 8, so packed and natural layouts agree.  ``verify()``
holds these rules.  The C header of the engine, the ST types and the JSON
description are generated from this module, which imports ctypes alone because
the build runs it before anything is installed.

Names are the manual's names; those marked (reconstructed) in ``docs/reference/hli.md``
have no public source. Units: positions and distances 0.1 um, angles rad, speeds
1 um/s, times us, unless a member says otherwise.
"""

from __future__ import annotations

import ctypes
from ctypes import Structure
from typing import Any

BOOL = ctypes.c_bool  # one byte
BYTE = ctypes.c_uint8
INT = ctypes.c_int16
UINT = ctypes.c_uint16
DINT = ctypes.c_int32
UDINT = ctypes.c_uint32
LREAL = ctypes.c_double
ULINT = ctypes.c_uint64
LINT = ctypes.c_int64


def STRING(length: int) -> Any:
    """ST ``STRING(length)``: ``length`` characters and a terminating NUL."""
    return ctypes.c_char * (length + 1)


# Highest index of each array (the vendor's habit: not the count).
HLI_SYS_CH_MAXIDX = 11
HLI_SYS_AX_MAXIDX = 63
HLI_CS_AXIS_MAXIDX = 31
HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX = 127
HLI_TU_CH_STD_SYNC_MAXIDX = 19
HLI_TU_CH_LATE_SYNC_MAXIDX = 19
HLI_TU_AX_STD_SYNC_MAXIDX = 7
HLI_TU_AX_LATE_SYNC_MAXIDX = 7
HLI_TECH_UNIT_CH_MAXIDX = 39
HLI_TECH_UNIT_AX_MAXIDX = 39
HLI_CUSTOMER_VAL_MAXIDX = 7
HLI_ERR_MASK_MAXIDX = 583
HLI_G_FUNCTION_MAXIDX = 15
HLI_KEY_MAXIDX = 11
HLI_HW_MAXIDX = 5
HLI_ESA_MAXIDX = 2
# UDINT words of one external-variable area: 1000 variables of 24 bytes
HLI_EXT_VAR_MAXIDX = 5999
HLI_INTF_VERSION_NAME_LAENGE = 23
HLI_ACHS_NAME_LAENGE = 15
# The extension HLI_AHEAD: not of the manual, so it has a version of its own
HLI_AHEAD_VERSION = 2
HLI_AHEAD_CH_MAXIDX = 0
HLI_AHEAD_SLOT_MAXIDX = 3
HLI_AHEAD_AXIS_MAXIDX = 8
HLI_AHEAD_KNOT_MAXIDX = 511

# block_type of a contour look-ahead element
HLI_CLAH_NONE = 0
HLI_CLAH_LINEAR = 1
HLI_CLAH_CIRCULAR = 2
HLI_CLAH_LOG_ON = 3
HLI_CLAH_LOG_PARAM = 4
HLI_CLAH_LOG_OFF = 5
HLI_CLAH_POLYNOMIAL = 6
HLI_CLAH_PASS_ENTRY = 1
HLI_CLAH_PASS_LOOP = 2
HLI_CLAH_PASS_EXIT = 3

# block_type of what a queue answers in place if HLI_AHEAD_EVENTS asks for it
HLI_CLAH_DWELL = 16
HLI_CLAH_M = 17
HLI_CLAH_H = 18
HLI_CLAH_S = 19
HLI_CLAH_T = 20

# HLI_AHEAD_REQUEST: mode; flags
HLI_AHEAD_MODE_LOG = 1
HLI_AHEAD_MODE_CONTOUR = 2
HLI_AHEAD_BEYOND = 1
HLI_AHEAD_EVENTS = 2
HLI_AHEAD_DETAILS = 4
# HLI_AHEAD_ANSWER: why it is empty
HLI_AHEAD_NOT_EMPTY = 0
HLI_AHEAD_EMPTY_DISABLED = 1
HLI_AHEAD_EMPTY_NOT_KNOWN = 2
HLI_AHEAD_EMPTY_BEHIND_END = 3
HLI_AHEAD_EMPTY_BEFORE_RESET = 4
HLI_AHEAD_EMPTY_DROPPED = 5
HLI_AHEAD_EMPTY_BAD_START = 6
HLI_AHEAD_EMPTY_BAD_LENGTH = 7
HLI_AHEAD_EMPTY_BAD_MODE = 8
HLI_AHEAD_EMPTY_BAD_EPOCH = 9
HLI_AHEAD_EMPTY_BAD_FLAGS = 10
# HLI_AHEAD_ANSWER: what ends that which is known
HLI_AHEAD_END_OPEN = 0
HLI_AHEAD_END_RESET = 1
HLI_AHEAD_END_LOOP = 2
HLI_AHEAD_END_PROGRAM = 3
HLI_AHEAD_END_LOG = 4
# low byte of HLI_AHEAD.slot_rw; above it the PLC's generation
HLI_AHEAD_FREE = 0
HLI_AHEAD_CLAIMED = 1
HLI_AHEAD_ASKED = 2
HLI_AHEAD_ANSWERED = 3
# flags of HLI_AHEAD_DETAIL
HLI_AHEAD_RAPID = 1
HLI_AHEAD_HAS_PLACE = 2
HLI_AHEAD_HAS_DIRECTION = 4
HLI_AHEAD_HAS_DRIVEN = 8
HLI_AHEAD_HAS_WAY = 16
HLI_AHEAD_HAS_START_PLAN = 32
HLI_AHEAD_HAS_END_PLAN = 64

# Operation modes and states of channel_mc_control.mode_and_state (hli_reference 5.4)
HLI_IMCM_STANDBY_MODE = 1
HLI_IMCM_AUTOMATIC_MODE = 2
HLI_IMCM_MDI_MODE = 3
HLI_IMCM_MANUAL_MODE = 4
HLI_IMCM_REFERENCE_MODE = 5
HLI_IMCM_PROCESS_DESELECTED = 1
HLI_IMCM_PROCESS_SELECTED = 2
HLI_IMCM_PROCESS_READY = 3
HLI_IMCM_PROCESS_ACTIVE = 4
HLI_IMCM_PROCESS_HOLD = 5
HLI_IMCM_PROCESS_ERROR = 6
HLI_IMCM_PROCESS_SELECTING = 7
HLI_IMCM_PROCESS_DESELECTING = 8
HLI_IMCM_PROCESS_PREPARING = 9
HLI_IMCM_PROCESS_CLEARING = 10
HLI_IMCM_PROCESS_STARTING = 11
HLI_IMCM_PROCESS_ABORTING = 12
HLI_IMCM_PROCESS_STOPPING = 13
HLI_IMCM_PROCESS_RESUMING = 14
HLI_IMCM_PROCESS_RESETTING = 15

# Segment head
HLI_MAGIC = int.from_bytes(b"HLICOSIM", "little")
HLI_ABI_VERSION = 1


# ---------------------------------------------------------------------------
# patterns (hli_reference 2.2, 2.3)
class MC_CONTROL_BOOL_UNIT(Structure):
    _fields_ = [
        ("request_r", BOOL),
        ("enable_w", BOOL),
        ("command_w", BOOL),
        ("state_r", BOOL),
        ("fill_1", DINT),
    ]


class MC_CONTROL_UNS16_UNIT(Structure):
    _fields_ = [
        ("request_r", UINT),
        ("enable_w", BOOL),
        ("fill_1", BYTE),
        ("command_w", UINT),
        ("state_r", UINT),
    ]


class MC_CONTROL_SGN32_UNIT(Structure):
    _fields_ = [
        ("request_r", DINT),
        ("enable_w", BOOL),
        ("fill_1", BYTE * 3),
        ("command_w", DINT),
        ("state_r", DINT),
    ]


class MC_CONTROL_UNS32_UNIT(Structure):
    _fields_ = [
        ("request_r", UDINT),
        ("enable_w", BOOL),
        ("fill_1", BYTE * 3),
        ("command_w", UDINT),
        ("state_r", UDINT),
    ]


class MC_CONTROL_LREAL_UNIT(Structure):
    _fields_ = [
        ("request_r", LREAL),
        ("enable_w", BOOL),
        ("fill_1", BYTE * 7),
        ("command_w", LREAL),
        ("state_r", LREAL),
    ]


class MC_WATCHDOG_UNIT(Structure):
    _fields_ = [
        ("enable_w", BOOL),
        ("alive_rw", BOOL),
        ("alive_state_r", BOOL),
        ("fill_1", BYTE),
        ("cycle_time_w", UDINT),
    ]


class HLI_PROC_TRANS_TO_MODE_STATE(Structure):
    _fields_ = [
        ("from_mode", UDINT),
        ("from_state", UDINT),
        ("to_mode", UDINT),
        ("to_state", UDINT),
        ("channel", UDINT),
        ("fill_1", UDINT),
        ("parameter", STRING(299)),
        ("fill_2", UDINT),
    ]


class HLI_IMCM_MODE_STATE(Structure):
    _fields_ = [("mode", UDINT), ("state", UDINT)]


class MC_CONTROL_MCM_MODE_STATE_UNIT(Structure):
    _fields_ = [
        ("request_r", HLI_PROC_TRANS_TO_MODE_STATE),
        ("enable_w", BOOL),
        ("fill_1", BYTE * 7),
        ("command_w", HLI_PROC_TRANS_TO_MODE_STATE),
        ("request_semaphor_rw", BOOL),
        ("command_semaphor_rw", BOOL),
        ("fill_2", BYTE * 6),
        ("state_r", HLI_IMCM_MODE_STATE),
    ]


class HLI_INSERT_CMD_COMMAND(Structure):
    _fields_ = [
        ("dist_or_pos", LREAL),
        ("rel_abs_mode", UINT),
        ("axis_nr", UINT),
        ("m_function_nr", UINT),
        ("fill_1", UINT),
        ("add_nr", DINT),
        ("fill_2", DINT),
    ]


class HLI_INSERT_CMD_STATE(Structure):
    _fields_ = [
        ("distance_of_next_stop", LREAL),
        ("position_at_next_stop", DINT * (HLI_CS_AXIS_MAXIDX + 1)),
    ]


class MC_CONTROL_INSERT_CMD_UNIT(Structure):
    _fields_ = [
        ("enable_w", BOOL),
        ("command_semaphor_rw", BOOL),
        ("fill_1", BYTE * 6),
        ("command_w", HLI_INSERT_CMD_COMMAND),
        ("state_r", HLI_INSERT_CMD_STATE),
    ]


# --------------------------------------------------------------------------- heads (3)
class HLI_INTF_VERSION(Structure):
    _fields_ = [("zeichen", STRING(HLI_INTF_VERSION_NAME_LAENGE))]


class HLI_HEAD_CHANNEL(Structure):
    _fields_ = [
        ("version_w", HLI_INTF_VERSION),
        ("version_r", HLI_INTF_VERSION),
        ("sizeof_interface_r", UDINT),
        ("channel_nr", DINT),
        ("channel_type_r", UDINT),
        ("plc_present_w", BOOL),
        ("init_done_r", BOOL),
        ("fill_1", BYTE * 2),
        ("mc_watchdog", MC_WATCHDOG_UNIT),
        ("lc_watchdog", MC_WATCHDOG_UNIT),
    ]


class HLI_HEAD_AXIS(Structure):
    _fields_ = [
        ("plc_present_w", BOOL),
        ("error_r", BOOL),
        ("reset_error_locked_r", BOOL),
        ("fill_1", BYTE),
        ("log_ax_n_r", UINT),
        ("axis_type_r", UINT),
        ("sizeof_interface_r", UDINT),
        ("fill_2", UDINT),
    ]


# ---------------------------------------------------------------------------
# channel control units (5.1)
class HLI_DECODER_MC_CONTROL(Structure):
    _fields_ = [
        ("program_block_ignore", MC_CONTROL_UNS32_UNIT),
        ("single_block", MC_CONTROL_BOOL_UNIT),
        ("execution_mode", MC_CONTROL_SGN32_UNIT),
    ]


class HLI_BAHN_MC_CONTROL(Structure):
    _fields_ = [
        ("feedhold", MC_CONTROL_BOOL_UNIT),
        ("override", MC_CONTROL_UNS16_UNIT),
        ("override_valid", MC_CONTROL_BOOL_UNIT),
        ("rapid_override", MC_CONTROL_UNS16_UNIT),
        ("rapid_override_valid", MC_CONTROL_BOOL_UNIT),
        ("single_block", MC_CONTROL_BOOL_UNIT),
        ("continue_machining", MC_CONTROL_BOOL_UNIT),
        ("m01_stop_enable", MC_CONTROL_BOOL_UNIT),
        ("delete_distance_to_go", MC_CONTROL_BOOL_UNIT),
        ("del_dist_to_go_end", MC_CONTROL_UNS32_UNIT),
        ("backward_motion", MC_CONTROL_BOOL_UNIT),
        ("simulate_motion", MC_CONTROL_BOOL_UNIT),
        ("backward_storage_off", MC_CONTROL_BOOL_UNIT),
        ("rt_loop_enable", MC_CONTROL_BOOL_UNIT),
        ("ext_command_speed", MC_CONTROL_SGN32_UNIT),
        ("ext_command_speed_valid", MC_CONTROL_BOOL_UNIT),
        ("insert_cmd", MC_CONTROL_INSERT_CMD_UNIT),
    ]


class HLI_CHANNEL_MC_CONTROL(Structure):
    _fields_ = [("mode_and_state", MC_CONTROL_MCM_MODE_STATE_UNIT)]


# ---------------------------------------------------------------------------
# channel status (4.1, 4.2)
class HLI_DECODER_STATE(Structure):
    _fields_ = [
        ("program_end_r", BOOL),
        ("syntax_check_r", BOOL),
        ("wait_after_error_r", BOOL),
        ("fill_1", BYTE * 5),
    ]


class HLI_HB_DISPLAY(Structure):
    _fields_ = [
        ("state", UINT),
        ("operation_mode", UINT),
        ("control_element", UINT),
        ("fill_1", UINT),
        ("hr_aufloesung", DINT),
        ("tipp_geschw", DINT),
        ("jog_geschw", DINT),
        ("jog_weg", DINT),
    ]


class HLI_ACHS_NAME(Structure):
    _fields_ = [("zeichen", STRING(HLI_ACHS_NAME_LAENGE))]


class HLI_COORD(Structure):
    _fields_ = [
        ("log_axis_nr_r", UINT),
        ("fill_1", UINT),
        ("axis_type_r", UINT),
        ("state_r", UINT),
        ("name", STRING(15)),
        ("cmd_position_r", DINT),
        ("act_position_r", DINT),
        ("current_position_r", DINT),
        ("acs_position_r", DINT),
        ("dist_to_geom_end_r", DINT),
        ("fill_2", DINT),
        ("hb_display_r", HLI_HB_DISPLAY),
        ("axis_name_r", HLI_ACHS_NAME),
    ]


class HLI_BAHN_STATE(Structure):
    _fields_ = [
        ("dist_prog_start", LREAL),
        ("dist_to_go_r", LREAL),
        ("eta_time_r", LREAL),
        ("dist_v_0_r", LREAL),
        ("esa_vb", LREAL * (HLI_ESA_MAXIDX + 1)),
        ("covered_distance_r", DINT),
        ("block_count_r", UDINT),
        ("block_number_r", UDINT),
        ("command_feed_r", DINT),
        ("active_feed_r", DINT),
        ("stop_condition_r", UDINT),
        ("error_id_r", UDINT),
        ("tool_nr_r", DINT),
        ("file_offset_r", DINT),
        ("override_r", UINT),
        ("block_search_state_r", INT),
        ("program_end_r", BOOL),
        ("interpolation_active_r", BOOL),
        ("axes_in_position_r", BOOL),
        ("wait_axes_in_position_r", BOOL),
        ("wait_techno_acknowledge_r", BOOL),
        ("wait_continue_r", BOOL),
        ("wait_error_removal_r", BOOL),
        ("dwell_time_active_r", BOOL),
        ("speed_limit_detect_r", BOOL),
        ("block_search_active_r", BOOL),
        ("delete_distance_to_go_active_r", BOOL),
        ("feedhold_active_r", BOOL),
        ("rapid_active_r", BOOL),
        ("backward_active_r", BOOL),
        ("error_r", BOOL),
        ("eta_valid_r", BOOL),
        ("pos_v_0_valid_r", BOOL),
        ("esa_data_valid", BOOL * (HLI_ESA_MAXIDX + 1)),
        ("inside_rt_loop_r", BOOL),
        ("fill_1", BYTE * 3),
        ("g_function_r", UINT * (HLI_G_FUNCTION_MAXIDX + 1)),
        ("prog_name_r", STRING(259)),
        ("rt_loop_count_r", UDINT),
        ("coord_r", HLI_COORD * (HLI_CS_AXIS_MAXIDX + 1)),
        ("pos_v_0_pcs_r", DINT * (HLI_CS_AXIS_MAXIDX + 1)),
        ("pos_v_0_acs_r", DINT * (HLI_CS_AXIS_MAXIDX + 1)),
    ]


# ---------------------------------------------------------------------------
# technology (6)
class HLI_ATTRIBUT(Structure):
    _fields_ = [("data", BYTE * (HLI_TECH_UNIT_CH_MAXIDX + 1))]


class TECHNO_UNIT_CH(Structure):
    _fields_ = [
        ("please_rw", BOOL),
        ("done_w", BOOL),
        ("fkt_ctrl_r", UINT),
        ("fill_1", UDINT),
        ("attribut_r", HLI_ATTRIBUT),
    ]


class TECHNO_UNIT_AX(Structure):
    _fields_ = list(TECHNO_UNIT_CH._fields_)


class HLI_M_H_PROZESS(Structure):
    _fields_ = [
        ("nr", UDINT),
        ("zeit", DINT),
        ("satz_nr", UDINT),
        ("zeilen_nr", UDINT),
        ("add_value", DINT),
        ("nr_late_sync", UINT),
        ("fill_1", UINT),
        ("synch_mode", UDINT),
        ("fill_2", UDINT),
    ]


class HLI_S_PROZESS(Structure):
    _fields_ = [
        ("pos", DINT),
        ("rev", DINT),
        ("zeit", UDINT),
        ("move_cmd", UINT),
        ("pos_cmd", UINT),
        ("axis_nr", UINT),
        ("nr_late_sync", UINT),
        ("synch_mode", UDINT),
        ("satz_nr", UDINT),
        ("zeilen_nr", UDINT),
        ("fill_1", UDINT * 2),
    ]


class HLI_TOOL_ID(Structure):
    _fields_ = [
        ("basic", DINT),
        ("sister", DINT),
        ("variant", DINT),
        ("sister_valid", BOOL),
        ("variant_valid", BOOL),
        ("fill_1", BYTE * 2),
    ]


class HLI_T_PROZESS(Structure):
    _fields_ = [
        ("id", HLI_TOOL_ID),
        ("add_info_r", UDINT * 4),
        ("nr_late_sync", UINT),
        ("fill_1", UINT),
        ("synch_mode", UDINT),
    ]


# ---------------------------------------------------------------------------
# errors (7.2)
class HLI_MODUL_NAME(Structure):
    _fields_ = [("zeichen", STRING(15))]


class HLI_ERROR_KOPF(Structure):
    _fields_ = [
        ("error_id", UDINT),
        ("fill_1", UDINT),
        ("modul_name", HLI_MODUL_NAME),
        ("line", DINT),
        ("util_error_id", UDINT),
        ("util_modul_name", HLI_MODUL_NAME),
        ("util_line", DINT),
        ("multiple_id", UINT),
        ("function_type", UINT),
        ("channel", UINT),
        ("sender", UINT),
        ("suppress", UINT),
        ("fill_2", UINT),
        ("date", UDINT),
        ("cycle", UDINT),
        ("version", HLI_INTF_VERSION),
        ("recovery_class", UINT),
        ("reaction_class", UINT),
        ("body_type", UDINT),
    ]


class HLI_ERROR_MASKE(Structure):
    _fields_ = [("err_mask", BYTE * (HLI_ERR_MASK_MAXIDX + 1))]


class HLI_ERROR_RUMPF(Structure):
    _fields_ = [
        ("maske", HLI_ERROR_MASKE),
        ("value", (BYTE * 40) * 5),
        ("identifier", (BYTE * 16) * 4),
    ]


class HLI_RUMPF_NC_PROG(Structure):
    _fields_ = [
        ("log_pfad_nr", UDINT),
        ("fill_1", UDINT),
        ("prog_name", STRING(263)),
        ("file_name", STRING(259)),
        ("fileoffset", DINT),
        ("satzoffset", UINT),
        ("tokenoffset", UINT),
        ("satz_nr", UDINT),
    ]


class HLI_ERROR_SATZ(Structure):
    _fields_ = [("kopf", HLI_ERROR_KOPF), ("rumpf", HLI_ERROR_RUMPF)]


class MC_ERROR(Structure):
    _fields_ = [
        ("satz_r", HLI_ERROR_SATZ),
        ("semaphor_rw", BOOL),
        ("enable_w", BOOL),
        ("fill_1", BYTE * 6),
    ]


# ---------------------------------------------------------------------------
# contour look-ahead (FCT-C40, 5)
class HLI_CONTOUR_LOOKAHEAD_BLOCK(Structure):
    _fields_ = [
        ("block_type", UDINT),
        ("block_number", UDINT),
        ("block_count_r", UDINT),
        ("circle_turns", UINT),
        ("rt_loop_pass", UINT),
        ("start_position", LREAL),
        ("length", LREAL),
        ("programmed_radius", LREAL),
        ("compensated_radius", LREAL),
        ("circle_angle", LREAL),
        ("length_min", LREAL),
        ("tangent_variation", LREAL),
    ]


class HLI_CONTOUR_LOOKAHEAD_REQUEST(Structure):
    _fields_ = [("start_position", LREAL), ("length", LREAL)]


class HLI_CONTOUR_LOOKAHEAD_RESPONSE(Structure):
    _fields_ = [
        (
            "block",
            HLI_CONTOUR_LOOKAHEAD_BLOCK
            * (HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1),
        )
    ]


class HLI_CONTOUR_LOOKAHEAD_STATE(Structure):
    _fields_ = [
        ("max_dist_prog_start", LREAL),
        ("count_logged_blocks", UDINT),
        ("f_log_is_active", BOOL),
        ("fill_1", BYTE * 3),
    ]


class HLI_CONTOUR_LOOKAHEAD(Structure):
    """The control unit; request and semaphore share one cache line, the answer
    and the state have their own.
    """

    _fields_ = [
        ("request", HLI_CONTOUR_LOOKAHEAD_REQUEST),
        ("semaphor_rw", BOOL),
        ("fill_1", BYTE * 47),
        ("response", HLI_CONTOUR_LOOKAHEAD_RESPONSE),
        ("state", HLI_CONTOUR_LOOKAHEAD_STATE),
        ("fill_2", BYTE * 48),
    ]


# ---------------------------------------------------------------------------
# manual mode: units with usage check
class HLI_HB_ACTIVATION(Structure):
    _fields_ = [
        ("log_achs_nr", UINT),
        ("control_element", UINT),
        ("operation_mode", UINT),
        ("param_index", UINT),
        ("fill_1", UINT * 2),
    ]


class HLI_HB_TIP_PARAMETER(Structure):
    _fields_ = [("log_achs_nr", UINT), ("fill_1", UINT), ("speed", UDINT)]


class HLI_HB_JOG_PARAMETER(Structure):
    _fields_ = [
        ("log_achs_nr", UINT),
        ("fill_1", UINT),
        ("distance", UDINT),
        ("speed", UDINT),
        ("fill_2", DINT),
    ]


class HLI_HB_HR_PARAMETER(Structure):
    _fields_ = [("log_achs_nr", UINT), ("fill_1", UINT), ("resolution", DINT)]


class HLI_HB_RAPID_KEY(Structure):
    _fields_ = [("log_key_nr", UINT), ("key_pressed", UINT), ("fill_1", UDINT)]


class HLI_HB_KEY(Structure):
    _fields_ = [
        ("log_key_nr", UINT),
        ("direction", INT),
        ("life_time", UDINT),
        ("f_refresh", BOOL),
        ("fill_1", BYTE * 3),
        ("fill_2", DINT),
    ]


class MC_CONTROL_HB_ACTIVATION_UNIT(Structure):
    _fields_ = [
        ("request_r", HLI_HB_ACTIVATION),
        ("enable_w", BOOL),
        ("fill_1", BYTE * 3),
        ("command_w", HLI_HB_ACTIVATION),
        ("request_semaphor_rw", BOOL),
        ("command_semaphor_rw", BOOL),
        ("fill_2", BYTE * 2),
    ]


class MC_CONTROL_HB_TIP_PARAM_UNIT(Structure):
    _fields_ = [
        ("request_r", HLI_HB_TIP_PARAMETER),
        ("enable_w", BOOL),
        ("fill_1", BYTE * 3),
        ("command_w", HLI_HB_TIP_PARAMETER),
        ("request_semaphor_rw", BOOL),
        ("command_semaphor_rw", BOOL),
        ("fill_2", BYTE * 2),
    ]


class MC_CONTROL_HB_JOG_PARAM_UNIT(Structure):
    _fields_ = [
        ("request_r", HLI_HB_JOG_PARAMETER),
        ("enable_w", BOOL),
        ("fill_1", BYTE * 3),
        ("command_w", HLI_HB_JOG_PARAMETER),
        ("request_semaphor_rw", BOOL),
        ("command_semaphor_rw", BOOL),
        ("fill_2", BYTE * 2),
    ]


class MC_CONTROL_HB_HR_PARAM_UNIT(Structure):
    _fields_ = [
        ("request_r", HLI_HB_HR_PARAMETER),
        ("enable_w", BOOL),
        ("fill_1", BYTE * 3),
        ("command_w", HLI_HB_HR_PARAMETER),
        ("request_semaphor_rw", BOOL),
        ("command_semaphor_rw", BOOL),
        ("fill_2", BYTE * 2),
    ]


class MC_CONTROL_HB_RAPID_KEY_UNIT(Structure):
    _fields_ = [
        ("request_r", HLI_HB_RAPID_KEY),
        ("enable_w", BOOL),
        ("fill_1", BYTE * 3),
        ("command_w", HLI_HB_RAPID_KEY),
        ("request_semaphor_rw", BOOL),
        ("command_semaphor_rw", BOOL),
        ("fill_2", BYTE * 2),
    ]


class MC_CONTROL_HB_KEY_UNIT(Structure):
    _fields_ = [
        ("request_r", HLI_HB_KEY),
        ("enable_w", BOOL),
        ("fill_1", BYTE * 3),
        ("command_w", HLI_HB_KEY),
        ("request_semaphor_rw", BOOL),
        ("command_semaphor_rw", BOOL),
        ("fill_2", BYTE * 2),
    ]


class HLI_HB_MC_CONTROL(Structure):
    _fields_ = [
        ("activation", MC_CONTROL_HB_ACTIVATION_UNIT),
        ("tip_parameter", MC_CONTROL_HB_TIP_PARAM_UNIT),
        ("jog_parameter", MC_CONTROL_HB_JOG_PARAM_UNIT),
        ("hr_parameter", MC_CONTROL_HB_HR_PARAM_UNIT),
        ("rapid_key", MC_CONTROL_HB_RAPID_KEY_UNIT),
        ("key", MC_CONTROL_HB_KEY_UNIT * (HLI_KEY_MAXIDX + 1)),
        ("handwheel_incs", MC_CONTROL_SGN32_UNIT * (HLI_HW_MAXIDX + 1)),
    ]


# --------------------------------------------------------------------------- areas
class HLI_CHANNEL(Structure):
    _fields_ = [
        ("head", HLI_HEAD_CHANNEL),
        ("decoder_mc_control", HLI_DECODER_MC_CONTROL),
        ("bahn_mc_control", HLI_BAHN_MC_CONTROL),
        ("channel_mc_control", HLI_CHANNEL_MC_CONTROL),
        ("decoder_state", HLI_DECODER_STATE),
        ("bahn_state", HLI_BAHN_STATE),
        ("used_units_std_sync_r", UINT),
        ("used_units_late_sync_r", UINT),
        ("fill_1", UDINT),
        (
            "techno_unit_std_sync",
            TECHNO_UNIT_CH * (HLI_TU_CH_STD_SYNC_MAXIDX + 1),
        ),
        (
            "techno_unit_late_sync",
            TECHNO_UNIT_CH * (HLI_TU_CH_LATE_SYNC_MAXIDX + 1),
        ),
        ("mc_error", MC_ERROR),
        ("lc_error", MC_ERROR),
        ("fill_2", BYTE * 56),  # the look-ahead unit starts on a cache line
        ("contour_lookahead", HLI_CONTOUR_LOOKAHEAD),
        ("hb_mc_control", HLI_HB_MC_CONTROL),
        ("fill_3", BYTE * 48),
    ]


class HLI_IPO_MC_CONTROL(Structure):
    _fields_ = [
        ("feedhold", MC_CONTROL_BOOL_UNIT),
        ("override", MC_CONTROL_UNS16_UNIT),
        ("override_valid", MC_CONTROL_BOOL_UNIT),
        ("dyn_pos_limit_low", MC_CONTROL_SGN32_UNIT),
        ("dyn_pos_limit_high", MC_CONTROL_SGN32_UNIT),
    ]


class HLI_ADD_CMD_VALUE(Structure):
    _fields_ = [
        ("m_add_pos_value", DINT),
        ("m_add_speed_value", DINT),
        ("sgn32_free_1", DINT),
        ("sgn32_free_2", DINT),
        ("sgn32_free_3", DINT),
        ("sgn32_free_4", DINT),
        ("sgn32_free_5", DINT),
        ("sgn32_free_6", DINT),
    ]


class MC_CONTROL_ADD_CMD_VALUE_UNIT(Structure):
    _fields_ = [
        ("request_r", HLI_ADD_CMD_VALUE),
        ("enable_w", BOOL),
        ("fill_1", BYTE * 7),
        ("command_w", HLI_ADD_CMD_VALUE),
        ("state_r", HLI_ADD_CMD_VALUE),
    ]


class HLI_LR_MC_CONTROL(Structure):
    _fields_ = [
        ("release_feedhold", MC_CONTROL_BOOL_UNIT),
        ("drive_on", MC_CONTROL_BOOL_UNIT),
        ("torque_permission", MC_CONTROL_BOOL_UNIT),
        ("add_cmd_values", MC_CONTROL_ADD_CMD_VALUE_UNIT),
    ]


class HLI_LR_STATE(Structure):
    _fields_ = [
        ("end_position_acs_r", DINT),
        ("active_position_acs_r", DINT),
        ("current_position_acs_r", DINT),
        ("position_offset_r", DINT),
        ("axis_state_r", UINT),
        ("fill_1", UINT),
        ("cmd_rev_r", DINT),
        ("active_rev_r", DINT),
        ("current_rev_r", DINT),
    ]


class HLI_IPO_STATE(Structure):
    _fields_ = [
        ("log_achs_nr_r", UINT),
        ("type_r", UINT),
        ("spindle_axis_r", BOOL),
        ("fill_1", BYTE * 3),
    ]


class HLI_AXIS(Structure):
    _fields_ = [
        ("head", HLI_HEAD_AXIS),
        ("ipo_mc_control", HLI_IPO_MC_CONTROL),
        ("lr_mc_control", HLI_LR_MC_CONTROL),
        ("lr_state", HLI_LR_STATE),
        ("used_units_std_sync_r", UINT),
        ("used_units_late_sync_r", UINT),
        ("fill_1", UDINT),
        (
            "techno_unit_std_sync",
            TECHNO_UNIT_AX * (HLI_TU_AX_STD_SYNC_MAXIDX + 1),
        ),
        (
            "techno_unit_late_sync",
            TECHNO_UNIT_AX * (HLI_TU_AX_LATE_SYNC_MAXIDX + 1),
        ),
        ("ipo_state", HLI_IPO_STATE),
    ]


class HLI_NC_CONFIG(Structure):
    _fields_ = [
        ("hli_version_w", HLI_INTF_VERSION),
        ("hli_version_r", HLI_INTF_VERSION),
        ("nc_kernel_version_r", HLI_INTF_VERSION),
    ]


class HLI_PLATFORM(Structure):
    _fields_ = [
        ("plc_present_w", BOOL),
        ("fill_1", BYTE * 7),
        ("nc_config", HLI_NC_CONFIG),
        ("channel_count_r", UDINT),
        ("axis_count_r", UDINT),
        ("customer_val_r", UDINT * (HLI_CUSTOMER_VAL_MAXIDX + 1)),
        ("fill_2", BYTE * 8),
    ]


class HLI_EXT_VAR(Structure):
    _fields_ = [("value", UDINT * (HLI_EXT_VAR_MAXIDX + 1))]


# ---------------------------------------------------------------------------
# segment head and sidecar (not public)
class HLI_SEGMENT_HEAD(Structure):
    """First bytes of the segment; ``ready`` is written last, with release order."""

    _fields_ = [
        ("magic", ULINT),
        ("abi_version", UDINT),
        ("channel_count", UDINT),
        ("axis_count", UDINT),
        ("ready", UDINT),
        ("segment_size", ULINT),
        ("owner_pid", LINT),
        ("owner_start", ULINT),
        ("layout_hash", BYTE * 32),
        ("fill_1", BYTE * 176),
    ]


class HLI_SIDE_CNC(Structure):
    """Written by the CNC process: identity, the cell's clock, liveness (one
    cache line).
    """

    _fields_ = [
        ("pid", LINT),
        ("start", ULINT),
        ("cycle", ULINT),
        ("cell_time_ns", ULINT),
        ("cycle_ns", UDINT),
        ("clock", UDINT),
        ("service", UDINT),
        ("generation", UDINT),
        ("phase", UDINT),
        ("fill_1", BYTE * 12),
    ]


class HLI_SIDE_PLC(Structure):
    """Written by the PLC process: identity, liveness, wish to keep the cell
    alive (one cache line).
    """

    _fields_ = [
        ("pid", LINT),
        ("start", ULINT),
        ("heartbeat", ULINT),
        ("generation", UDINT),
        ("attached", UDINT),
        ("finished", UDINT),
        ("scans_due", UDINT),
        ("scans", ULINT),
        ("fill_1", BYTE * 16),
    ]


class HLI_SIDE_WORD(Structure):
    """One futex word with the number of its waiters, alone on its cache line."""

    _fields_ = [
        ("word", UDINT),
        ("waiters", UDINT),
        ("core", UDINT),
        ("fill_1", BYTE * 52),
    ]


class HLI_SIDE_STATS(Structure):
    """Counters written by the CNC (one cache line)."""

    _fields_ = [
        ("requests_mode1", ULINT),
        ("requests_mode2", ULINT),
        ("requests_bad", ULINT),
        ("overruns", ULINT),
        ("bad_commands", ULINT),
        ("planner_late_cycles", ULINT),
        ("techno_busy", UDINT),
        ("planner_late", UDINT),
        ("fill_1", BYTE * 8),
    ]


class HLI_SIDE_TECHNO(Structure):
    """Functions that a PLC before this one has fetched: the PLC's lines, then
    the CNC's.
    """

    _fields_ = [
        ("shown", ULINT * (HLI_SYS_CH_MAXIDX + 1)),
        ("axis_shown", BYTE * (HLI_SYS_AX_MAXIDX + 1)),
        ("fill_1", BYTE * 32),
        ("again", ULINT * (HLI_SYS_CH_MAXIDX + 1)),
        ("axis_again", BYTE * (HLI_SYS_AX_MAXIDX + 1)),
        ("fill_2", BYTE * 32),
    ]


class HLI_SIDE_PLANNER(Structure):
    """What the planner of a channel takes for each ms of motion (one cache line)."""

    _fields_ = [
        ("p50", LREAL),
        ("p99", LREAL),
        ("most", LREAL),
        ("fill_1", BYTE * 40),
    ]


class HLI_SIDECAR(Structure):
    _fields_ = [
        ("cnc", HLI_SIDE_CNC),
        ("plc", HLI_SIDE_PLC),
        ("cnc_turn", HLI_SIDE_WORD),
        ("plc_turn", HLI_SIDE_WORD),
        ("clah_bell", HLI_SIDE_WORD),
        ("clah_answer", HLI_SIDE_WORD),
        ("channel_seq", HLI_SIDE_WORD),
        ("stats", HLI_SIDE_STATS),
        ("techno", HLI_SIDE_TECHNO),
        ("planner", HLI_SIDE_PLANNER * (HLI_SYS_CH_MAXIDX + 1)),
    ]


# ---------------------------------------------------------------------------
# look-ahead extension: beside the manual's members, which know nothing of it
class HLI_AHEAD_REQUEST(Structure):
    """One cache line; the PLC's from the claim of a slot to its asking."""

    _fields_ = [
        ("start_position", LREAL),
        ("length", LREAL),
        ("mode", UDINT),
        ("flags", UDINT),
        ("epoch", UDINT),
        ("tag", UDINT),
        ("fill_1", BYTE * 32),
    ]


class HLI_AHEAD_ANSWER(Structure):
    """What is to be known of an answer beside its elements (one cache line)."""

    _fields_ = [
        ("count", UDINT),
        ("empty", UDINT),
        ("end", UDINT),
        ("mode", UDINT),
        ("epoch", UDINT),
        ("tag", UDINT),
        ("more", BOOL),
        ("fill_1", BYTE * 7),
        ("start_position", LREAL),
        ("length", LREAL),
        ("dist_prog_start", LREAL),
        ("fill_2", BYTE * 8),
    ]


class HLI_AHEAD_DETAIL(Structure):
    """What an element is beside its HLI_CONTOUR_LOOKAHEAD_BLOCK."""

    _fields_ = [
        ("flags", UDINT),
        ("epoch", UDINT),
        ("code", DINT),
        ("fill_1", UDINT),
        ("value", LREAL),
        ("way", LREAL),
        ("feed", LREAL),
        ("driven_length", LREAL),
        ("speed_start", LREAL),
        ("speed_end", LREAL),
        ("time_start", LREAL),
        ("time_end", LREAL),
        ("start", LREAL * (HLI_AHEAD_AXIS_MAXIDX + 1)),
        ("end", LREAL * (HLI_AHEAD_AXIS_MAXIDX + 1)),
        ("direction_start", LREAL * 3),
        ("direction_end", LREAL * 3),
    ]


class HLI_AHEAD_SLOT(Structure):
    _fields_ = [
        ("request", HLI_AHEAD_REQUEST),
        ("answer", HLI_AHEAD_ANSWER),
        (
            "block",
            HLI_CONTOUR_LOOKAHEAD_BLOCK
            * (HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1),
        ),
        (
            "detail",
            HLI_AHEAD_DETAIL * (HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1),
        ),
    ]


class HLI_AHEAD_STATE(Structure):
    """Written in every cycle, under the seqlock of the channel."""

    _fields_ = [
        ("motion_time", LREAL),
        ("epoch", UDINT),
        ("edition", UDINT),
        ("plan_valid", BOOL),
        ("fill_1", BYTE * 7),
        ("speed", LREAL),
        ("position", LREAL * (HLI_AHEAD_AXIS_MAXIDX + 1)),
        ("fill_2", BYTE * 24),
    ]


class HLI_AHEAD_KNOT(Structure):
    _fields_ = [
        ("motion_time", LREAL),
        ("distance", LREAL),
        ("rate", LREAL),
        ("speed", LREAL),
    ]


class HLI_AHEAD_PLAN(Structure):
    """The plan of the coming motion, under a seqlock of its own, ``seq``."""

    _fields_ = [
        ("seq", UDINT),
        ("edition", UDINT),
        ("count", UDINT),
        ("complete", BOOL),
        ("fill_1", BYTE * 3),
        ("override", LREAL),
        ("fill_2", BYTE * 40),
        ("knot", HLI_AHEAD_KNOT * (HLI_AHEAD_KNOT_MAXIDX + 1)),
    ]


class HLI_AHEAD(Structure):
    """The extension of one channel: each line has one writer but ``slot_rw``."""

    _fields_ = [
        ("version_r", UDINT),
        ("sizeof_r", UDINT),
        ("fill_1", BYTE * 56),
        ("answer", HLI_AHEAD_ANSWER),
        ("slot_rw", UDINT * (HLI_AHEAD_SLOT_MAXIDX + 1)),
        ("fill_2", BYTE * 48),
        ("plan_enable_w", BOOL),
        ("fill_3", BYTE * 63),
        ("state", HLI_AHEAD_STATE),
        ("plan", HLI_AHEAD_PLAN),
        ("slot", HLI_AHEAD_SLOT * (HLI_AHEAD_SLOT_MAXIDX + 1)),
    ]


# values of HLI_SIDE_CNC.clock, .service and .phase
HLI_CLOCK_LOCKSTEP = 0
HLI_CLOCK_FREERUN = 1
HLI_CLOCK_REALTIME = 2
HLI_SERVICE_CYCLIC = 0
HLI_SERVICE_IMMEDIATE = 1
HLI_PHASE_STARTING = 0
HLI_PHASE_READY = 1
HLI_PHASE_RUNNING = 2
HLI_PHASE_ENDED = 3
HLI_PHASE_SHUTDOWN = 4


class HLI_SEGMENT(Structure):
    _fields_ = [
        ("segment_head", HLI_SEGMENT_HEAD),
        ("platform", HLI_PLATFORM),
        ("channel", HLI_CHANNEL * (HLI_SYS_CH_MAXIDX + 1)),
        ("axis", HLI_AXIS * (HLI_SYS_AX_MAXIDX + 1)),
        ("ext_var_channel", HLI_EXT_VAR * (HLI_SYS_CH_MAXIDX + 1)),
        ("ext_var_global", HLI_EXT_VAR),
        ("sidecar", HLI_SIDECAR),
        # behind everything else: no other offset depends on it
        ("ahead", HLI_AHEAD * (HLI_AHEAD_CH_MAXIDX + 1)),
    ]


# Old or uncertain spellings -> the spelling used here (hli_reference 1.2, 4.1,
# 5.3; contour look-ahead section 10).
ALIASES: dict[str, str] = {
    "dist_prog_start_high": "dist_prog_start",
    "stop_conditions_r": "stop_condition_r",
    "insert_cmd.semaphor_rw": "insert_cmd.command_semaphor_rw",
    "feed_hold": "feedhold",
    "log_achs_nr_r": "log_axis_nr_r",
    "HLI_CONTOUR_LOOKAHEAD.HLI_INSERT_CMD_STATE": "HLI_CONTOUR_LOOKAHEAD_STATE",
}

CONSTANTS: dict[str, int] = {
    k: v
    for k, v in globals().items()
    if k.startswith("HLI_") and isinstance(v, int)
}


def structures() -> list[type[Structure]]:
    """All structures, members before the structures that hold them."""
    return [
        v
        for v in globals().values()
        if isinstance(v, type)
        and issubclass(v, Structure)
        and v is not Structure
    ]


def element_type(ctype: Any) -> tuple[Any, tuple[int, ...]]:
    """(scalar or structure type, array dimensions) of a member's ctypes type;
    char arrays stay strings.
    """
    dims: list[int] = []
    while hasattr(ctype, "_length_") and not is_string(ctype):
        dims.append(ctype._length_)
        ctype = ctype._type_
    return ctype, tuple(dims)


def is_string(ctype: Any) -> bool:
    """True for ST strings (ctypes char arrays)."""
    return hasattr(ctype, "_length_") and ctype._type_ is ctypes.c_char


def _check_structure(cls: type[Structure]) -> None:
    end = 0
    for name, ctype in cls._fields_:  # type: ignore[misc]
        descriptor = getattr(cls, name)
        if descriptor.offset != end:
            raise AssertionError(
                f"{cls.__name__}.{name}: gap before offset {descriptor.offset}"
            )
        end = descriptor.offset + ctypes.sizeof(ctype)
    if ctypes.sizeof(cls) != end or end % 4:
        raise AssertionError(
            f"{cls.__name__}: size {ctypes.sizeof(cls)}, members end at {end}"
        )


def verify() -> None:
    """Raise AssertionError if a structure has implicit padding or a size that
    packed layouts would not share.
    """
    for cls in structures():
        _check_structure(cls)
    for offset in (
        HLI_CHANNEL.contour_lookahead.offset,
        HLI_SEGMENT.channel.offset,
        HLI_SEGMENT.sidecar.offset,
        HLI_SEGMENT.ahead.offset,
        HLI_AHEAD.slot.offset,
    ):
        if offset % 64:
            raise AssertionError(f"offset {offset} is not on a cache line")
    for cls in (HLI_CHANNEL, HLI_AHEAD_SLOT, HLI_AHEAD):
        if ctypes.sizeof(cls) % 64:
            raise AssertionError(
                f"{cls.__name__}: {ctypes.sizeof(cls)} bytes, not whole cache lines"
            )


def describe() -> str:
    """One line per member of every structure (name, type, offset, size): what
    the layout hash is taken of.
    """
    lines = [f"abi {HLI_ABI_VERSION}"]
    for cls in structures():
        lines.append(f"{cls.__name__} {ctypes.sizeof(cls)}")
        for name, ctype in cls._fields_:  # type: ignore[misc]
            base, dims = element_type(ctype)
            offset, size = getattr(cls, name).offset, ctypes.sizeof(ctype)
            lines.append(
                f"  {name} {base.__name__}{list(dims)} @{offset} {size}"
            )
    return "\n".join(lines)
