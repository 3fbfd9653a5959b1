/* The life of a name: hli.segment.create, _remove_stale and sweep (the place of the PLC is place.pml).
 *
 * Two CNCs want the same name, somebody sweeps; both CNCs may die at any step. Names, files and locks belong to the kernel,
 * so steps are system calls and their order is the program's.
 * Properties: the name of a living CNC is never removed by another; nobody waits for ever; and recovery: whatever died
 * where, a new CNC gets the name.
 */
#define FILES 4
#define CNCS 3        /* the third comes at rest */
byte name_;           /* file behind the name, 0: none */
byte owner[FILES];    /* CNC + 1 that wrote the head, 0: no head yet */
byte locked[FILES];   /* flock */
bit cnc_alive[CNCS + 1];
bit killed[CNCS + 1];
byte has_name, ended;
bit rest;

inline flock(f, me) { atomic { locked[f] == 0 -> locked[f] = me } }
inline unflock(f) { locked[f] = 0 }
inline drop_locks(me) {
    d_step {
        byte k = 0;
        do :: k < FILES -> if :: locked[k] == me -> locked[k] = 0 :: else fi; k++ :: else -> break od;
        k = 0
    }
}

/* removed: 1 the name is free now, 0 a living process (or a foreign file) has it */
inline remove_stale(f, me, removed) {
    f = name_;
    if
    :: f == 0 -> removed = 1
    :: else ->
#ifndef MUTATE_SWEEP_WITHOUT_LOCK
        flock(f, me);
#endif
        if
        :: owner[f] == 0 || cnc_alive[owner[f]] -> removed = 0
        :: else ->
            if
#ifdef MUTATE_NO_SECOND_LOOK
            :: skip ->
#else
            :: name_ == f ->
#endif
                d_step { assert(name_ == 0 || owner[name_] == 0 || !cnc_alive[owner[name_]]); name_ = 0 }
#ifndef MUTATE_NO_SECOND_LOOK
            :: else
#endif
            fi;
            removed = 1
        fi;
#ifndef MUTATE_SWEEP_WITHOUT_LOCK
        unflock(f)
#endif
    fi
}

proctype cnc(byte me) {
    byte f, mine;
    bit removed;
    {
        cnc_alive[me] = 1;
_map_new:
        do
        ::
            mine = me; /* its file, under a draft's name */
#ifdef MUTATE_NAME_BEFORE_HEAD
            if :: atomic { name_ == 0 -> name_ = mine } :: atomic { name_ != 0 -> mine = 0 } fi;
            if :: mine -> owner[mine] = me; break :: else fi;
#else
_write_head:
            owner[mine] = me;
link:
            if
            :: atomic { name_ == 0 -> name_ = mine }; break
            :: atomic { name_ != 0 -> skip }
            fi;
#endif
            remove_stale(f, me, removed);
            if
            :: !removed -> goto in_use
            :: else
            fi
        od;
run_:
        if
        :: me == CNCS -> assert(rest); has_name = me
        :: else
        fi;
unlink_: /* a living owner's name is its own until here */
        d_step { assert(name_ == mine); name_ = 0 };
in_use:
        skip
    } unless { killed[me] };
    drop_locks(me);
    d_step { cnc_alive[me] = 0; ended++ }
}

proctype sweep() {
    byte f;
    bit removed;
    remove_stale(f, CNCS + 1, removed);
    ended++
}

proctype fate() {
    if :: killed[1] = 1 :: skip fi;
    if :: killed[2] = 1 :: skip fi
}

init {
    atomic { run cnc(1); run cnc(2); run sweep(); run fate() };
    (ended == 3);
    rest = 1;
    run cnc(3);
    (has_name == 3) /* recovery: whatever died where, the name is to be had */
}
