/* Which elements the look-ahead shows at present. */
#ifndef ENGINE_LOOKAHEAD_WINDOW_H
#define ENGINE_LOOKAHEAD_WINDOW_H
#include "engine/state/state.h"

typedef struct range {
    uint64_t first, end;   /* element ids; of the present epoch */
    uint64_t window, head; /* end of those of any epoch; pushed */
    double shift; /* 0.1 um: what passes of real-time loops have added to the
                     distances */
    uint32_t epoch, resets;
    uint32_t last; /* epoch of its end: one more where a loop will be entered */
    bool finished; /* behind `head` nothing comes */
} range;

/* Elements of one epoch, and where its distances begin: 0.1 um of path behind
 * the zero of the present epoch. */
typedef struct stretch {
    uint64_t first, end;
    double shift, zero;
    uint32_t epoch, last;
} stretch;

/* Epochs as the PLC sees them count from 1; 0 is the present one. */
static inline uint32_t epoch_shown(uint32_t epoch) {
    return epoch + 1;
}

/* The program was aborted: nothing more is driven of it. */
bool left_out(const struct program_state *program);

/* dist_prog_start, 0.1 um. */
double displayed_distance(const struct geo *geo);

bool mode2_available(const engine_config *cfg);
struct range window_range(struct engine *engine);

/* Whether no slot that the range begins with was used again meanwhile. */
bool range_holds(struct engine *engine, const struct range *range);

struct stretch stretch_now(const struct range *range);

/* The next epoch, if it has elements in the window. */
bool stretch_next(const struct piece_store *store,
                  const struct range *range,
                  struct stretch *stretch);

/* First element of the stretch that ends behind `start`. */
uint64_t first_behind(const struct piece_store *store,
                      const struct stretch *stretch,
                      double start);

/* HLI_AHEAD_END_...: what is known ends with, behind this stretch. */
uint32_t stretch_end(const struct piece_store *store,
                     const struct range *range,
                     const struct stretch *stretch);
#endif
