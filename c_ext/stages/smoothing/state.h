/* State of the smoothing stage: the section in work, its window, and what waits
 * to be written. One thread uses it. */
#ifndef SMOOTH_STATE_H
#define SMOOTH_STATE_H
#include <math.h>
#include <stdbool.h>
#include <string.h>
#include "stages/smoothing/smoothing.h"
#include "stages/smoothing/tuning.h"

#define ORDER 6
#define PAIRS (ORDER / 2)
#define AXES_EVEN                                                              \
    (NC_AXES                                                                   \
     + NC_AXES                                                                 \
           % 2) /* axes are gone through in pairs; what is too much is zero */
#define NODES_FULL (NODES - 8)
#define SITES (NODES + SPANS_ROOM)
#define CONTROLS (SPANS_ROOM + 5)
#define KNOTS (CONTROLS + 6)

typedef enum node_kind {
    NODE_VERTEX, /* within a smooth section */
    NODE_BREAK,  /* the path passes it exactly; sections end and begin */
    NODE_TAIL,   /* on a long line: a section ends here and the line goes on */
    NODE_HEAD    /* on a long line: the next section begins */
} node_kind;

/* A chord of an arc: its plane by channel axes, and the angle between the chord
 * and the arc at either end, rad; 0: a straight one. */
typedef struct bow {
    int8_t first, second;
    float half;
} bow;

/* A point of the programmed contour; coordinates scaled so that every group of
 * axes has the tolerance of the linear ones. */
typedef struct node {
    double position[NC_AXES];
    double t;          /* scaled chord length since the last resync */
    double programmed; /* programmed distance, mm */
    double turn;       /* rad, between the chords at it */
    double size;       /* wanted length of a knot span around it */
    double slack; /* deviation used up by the chord that ends here (points left
                     out, arcs) */
    double feed;  /* of the chord that ends here; 0 rapid */
    double most;  /* mm/s that its axes allow */
    double len;   /* of that chord as programmed, scaled */
    float end_speed; /* largest speed at it, mm/s; 0: none */
    uint8_t kind;
    uint16_t flags; /* of the row: NC_NO_OVERRIDE */
    struct bow bow; /* of the chord that ends here */
    bool mark;      /* a piece must end here: feed changes, or a row that is not
                       motion takes effect */
    uint32_t number, line, count;
    uint16_t file;
} node;

/* A row waiting to be written, with the contour parameter it takes effect at.
 */
typedef struct held_row {
    nc_block row;
    double t;
    bool motion;
} held_row;

/* Two doubles at any address, worked on at once. */
typedef double pair __attribute__((vector_size(16), aligned(8), may_alias));

typedef struct site {
    double position[AXES_EVEN], t, basis[ORDER + PAIRS], weight,
        target; /* the basis ends in zeros */
    int span;
    double miss; /* residual over target */
    double allowed;
    bool wish; /* the target is closer than the tolerance asks for */
    /* as a wall: where it draws the curve to, and how strongly it draws linear
     * and rotary axes; the target is where it stands. Where the curve passes
     * it, and squares of how far off it is in linear and rotary axes. */
    double aim[AXES_EVEN], force[2];
    double passed[AXES_EVEN], off[2];
} site;

/* What follows at one place from the law of motion alone: from y = ln v and its
 * derivatives by t. */
typedef struct pace {
    double y1, bend; /* bend: y'' + 2 y'^2 */
    double cube;     /* e^3y over the limit of the jerk */
    double weight;   /* time at this place, s */
    double over;     /* of y, above the feed */
} pace;

/* What follows at one place from the curve alone: derivatives by t. */
typedef struct rates {
    double q1[AXES_EVEN], q2[AXES_EVEN], q3[AXES_EVEN];
} rates;

typedef struct window {
    double tau[KNOTS];                      /* knots */
    double control[CONTROLS][AXES_EVEN];    /* control points */
    double basis[SPANS_ROOM][ORDER][ORDER]; /* basis functions of each span as
                                           polynomials of x = 0..1 */
    double hull[SPANS_ROOM][ORDER]
               [ORDER]; /* the same by their Bernstein coefficients */
    double middle[SPANS_ROOM][2][ORDER]; /* their first and second derivatives
                                            in the middle, over x */
    double fair[SPANS_ROOM][ORDER]
               [ORDER]; /* fairness of each span: row i has what control points
                           i + 0.. share, then zeros */
    double rho[SPANS_ROOM];
    struct site sites[SITES];
    double band[ORDER + CONTROLS + ORDER]
               [ORDER]; /* row ORDER + i: coefficients of control points i +
                           0..; zeros around them */
    double inverse[CONTROLS + ORDER]
                  [ORDER]; /* of the system, as far as the band reaches: row i,
                              control points i + 0.. */
    int spans, sites_n, fixed_head, fixed_tail;
    int kept; /* control points that the window before has too */
    /* The law of motion (law.c), if there is one: control points of ln v, how
     * many are fixed, and the largest ln v of each span */
    bool timed;
    double law[CONTROLS], law_top[SPANS_ROOM];
    int law_head, law_tail;
    int moving[NC_AXES], moving_n; /* axes that move */
    /* basis functions and three derivatives at the places looked at */
    double place[SPANS_ROOM][LAW_PLACES][4][ORDER];
    struct pace pace[SPANS_ROOM][LAW_PLACES];
    struct rates rates[SPANS_ROOM][LAW_PLACES];
    /* of the jerk of every axis that moves: what draws it to its limit */
    double penalty[SPANS_ROOM][LAW_PLACES][NC_AXES];
    /* roughness at each place: a row over the control points, squared with a
     * weight for every axis; and what it draws them to, times the weight */
    double row[SPANS_ROOM][LAW_PLACES][ORDER];
    double heavy[SPANS_ROOM][LAW_PLACES][NC_AXES];
    double pull[CONTROLS][NC_AXES];
} window;

