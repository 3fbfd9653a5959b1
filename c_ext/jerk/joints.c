/* Joints of the path where its direction jumps, several of them in a cycle: what they add up to in the samples' accelerations.
 *
 * A jump dv of an axis' velocity at a time t adds dv/dt * w to the acceleration measured around a sample, w the triangle of
 * half-width one cycle. Alone it stays below what needs no room (grid.c); those of a curve that is driven as many short lines
 * add up to the curve's own acceleration, and only what they leave is there for everything else. Those that turn to and fro do not.
 */
#include <math.h>
#include "jerk/state.h"

#define FREE 0.012       /* share of the acceleration limit for which nothing is set aside */
#define MOST 0.75        /* share that joints may use together: else they are passed more slowly */
#define LEAST 0.25       /* share that the motion between them keeps */
#define NO_TURN 1e-9     /* of the direction */

/* The direction behind a joint less that ahead of it; false: it goes straight on. */
static bool turn_between(const jerk_planner *p, const jerk_interval *left, const jerk_interval *right, double *turn) {
    double most = 0.0;
    for (int a = 0; a < p->cfg.axes; a++) {
        turn[a] = right->d1[0][a] - left->d1[1][a];
        most = fmax(most, fabs(turn[a]));
    }
    return most > NO_TURN;
}

void turn_passed(jerk_planner *p, const jerk_interval *left, const jerk_interval *right) {
    turned *t = &p->turned[p->turned_count % TURNED_MAX];
    if (!turn_between(p, left, right, t->by)) return;
    t->at = p->driven;
    t->v = p->scale * sqrt(p->x);
    p->turned_count++;
}

/* Laws were taken back to where so much was driven: what lies ahead again has not been passed. */
void turns_back(jerk_planner *p, double driven) {
    p->driven = driven;
    while (p->turned_count > 0 && p->turned[(p->turned_count - 1) % TURNED_MAX].at > driven) p->turned_count--;
}

/* Speed (scaled, squared) that is asked for at knot k at the most: it changes with the override only above 1. */
static double asked_speed2(const jerk_planner *p, const grid *g, int k) {
    const speeds usual = {p->command_speed, fmax(1.0, p->feed_factor), fmax(1.0, p->rapid_factor)};
    double x = g->knot_cap[k];
    if (p->command_speed >= 0.0) return x;
    for (int i = k > 0 ? k - 1 : k; i <= k && i < g->n; i++) {
        double v = asked_under(&usual, g->seg[i].q) / p->scale;
        if (v * v < x) x = v * v;
    }
    return x;
}

/* How much x can change over a segment. */
static double rise_over(const jerk_planner *p, const segment *s) {
    double acc = 1e30;
    for (int a = 0; a < p->cfg.axes; a++) acc = fmin(acc, acc_max(p, s->q, a) / fmax(1e-9, fmax(fabs(s->q->d1[0][a]), fabs(s->q->d1[1][a]))));
    return 2.0 * s->h * acc / (p->scale * p->scale);
}

/* The speed at which each knot may be passed, its neighbours being passed no faster than they may. */
static void top_speeds(const jerk_planner *p, grid *g) {
    double *x = g->top;
    for (int k = 0; k <= g->n; k++) x[k] = asked_speed2(p, g, k);
    x[0] = p->at_rest ? 0.0 : p->x;
    for (int k = 1; k <= g->n; k++) x[k] = fmin(x[k], x[k - 1] + rise_over(p, &g->seg[k - 1]));
    for (int k = g->n - 1; k > 0; k--) x[k] = fmin(x[k], x[k + 1] + rise_over(p, &g->seg[k]));
}

/* What a turn passed at v1, `d` mm from a knot that is passed at v, adds to the velocity's change there; false: it is a cycle away. */
static bool add_turn(const jerk_planner *p, const double *turn, double d, double v, double v1, double *sum) {
    double cycles = d > 0.0 ? 2.0 * d / ((v + v1) * p->cfg.cycle_s) : 0.0;
    if (!(cycles < 1.0)) return false;
    for (int a = 0; a < p->cfg.axes; a++) sum[a] += (1.0 - cycles) * v1 * turn[a];
    return true;
}

/* Change of velocity that shows at knot k, passed at v; how many joints make it. */
static int turns_around(const jerk_planner *p, const grid *g, int k, double v, double *sum) {
    double turn[JERK_AXES], at = g->from_start[k], way = 2.0 * v * p->cfg.cycle_s;
    int n = 0;
    for (int side = -1; side <= 1; side += 2)
        for (int i = side < 0 ? k : k + 1; i > 0 && i < g->n && fabs(g->from_start[i] - at) < way; i += side)
            if (g->seg[i - 1].last && turn_between(p, g->seg[i - 1].q, g->seg[i].q, turn))
                n += add_turn(p, turn, fabs(g->from_start[i] - at), v, p->scale * sqrt(g->top[i]), sum);
    for (uint64_t i = p->turned_count; i-- > 0 && i + TURNED_MAX >= p->turned_count;) {
        const turned *t = &p->turned[i % TURNED_MAX];
        if (p->driven - t->at + at >= way) break;
        n += add_turn(p, t->by, p->driven - t->at + at, v, t->v, sum);
    }
    return n;
}

/* Share of each axis' acceleration limit that the joints around knot k use; the largest. */
static double used_at(const jerk_planner *p, const grid *g, int k, double v, double *used) {
    double sum[JERK_AXES] = {0.0}, most = 0.0;
    if (turns_around(p, g, k, v, sum) < 2) return 0.0; /* a single one needs no room */
    const jerk_interval *left = g->seg[k > 0 ? k - 1 : 0].q, *right = g->seg[k].q;
    for (int a = 0; a < p->cfg.axes; a++) {
        used[a] = fabs(sum[a]) / (p->cfg.cycle_s * fmin(acc_max(p, left, a), acc_max(p, right, a)));
        most = fmax(most, used[a]);
    }
    return most;
}

static void leave(const jerk_planner *p, segment *s, const double *used) {
    for (int a = 0; a < p->cfg.axes; a++) s->acc[a] = fmin(s->acc[a], fmax(LEAST, 1.0 - fmax(0.0, used[a] - FREE)));
}

/* What the motion around the joint at knot k, or around the head (k 0), is left with. */
static void turn_cap(const jerk_planner *p, grid *g, int k) {
    double used[JERK_AXES], v = p->scale * sqrt(g->top[k]), at = g->from_start[k], way = v * p->cfg.cycle_s, most = used_at(p, g, k, v, used);
    if (most <= FREE) return;
    if (most > MOST && k > 0) g->knot_cap[k] = fmin(g->knot_cap[k], g->top[k] * MOST / most);
    for (int i = k - 1; i >= 0 && at - g->from_start[i + 1] < way; i--) leave(p, &g->seg[i], used);
    for (int i = k; i < g->n && g->from_start[i] - at < way; i++) leave(p, &g->seg[i], used);
}

/* Whether the direction jumps at knot k. */
static bool is_joint(const jerk_planner *p, const grid *g, int k) {
    double turn[JERK_AXES];
    return g->seg[k - 1].last && turn_between(p, g->seg[k - 1].q, g->seg[k].q, turn);
}

void turn_caps(const jerk_planner *p, grid *g) {
    int first = 0;
    for (int k = g->n - 1; k > 0; k--)
        if (is_joint(p, g, k)) first = k;
    if (first == 0 && p->turned_count == 0) return;
    top_speeds(p, g);
    turn_cap(p, g, 0);
    for (int k = first; k > 0 && k < g->n; k++)
        if (is_joint(p, g, k)) turn_cap(p, g, k);
}
