/* Rows of technology functions become output and gate pieces of the store. */
#ifndef ENGINE_STORE_TECHNOLOGY_ROWS_H
#define ENGINE_STORE_TECHNOLOGY_ROWS_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* Functions that are put out or waited for behind the motion of their block. */
void techno_block_end(struct engine *engine);

/* Room for what one row may add. */
bool techno_has_room(const struct engine *engine);

/* An S word of a block without M3, M4, M5, M19: a turning spindle changes its
 * speed. */
void techno_spindle_word(struct engine *engine);

/* A function row; false if it is no function that goes to the PLC. */
bool techno_push(struct engine *engine, const nc_block *row);

/* MVS_SLM: the transition to the next G01, G02, G03. MVS_SLP: at #EXPL SYN. */
void techno_before_motion(struct engine *engine, const nc_block *row);
void techno_expl_syn(struct engine *engine, const nc_block *row);

/* A wait for functions, which is no row of its own. */
bool is_gate(const struct piece *piece);

/* Behind a halt: functions that were left out are awaited no more. */
void techno_left_out(struct engine *engine);
#endif
