/* The raw reference of the handshake benchmark (see bench.h): what two C
 * threads need for the same payload. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "hli/bench.h"

#include <pthread.h>
#include <sched.h>

#include "hli/hli_layout.h"
#include "hli/sync.h"

typedef HLI_CONTOUR_LOOKAHEAD_BLOCK facts;

typedef struct {
    HLI_CONTOUR_LOOKAHEAD unit __attribute__((aligned(64)));
    const facts *table;
    uint32_t n_blocks;
    uint32_t stop;
    int cpu;
    int pinned;
} raw_server;

static facts facts_of(uint32_t index) {
    facts element = {.block_type = 1u + index % 2u,
                     .block_number = 10u * index,
                     .block_count_r = index};
    element.start_position = (double)index;
    element.length = (double)index + 0.25;
    element.programmed_radius = element.compensated_radius =
        (double)index + 0.5;
    element.circle_angle = (double)index + 0.75;
    element.length_min = element.length;
    element.tangent_variation = -(double)index;
    return element;
}

void hb_fill(void *blocks, uint32_t rows) {
    for (uint32_t i = 0; i < rows; i++) {
        ((facts *)blocks)[i] = facts_of(i);
    }
}

uint32_t hb_wrong(const void *blocks, uint32_t count, uint32_t first) {
    uint32_t wrong = 0;
    for (uint32_t i = 0; i < count; i++) {
        facts element = facts_of(first + i);
        wrong +=
            memcmp(&((const facts *)blocks)[i], &element, sizeof(facts)) != 0;
    }
    return wrong;
}

static int pin(int cpu) {
    cpu_set_t set;
    CPU_ZERO(&set);
    if (cpu < 0) {
        return 0;
    }
    CPU_SET((size_t)cpu, &set);
    return pthread_setaffinity_np(pthread_self(), sizeof set, &set) == 0;
}

static void *serve(void *arg) {
    raw_server *raw_server = arg;
    raw_server->pinned = pin(raw_server->cpu);
    while (!load_u32_acquire(&raw_server->stop)) {
        if (load_u8_acquire(&raw_server->unit.semaphor_rw) == 0) {
            cpu_pause();
            continue;
        }
        uint32_t first = (uint32_t)load_f64_relaxed(
            &raw_server->unit.request.start_position);
        memcpy(raw_server->unit.response.block,
               raw_server->table + first,
               raw_server->n_blocks * sizeof(facts));
        store_u8_release(&raw_server->unit.semaphor_rw, 0);
    }
    return NULL;
}

static int64_t exchange(raw_server *raw_server, uint32_t first, facts *copy) {
    int64_t begin = hs_monotonic_ns();
    store_f64_relaxed(&raw_server->unit.request.start_position, (double)first);
    store_f64_relaxed(&raw_server->unit.request.length, 1.0);
    store_u8_release(&raw_server->unit.semaphor_rw, 1);
    while (load_u8_acquire(&raw_server->unit.semaphor_rw) != 0) {
        cpu_pause();
    }
    memcpy(copy,
           raw_server->unit.response.block,
           raw_server->n_blocks * sizeof(facts));
    return hs_monotonic_ns() - begin;
}

static int64_t client(raw_server *raw_server,
                      uint32_t span,
                      int64_t exchanges,
                      int64_t max_ns,
                      int64_t *samples,
                      int64_t *torn) {
    facts copy[HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1];
    int64_t end = hs_monotonic_ns() + max_ns;
    int64_t k = 0;
    for (; k < exchanges && hs_monotonic_ns() < end; k++) {
        uint32_t first = (uint32_t)(k * 7 % span);
        samples[k] = exchange(raw_server, first, copy);
        *torn += hb_wrong(copy, raw_server->n_blocks, first) != 0;
    }
    return k;
}

int64_t hb_raw(const void *table,
               uint32_t table_rows,
               uint32_t n_blocks,
               int64_t exchanges,
               int64_t max_ns,
               int cpu_client,
               int cpu_server,
               int64_t *samples,
               int64_t *torn,
               int *pinned) {
    raw_server raw_server = {.table = table,
                             .n_blocks = n_blocks,
                             .cpu = cpu_server};
    cpu_set_t before;
    pthread_t thread;
    *torn = 0;
    if (n_blocks > HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1
        || n_blocks >= table_rows) {
        return -1;
    }
    pthread_getaffinity_np(pthread_self(), sizeof before, &before);
    if (pthread_create(&thread, NULL, serve, &raw_server) != 0) {
        return -1;
    }
    *pinned = pin(cpu_client);
    int64_t count = client(&raw_server,
                           table_rows - n_blocks,
                           exchanges,
                           max_ns,
                           samples,
                           torn);
    store_u32_release(&raw_server.stop, 1);
    pthread_join(thread, NULL);
    *pinned = *pinned && raw_server.pinned && cpu_client != cpu_server;
    pthread_setaffinity_np(pthread_self(), sizeof before, &before);
    return count;
}
