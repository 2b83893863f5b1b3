/* SPDX-License-Identifier: Apache-2.0
 *
 * Lamps are moved: sequential linear programs in a trust region (Fletcher and Sainz de la Maza 1989,
 * Math. Programming 43, 235). With levels x, places p and the rows g(x, p) >= 0 of what is wanted,
 * a step (dx, dp) minimises
 *
 *     c dx + M t    over    g + dg/dx dx + dg/dp dp + t >= 0,  t >= 0,  |dp| <= D
 *
 * and is taken where c x + M max(0, -g) falls as foreseen; else D shrinks. All readings have the same
 * random numbers, so that g is one function of x and p, which a place changes smoothly but
 * for shadows. Its slopes by p are differences of such readings: meters have no derivative by
 * places, and one lamp has to be read again for each number of its place, not all of them. */
#include "base/arguments.h"
#include "design_moving.h"
#include "math/vec.h"
#include "search/simplex.h"
#include <math.h>
#include <string.h>

#define FIRST    0.1  /* D, in parts of the ranges of the numbers */
#define SMALLEST 1e-3 /* D at which a search ends */
#define GAIN     1e-5 /* what a step should gain at least, in parts of M/PENALTY */
#define PENALTY  100  /* M in parts of the objective with all levels at their most */

/* ---- Places and rows ------------------------------------------------------------------- */

/* The places p, and the readings there: of the lamps that have moved, or of all of them. */
static enum imp_status places_set(struct imp__moving *v, const double *p)
{
    struct imp__design_model *m = v->m;
    bool all = false, any = false;
    for (size_t j = 0; j < m->n; j++) v->again[j] = false;
    for (size_t i = 0; i < v->n; i++) {
        if (p[i] == v->at[i]) continue;
        any = true;
        if (v->lamp[i] < m->n) v->again[v->lamp[i]] = true;
        else all = true;
    }
    if (!any) return IMP_OK;
    IMP_CHECKED(imp__moving_place(v, p));
    for (size_t j = 0; j <= m->n; j++)
        if (all || (j < m->n && v->again[j])) IMP_CHECKED(imp__design_response(m, j));
    return imp__design_observe(m);
}

/* The margin of want k: from the rms of the errors of its rows, in their own units; and d/dx. The
 * error of a single point has few degrees of freedom, and the least of many rows, each less its own
 * error, were no smooth function of places. */
static double margin_of(const struct imp__moving *v, size_t k, const double *x,
                        double *slope)
{
    const struct imp__design_model *m = v->m;
    const size_t first = m->first_row[k], end = m->first_row[k + 1];
    const double more = v->more * m->row[first].z;
    double sum = 0;
    for (size_t j = 0; j < m->n; j++) slope[j] = 0;
    for (size_t r = first; r < end; r++) {
        sum += m->row[r].v0;
        for (size_t j = 0; j < m->n; j++) {
            sum += m->row[r].v[j] * x[j] * x[j];
            slope[j] += m->row[r].v[j] * x[j];
        }
    }
    const double n = (double)(end - first), rms = sqrt(sum / n);
    for (size_t j = 0; j < m->n; j++)
        slope[j] = rms > 0 ? more * slope[j] / (n * rms) : 0;
    return more * rms;
}

/* All rows at the levels x and the present places, divided by v->scale, and d row / d level. */
static void rows_value(struct imp__moving *v, const double *x, double *out)
{
    struct imp__design_model *m = v->m;
    for (size_t k = 0; k < m->n_wants; k++) {
        imp__design_rows_set(m, k, m->want[k].value, IMP_DESIGN_MARGIN);
        const double margin = margin_of(v, k, x, v->turn);
        for (size_t r = m->first_row[k]; r < m->first_row[k + 1]; r++) {
            const struct imp__choice_row *row = &m->row[r];
            const double s = m->scale[r] / v->scale[r];
            double value = row->b;
            for (size_t j = 0; j < m->n; j++) {
                const double q = row->q ? row->q[j] * x[j] : 0;
                value += (row->a[j] - q) * x[j];
                v->slope[r * v->width + j] = (row->a[j] - 2 * q - v->turn[j]) * s;
            }
            out[r] = (value - margin) * s;
        }
    }
}

