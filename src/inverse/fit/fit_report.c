/* SPDX-License-Identifier: Apache-2.0
 *
 * The warnings of a fit as one text: chi-square too large, noise not known, variables without an
 * interval, bias of order 1/spp. */
#include "fit.h"
#include "inverse/problem/loss.h"
#include "search/covariance.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define NAMES_MAX 6
#define MISFIT    2   /* warn above this chi^2 per degree of freedom, if it is also */
#define MISFIT_Z  3   /* this many standard errors above 1 */
#define LEFT_OVER 0.2 /* warn above this relative residual of the targets */
#define FAR       3   /* warn above this step at the end, in standard errors */
#define FEW       10  /* with fewer degrees of freedom chi^2 is too noisy to judge */

struct text {
    char buffer[1536];
    size_t used;
};

IMP_PRINTF(2, 3) static void put(struct text *t, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    const int n =
        vsnprintf(t->buffer + t->used, sizeof t->buffer - t->used, format, args);
    va_end(args);
    if (n > 0) t->used = imp_min(t->used + (size_t)n, sizeof t->buffer - 1);
}

static void put_name(struct text *t, const struct imp__fit *f, size_t i)
{
    const struct imp__block *b = imp__problem_block(f->problem, i);
    put(t, b->count > 1 ? "%s[%zu]" : "%s", imp__block_name(f->problem, b), i - b->first);
}

static void put_loose(struct text *t, const struct imp__fit *f,
                      const struct imp_fit_variable *v, const struct imp__uncertainty *u)
{
    const size_t n = f->problem->n;
    const double *direction = u->loosest;
    size_t count = 0, held = 0, shown = 0;
    for (size_t i = 0; i < n; i++) {
        count += !v[i].determined;
        held += !v[i].determined && isfinite(v[i].se);
    }
    if (count == 0) return;
    put(t, "%sthe pictures do not determine ", t->used ? "; " : "");
    for (size_t i = 0; i < n && shown < NAMES_MAX; i++) {
        if (v[i].determined) continue;
        if (shown++) put(t, ", ");
        put_name(t, f, i);
    }
    if (count > shown) put(t, " and %zu more", count - shown);
    if (u->hidden) put(t, ", or these samples are too few to tell: use more");
    if (held) put(t, ", whose intervals rest on the prior");
    /* Warn of an undetermined combination; a single variable has its own warning. */
    double largest = 0;
    for (size_t i = 0; i < n; i++) largest = fmax(largest, fabs(direction[i]));
    if (largest < 0.98) {
        put(t, " (least: ");
        shown = 0;
        for (size_t i = 0; i < n && shown < NAMES_MAX; i++) {
            if (fabs(direction[i]) < 0.2) continue;
            put(t, "%s%+.2f ", shown++ ? " " : "", direction[i]);
            put_name(t, f, i);
        }
        put(t, ", in units of their scales)");
    }
}

/* Standard errors of many variables, which drawn vectors estimate. */
static void put_errors(struct text *t, const struct imp__fit *f)
{
    put(t, "%sstandard errors are those of %d drawn vectors, each known to %.0f %%",
        t->used ? "; " : "", IMP_ERROR_DRAWS, 100 / sqrt(2.0 * IMP_ERROR_DRAWS));
    if (f->errors.n_loose)
        put(t, "; the pictures do not determine %zu of %zu numbers", f->errors.n_loose,
            f->problem->n);
    if (f->errors.n_bound) put(t, "; %zu at a bound have none", f->errors.n_bound);
}

static void put_shift(struct text *t, const struct imp__fit *f,
                      const struct imp__fit_shift *shift)
{
    if (shift->of_se < 2) {
        put(t,
            "; four times the samples would move no number by more than %.1f of its "
            "standard errors",
            fmax(shift->of_se, 0.1));
        return;
    }
    put(t, "; four times the samples would move ");
    put_name(t, f, shift->variable);
    put(t, " by %+.2g +- %.1g, %.1f of its standard errors: use more", shift->step,
        shift->se, shift->of_se);
}

static bool quadratic(const struct imp_problem *p)
{
    for (size_t t = 0; t < p->n_targets; t++)
        if (!imp__loss_quadratic(p->targets[t].desc.loss)) return false;
    return true;
}

/* More than the uncertainty of the loss, where the targets' noise does not explain it. */
static bool much_left(const struct imp__fit_residual *r)
{
    const double square = r->relative * r->relative;
    const double two_se = r->relative_hi * r->relative_hi - square;
    return !isfinite(r->chi2) && square - two_se > LEFT_OVER * LEFT_OVER;
}

const char *imp__fit_warning(const struct imp__fit *f, int bias_order,
                             const struct imp_fit_variable *variables,
                             const struct imp__uncertainty *u, const char *no_intervals,
                             const struct imp__fit_residual *residual,
                             const struct imp__fit_shift *shift)
{
    struct text t = {.used = 0};
    const double *loosest = u->loosest;
    if (residual->chi2 > MISFIT && residual->chi2 - 1 > MISFIT_Z * residual->chi2_se)
        put(&t,
            "the scene does not explain the pictures: what is left is %.*f +- %.1g times "
            "what their noise leaves (chi-square per degree of freedom); this is another "
            "minimum, or another parameter is wrong, which intervals do not include",
            residual->chi2 < 100, residual->chi2, residual->chi2_se);
    else if (much_left(residual))
        put(&t,
            "%.0f %% of the targets are left over: a target belongs to another sensor, "
            "this is another minimum, or the scene cannot make the pictures",
            100 * residual->relative);
    if (loosest && !f->noise_known && residual->freedom < FEW)
        put(&t,
            "%sthe targets' noise is not known, and %.0f residuals less %zu variables "
            "determine %s of it: intervals %s. Give targets with their standard errors "
            "(render --se)",
            t.used ? "; " : "", residual->count, f->problem->n,
            residual->freedom > 0 ? "little" : "nothing",
            residual->freedom > 0 ? "are uncertain" : "are without it");
    if (loosest) put_loose(&t, f, variables, u);
    /* Levenberg-Marquardt's steps say themselves how near it is. */
    if (u->step > FAR && f->options.optimizer != IMP_LM) {
        put(&t, "%sthe search had not ended: the last step moved ", t.used ? "; " : "");
        put_name(&t, f, u->step_of);
        put(&t,
            " by %.1f of its standard errors, which hold near the end alone. Use more "
            "iterations or samples",
            u->step);
    }
    if (f->errors.x) put_errors(&t, f);
    if (no_intervals) put(&t, "%sno intervals: %s", t.used ? "; " : "", no_intervals);
    if (bias_order > 0)
        put(&t, "%s%s a bias of order 1/spp%s in value and gradient", t.used ? "; " : "",
            quadratic(f->problem) ? "a filter wider than a pixel leaves"
                                  : "this loss leaves",
            bias_order == 2 ? "^2" : "");
    if (bias_order > 0 && shift->of_se >= 0) put_shift(&t, f, shift);
    return t.used ? imp__arena_strdup(&f->problem->fit_arena, t.buffer) : NULL;
}
