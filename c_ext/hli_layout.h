/* Generated from hli/layout.py. Do not edit. */
#ifndef HLI_LAYOUT_H
#define HLI_LAYOUT_H
#include <stddef.h>
#include <stdint.h>

#define HLI_SYS_CH_MAXIDX 11
#define HLI_SYS_AX_MAXIDX 63
#define HLI_CS_AXIS_MAXIDX 31
#define HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX 127
#define HLI_TU_CH_STD_SYNC_MAXIDX 19
#define HLI_TU_CH_LATE_SYNC_MAXIDX 19
#define HLI_TU_AX_STD_SYNC_MAXIDX 7
#define HLI_TU_AX_LATE_SYNC_MAXIDX 7
#define HLI_TECH_UNIT_CH_MAXIDX 39
#define HLI_TECH_UNIT_AX_MAXIDX 39
#define HLI_CUSTOMER_VAL_MAXIDX 7
#define HLI_ERR_MASK_MAXIDX 583
#define HLI_G_FUNCTION_MAXIDX 15
#define HLI_ESA_MAXIDX 2
#define HLI_EXT_VAR_MAXIDX 5999
#define HLI_INTF_VERSION_NAME_LAENGE 23
#define HLI_CLAH_NONE 0
#define HLI_CLAH_LINEAR 1
#define HLI_CLAH_CIRCULAR 2
#define HLI_CLAH_LOG_ON 3
#define HLI_CLAH_LOG_PARAM 4
#define HLI_CLAH_LOG_OFF 5
#define HLI_CLAH_POLYNOMIAL 6
#define HLI_IMCM_STANDBY_MODE 1
#define HLI_IMCM_AUTOMATIC_MODE 2
#define HLI_IMCM_MDI_MODE 3
#define HLI_IMCM_MANUAL_MODE 4
#define HLI_IMCM_REFERENCE_MODE 5
#define HLI_IMCM_PROCESS_DESELECTED 1
#define HLI_IMCM_PROCESS_SELECTED 2
#define HLI_IMCM_PROCESS_READY 3
#define HLI_IMCM_PROCESS_ACTIVE 4
#define HLI_IMCM_PROCESS_HOLD 5
#define HLI_IMCM_PROCESS_ERROR 6
#define HLI_IMCM_PROCESS_SELECTING 7
#define HLI_IMCM_PROCESS_DESELECTING 8
#define HLI_IMCM_PROCESS_PREPARING 9
#define HLI_IMCM_PROCESS_CLEARING 10
#define HLI_IMCM_PROCESS_STARTING 11
#define HLI_IMCM_PROCESS_ABORTING 12
#define HLI_IMCM_PROCESS_STOPPING 13
#define HLI_IMCM_PROCESS_RESUMING 14
#define HLI_IMCM_PROCESS_RESETTING 15
#define HLI_MAGIC 0x4d49534f43494c48ULL
#define HLI_ABI_VERSION 1
#define HLI_CLOCK_LOCKSTEP 0
#define HLI_CLOCK_FREERUN 1
#define HLI_CLOCK_REALTIME 2
#define HLI_SERVICE_CYCLIC 0
#define HLI_SERVICE_IMMEDIATE 1
#define HLI_PHASE_STARTING 0
#define HLI_PHASE_READY 1
#define HLI_PHASE_RUNNING 2
#define HLI_PHASE_ENDED 3
#define HLI_PHASE_SHUTDOWN 4
#define HLI_LAYOUT_HASH {0x58, 0x62, 0x5a, 0xfa, 0xf7, 0x79, 0xcb, 0xbc, 0xfb, 0xbd, 0xde, 0x7d, 0x2f, 0x97, 0x73, 0xa1, 0x0f, 0x89, 0x1e, 0x9e, 0x43, 0x23, 0x75, 0x2c, 0x86, 0xfd, 0xed, 0xcc, 0x41, 0x69, 0xde, 0xeb}

typedef struct MC_CONTROL_BOOL_UNIT {
    uint8_t request_r;
    uint8_t enable_w;
    uint8_t command_w;
    uint8_t state_r;
    int32_t fill_1;
} MC_CONTROL_BOOL_UNIT;
_Static_assert(offsetof(MC_CONTROL_BOOL_UNIT, request_r) == 0, "MC_CONTROL_BOOL_UNIT.request_r");
_Static_assert(offsetof(MC_CONTROL_BOOL_UNIT, enable_w) == 1, "MC_CONTROL_BOOL_UNIT.enable_w");
_Static_assert(offsetof(MC_CONTROL_BOOL_UNIT, command_w) == 2, "MC_CONTROL_BOOL_UNIT.command_w");
_Static_assert(offsetof(MC_CONTROL_BOOL_UNIT, state_r) == 3, "MC_CONTROL_BOOL_UNIT.state_r");
_Static_assert(offsetof(MC_CONTROL_BOOL_UNIT, fill_1) == 4, "MC_CONTROL_BOOL_UNIT.fill_1");
_Static_assert(sizeof(MC_CONTROL_BOOL_UNIT) == 8, "MC_CONTROL_BOOL_UNIT");

typedef struct MC_CONTROL_UNS16_UNIT {
    uint16_t request_r;
    uint8_t enable_w;
    uint8_t fill_1;
    uint16_t command_w;
    uint16_t state_r;
} MC_CONTROL_UNS16_UNIT;
_Static_assert(offsetof(MC_CONTROL_UNS16_UNIT, request_r) == 0, "MC_CONTROL_UNS16_UNIT.request_r");
_Static_assert(offsetof(MC_CONTROL_UNS16_UNIT, enable_w) == 2, "MC_CONTROL_UNS16_UNIT.enable_w");
_Static_assert(offsetof(MC_CONTROL_UNS16_UNIT, fill_1) == 3, "MC_CONTROL_UNS16_UNIT.fill_1");
_Static_assert(offsetof(MC_CONTROL_UNS16_UNIT, command_w) == 4, "MC_CONTROL_UNS16_UNIT.command_w");
_Static_assert(offsetof(MC_CONTROL_UNS16_UNIT, state_r) == 6, "MC_CONTROL_UNS16_UNIT.state_r");
_Static_assert(sizeof(MC_CONTROL_UNS16_UNIT) == 8, "MC_CONTROL_UNS16_UNIT");

typedef struct MC_CONTROL_SGN32_UNIT {
    int32_t request_r;
    uint8_t enable_w;
    uint8_t fill_1[3];
    int32_t command_w;
    int32_t state_r;
} MC_CONTROL_SGN32_UNIT;
_Static_assert(offsetof(MC_CONTROL_SGN32_UNIT, request_r) == 0, "MC_CONTROL_SGN32_UNIT.request_r");
_Static_assert(offsetof(MC_CONTROL_SGN32_UNIT, enable_w) == 4, "MC_CONTROL_SGN32_UNIT.enable_w");
_Static_assert(offsetof(MC_CONTROL_SGN32_UNIT, fill_1) == 5, "MC_CONTROL_SGN32_UNIT.fill_1");
_Static_assert(offsetof(MC_CONTROL_SGN32_UNIT, command_w) == 8, "MC_CONTROL_SGN32_UNIT.command_w");
_Static_assert(offsetof(MC_CONTROL_SGN32_UNIT, state_r) == 12, "MC_CONTROL_SGN32_UNIT.state_r");
_Static_assert(sizeof(MC_CONTROL_SGN32_UNIT) == 16, "MC_CONTROL_SGN32_UNIT");

typedef struct MC_CONTROL_UNS32_UNIT {
    uint32_t request_r;
    uint8_t enable_w;
    uint8_t fill_1[3];
    uint32_t command_w;
    uint32_t state_r;
} MC_CONTROL_UNS32_UNIT;
_Static_assert(offsetof(MC_CONTROL_UNS32_UNIT, request_r) == 0, "MC_CONTROL_UNS32_UNIT.request_r");
_Static_assert(offsetof(MC_CONTROL_UNS32_UNIT, enable_w) == 4, "MC_CONTROL_UNS32_UNIT.enable_w");
_Static_assert(offsetof(MC_CONTROL_UNS32_UNIT, fill_1) == 5, "MC_CONTROL_UNS32_UNIT.fill_1");
_Static_assert(offsetof(MC_CONTROL_UNS32_UNIT, command_w) == 8, "MC_CONTROL_UNS32_UNIT.command_w");
_Static_assert(offsetof(MC_CONTROL_UNS32_UNIT, state_r) == 12, "MC_CONTROL_UNS32_UNIT.state_r");
_Static_assert(sizeof(MC_CONTROL_UNS32_UNIT) == 16, "MC_CONTROL_UNS32_UNIT");

typedef struct MC_CONTROL_LREAL_UNIT {
    double request_r;
    uint8_t enable_w;
    uint8_t fill_1[7];
    double command_w;
    double state_r;
} MC_CONTROL_LREAL_UNIT;
_Static_assert(offsetof(MC_CONTROL_LREAL_UNIT, request_r) == 0, "MC_CONTROL_LREAL_UNIT.request_r");
_Static_assert(offsetof(MC_CONTROL_LREAL_UNIT, enable_w) == 8, "MC_CONTROL_LREAL_UNIT.enable_w");
_Static_assert(offsetof(MC_CONTROL_LREAL_UNIT, fill_1) == 9, "MC_CONTROL_LREAL_UNIT.fill_1");
_Static_assert(offsetof(MC_CONTROL_LREAL_UNIT, command_w) == 16, "MC_CONTROL_LREAL_UNIT.command_w");
_Static_assert(offsetof(MC_CONTROL_LREAL_UNIT, state_r) == 24, "MC_CONTROL_LREAL_UNIT.state_r");
_Static_assert(sizeof(MC_CONTROL_LREAL_UNIT) == 32, "MC_CONTROL_LREAL_UNIT");