/* d row / d place by central differences within the bounds. */
static enum imp_status place_slopes(struct imp__moving *v, const double *x, double reach)
{
    struct imp__design_model *m = v->m;
    double *p = v->trial, ends[2];
    for (size_t i = 0; i < v->n; i++) {
        const double h = reach * (v->hi[i] - v->lo[i]), middle = v->at[i];
        const struct imp__moving_readings kept = imp__moving_keep(v);
        for (int e = 0; e < 2; e++) {
            memcpy(p, v->p, v->n * sizeof *p);
            p[i] = ends[e] = e ? fmin(middle + h, v->hi[i]) : fmax(middle - h, v->lo[i]);
            IMP_CHECKED(places_set(v, p));
            rows_value(v, x, v->side[e]);
        }
        for (size_t r = 0; r < m->n_rows; r++)
            v->slope[r * v->width + m->n + i] =
                (v->side[1][r] - v->side[0][r]) / (ends[1] - ends[0]);
        IMP_CHECKED(imp__moving_place(v, v->p));
        imp__moving_restore(v, &kept);
    }
    return IMP_OK;
}

/* ---- Steps ------------------------------------------------------------------------------ */

static double worst_of(const struct imp__moving *v, const double *g)
{
    double worst = 0;
    for (size_t r = 0; r < v->m->n_rows; r++) worst = fmax(worst, -g[r]);
    return worst;
}
static double merit_of(const struct imp__moving *v, const double *x, const double *g)
{
    double sum = v->penalty * worst_of(v, g);
    for (size_t j = 0; j < v->m->n; j++) sum += v->m->price[j] * x[j];
    return sum;
}

/* The step of the linear program: levels, then places, into v->step; what it should gain. */
static enum imp_status step_find(struct imp__moving *v, double reach, double *gain)
{
    enum imp_status st = IMP_OK;
    struct imp__design_model *m = v->m;
    struct imp__lp lp = {0};
    enum imp__lp_end end;
    const size_t t = v->width - 1;
    for (size_t j = 0; j < m->n; j++) {
        v->cost[j] = m->price[j];
        v->least[j] = v->used[j] ? m->least[j] - v->x[j] : 0;
        v->most[j] = v->used[j] ? m->most[j] - v->x[j] : 0;
    }
    for (size_t i = 0; i < v->n; i++) {
        const double most = reach * (v->hi[i] - v->lo[i]);
        v->cost[m->n + i] = 0;
        v->least[m->n + i] = fmax(v->lo[i] - v->p[i], -most);
        v->most[m->n + i] = fmin(v->hi[i] - v->p[i], most);
    }
    v->cost[t] = v->penalty;
    v->least[t] = 0;
    v->most[t] = 1e6;
    IMP_TRY(imp__lp_create(m->ctx, v->width, v->cost, v->least, v->most, &lp));
    for (size_t r = 0; r < m->n_rows; r++) {
        v->slope[r * v->width + t] = 1;
        IMP_TRY(imp__lp_add(&lp, v->slope + r * v->width, v->g[r], (int)r));
    }
    IMP_TRY(imp__lp_solve(&lp, &end));
    *gain = 0;
    if (end != IMP_LP_OPTIMAL) goto out;
    memcpy(v->step, lp.x, v->width * sizeof *v->step);
    *gain = v->penalty * worst_of(v, v->g) - lp.objective;
out:
    imp__lp_destroy(&lp);
    return st;
}

