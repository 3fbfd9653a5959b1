/* Gates: how many technology functions have been freed and acknowledged. */
#ifndef ENGINE_PATH_TECHNOLOGY_COUNTS_H
#define ENGINE_PATH_TECHNOLOGY_COUNTS_H
#include "engine/state/state.h"

bool gate_open(const struct techno_counts *done,
               const struct techno_counts *need);
bool same_techno(const struct techno_counts *now,
                 const struct techno_counts *then);
struct techno_counts techno_done(const struct techno_counts *counts);
#endif
