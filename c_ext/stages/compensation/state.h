/* Steps of the tool radius compensation that offset.c and join.c share. */
#ifndef OFFSET_INTERNAL_H
#define OFFSET_INTERNAL_H
#include "stages/compensation/intersect.h"

enum { /* states */
    OFFSET_OFF,
    OFFSET_ARMED,  /* selected, the selection block has not come yet */
    OFFSET_ACTIVE, /* without an element held back: it was drained, nothing in
                      the plane may follow */
    OFFSET_LEAVING /* deselected, the block back to the programmed path has not
                      come yet */
};

enum { /* roles of an element */
    OFFSET_CONTOUR,
    OFFSET_APPROACH, /* starts where the tool stands */
    OFFSET_SWITCH,   /* from one side to the other */
    OFFSET_LEAVE     /* ends on the programmed path */
};

extern const int OFFSET_PLANE_AXES[3][3];

int offset_axis(const nc_offset *offset, int i);
int offset_fail(nc_offset *offset, int error, const nc_block *place);
void offset_emit(nc_offset *offset, const nc_block *row);
void offset_set_length(const nc_offset *offset, nc_block *row);
void offset_corner_line(nc_offset *offset,
                        const nc_block *like,
                        const double end[2]);
void offset_release(nc_offset *offset);
int offset_finish(nc_offset *offset, nc_element *element, const double end[2]);
int offset_join(nc_offset *offset, nc_element *next);
int offset_end_perpendicular(nc_offset *offset);
#endif
