/* SPDX-License-Identifier: Apache-2.0
 *
 * Searches of a design: for the best combination, and, where there is none, for what can be had. */
#include "base/arguments.h"
#include "designing.h"
#include <math.h>

#define PRECISION 1e-6 /* relative, of the values that can be had */
#define HALVINGS  60   /* of the range in which they are found, at most */
#define UGR_LEAST (-40.0)
#define UGR_MOST  100.0 /* ratings beyond these are no lamps */

double imp__design_objective(const struct imp__design_model *m,
                             enum imp_design_least what, const double *x)
{
    double sum = 0;
    for (size_t j = 0; j < m->n; j++)
        sum += what == IMP_LEAST_WATTS  ? m->watts[j] * x[j]
               : what == IMP_LEAST_FLUX ? m->flux[j] * x[j]
               : x[j] > 0               ? m->lamp[j].cost
                                        : 0;
    return sum;
}

/* Prices of levels and of being used. Of equal costs the fewest watts win: these count a
 * millionth. */
static enum imp_status prices_set(struct imp__design_model *m)
{
    double *numbers = imp__arena_array(m->arena, 4 * m->n, sizeof *numbers);
    double cost = 0, watts = 0;
    if (!numbers) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for prices");
    m->price = numbers;
    m->fixed = numbers + m->n;
    m->least = numbers + 2 * m->n;
    m->most = numbers + 3 * m->n;
    for (size_t j = 0; j < m->n; j++) cost += m->lamp[j].cost, watts += m->watts[j];
    for (size_t j = 0; j < m->n; j++) {
        const bool costs = m->o.least == IMP_LEAST_COST;
        m->least[j] = m->lamp[j].least;
        m->most[j] = m->lamp[j].most;
        m->price[j] = m->o.least == IMP_LEAST_FLUX ? m->flux[j] : m->watts[j];
        if (costs && watts > 0) m->price[j] *= 1e-6 * cost / watts;
        m->fixed[j] = costs ? m->lamp[j].cost : 0;
    }
    return IMP_OK;
}

enum imp_status imp__design_search(struct imp__design_model *m,
                                   const bool *const *not_these, size_t n_not, bool any,
                                   struct imp__choice_answer *out)
{
    if (!m->price) IMP_CHECKED(prices_set(m));
    const struct imp__choice c = {.ctx = m->ctx,
                                  .n = m->n,
                                  .price = m->price,
                                  .fixed = m->fixed,
                                  .least = m->least,
                                  .most = m->most,
                                  .place = m->place,
                                  .n_places = m->n_places,
                                  .needed = m->needed,
                                  .n_rows = m->n_rows,
                                  .rows = m->row,
                                  .n_not = n_not,
                                  .not_these = not_these,
                                  .nodes = (size_t)m->o.nodes,
                                  .gap = 1e-7,
                                  .any = any};
    *out = (struct imp__choice_answer){0};
    out->x = imp__arena_array(m->arena, m->n, sizeof *out->x);
    out->used = imp__arena_array(m->arena, m->n, sizeof *out->used);
    out->dual = imp__arena_array(m->arena, m->n_rows, sizeof *out->dual);
    if (!out->x || !out->used || !out->dual)
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for a search");
    IMP_CHECKED(imp__choose(&c, out));
    m->nodes += (int64_t)out->nodes;
    return IMP_OK;
}

/* ---- What can be had -------------------------------------------------------------------- */

/* A want that asks for nothing: the rows of it hold by far. */
static void drop(struct imp__design_model *m, size_t k)
{
    for (size_t r = m->first_row[k]; r < m->first_row[k + 1]; r++) {
        m->row[r].b = 1e6;
        m->row[r].z = 0;
    }
}

enum possible { NO, YES, NOT_KNOWN };

static enum imp_status is_possible(struct imp__design_model *m, enum possible *out)
{
    struct imp__choice_answer a;
    const enum imp_status st = imp__design_search(m, NULL, 0, true, &a);
    *out = st == IMP_OK && a.found ? YES : a.proven ? NO : NOT_KNOWN;
    return st;
}

/* Values between which the best one of want k lies, from none that lamps can have to one that they all
 * have; they do not depend on what is wanted. */
static void range_of(const struct imp__design_model *m, size_t k, double *bad,
                     double *good)
{
    const enum imp_design_want_of of = m->want[k].of;
    const struct imp__design_grid *g = &m->grid[m->grid_of[k]];
    double most = 0; /* of a point with all lamps at level 1 */
    for (size_t p = g->first; p < g->first + g->n; p++) {
        double sum = m->base.value[p] + IMP_DESIGN_MARGIN * m->base.se[p];
        for (size_t j = 0; j < m->n; j++)
            sum += m->with[j].value[p] + IMP_DESIGN_MARGIN * m->with[j].se[p];
        most = fmax(most, sum);
    }
    *bad = of == IMP_WANT_MAXIMUM ? 0 : of == IMP_WANT_UGR ? UGR_LEAST : most;
    *good = of == IMP_WANT_MAXIMUM ? most : of == IMP_WANT_UGR ? UGR_MOST : 0;
    if (of == IMP_WANT_UNIFORMITY) *bad = 1;
}

/* The best value of want k with the rows of the others as they are, by bisection; NAN: none, or a
 * search ended before it was known. */
static enum imp_status best_of(struct imp__design_model *m, size_t k, double *out)
{
    enum possible is;
    double bad, good;
    *out = NAN;
    drop(m, k);
    IMP_CHECKED(is_possible(m, &is));
    if (is != YES) return IMP_OK;
    range_of(m, k, &bad, &good);
    imp__design_rows_set(m, k, good, IMP_DESIGN_MARGIN);
    IMP_CHECKED(is_possible(m, &is));
    if (is != YES) return IMP_OK; /* nothing is lit, or no point has a value above 0 */
    imp__design_rows_set(m, k, bad, IMP_DESIGN_MARGIN);
    IMP_CHECKED(is_possible(m, &is));
    if (is == YES) {
        /* All of the range can be had; of ratings, without a lamp in sight. */
        *out = m->want[k].of == IMP_WANT_UGR ? -INFINITY : bad;
        return IMP_OK;
    }
    for (int i = 0; i < HALVINGS && fabs(good - bad) > PRECISION * fabs(good); i++) {
        const double middle = 0.5 * (good + bad);
        imp__design_rows_set(m, k, middle, IMP_DESIGN_MARGIN);
        IMP_CHECKED(is_possible(m, &is));
        if (is == NOT_KNOWN) return IMP_OK;
        if (is == YES) good = middle;
        else bad = middle;
    }
    *out = good;
    return IMP_OK;
}

static void rows_reset(struct imp__design_model *m)
{
    for (size_t k = 0; k < m->n_wants; k++)
        imp__design_rows_set(m, k, m->want[k].value, IMP_DESIGN_MARGIN);
}

enum imp_status imp__design_attainable(struct imp__design_model *m,
                                       struct imp_design_finding *finding)
{
    for (size_t k = 0; k < m->n_wants; k++) {
        rows_reset(m);
        IMP_CHECKED(best_of(m, k, &finding[k].attainable));
        for (size_t q = 0; q < m->n_wants; q++) drop(m, q);
        IMP_CHECKED(best_of(m, k, &finding[k].alone));
        finding[k].value = finding[k].sure = finding[k].alone;
        finding[k].holds =
            imp_design_enough(m->want[k].of, finding[k].alone, m->want[k].value);
    }
    rows_reset(m);
    return IMP_OK;
}
