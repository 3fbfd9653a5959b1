/* The plan as a table of places and times. The planner writes it behind each
 * commit while a PLC wants it; GEO shows it; the look-ahead service reads a
 * copy. */
#include <math.h>
#include <string.h>
#include "engine/plan/timetable.h"
#include "engine/path/piece_curve.h"
#include "engine/state/state.h"
#include "hli/sync.h"
#include "jerk/state/api.h"
#include "rows/nc_block.h"

#define KNOTS (HLI_AHEAD_KNOT_MAXIDX + 1u)
#define UM_PER_MM 1000.0
/* a knot is left out where the cubic over it is off by less: 0.1 um, share of
 * the speed */
#define SAME_PLACE 0.05
/* a way asked for begins at a place of now and ends at one of the table */
#define NEAR_PLACE (2.0 * SAME_PLACE)
#define SAME_RATE 1e-4
#define SAME_TIME 1e-3 /* us */
#define STEPS 40       /* of the search for a time, at the most */

/* ---- the planner writes */

void timetable_begin(struct engine *engine, struct timetable *table) {
    table->count = 0;
    table->full = table->complete = false;
    table->edition = ++engine->plan.editions;
}

/* Driven path over programmed path; where it stands, as at the other end. */
static double stretched(const HLI_AHEAD_KNOT *knot,
                        const HLI_AHEAD_KNOT *other) {
    if (knot->rate == 0.0) {
        knot = other;
    }
    return knot->rate == 0.0 ? 0.0 : knot->speed / fabs(knot->rate);
}

static struct place_in_time between(const HLI_AHEAD_KNOT *a,
                                    const HLI_AHEAD_KNOT *b,
                                    double time) {
    double h = (b->motion_time - a->motion_time) / TIMETABLE_US;
    if (h <= 0.0) {
        return (struct place_in_time){b->motion_time,
                                      b->distance,
                                      b->rate,
                                      b->speed};
    }
    double u = (time - a->motion_time) / (b->motion_time - a->motion_time),
           w = 1.0 - u, way = b->distance - a->distance;
    double slope = way / h;
    double rate = 6.0 * u * w * slope + a->rate * w * (1.0 - 3.0 * u)
                  + b->rate * u * (1.0 - 3.0 * w);
    return (struct place_in_time){
        .time = time,
        .distance = a->distance + way * u * u * (3.0 - 2.0 * u)
                    + h * u * w * (a->rate * w - b->rate * u),
        .rate = rate,
        .speed = fabs(rate) * (stretched(a, b) * w + stretched(b, a) * u)};
}

/* Whether the knots around it tell of the last but one as well. */
static bool is_between(const HLI_AHEAD_KNOT *knot) {
    const HLI_AHEAD_KNOT *a = &knot[-1], *b = &knot[1];
    if (knot->motion_time - a->motion_time < SAME_TIME
        || b->motion_time - knot->motion_time < SAME_TIME) {
        return false;
    }
    struct place_in_time place = between(a, b, knot->motion_time);
    return fabs(place.distance - knot->distance) < SAME_PLACE
           && fabs(place.rate - knot->rate)
                  < SAME_RATE * fmax(1.0, fabs(knot->rate))
           && fabs(place.speed - knot->speed)
                  < SAME_RATE * fmax(1.0, fabs(knot->speed));
}

/* It stands where the one before it does, with another rate or not. */
static bool same_time(const HLI_AHEAD_KNOT *knot) {
    return knot->motion_time - knot[-1].motion_time < SAME_TIME;
}

/* Two phases meet in one knot; they may differ in the last bits. */
static bool is_same(const HLI_AHEAD_KNOT *a, const HLI_AHEAD_KNOT *b) {
    return fabs(b->motion_time - a->motion_time) < SAME_TIME
           && fabs(b->distance - a->distance) < SAME_PLACE
           && fabs(b->rate - a->rate) < SAME_RATE * fmax(1.0, fabs(a->rate))
           && fabs(b->speed - a->speed) < SAME_RATE * fmax(1.0, fabs(a->speed));
}

