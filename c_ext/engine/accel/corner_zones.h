/* Zones of corners: how far their jumps use up acceleration, whatever pieces
 * lie there. */
#ifndef ENGINE_ACCEL_CORNER_ZONES_H
#define ENGINE_ACCEL_CORNER_ZONES_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* corner_zones.c */
/* Acceleration that jumps use up over some mm from one end of a piece on. */
typedef struct zone_use {
    double reach;
    const double *reserve; /* of every axis, where reach > 0; `sum`, or that of
                              a corner */
    double sum[NC_AXES];
} zone_use;

bool zones_new(struct engine *e);
double corner_zone(const struct engine *engine,
                   double v,
                   const struct piece *piece);
void zones_follow(struct engine *engine, uint64_t i);
void zones_note(struct engine *engine,
                uint64_t i,
                const struct piece *before,
                double v);
void zones_use(struct engine *engine,
               const struct piece *piece,
               const struct piece *next,
               zone_use *first,
               zone_use *last);
bool zones_known(struct engine *e,
                 const struct piece *p,
                 const struct piece *next);
#endif
