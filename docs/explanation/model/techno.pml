/* One technology unit with its two flags: put_out, look_at_unit, techno_clear_units (c_ext/techno.c, engine_program.c)
 * against hs_techno_next, hs_techno_fetch, hs_techno_done, hs_techno_take (c_ext/hli_sync.c).
 *
 * Functions 1..LAST go through the same unit; the odd ones (MOS) are free when fetched, the even ones wait for done_w.
 * The PLC may die at any step. If it has fetched a waiting function and not acknowledged it, nobody can know whether it was
 * carried out: the CNC keeps waiting and says so, until the channel is reset.
 * Properties: each function is fetched whole, in order, once; a waiting function is acknowledged only when it has been
 * carried out; the path never goes on without; behind a reset everything goes on.
 */
#define ACTORS 2
#define CNC 0
#define PLC 1
#define LOCATIONS 4
#define PLEASE 0
#define DONE 1
#define DATA0 2
#define DATA1 3
#define LAST 4
#define WAITS(id) ((id) % 2 == 0)
#define STORES landed(CNC, PLEASE) landed(CNC, DONE) landed(CNC, DATA0) landed(CNC, DATA1) landed(PLC, PLEASE) landed(PLC, DONE)
#define FETCHES fetch(PLC, DATA1) fetch(CNC, DONE)
#include "memory.pml"

bit killed, orphan;   /* orphan: fetched by a PLC that died before it acknowledged */
byte fetched_[LAST + 1], carried[LAST + 1], acked, died_with, at_id;

active proctype cnc() {
    byte id = 1, please, done;
    bit reset;
    do
    :: id <= LAST ->
put_out:
        relaxed_store(CNC, DATA0, id);
        relaxed_store(CNC, DATA1, id);
#ifdef MUTATE_PLEASE_BEFORE_DONE
        release_store(CNC, PLEASE, 1);
        release_store(CNC, DONE, 0);
#else
#ifndef MUTATE_DONE_STAYS
        release_store(CNC, DONE, 0);
#endif
#ifdef MUTATE_PLEASE_RELEASE
        relaxed_store(CNC, PLEASE, 1);
#else
        release_store(CNC, PLEASE, 1);
#endif
#endif
look_at_unit:
        if
        :: atomic { !buf[CNC].pending[PLEASE] && mem[PLEASE] == 0 && (!WAITS(id) || mem[DONE] == 1) -> skip }
        :: atomic { orphan && WAITS(id) && mem[PLEASE] == 0 && mem[DONE] == 0 -> reset = 1 }
        fi;
        if
        :: reset ->
techno_clear_units:
            release_store(CNC, PLEASE, 0);
            d_step { reset = 0; orphan = 0 }
        :: else ->
            acquire_load(CNC, PLEASE, please);
            acquire_load(CNC, DONE, done);
            if
            :: please == 0 && done == 1 && WAITS(id) -> assert(carried[id] == 1); acked = id
            :: please == 0 && !WAITS(id) && done == 1 -> acked = id
            :: else
            fi
        fi;
        d_step { id++; please = 0; done = 0 }
    :: else -> break
    od;
    assert(fetched_[1] && fetched_[3]) /* functions nobody waits for are not lost either */
}

proctype plc() {
    byte a, b, please, last;
restart:
    {
        skip;
end_cyclic:
        do
        :: atomic { mem[PLEASE] == 1 && !buf[PLC].pending[PLEASE] -> skip };
hs_techno_next:
#ifdef MUTATE_NEXT_ACQUIRE
            relaxed_load(PLC, PLEASE, please);
#else
            acquire_load(PLC, PLEASE, please);
#endif
#ifdef MUTATE_FETCH_BEFORE_COPY
            release_store(PLC, PLEASE, 0);
#endif
            relaxed_load(PLC, DATA0, a);
            relaxed_load(PLC, DATA1, b);
            assert(a == b && a > last); /* whole, in order, not the same once more */
            at_id = a;
            if
            :: !WAITS(a) ->
                if
                :: skip; /* hs_techno_fetch alone: MOS needs no acknowledgement */
#ifndef MUTATE_FETCH_BEFORE_COPY
                    atomic { release_store(PLC, PLEASE, 0); fetched_[a]++; carried[a]++; last = a }
#else
                    d_step { fetched_[a]++; carried[a]++; last = a }
#endif
#ifdef MUTATE_LATE_ACK_OF_MOS
                :: atomic { release_store(PLC, PLEASE, 0); fetched_[a]++; carried[a]++; last = a };
                    release_store(PLC, DONE, 1)
#else
                :: skip; /* hs_techno_take: done_w ahead of please_rw */
                    release_store(PLC, DONE, 1);
                    atomic { release_store(PLC, PLEASE, 0); fetched_[a]++; carried[a]++; last = a }
#endif
                fi
            :: else ->
hs_techno_fetch:
                atomic { release_store(PLC, PLEASE, 0); fetched_[a]++; orphan = 0; last = a };
#ifdef MUTATE_DONE_BEFORE_CARRIED
                release_store(PLC, DONE, 1);
#endif
                carried[a]++;
hs_techno_done:
#ifndef MUTATE_DONE_BEFORE_CARRIED
                release_store(PLC, DONE, 1)
#else
                skip
#endif
            fi;
            assert(fetched_[last] == 1);
            d_step { a = 0; b = 0; please = 0; at_id = 0 }
        od
    } unless { killed };
    buried(PLC);
    d_step {
        killed = 0; a = 0; b = 0; please = 0;
        if :: at_id && WAITS(at_id) && fetched_[at_id] && mem[DONE] == 0 -> orphan = 1 :: else fi;
        at_id = 0
    };
    goto restart
}

active proctype fate() { if :: killed = 1 :: skip fi }

init { run plc() }
