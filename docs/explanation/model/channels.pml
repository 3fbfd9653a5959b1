/* The contour look-ahead of several channels: a unit each, one server and one bell for all (serve_main, serve_all in
 * c_ext/engine/threads.c; hs_clah_request, hs_clah_answer in c_ext/hli/sync.c).
 *
 * In each scan the PLC asks both channels and takes both answers, in any order. The server sleeps while the bell is what
 * it was before it looked at the units. The code looks again after a while; the model leaves that out, so that a wake
 * that is lost shows. One unit alone, with deaths, is clah.pml; the sleep itself is word.pml.
 * Properties: an answer belongs to the channel and the request; each request is answered once (else: invalid end state).
 */
#define CHANNELS 2
#define SCANS 2
#define ACTORS 2
#define CNC 0
#define PLC 1
#define BELL 0
#define SEM(c) (1 + 3 * (c))
#define ASK(c) (2 + 3 * (c))
#define ROW(c) (3 + 3 * (c))
#define LOCATIONS 7
#define OF(c, scan) (1 + (c) + CHANNELS * (scan)) /* unique among all requests */
#define STORES_OF(c) landed(PLC, SEM(c)) landed(PLC, ASK(c)) landed(CNC, SEM(c)) landed(CNC, ROW(c))
#define STORES STORES_OF(0) STORES_OF(1)
#define FETCHES fetch(CNC, ASK(0)) fetch(CNC, ASK(1)) fetch(PLC, ROW(0)) fetch(PLC, ROW(1))
#include "memory.pml"

byte answered[1 + CHANNELS * SCANS];

active proctype server() {
    byte seen, c, sem, ask, served;
end_serve:
    do
    ::
#ifndef MUTATE_BELL_BEHIND_THE_UNITS
        acquire_load(CNC, BELL, seen);
#endif
        d_step { c = 0; served = 0 };
serve_all:
        do
        :: c < CHANNELS ->
            acquire_load(CNC, SEM(c), sem);
            if
            :: sem ->
                relaxed_load(CNC, ASK(c), ask);
                d_step {
                    assert((ask - 1) % CHANNELS == c); /* another channel's request */
                    answered[ask]++;
                    assert(answered[ask] == 1);
                    served = 1
                };
#ifdef MUTATE_ONE_BUFFER
                relaxed_store(CNC, ROW(0), ask);
#else
                relaxed_store(CNC, ROW(c), ask);
#endif
                release_store(CNC, SEM(c), 0);
#ifdef MUTATE_ONE_REQUEST_A_LOOK
                d_step { c = CHANNELS; served = 0 };
                goto sleep
#endif
            :: else
            fi;
            c++
        :: else -> break
        od;
sleep:
#ifdef MUTATE_BELL_BEHIND_THE_UNITS
        acquire_load(CNC, BELL, seen);
#endif
        if
        :: served
        :: else ->
end_sleep:  /* the kernel compares and sleeps in one step */
            mem[BELL] != seen
        fi;
        d_step { sem = 0; ask = 0 }
    od
}

inline hs_clah_request(c) {
#ifdef MUTATE_SEMAPHORE_FIRST
    release_store(PLC, SEM(c), 1);
    relaxed_store(PLC, ASK(c), OF(c, scan));
#else
    relaxed_store(PLC, ASK(c), OF(c, scan));
    release_store(PLC, SEM(c), 1);
#endif
#ifdef MUTATE_BELL_UNORDERED
    atomic { mem[BELL]++ }
#else
    atomic { buf[PLC].count == 0; mem[BELL]++ } /* fetch_add, release */
#endif
}

inline hs_clah_take(c) {
    atomic { !buf[PLC].pending[SEM(c)] && mem[SEM(c)] == 0 -> skip };
#ifdef MUTATE_TAKE_ACQUIRE
    relaxed_load(PLC, SEM(c), sem);
#else
    acquire_load(PLC, SEM(c), sem);
#endif
    relaxed_load(PLC, ROW(c), row);
    assert(row == OF(c, scan)); /* stale, or another channel's */
    d_step { sem = 0; row = 0 }
}

active proctype plc() {
    byte scan, sem, row;
    do
    :: scan == SCANS -> break
    :: else ->
        hs_clah_request(0);
        hs_clah_request(1);
        if
        :: hs_clah_take(0); hs_clah_take(1)
        :: hs_clah_take(1); hs_clah_take(0)
        fi;
        scan++
    od
}
