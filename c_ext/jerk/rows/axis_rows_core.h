/* Rows of the axes' jerks and accelerations over (x, accel, input), LANES
 * stages at a time.
 *
 * AXIS_ROWS: the build's name of axis_rows. */
#include <math.h>
#include "jerk/rows/axis_rows.h"
#include "jerk/rows/implied_rows.h"
#include "jerk/state/vectors.h"
#include "maths/order.h"

/* The stages of a block; where there are fewer the last one stands in the lanes
 * that are left. */
typedef struct stages {
    const struct segment *at[LANES], *before[LANES];
    ivec planned; /* their jerks and inputs are planned */
    ivec inner;   /* they begin at a knot between two intervals */
    ivec joint;   /* ... at which pushed intervals meet */
    vec entry, length;
} stages;

/* Derivatives of one axis at the start and at the end of the stages. */
typedef struct bend {
    vec d1[2], d2[2], d3[2];
} bend;

/* The state that a window starts with was checked, not planned, to lie within
 * the limits: between the knots of that plan it may lie a little above what is
 * planned with. */
static double entry_slack(const struct problem *problem, int k) {
    return problem->from_standstill || k >= ENTRY_STAGES
               ? 1.0
               : 1.0 + ENTRY_SLACK * (1.0 - (double)k / ENTRY_STAGES);
}

static void stages_of(const struct grid *grid,
                      const struct problem *problem,
                      int i,
                      stages *out) {
    ivec planned = {0}, inner = {0}, joint = {0};
    vec entry = {0}, length = {0};
    for (int lane = 0; lane < LANES; lane++) {
        int k = i * LANES + lane;
        int at = k < grid->count ? k : grid->count - 1;
        int before = at > 0 ? at - 1 : 0;
        out->at[lane] = &grid->seg[at];
        out->before[lane] = &grid->seg[before];
        planned[lane] = -(k >= problem->first && k <= grid->count - 2);
        inner[lane] = -(k >= 1 && k < grid->count);
        joint[lane] = -(grid->seg[before].last != 0);
        entry[lane] = entry_slack(problem, at);
        length[lane] = out->at[lane]->interval->length;
    }
    out->planned = planned;
    out->inner = inner;
    out->joint = joint;
    out->entry = entry;
    out->length = length;
}

static bend bend_of_axis(const stages *of, int axis) {
    bend out;
    for (int end = 0; end < 2; end++) {
        for (int lane = 0; lane < LANES; lane++) {
            const jerk_interval *interval = of->at[lane]->interval;
            out.d1[end][lane] = interval->d1[end][axis];
            out.d2[end][lane] = interval->d2[end][axis];
            out.d3[end][lane] = interval->d3[end][axis];
        }
    }
    return out;
}

static inline void add_form(struct forms *forms,
                            ivec there,
                            vec x,
                            vec u,
                            vec c) {
    vec *coef = forms->coef[forms->count];
    forms->there[forms->count++] = there;
    coef[0] = chosen(there, x, set1(0.0));
    coef[1] = chosen(there, u, set1(0.0));
    coef[2] = chosen(there, c, set1(0.0));
}

/* Those that the rest does not imply, into the rows of a block, each lane's
 * from the first one on; how many rows are in use. */
static int put_forms(struct forms *forms, two_sided *rows) {
    int filled[LANES] = {0};
    int most = 0;
    without_implied(forms);
    for (int i = 0; i < forms->count; i++) {
        for (int lane = 0; lane < LANES; lane++) {
            if (!forms->there[i][lane]) {
                continue;
            }
            two_sided *row = &rows[filled[lane]++];
            for (int n = 0; n < 3; n++) {
                row->coef[n][lane] = forms->coef[i][n][lane];
            }
            most = filled[lane] > most ? filled[lane] : most;
        }
    }
    return most;
}

/* Acceleration and jerk limits of one axis. */
static void limits_of(const jerk_planner *planner,
                      const stages *of,
                      int axis,
                      vec *acc,
                      vec *jerk) {
    for (int lane = 0; lane < LANES; lane++) {
        const jerk_interval *interval = of->at[lane]->interval;
        (*acc)[lane] = acc_max(planner, interval, axis);
        (*jerk)[lane] = jerk_max(planner, interval, axis);
    }
}

/* Jerk over acceleration limit, 1/s, that turns an acceleration from limit to
 * limit within the segments at their highest speeds, which may be that of here
 * where it falls. More is of no use there. */
static vec turning_rates(const jerk_planner *planner, const stages *of) {
    vec most, length;
    for (int lane = 0; lane < LANES; lane++) {
        const struct segment *segment = of->at[lane];
        most[lane] = greater(planner->x, lesser(segment->soft, segment->cap));
        length[lane] = segment->length;
    }
    return 2.0 * planner->scale * root_of(most) / length;
}