typedef struct MC_WATCHDOG_UNIT {
    uint8_t enable_w;
    uint8_t alive_rw;
    uint8_t alive_state_r;
    uint8_t fill_1;
    uint32_t cycle_time_w;
} MC_WATCHDOG_UNIT;
_Static_assert(offsetof(MC_WATCHDOG_UNIT, enable_w) == 0, "MC_WATCHDOG_UNIT.enable_w");
_Static_assert(offsetof(MC_WATCHDOG_UNIT, alive_rw) == 1, "MC_WATCHDOG_UNIT.alive_rw");
_Static_assert(offsetof(MC_WATCHDOG_UNIT, alive_state_r) == 2, "MC_WATCHDOG_UNIT.alive_state_r");
_Static_assert(offsetof(MC_WATCHDOG_UNIT, fill_1) == 3, "MC_WATCHDOG_UNIT.fill_1");
_Static_assert(offsetof(MC_WATCHDOG_UNIT, cycle_time_w) == 4, "MC_WATCHDOG_UNIT.cycle_time_w");
_Static_assert(sizeof(MC_WATCHDOG_UNIT) == 8, "MC_WATCHDOG_UNIT");

typedef struct HLI_PROC_TRANS_TO_MODE_STATE {
    uint32_t from_mode;
    uint32_t from_state;
    uint32_t to_mode;
    uint32_t to_state;
    uint32_t channel;
    uint32_t fill_1;
    char parameter[300];
    uint32_t fill_2;
} HLI_PROC_TRANS_TO_MODE_STATE;
_Static_assert(offsetof(HLI_PROC_TRANS_TO_MODE_STATE, from_mode) == 0, "HLI_PROC_TRANS_TO_MODE_STATE.from_mode");
_Static_assert(offsetof(HLI_PROC_TRANS_TO_MODE_STATE, from_state) == 4, "HLI_PROC_TRANS_TO_MODE_STATE.from_state");
_Static_assert(offsetof(HLI_PROC_TRANS_TO_MODE_STATE, to_mode) == 8, "HLI_PROC_TRANS_TO_MODE_STATE.to_mode");
_Static_assert(offsetof(HLI_PROC_TRANS_TO_MODE_STATE, to_state) == 12, "HLI_PROC_TRANS_TO_MODE_STATE.to_state");
_Static_assert(offsetof(HLI_PROC_TRANS_TO_MODE_STATE, channel) == 16, "HLI_PROC_TRANS_TO_MODE_STATE.channel");
_Static_assert(offsetof(HLI_PROC_TRANS_TO_MODE_STATE, fill_1) == 20, "HLI_PROC_TRANS_TO_MODE_STATE.fill_1");
_Static_assert(offsetof(HLI_PROC_TRANS_TO_MODE_STATE, parameter) == 24, "HLI_PROC_TRANS_TO_MODE_STATE.parameter");
_Static_assert(offsetof(HLI_PROC_TRANS_TO_MODE_STATE, fill_2) == 324, "HLI_PROC_TRANS_TO_MODE_STATE.fill_2");
_Static_assert(sizeof(HLI_PROC_TRANS_TO_MODE_STATE) == 328, "HLI_PROC_TRANS_TO_MODE_STATE");

typedef struct HLI_IMCM_MODE_STATE {
    uint32_t mode;
    uint32_t state;
} HLI_IMCM_MODE_STATE;
_Static_assert(offsetof(HLI_IMCM_MODE_STATE, mode) == 0, "HLI_IMCM_MODE_STATE.mode");
_Static_assert(offsetof(HLI_IMCM_MODE_STATE, state) == 4, "HLI_IMCM_MODE_STATE.state");
_Static_assert(sizeof(HLI_IMCM_MODE_STATE) == 8, "HLI_IMCM_MODE_STATE");

typedef struct MC_CONTROL_MCM_MODE_STATE_UNIT {
    HLI_PROC_TRANS_TO_MODE_STATE request_r;
    uint8_t enable_w;
    uint8_t fill_1[7];
    HLI_PROC_TRANS_TO_MODE_STATE command_w;
    uint8_t request_semaphor_rw;
    uint8_t command_semaphor_rw;
    uint8_t fill_2[6];
    HLI_IMCM_MODE_STATE state_r;
} MC_CONTROL_MCM_MODE_STATE_UNIT;
_Static_assert(offsetof(MC_CONTROL_MCM_MODE_STATE_UNIT, request_r) == 0, "MC_CONTROL_MCM_MODE_STATE_UNIT.request_r");
_Static_assert(offsetof(MC_CONTROL_MCM_MODE_STATE_UNIT, enable_w) == 328, "MC_CONTROL_MCM_MODE_STATE_UNIT.enable_w");
_Static_assert(offsetof(MC_CONTROL_MCM_MODE_STATE_UNIT, fill_1) == 329, "MC_CONTROL_MCM_MODE_STATE_UNIT.fill_1");
_Static_assert(offsetof(MC_CONTROL_MCM_MODE_STATE_UNIT, command_w) == 336, "MC_CONTROL_MCM_MODE_STATE_UNIT.command_w");
_Static_assert(offsetof(MC_CONTROL_MCM_MODE_STATE_UNIT, request_semaphor_rw) == 664, "MC_CONTROL_MCM_MODE_STATE_UNIT.request_semaphor_rw");
_Static_assert(offsetof(MC_CONTROL_MCM_MODE_STATE_UNIT, command_semaphor_rw) == 665, "MC_CONTROL_MCM_MODE_STATE_UNIT.command_semaphor_rw");
_Static_assert(offsetof(MC_CONTROL_MCM_MODE_STATE_UNIT, fill_2) == 666, "MC_CONTROL_MCM_MODE_STATE_UNIT.fill_2");
_Static_assert(offsetof(MC_CONTROL_MCM_MODE_STATE_UNIT, state_r) == 672, "MC_CONTROL_MCM_MODE_STATE_UNIT.state_r");
_Static_assert(sizeof(MC_CONTROL_MCM_MODE_STATE_UNIT) == 680, "MC_CONTROL_MCM_MODE_STATE_UNIT");

typedef struct HLI_INSERT_CMD_COMMAND {
    double dist_or_pos;
    uint16_t rel_abs_mode;
    uint16_t axis_nr;
    uint16_t m_function_nr;
    uint16_t fill_1;
    int32_t add_nr;
    int32_t fill_2;
} HLI_INSERT_CMD_COMMAND;
_Static_assert(offsetof(HLI_INSERT_CMD_COMMAND, dist_or_pos) == 0, "HLI_INSERT_CMD_COMMAND.dist_or_pos");
_Static_assert(offsetof(HLI_INSERT_CMD_COMMAND, rel_abs_mode) == 8, "HLI_INSERT_CMD_COMMAND.rel_abs_mode");
_Static_assert(offsetof(HLI_INSERT_CMD_COMMAND, axis_nr) == 10, "HLI_INSERT_CMD_COMMAND.axis_nr");
_Static_assert(offsetof(HLI_INSERT_CMD_COMMAND, m_function_nr) == 12, "HLI_INSERT_CMD_COMMAND.m_function_nr");
_Static_assert(offsetof(HLI_INSERT_CMD_COMMAND, fill_1) == 14, "HLI_INSERT_CMD_COMMAND.fill_1");
_Static_assert(offsetof(HLI_INSERT_CMD_COMMAND, add_nr) == 16, "HLI_INSERT_CMD_COMMAND.add_nr");
_Static_assert(offsetof(HLI_INSERT_CMD_COMMAND, fill_2) == 20, "HLI_INSERT_CMD_COMMAND.fill_2");
_Static_assert(sizeof(HLI_INSERT_CMD_COMMAND) == 24, "HLI_INSERT_CMD_COMMAND");

typedef struct HLI_INSERT_CMD_STATE {
    double distance_of_next_stop;
    int32_t position_at_next_stop[32];
} HLI_INSERT_CMD_STATE;
_Static_assert(offsetof(HLI_INSERT_CMD_STATE, distance_of_next_stop) == 0, "HLI_INSERT_CMD_STATE.distance_of_next_stop");
_Static_assert(offsetof(HLI_INSERT_CMD_STATE, position_at_next_stop) == 8, "HLI_INSERT_CMD_STATE.position_at_next_stop");
_Static_assert(sizeof(HLI_INSERT_CMD_STATE) == 136, "HLI_INSERT_CMD_STATE");

typedef struct MC_CONTROL_INSERT_CMD_UNIT {
    uint8_t enable_w;
    uint8_t command_semaphor_rw;
    uint8_t fill_1[6];
    HLI_INSERT_CMD_COMMAND command_w;
    HLI_INSERT_CMD_STATE state_r;
} MC_CONTROL_INSERT_CMD_UNIT;
_Static_assert(offsetof(MC_CONTROL_INSERT_CMD_UNIT, enable_w) == 0, "MC_CONTROL_INSERT_CMD_UNIT.enable_w");
_Static_assert(offsetof(MC_CONTROL_INSERT_CMD_UNIT, command_semaphor_rw) == 1, "MC_CONTROL_INSERT_CMD_UNIT.command_semaphor_rw");
_Static_assert(offsetof(MC_CONTROL_INSERT_CMD_UNIT, fill_1) == 2, "MC_CONTROL_INSERT_CMD_UNIT.fill_1");
_Static_assert(offsetof(MC_CONTROL_INSERT_CMD_UNIT, command_w) == 8, "MC_CONTROL_INSERT_CMD_UNIT.command_w");
_Static_assert(offsetof(MC_CONTROL_INSERT_CMD_UNIT, state_r) == 32, "MC_CONTROL_INSERT_CMD_UNIT.state_r");
_Static_assert(sizeof(MC_CONTROL_INSERT_CMD_UNIT) == 168, "MC_CONTROL_INSERT_CMD_UNIT");

typedef struct HLI_INTF_VERSION {
    char zeichen[24];
} HLI_INTF_VERSION;
_Static_assert(offsetof(HLI_INTF_VERSION, zeichen) == 0, "HLI_INTF_VERSION.zeichen");
_Static_assert(sizeof(HLI_INTF_VERSION) == 24, "HLI_INTF_VERSION");

