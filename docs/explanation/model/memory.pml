/* Shared memory as C11 gives it to processes that order nothing by themselves.
 *
 * A relaxed store waits in its writer's buffer and becomes visible whenever it likes, in any order. A release store
 * becomes visible behind everything its writer stored before. A relaxed load may return a value that was fetched at any
 * time before; an acquire load throws such values away. A load is never later than its place in the program: where the
 * order of a load and a later store matters, the mutation swaps the two.
 *
 * The including model defines LOCATIONS, ACTORS, and the alternatives of `memory`:
 *     STORES   landed(actor, location): what the actor stores becomes visible
 *     FETCHES  fetch(actor, location): what the actor's relaxed loads may have fetched early
 * Death: what a killed process has stored becomes visible before anybody can see that it is gone (`buried`).
 */
byte mem[LOCATIONS];
typedef buffer { bit pending[LOCATIONS]; byte value[LOCATIONS]; byte count };
typedef fetched { bit has[LOCATIONS]; byte value[LOCATIONS] };
buffer buf[ACTORS];
fetched early[ACTORS];
byte at_;

inline relaxed_store(p, x, v) {
    d_step {
        if :: !buf[p].pending[x] -> buf[p].pending[x] = 1; buf[p].count++ :: else fi;
        buf[p].value[x] = v;
        early[p].has[x] = 0; early[p].value[x] = 0
    }
}

inline release_store(p, x, v) { atomic { buf[p].count == 0; relaxed_store(p, x, v) } }

inline relaxed_load(p, x, r) {
    atomic {
        if
        :: buf[p].pending[x] -> r = buf[p].value[x]
        :: else ->
            if
            :: early[p].has[x] -> r = early[p].value[x]
            :: r = mem[x]; early[p].has[x] = 0; early[p].value[x] = 0
            fi
        fi
    }
}

inline forget(p) {
    at_ = 0;
    do :: at_ < LOCATIONS -> early[p].has[at_] = 0; early[p].value[at_] = 0; at_++ :: else -> break od;
    at_ = 0
}

inline acquire_load(p, x, r) {
    d_step {
        if :: buf[p].pending[x] -> r = buf[p].value[x] :: else -> r = mem[x] fi;
        forget(p)
    }
}

inline acquire_fence(p) { d_step { forget(p) } }
inline release_fence(p) { buf[p].count == 0 }
inline full_fence(p) { atomic { buf[p].count == 0; acquire_fence(p) } }
/* The process is gone: its stores have landed, what it had fetched is forgotten. */
inline buried(p) { atomic { buf[p].count == 0; acquire_fence(p) } }

#define landed(p, x) :: d_step { buf[p].pending[x] -> \
    mem[x] = buf[p].value[x]; buf[p].pending[x] = 0; buf[p].value[x] = 0; buf[p].count-- }
#define fetch(p, x) :: d_step { !early[p].has[x] -> early[p].has[x] = 1; early[p].value[x] = mem[x] }

active proctype memory() {
end:
    do
    STORES
    FETCHES
    od
}
