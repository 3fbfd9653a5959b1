"""What single values, bits and signs of the HLI's members mean.

``docs/generate.py`` joins these texts with ``hli.layout`` and
``hli.reference``.  A line names ``STRUCTURE.member``, several share the lines
below; an indented line is a value, ``|`` and its meaning.  A value is a number,
``bit N``, a sign (``> 0``), or the name of a constant of ``hli.layout``.
"""

from __future__ import annotations

import functools

from . import layout

VALUES = r"""
HLI_BAHN_STATE.stop_condition_r
    bit 0 | feed hold
    bit 1 | feed hold of an axis
    bit 2 | override 0
    bit 3 | single block
    bit 4 | M00
    bit 5 | M01
    bit 6 | a technology function that waits for the PLC
    bit 7 | in-position; never set
    bit 8 | dwell
    bit 9 | error
    bit 10 | HOLD of the operation mode
    bit 11 | inserted stop
    bit 12 | an axis is not released
    bit 13 | no block supply
HLI_BAHN_STATE.active_feed_r
    > 0 | drives forward
    < 0 | drives backward
    0 | stands
HLI_BAHN_STATE.esa_vb
    -1 | not known: the time is 0, or the plan does not reach so far
HLI_BAHN_STATE.file_offset_r
    -1 | not known; always
HLI_COORD.state_r HLI_LR_STATE.axis_state_r
    1 | stands
    3 | moves
HLI_COORD.axis_type_r
    1 | linear
    2 | rotary
HLI_HEAD_AXIS.axis_type_r
    1 | linear
    2 | rotary
    4 | spindle
HLI_BAHN_MC_CONTROL.override HLI_BAHN_MC_CONTROL.rapid_override
    0 | stands
    1000 | as programmed
    2000 | twice as fast; more is taken as 2000
HLI_BAHN_MC_CONTROL.ext_command_speed
    > 0 | drives forward
    < 0 | drives backward
    0 | stands
HLI_DECODER_MC_CONTROL.program_block_ignore
    bit 0 | blocks with / or /1 are left out
    bit 1 | blocks with /2, and so on to bit 9 for /10
HLI_DECODER_MC_CONTROL.execution_mode
    0 | as programmed
    0x2000 | M, H and T are not put out
HLI_INSERT_CMD_COMMAND.rel_abs_mode
    0 | from here, again and again
    1 | from program start
    2 | from here, once
HLI_INSERT_CMD_COMMAND.m_function_nr
    0 | M00
    1 | M01
    > 1 | this M function
HLI_INSERT_CMD_STATE.distance_of_next_stop
    -1 | none in sight
HLI_PROC_TRANS_TO_MODE_STATE.from_mode HLI_PROC_TRANS_TO_MODE_STATE.from_state
    0 | do not care
HLI_PROC_TRANS_TO_MODE_STATE.to_mode HLI_IMCM_MODE_STATE.mode
    HLI_IMCM_STANDBY_MODE | states 1 to 3 only
    HLI_IMCM_AUTOMATIC_MODE | programs from files
    HLI_IMCM_MDI_MODE | the parameter is the program's text
    HLI_IMCM_MANUAL_MODE | no motion of its own
    HLI_IMCM_REFERENCE_MODE | `rpf.nc` beside the program
HLI_PROC_TRANS_TO_MODE_STATE.to_state HLI_IMCM_MODE_STATE.state
    HLI_IMCM_PROCESS_DESELECTED | no program is chosen
    HLI_IMCM_PROCESS_SELECTED | a program is chosen
    HLI_IMCM_PROCESS_READY | it may be started
    HLI_IMCM_PROCESS_ACTIVE | it runs
    HLI_IMCM_PROCESS_HOLD | it stands on the path and can go on
    HLI_IMCM_PROCESS_ERROR | an error stands
    HLI_IMCM_PROCESS_SELECTING | on the way to SELECTED
    HLI_IMCM_PROCESS_DESELECTING | on the way to DESELECTED
    HLI_IMCM_PROCESS_PREPARING | on the way to READY
    HLI_IMCM_PROCESS_CLEARING | on the way from READY back to SELECTED
    HLI_IMCM_PROCESS_STARTING | on the way to ACTIVE
    HLI_IMCM_PROCESS_ABORTING | brakes and leaves out the rest
    HLI_IMCM_PROCESS_STOPPING | brakes for HOLD
    HLI_IMCM_PROCESS_RESUMING | on the way from HOLD to ACTIVE
    HLI_IMCM_PROCESS_RESETTING | on the way out of ERROR; asked for, a reset
TECHNO_UNIT_CH.fkt_ctrl_r TECHNO_UNIT_AX.fkt_ctrl_r
    1 | M: the data are HLI_M_H_PROZESS
    2 | H: the data are HLI_M_H_PROZESS
    3 | S: the data are HLI_S_PROZESS
    4 | T: the data are HLI_T_PROZESS
HLI_M_H_PROZESS.synch_mode HLI_S_PROZESS.synch_mode HLI_T_PROZESS.synch_mode
    0x1 | MOS: not waited for
    0x2 | MVS_SVS: out ahead of the block, waited for ahead of it
    0x4 | MVS_SNS: out ahead of the block, waited for behind it
    0x8 | MNS_SNS: out behind the block, waited for there
    0x4000 | MVS_SLM: waited for at the transition to the next G01, G02, G03
    0x8000 | MVS_SLP: waited for at `#EXPL SYN`
    bit 22 | BWD_SYNCH: waited for in backward motion, too
    bit 23 | FWD_SYNCH: as configured in simulated forward motion
HLI_S_PROZESS.move_cmd
    3 | M03
    4 | M04
    5 | M05
    0 | M19
HLI_S_PROZESS.pos_cmd
    19 | M19
    0 | none
HLI_ERROR_KOPF.recovery_class HLI_ERROR_KOPF.reaction_class
    1 | a refused command of `mode_and_state` (270061, 901001, 905020)
    2 | an error of the program; a reset removes it
    7 | the watchdog (270053); the CNC has to be started again
HLI_ERROR_KOPF.body_type
    0 | no body
    1 | the body is HLI_RUMPF_NC_PROG
HLI_RUMPF_NC_PROG.fileoffset
    -1 | not known
HLI_CONTOUR_LOOKAHEAD_BLOCK.block_type
    HLI_CLAH_NONE | the answer ends ahead of it
    HLI_CLAH_LINEAR | straight line
    HLI_CLAH_CIRCULAR | arc or helix
    HLI_CLAH_LOG_ON | marked area begins; `length` is the PARAM of its command, no length
    HLI_CLAH_LOG_PARAM | marker inside the area; `length` as above
    HLI_CLAH_LOG_OFF | marked area ends; `length` as above
    HLI_CLAH_POLYNOMIAL | curve
    HLI_CLAH_DWELL | queue with HLI_AHEAD_EVENTS: dwell
    HLI_CLAH_M | queue with HLI_AHEAD_EVENTS: M function
    HLI_CLAH_H | queue with HLI_AHEAD_EVENTS: H function
    HLI_CLAH_S | queue with HLI_AHEAD_EVENTS: spindle speed
    HLI_CLAH_T | queue with HLI_AHEAD_EVENTS: tool
HLI_CONTOUR_LOOKAHEAD_BLOCK.rt_loop_pass
    0 | not in a real-time loop
    HLI_CLAH_PASS_ENTRY | entering pass
    HLI_CLAH_PASS_LOOP | from loop to loop
    HLI_CLAH_PASS_EXIT | last pass
HLI_CONTOUR_LOOKAHEAD_BLOCK.circle_angle
    > 0 | counter-clockwise (G03)
    < 0 | clockwise (G02)
    0 | no circle
HLI_CONTOUR_LOOKAHEAD_BLOCK.tangent_variation
    0 | tangential, or the first motion
    > 0 | angle of the corner, to pi; never negative
HLI_CONTOUR_LOOKAHEAD_REQUEST.length
    0 | mode 1: marked blocks; start_position is the index of the first
    > 0 | mode 2: the coming contour from start_position on
HLI_SIDE_CNC.clock
    HLI_CLOCK_LOCKSTEP | the PLC allows the cycles
    HLI_CLOCK_FREERUN | virtual time, nobody waits
    HLI_CLOCK_REALTIME | absolute deadlines
HLI_SIDE_CNC.service
    HLI_SERVICE_CYCLIC | look-ahead requests are answered once a cycle
    HLI_SERVICE_IMMEDIATE | at once
HLI_SIDE_CNC.phase
    HLI_PHASE_STARTING | the CNC starts
    HLI_PHASE_READY | a PLC may attach
    HLI_PHASE_RUNNING | cycles run
    HLI_PHASE_ENDED | the program has ended
    HLI_PHASE_SHUTDOWN | the CNC leaves
HLI_AHEAD.slot_rw
    HLI_AHEAD_FREE | low byte: nobody uses the slot
    HLI_AHEAD_CLAIMED | low byte: a PLC writes its request
    HLI_AHEAD_ASKED | low byte: the CNC has to answer
    HLI_AHEAD_ANSWERED | low byte: the PLC may fetch the answer
HLI_AHEAD_REQUEST.mode HLI_AHEAD_ANSWER.mode
    HLI_AHEAD_MODE_LOG | marked log
    HLI_AHEAD_MODE_CONTOUR | coming contour
HLI_AHEAD_REQUEST.flags
    HLI_AHEAD_BEYOND | the range goes on into the next epochs
    HLI_AHEAD_EVENTS | functions and dwells stand between the elements
    HLI_AHEAD_DETAILS | each element has a detail
HLI_AHEAD_ANSWER.empty
    HLI_AHEAD_NOT_EMPTY | there are elements
    HLI_AHEAD_EMPTY_DISABLED | the function or its memory is not configured
    HLI_AHEAD_EMPTY_NOT_KNOWN | nothing is known there yet: ask again
    HLI_AHEAD_EMPTY_BEHIND_END | behind the end of the program or marked area
    HLI_AHEAD_EMPTY_BEFORE_RESET | a distance reset or the end of a real-time loop is ahead
    HLI_AHEAD_EMPTY_DROPPED | left behind, or of an epoch that is over
    HLI_AHEAD_EMPTY_BAD_START | start_position is not usable
    HLI_AHEAD_EMPTY_BAD_LENGTH | length is not usable
    HLI_AHEAD_EMPTY_BAD_MODE | mode is not usable
    HLI_AHEAD_EMPTY_BAD_EPOCH | epoch is not usable
    HLI_AHEAD_EMPTY_BAD_FLAGS | flags are not usable
HLI_AHEAD_ANSWER.end
    HLI_AHEAD_END_OPEN | more will come
    HLI_AHEAD_END_RESET | a distance reset
    HLI_AHEAD_END_LOOP | the end of a real-time loop
    HLI_AHEAD_END_PROGRAM | the program's end
    HLI_AHEAD_END_LOG | the marked area is closed
HLI_AHEAD_DETAIL.flags
    HLI_AHEAD_RAPID | rapid motion
    HLI_AHEAD_HAS_PLACE | start and end count
    HLI_AHEAD_HAS_DIRECTION | direction_start and direction_end count
    HLI_AHEAD_HAS_DRIVEN | driven_length counts
    HLI_AHEAD_HAS_WAY | way counts
    HLI_AHEAD_HAS_START_PLAN | speed_start and time_start count
    HLI_AHEAD_HAS_END_PLAN | speed_end and time_end count
"""

