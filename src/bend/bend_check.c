/* SPDX-License-Identifier: Apache-2.0
 *
 * Checks of a problem of bent rays: identities that its gradient must satisfy, and the
 * error of its step. */
#include "bend_problem.h"
#include "math/rng.h"
#include <string.h>

static double random_pm(uint64_t stream, uint64_t i)
{
    return 2 * imp__u01(imp__key(126, stream, i), 0) - 1;
}

static enum imp_status row_add(imp_bend *b, struct imp_check_row row)
{
    void *grown =
        imp__grow(b->ctx, b->rows, &b->cap_rows, b->n_rows + 1, sizeof *b->rows);
    if (!grown) return imp__error(b->ctx, IMP_E_NOMEM, "no memory for a check");
    b->rows = grown;
    row.size = sizeof row;
    row.ok =
        row.limit <= 0 || row.error <= row.limit ? IMP_VERDICT_RIGHT : IMP_VERDICT_WRONG;
    b->rows[b->n_rows++] = row;
    return IMP_OK;
}

/* ---- The step ------------------------------------------------------------------ */

enum imp_status imp_bend_step_error(imp_bend *b, size_t pilots, double *error,
                                    double *order)
{
    enum imp_status st = IMP_OK;
    struct imp_bend_options o;
    IMP_REQUIRE(NULL, b, "bend");
    IMP_FLOAT_MODE;
    const size_t stride = imp_max(b->n / imp_max(pilots, (size_t)1), (size_t)1);
    const size_t n = b->n ? (b->n + stride - 1) / stride : 0;
    double(*x)[3] = imp__alloc(b->ctx, n + 1, sizeof *x),
    (*d)[3] = imp__alloc(b->ctx, n + 1, sizeof *d);
    uint16_t *group = imp__alloc(b->ctx, n + 1, sizeof *group);
    struct imp_bend_exit *e = imp__alloc(b->ctx, 3 * n + 1, sizeof *e);
    double sum[2] = {0}, used = 0;
    if (!x || !d || !group || !e)
        IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "no memory for pilot rays"));
    IMP_TRY(imp__bend_options_ready(b, &o));
    o.n_taps = 0;
    for (size_t i = 0; i < n; i++) {
        memcpy(x[i], b->x[i * stride], sizeof *x);
        memcpy(d[i], b->d[i * stride], sizeof *d);
        group[i] = b->group[i * stride];
    }
    const struct imp_bend_rays r = {.size = sizeof(struct imp_bend_rays),
                                    .n = n,
                                    .x = (const double(*)[3])x,
                                    .d = (const double(*)[3])d,
                                    .group = group};
    for (int k = 0; k < 3; k++, o.step /= 2)
        IMP_TRY(imp__bundles_trace(b, b->field, &o, &r, e + (size_t)k * n, NULL, NULL));
    for (size_t i = 0; i < n; i++) {
        const struct imp_bend_exit *a = &e[i], *h = &e[n + i], *q = &e[2 * n + i];
        if ((a->flags | h->flags | q->flags) & IMP_BEND_DROPPED) continue;
        used++;
        for (int k = 0; k < 3; k++) {
            sum[0] += imp__sqr(a->x[k] - h->x[k]);
            sum[1] += imp__sqr(h->x[k] - q->x[k]);
        }
    }
    if (!(used > 0)) {
        if (stride > 1) st = imp_bend_step_error(b, b->n, error, order); /* all rays */
        else
            st = imp__error(b->ctx, IMP_E_NUMERIC,
                            "error of the step: none of %zu rays comes to its end", n);
        goto out;
    }
    const double d0 = sqrt(sum[0] / used), d1 = sqrt(sum[1] / used);
    const double p = d1 > 1e-14 && d0 > d1 ? log2(d0 / d1) : 0;
    /* |x_t - x_{t/2}| = error(t) (1 - 2^-p) (docs/bent-rays.md 2.5) */
    if (error) *error = p > 0 ? d0 / (1 - exp2(-p)) : d0;
    if (order) *order = p;
