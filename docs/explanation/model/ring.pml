/* Facts that are copied out of the ring while preparation goes on: push_element (c_ext/ring.c) against answer_distance
 * (c_ext/serve.c). An element is two words; element i lies in slot i modulo SIZE, head is the number of elements.
 * Property: a copy that is accepted is the whole element that was asked for.
 */
#define SIZE 2
#define LAST 4
#define ACTORS 2
#define SDA 0
#define SERVICE 1
#define HEAD 0
#define FACT0(i) (1 + 2 * ((i) % SIZE))
#define FACT1(i) (2 + 2 * ((i) % SIZE))
#define LOCATIONS 5
#define STORES landed(SDA, 0) landed(SDA, 1) landed(SDA, 2) landed(SDA, 3) landed(SDA, 4)
#define FETCHES fetch(SERVICE, 0) fetch(SERVICE, 1) fetch(SERVICE, 2) fetch(SERVICE, 3) fetch(SERVICE, 4)
#include "memory.pml"

active proctype sda() {
    byte i;
    do
    :: i < LAST ->
push_element:
#ifndef MUTATE_PUSH_FENCE
        release_fence(SDA);
#endif
        relaxed_store(SDA, FACT0(i), i + 1);
        relaxed_store(SDA, FACT1(i), i + 1);
#ifdef MUTATE_HEAD_RELEASE
        relaxed_store(SDA, HEAD, i + 1);
#else
        release_store(SDA, HEAD, i + 1);
#endif
        i++
    :: else -> break
    od
}

active proctype service() {
    byte copies, first, head, a, b;
    do
    :: copies < 2 ->
window_range:
#ifdef MUTATE_HEAD_ACQUIRE
        relaxed_load(SERVICE, HEAD, head);
#else
        acquire_load(SERVICE, HEAD, head);
#endif
        if
        :: head == 0 -> first = 0
        :: head > 0 -> first = head - 1
        :: head > 1 -> first = head - 2
        fi;
        if
        :: first < head ->
answer_distance:
            relaxed_load(SERVICE, FACT0(first), a);
            relaxed_load(SERVICE, FACT1(first), b);
#ifndef MUTATE_RECHECK_FENCE
            acquire_fence(SERVICE);
#endif
            relaxed_load(SERVICE, HEAD, head);
#ifdef MUTATE_NO_RECHECK
            head = 0;
#endif
            if
            :: head < first + SIZE -> assert(a == first + 1 && b == first + 1)
            :: else
            fi
        :: else
        fi;
        d_step { copies++; a = 0; b = 0; first = 0; head = 0 }
    :: else -> break
    od
}