FIRST = "0.1.0"
NOT_SERVED = ("0: ", "-1: ", "not supported")
SINCE: dict[str, str] = {}
"""``STRUCTURE.member``: the version that first served it, if not ``FIRST``."""

Meanings = tuple[tuple[str, str], ...]


@functools.cache
def values() -> dict[str, dict[str, Meanings]]:
    """Structure -> member -> ((value, meaning), ..); a constant has its number
    in front of its name.
    """
    found: dict[str, dict[str, Meanings]] = {}
    names: list[tuple[str, str]] = []
    for line in VALUES.strip().splitlines():
        if not line.startswith(" "):
            names = [
                (structure, member)
                for structure, _, member in (
                    name.partition(".") for name in line.split()
                )
            ]
            continue
        value, _, said = (part.strip() for part in line.partition("|"))
        for structure, member in names:
            known = found.setdefault(structure, {})
            known[member] = (*known.get(member, ()), (_shown(value), said))
    return found


def _shown(value: str) -> str:
    if not value.startswith("HLI_"):
        return value
    return f"{getattr(layout, value)} {value}"


def served_since(structure: str, member: str, meaning: str) -> str:
    """The version that first served a member; ``no``: it is there for the layout
    alone, as its meaning says.
    """
    if meaning in ("0", "not evaluated") or meaning.startswith(NOT_SERVED):
        return "no"
    return SINCE.get(f"{structure}.{member}", FIRST)