typedef struct HLI_HEAD_CHANNEL {
    HLI_INTF_VERSION version_w;
    HLI_INTF_VERSION version_r;
    uint32_t sizeof_interface_r;
    int32_t channel_nr;
    uint32_t channel_type_r;
    uint8_t plc_present_w;
    uint8_t init_done_r;
    uint8_t fill_1[2];
    MC_WATCHDOG_UNIT mc_watchdog;
    MC_WATCHDOG_UNIT lc_watchdog;
} HLI_HEAD_CHANNEL;
_Static_assert(offsetof(HLI_HEAD_CHANNEL, version_w) == 0, "HLI_HEAD_CHANNEL.version_w");
_Static_assert(offsetof(HLI_HEAD_CHANNEL, version_r) == 24, "HLI_HEAD_CHANNEL.version_r");
_Static_assert(offsetof(HLI_HEAD_CHANNEL, sizeof_interface_r) == 48, "HLI_HEAD_CHANNEL.sizeof_interface_r");
_Static_assert(offsetof(HLI_HEAD_CHANNEL, channel_nr) == 52, "HLI_HEAD_CHANNEL.channel_nr");
_Static_assert(offsetof(HLI_HEAD_CHANNEL, channel_type_r) == 56, "HLI_HEAD_CHANNEL.channel_type_r");
_Static_assert(offsetof(HLI_HEAD_CHANNEL, plc_present_w) == 60, "HLI_HEAD_CHANNEL.plc_present_w");
_Static_assert(offsetof(HLI_HEAD_CHANNEL, init_done_r) == 61, "HLI_HEAD_CHANNEL.init_done_r");
_Static_assert(offsetof(HLI_HEAD_CHANNEL, fill_1) == 62, "HLI_HEAD_CHANNEL.fill_1");
_Static_assert(offsetof(HLI_HEAD_CHANNEL, mc_watchdog) == 64, "HLI_HEAD_CHANNEL.mc_watchdog");
_Static_assert(offsetof(HLI_HEAD_CHANNEL, lc_watchdog) == 72, "HLI_HEAD_CHANNEL.lc_watchdog");
_Static_assert(sizeof(HLI_HEAD_CHANNEL) == 80, "HLI_HEAD_CHANNEL");

typedef struct HLI_HEAD_AXIS {
    uint8_t plc_present_w;
    uint8_t error_r;
    uint8_t reset_error_locked_r;
    uint8_t fill_1;
    uint16_t log_ax_n_r;
    uint16_t axis_type_r;
    uint32_t sizeof_interface_r;
    uint32_t fill_2;
} HLI_HEAD_AXIS;
_Static_assert(offsetof(HLI_HEAD_AXIS, plc_present_w) == 0, "HLI_HEAD_AXIS.plc_present_w");
_Static_assert(offsetof(HLI_HEAD_AXIS, error_r) == 1, "HLI_HEAD_AXIS.error_r");
_Static_assert(offsetof(HLI_HEAD_AXIS, reset_error_locked_r) == 2, "HLI_HEAD_AXIS.reset_error_locked_r");
_Static_assert(offsetof(HLI_HEAD_AXIS, fill_1) == 3, "HLI_HEAD_AXIS.fill_1");
_Static_assert(offsetof(HLI_HEAD_AXIS, log_ax_n_r) == 4, "HLI_HEAD_AXIS.log_ax_n_r");
_Static_assert(offsetof(HLI_HEAD_AXIS, axis_type_r) == 6, "HLI_HEAD_AXIS.axis_type_r");
_Static_assert(offsetof(HLI_HEAD_AXIS, sizeof_interface_r) == 8, "HLI_HEAD_AXIS.sizeof_interface_r");
_Static_assert(offsetof(HLI_HEAD_AXIS, fill_2) == 12, "HLI_HEAD_AXIS.fill_2");
_Static_assert(sizeof(HLI_HEAD_AXIS) == 16, "HLI_HEAD_AXIS");

typedef struct HLI_DECODER_MC_CONTROL {
    MC_CONTROL_UNS32_UNIT program_block_ignore;
    MC_CONTROL_BOOL_UNIT single_block;
    MC_CONTROL_SGN32_UNIT execution_mode;
} HLI_DECODER_MC_CONTROL;
_Static_assert(offsetof(HLI_DECODER_MC_CONTROL, program_block_ignore) == 0, "HLI_DECODER_MC_CONTROL.program_block_ignore");
_Static_assert(offsetof(HLI_DECODER_MC_CONTROL, single_block) == 16, "HLI_DECODER_MC_CONTROL.single_block");
_Static_assert(offsetof(HLI_DECODER_MC_CONTROL, execution_mode) == 24, "HLI_DECODER_MC_CONTROL.execution_mode");
_Static_assert(sizeof(HLI_DECODER_MC_CONTROL) == 40, "HLI_DECODER_MC_CONTROL");

typedef struct HLI_BAHN_MC_CONTROL {
    MC_CONTROL_BOOL_UNIT feedhold;
    MC_CONTROL_UNS16_UNIT override;
    MC_CONTROL_BOOL_UNIT override_valid;
    MC_CONTROL_UNS16_UNIT rapid_override;
    MC_CONTROL_BOOL_UNIT rapid_override_valid;
    MC_CONTROL_BOOL_UNIT single_block;
    MC_CONTROL_BOOL_UNIT continue_machining;
    MC_CONTROL_BOOL_UNIT m01_stop_enable;
    MC_CONTROL_BOOL_UNIT delete_distance_to_go;
    MC_CONTROL_UNS32_UNIT del_dist_to_go_end;
    MC_CONTROL_BOOL_UNIT backward_motion;
    MC_CONTROL_BOOL_UNIT simulate_motion;
    MC_CONTROL_BOOL_UNIT backward_storage_off;
    MC_CONTROL_BOOL_UNIT rt_loop_enable;
    MC_CONTROL_SGN32_UNIT ext_command_speed;
    MC_CONTROL_BOOL_UNIT ext_command_speed_valid;
    MC_CONTROL_INSERT_CMD_UNIT insert_cmd;
} HLI_BAHN_MC_CONTROL;
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, feedhold) == 0, "HLI_BAHN_MC_CONTROL.feedhold");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, override) == 8, "HLI_BAHN_MC_CONTROL.override");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, override_valid) == 16, "HLI_BAHN_MC_CONTROL.override_valid");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, rapid_override) == 24, "HLI_BAHN_MC_CONTROL.rapid_override");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, rapid_override_valid) == 32, "HLI_BAHN_MC_CONTROL.rapid_override_valid");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, single_block) == 40, "HLI_BAHN_MC_CONTROL.single_block");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, continue_machining) == 48, "HLI_BAHN_MC_CONTROL.continue_machining");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, m01_stop_enable) == 56, "HLI_BAHN_MC_CONTROL.m01_stop_enable");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, delete_distance_to_go) == 64, "HLI_BAHN_MC_CONTROL.delete_distance_to_go");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, del_dist_to_go_end) == 72, "HLI_BAHN_MC_CONTROL.del_dist_to_go_end");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, backward_motion) == 88, "HLI_BAHN_MC_CONTROL.backward_motion");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, simulate_motion) == 96, "HLI_BAHN_MC_CONTROL.simulate_motion");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, backward_storage_off) == 104, "HLI_BAHN_MC_CONTROL.backward_storage_off");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, rt_loop_enable) == 112, "HLI_BAHN_MC_CONTROL.rt_loop_enable");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, ext_command_speed) == 120, "HLI_BAHN_MC_CONTROL.ext_command_speed");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, ext_command_speed_valid) == 136, "HLI_BAHN_MC_CONTROL.ext_command_speed_valid");
_Static_assert(offsetof(HLI_BAHN_MC_CONTROL, insert_cmd) == 144, "HLI_BAHN_MC_CONTROL.insert_cmd");
_Static_assert(sizeof(HLI_BAHN_MC_CONTROL) == 312, "HLI_BAHN_MC_CONTROL");

typedef struct HLI_CHANNEL_MC_CONTROL {
    MC_CONTROL_MCM_MODE_STATE_UNIT mode_and_state;
} HLI_CHANNEL_MC_CONTROL;
_Static_assert(offsetof(HLI_CHANNEL_MC_CONTROL, mode_and_state) == 0, "HLI_CHANNEL_MC_CONTROL.mode_and_state");
_Static_assert(sizeof(HLI_CHANNEL_MC_CONTROL) == 680, "HLI_CHANNEL_MC_CONTROL");

typedef struct HLI_DECODER_STATE {
    uint8_t program_end_r;
    uint8_t syntax_check_r;
    uint8_t wait_after_error_r;
    uint8_t fill_1[5];
} HLI_DECODER_STATE;
_Static_assert(offsetof(HLI_DECODER_STATE, program_end_r) == 0, "HLI_DECODER_STATE.program_end_r");
_Static_assert(offsetof(HLI_DECODER_STATE, syntax_check_r) == 1, "HLI_DECODER_STATE.syntax_check_r");
_Static_assert(offsetof(HLI_DECODER_STATE, wait_after_error_r) == 2, "HLI_DECODER_STATE.wait_after_error_r");
_Static_assert(offsetof(HLI_DECODER_STATE, fill_1) == 3, "HLI_DECODER_STATE.fill_1");
_Static_assert(sizeof(HLI_DECODER_STATE) == 8, "HLI_DECODER_STATE");

typedef struct HLI_COORD {
    uint16_t log_axis_nr_r;
    uint16_t fill_1;
    uint16_t axis_type_r;
    uint16_t state_r;
    char name[16];
    int32_t cmd_position_r;
    int32_t act_position_r;
    int32_t current_position_r;
    int32_t acs_position_r;
    int32_t dist_to_geom_end_r;
    int32_t fill_2;
} HLI_COORD;
_Static_assert(offsetof(HLI_COORD, log_axis_nr_r) == 0, "HLI_COORD.log_axis_nr_r");
_Static_assert(offsetof(HLI_COORD, fill_1) == 2, "HLI_COORD.fill_1");
_Static_assert(offsetof(HLI_COORD, axis_type_r) == 4, "HLI_COORD.axis_type_r");
_Static_assert(offsetof(HLI_COORD, state_r) == 6, "HLI_COORD.state_r");
_Static_assert(offsetof(HLI_COORD, name) == 8, "HLI_COORD.name");
_Static_assert(offsetof(HLI_COORD, cmd_position_r) == 24, "HLI_COORD.cmd_position_r");
_Static_assert(offsetof(HLI_COORD, act_position_r) == 28, "HLI_COORD.act_position_r");
_Static_assert(offsetof(HLI_COORD, current_position_r) == 32, "HLI_COORD.current_position_r");
_Static_assert(offsetof(HLI_COORD, acs_position_r) == 36, "HLI_COORD.acs_position_r");
_Static_assert(offsetof(HLI_COORD, dist_to_geom_end_r) == 40, "HLI_COORD.dist_to_geom_end_r");
_Static_assert(offsetof(HLI_COORD, fill_2) == 44, "HLI_COORD.fill_2");
_Static_assert(sizeof(HLI_COORD) == 48, "HLI_COORD");

