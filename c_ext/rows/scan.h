/* Words of one block to a row, and plain motion lines to rows.
 *
 * A plain line holds only N, G00-G03, G17-G19, G90/G91, the machine's
 * one-letter axis words, I J K R and F with plain decimal numbers, and
 * comments.  scan.c reads plain lines.  Every other line belongs to the
 * dialect's Python parser, which fills an nc_words and calls
 * nc_block_from_words (modal.c) too: there is one geometry.
 */
#ifndef SCAN_H
#define SCAN_H
#include <stddef.h>
#include <stdint.h>

#include "rows/nc_block.h"

/* cdef begin */
#define NC_WORD_I 1
#define NC_WORD_J 2
#define NC_WORD_K 4
#define NC_WORD_R 8
#define NC_WORD_F 16
#define NC_WORD_N 32

#define NC_BLOCK_CHARACTERS 4096 /* longest block */

/* why nc_scan stopped */
#define NC_SCAN_MORE 0  /* the buffer holds no further whole line */
#define NC_SCAN_FULL 1  /* the output array is full */
#define NC_SCAN_OTHER 2 /* the next line is not plain */
/* the next line is plain and wrong; the modal state is as before it */
#define NC_SCAN_ERROR 3

/* rules of a dialect, in nc_modal; none of them: the ISG kernel */
/* R holds for its block alone, and only for a circle */
#define NC_RULE_RADIUS_ONCE 1
/* a centre word of the plane's third axis is an error unless it is 0 */
#define NC_RULE_NO_PITCH 2
/* a centre far from the bisector of the chord stays; only the two radii are
 * compared */
#define NC_RULE_KEEP_CENTRE 4
#define NC_RULE_NO_EQUALS 8 /* not plain: `=` in a word */
/* G164: the centre stays as programmed, the radii may differ by 0.01 mm */
#define NC_RULE_NO_CORRECTION 32
/* not plain: a comment with a comma, it may be a message */
#define NC_RULE_MESSAGES 16
/* I, J: first and second axis of the plane, whichever it is; K is no centre
 * word */
#define NC_RULE_PLANE_CENTRE 64
/* under G91 centre words count from the start, whatever centre_absolute says */
#define NC_RULE_CENTRE_DISTANCE 128
#define NC_RULE_NO_PLANES 512      /* not plain: G17, G18, G19 */
#define NC_RULE_NO_BRACKETS 256    /* not plain: `(` */
#define NC_RULE_FEED_POSITIVE 1024 /* not plain: F that is not positive */

/* numbers of cnc_core.errors */
#define NC_ERROR_PLANE_COMPENSATED 20133
#define NC_ERROR_CENTRE_AND_RADIUS 21024
#define NC_ERROR_RADII 21758
#define NC_ERROR_FEED 900006
#define NC_ERROR_SCALED_CIRCLE 910113
#define NC_ERROR_CIRCLE 900007
#define NC_ERROR_NO_CENTRE 900008
#define NC_ERROR_RANGE 900012
#define NC_ERROR_CENTRE_WITHOUT_CIRCLE 900015
#define NC_ERROR_PLANE_AXIS 900016

/* Modal state of one channel, shared by scanner and parser. Lengths mm, rotary
 * axes degrees. */
typedef struct nc_modal {
    double pos[NC_AXES];    /* end of the last motion, machine coordinates */
    double offset[NC_AXES]; /* offset in force */
    double offset_next[NC_AXES]; /* offset in force from the axis's next
                                    absolute word on */
    double zero[NC_AXES];   /* share of offset_next that is not tool length */
    double mirror[NC_AXES]; /* 1, or -1 where mirrored: axis words, centre
                               words, sense of circles */
    double share[NC_AXES];  /* of an axis word that is driven: 1, or 0.5 for
                               diameters */
    double arc_scale[3];    /* of the main axes: centre words and pitch; radius:
                               that of both axes of the plane */
    double centre_word[3];  /* I, J, K as last programmed */
    double tool_length;     /* acts on the third axis of the plane */
    double unit;            /* mm per programmed unit of length: 1 or 25.4 */
    double feed;            /* F as programmed, per minute; 0: none yet */
    double feed_unit;       /* mm per unit of length that F was programmed in */
    double feed_factor;     /* programmed override of the feed, 1 for 100 % */
    double feed_limit;      /* largest path feed, mm/s; 0: none */
    double radius;          /* modal R */
    double centre_limit;    /* centre correction: largest deviation, mm ... */
    double centre_ratio;    /* ... and as a share of the radius; an error needs
                               both exceeded */
    uint32_t line;          /* physical lines read from this file */
    uint32_t count;       /* physical lines read by the decoder: block_count */
    uint32_t programmed;  /* plain lines with at least one word */
    uint32_t n;           /* N number programmed last */
    int32_t main_axis[3]; /* channel index of X, Y, Z; -1 where absent */
    int8_t letter_axis[26]; /* channel index of the axis with this one-letter
                               name, -1 none */
    uint8_t rotary[NC_AXES];
    uint8_t axes;
    uint8_t motion;          /* 0..3 */
    uint8_t plane;           /* 17..19 */
    uint8_t absolute;        /* G90 */
    uint8_t centre_absolute; /* G161 */
    uint8_t exact_stop;      /* G360 */
    uint8_t has_radius;
    uint8_t compensated; /* G41, G42: the plane stays */
    uint16_t file;
    uint32_t rules; /* NC_RULE_... */
} nc_modal;

/* Words of one block. Codes are -1 where the block does not name them. */
typedef struct nc_words {
    double axis[NC_AXES];
    double centre[3]; /* I, J, K */
    double r;
    double f;
    uint32_t axis_set; /* bit i: axis i was programmed */
    uint32_t set;      /* NC_WORD_... */
    uint32_t n;
    uint32_t column;        /* 1-based, of the first word of the motion */
    int8_t motion;          /* 0..3 */
    int8_t plane;           /* 17..19 */
    int8_t absolute;        /* 1: G90, 0: G91 */
    int8_t inch;            /* 1: G70, 0: G71 */
    int8_t centre_absolute; /* 1: G161, 0: G162 */
    int8_t exact_stop;      /* 1: G360, 0: G359 */
    int8_t block_stop;      /* 1: G60 */
} nc_words;

typedef struct nc_scan_result {
    size_t consumed; /* bytes of whole lines read */
    size_t rows;     /* rows written */
    int32_t error;   /* with NC_SCAN_ERROR: number ... */
    uint32_t column; /* ... and column */
    int32_t stop;    /* NC_SCAN_... */
} nc_scan_result;

void nc_modal_init(nc_modal *modal);
void nc_modal_offsets(nc_modal *modal);
void nc_words_init(nc_words *words);
int nc_block_from_words(nc_modal *modal,
                        const nc_words *words,
                        nc_block *out,
                        int *emitted);
int nc_scan(nc_modal *modal,
            const char *text,
            size_t size,
            int final,
            nc_block *out,
            size_t room,
            nc_scan_result *result);
/* cdef end */

#endif
