/* One technology unit with its two flags: put_out, look_at_unit (c_ext/engine/geo/technology.c) and offer_again
 * (c_ext/engine/path/technology_again.c) against hs_plc_register, hs_techno_next, hs_techno_fetch, hs_techno_done, hs_techno_take
 * (c_ext/hli/sync.c).
 *
 * Functions 1..LAST go through the same unit; the odd ones (MOS) are free when fetched, the even ones wait for done_w.
 * The PLC may die at any step, while it attaches too. If it has fetched a waiting function and not acknowledged it, nobody
 * can know whether it was carried out: the function is offered again to the next PLC, with a mark.
 * Properties: each function is fetched whole, in order, once, and once more only with the mark and only by another PLC than
 * the one that fetched it first; a waiting function is acknowledged only when it has been carried out; the path never goes
 * on without; behind a death everything goes on.
 */
#define ACTORS 2
#define CNC 0
#define PLC 1
#define LOCATIONS 9
#define PLEASE 0
#define DONE 1
#define DATA0 2
#define DATA1 3
#define GENERATION 4
#define SHOWN 5
#define ATTACHED 6
#define AGAIN 7
#define BUSY 8 /* 1 while the CNC puts out */
#define LAST 4
#define WAITS(id) ((id) % 2 == 0)
#define STORES landed(CNC, PLEASE) landed(CNC, DONE) landed(CNC, DATA0) landed(CNC, DATA1) landed(CNC, AGAIN) landed(CNC, BUSY) \
               landed(PLC, PLEASE) landed(PLC, DONE) landed(PLC, GENERATION) landed(PLC, SHOWN) landed(PLC, ATTACHED)
#define FETCHES fetch(PLC, DATA1) fetch(CNC, DONE)
#include "memory.pml"

bit killed;
byte fetched_[LAST + 1], fetcher[LAST + 1], carried[LAST + 1], acked;

active proctype cnc() {
    byte id = 1, please, done, made, now, seen;
    do
    :: id <= LAST ->
put_out:
        relaxed_store(CNC, BUSY, 1);
#ifndef MUTATE_PUT_OUT_FENCE
        full_fence(CNC);
#endif
#ifndef MUTATE_PLEASE_BEFORE_GENERATION
        acquire_load(CNC, GENERATION, made);
#endif
        relaxed_store(CNC, DATA0, id);
        relaxed_store(CNC, DATA1, id);
        relaxed_store(CNC, AGAIN, 0);
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
#ifdef MUTATE_PLEASE_BEFORE_GENERATION
        acquire_load(CNC, GENERATION, made);
#endif
        release_store(CNC, BUSY, 0);
        do
        :: atomic { !buf[CNC].pending[PLEASE] && mem[PLEASE] == 0 && (!WAITS(id) || mem[DONE] == 1) -> break }
        :: atomic { mem[GENERATION] != seen && mem[ATTACHED] -> skip };
offer_again:
            acquire_load(CNC, GENERATION, now);
#ifdef MUTATE_ATTACHED_IGNORED
            please = 1;
#else
            acquire_load(CNC, ATTACHED, please);
#endif
            if
            :: please ->
                seen = now;
                acquire_load(CNC, SHOWN, now);
                acquire_load(CNC, PLEASE, please);
                acquire_load(CNC, DONE, done);
                if
#ifdef MUTATE_SHOWN_IGNORED
                :: WAITS(id) && made != seen && !please && !done ->
#else
#ifdef MUTATE_MADE_IGNORED
                :: WAITS(id) && !now && !please && !done ->
#else
                :: WAITS(id) && made != seen && !now && !please && !done ->
#endif
#endif
                    relaxed_store(CNC, AGAIN, 1);
#ifdef MUTATE_AGAIN_RELEASE
                    relaxed_store(CNC, PLEASE, 1)
#else
                    release_store(CNC, PLEASE, 1)
#endif
                :: else
                fi
            :: else
            fi;
            d_step { please = 0; done = 0; now = 0 }
        od;
look_at_unit:
        acquire_load(CNC, PLEASE, please);
        acquire_load(CNC, DONE, done);
        if
        :: please == 0 && done == 1 && WAITS(id) -> assert(carried[id]); acked = id
        :: please == 0 && !WAITS(id) && done == 1 -> acked = id
        :: else
        fi;
        d_step { id++; please = 0; done = 0; made = 0 }
    :: else -> break
    od;
    assert(fetched_[1] && fetched_[3]) /* functions nobody waits for are not lost either */
}

proctype plc() {
    byte a, b, please, me;
restart:
    {
        skip;
hs_plc_register:
        release_store(PLC, ATTACHED, 0);
        me++;
#ifdef MUTATE_SHOWN_BEFORE_GENERATION
        acquire_load(PLC, PLEASE, please);
        release_store(PLC, GENERATION, me);
#else
        release_store(PLC, GENERATION, me);
#ifndef MUTATE_REGISTER_FENCE
        full_fence(PLC);
#endif
#ifndef MUTATE_BUSY_IGNORED
        atomic { mem[BUSY] == 0 -> acquire_fence(PLC) };
#endif
        acquire_load(PLC, PLEASE, please);
#endif
        release_store(PLC, SHOWN, please);
        release_store(PLC, ATTACHED, 1);
        please = 0;
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
            relaxed_load(PLC, AGAIN, please);
            assert(a == b && fetched_[a] == please); /* whole; once, and once more with the mark */
            assert(!please || fetcher[a] != me);
            assert(a == 1 || fetched_[a - 1]);
            if
            :: !WAITS(a) ->
                if
                :: skip; /* hs_techno_fetch alone: MOS needs no acknowledgement */
#ifndef MUTATE_FETCH_BEFORE_COPY
                    atomic { release_store(PLC, PLEASE, 0); fetched_[a]++; carried[a]++ }
#else
                    d_step { fetched_[a]++; carried[a]++ }
#endif
#ifdef MUTATE_LATE_ACK_OF_MOS
                :: atomic { release_store(PLC, PLEASE, 0); fetched_[a]++; carried[a]++ };
                    release_store(PLC, DONE, 1)
#else
                :: skip; /* hs_techno_take: done_w ahead of please_rw */
                    release_store(PLC, DONE, 1);
                    atomic { release_store(PLC, PLEASE, 0); fetched_[a]++; carried[a]++ }
#endif
                fi
            :: else ->
hs_techno_fetch:
                atomic { release_store(PLC, PLEASE, 0); fetched_[a]++; fetcher[a] = me };
#ifdef MUTATE_DONE_BEFORE_CARRIED
                release_store(PLC, DONE, 1);
#endif
                carried[a] = 1;
hs_techno_done:
#ifndef MUTATE_DONE_BEFORE_CARRIED
                release_store(PLC, DONE, 1)
#else
                skip
#endif
            fi;
            d_step { a = 0; b = 0; please = 0 }
        od
    } unless { killed };
    buried(PLC);
    d_step { killed = 0; a = 0; b = 0; please = 0 };
    goto restart
}

active proctype fate() { if :: killed = 1 :: skip fi }

init { run plc() }