typedef struct HLI_BAHN_STATE {
    double dist_prog_start;
    double dist_to_go_r;
    double eta_time_r;
    double dist_v_0_r;
    double esa_vb[3];
    int32_t covered_distance_r;
    uint32_t block_count_r;
    uint32_t block_number_r;
    int32_t command_feed_r;
    int32_t active_feed_r;
    uint32_t stop_condition_r;
    uint32_t error_id_r;
    int32_t tool_nr_r;
    int32_t file_offset_r;
    uint16_t override_r;
    int16_t block_search_state_r;
    uint8_t program_end_r;
    uint8_t interpolation_active_r;
    uint8_t axes_in_position_r;
    uint8_t wait_axes_in_position_r;
    uint8_t wait_techno_acknowledge_r;
    uint8_t wait_continue_r;
    uint8_t wait_error_removal_r;
    uint8_t dwell_time_active_r;
    uint8_t speed_limit_detect_r;
    uint8_t block_search_active_r;
    uint8_t delete_distance_to_go_active_r;
    uint8_t feedhold_active_r;
    uint8_t rapid_active_r;
    uint8_t backward_active_r;
    uint8_t error_r;
    uint8_t eta_valid_r;
    uint8_t pos_v_0_valid_r;
    uint8_t esa_data_valid[3];
    uint8_t fill_1[4];
    uint16_t g_function_r[16];
    char prog_name_r[260];
    uint32_t fill_2;
    HLI_COORD coord_r[32];
    int32_t pos_v_0_pcs_r[32];
    int32_t pos_v_0_acs_r[32];
} HLI_BAHN_STATE;
_Static_assert(offsetof(HLI_BAHN_STATE, dist_prog_start) == 0, "HLI_BAHN_STATE.dist_prog_start");
_Static_assert(offsetof(HLI_BAHN_STATE, dist_to_go_r) == 8, "HLI_BAHN_STATE.dist_to_go_r");
_Static_assert(offsetof(HLI_BAHN_STATE, eta_time_r) == 16, "HLI_BAHN_STATE.eta_time_r");
_Static_assert(offsetof(HLI_BAHN_STATE, dist_v_0_r) == 24, "HLI_BAHN_STATE.dist_v_0_r");
_Static_assert(offsetof(HLI_BAHN_STATE, esa_vb) == 32, "HLI_BAHN_STATE.esa_vb");
_Static_assert(offsetof(HLI_BAHN_STATE, covered_distance_r) == 56, "HLI_BAHN_STATE.covered_distance_r");
_Static_assert(offsetof(HLI_BAHN_STATE, block_count_r) == 60, "HLI_BAHN_STATE.block_count_r");
_Static_assert(offsetof(HLI_BAHN_STATE, block_number_r) == 64, "HLI_BAHN_STATE.block_number_r");
_Static_assert(offsetof(HLI_BAHN_STATE, command_feed_r) == 68, "HLI_BAHN_STATE.command_feed_r");
_Static_assert(offsetof(HLI_BAHN_STATE, active_feed_r) == 72, "HLI_BAHN_STATE.active_feed_r");
_Static_assert(offsetof(HLI_BAHN_STATE, stop_condition_r) == 76, "HLI_BAHN_STATE.stop_condition_r");
_Static_assert(offsetof(HLI_BAHN_STATE, error_id_r) == 80, "HLI_BAHN_STATE.error_id_r");
_Static_assert(offsetof(HLI_BAHN_STATE, tool_nr_r) == 84, "HLI_BAHN_STATE.tool_nr_r");
_Static_assert(offsetof(HLI_BAHN_STATE, file_offset_r) == 88, "HLI_BAHN_STATE.file_offset_r");
_Static_assert(offsetof(HLI_BAHN_STATE, override_r) == 92, "HLI_BAHN_STATE.override_r");
_Static_assert(offsetof(HLI_BAHN_STATE, block_search_state_r) == 94, "HLI_BAHN_STATE.block_search_state_r");
_Static_assert(offsetof(HLI_BAHN_STATE, program_end_r) == 96, "HLI_BAHN_STATE.program_end_r");
_Static_assert(offsetof(HLI_BAHN_STATE, interpolation_active_r) == 97, "HLI_BAHN_STATE.interpolation_active_r");
_Static_assert(offsetof(HLI_BAHN_STATE, axes_in_position_r) == 98, "HLI_BAHN_STATE.axes_in_position_r");
_Static_assert(offsetof(HLI_BAHN_STATE, wait_axes_in_position_r) == 99, "HLI_BAHN_STATE.wait_axes_in_position_r");
_Static_assert(offsetof(HLI_BAHN_STATE, wait_techno_acknowledge_r) == 100, "HLI_BAHN_STATE.wait_techno_acknowledge_r");
_Static_assert(offsetof(HLI_BAHN_STATE, wait_continue_r) == 101, "HLI_BAHN_STATE.wait_continue_r");
_Static_assert(offsetof(HLI_BAHN_STATE, wait_error_removal_r) == 102, "HLI_BAHN_STATE.wait_error_removal_r");
_Static_assert(offsetof(HLI_BAHN_STATE, dwell_time_active_r) == 103, "HLI_BAHN_STATE.dwell_time_active_r");
_Static_assert(offsetof(HLI_BAHN_STATE, speed_limit_detect_r) == 104, "HLI_BAHN_STATE.speed_limit_detect_r");
_Static_assert(offsetof(HLI_BAHN_STATE, block_search_active_r) == 105, "HLI_BAHN_STATE.block_search_active_r");
_Static_assert(offsetof(HLI_BAHN_STATE, delete_distance_to_go_active_r) == 106, "HLI_BAHN_STATE.delete_distance_to_go_active_r");
_Static_assert(offsetof(HLI_BAHN_STATE, feedhold_active_r) == 107, "HLI_BAHN_STATE.feedhold_active_r");
_Static_assert(offsetof(HLI_BAHN_STATE, rapid_active_r) == 108, "HLI_BAHN_STATE.rapid_active_r");
_Static_assert(offsetof(HLI_BAHN_STATE, backward_active_r) == 109, "HLI_BAHN_STATE.backward_active_r");
_Static_assert(offsetof(HLI_BAHN_STATE, error_r) == 110, "HLI_BAHN_STATE.error_r");
_Static_assert(offsetof(HLI_BAHN_STATE, eta_valid_r) == 111, "HLI_BAHN_STATE.eta_valid_r");
_Static_assert(offsetof(HLI_BAHN_STATE, pos_v_0_valid_r) == 112, "HLI_BAHN_STATE.pos_v_0_valid_r");
_Static_assert(offsetof(HLI_BAHN_STATE, esa_data_valid) == 113, "HLI_BAHN_STATE.esa_data_valid");
_Static_assert(offsetof(HLI_BAHN_STATE, fill_1) == 116, "HLI_BAHN_STATE.fill_1");
_Static_assert(offsetof(HLI_BAHN_STATE, g_function_r) == 120, "HLI_BAHN_STATE.g_function_r");
_Static_assert(offsetof(HLI_BAHN_STATE, prog_name_r) == 152, "HLI_BAHN_STATE.prog_name_r");
_Static_assert(offsetof(HLI_BAHN_STATE, fill_2) == 412, "HLI_BAHN_STATE.fill_2");
_Static_assert(offsetof(HLI_BAHN_STATE, coord_r) == 416, "HLI_BAHN_STATE.coord_r");
_Static_assert(offsetof(HLI_BAHN_STATE, pos_v_0_pcs_r) == 1952, "HLI_BAHN_STATE.pos_v_0_pcs_r");
_Static_assert(offsetof(HLI_BAHN_STATE, pos_v_0_acs_r) == 2080, "HLI_BAHN_STATE.pos_v_0_acs_r");
_Static_assert(sizeof(HLI_BAHN_STATE) == 2208, "HLI_BAHN_STATE");

typedef struct HLI_ATTRIBUT {
    uint8_t data[40];
} HLI_ATTRIBUT;
_Static_assert(offsetof(HLI_ATTRIBUT, data) == 0, "HLI_ATTRIBUT.data");
_Static_assert(sizeof(HLI_ATTRIBUT) == 40, "HLI_ATTRIBUT");

typedef struct TECHNO_UNIT_CH {
    uint8_t please_rw;
    uint8_t done_w;
    uint16_t fkt_ctrl_r;
    uint32_t fill_1;
    HLI_ATTRIBUT attribut_r;
} TECHNO_UNIT_CH;
_Static_assert(offsetof(TECHNO_UNIT_CH, please_rw) == 0, "TECHNO_UNIT_CH.please_rw");
_Static_assert(offsetof(TECHNO_UNIT_CH, done_w) == 1, "TECHNO_UNIT_CH.done_w");
_Static_assert(offsetof(TECHNO_UNIT_CH, fkt_ctrl_r) == 2, "TECHNO_UNIT_CH.fkt_ctrl_r");
_Static_assert(offsetof(TECHNO_UNIT_CH, fill_1) == 4, "TECHNO_UNIT_CH.fill_1");
_Static_assert(offsetof(TECHNO_UNIT_CH, attribut_r) == 8, "TECHNO_UNIT_CH.attribut_r");
_Static_assert(sizeof(TECHNO_UNIT_CH) == 48, "TECHNO_UNIT_CH");

