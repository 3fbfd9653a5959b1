/* Waiting on a side word without a timeout: ring, hs_word_post, wake_waiters against wait_until, sleep_once
 * (c_ext/hli_sync.c). The code also looks every 100 ms; the model leaves that out, so that a wake that is lost shows.
 *
 * The waiter waits for a semaphore to fall and sleeps on the bell word beside it, as hs_clah_await does.
 * Property: the waiter ends (else: invalid end state).
 */
#define ACTORS 2
#define WAKER 0
#define WAITER 1
#define LOCATIONS 3
#define SEM 0     /* 1: the answer stands in semaphor_rw FALSE */
#define WORD 1
#define WAITERS 2
#define STORES landed(WAKER, SEM) landed(WAKER, WORD)
#define FETCHES fetch(WAKER, WAITERS) fetch(WAITER, SEM) fetch(WAITER, WORD)
#include "memory.pml"

bit asleep;

active proctype waker() {
    byte waiters;
#ifdef MUTATE_RING_BEFORE_STORE
    release_store(WAKER, WORD, 1);
    relaxed_store(WAKER, SEM, 1);
#else
hs_clah_answer:
    relaxed_store(WAKER, SEM, 1);
    release_store(WAKER, WORD, 1);
#endif
wake_waiters:
#ifndef MUTATE_WAKE_FENCE
    full_fence(WAKER);
#endif
    relaxed_load(WAKER, WAITERS, waiters);
    if
    :: waiters -> asleep = 0 /* FUTEX_WAKE */
    :: else
    fi
}

active proctype waiter() {
    byte seen, sem;
#ifndef MUTATE_SLEEPS_UNANNOUNCED
wait_until: /* fetch_add with sequential consistency */
    atomic { mem[WAITERS] = 1; acquire_fence(WAITER) };
#endif
sleep_once:
#ifdef MUTATE_CONDITION_BEFORE_WORD
    acquire_load(WAITER, SEM, sem);
    acquire_load(WAITER, WORD, seen);
#else
#ifdef MUTATE_WORD_ACQUIRE
    relaxed_load(WAITER, WORD, seen);
    relaxed_load(WAITER, SEM, sem);
#else
    acquire_load(WAITER, WORD, seen);
    acquire_load(WAITER, SEM, sem);
#endif
#endif
    if
    :: sem -> goto met
    :: else
    fi;
futex_sleep: /* the kernel compares and sleeps in one step */
#ifdef MUTATE_SLEEP_WITHOUT_COMPARE
    asleep = 1;
#else
    atomic {
        if
        :: mem[WORD] == seen -> asleep = 1
        :: else
        fi
    };
#endif
    (asleep == 0);
    goto sleep_once;
met:
#ifndef MUTATE_SLEEPS_UNANNOUNCED
    mem[WAITERS] = 0
#else
    skip
#endif
}
