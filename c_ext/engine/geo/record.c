/* What is recorded of a cycle, and what the recorder takes. */
#include <string.h>
#include "engine/geo/record.h"
#include "engine/geo/interpolate.h"
#include "engine/state/memory.h"
#include "engine/state/record_ring.h"
#include "engine/state/tuning.h"

static uint32_t sample_flags(const struct geo *geo, const struct piece *piece) {
    return (geo->rapid ? ENGINE_SAMPLE_RAPID : 0u)
           | (piece && piece->dir < 0 ? ENGINE_SAMPLE_BACKWARD : 0u)
           | (geo->in_tail ? ENGINE_SAMPLE_TAIL : 0u);
}

static void fill_sample(struct engine *engine, struct engine_sample *sample) {
    const struct geo *geo = &engine->geo;
    const struct recording *recording = &engine->recording;
    const struct piece *piece =
        geo->piece == UINT64_MAX ? NULL : piece_at(&engine->run, geo->piece);
    sample->cycle = geo->cycle;
    sample->element = geo->active;
    sample->path = geo->path;
    sample->dist = (geo->dist_shift + geo->dist) * TENTH_UM;
    sample->known = recording->known;
    sample->feed = geo->feed;
    sample->override = engine->orders.override;
    __atomic_load(&engine->commit.pace.last_us,
                  &sample->planner_us_per_ms,
                  __ATOMIC_RELAXED);
    sample->n = geo->n;
    sample->count = geo->count;
    sample->line = piece ? piece->line : 0;
    sample->stops = recording->stops;
    sample->state = ATOMIC_GET(engine->modes.state);
    uint64_t prepared = ATOMIC_GET(engine->store.element_head),
             phases = ATOMIC_GET(engine->commit.word) >> 2;
    sample->elements =
        (uint32_t)(prepared > geo->active ? prepared - geo->active : 0);
    sample->phases =
        (uint32_t)(phases > geo->consumed ? phases - geo->consumed : 0);
    sample->overruns = (uint32_t)engine->timing.overruns;
    sample->flags = sample_flags(geo, piece);
    sample->tool = geo->tool;
    memcpy(sample->position,
           geo->position,
           sizeof(double) * (size_t)engine->cfg.axis_count);
}

/* Rates are those of the cycle, also behind rows that were lost. */
void record_cycle(struct engine *engine) {
    struct recording *recording = &engine->recording;
    if (!recording->samples.rows) {
        return;
    }
    double speed = engine->hli.segment ? recording->path_speed
                                       : geo_path_speed(engine),
           cycle_s = engine->cfg.cycle_s;
    double acceleration = (speed - recording->speed) / cycle_s;
    double jerk = (acceleration - recording->acceleration) / cycle_s;
    recording->speed = speed;
    recording->acceleration = acceleration;
    struct engine_sample *sample = record_next(&recording->samples);
    if (!sample) {
        return;
    }
    sample->speed = speed;
    sample->acceleration = acceleration;
    sample->jerk = jerk;
    fill_sample(engine, sample);
    record_put(&recording->samples);
}

void record_standing(struct engine *engine, uint64_t cycle) {
    struct record_ring *ring = &engine->recording.samples;
    if (!ring->rows || !ATOMIC_GET(ring->head)) {
        return;
    }
    const struct engine_sample *last = record_last(ring);
    struct engine_sample *sample = record_next(ring);
    if (!sample) {
        return;
    }
    memcpy(sample, last, ring->bytes);
    sample->cycle = cycle;
    sample->speed = sample->acceleration = sample->jerk = 0.0;
    record_put(ring);
}

void record_rehearse(struct engine *engine) {
    struct engine_sample *sample = record_room(&engine->recording.samples);
    if (sample) {
        fill_sample(engine, sample);
    }
}

int64_t engine_sample_bytes(const struct engine *engine) {
    return (int64_t)(sizeof(struct engine_sample)
                     + sizeof(double) * (size_t)engine->cfg.axis_count);
}

int engine_record(struct engine *engine, int64_t rows) {
    struct recording *recording = &engine->recording;
    int result = record_ring_new(&recording->samples,
                                 (size_t)engine_sample_bytes(engine),
                                 rows)
                 | record_ring_new(&recording->functions,
                                   sizeof(struct engine_function),
                                   rows)
                 | record_ring_new(&recording->requests,
                                   sizeof(struct engine_request),
                                   rows);
    if (!result) {
        memory_touch(recording->samples.rows,
                     (size_t)rows * recording->samples.bytes);
    }
    return result;
}

static struct record_ring *ring_of(struct recording *recording, int what) {
    return what == ENGINE_RECORD_FUNCTIONS  ? &recording->functions
           : what == ENGINE_RECORD_REQUESTS ? &recording->requests
                                            : &recording->samples;
}

int64_t engine_record_take(struct engine *engine,
                           int what,
                           void *out,
                           int64_t max_rows) {
    struct record_ring *ring = ring_of(&engine->recording, what);
    int64_t head = ATOMIC_GET(ring->head), tail = ring->tail, count = 0;
    while (tail < head && count < max_rows) {
        int64_t first = tail % ring->size, here = ring->size - first;
        here = here < head - tail ? here : head - tail;
        here = here < max_rows - count ? here : max_rows - count;
        memcpy((char *)out + (size_t)count * ring->bytes,
               ring->rows + (size_t)first * ring->bytes,
               (size_t)here * ring->bytes);
        tail += here;
        count += here;
    }
    ATOMIC_SET(ring->tail, tail);
    return count;
}

uint64_t engine_record_lost(const struct engine *engine, int what) {
    return ATOMIC_GET(
        ring_of((struct recording *)&engine->recording, what)->lost);
}

int64_t engine_elements(const struct engine *engine,
                        uint64_t first,
                        engine_element *out,
                        int64_t max_rows) {
    int64_t count = 0;
    for (uint64_t i = first; i < engine->store.element_head && count < max_rows;
         i++) {
        const struct element *element = element_at(&engine->store, i);
        const HLI_CONTOUR_LOOKAHEAD_BLOCK *facts = &element->facts;
        out[count++] = (engine_element){
            .element = i,
            .type = facts->block_type,
            .n = facts->block_number,
            .count = facts->block_count_r,
            .epoch = element->epoch,
            .start = facts->start_position,
            .length = facts->length,
            .programmed_radius = facts->programmed_radius,
            .compensated_radius = facts->compensated_radius,
            .angle = facts->circle_angle,
            .length_min = facts->length_min,
            .turn = facts->tangent_variation,
        };
    }
    return count;
}