typedef struct TECHNO_UNIT_AX {
    uint8_t please_rw;
    uint8_t done_w;
    uint16_t fkt_ctrl_r;
    uint32_t fill_1;
    HLI_ATTRIBUT attribut_r;
} TECHNO_UNIT_AX;
_Static_assert(offsetof(TECHNO_UNIT_AX, please_rw) == 0, "TECHNO_UNIT_AX.please_rw");
_Static_assert(offsetof(TECHNO_UNIT_AX, done_w) == 1, "TECHNO_UNIT_AX.done_w");
_Static_assert(offsetof(TECHNO_UNIT_AX, fkt_ctrl_r) == 2, "TECHNO_UNIT_AX.fkt_ctrl_r");
_Static_assert(offsetof(TECHNO_UNIT_AX, fill_1) == 4, "TECHNO_UNIT_AX.fill_1");
_Static_assert(offsetof(TECHNO_UNIT_AX, attribut_r) == 8, "TECHNO_UNIT_AX.attribut_r");
_Static_assert(sizeof(TECHNO_UNIT_AX) == 48, "TECHNO_UNIT_AX");

typedef struct HLI_M_H_PROZESS {
    uint32_t nr;
    int32_t zeit;
    uint32_t satz_nr;
    uint32_t zeilen_nr;
    int32_t add_value;
    uint16_t nr_late_sync;
    uint16_t fill_1;
    uint32_t synch_mode;
    uint32_t fill_2;
} HLI_M_H_PROZESS;
_Static_assert(offsetof(HLI_M_H_PROZESS, nr) == 0, "HLI_M_H_PROZESS.nr");
_Static_assert(offsetof(HLI_M_H_PROZESS, zeit) == 4, "HLI_M_H_PROZESS.zeit");
_Static_assert(offsetof(HLI_M_H_PROZESS, satz_nr) == 8, "HLI_M_H_PROZESS.satz_nr");
_Static_assert(offsetof(HLI_M_H_PROZESS, zeilen_nr) == 12, "HLI_M_H_PROZESS.zeilen_nr");
_Static_assert(offsetof(HLI_M_H_PROZESS, add_value) == 16, "HLI_M_H_PROZESS.add_value");
_Static_assert(offsetof(HLI_M_H_PROZESS, nr_late_sync) == 20, "HLI_M_H_PROZESS.nr_late_sync");
_Static_assert(offsetof(HLI_M_H_PROZESS, fill_1) == 22, "HLI_M_H_PROZESS.fill_1");
_Static_assert(offsetof(HLI_M_H_PROZESS, synch_mode) == 24, "HLI_M_H_PROZESS.synch_mode");
_Static_assert(offsetof(HLI_M_H_PROZESS, fill_2) == 28, "HLI_M_H_PROZESS.fill_2");
_Static_assert(sizeof(HLI_M_H_PROZESS) == 32, "HLI_M_H_PROZESS");

typedef struct HLI_S_PROZESS {
    int32_t pos;
    int32_t rev;
    uint32_t zeit;
    uint16_t move_cmd;
    uint16_t pos_cmd;
    uint16_t axis_nr;
    uint16_t nr_late_sync;
    uint32_t synch_mode;
    uint32_t satz_nr;
    uint32_t zeilen_nr;
    uint32_t fill_1[2];
} HLI_S_PROZESS;
_Static_assert(offsetof(HLI_S_PROZESS, pos) == 0, "HLI_S_PROZESS.pos");
_Static_assert(offsetof(HLI_S_PROZESS, rev) == 4, "HLI_S_PROZESS.rev");
_Static_assert(offsetof(HLI_S_PROZESS, zeit) == 8, "HLI_S_PROZESS.zeit");
_Static_assert(offsetof(HLI_S_PROZESS, move_cmd) == 12, "HLI_S_PROZESS.move_cmd");
_Static_assert(offsetof(HLI_S_PROZESS, pos_cmd) == 14, "HLI_S_PROZESS.pos_cmd");
_Static_assert(offsetof(HLI_S_PROZESS, axis_nr) == 16, "HLI_S_PROZESS.axis_nr");
_Static_assert(offsetof(HLI_S_PROZESS, nr_late_sync) == 18, "HLI_S_PROZESS.nr_late_sync");
_Static_assert(offsetof(HLI_S_PROZESS, synch_mode) == 20, "HLI_S_PROZESS.synch_mode");
_Static_assert(offsetof(HLI_S_PROZESS, satz_nr) == 24, "HLI_S_PROZESS.satz_nr");
_Static_assert(offsetof(HLI_S_PROZESS, zeilen_nr) == 28, "HLI_S_PROZESS.zeilen_nr");
_Static_assert(offsetof(HLI_S_PROZESS, fill_1) == 32, "HLI_S_PROZESS.fill_1");
_Static_assert(sizeof(HLI_S_PROZESS) == 40, "HLI_S_PROZESS");

typedef struct HLI_TOOL_ID {
    int32_t basic;
    int32_t sister;
    int32_t variant;
    uint8_t sister_valid;
    uint8_t variant_valid;
    uint8_t fill_1[2];
} HLI_TOOL_ID;
_Static_assert(offsetof(HLI_TOOL_ID, basic) == 0, "HLI_TOOL_ID.basic");
_Static_assert(offsetof(HLI_TOOL_ID, sister) == 4, "HLI_TOOL_ID.sister");
_Static_assert(offsetof(HLI_TOOL_ID, variant) == 8, "HLI_TOOL_ID.variant");
_Static_assert(offsetof(HLI_TOOL_ID, sister_valid) == 12, "HLI_TOOL_ID.sister_valid");
_Static_assert(offsetof(HLI_TOOL_ID, variant_valid) == 13, "HLI_TOOL_ID.variant_valid");
_Static_assert(offsetof(HLI_TOOL_ID, fill_1) == 14, "HLI_TOOL_ID.fill_1");
_Static_assert(sizeof(HLI_TOOL_ID) == 16, "HLI_TOOL_ID");

typedef struct HLI_T_PROZESS {
    HLI_TOOL_ID id;
    uint32_t add_info_r[4];
    uint16_t nr_late_sync;
    uint16_t fill_1;
    uint32_t synch_mode;
} HLI_T_PROZESS;
_Static_assert(offsetof(HLI_T_PROZESS, id) == 0, "HLI_T_PROZESS.id");
_Static_assert(offsetof(HLI_T_PROZESS, add_info_r) == 16, "HLI_T_PROZESS.add_info_r");
_Static_assert(offsetof(HLI_T_PROZESS, nr_late_sync) == 32, "HLI_T_PROZESS.nr_late_sync");
_Static_assert(offsetof(HLI_T_PROZESS, fill_1) == 34, "HLI_T_PROZESS.fill_1");
_Static_assert(offsetof(HLI_T_PROZESS, synch_mode) == 36, "HLI_T_PROZESS.synch_mode");
_Static_assert(sizeof(HLI_T_PROZESS) == 40, "HLI_T_PROZESS");

typedef struct HLI_MODUL_NAME {
    char zeichen[16];
} HLI_MODUL_NAME;
_Static_assert(offsetof(HLI_MODUL_NAME, zeichen) == 0, "HLI_MODUL_NAME.zeichen");
_Static_assert(sizeof(HLI_MODUL_NAME) == 16, "HLI_MODUL_NAME");

typedef struct HLI_ERROR_KOPF {
    uint32_t error_id;
    uint32_t fill_1;
    HLI_MODUL_NAME modul_name;
    int32_t line;
    uint32_t util_error_id;
    HLI_MODUL_NAME util_modul_name;
    int32_t util_line;
    uint16_t multiple_id;
    uint16_t function_type;
    uint16_t channel;
    uint16_t sender;
    uint16_t suppress;
    uint16_t fill_2;
    uint32_t date;
    uint32_t cycle;
    HLI_INTF_VERSION version;
    uint16_t recovery_class;
    uint16_t reaction_class;
    uint32_t body_type;
} HLI_ERROR_KOPF;
_Static_assert(offsetof(HLI_ERROR_KOPF, error_id) == 0, "HLI_ERROR_KOPF.error_id");
_Static_assert(offsetof(HLI_ERROR_KOPF, fill_1) == 4, "HLI_ERROR_KOPF.fill_1");
_Static_assert(offsetof(HLI_ERROR_KOPF, modul_name) == 8, "HLI_ERROR_KOPF.modul_name");
_Static_assert(offsetof(HLI_ERROR_KOPF, line) == 24, "HLI_ERROR_KOPF.line");
_Static_assert(offsetof(HLI_ERROR_KOPF, util_error_id) == 28, "HLI_ERROR_KOPF.util_error_id");
_Static_assert(offsetof(HLI_ERROR_KOPF, util_modul_name) == 32, "HLI_ERROR_KOPF.util_modul_name");
_Static_assert(offsetof(HLI_ERROR_KOPF, util_line) == 48, "HLI_ERROR_KOPF.util_line");
_Static_assert(offsetof(HLI_ERROR_KOPF, multiple_id) == 52, "HLI_ERROR_KOPF.multiple_id");
_Static_assert(offsetof(HLI_ERROR_KOPF, function_type) == 54, "HLI_ERROR_KOPF.function_type");
_Static_assert(offsetof(HLI_ERROR_KOPF, channel) == 56, "HLI_ERROR_KOPF.channel");
_Static_assert(offsetof(HLI_ERROR_KOPF, sender) == 58, "HLI_ERROR_KOPF.sender");
_Static_assert(offsetof(HLI_ERROR_KOPF, suppress) == 60, "HLI_ERROR_KOPF.suppress");
_Static_assert(offsetof(HLI_ERROR_KOPF, fill_2) == 62, "HLI_ERROR_KOPF.fill_2");
_Static_assert(offsetof(HLI_ERROR_KOPF, date) == 64, "HLI_ERROR_KOPF.date");
_Static_assert(offsetof(HLI_ERROR_KOPF, cycle) == 68, "HLI_ERROR_KOPF.cycle");
_Static_assert(offsetof(HLI_ERROR_KOPF, version) == 72, "HLI_ERROR_KOPF.version");
_Static_assert(offsetof(HLI_ERROR_KOPF, recovery_class) == 96, "HLI_ERROR_KOPF.recovery_class");
_Static_assert(offsetof(HLI_ERROR_KOPF, reaction_class) == 98, "HLI_ERROR_KOPF.reaction_class");
_Static_assert(offsetof(HLI_ERROR_KOPF, body_type) == 100, "HLI_ERROR_KOPF.body_type");
_Static_assert(sizeof(HLI_ERROR_KOPF) == 104, "HLI_ERROR_KOPF");

