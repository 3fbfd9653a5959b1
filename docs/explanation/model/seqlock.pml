/* Members that belong together: seq_begin, seq_end (c_ext/hli_sync.h) against hs_snapshot (c_ext/hli_sync.c).
 *
 * The writer may die at any step. Properties: a copy that is accepted is of one generation; a snapshot ends, with a copy
 * or with HS_TIMEOUT; a copy begun behind a completed publication is not older than that publication.
 */
#define ACTORS 2
#define CNC 0
#define PLC 1
#define LOCATIONS 3
#define GEN 0
#define WORD0 1
#define WORD1 2
#define WRITES 2
#define TRIES 2
#define STORES landed(CNC, GEN) landed(CNC, WORD0) landed(CNC, WORD1)
#define FETCHES fetch(PLC, GEN) fetch(PLC, WORD0) fetch(PLC, WORD1)
#include "memory.pml"

bit killed;

active proctype writer() {
    byte i;
    {
        skip;
        do
        :: i < WRITES ->
seq_begin:
#ifndef MUTATE_NO_ODD
            relaxed_store(CNC, GEN, 2 * i + 1);
#endif
#ifndef MUTATE_BEGIN_FENCE
            release_fence(CNC);
#endif
publish:
            relaxed_store(CNC, WORD0, i + 1);
            relaxed_store(CNC, WORD1, i + 1);
seq_end:
#ifdef MUTATE_END_RELEASE
            relaxed_store(CNC, GEN, 2 * i + 2);
#else
            release_store(CNC, GEN, 2 * i + 2);
#endif
            i++
        :: else -> break
        od
    } unless { killed };
    buried(CNC)
}

active proctype reader() {
    byte try, before, behind, a, b;
    do
    :: try < TRIES ->
hs_snapshot:
#ifdef MUTATE_FIRST_ACQUIRE
        relaxed_load(PLC, GEN, before);
#else
        acquire_load(PLC, GEN, before);
#endif
#ifndef MUTATE_ODD_ACCEPTED
        if
        :: before % 2 -> goto again
        :: else
        fi;
#endif
copy_relaxed:
        relaxed_load(PLC, WORD0, a);
        relaxed_load(PLC, WORD1, b);
#ifndef MUTATE_SECOND_FENCE
        acquire_fence(PLC);
#endif
        relaxed_load(PLC, GEN, behind);
        if
        :: behind == before -> assert(a == b && a == before / 2); break
        :: else
        fi;
again:
        skip;
        d_step { try++; a = 0; b = 0; before = 0; behind = 0 }
    :: else -> break /* HS_TIMEOUT */
    od
}

active proctype fate() { if :: killed = 1 :: skip fi }