out:
    imp__release(b->ctx, x), imp__release(b->ctx, d);
    imp__release(b->ctx, group), imp__release(b->ctx, e);
    return st;
}

/* ---- The gradient -------------------------------------------------------------- */

static enum imp_status check_transpose(imp_bend *b, const double *dot, double *bar)
{
    const imp_field *f = b->field;
    double worst = 0;
    for (uint64_t p = 0; p < 32; p++) {
        const struct imp_bend_rays r = imp__bend_rays(b);
        const imp_v3 x = imp__v3_load(r.x[imp__mix64(p) % r.n]);
        const imp_v3 g = imp__v3(random_pm(1, p), random_pm(2, p), random_pm(3, p));
        double eta_dot, left = 0, scale = 1e-300;
        imp_v3 g_dot;
        memset(bar, 0, f->n_theta * sizeof *bar);
        f->ops->splat(f, &x, 0.7, &g, &(struct imp__bar){.theta = bar});
        f->ops->tangent(f, &x, dot, &eta_dot, &g_dot);
        for (size_t i = 0; i < f->n_theta; i++)
            left += bar[i] * dot[i], scale += fabs(bar[i] * dot[i]);
        worst = fmax(worst, fabs(left - (0.7 * eta_dot + imp__dot(g, g_dot))) / scale);
    }
    return row_add(b, (struct imp_check_row){.method = "transpose",
                                             .param = f->ops->name,
                                             .error = worst,
                                             .limit = 1e-12});
}

static enum imp_status check_dot(imp_bend *b, const double *dot, double *bar,
                                 struct imp_bend_stats *traced)
{
    enum imp_status st = IMP_OK;
    struct imp_bend_options o;
    struct imp_bend_stats stats = IMP_BEND_STATS_INIT;
    const struct imp_bend_rays r = imp__bend_rays(b);
    const size_t taps = b->n * b->options.n_taps;
    struct imp_bend_exit *e = imp__alloc(b->ctx, b->n, sizeof *e);
    struct imp_bend_exit *te = imp__alloc(b->ctx, taps + 1, sizeof *te);
    struct imp_bend_cotangent *c = imp__alloc(b->ctx, 2 * b->n, sizeof *c),
                              *d = c ? c + b->n : NULL;
    double left = 0, right = 0, scale = 1e-300;
    if (!e || !te || !c)
        IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "no memory for a check"));
    IMP_TRY(imp__bend_options_ready(b, &o));
    IMP_TRY(imp__bundles_trace(b, b->field, &o, &r, e, te, traced));
    IMP_TRY(imp__bend_traced(b, traced));
    for (size_t i = 0; i < b->n; i++) {
        for (int k = 0; k < 3; k++)
            c[i].x[k] = random_pm(4 + (uint64_t)k, i),
            c[i].v[k] = random_pm(7 + (uint64_t)k, i);
        c[i].path = random_pm(10, i);
    }
    IMP_TRY(imp__bundles_adjoint(b, &o, &r, e, te, c, NULL, bar, &stats));
    IMP_TRY(imp__bundles_tangent(b, &o, &r, dot, d));
    for (size_t i = 0; i < b->field->n_theta; i++) left += bar[i] * dot[i];
    for (size_t i = 0; i < b->n; i++) {
        if (e[i].flags & IMP_BEND_DROPPED) continue;
        double s = c[i].path * d[i].path;
        for (int k = 0; k < 3; k++) s += c[i].x[k] * d[i].x[k] + c[i].v[k] * d[i].v[k];
        right += s;
        scale += fabs(s);
    }
    IMP_TRY(row_add(b, (struct imp_check_row){.method = "dot",
                                              .param = b->field->ops->name,
                                              .value = left,
                                              .reference = right,
                                              .error = fabs(left - right) / scale,
                                              .limit = 1e-12}));
    IMP_TRY(row_add(b, (struct imp_check_row){.method = "reversal",
                                              .param = "positions",
                                              .value = (double)stats.reversal,
                                              .error = stats.worst_reversal,
                                              .limit = 1e-10}));
    IMP_TRY(row_add(b, (struct imp_check_row){.method = "energy",
                                              .param = "|v|^2/eta^2 - 1",
                                              .value = (double)stats.energy,
                                              .error = stats.worst_energy,
                                              .limit = 0.01}));
