/* The narrow waist: one canonical row of a prepared NC program (numpy dtype
 * cnc_core.blocks.NC_BLOCK).
 *
 * Lengths mm, rotary axes degrees, feed mm/s, angles rad. `end` holds all
 * channel axes in channel order, in machine coordinates. The start of a motion
 * is the end of the motion before it.
 */
#ifndef NC_BLOCK_H
#define NC_BLOCK_H
#include <stdint.h>

/* cdef begin */
#define NC_AXES 9

#define NC_LINEAR 1
#define NC_CIRCULAR 2
#define NC_POLYNOMIAL 3
#define NC_DWELL 4
#define NC_M 5
#define NC_H 6
#define NC_S 7
#define NC_T 8
#define NC_MARKER 9
#define NC_DISTANCE_RESET 10
#define NC_FLUSH 11
#define NC_RT_LOOP_BEGIN 12
#define NC_RT_LOOP_END 13
#define NC_EVENT 14
#define NC_COMPENSATION 15 /* consumed by the radius compensation stage */
#define NC_SMOOTHING 16    /* consumed by the smoothing stage */
#define NC_CONTOUR 17      /* consumed by the contouring stage */
#define NC_DYNAMICS 18     /* limits of the motions from here on */
/* consumed by the spline stage, cnc_core/geometry/stages/spline.py */
#define NC_SPLINE 19
/* consumed by the stages of frames and kinematics */
#define NC_COORDINATES 20
#define NC_SOFT_LIMITS 25 /* consumed by the stage of software limits */
/* consumed by the stage of chamfers and roundings,
 * cnc_core/geometry/stages/corner.py */
#define NC_CORNER 21
/* what the feed refers to, corner and arc speeds; consumed by that stage
 * (geometry/stages/path_mode.py) */
#define NC_PATH_MODE 22
/* settings of a filter; consumed with it (geometry/filters/run_filter.py) */
#define NC_FILTER 23
/* consumed by the orbit stage: `code` 1 on, 0 off; `value` R_MAX_SCALE,
 * `radius` R_MAX_EQUID, mm */
#define NC_EXTENSION 24

/* flags */
#define NC_RAPID 1      /* motion: G00, feed ignored */
#define NC_EXACT_STOP 2 /* motion: ends at standstill */
#define NC_STANDSTILL 4 /* not motion: takes effect at standstill */
#define NC_HAS_PARAM 8  /* marker: PARAM was programmed */
#define NC_WAIT 16      /* flush: the front end waits until it is executed */
#define NC_HAS_VALUE 32 /* M, H: additional value was programmed */
/* real-time loop: every pass begins with the same distance */
#define NC_MODULO 128
/* motion: seen by the PLC, not executed; the pieces that follow execute it */
#define NC_ELEMENT 256
/* motion: executed, not seen; covers `value` mm of the elements */
#define NC_PIECE 512
/* motion: the feed as programmed, whatever the override */
#define NC_NO_OVERRIDE 32768
/* motion: the feed counts along `length`, whatever the path mode says
 * (geometry/stages/path_mode.py) */
#define NC_PATH_FEED 16384
/* polynomial: the feed is that of its parameter; pieces: so is their path */
#define NC_BY_PARAMETER 1024
/* piece with NC_BY_PARAMETER: covers a path of the tool tip, its axes say
 * nothing about the speed there */
#define NC_OF_TIP 2048
/* polynomial: its parameter runs with the path length; the length is given,
 * not measured */
#define NC_BY_LENGTH 4096
/* coordinates: the tool length is corrected, the axes are programmed */
#define NC_LENGTH_ONLY 2048
/* coordinates: blocks are straight lines of the machine axes */
#define NC_PTP 8192
/* compensation: feed of arcs refers to the contour (G11), not to the tool
 * centre */
#define NC_CONTOUR_FEED 64

/* code of an NC_EVENT row */
/* #DEL DIST2GO [END = mask]: where a deleted distance to go may end; mask in
 * `value` */
#define NC_EVENT_DIST2GO_END 3
/* #BACKWARD STORAGE CLEAR: backward motion does not go behind this place */
#define NC_EVENT_STORAGE_CLEAR 4
/* told to the cell when the path passes: number in `value` */
#define NC_EVENT_COMMAND 5
/* from here on the override counts (`value` 1) or not (0) */
#define NC_EVENT_OVERRIDE 6
/* V.RTG.LOOP.ENABLED in `value` */
#define NC_EVENT_RT_LOOP 7
/* V.RTG.LOOP.COUNT in `value` */
#define NC_EVENT_RT_COUNT 11
/* and 9, 10: #CHANNEL SET [ESA_TIME0 = s], 1, 2: time of FCT_CALC_STATE_AT_T
 * in `value` */
#define NC_EVENT_ESA_TIME 8
/* #EXPL SYN: wait for functions of type MVS_SLP */
#define NC_EVENT_EXPL_SYN 2

/* code of an NC_MARKER row */
#define NC_MARKER_ON 1
#define NC_MARKER_PARAM 2
#define NC_MARKER_OFF 3
#define NC_MARKER_CLEAR 4

/* An NC_COMPENSATION row says which tool radius compensation holds from here
 * on: `code` 40, 41, 42; `value` the tool radius, mm, negative swaps the side;
 * `plane` 17, 18, 19; `pool` how it is selected and deselected: 138, 139, 237,
 * 239 or 5; `degree` outer corners: 25 lines, 26 arcs; `flags` NC_CONTOUR_FEED.
 */
