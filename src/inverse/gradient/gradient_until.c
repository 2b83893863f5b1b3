/* SPDX-License-Identifier: Apache-2.0
 *
 * A value and its gradient until their errors are small enough: the mean over stages,
 * each of its own walks, after each of which the errors are tested. For a parameter with
 * standard errors s_i, |g - truth|^2 is beyond z^2 sum s_i^2 no more often than a normal
 * variable is beyond +-z, for z >= 1.54 and however the errors depend on each other
 * (Szekely and Bakirov, Probab. Theory Relat. Fields 126, 2003). */
#include "allocation.h"
#include "base/arguments.h"
#include "walk/run/interim_looks.h"
#include <math.h>
#include <string.h>

static double over(double error, double of)
{
    return of > 0 ? error / of : INFINITY; /* what is 0 may not have been found yet */
}

/* Error bound of the least certain parameter, or of the value if there is no gradient. */
static double bound(const struct imp__looks *l, const struct imp_problem *p,
                    const struct imp_estimate *value, const double *g, const double *se)
{
    const double z = imp__looks_z(l);
    double worst = 0;
    if (!g) return over(z * value->se, fabs(value->value));
    for (size_t b = 0; b < p->n_blocks; b++) {
        double square = 0, length = 0;
        for (size_t i = p->blocks[b].first; i < p->blocks[b].first + p->blocks[b].count;
             i++) {
            square += se[i] * se[i];
            length += g[i] * g[i];
        }
        const double part = over(z * sqrt(square), sqrt(length));
        if (!(part <= worst)) worst = part; /* not a number, too */
    }
    return worst;
}

/* The variance by which a stage's samples are allocated. With q_b the squared error of
 * parameter b over its squared length, the largest of which ends the sequence, sum q_b^4
 * estimates it:
 *
 *     d q_b^4 / d Var g_k  ~  q_b^3 / |g_b|^2
 */
struct counting {
    const struct imp_problem *p;
    double *weight; /* [n_blocks] */
};

static double counting_weight(size_t k, const void *payload)
{
    const struct counting *c = payload;
    return c->weight[imp__problem_block(c->p, k) - c->p->blocks];
}

static void counting_set(const struct counting *c, const double *g, const double *se)
{
    double most = 0;
    for (int pass = 0; pass < 2; pass++)
        for (size_t b = 0; b < c->p->n_blocks; b++) {
            const struct imp__block *of = &c->p->blocks[b];
            double square = 0, length = 0;
            for (size_t i = of->first; i < of->first + of->count; i++) {
                square += se[i] * se[i];
                length += g[i] * g[i];
            }
            const double q = length > 0 ? square / length : 0;
            if (pass == 0) most = fmax(most, q);
            else c->weight[b] = q > 0 ? pow(q / most, 3) / length : 0;
        }
}

static void mix(double w, double value, double value_se, double *mean, double *se)
{
    *mean = (1 - w) * *mean + w * value;
    *se = hypot((1 - w) * *se, w * value_se);
}

enum imp_status imp_problem_until(imp_problem *p, const float *adjoint,
                                  const struct imp_run *run,
                                  const struct imp_until_options *options,
                                  struct imp_estimate *value, double *gradient,
                                  double *gradient_se, struct imp_until_end *end)
{
    enum imp_status st = IMP_OK;
    struct imp_run own;
    struct imp__looks l;
    struct imp_estimate all = {0}, f;
    struct imp__allocation allocation = {0};
    double *g = NULL;
    IMP_REQUIRE(NULL, p, "problem");
    imp_context *ctx = p->ctx;
    if (end) IMP_SIZED(ctx, end, "end");
    if (!gradient != !gradient_se)
        return imp__error(ctx, IMP_E_ARG, "%s: gradient and gradient_se go together",
                          __func__);
    IMP_RUN(ctx, own, run);
    IMP_CHECKED(imp__looks_begin(ctx, __func__, &own, options, &l));
    const size_t n = gradient ? p->n : 0;
    g = imp__alloc(ctx, 4 * n + p->n_blocks + 1, sizeof *g);
    if (!g) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for %zu derivatives", n));
    double *se = g + n, *mean = se + n, *mean_se = mean + n;
    const struct counting counting = {p, mean_se + n};
    const struct imp__metric metric = {.weight = counting_weight, .payload = &counting};
    const bool allocates =
        n > 0 && !adjoint && l.options.allocation != IMP_ALLOCATION_EVEN;
    l.run.time_limit_s = 0;
    if (!adjoint) imp__points_of_losses(p, &l.run);
    while (imp__looks_next(&l)) {
        double *to = gradient ? g : NULL, *to_se = gradient ? se : NULL;
        if (allocates) IMP_TRY(imp__allocation_again(p, &l.run, &allocation));
        allocation.metric = l.end.looks > 1 ? &metric : NULL;
        p->allocation = allocation.n > 0 ? &allocation : NULL;
        st = adjoint ? imp_problem_functional(p, adjoint, &l.run, &f, to, to_se)
                     : imp_problem_objective(p, NULL, &l.run, &f, to, to_se);
        p->allocation = NULL;
        if (st == IMP_CANCELLED && l.end.looks > 1) {
            l.end.spp = (int64_t)l.before;
            l.end.looks--;
            break;
        }
        IMP_TRY(st);
        const double w = imp__looks_weight(&l);
        mix(w, f.value, f.se, &all.value, &all.se);
        /* Each stage has the bias of its own number of samples: the mean's is that of the
         * first. */
        all.bias_order = l.end.looks > 1 && f.bias_order ? 1 : f.bias_order;
        for (size_t i = 0; i < n; i++) mix(w, g[i], se[i], &mean[i], &mean_se[i]);
        if (allocation.n > 0) {
            imp__allocation_update(&allocation);
            counting_set(&counting, mean, mean_se);
        }
        imp__looks_bound(&l, bound(&l, p, &all, gradient ? mean : NULL, mean_se));
    }
    if (value) *value = all;
    if (n > 0) memcpy(gradient, mean, n * sizeof *mean);
    if (n > 0) memcpy(gradient_se, mean_se, n * sizeof *mean_se);
    if (end) IMP_GIVE(ctx, end, l.end, "end");
out:
    p->allocation = NULL;
    imp__allocation_destroy(&allocation);
    imp__release(ctx, g);
    return st;
}
