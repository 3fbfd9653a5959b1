/* What a request of the look-ahead is answered with. */
#ifndef ENGINE_LOOKAHEAD_ANSWER_H
#define ENGINE_LOOKAHEAD_ANSWER_H
#include "engine/state/state.h"

#define ANSWER_MAX (HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1)

/* A private copy of what the PLC wrote. */
typedef struct question {
    double start, length;
    uint32_t mode, flags, epoch;
} question;

/* Fills `out`, and `details` unless it is NULL, up to the last element; `facts`
 * tells how many there are and, if none, why. */
void answer_question(struct engine *engine,
                     const struct question *question,
                     HLI_CONTOUR_LOOKAHEAD_BLOCK *out,
                     HLI_AHEAD_DETAIL *details,
                     HLI_AHEAD_ANSWER *facts);
#endif
