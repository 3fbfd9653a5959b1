/* The place of the PLC in a published segment: plc_client.client._register under hli.segment.locked, and the CNC's
 * _look_at_plc, which takes a dead PLC off.
 *
 * Two PLCs want the place, a third comes at rest; the first two may die at any step.
 * Properties: two living PLCs never hold the place; and recovery: the third gets it.
 */
#define PLCS 3
byte locked, holder, attached, holders, ended;
bit alive[PLCS + 1], killed[PLCS + 1], rest;

inline leave(me) {
    d_step {
        if :: locked == me -> locked = 0 :: else fi; /* the kernel's: flock ends with its holder */
        alive[me] = 0
    }
}

proctype plc(byte me) {
    bit mine;
    {
        alive[me] = 1;
locked_:
#ifndef MUTATE_REGISTER_WITHOUT_LOCK
        atomic { locked == 0 -> locked = me };
#endif
_register:
        if
        :: attached && alive[holder] -> goto in_use
        :: else
        fi;
        attached = 0;
        holder = me;
        d_step { attached = 1; mine = 1; holders++; assert(holders == 1) };
#ifndef MUTATE_REGISTER_WITHOUT_LOCK
        locked = 0;
#endif
close_:
        d_step { assert(holder == me && attached); attached = 0; mine = 0; holders--; ended = ended + (me == PLCS) };
in_use:
        skip;
#ifndef MUTATE_REGISTER_WITHOUT_LOCK
        d_step { if :: locked == me -> locked = 0 :: else fi }
#else
        skip
#endif
    } unless { killed[me] };
    d_step { if :: mine -> mine = 0; holders-- :: else fi };
    leave(me);
    ended++
}

active proctype cnc() {
end_look_at_plc:
    do
    :: attached ->
        if
        :: attached && !alive[holder] ->
#ifdef MUTATE_LOOK_WITHOUT_LOCK
            skip;
            attached = 0
#else
            atomic { locked == 0 -> locked = PLCS + 1 };
            if
            :: attached && !alive[holder] -> attached = 0
            :: else
            fi;
            locked = 0
#endif
        :: else
        fi;
        if :: ended >= 4 -> break :: else fi
    od
}

active proctype fate() {
    if :: killed[1] = 1 :: skip fi;
    if :: killed[2] = 1 :: skip fi
}

init {
    atomic { run plc(1); run plc(2) };
    (ended == 2);
    rest = 1;
    run plc(3);
    (ended == 4)
}