/* Axis jerk over sqrt(x), at the start and at the end of the stages. */
static void jerk_rows(const jerk_planner *planner,
                      const struct grid *grid,
                      struct problem *problem,
                      int i,
                      const stages *of,
                      const bend *bends) {
    double f3 = planner->scale * planner->scale * planner->scale;
    struct used *used = &problem->used[i];
    vec rate = turning_rates(planner, of);
    vec usable = vmax(set1(grid->usable), JERK_USABLE * of->entry);
    vec share, weight[JERK_AXES];
    for (int lane = 0; lane < LANES; lane++) {
        share[lane] = of->at[lane]->share;
    }
    for (int n = 0; n < problem->axes; n++) {
        vec acc, jerk;
        limits_of(planner, of, problem->axis[n], &acc, &jerk);
        vec turning = rate * acc;
        used->quick =
            used->quick || any_of(of->planned & (jerk > QUICK * turning));
        weight[n] = f3 / (share * usable * vmin(jerk, turning));
    }
    for (int end = 0; end < 2; end++) {
        struct forms forms;
        forms.count = 0;
        for (int n = 0; n < problem->axes; n++) {
            add_form(&forms,
                     of->planned,
                     weight[n] * bends[n].d3[end],
                     weight[n] * 3.0 * bends[n].d2[end],
                     weight[n] * bends[n].d1[end]);
        }
        int count = put_forms(&forms, jerk_rows_of(problem, i, end));
        used->jerk = count > used->jerk ? count : used->jerk;
    }
}

static vec acc_weight(const jerk_planner *planner,
                      const struct segment *const at[LANES],
                      int axis,
                      const vec *entry) {
    vec usable;
    for (int lane = 0; lane < LANES; lane++) {
        usable[lane] = ACC_USABLE * at[lane]->acc[axis] * *at[lane]->acc_tight
                       * acc_max(planner, at[lane]->interval, axis);
    }
    return planner->scale * planner->scale / (usable * *entry);
}

/* At the knots where the stages begin, on either side; inside a pushed interval
 * both are the same. */
static void acc_rows(const jerk_planner *planner,
                     struct problem *problem,
                     int i,
                     const stages *of,
                     const bend *bends) {
    struct forms forms;
    forms.count = 0;
    ivec joint = of->inner & of->joint;
    for (int n = 0; n < problem->axes; n++) {
        int axis = problem->axis[n];
        vec before = acc_weight(planner, of->before, axis, &of->entry);
        vec after = acc_weight(planner, of->at, axis, &of->entry);
        after = chosen(of->joint, after, vmax(before, after));
        add_form(&forms,
                 of->inner,
                 after * bends[n].d2[0],
                 after * bends[n].d1[0],
                 set1(0.0));
        if (!any_of(joint)) {
            continue;
        }
        vec d1, d2;
        for (int lane = 0; lane < LANES; lane++) {
            d1[lane] = of->before[lane]->interval->d1[1][axis];
            d2[lane] = of->before[lane]->interval->d2[1][axis];
        }
        add_form(&forms, joint, before * d2, before * d1, set1(0.0));
    }
    problem->used[i].acc = put_forms(&forms, acc_rows_of(problem, i));
}

/* Between its ends the acceleration may go beyond what it is there: c changes.
 */
static void mid_rows(const jerk_planner *planner,
                     struct problem *problem,
                     int i,
                     const stages *of,
                     const bend *bends) {
    struct forms forms;
    forms.count = 0;
    vec length = of->length;
    for (int n = 0; n < problem->axes; n++) {
        const bend *bend = &bends[n];
        vec weight = acc_weight(planner, of->at, problem->axis[n], &of->entry);
        vec d1 = 0.5 * (bend->d1[0] + bend->d1[1])
                 + length
                       * (5.0 / 32.0 * (bend->d2[0] - bend->d2[1])
                          + length / 64.0 * (bend->d3[0] + bend->d3[1]));
        vec d2 = 15.0 / 8.0 * (bend->d1[1] - bend->d1[0]) / length
                 - 7.0 / 16.0 * (bend->d2[0] + bend->d2[1])
                 + length / 32.0 * (bend->d3[1] - bend->d3[0]);
        add_form(&forms, of->planned, weight * d2, weight * d1, set1(0.0));
    }
    problem->used[i].mid = put_forms(&forms, mid_rows_of(problem, i));
}

void AXIS_ROWS(const jerk_planner *planner,
               const struct grid *grid,
               struct problem *problem) {
    for (int i = 0; i < problem->blocks; i++) {
        stages stages;
        bend bends[JERK_AXES];
        stages_of(grid, problem, i, &stages);
        for (int n = 0; n < problem->axes; n++) {
            bends[n] = bend_of_axis(&stages, problem->axis[n]);
        }
        acc_rows(planner, problem, i, &stages, bends);
        jerk_rows(planner, grid, problem, i, &stages, bends);
        mid_rows(planner, problem, i, &stages, bends);
        store(problem->on + i * LANES,
              chosen(stages.planned, set1(1.0), set1(0.0)));
    }
}