typedef struct HLI_ERROR_MASKE {
    uint8_t err_mask[584];
} HLI_ERROR_MASKE;
_Static_assert(offsetof(HLI_ERROR_MASKE, err_mask) == 0, "HLI_ERROR_MASKE.err_mask");
_Static_assert(sizeof(HLI_ERROR_MASKE) == 584, "HLI_ERROR_MASKE");

typedef struct HLI_ERROR_RUMPF {
    HLI_ERROR_MASKE maske;
    uint8_t value[5][40];
    uint8_t identifier[4][16];
} HLI_ERROR_RUMPF;
_Static_assert(offsetof(HLI_ERROR_RUMPF, maske) == 0, "HLI_ERROR_RUMPF.maske");
_Static_assert(offsetof(HLI_ERROR_RUMPF, value) == 584, "HLI_ERROR_RUMPF.value");
_Static_assert(offsetof(HLI_ERROR_RUMPF, identifier) == 784, "HLI_ERROR_RUMPF.identifier");
_Static_assert(sizeof(HLI_ERROR_RUMPF) == 848, "HLI_ERROR_RUMPF");

typedef struct HLI_RUMPF_NC_PROG {
    uint32_t log_pfad_nr;
    uint32_t fill_1;
    char prog_name[264];
    char file_name[260];
    int32_t fileoffset;
    uint16_t satzoffset;
    uint16_t tokenoffset;
    uint32_t satz_nr;
} HLI_RUMPF_NC_PROG;
_Static_assert(offsetof(HLI_RUMPF_NC_PROG, log_pfad_nr) == 0, "HLI_RUMPF_NC_PROG.log_pfad_nr");
_Static_assert(offsetof(HLI_RUMPF_NC_PROG, fill_1) == 4, "HLI_RUMPF_NC_PROG.fill_1");
_Static_assert(offsetof(HLI_RUMPF_NC_PROG, prog_name) == 8, "HLI_RUMPF_NC_PROG.prog_name");
_Static_assert(offsetof(HLI_RUMPF_NC_PROG, file_name) == 272, "HLI_RUMPF_NC_PROG.file_name");
_Static_assert(offsetof(HLI_RUMPF_NC_PROG, fileoffset) == 532, "HLI_RUMPF_NC_PROG.fileoffset");
_Static_assert(offsetof(HLI_RUMPF_NC_PROG, satzoffset) == 536, "HLI_RUMPF_NC_PROG.satzoffset");
_Static_assert(offsetof(HLI_RUMPF_NC_PROG, tokenoffset) == 538, "HLI_RUMPF_NC_PROG.tokenoffset");
_Static_assert(offsetof(HLI_RUMPF_NC_PROG, satz_nr) == 540, "HLI_RUMPF_NC_PROG.satz_nr");
_Static_assert(sizeof(HLI_RUMPF_NC_PROG) == 544, "HLI_RUMPF_NC_PROG");

typedef struct HLI_ERROR_SATZ {
    HLI_ERROR_KOPF kopf;
    HLI_ERROR_RUMPF rumpf;
} HLI_ERROR_SATZ;
_Static_assert(offsetof(HLI_ERROR_SATZ, kopf) == 0, "HLI_ERROR_SATZ.kopf");
_Static_assert(offsetof(HLI_ERROR_SATZ, rumpf) == 104, "HLI_ERROR_SATZ.rumpf");
_Static_assert(sizeof(HLI_ERROR_SATZ) == 952, "HLI_ERROR_SATZ");

typedef struct MC_ERROR {
    HLI_ERROR_SATZ satz_r;
    uint8_t semaphor_rw;
    uint8_t enable_w;
    uint8_t fill_1[6];
} MC_ERROR;
_Static_assert(offsetof(MC_ERROR, satz_r) == 0, "MC_ERROR.satz_r");
_Static_assert(offsetof(MC_ERROR, semaphor_rw) == 952, "MC_ERROR.semaphor_rw");
_Static_assert(offsetof(MC_ERROR, enable_w) == 953, "MC_ERROR.enable_w");
_Static_assert(offsetof(MC_ERROR, fill_1) == 954, "MC_ERROR.fill_1");
_Static_assert(sizeof(MC_ERROR) == 960, "MC_ERROR");

typedef struct HLI_CONTOUR_LOOKAHEAD_BLOCK {
    uint32_t block_type;
    uint32_t block_number;
    uint32_t block_count_r;
    uint32_t fill_1;
    double start_position;
    double length;
    double programmed_radius;
    double compensated_radius;
    double circle_angle;
    double length_min;
    double tangent_variation;
} HLI_CONTOUR_LOOKAHEAD_BLOCK;
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_BLOCK, block_type) == 0, "HLI_CONTOUR_LOOKAHEAD_BLOCK.block_type");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_BLOCK, block_number) == 4, "HLI_CONTOUR_LOOKAHEAD_BLOCK.block_number");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_BLOCK, block_count_r) == 8, "HLI_CONTOUR_LOOKAHEAD_BLOCK.block_count_r");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_BLOCK, fill_1) == 12, "HLI_CONTOUR_LOOKAHEAD_BLOCK.fill_1");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_BLOCK, start_position) == 16, "HLI_CONTOUR_LOOKAHEAD_BLOCK.start_position");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_BLOCK, length) == 24, "HLI_CONTOUR_LOOKAHEAD_BLOCK.length");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_BLOCK, programmed_radius) == 32, "HLI_CONTOUR_LOOKAHEAD_BLOCK.programmed_radius");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_BLOCK, compensated_radius) == 40, "HLI_CONTOUR_LOOKAHEAD_BLOCK.compensated_radius");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_BLOCK, circle_angle) == 48, "HLI_CONTOUR_LOOKAHEAD_BLOCK.circle_angle");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_BLOCK, length_min) == 56, "HLI_CONTOUR_LOOKAHEAD_BLOCK.length_min");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_BLOCK, tangent_variation) == 64, "HLI_CONTOUR_LOOKAHEAD_BLOCK.tangent_variation");
_Static_assert(sizeof(HLI_CONTOUR_LOOKAHEAD_BLOCK) == 72, "HLI_CONTOUR_LOOKAHEAD_BLOCK");

typedef struct HLI_CONTOUR_LOOKAHEAD_REQUEST {
    double start_position;
    double length;
} HLI_CONTOUR_LOOKAHEAD_REQUEST;
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_REQUEST, start_position) == 0, "HLI_CONTOUR_LOOKAHEAD_REQUEST.start_position");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_REQUEST, length) == 8, "HLI_CONTOUR_LOOKAHEAD_REQUEST.length");
_Static_assert(sizeof(HLI_CONTOUR_LOOKAHEAD_REQUEST) == 16, "HLI_CONTOUR_LOOKAHEAD_REQUEST");

typedef struct HLI_CONTOUR_LOOKAHEAD_RESPONSE {
    HLI_CONTOUR_LOOKAHEAD_BLOCK block[128];
} HLI_CONTOUR_LOOKAHEAD_RESPONSE;
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_RESPONSE, block) == 0, "HLI_CONTOUR_LOOKAHEAD_RESPONSE.block");
_Static_assert(sizeof(HLI_CONTOUR_LOOKAHEAD_RESPONSE) == 9216, "HLI_CONTOUR_LOOKAHEAD_RESPONSE");

typedef struct HLI_CONTOUR_LOOKAHEAD_STATE {
    double max_dist_prog_start;
    uint32_t count_logged_blocks;
    uint8_t f_log_is_active;
    uint8_t fill_1[3];
} HLI_CONTOUR_LOOKAHEAD_STATE;
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_STATE, max_dist_prog_start) == 0, "HLI_CONTOUR_LOOKAHEAD_STATE.max_dist_prog_start");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_STATE, count_logged_blocks) == 8, "HLI_CONTOUR_LOOKAHEAD_STATE.count_logged_blocks");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_STATE, f_log_is_active) == 12, "HLI_CONTOUR_LOOKAHEAD_STATE.f_log_is_active");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD_STATE, fill_1) == 13, "HLI_CONTOUR_LOOKAHEAD_STATE.fill_1");
_Static_assert(sizeof(HLI_CONTOUR_LOOKAHEAD_STATE) == 16, "HLI_CONTOUR_LOOKAHEAD_STATE");

typedef struct HLI_CONTOUR_LOOKAHEAD {
    HLI_CONTOUR_LOOKAHEAD_REQUEST request;
    uint8_t semaphor_rw;
    uint8_t fill_1[47];
    HLI_CONTOUR_LOOKAHEAD_RESPONSE response;
    HLI_CONTOUR_LOOKAHEAD_STATE state;
    uint8_t fill_2[48];
} HLI_CONTOUR_LOOKAHEAD;
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD, request) == 0, "HLI_CONTOUR_LOOKAHEAD.request");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD, semaphor_rw) == 16, "HLI_CONTOUR_LOOKAHEAD.semaphor_rw");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD, fill_1) == 17, "HLI_CONTOUR_LOOKAHEAD.fill_1");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD, response) == 64, "HLI_CONTOUR_LOOKAHEAD.response");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD, state) == 9280, "HLI_CONTOUR_LOOKAHEAD.state");
_Static_assert(offsetof(HLI_CONTOUR_LOOKAHEAD, fill_2) == 9296, "HLI_CONTOUR_LOOKAHEAD.fill_2");
_Static_assert(sizeof(HLI_CONTOUR_LOOKAHEAD) == 9344, "HLI_CONTOUR_LOOKAHEAD");