static void add_knot(struct timetable *table, HLI_AHEAD_KNOT knot) {
    if (table->count && is_same(&table->knot[table->count - 1], &knot)) {
        return;
    }
    if (table->count == KNOTS) {
        table->full = true;
        return;
    }
    table->knot[table->count++] = knot;
    if (table->count > 2 && is_between(&table->knot[table->count - 2])) {
        table->knot[table->count - 2] = knot;
        table->count--;
    }
}

static double speed_of(struct engine *engine,
                       const struct piece *piece,
                       double s,
                       double v) {
    if (!(piece->flags & NC_BY_PARAMETER)) {
        return v * UM_PER_MM;
    }
    return v * UM_PER_MM
           * (piece->flags & NC_OF_TIP
                  ? fabs(piece->path_rate)
                  : curve_piece_main_rate(engine, piece, s));
}

void timetable_add(struct engine *engine,
                   struct timetable *table,
                   const phase *ph,
                   double begin_s) {
    const struct piece *piece = piece_at(&engine->run, ph->piece);
    if (table->full || ph->time <= 0.0) {
        return;
    }
    double from = table->count ? table->knot[table->count - 1].distance : 0.0;
    HLI_AHEAD_KNOT knot[2] = {
        {.motion_time = begin_s * TIMETABLE_US, .distance = from},
        {.motion_time = (begin_s + ph->time) * TIMETABLE_US, .distance = from}};
    if (is_motion(piece)) {
        const jerk_law law = law_of_phase(ph);
        jerk_state end;
        jerk_at(&law, ph->time, &end);
        double rate = piece->dist_rate * TENTH_UM;
        double v0 = greater(0.0, ph->v0), v1 = greater(0.0, end.v);
        knot[0].rate = v0 * rate;
        knot[0].speed = speed_of(engine, piece, ph->s0, v0);
        knot[1].distance += (end.s - ph->s0) * rate;
        knot[1].rate = v1 * rate;
        knot[1].speed = speed_of(engine, piece, end.s, v1);
    }
    add_knot(table, knot[0]);
    add_knot(table, knot[1]);
}

/* Change of the speed between two knots, 1 um/s in a us. */
static double speed_change(const HLI_AHEAD_KNOT *to) {
    double time = to->motion_time - to[-1].motion_time;
    return same_time(to) ? 0.0 : (to->speed - to[-1].speed) / time;
}

/* A plan that does not reach the end of what comes brakes for its own end. The
 * planner will not drive that, nor the way in which the speed rounds off in
 * front of it: what stays is as far as another end would change nothing. */
static void cut_own_brake(struct timetable *table) {
    uint32_t last = table->count - 1;
    while (last > 0
           && (same_time(&table->knot[last])
               || table->knot[last - 1].speed
                      > table->knot[last].speed * (1.0 + SAME_RATE))) {
        last--;
    }
    bool cruises =
        last > 0
        && fabs(table->knot[last - 1].speed - table->knot[last].speed)
               <= SAME_RATE * table->knot[last].speed;
    if (!cruises) {
        while (last > 1
               && (same_time(&table->knot[last - 1])
                   || speed_change(&table->knot[last - 1])
                          >= speed_change(&table->knot[last]))) {
            last--;
        }
        last -= last > 0;
    }
    table->count = last + 1;
}

void timetable_end(struct timetable *table,
                   bool complete,
                   bool stands,
                   double override) {
    table->complete = complete && !table->full;
    table->override = override;
    if (!stands && !table->full && table->count > 0) {
        cut_own_brake(table);
    }
}

/* ---- anybody reads */

struct place_in_time timetable_place(const struct timetable *table,
                                     double time) {
    uint32_t lo = 0, hi = table->count - 1; /* the last knot not behind time */
    while (lo < hi) {
        uint32_t mid = lo + (hi - lo + 1) / 2;
        if (table->knot[mid].motion_time <= time) {
            lo = mid;
        } else {
            hi = mid - 1;
        }
    }
    const HLI_AHEAD_KNOT *knot = &table->knot[lo];
    if (lo + 1 == table->count || time <= knot->motion_time) {
        return (struct place_in_time){knot->motion_time,
                                      knot->distance,
                                      knot->rate,
                                      knot->speed};
    }
    return between(knot, knot + 1, time);
}

