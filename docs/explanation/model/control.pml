/* A control unit with usage check (command_semaphor_rw) and the way of its command to the cell: take_command and
 * engine_take_mode_command (c_ext/mode.c). The PLC writes, GEO takes in its cycle, the cell's thread carries out.
 *
 * The PLC may die at any step; its successor goes on behind what has been taken. Properties: each command taken is whole,
 * each command of a PLC that lives on is carried out, once, in order; every wait ends.
 */
#define ACTORS 3
#define PLC 0
#define GEO 1
#define CELL 2
#define LOCATIONS 6
#define SEM 0
#define TO_MODE 1
#define TO_STATE 2
#define PENDING 3
#define MODE 4
#define STATE 5
#define COMMANDS 3
#define STORES landed(PLC, SEM) landed(PLC, TO_MODE) landed(PLC, TO_STATE) landed(GEO, SEM) landed(GEO, PENDING) \
    landed(GEO, MODE) landed(GEO, STATE) landed(CELL, PENDING)
#define FETCHES fetch(GEO, TO_STATE) fetch(CELL, STATE)
#include "memory.pml"

bit killed;
byte given;   /* last command whose semaphore a living PLC has set */
byte carried; /* last one carried out */
byte lost;    /* the one the dead PLC was at */

proctype plc() {
    byte sem;
restart:
    {
        skip;
        do
        :: given < COMMANDS ->
#ifndef MUTATE_NO_WAIT_FREE
            (mem[SEM] == 0 && buf[PLC].count == 0);
            acquire_load(PLC, SEM, sem);
#endif
            given++;
            relaxed_store(PLC, TO_MODE, given);
            relaxed_store(PLC, TO_STATE, given);
#ifdef MUTATE_COMMAND_RELEASE
            relaxed_store(PLC, SEM, 1)
#else
            release_store(PLC, SEM, 1)
#endif
        :: else -> break
        od
    } unless { killed };
    buried(PLC);
    if
    :: killed -> d_step { killed = 0; lost = given }; goto restart
    :: else
    fi
}

active proctype geo() {
    byte a, b, flag;
end_mode_cycle:
    do
    :: atomic { mem[SEM] == 1 && !buf[GEO].pending[SEM] -> skip };
take_command:
#ifdef MUTATE_TAKE_ACQUIRE
        relaxed_load(GEO, SEM, flag);
#else
        acquire_load(GEO, SEM, flag);
#endif
#ifndef MUTATE_PENDING_IGNORED
        (mem[PENDING] == 0 && !buf[GEO].pending[PENDING]); /* one at a time: the next cycles look again */
#ifdef MUTATE_TAKE_ACQUIRE
        relaxed_load(GEO, PENDING, flag);
#else
        acquire_load(GEO, PENDING, flag);
#endif
#endif
#ifdef MUTATE_TAKEN_BEFORE_COPIED
        release_store(GEO, SEM, 0);
#endif
read_command:
        relaxed_load(GEO, TO_MODE, a);
        relaxed_load(GEO, TO_STATE, b);
        assert(a == b);
#ifndef MUTATE_TAKEN_BEFORE_COPIED
        release_store(GEO, SEM, 0);
#endif
        relaxed_store(GEO, MODE, a);
        relaxed_store(GEO, STATE, b);
#ifdef MUTATE_PENDING_RELEASE
        relaxed_store(GEO, PENDING, 1);
#else
        release_store(GEO, PENDING, 1);
#endif
        d_step { a = 0; b = 0; flag = 0 }
    od
}

active proctype cell() {
    byte a, b, flag;
end_pending_event:
    do
    :: atomic { mem[PENDING] == 1 && !buf[CELL].pending[PENDING] -> skip };
engine_take_mode_command:
#ifdef MUTATE_PENDING_ACQUIRE
        relaxed_load(CELL, PENDING, flag);
#else
        acquire_load(CELL, PENDING, flag);
#endif
#ifdef MUTATE_FREED_BEFORE_COPIED
        release_store(CELL, PENDING, 0);
#endif
        relaxed_load(CELL, MODE, a);
        relaxed_load(CELL, STATE, b);
#ifndef MUTATE_FREED_BEFORE_COPIED
        release_store(CELL, PENDING, 0);
#endif
        assert(a == b);
        assert(a == carried + 1 || (a == carried + 2 && lost == carried + 1)); /* in order, none lost, none twice */
        d_step { carried = a; a = 0; b = 0; flag = 0 }
    od
}

active proctype fate() { if :: killed = 1 :: skip fi }

/* At rest everything that was given has been carried out. */
active proctype rest() {
    timeout;
    assert(given == COMMANDS && (carried == COMMANDS || lost == COMMANDS))
}

init { run plc() }
