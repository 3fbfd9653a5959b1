/* Functions that a PLC has fetched and not acknowledged, for the next PLC. */
#ifndef TECHNOLOGY_AGAIN_H
#define TECHNOLOGY_AGAIN_H
#include <stdbool.h>
#include <stdint.h>
struct engine;

/* Around putting out; the generation of the PLC that it is put out to. */
uint32_t begin_output(struct engine *engine);
void end_output(struct engine *engine);
/* Bit of the first unit of a spindle in the marks; the others are those of
 * HLI_SIDE_TECHNO. */
#define TECHNO_BIT_SPINDLE 40u
/* Whether a unit's function is offered once more. */
void mark_again(struct engine *engine, uint32_t bit, bool again);
void offer_again(struct engine *engine);
#endif