bool timetable_forward(const struct timetable *table) {
    for (uint32_t i = 0; i < table->count; i++) {
        if (table->knot[i].rate < 0.0) {
            return false;
        }
    }
    return table->count > 0;
}

/* The time inside an interval at which the distance is reached. */
static struct place_in_time find_time(const HLI_AHEAD_KNOT *a,
                                      const HLI_AHEAD_KNOT *b,
                                      double distance) {
    double lo = a->motion_time, hi = b->motion_time;
    struct place_in_time place = between(a, b, lo);
    for (int i = 0; i < STEPS && hi - lo > SAME_TIME; i++) {
        double step = place.rate > 0.0 ? (distance - place.distance)
                                             / place.rate * TIMETABLE_US
                                       : 0.0;
        double time = place.time + step;
        if (!(time > lo && time < hi)) {
            time = 0.5 * (lo + hi);
        }
        place = between(a, b, time);
        if (fabs(place.distance - distance) < SAME_TIME) {
            return place;
        }
        *(place.distance < distance ? &lo : &hi) = time;
    }
    return place;
}

bool timetable_reach(const struct timetable *table,
                     double distance,
                     bool last,
                     struct place_in_time *place) {
    uint32_t lo = 0, hi = table->count; /* first knot behind the distance */
    while (lo < hi) {
        uint32_t mid = lo + (hi - lo) / 2;
        double d = table->knot[mid].distance;
        if (last ? d > distance + NEAR_PLACE : d >= distance - NEAR_PLACE) {
            hi = mid;
        } else {
            lo = mid + 1;
        }
    }
    if (lo == table->count) {
        const HLI_AHEAD_KNOT *end = &table->knot[lo - 1];
        *place = (struct place_in_time){end->motion_time,
                                        end->distance,
                                        end->rate,
                                        end->speed};
        return last && end->distance >= distance - NEAR_PLACE;
    }
    const HLI_AHEAD_KNOT *knot = &table->knot[lo];
    bool at_knot = !last && knot->distance <= distance + NEAR_PLACE;
    if (lo == 0 || at_knot) {
        *place = (struct place_in_time){knot->motion_time,
                                        knot->distance,
                                        knot->rate,
                                        knot->speed};
        return true;
    }
    if (last && knot[-1].distance >= distance - NEAR_PLACE) {
        knot--;
        *place = (struct place_in_time){knot->motion_time,
                                        knot->distance,
                                        knot->rate,
                                        knot->speed};
        return true;
    }
    *place = find_time(knot - 1, knot, distance);
    return true;
}

/* ---- GEO shows */

static void copy_table(struct timetable *to, const struct timetable *from) {
    memcpy(to->knot, from->knot, from->count * sizeof from->knot[0]);
    to->count = from->count;
    to->edition = from->edition;
    to->complete = from->complete;
    to->override = from->override;
}

void timetable_publish(struct engine *engine, const struct timetable *table) {
    struct shown_timetable *shown = &engine->timetable;
    seq_begin(&shown->seq);
    copy_table(&shown->table, table);
    seq_end(&shown->seq);
    ATOMIC_SET(shown->valid, 1);
    HLI_AHEAD_PLAN *plan = &engine->hli.ahead->plan;
    seq_begin(&plan->seq);
    memcpy(plan->knot, table->knot, table->count * sizeof table->knot[0]);
    plan->count = table->count;
    plan->edition = table->edition;
    plan->complete = table->complete;
    plan->override = table->override;
    seq_end(&plan->seq);
}

void timetable_withdraw(struct engine *engine) {
    ATOMIC_SET(engine->timetable.valid, 0);
}

bool timetable_copy(struct engine *engine, struct timetable *table) {
    struct shown_timetable *shown = &engine->timetable;
    while (ATOMIC_GET(shown->valid)) {
        uint32_t seq = load_u32_acquire(&shown->seq);
        uint32_t count = shown->table.count;
        if (!(seq & 1) && count <= KNOTS) {
            copy_table(table, &shown->table);
            __atomic_thread_fence(__ATOMIC_ACQUIRE);
            if (load_u32_relaxed(&shown->seq) == seq) {
                return table->count > 0;
            }
        }
        cpu_pause();
    }
    return false;
}
