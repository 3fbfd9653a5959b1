/* What the extension of the look-ahead tells of elements beside their facts. */
#ifndef ENGINE_STORE_ELEMENT_MORE_H
#define ENGINE_STORE_ELEMENT_MORE_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* Of the element that is pushed next; `in` and `out` are its first and last
 * direction in the main axes, 0 where none of them moves. */
void note_element(struct engine *engine,
                  const nc_block *row,
                  const double *in,
                  const double *out);

/* A piece of `driven` mm covers `programmed` mm of the elements from `from` mm
 * of `element` on. */
void note_driven(struct engine *engine,
                 uint64_t element,
                 double from,
                 double programmed,
                 double driven);

/* A row that is no motion: functions and dwells are noted where they stand. */
void note_event(struct engine *engine, const nc_block *row);
#endif