out:
    imp__release(b->ctx, e), imp__release(b->ctx, te), imp__release(b->ctx, c);
    return st;
}

struct floats {
    uint8_t *mask;
};
static void floats_leaf(imp_field *f, size_t offset, void *payload)
{
    const struct floats *to = payload;
    const uint32_t *number;
    const struct imp__grid *g = imp__field_nodes(f, &number);
    if (g && g->desc.single) memset(to->mask + offset, 1, f->n_theta);
}

struct trilinear {
    bool any;
    double spacing;
};
static void trilinear_leaf(imp_field *f, size_t offset, void *payload)
{
    struct trilinear *t = payload;
    const uint32_t *number;
    const struct imp__grid *g = imp__field_nodes(f, &number);
    (void)offset;
    if (!g || g->desc.interp != IMP_FIELD_TRILINEAR) return;
    t->any = true;
    t->spacing = f->spacing;
}

/* In a trilinear field the objective has a kink where a ray runs along cell faces, as the
 * middle ray of a beam may. So each start is moved across its ray, at random, by about a
 * thousandth of a cell. */
static void aside(const imp_bend *b, double by, double (*x)[3])
{
    for (size_t i = 0; i < b->n; i++) {
        const imp_v3 d = imp__normalize(imp__v3_load(b->d[i]));
        imp_v3 m = imp__v3(random_pm(20, i), random_pm(21, i), random_pm(22, i));
        m = imp__v3_load(x[i]) + by * (m - d * imp__dot(d, m));
        imp__v3_store(m, x[i]);
    }
}

/* Central differences along the direction g / max_i |g_i|, g the gradient. */
static enum imp_status check_differences(imp_bend *b, double *dot, double *bar)
{
    enum imp_status st = IMP_OK;
    const size_t n = b->field->n_theta;
    double *theta = imp__alloc(b->ctx, 2 * n + 1, sizeof *theta),
           *moved = theta ? theta + n : NULL;
    double(*x)[3] = imp__alloc(b->ctx, b->n, sizeof *x);
    struct floats floats = {imp__alloc(b->ctx, n + 1, 1)};
    struct trilinear tri = {false, 0};
    double value, norm = 0, most = 0, f[2], before = NAN, bend = 0, size2 = 0;
    if (theta) imp_field_get_theta(b->field, theta);
    if (x) memcpy(x, b->x, b->n * sizeof *x);
    if (!theta || !x || !floats.mask)
        IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "no memory for a check"));
    imp__field_leaves(b->field, 0, floats_leaf, &floats);
    imp__field_leaves(b->field, 0, trilinear_leaf, &tri);
    if (tri.any) aside(b, 1e-3 * tri.spacing, b->x);
    IMP_TRY(imp_bend_objective(b, &value, bar, NULL, NULL));
    for (size_t i = 0; i < n; i++) most = fmax(most, fabs(bar[i]));
    for (size_t i = 0; i < n; i++) {
        dot[i] = most > 0 ? bar[i] / most : 0;
        norm += bar[i] * dot[i];
    }
    const bool smooth = b->field->ops != &imp__field_sum && !tri.any;
    const bool some_floats = memchr(floats.mask, 1, n) != NULL;
    for (size_t i = 0; i < b->n;
         i++) { /* scale of rounding: most objectives are squared lengths */
        const imp_v3 at = imp__v3_load(x[i]);
        size2 = fmax(size2, imp__dot(at, at));
    }
    for (int k = 2; k <= 8 && norm > 0; k++) {
        const double eps = pow(10, -k);
        double want = 0;
        for (int side = 0; side < 2; side++) {
            const double sign = side ? -1 : 1;
            for (size_t i = 0; i < n; i++) {
                moved[i] = theta[i] + sign * eps * dot[i];
                if (floats.mask[i]) moved[i] = (float)moved[i]; /* as it is traced */
                want += sign * bar[i] * (moved[i] / (2 * eps));
            }
            IMP_TRY(imp_field_set_theta(b->field, moved));
            st = imp_bend_objective(b, &f[side], NULL, NULL, NULL);
            if (st == IMP_E_NUMERIC) f[side] = NAN, st = IMP_OK; /* this row fails */
            if (st != IMP_OK) goto out;
        }
        /* Curvature of the objective limits large steps, rounding small ones. Sums and
         * trilinear fields are judged at the smallest step, 1e-8 (docs/bent-rays.md 3.3),
         * all others at 1e-4 to 1e-6. There a central difference has an error of
         * O(eps^2), so about 1/100 of the change from the ten times larger step is left;
         * 1/50 is allowed. Near a minimum the gradient is so small that the rounding of
         * theta counts: curvature times 1e-12, or 1e-7 where theta is stored as float. */
        const double fd = (f[0] - f[1]) / (2 * eps);
        if (k <= 4) bend = fmax(bend, fabs(f[0] + f[1] - 2 * value) / (eps * eps));
        const double left = !smooth            ? bend * eps
                            : isfinite(before) ? fabs(before - fd) / 50
                                               : 0;
        const double rounding = 1e-14 * fabs(value) / eps +
                                (some_floats ? 1e-7 : 1e-12) * bend + 1e-13 * size2;
        const bool judged = smooth ? k >= 4 && k <= 6 : k == 8;
        before = fd;
        IMP_TRY(row_add(b, (struct imp_check_row){
                               .method = "difference",
                               .param = "objective",
                               .step = eps,
                               .value = want,
                               .reference = fd,
                               .error = fabs(fd - want) / norm,
                               .limit = judged ? 1e-4 + (rounding + left) / norm : 0}));
    }