/* What is kept of the last accepted window. */
typedef struct carry {
    bool valid;
    double tau[KNOTS], control[CONTROLS][AXES_EVEN];
    int spans;  /* certified spans not committed yet */
    bool timed; /* with a law */
    double law[CONTROLS];
} carry;

#define LEFT_OUT 64

typedef struct left_out {
    double position[NC_AXES], programmed; /* as in a node */
} left_out;

struct nc_smooth {
    nc_smooth_config cfg;
    double turn_configured,
        longest; /* rad as configured; mm: longer motions stay exact, 0: none */
    double scale[NC_AXES];    /* scaled = scale * axis value */
    double jerk;              /* that shapes the curves, mm/s3; 0: no limit */
    double slowness[NC_AXES]; /* least limit of jerk over that of the axis, both
                                 scaled */
    double penalty_least[NC_AXES]; /* of the jerk of each axis */
    uint16_t main_mask;
    /* commands of the path act at their programmed place */
    bool exact_commands;
    bool cuts;      /* corners are cut, also where swinging out is faster */
    double tol;     /* of all groups, in scaled coordinates; 0: off */
    double degrees; /* of the rotary axes for 1 in scaled coordinates; 0: there
                       are none */
    /* A frame behind this stage turns the path: nodes and curves are as the
     * axes drive them, what comes in and goes out is as programmed */
    bool is_turned;
    double forth[3][3], back[3][3]; /* main axes */
    double here[NC_AXES]; /* `last` as the axes drive it, once asked for */
    /* intake */
    double last[NC_AXES]; /* programmed position, scaled */
    double t, programmed;
    bool has_function; /* rows that are not motion came with this block_count
                          last */
    uint32_t function_count;
    /* direction of the curve where the last chord of one has ended, scaled */
    double bent[3];
    bool is_bent;
    struct bow bow;          /* of the chord that ends at the next point */
    double bulge;            /* largest distance of a curve from its chord */
    double skipped;          /* farthest point left out behind the last node */
    left_out left[LEFT_OUT]; /* these points, or every so many of them */
    int left_n;
    double feed; /* of the section's last row, whose point may be left out; -1:
                    none yet */
    uint16_t feed_flags;
    int merged_n; /* points left out on the last chord, collinear */
    double toward[NC_AXES],
        spread;     /* directions of that chord that pass them */
    double measure; /* knot spans that the settled nodes ask for */
    struct node nodes[NODES];
    int n_nodes; /* node 0 is where what is written so far ends */
    /* rows waiting */
    struct held_row *held;
    size_t held_n, held_first, held_room;
    /* section in work */
    struct window window;
    carry keep;
    /* output */
    nc_block *rows;
    size_t rows_n, rows_room;
    double *pool;
    size_t pool_n, pool_room;
    double out_at[NC_AXES]; /* end of the last piece, axis units */
    double out_t;           /* and its contour parameter */
    nc_block line;          /* straight piece not written yet */
    bool has_line;
    double line_start[NC_AXES], line_t;
    bool no_memory;
    double finer;  /* factor of all span lengths, below 1 after a failure */
    double closer; /* share of the tolerance in which the curve is sought, below
                      1 after a failure */
    bool firm; /* all control points that the window before knows are fixed */
    nc_smooth_stats stats;
};

static inline bool in_main(const nc_smooth *smooth, int axis) {
    return smooth->main_mask >> axis & 1;
}

/* Whether the window before was made faster: its speed is given at the join. */
static inline bool law_goes_on(const nc_smooth *smooth) {
    return smooth->keep.valid && smooth->keep.timed;
}

static inline double dot(const double *from, const double *to, int count) {
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        sum += from[i] * to[i];
    }
    return sum;
}

/* `most`: of a piece that is written, scaled. */
static inline void note_deviation(nc_smooth *smooth, double most) {
    smooth->stats.deviation = fmax(smooth->stats.deviation, most);
    smooth->stats.rotary_deviation =
        fmax(smooth->stats.rotary_deviation, most * smooth->degrees);
}
#endif
