/* Tool radius compensation: programmed rows in, rows of the tool centre out.
 *
 * cnc_core/geometry/stages/radius_compensation.py is the stage around it.  From
 * top to bottom:
 *
 * offset.c: which row is what (selection, compensation, change of side).
 * join.c: two neighbours, and their intersection, corner lines or corner arc.
 * intersect.c: points, tangents and intersections, without state.
 *
 * One element is held back until the next one in the plane is known, with all
 * rows behind it.  Offsets are signed: positive to the left of the path.
 */
#ifndef OFFSET_H
#define OFFSET_H
#include <stddef.h>
#include <stdint.h>

#include "rows/nc_block.h"

/* cdef begin */
#define NC_OFFSET_HELD 1000 /* rows behind the element held back */
/* rows written for one row read, at most; and the held ones */
#define NC_OFFSET_GROWTH 5

#define NC_OFFSET_LINES 25
#define NC_OFFSET_ARCS 26
#define NC_OFFSET_TANGENTIAL 5
#define NC_OFFSET_DIRECT 138
#define NC_OFFSET_INDIRECT 139
#define NC_OFFSET_PERPENDICULAR 237
#define NC_OFFSET_WITHOUT_BLOCK 239

/* numbers of cnc_core.errors */
#define NC_ERROR_SYNC 20651
#define NC_ERROR_PLANE 20133
#define NC_ERROR_SELECTION 90008
#define NC_ERROR_HELD 90011
#define NC_ERROR_INNER_RADIUS 90017
#define NC_ERROR_CIRCLES 90031
#define NC_ERROR_RADIUS_CHANGE 90047
#define NC_ERROR_DAMAGE 906001
#define NC_ERROR_DESELECTION 906002
#define NC_ERROR_UNSUPPORTED_ROW 906003
#define NC_ERROR_TANGENTIAL 906004
#define NC_WARNING_LINEARIZED 906005

/* A motion in the plane. Index 0: at its start, 1: at its end. */
typedef struct nc_element {
    nc_block row;     /* as programmed */
    double p[2][2];   /* programmed points */
    double t[2][2];   /* tangents */
    double d[2];      /* offsets; they differ while the tool radius changes */
    double start[2];  /* compensated start */
    double curvature; /* positive: to the left */
    int32_t role;
    int32_t mode; /* of the selection or deselection it makes */
} nc_element;

typedef struct nc_offset {
    double last[NC_AXES]; /* programmed end of the last motion */
    double pos[NC_AXES];  /* end of the last row written, compensated */
    double offset;        /* in force ... */
    double offset_next;   /* ... and from the next element on */
    nc_element prev;      /* held back */
    nc_block select;      /* last compensation row */
    nc_block place;       /* the row an error or warning speaks of */
    double detail[2];     /* 90017: radius of the contour, of the tool */
    size_t held;
    int32_t main_axis[3];
    int32_t state;
    int32_t has_prev;
    int32_t shifted; /* G239: axes stay beside the programmed position until
                        they are programmed */
    int32_t mode;
    int32_t corner;
    int32_t warning; /* nc_offset_push came back early to have it reported */
    uint8_t axes, plane, contour_feed;
    nc_block rows[NC_OFFSET_HELD];
    nc_block *out; /* while pushing */
    size_t made, room;
} nc_offset;

void nc_offset_init(nc_offset *offset);
int nc_offset_idle(const nc_offset *offset);
int nc_offset_push(nc_offset *offset,
                   const nc_block *in,
                   size_t count,
                   size_t *taken,
                   nc_block *out,
                   size_t room,
                   size_t *made);
int nc_offset_drain(nc_offset *offset,
                    nc_block *out,
                    size_t room,
                    size_t *made);
void nc_offset_resync(nc_offset *offset, const double *position);
void nc_offset_forget(nc_offset *offset);
/* cdef end */

#endif
