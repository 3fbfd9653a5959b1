/* The queue of the look-ahead extension: a slot that two tasks of a PLC use without waiting for each other
 * (c_ext/hli/queue.c, serve_queue of c_ext/engine/lookahead/service.c).
 *
 * The slots know nothing of each other: one of them, wanted by two tasks, stands for four and many.
 * A slot's word holds the PLC's generation and a phase. A PLC may die once, at any step, with both of its tasks. The next
 * one has another generation and finds the slot as it was left. It comes when the stores of the dead one have landed
 * (attach.pml).
 * Properties: the slot has one owner; each answer taken belongs to the request of the one who takes it; no request is
 * answered twice; every request of a living task is answered, and the slot is not lost (else: invalid end state).
 */
#define TASKS 2
#define ACTORS 3 /* tasks 0 and 1, CNC */
#define CNC 2
#define LOCATIONS 3
#define WORD 0
#define START 1
#define ROW 2
#define STORES landed(0, WORD) landed(1, WORD) landed(0, START) landed(1, START) landed(CNC, WORD) landed(CNC, ROW)
#define FETCHES fetch(CNC, START) fetch(0, ROW) fetch(1, ROW)
#include "memory.pml"

#define FREE 0
#define CLAIMED 1
#define ASKED 2
#define ANSWERED 3
#define word_of(generation, phase) (4 * (generation) + (phase))
#define phase_of(word) ((word) % 4)
#define generation_of(word) ((word) / 4)

bit killed;
bit dead_or_spared;  /* the PLC will not die any more */
byte down;           /* tasks that have noticed */
byte generation = 1; /* of the PLC that is attached */
byte ids;            /* of requests, unique */
byte answered[8];
byte owner; /* id of the request that a living task has there */

proctype cnc() {
    byte id, word;
end_serve:
    do
    :: atomic { phase_of(mem[WORD]) == ASKED -> skip };
serve_slot:
#ifdef MUTATE_SERVE_ACQUIRE
        relaxed_load(CNC, WORD, word);
#else
        acquire_load(CNC, WORD, word);
#endif
        if :: phase_of(word) != ASKED -> goto end_serve :: else fi;
        relaxed_load(CNC, START, id);
        d_step { answered[id]++; assert(answered[id] == 1) };
        relaxed_store(CNC, ROW, id);
#ifdef MUTATE_ANSWER_RELEASE
        relaxed_store(CNC, WORD, word_of(generation_of(word), ANSWERED));
#else
        release_store(CNC, WORD, word_of(generation_of(word), ANSWERED));
#endif
        buf[CNC].count == 0; /* it looks again in its next cycle */
        id = 0; word = 0
    od
}

/* Free, or left behind by another PLC. */
#ifdef MUTATE_ASKED_IS_FREE
#define is_free(word) (phase_of(word) == FREE || generation_of(word) != generation)
#else
#ifdef MUTATE_LEFT_BEHIND_STAYS
#define is_free(word) (phase_of(word) == FREE)
#else
#define is_free(word) (phase_of(word) == FREE || (generation_of(word) != generation && phase_of(word) != ASKED))
#endif
#endif

proctype task(byte me) {
    byte id, word, row;
restart:
    {
        skip;
hs_ahead_claim:
        atomic { is_free(mem[WORD]) -> skip };
#ifdef MUTATE_CLAIM_WITHOUT_CAS
        acquire_load(me, WORD, word);
        if :: !is_free(word) -> goto hs_ahead_claim :: else fi;
        release_store(me, WORD, word_of(generation, CLAIMED));
#else
        atomic { /* compare and exchange */
            buf[me].count == 0;
            if
            :: is_free(mem[WORD]) -> mem[WORD] = word_of(generation, CLAIMED); forget(me)
            :: else -> goto hs_ahead_claim
            fi
        };
#endif
        d_step { ids++; id = ids; assert(owner == 0); owner = id };
        relaxed_store(me, START, id);
hs_ahead_ask:
#ifdef MUTATE_ASK_RELEASE
        relaxed_store(me, WORD, word_of(generation, ASKED));
#else
        release_store(me, WORD, word_of(generation, ASKED));
#endif
hs_ahead_take:
        atomic { !buf[me].pending[WORD] && mem[WORD] == word_of(generation, ANSWERED) -> skip };
#ifdef MUTATE_TAKE_ACQUIRE
        relaxed_load(me, WORD, word);
#else
        acquire_load(me, WORD, word);
#endif
#ifdef MUTATE_FREE_BEFORE_COPY
        d_step { owner = 0 };
        release_store(me, WORD, FREE);
#endif
        relaxed_load(me, ROW, row);
        assert(row == id); /* stale or somebody else's */
#ifndef MUTATE_FREE_BEFORE_COPY
        d_step { owner = 0 };
        release_store(me, WORD, FREE);
#endif
        goto finished
    } unless { killed };
    buried(me);
    d_step {
        if :: id > 0 && owner == id -> owner = 0 :: else fi;
        id = 0; word = 0; row = 0; down++
    };
    !killed;
    goto restart;
finished:
    if /* a task that has what it wanted stays until the PLC goes */
    :: killed -> buried(me); down++; !killed; id = 0; word = 0; row = 0; goto restart
    :: atomic { dead_or_spared -> skip }
    fi
}



proctype fate() {
    if
    :: killed = 1;
        atomic { down == TASKS -> generation++; killed = 0 }
    :: skip
    fi;
    dead_or_spared = 1
}

init { atomic { run cnc(); run task(0); run task(1); run fate() } }