out:
    if (x) memcpy(b->x, x, b->n * sizeof *x);
    if (theta) { /* restored also after a failure */
        const enum imp_status back = imp_field_set_theta(b->field, theta);
        if (st == IMP_OK) st = back;
    }
    imp__release(b->ctx, theta);
    imp__release(b->ctx, x);
    imp__release(b->ctx, floats.mask);
    return st;
}

enum imp_status imp_bend_check(imp_bend *b, const struct imp_check_row **rows,
                               size_t *n_rows)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, b, "bend");
    IMP_REQUIRE(b->ctx, rows, "rows");
    IMP_REQUIRE(b->ctx, n_rows, "n_rows");
    IMP_FLOAT_MODE;
    const size_t n = b->field->n_theta;
    double *dot = imp__alloc(b->ctx, 2 * n + 1, sizeof *dot), *bar = dot ? dot + n : NULL;
    struct imp_bend_stats traced = IMP_BEND_STATS_INIT;
    double error, order;
    if (!dot) return imp__error(b->ctx, IMP_E_NOMEM, "no memory for a check");
    if (b->n == 0) IMP_TRY(imp__error(b->ctx, IMP_E_ARG, "a problem without rays"));
    b->n_rows = 0;
    for (size_t i = 0; i < n; i++) dot[i] = random_pm(11, i);
    IMP_TRY(check_transpose(b, dot, bar));
    IMP_TRY(check_dot(b, dot, bar, &traced));
    if (b->n_targets > 0) IMP_TRY(check_differences(b, dot, bar));
    IMP_TRY(imp_bend_step_error(b, 200, &error, &order));
    IMP_TRY(row_add(b, (struct imp_check_row){.method = "step",
                                              .param = "rms of exits",
                                              .value = order,
                                              .error = error}));
    const double all = (double)b->n;
    IMP_TRY(row_add(b, (struct imp_check_row){.method = "rays",
                                              .param = "come to their end",
                                              .value = (double)traced.traced,
                                              .reference = all,
                                              .error = 1 - (double)traced.traced / all}));
    *rows = b->rows;
    *n_rows = b->n_rows;
out:
    imp__release(b->ctx, dot);
    return st;
}
