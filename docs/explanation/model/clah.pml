/* The contour look-ahead unit: one semaphore, two request words, two answer words (c_ext/hli_sync.c, c_ext/serve.c).
 *
 * Both sides may die once, at any step. A CNC that starts again makes a new segment (attach.pml says how),
 * a PLC that starts again finds what its predecessor left in the old one. serve_request is the same function in both
 * service modes; what the immediate mode adds, an interpolator that goes on while the facts are copied, is ring.pml.
 * Properties: each answer taken belongs whole to the request of the one who takes it; no request is answered twice; every
 * request of a living PLC to a living CNC is answered (else: invalid end state).
 */
#define SEGMENTS 2
#define PER_SEGMENT 5
#define ACTORS 2
#define CNC 0
#define PLC 1
#define LOCATIONS 10
#define SEM(s) (5 * (s))
#define START(s) (5 * (s) + 1)
#define LENGTH(s) (5 * (s) + 2)
#define ROW0(s) (5 * (s) + 3)
#define ROW1(s) (5 * (s) + 4)
#define REQUESTS 2 /* each PLC that lives long enough has answered */
#define STORES_OF(s) landed(PLC, SEM(s)) landed(PLC, START(s)) landed(PLC, LENGTH(s)) landed(CNC, SEM(s)) \
    landed(CNC, ROW0(s)) landed(CNC, ROW1(s))
#define FETCHES_OF(s) fetch(CNC, LENGTH(s)) fetch(PLC, ROW1(s)) /* one of each pair is enough to tear it */
#define STORES STORES_OF(0) STORES_OF(1)
#define FETCHES FETCHES_OF(0) FETCHES_OF(1)
#include "memory.pml"

bit killed[ACTORS];
bit alive[SEGMENTS];   /* hs_process_alive of the segment's owner */
byte segments;         /* created; the last one has the name */
byte asked;            /* ids of requests, unique */
byte answered[8];

proctype cnc() {
    byte s, a, b, sem;
restart:
    {
        skip;
create_: /* hli.segment.create: all zero, with its name in one step */
        atomic { s = segments; alive[s] = 1; segments++ };
end_serve:
        do
        :: atomic { mem[SEM(s)] == 1 -> skip };
serve_request:
#ifdef MUTATE_SERVE_ACQUIRE
            relaxed_load(CNC, SEM(s), sem);
#else
            acquire_load(CNC, SEM(s), sem);
#endif
            if :: sem == 0 -> goto end_serve :: else fi;
#ifdef MUTATE_COPY_BEFORE_ANSWER
            /* the request is looked at again after the semaphore fell */
            release_store(CNC, SEM(s), 0);
#endif
            relaxed_load(CNC, START(s), a);
            relaxed_load(CNC, LENGTH(s), b);
            assert(a == b); /* request torn */
#ifndef MUTATE_COPY_BEFORE_ANSWER
            d_step { answered[a]++; assert(answered[a] == 1) };
#endif
answer_:
            relaxed_store(CNC, ROW0(s), a);
            relaxed_store(CNC, ROW1(s), b);
#ifdef MUTATE_ANSWER_RELEASE
            relaxed_store(CNC, SEM(s), 0);
#else
#ifndef MUTATE_COPY_BEFORE_ANSWER
            release_store(CNC, SEM(s), 0);
#endif
#endif
#ifdef MUTATE_ANSWER_TWICE
            relaxed_load(CNC, START(s), a);
            d_step { answered[a]++; assert(answered[a] == 1) };
#endif
            a = 0; b = 0; sem = 0
        od
    } unless { killed[CNC] };
    buried(CNC);
    d_step { a = 0; b = 0; sem = 0; killed[CNC] = 0; alive[s] = 0 };
    goto restart
}

#define gone(s) (!alive[s])

proctype plc() {
    byte s, id, a, b, sem, done;
restart:
    {
        skip;
attach_running:
        atomic { segments > 0 && alive[segments - 1] -> s = segments - 1 };
        do
        :: done == REQUESTS -> goto finished
        :: else ->
hs_clah_call_free: /* wait until semaphor_rw FALSE; the CNC's death is seen in every slice of the wait */
#ifndef MUTATE_NO_WAIT_FREE
            if
            :: atomic { mem[SEM(s)] == 0 -> skip }
            :: atomic { gone(s) -> sem = 0; goto attach_running }
            fi;
            acquire_load(PLC, SEM(s), sem);
            if :: sem != 0 -> goto hs_clah_call_free :: else fi;
#endif
hs_clah_request:
            d_step { asked++; id = asked };
#ifdef MUTATE_SEMAPHORE_FIRST
            release_store(PLC, SEM(s), 1);
#endif
            relaxed_store(PLC, START(s), id);
            relaxed_store(PLC, LENGTH(s), id);
#ifdef MUTATE_REQUEST_RELEASE
            relaxed_store(PLC, SEM(s), 1);
#else
#ifndef MUTATE_SEMAPHORE_FIRST
            release_store(PLC, SEM(s), 1);
#endif
#endif
hs_clah_await:
            atomic {
                if
                :: !buf[PLC].pending[SEM(s)] && mem[SEM(s)] == 0 -> skip
#ifndef MUTATE_NO_LIFE_CHECK
                :: gone(s) -> d_step { id = 0; a = 0; b = 0; sem = 0 }; goto attach_running
#endif
                fi
            };
#ifdef MUTATE_AWAIT_ACQUIRE
            relaxed_load(PLC, SEM(s), sem);
#else
            acquire_load(PLC, SEM(s), sem);
#endif
copy_answer:
            relaxed_load(PLC, ROW0(s), a);
            relaxed_load(PLC, ROW1(s), b);
            assert(a == id && b == id); /* torn, stale or somebody else's */
            d_step { done++; id = 0; a = 0; b = 0; sem = 0 }
        od
    } unless { killed[PLC] };
    buried(PLC);
    d_step { id = 0; a = 0; b = 0; sem = 0; killed[PLC] = 0; done = 0 };
    goto restart;
finished:
    skip
}

proctype fate() {
    /* one death of each side at any step */
    if :: killed[CNC] = 1 :: skip fi;
    killed[CNC] == 0;
    if :: killed[PLC] = 1 :: skip fi
}

init { atomic { run cnc(); run plc(); run fate() } }
