/* Gates: how many technology functions have been freed and acknowledged. */
#include "engine/path/technology_counts.h"
#include "engine/state/state.h"

bool gate_open(const struct techno_counts *done,
               const struct techno_counts *need) {
    return done->std_freed >= need->std_freed
           && done->std_acked >= need->std_acked
           && done->late_freed >= need->late_freed
           && done->slm_acked >= need->slm_acked
           && done->slp_acked >= need->slp_acked;
}

bool same_techno(const struct techno_counts *now,
                 const struct techno_counts *then) {
    return ATOMIC_GET(now->std_freed) == then->std_freed
           && ATOMIC_GET(now->std_acked) == then->std_acked
           && ATOMIC_GET(now->late_freed) == then->late_freed
           && ATOMIC_GET(now->slm_acked) == then->slm_acked
           && ATOMIC_GET(now->slp_acked) == then->slp_acked;
}

struct techno_counts techno_done(const struct techno_counts *counts) {
    struct techno_counts techno_counts;
    techno_counts.std_freed = ATOMIC_GET(counts->std_freed);
    techno_counts.std_acked = ATOMIC_GET(counts->std_acked);
    techno_counts.late_freed = ATOMIC_GET(counts->late_freed);
    techno_counts.slm_acked = ATOMIC_GET(counts->slm_acked);
    techno_counts.slp_acked = ATOMIC_GET(counts->slp_acked);
    return techno_counts;
}
