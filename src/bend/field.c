/* SPDX-License-Identifier: Apache-2.0
 *
 * What all index fields share: numbers, names, and calls by plain arrays. */
#include "bend_rays.h"
#include <string.h>

enum imp_status imp__field_new(imp_context *ctx, const struct imp__field_ops *ops,
                               size_t size, size_t n_theta, imp_field **out)
{
    imp_field *f = imp__alloc(ctx, 1, size);
    if (!f) return imp__error(ctx, IMP_E_NOMEM, "no memory for an index field");
    f->ops = ops;
    f->ctx = ctx;
    f->n_theta = n_theta;
    f->lo = imp__v3(-INFINITY, -INFINITY, -INFINITY);
    f->hi = -f->lo;
    f->lo[3] = f->hi[3] = 0;
    f->theta = imp__alloc(ctx, imp_max(n_theta, (size_t)1), sizeof *f->theta);
    if (!f->theta) {
        imp__release(ctx, f);
        return imp__error(ctx, IMP_E_NOMEM, "no memory for %zu numbers of an index field",
                          n_theta);
    }
    imp__context_hold(ctx);
    *out = f;
    return IMP_OK;
}

void imp_field_destroy(imp_field *f)
{
    if (!f) return;
    if (f->ops->destroy) f->ops->destroy(f);
    imp_context *ctx = f->ctx;
    if (!f->borrowed) imp__release(ctx, f->theta);
    imp__release(ctx, f);
    imp__context_drop(ctx);
}

const char *imp_field_kind(const imp_field *f) { return f ? f->ops->name : ""; }
size_t imp_field_n_theta(const imp_field *f) { return f ? f->n_theta : 0; }

enum imp_status imp_field_get_theta(const imp_field *f, double *theta)
{
    IMP_REQUIRE(NULL, f, "field");
    IMP_REQUIRE(f->ctx, theta, "theta");
    memcpy(theta, f->theta, f->n_theta * sizeof *theta);
    return IMP_OK;
}

enum imp_status imp_field_set_theta(imp_field *f, const double *theta)
{
    IMP_REQUIRE(NULL, f, "field");
    IMP_REQUIRE(f->ctx, theta, "theta");
    IMP_FLOAT_MODE;
    for (size_t i = 0; i < f->n_theta; i++)
        if (!isfinite(theta[i]))
            return imp__error(f->ctx, IMP_E_ARG, "theta[%zu] of the %s field is %g", i,
                              f->ops->name, theta[i]);
    memcpy(f->theta, theta, f->n_theta * sizeof *theta);
    if (f->ops->changed) f->ops->changed(f);
    return IMP_OK;
}

const char *imp_field_param_name(const imp_field *f, size_t i)
{
    return f && f->ops->param_name && i < f->n_theta ? f->ops->param_name(f, i) : NULL;
}

enum imp_status imp_field_get_bounds(const imp_field *f, double lo[3], double hi[3])
{
    IMP_REQUIRE(NULL, f, "field");
    IMP_REQUIRE(f->ctx, lo, "lo");
    IMP_REQUIRE(f->ctx, hi, "hi");
    imp__v3_store(f->lo, lo);
    imp__v3_store(f->hi, hi);
    return IMP_OK;
}

void imp_field_eval(const imp_field *f, const double x[3], double *eta, double *gradient,
                    double *hessian)
{
    IMP_REQUIRE_OR(NULL, f, "field", );
    IMP_REQUIRE_OR(f->ctx, x, "x", );
    IMP_REQUIRE_OR(f->ctx, eta, "eta", );
    IMP_FLOAT_MODE;
    const imp_v3 at = imp__v3_load(x);
    struct imp__jet j;
    imp__field_eval1(f, &at, hessian ? 2 : 1, &j);
    *eta = j.eta;
    if (gradient) imp__v3_store(j.g, gradient);
    if (hessian) {
        hessian[0] = j.h[0][0], hessian[1] = j.h[1][1], hessian[2] = j.h[2][2];
        hessian[3] = j.h[0][1], hessian[4] = j.h[0][2], hessian[5] = j.h[1][2];
    }
}

void imp_field_splat(const imp_field *f, const double x[3], double a, const double b[3],
                     double *theta_bar)
{
    IMP_REQUIRE_OR(NULL, f, "field", );
    IMP_REQUIRE_OR(f->ctx, x, "x", );
    IMP_REQUIRE_OR(f->ctx, b, "b", );
    IMP_REQUIRE_OR(f->ctx, theta_bar, "theta_bar", );
    IMP_FLOAT_MODE;
    const imp_v3 at = imp__v3_load(x), gb = imp__v3_load(b);
    struct imp__bar bar = {.theta = theta_bar};
    f->ops->splat(f, &at, a, &gb, &bar);
}

void imp_field_tangent(const imp_field *f, const double x[3], const double *theta_dot,
                       double *eta_dot, double gradient_dot[3])
{
    IMP_REQUIRE_OR(NULL, f, "field", );
    IMP_REQUIRE_OR(f->ctx, x, "x", );
    IMP_REQUIRE_OR(f->ctx, theta_dot, "theta_dot", );
    IMP_REQUIRE_OR(f->ctx, eta_dot, "eta_dot", );
    IMP_REQUIRE_OR(f->ctx, gradient_dot, "gradient_dot", );
    IMP_FLOAT_MODE;
    const imp_v3 at = imp__v3_load(x);
    imp_v3 g;
    f->ops->tangent(f, &at, theta_dot, eta_dot, &g);
    imp__v3_store(g, gradient_dot);
}

double imp__field_index_max(const imp_field *f)
{
    const uint32_t *number;
    const struct imp__grid *g = imp__field_nodes(f, &number);
    if (g) {
        return g->desc.param == IMP_FIELD_ETA2 ? sqrt(2 * g->most) : g->most;
    }
    double m = 0;
    for (int i = 0; i <= 64; i++) {
        imp_v3 x = {0};
        for (int k = 0; k < 3; k++)
            if (isfinite(f->lo[k]) && isfinite(f->hi[k]))
                x[k] = f->lo[k] + (f->hi[k] - f->lo[k]) * i / 64;
        struct imp__jet j;
        imp__field_eval1(f, &x, 1, &j);
        if (isfinite(j.eta)) m = fmax(m, j.eta);
    }
    return m;
}
