/* The functions of the project that the harnesses call.
 *
 * A fuzzer is linked with them. For a replay the harnesses are a small library
 * (FUZZ_LOADED) whose table `fuzz_calls` is filled with the functions of the
 * module that is installed, so nothing of the project is compiled again, and a
 * module built under sanitizers is replayed under them.
 */
#ifndef FUZZ_CALLS_H
#define FUZZ_CALLS_H
#include "engine/state/api.h"
#include "rows/nc_block.h"
#include "rows/scan.h"
#include "stages/compensation/offset.h"
#include "stages/contouring/contouring.h"
#include "stages/smoothing/smoothing.h"

#define FUZZ_CALLS(CALL)                                                       \
    CALL(nc_modal_init)                                                        \
    CALL(nc_words_init)                                                        \
    CALL(nc_block_from_words)                                                  \
    CALL(nc_scan)                                                              \
    CALL(nc_offset_init)                                                       \
    CALL(nc_offset_push)                                                       \
    CALL(nc_offset_drain)                                                      \
    CALL(nc_offset_resync)                                                     \
    CALL(nc_offset_forget)                                                     \
    CALL(nc_contour_new)                                                       \
    CALL(nc_contour_free)                                                      \
    CALL(nc_contour_set_wait)                                                  \
    CALL(nc_contour_push)                                                      \
    CALL(nc_contour_drain)                                                     \
    CALL(nc_contour_rows)                                                      \
    CALL(nc_contour_coefficients)                                              \
    CALL(nc_contour_take)                                                      \
    CALL(nc_contour_take_short)                                                \
    CALL(nc_smooth_new)                                                        \
    CALL(nc_smooth_free)                                                       \
    CALL(nc_smooth_push)                                                       \
    CALL(nc_smooth_drain)                                                      \
    CALL(nc_smooth_rows)                                                       \
    CALL(nc_smooth_coefficients)                                               \
    CALL(nc_smooth_take)                                                       \
    CALL(engine_new)                                                           \
    CALL(engine_free)                                                          \
    CALL(engine_set_synch)                                                     \
    CALL(engine_record)                                                        \
    CALL(engine_record_take)                                                   \
    CALL(engine_sample_bytes)                                                  \
    CALL(engine_run)                                                           \
    CALL(engine_push)                                                          \
    CALL(engine_finish)                                                        \
    CALL(engine_halt)                                                          \
    CALL(engine_resync)                                                        \
    CALL(engine_get_state)                                                     \
    CALL(engine_take_mode_command)                                             \
    CALL(engine_take_plc_error)                                                \
    CALL(engine_begin_program)                                                 \
    CALL(engine_abort)                                                         \
    CALL(engine_reset_channel)                                                 \
    CALL(engine_set_mode)                                                      \
    CALL(engine_suppress_functions)                                            \
    CALL(engine_set_program_name)                                              \
    CALL(engine_set_error)                                                     \
    CALL(engine_post_error)                                                    \
    CALL(engine_external)                                                      \
    CALL(engine_write_external)                                                \
    CALL(engine_show_commands)                                                 \
    CALL(engine_rt_cycle)                                                      \
    CALL(engine_expect_drain)                                                  \
    CALL(engine_expect_cycle)                                                  \
    CALL(engine_hold_by_cell)                                                  \
    CALL(engine_hold)                                                          \
    CALL(engine_macro_runs)                                                    \
    CALL(engine_take_command)                                                  \
    CALL(engine_hold_start)                                                    \
    CALL(engine_record_end)                                                    \
    CALL(engine_elements)                                                      \
    CALL(engine_get_standstill)                                                \
    CALL(engine_tell_standstill)                                               \
    CALL(engine_set_override)                                                  \
    CALL(engine_stall_planner)                                                 \
    CALL(engine_rehearse)                                                      \
    CALL(engine_set_spindle_synch)                                             \
    CALL(engine_set_axis)

#ifdef FUZZ_LOADED
#define FUZZ_MEMBER(name) __typeof__(&name) to_##name;
struct fuzz_calls {
    FUZZ_CALLS(FUZZ_MEMBER)
};
extern struct fuzz_calls fuzz_calls;

#include "fuzz_loaded.h" /* each name to its member, generated */
#endif

#endif