typedef struct HLI_CHANNEL {
    HLI_HEAD_CHANNEL head;
    HLI_DECODER_MC_CONTROL decoder_mc_control;
    HLI_BAHN_MC_CONTROL bahn_mc_control;
    HLI_CHANNEL_MC_CONTROL channel_mc_control;
    HLI_DECODER_STATE decoder_state;
    HLI_BAHN_STATE bahn_state;
    uint16_t used_units_std_sync_r;
    uint16_t used_units_late_sync_r;
    uint32_t fill_1;
    TECHNO_UNIT_CH techno_unit_std_sync[20];
    TECHNO_UNIT_CH techno_unit_late_sync[20];
    MC_ERROR mc_error;
    MC_ERROR lc_error;
    uint8_t fill_2[56];
    HLI_CONTOUR_LOOKAHEAD contour_lookahead;
} HLI_CHANNEL;
_Static_assert(offsetof(HLI_CHANNEL, head) == 0, "HLI_CHANNEL.head");
_Static_assert(offsetof(HLI_CHANNEL, decoder_mc_control) == 80, "HLI_CHANNEL.decoder_mc_control");
_Static_assert(offsetof(HLI_CHANNEL, bahn_mc_control) == 120, "HLI_CHANNEL.bahn_mc_control");
_Static_assert(offsetof(HLI_CHANNEL, channel_mc_control) == 432, "HLI_CHANNEL.channel_mc_control");
_Static_assert(offsetof(HLI_CHANNEL, decoder_state) == 1112, "HLI_CHANNEL.decoder_state");
_Static_assert(offsetof(HLI_CHANNEL, bahn_state) == 1120, "HLI_CHANNEL.bahn_state");
_Static_assert(offsetof(HLI_CHANNEL, used_units_std_sync_r) == 3328, "HLI_CHANNEL.used_units_std_sync_r");
_Static_assert(offsetof(HLI_CHANNEL, used_units_late_sync_r) == 3330, "HLI_CHANNEL.used_units_late_sync_r");
_Static_assert(offsetof(HLI_CHANNEL, fill_1) == 3332, "HLI_CHANNEL.fill_1");
_Static_assert(offsetof(HLI_CHANNEL, techno_unit_std_sync) == 3336, "HLI_CHANNEL.techno_unit_std_sync");
_Static_assert(offsetof(HLI_CHANNEL, techno_unit_late_sync) == 4296, "HLI_CHANNEL.techno_unit_late_sync");
_Static_assert(offsetof(HLI_CHANNEL, mc_error) == 5256, "HLI_CHANNEL.mc_error");
_Static_assert(offsetof(HLI_CHANNEL, lc_error) == 6216, "HLI_CHANNEL.lc_error");
_Static_assert(offsetof(HLI_CHANNEL, fill_2) == 7176, "HLI_CHANNEL.fill_2");
_Static_assert(offsetof(HLI_CHANNEL, contour_lookahead) == 7232, "HLI_CHANNEL.contour_lookahead");
_Static_assert(sizeof(HLI_CHANNEL) == 16576, "HLI_CHANNEL");

typedef struct HLI_IPO_MC_CONTROL {
    MC_CONTROL_BOOL_UNIT feedhold;
    MC_CONTROL_UNS16_UNIT override;
    MC_CONTROL_BOOL_UNIT override_valid;
} HLI_IPO_MC_CONTROL;
_Static_assert(offsetof(HLI_IPO_MC_CONTROL, feedhold) == 0, "HLI_IPO_MC_CONTROL.feedhold");
_Static_assert(offsetof(HLI_IPO_MC_CONTROL, override) == 8, "HLI_IPO_MC_CONTROL.override");
_Static_assert(offsetof(HLI_IPO_MC_CONTROL, override_valid) == 16, "HLI_IPO_MC_CONTROL.override_valid");
_Static_assert(sizeof(HLI_IPO_MC_CONTROL) == 24, "HLI_IPO_MC_CONTROL");

typedef struct HLI_LR_MC_CONTROL {
    MC_CONTROL_BOOL_UNIT release_feedhold;
    MC_CONTROL_BOOL_UNIT drive_on;
    MC_CONTROL_BOOL_UNIT torque_permission;
} HLI_LR_MC_CONTROL;
_Static_assert(offsetof(HLI_LR_MC_CONTROL, release_feedhold) == 0, "HLI_LR_MC_CONTROL.release_feedhold");
_Static_assert(offsetof(HLI_LR_MC_CONTROL, drive_on) == 8, "HLI_LR_MC_CONTROL.drive_on");
_Static_assert(offsetof(HLI_LR_MC_CONTROL, torque_permission) == 16, "HLI_LR_MC_CONTROL.torque_permission");
_Static_assert(sizeof(HLI_LR_MC_CONTROL) == 24, "HLI_LR_MC_CONTROL");

typedef struct HLI_LR_STATE {
    int32_t end_position_acs_r;
    int32_t active_position_acs_r;
    int32_t current_position_acs_r;
    int32_t position_offset_r;
    uint16_t axis_state_r;
    uint16_t fill_1;
    uint32_t fill_2;
} HLI_LR_STATE;
_Static_assert(offsetof(HLI_LR_STATE, end_position_acs_r) == 0, "HLI_LR_STATE.end_position_acs_r");
_Static_assert(offsetof(HLI_LR_STATE, active_position_acs_r) == 4, "HLI_LR_STATE.active_position_acs_r");
_Static_assert(offsetof(HLI_LR_STATE, current_position_acs_r) == 8, "HLI_LR_STATE.current_position_acs_r");
_Static_assert(offsetof(HLI_LR_STATE, position_offset_r) == 12, "HLI_LR_STATE.position_offset_r");
_Static_assert(offsetof(HLI_LR_STATE, axis_state_r) == 16, "HLI_LR_STATE.axis_state_r");
_Static_assert(offsetof(HLI_LR_STATE, fill_1) == 18, "HLI_LR_STATE.fill_1");
_Static_assert(offsetof(HLI_LR_STATE, fill_2) == 20, "HLI_LR_STATE.fill_2");
_Static_assert(sizeof(HLI_LR_STATE) == 24, "HLI_LR_STATE");

typedef struct HLI_AXIS {
    HLI_HEAD_AXIS head;
    HLI_IPO_MC_CONTROL ipo_mc_control;
    HLI_LR_MC_CONTROL lr_mc_control;
    HLI_LR_STATE lr_state;
    uint16_t used_units_std_sync_r;
    uint16_t used_units_late_sync_r;
    uint32_t fill_1;
    TECHNO_UNIT_AX techno_unit_std_sync[8];
    TECHNO_UNIT_AX techno_unit_late_sync[8];
} HLI_AXIS;
_Static_assert(offsetof(HLI_AXIS, head) == 0, "HLI_AXIS.head");
_Static_assert(offsetof(HLI_AXIS, ipo_mc_control) == 16, "HLI_AXIS.ipo_mc_control");
_Static_assert(offsetof(HLI_AXIS, lr_mc_control) == 40, "HLI_AXIS.lr_mc_control");
_Static_assert(offsetof(HLI_AXIS, lr_state) == 64, "HLI_AXIS.lr_state");
_Static_assert(offsetof(HLI_AXIS, used_units_std_sync_r) == 88, "HLI_AXIS.used_units_std_sync_r");
_Static_assert(offsetof(HLI_AXIS, used_units_late_sync_r) == 90, "HLI_AXIS.used_units_late_sync_r");
_Static_assert(offsetof(HLI_AXIS, fill_1) == 92, "HLI_AXIS.fill_1");
_Static_assert(offsetof(HLI_AXIS, techno_unit_std_sync) == 96, "HLI_AXIS.techno_unit_std_sync");
_Static_assert(offsetof(HLI_AXIS, techno_unit_late_sync) == 480, "HLI_AXIS.techno_unit_late_sync");
_Static_assert(sizeof(HLI_AXIS) == 864, "HLI_AXIS");

typedef struct HLI_NC_CONFIG {
    HLI_INTF_VERSION hli_version_w;
    HLI_INTF_VERSION hli_version_r;
    HLI_INTF_VERSION nc_kernel_version_r;
} HLI_NC_CONFIG;
_Static_assert(offsetof(HLI_NC_CONFIG, hli_version_w) == 0, "HLI_NC_CONFIG.hli_version_w");
_Static_assert(offsetof(HLI_NC_CONFIG, hli_version_r) == 24, "HLI_NC_CONFIG.hli_version_r");
_Static_assert(offsetof(HLI_NC_CONFIG, nc_kernel_version_r) == 48, "HLI_NC_CONFIG.nc_kernel_version_r");
_Static_assert(sizeof(HLI_NC_CONFIG) == 72, "HLI_NC_CONFIG");

typedef struct HLI_PLATFORM {
    uint8_t plc_present_w;
    uint8_t fill_1[7];
    HLI_NC_CONFIG nc_config;
    uint32_t channel_count_r;
    uint32_t axis_count_r;
    uint32_t customer_val_r[8];
    uint8_t fill_2[8];
} HLI_PLATFORM;
_Static_assert(offsetof(HLI_PLATFORM, plc_present_w) == 0, "HLI_PLATFORM.plc_present_w");
_Static_assert(offsetof(HLI_PLATFORM, fill_1) == 1, "HLI_PLATFORM.fill_1");
_Static_assert(offsetof(HLI_PLATFORM, nc_config) == 8, "HLI_PLATFORM.nc_config");
_Static_assert(offsetof(HLI_PLATFORM, channel_count_r) == 80, "HLI_PLATFORM.channel_count_r");
_Static_assert(offsetof(HLI_PLATFORM, axis_count_r) == 84, "HLI_PLATFORM.axis_count_r");
_Static_assert(offsetof(HLI_PLATFORM, customer_val_r) == 88, "HLI_PLATFORM.customer_val_r");
_Static_assert(offsetof(HLI_PLATFORM, fill_2) == 120, "HLI_PLATFORM.fill_2");
_Static_assert(sizeof(HLI_PLATFORM) == 128, "HLI_PLATFORM");

typedef struct HLI_EXT_VAR {
    uint32_t value[6000];
} HLI_EXT_VAR;
_Static_assert(offsetof(HLI_EXT_VAR, value) == 0, "HLI_EXT_VAR.value");
_Static_assert(sizeof(HLI_EXT_VAR) == 24000, "HLI_EXT_VAR");

