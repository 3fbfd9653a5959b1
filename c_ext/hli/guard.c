/* A segment that is cut (ftruncate) while it is mapped raises SIGBUS at its
 * next use. The handler puts private zeros in its place, so that the process
 * can say what has happened and end in order. */
#define _GNU_SOURCE
#include "hli/guard.h"

#include <pthread.h>
#include <signal.h>
#include <stddef.h>
#include <sys/mman.h>

#define GUARDS 1024

static struct guard {
    uintptr_t base;
    uint64_t size;
    int lost;
} guards[GUARDS];
static struct sigaction before;
static pthread_mutex_t guards_lock = PTHREAD_MUTEX_INITIALIZER;
static int installed;

static void on_bus(int number, siginfo_t *info, void *context) {
    (void)context;
    uintptr_t at = (uintptr_t)info->si_addr;
    for (int i = 0; i < GUARDS; i++) {
        uintptr_t base = __atomic_load_n(&guards[i].base, __ATOMIC_ACQUIRE);
        if (!base || at < base || at - base >= guards[i].size) {
            continue;
        }
        __atomic_store_n(&guards[i].lost, 1, __ATOMIC_RELEASE);
        if (mmap((void *)base,
                 guards[i].size,
                 PROT_READ | PROT_WRITE,
                 MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED,
                 -1,
                 0)
            != MAP_FAILED) {
            return;
        }
    }
    sigaction(number, &before, NULL); /* the access is repeated, and ends it */
}

static int install(void) {
    struct sigaction action = {.sa_sigaction = on_bus,
                               .sa_flags = SA_SIGINFO | SA_NODEFER};
    if (!installed) {
        installed = sigaction(SIGBUS, &action, &before) == 0;
    }
    return installed ? 0 : -1;
}

int hs_guard(void *base, uint64_t size) {
    int done = -1;
    pthread_mutex_lock(&guards_lock);
    for (int i = 0; i < GUARDS && install() == 0 && done != 0; i++) {
        if (!guards[i].base) {
            guards[i].size = size;
            guards[i].lost = 0;
            __atomic_store_n(&guards[i].base,
                             (uintptr_t)base,
                             __ATOMIC_RELEASE);
            done = 0;
        }
    }
    pthread_mutex_unlock(&guards_lock);
    return done;
}

static struct guard *guard_of(const void *base) {
    for (int i = 0; i < GUARDS; i++) {
        if (guards[i].base == (uintptr_t)base) {
            return &guards[i];
        }
    }
    return NULL;
}

void hs_unguard(void *base) {
    pthread_mutex_lock(&guards_lock);
    struct guard *guard = guard_of(base);
    if (guard) {
        __atomic_store_n(&guard->base, 0, __ATOMIC_RELEASE);
    }
    pthread_mutex_unlock(&guards_lock);
}

int hs_guard_lost(void *base) {
    const struct guard *guard = guard_of(base);
    return guard ? __atomic_load_n(&guard->lost, __ATOMIC_ACQUIRE) : 0;
}
