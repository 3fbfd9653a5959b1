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
    const double *reserve; /* of every axis: `sum`, that of a corner, or zeros
                              where reach is 0 */
    double sum[NC_AXES];
} zone_use;

bool corner_zones_new(struct engine *engine);
double corner_zone(const engine_config *cfg,
                   double v,
                   const struct piece *piece);

/* Piece i is the next one that is capped: behind the one capped last, or again
 * behind one that has been. */
void corner_zones_follow(struct engine *engine, uint64_t i);

/* Piece i has been capped. `v`: fastest at its start if its jumps use up
 * acceleration, else below 0. */
void corner_zones_note(struct engine *engine,
                       uint64_t i,
                       const struct piece *before,
                       double v);

/* What jumps use up at both ends of p. `next`: the motion behind it, NULL where
 * that ends in a standstill or is not known. */
void corner_zones_use(struct engine *engine,
                      const struct piece *piece,
                      const struct piece *next,
                      zone_use *first,
                      zone_use *last);

/* Whether all corners are known that can use up acceleration on piece. Nobody
 * waits for what lies behind a standstill. */
bool corner_zones_known(struct engine *engine,
                        const struct piece *piece,
                        const struct piece *next);
#endif
