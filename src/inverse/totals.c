/* SPDX-License-Identifier: Apache-2.0 */
#include "totals.h"
#include "base/team.h"
#include "tally.h"
#include <math.h>
#include <string.h>

enum imp_status imp__totals_begin(struct imp_problem *p, bool in_place, double *gradient,
                                  double *gradient_se, struct imp__totals *t)
{
    const size_t n = p->n;
    *t = (struct imp__totals){.many = n > IMP_TALLY_DENSE};
    if (!t->many || !in_place) {
        const size_t rows = t->many ? !!gradient + !!gradient_se : 2;
        t->own = imp__alloc(p->ctx, rows * n, sizeof *t->own);
        if (!t->own) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for gradients");
    }
    if (!t->many) {
        t->gradient = t->own;
        t->gradient_variance = t->own + n;
        return IMP_OK;
    }
    double *mean = in_place ? gradient : gradient ? t->own : NULL;
    double *spread = in_place      ? gradient_se
                     : gradient_se ? t->own + (gradient ? n : 0)
                                   : NULL;
    t->mean = (struct imp_fixed_sum){.n = n, .sum = (imp_fixed *)mean};
    t->spread = (struct imp_fixed_sum){.n = n, .sum = (imp_fixed *)spread};
    if (spread) {
        t->spread.fine = imp__alloc(p->ctx, n, sizeof *t->spread.fine);
        if (!t->spread.fine)
            return imp__error(p->ctx, IMP_E_NOMEM, "no memory for errors");
    }
    if (mean) memset(mean, 0, n * sizeof *mean);
    if (spread) memset(spread, 0, n * sizeof *spread);
    return IMP_OK;
}

void imp__totals_free(struct imp_problem *p, struct imp__totals *t)
{
    imp__release(p->ctx, t->own);
    imp__release(p->ctx, t->spread.fine);
}

enum imp_status imp__totals_share(struct imp_problem *p, struct imp__totals *t)
{
    enum imp_status st = IMP_OK;
    if (t->many) {
        IMP_TRY(imp__shared_fixed(p->ctx, &t->mean));
        IMP_TRY(imp__shared_fixed(p->ctx, &t->spread));
    }
    if (imp__team_part(p->ctx)) return IMP_PART;
    if (imp__team_merges(p->ctx) && (t->mean.too_large || t->spread.too_large))
        return imp__error(p->ctx, IMP_E_NUMERIC,
                          "a term of the gradient is 4096 times larger than those that "
                          "its parts looked at first: this gradient cannot be merged");
out:
    return st;
}

enum imp_status imp__totals_again(struct imp_problem *p, struct imp__totals *t,
                                  bool *again)
{
    const double mean = imp__fixed_largest(&t->mean);
    const double spread = imp__fixed_largest(&t->spread);
    *again = t->many && (t->mean.too_large || t->spread.too_large);
    if (t->many && !(isfinite(mean) && isfinite(spread)))
        return imp__error(p->ctx, IMP_E_NUMERIC, "a derivative is not finite");
    if (!*again) return IMP_OK;
    const double terms = t->mean.limit * t->mean.per_unit;
    imp__fixed_begin(&t->mean, mean, 1, ldexp(1, 62) / terms);
    imp__fixed_begin(&t->spread, spread, 1, ldexp(1, 62) / terms);
    t->objective = t->variance = 0;
    return IMP_OK;
}

void imp__totals_end(struct imp_problem *p, struct imp__totals *t, double *gradient,
                     double *gradient_se)
{
    const size_t bytes = p->n * sizeof(double);
    const void *mean = t->gradient, *spread = t->gradient_variance;
    if (t->many) {
        if (t->mean.sum && t->unit_known) imp__fixed_end(&t->mean);
        if (t->spread.sum && t->unit_known) imp__fixed_end(&t->spread);
        mean = t->mean.sum, spread = t->spread.sum;
    }
    if (gradient && mean != gradient) memcpy(gradient, mean, bytes);
    if (gradient_se && spread != gradient_se) memcpy(gradient_se, spread, bytes);
    for (size_t k = 0; gradient_se && k < p->n; k++)
        gradient_se[k] = sqrt(fmax(gradient_se[k], 0));
}
