/* The raw reference of the handshake benchmark (see bench.h): what two C threads need for the same payload. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "hli/bench.h"

#include <pthread.h>
#include <sched.h>

#include "hli/hli_layout.h"
#include "hli/sync.h"

typedef HLI_CONTOUR_LOOKAHEAD_BLOCK element;

typedef struct {
    HLI_CONTOUR_LOOKAHEAD unit __attribute__((aligned(64)));
    const element *table;
    uint32_t n_blocks;
    uint32_t stop;
    int cpu;
    int pinned;
} raw_server;

static element element_of(uint32_t index) {
    element e = {.block_type = 1u + index % 2u, .block_number = 10u * index, .block_count_r = index};
    e.start_position = (double)index;
    e.length = (double)index + 0.25;
    e.programmed_radius = e.compensated_radius = (double)index + 0.5;
    e.circle_angle = (double)index + 0.75;
    e.length_min = e.length;
    e.tangent_variation = -(double)index;
    return e;
}

void hb_fill(void *blocks, uint32_t rows) {
    for (uint32_t i = 0; i < rows; i++)
        ((element *)blocks)[i] = element_of(i);
}

uint32_t hb_wrong(const void *blocks, uint32_t n, uint32_t first) {
    uint32_t wrong = 0;
    for (uint32_t i = 0; i < n; i++) {
        element e = element_of(first + i);
        wrong += memcmp(&((const element *)blocks)[i], &e, sizeof e) != 0;
    }
    return wrong;
}

static int pin(int cpu) {
    cpu_set_t set;
    CPU_ZERO(&set);
    if (cpu < 0)
        return 0;
    CPU_SET((size_t)cpu, &set);
    return pthread_setaffinity_np(pthread_self(), sizeof set, &set) == 0;
}

static void *serve(void *arg) {
    raw_server *s = arg;
    s->pinned = pin(s->cpu);
    while (!load_u32_acquire(&s->stop)) {
        if (load_u8_acquire(&s->unit.semaphor_rw) == 0) {
            cpu_pause();
            continue;
        }
        uint32_t first = (uint32_t)load_f64_relaxed(&s->unit.request.start_position);
        memcpy(s->unit.response.block, s->table + first, s->n_blocks * sizeof(element));
        store_u8_release(&s->unit.semaphor_rw, 0);
    }
    return NULL;
}

static int64_t exchange(raw_server *s, uint32_t first, element *copy) {
    int64_t begin = hs_monotonic_ns();
    store_f64_relaxed(&s->unit.request.start_position, (double)first);
    store_f64_relaxed(&s->unit.request.length, 1.0);
    store_u8_release(&s->unit.semaphor_rw, 1);
    while (load_u8_acquire(&s->unit.semaphor_rw) != 0)
        cpu_pause();
    memcpy(copy, s->unit.response.block, s->n_blocks * sizeof(element));
    return hs_monotonic_ns() - begin;
}

static int64_t client(raw_server *s, uint32_t span, int64_t exchanges, int64_t max_ns, int64_t *samples, int64_t *torn) {
    element copy[HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1];
    int64_t end = hs_monotonic_ns() + max_ns, k = 0;
    for (; k < exchanges && hs_monotonic_ns() < end; k++) {
        uint32_t first = (uint32_t)(k * 7 % span);
        samples[k] = exchange(s, first, copy);
        *torn += hb_wrong(copy, s->n_blocks, first) != 0;
    }
    return k;
}

int64_t hb_raw(const void *table, uint32_t table_rows, uint32_t n_blocks, int64_t exchanges, int64_t max_ns,
               int cpu_client, int cpu_server, int64_t *samples, int64_t *torn, int *pinned) {
    raw_server s = {.table = table, .n_blocks = n_blocks, .cpu = cpu_server};
    cpu_set_t before;
    pthread_t thread;
    *torn = 0;
    if (n_blocks > HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1 || n_blocks >= table_rows)
        return -1;
    pthread_getaffinity_np(pthread_self(), sizeof before, &before);
    if (pthread_create(&thread, NULL, serve, &s) != 0)
        return -1;
    *pinned = pin(cpu_client);
    int64_t n = client(&s, table_rows - n_blocks, exchanges, max_ns, samples, torn);
    store_u32_release(&s.stop, 1);
    pthread_join(thread, NULL);
    *pinned = *pinned && s.pinned && cpu_client != cpu_server;
    pthread_setaffinity_np(pthread_self(), sizeof before, &before);
    return n;
}
