/* SPDX-License-Identifier: Apache-2.0
 *
 * Totals over targets, as doubles or as fixed-point sums: begun, shared between ranks, widened
 * where a term overflows, ended. */
#include "totals.h"
#include "base/team.h"
#include "tally.h"
#include <math.h>
#include <string.h>

enum imp_status imp__totals_begin(struct imp_problem *p, bool in_place, double *gradient,
                                  double *gradient_se, struct imp__totals *t)
{
    const size_t n = p->n;
    *t = (struct imp__totals){.many = n > IMP_TALLY_DENSE,
                              .wants_errors = gradient_se != NULL};
    const bool fine = t->many && gradient_se;
    const size_t rows = t->many ? !!gradient + !!gradient_se : 2;
    const size_t own = t->many && in_place ? fine : rows + fine;
    if (own > 0) {
        t->own = imp__alloc(p->ctx, own * n, sizeof *t->own);
        if (!t->own) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for gradients");
    }
    if (!t->many) {
        t->gradient = t->own;
        t->gradient_variance = t->own + n;
        return IMP_OK;
    }
    /* The sums of a value lie together: additions wait for memory. */
    imp_fixed *mean = in_place ? (imp_fixed *)gradient : (imp_fixed *)t->own;
    imp_fixed *spread =
        in_place ? (imp_fixed *)gradient_se : (imp_fixed *)t->own + !!gradient;
    const size_t apart = in_place ? 0 : own - 1;
    const bool alone = p->ctx->threads == 1;
    t->mean = (struct imp_fixed_sum){.n = n,
                                     .sum = gradient ? mean : NULL,
                                     .apart = apart,
                                     .clear = true,
                                     .alone = alone};
    t->spread = t->mean;
    t->spread.sum = gradient_se ? spread : NULL;
    if (fine) t->spread.fine = in_place ? (imp_fixed *)t->own : spread + 1;
    if (in_place && gradient) memset(gradient, 0, n * sizeof *gradient);
    if (in_place && gradient_se) memset(gradient_se, 0, n * sizeof *gradient_se);
    return IMP_OK;
}

void imp__totals_free(struct imp_problem *p, struct imp__totals *t)
{
    imp__release(p->ctx, t->own);
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
    if (!t->many) {
        if (gradient) memcpy(gradient, t->gradient, bytes);
        for (size_t k = 0; gradient_se && k < p->n; k++)
            gradient_se[k] = sqrt(fmax(t->gradient_variance[k], 0));
    } else if (!t->unit_known) { /* there was no term */
        if (gradient) memset(gradient, 0, bytes);
        if (gradient_se) memset(gradient_se, 0, bytes);
    } else { /* one pass through memory */
        for (size_t k = 0; k < p->n; k++) {
            if (gradient) gradient[k] = imp__fixed_value(&t->mean, k);
            if (!gradient_se) continue;
            const double variance = imp__fixed_value(&t->spread, k);
            gradient_se[k] = sqrt(imp_max(variance, 0.0));
        }
    }
}