static void levels_step(struct imp__moving *v)
{
    const struct imp__design_model *m = v->m;
    for (size_t j = 0; j < m->n; j++)
        v->x[j] =
            v->used[j] ? imp_clamp(v->x[j] + v->step[j], m->least[j], m->most[j]) : 0;
    rows_value(v, v->x, v->g);
}

/* Takes the step if it gains a tenth of what it should: else levels and places go back. What
 * places are worth is what the best levels for them are: a step in both has an error of second
 * order, dx dp, for which the penalty would allow small steps alone. */
static enum imp_status step_try(struct imp__moving *v, double gain, double *part)
{
    struct imp__design_model *m = v->m;
    const struct imp__moving_readings kept = imp__moving_keep(v);
    const double before = merit_of(v, v->x, v->g);
    double none;
    for (size_t i = 0; i < v->n; i++)
        v->trial[i] = imp_clamp(v->p[i] + v->step[m->n + i], v->lo[i], v->hi[i]);
    memcpy(v->before, v->x, m->n * sizeof *v->x);
    IMP_CHECKED(places_set(v, v->trial));
    levels_step(v);
    IMP_CHECKED(step_find(v, 0, &none));
    levels_step(v);
    *part = (before - merit_of(v, v->x, v->g)) / gain;
    if (*part >= 0.1) {
        memcpy(v->p, v->trial, v->n * sizeof *v->p);
        v->steps++;
        return IMP_OK;
    }
    memcpy(v->x, v->before, m->n * sizeof *v->x);
    IMP_CHECKED(imp__moving_place(v, v->p));
    imp__moving_restore(v, &kept);
    rows_value(v, v->x, v->g);
    return IMP_OK;
}

/* Which lamps are used, and their first levels: those of the best combination at the first places; where
 * there is none, all of them with all that they have. */
static enum imp_status levels_begin(struct imp__moving *v)
{
    struct imp__design_model *m = v->m;
    struct imp__choice_answer a;
    double whole = 0;
    for (size_t k = 0; k < m->n_wants; k++)
        imp__design_rows_set(m, k, m->want[k].value, IMP_DESIGN_MARGIN);
    IMP_CHECKED(imp__design_search(m, NULL, 0, false, &a));
    for (size_t j = 0; j < m->n; j++) {
        v->used[j] = !a.found || a.x[j] > 0;
        v->x[j] = a.found ? a.x[j] : m->most[j];
        whole += m->price[j] * m->most[j];
    }
    if (!v->begun)
        v->started = a.found ? imp__design_objective(m, m->o.least, a.x) : INFINITY;
    v->begun = true;
    v->penalty = whole > 0 ? PENALTY * whole : 1;
    return IMP_OK;
}

enum imp_status imp__design_move(struct imp__moving *v)
{
    struct imp__design_model *m = v->m;
    double reach = FIRST;
    if (v->n == 0) return IMP_OK;
    IMP_CHECKED(imp__design_responses(m));
    IMP_CHECKED(imp__design_rows_make(m));
    IMP_CHECKED(imp__moving_rows(v));
    IMP_CHECKED(levels_begin(v));
    for (int k = 0; k < v->iterations && reach >= SMALLEST; k++) {
        double gain, part = 0;
        for (size_t r = 0; r < m->n_rows; r++) v->scale[r] = m->scale[r];
        IMP_CHECKED(place_slopes(v, v->x, fmin(fmax(0.25 * reach, 1e-3), 0.02)));
        rows_value(v, v->x, v->g);
        while (reach >= SMALLEST) {
            IMP_CHECKED(step_find(v, reach, &gain));
            if (!(gain > GAIN * v->penalty / PENALTY)) return IMP_OK;
            IMP_CHECKED(step_try(v, gain, &part));
            if (part >= 0.1) break;
            reach *= 0.4;
        }
        if (part > 0.75) reach = fmin(2 * reach, 0.5);
        else if (part < 0.25) reach *= 0.5;
    }
    return IMP_OK;
}