/* An NC_SMOOTHING row says how the contour is smoothed from here on: `code`
 * NC_SMOOTH_OFF exactly, others within `value` mm (0: as configured) and
 * `radius` degrees of the rotary axes (0: as configured); turns over `angle`
 * rad (0: as configured) stay corners, motions longer than `length` mm (0: no
 * limit) stay exact. With NC_SMOOTH_CUT a corner is cut by one curve, also
 * where swinging out to one side of it were faster. */
#define NC_SMOOTH_OFF 0
#define NC_SMOOTH_ON 1
#define NC_SMOOTH_CUT 2

/* An NC_COORDINATES row says what lies between programmed and axis positions
 * from here on. `end`: where the channel stands in the new programmed
 * coordinates. Frame: p = origin + R p_programmed over the three main axes; R
 * as unit quaternion (w x y z) in `center`, `radius`, `programmed_radius`;
 * origin in `angle`, `value`, `length_min`. Kinematics: `code`, its number + 1,
 * 0 for none; tool length in `feed`; flags NC_PTP, NC_LENGTH_ONLY. */
/* A motion with NC_ELEMENT and `degree` NC_TANGENTS names its tangents over the
 * main axes (in and out, 6 numbers in the pool from `pool` on), because its
 * geometry lies in other coordinates than the axes. */
#define NC_TANGENTS 255
/* A straight motion with `degree` NC_BENT is a chord of a curve, which goes on
 * from the motion before; with NC_BENT_FIRST the curve begins there. Direction
 * of the curve at the end over the main axes: `center`, `radius`, length 1.
 * Consumed by the smoothing stage, which drives the curve. */
#define NC_BENT 254
#define NC_BENT_FIRST 253
/* An NC_CONTOUR row says how corners are rounded from here on: `plane` 1 on, 0
 * off; `code` NC_CONTOUR_DEV .. AUTO_VEL; `degree` NC_CONTOUR_PRE .. POST,
 * where functions between the blocks go; `flags` NC_CONTOUR_CONST_VEL; `value`
 * largest deviation mm (0: none); `center` corner distances mm (negative: none
 * given); `radius` largest deviation of the other axes; `programmed_radius`,
 * `length_min` shorter blocks are passed over, mm and way of the other axes;
 * `feed` share of a block that remains; `angle` larger turns stay corners, rad
 * (0: none do); `length` share of acceleration or speed; `end` interim point.
 */
#define NC_CONTOUR_DEV 1
#define NC_CONTOUR_DIST 2
#define NC_CONTOUR_SOFT 3
#define NC_CONTOUR_POS 4
#define NC_CONTOUR_PTP 5
#define NC_CONTOUR_AUTO_DEV 6
#define NC_CONTOUR_AUTO_VEL 7
#define NC_CONTOUR_PRE 0
#define NC_CONTOUR_INTER 1
#define NC_CONTOUR_POST 2
#define NC_CONTOUR_CONST_VEL 1
/* An NC_DYNAMICS row sets one kind of limit of the motions behind it, `code`
 * NC_DYNAMICS_...; `end`: shares of the axes' own limits, above 0 and at most 1
 * (jerk: at most 1e4), or for NC_DYNAMICS_PATH limits of the path (0: none):
 * velocity mm/s, acceleration, radial acceleration mm/s2, acceleration at
 * transitions mm/s2, jerk, radial jerk mm/s3; `value` 0: of feed motions, 1: of
 * rapid motions. */
#define NC_DYNAMICS_VELOCITY 1
#define NC_DYNAMICS_ACCELERATION 2
#define NC_DYNAMICS_JERK 3
#define NC_DYNAMICS_PATH 4
#define NC_DYNAMICS_PROFILE 5 /* `value`: 0 STEP, 1 TRAPEZ, 2 SIN2, 3 HSC */

typedef struct nc_block {
    double end[NC_AXES];
    double length; /* path length: main axes, rotary axes when only they move */
    double feed;   /* path feed; 0 for rapid and for rows that are not motion */
    double center[2];         /* circle: first and second axis of the plane */
    double radius;            /* circle: of the path that is driven (tool radius
                                 compensated) */
    double programmed_radius; /* circle */
    double angle; /* circle: swept angle, counter-clockwise positive;
                     polynomial: parameter end s */
    double value; /* dwell s; marker PARAM; M/H additional value; S rev/min */
    double length_min; /* die sinking: length on the scaled contour; equal to
                          length without scaling */
    int32_t code;      /* M, H, T, D number; marker action */
    uint32_t pool;     /* polynomial: first coefficient in the batch's pool */
    uint32_t n;        /* programmed block number, 0 if none */
    uint32_t line;  /* source line, 1-based, of the first physical line of the
                       block */
    uint32_t count; /* block_count: lines read by the decoder up to and with
                       that line */
    uint16_t file;  /* index of the source file in the program's file table */
    uint16_t flags;
    uint8_t type;
    uint8_t plane;  /* circle: 17, 18, 19 */
    uint8_t degree; /* polynomial */
    uint8_t fill_1;
    float end_speed; /* motion: largest path speed at its end, mm/s; 0: none */
} nc_block;
/* cdef end */

_Static_assert(sizeof(nc_block) == 176, "nc_block");
#endif