typedef struct HLI_SEGMENT_HEAD {
    uint64_t magic;
    uint32_t abi_version;
    uint32_t channel_count;
    uint32_t axis_count;
    uint32_t ready;
    uint64_t segment_size;
    int64_t owner_pid;
    uint64_t owner_start;
    uint8_t layout_hash[32];
    uint8_t fill_1[176];
} HLI_SEGMENT_HEAD;
_Static_assert(offsetof(HLI_SEGMENT_HEAD, magic) == 0, "HLI_SEGMENT_HEAD.magic");
_Static_assert(offsetof(HLI_SEGMENT_HEAD, abi_version) == 8, "HLI_SEGMENT_HEAD.abi_version");
_Static_assert(offsetof(HLI_SEGMENT_HEAD, channel_count) == 12, "HLI_SEGMENT_HEAD.channel_count");
_Static_assert(offsetof(HLI_SEGMENT_HEAD, axis_count) == 16, "HLI_SEGMENT_HEAD.axis_count");
_Static_assert(offsetof(HLI_SEGMENT_HEAD, ready) == 20, "HLI_SEGMENT_HEAD.ready");
_Static_assert(offsetof(HLI_SEGMENT_HEAD, segment_size) == 24, "HLI_SEGMENT_HEAD.segment_size");
_Static_assert(offsetof(HLI_SEGMENT_HEAD, owner_pid) == 32, "HLI_SEGMENT_HEAD.owner_pid");
_Static_assert(offsetof(HLI_SEGMENT_HEAD, owner_start) == 40, "HLI_SEGMENT_HEAD.owner_start");
_Static_assert(offsetof(HLI_SEGMENT_HEAD, layout_hash) == 48, "HLI_SEGMENT_HEAD.layout_hash");
_Static_assert(offsetof(HLI_SEGMENT_HEAD, fill_1) == 80, "HLI_SEGMENT_HEAD.fill_1");
_Static_assert(sizeof(HLI_SEGMENT_HEAD) == 256, "HLI_SEGMENT_HEAD");

typedef struct HLI_SIDE_CNC {
    int64_t pid;
    uint64_t start;
    uint64_t cycle;
    uint64_t cell_time_ns;
    uint32_t cycle_ns;
    uint32_t clock;
    uint32_t service;
    uint32_t generation;
    uint32_t phase;
    uint8_t fill_1[12];
} HLI_SIDE_CNC;
_Static_assert(offsetof(HLI_SIDE_CNC, pid) == 0, "HLI_SIDE_CNC.pid");
_Static_assert(offsetof(HLI_SIDE_CNC, start) == 8, "HLI_SIDE_CNC.start");
_Static_assert(offsetof(HLI_SIDE_CNC, cycle) == 16, "HLI_SIDE_CNC.cycle");
_Static_assert(offsetof(HLI_SIDE_CNC, cell_time_ns) == 24, "HLI_SIDE_CNC.cell_time_ns");
_Static_assert(offsetof(HLI_SIDE_CNC, cycle_ns) == 32, "HLI_SIDE_CNC.cycle_ns");
_Static_assert(offsetof(HLI_SIDE_CNC, clock) == 36, "HLI_SIDE_CNC.clock");
_Static_assert(offsetof(HLI_SIDE_CNC, service) == 40, "HLI_SIDE_CNC.service");
_Static_assert(offsetof(HLI_SIDE_CNC, generation) == 44, "HLI_SIDE_CNC.generation");
_Static_assert(offsetof(HLI_SIDE_CNC, phase) == 48, "HLI_SIDE_CNC.phase");
_Static_assert(offsetof(HLI_SIDE_CNC, fill_1) == 52, "HLI_SIDE_CNC.fill_1");
_Static_assert(sizeof(HLI_SIDE_CNC) == 64, "HLI_SIDE_CNC");

typedef struct HLI_SIDE_PLC {
    int64_t pid;
    uint64_t start;
    uint64_t heartbeat;
    uint32_t generation;
    uint32_t attached;
    uint32_t finished;
    uint32_t scans_due;
    uint64_t scans;
    uint8_t fill_1[16];
} HLI_SIDE_PLC;
_Static_assert(offsetof(HLI_SIDE_PLC, pid) == 0, "HLI_SIDE_PLC.pid");
_Static_assert(offsetof(HLI_SIDE_PLC, start) == 8, "HLI_SIDE_PLC.start");
_Static_assert(offsetof(HLI_SIDE_PLC, heartbeat) == 16, "HLI_SIDE_PLC.heartbeat");
_Static_assert(offsetof(HLI_SIDE_PLC, generation) == 24, "HLI_SIDE_PLC.generation");
_Static_assert(offsetof(HLI_SIDE_PLC, attached) == 28, "HLI_SIDE_PLC.attached");
_Static_assert(offsetof(HLI_SIDE_PLC, finished) == 32, "HLI_SIDE_PLC.finished");
_Static_assert(offsetof(HLI_SIDE_PLC, scans_due) == 36, "HLI_SIDE_PLC.scans_due");
_Static_assert(offsetof(HLI_SIDE_PLC, scans) == 40, "HLI_SIDE_PLC.scans");
_Static_assert(offsetof(HLI_SIDE_PLC, fill_1) == 48, "HLI_SIDE_PLC.fill_1");
_Static_assert(sizeof(HLI_SIDE_PLC) == 64, "HLI_SIDE_PLC");

typedef struct HLI_SIDE_WORD {
    uint32_t word;
    uint32_t waiters;
    uint8_t fill_1[56];
} HLI_SIDE_WORD;
_Static_assert(offsetof(HLI_SIDE_WORD, word) == 0, "HLI_SIDE_WORD.word");
_Static_assert(offsetof(HLI_SIDE_WORD, waiters) == 4, "HLI_SIDE_WORD.waiters");
_Static_assert(offsetof(HLI_SIDE_WORD, fill_1) == 8, "HLI_SIDE_WORD.fill_1");
_Static_assert(sizeof(HLI_SIDE_WORD) == 64, "HLI_SIDE_WORD");

typedef struct HLI_SIDE_STATS {
    uint64_t requests_mode1;
    uint64_t requests_mode2;
    uint64_t requests_bad;
    uint64_t overruns;
    uint64_t bad_commands;
    uint8_t fill_1[24];
} HLI_SIDE_STATS;
_Static_assert(offsetof(HLI_SIDE_STATS, requests_mode1) == 0, "HLI_SIDE_STATS.requests_mode1");
_Static_assert(offsetof(HLI_SIDE_STATS, requests_mode2) == 8, "HLI_SIDE_STATS.requests_mode2");
_Static_assert(offsetof(HLI_SIDE_STATS, requests_bad) == 16, "HLI_SIDE_STATS.requests_bad");
_Static_assert(offsetof(HLI_SIDE_STATS, overruns) == 24, "HLI_SIDE_STATS.overruns");
_Static_assert(offsetof(HLI_SIDE_STATS, bad_commands) == 32, "HLI_SIDE_STATS.bad_commands");
_Static_assert(offsetof(HLI_SIDE_STATS, fill_1) == 40, "HLI_SIDE_STATS.fill_1");
_Static_assert(sizeof(HLI_SIDE_STATS) == 64, "HLI_SIDE_STATS");

typedef struct HLI_SIDECAR {
    HLI_SIDE_CNC cnc;
    HLI_SIDE_PLC plc;
    HLI_SIDE_WORD cnc_turn;
    HLI_SIDE_WORD plc_turn;
    HLI_SIDE_WORD clah_bell;
    HLI_SIDE_WORD clah_answer;
    HLI_SIDE_WORD channel_seq;
    HLI_SIDE_STATS stats;
} HLI_SIDECAR;
_Static_assert(offsetof(HLI_SIDECAR, cnc) == 0, "HLI_SIDECAR.cnc");
_Static_assert(offsetof(HLI_SIDECAR, plc) == 64, "HLI_SIDECAR.plc");
_Static_assert(offsetof(HLI_SIDECAR, cnc_turn) == 128, "HLI_SIDECAR.cnc_turn");
_Static_assert(offsetof(HLI_SIDECAR, plc_turn) == 192, "HLI_SIDECAR.plc_turn");
_Static_assert(offsetof(HLI_SIDECAR, clah_bell) == 256, "HLI_SIDECAR.clah_bell");
_Static_assert(offsetof(HLI_SIDECAR, clah_answer) == 320, "HLI_SIDECAR.clah_answer");
_Static_assert(offsetof(HLI_SIDECAR, channel_seq) == 384, "HLI_SIDECAR.channel_seq");
_Static_assert(offsetof(HLI_SIDECAR, stats) == 448, "HLI_SIDECAR.stats");
_Static_assert(sizeof(HLI_SIDECAR) == 512, "HLI_SIDECAR");

typedef struct HLI_SEGMENT {
    HLI_SEGMENT_HEAD segment_head;
    HLI_PLATFORM platform;
    HLI_CHANNEL channel[12];
    HLI_AXIS axis[64];
    HLI_EXT_VAR ext_var_channel[12];
    HLI_EXT_VAR ext_var_global;
    HLI_SIDECAR sidecar;
} HLI_SEGMENT;
_Static_assert(offsetof(HLI_SEGMENT, segment_head) == 0, "HLI_SEGMENT.segment_head");
_Static_assert(offsetof(HLI_SEGMENT, platform) == 256, "HLI_SEGMENT.platform");
_Static_assert(offsetof(HLI_SEGMENT, channel) == 384, "HLI_SEGMENT.channel");
_Static_assert(offsetof(HLI_SEGMENT, axis) == 199296, "HLI_SEGMENT.axis");
_Static_assert(offsetof(HLI_SEGMENT, ext_var_channel) == 254592, "HLI_SEGMENT.ext_var_channel");
_Static_assert(offsetof(HLI_SEGMENT, ext_var_global) == 542592, "HLI_SEGMENT.ext_var_global");
_Static_assert(offsetof(HLI_SEGMENT, sidecar) == 566592, "HLI_SEGMENT.sidecar");
_Static_assert(sizeof(HLI_SEGMENT) == 567104, "HLI_SEGMENT");

#endif
