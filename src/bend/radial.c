/* SPDX-License-Identifier: Apache-2.0
 *
 * Radial spline: eta = f(u), a cubic B-spline in u = r^2 on [0, radius^2], with r from a
 * centre or an axis. In r^2 nothing is singular at r = 0:
 *     g = 2 f' y,  H = 2 f' P + 4 f'' y y^T,
 *     theta_bar_k += a B_k(u) + 2 (b.y) B_k'(u)
 * (docs/bent-rays.md 3.2). */
#include "bend_rays.h"
#include <string.h>

#define CELLS_MAX 65536

static inline imp_v3 offset_of(const struct imp__radial *r, imp_v3 x)
{
    imp_v3 y = x - r->centre;
    if (r->desc.cylinder) y -= r->axis * imp__dot(y, r->axis);
    return y;
}

static inline struct imp__bend_basis basis_of(const struct imp__radial *r, double u2)
{
    return imp__bend_basis_of(u2 / r->h, r->desc.cells, 1 / r->h);
}

static void radial_eval(const imp_field *f, int n, const imp_v3 *x, int order,
                        struct imp__jet *jet)
{
    const struct imp__radial *r = (const struct imp__radial *)f;
    for (int i = 0; i < n; i++) {
        const imp_v3 y = offset_of(r, x[i]);
        const struct imp__bend_basis b = basis_of(r, imp__dot(y, y));
        double f0 = 0, f1 = 0, f2 = 0;
        for (int k = 0; k < 4; k++) {
            const double c = f->theta[b.first + k];
            f0 += c * b.b[k], f1 += c * b.d[k], f2 += c * b.dd[k];
        }
        jet[i].eta = f0;
        jet[i].g = y * (2 * f1);
        if (order < 2) continue;
        for (int k = 0; k < 3; k++) {
            imp_v3 e = {0};
            e[k] = 1;
            if (r->desc.cylinder) e -= r->axis * r->axis[k];
            jet[i].h[k] = e * (2 * f1) + y * (4 * f2 * y[k]);
        }
    }
}

static void radial_splat(const imp_field *f, const imp_v3 *x, double a, const imp_v3 *b,
                         struct imp__bar *bar)
{
    const struct imp__radial *r = (const struct imp__radial *)f;
    const imp_v3 y = offset_of(r, *x);
    const struct imp__bend_basis s = basis_of(r, imp__dot(y, y));
    const double slope = 2 * imp__dot(*b, y);
    double *theta_bar = imp__bar_reach(bar, (size_t)s.first, 4);
    for (int k = 0; k < 4; k++) theta_bar[s.first + k] += a * s.b[k] + slope * s.d[k];
}

static void radial_tangent(const imp_field *f, const imp_v3 *x, const double *theta_dot,
                           double *eta_dot, imp_v3 *g_dot)
{
    const struct imp__radial *r = (const struct imp__radial *)f;
    const imp_v3 y = offset_of(r, *x);
    const struct imp__bend_basis s = basis_of(r, imp__dot(y, y));
    double f0 = 0, f1 = 0;
    for (int k = 0; k < 4; k++)
        f0 += theta_dot[s.first + k] * s.b[k], f1 += theta_dot[s.first + k] * s.d[k];
    *eta_dot = f0;
    *g_dot = y * (2 * f1);
}

const struct imp__field_ops imp__field_radial = {.name = "radial",
                                                 .eval = radial_eval,
                                                 .splat = radial_splat,
                                                 .tangent = radial_tangent};

enum imp_status imp_field_radial_create(imp_context *ctx,
                                        const struct imp_field_radial *radial,
                                        double index, imp_field **out)
{
    struct imp_field_radial own = IMP_FIELD_RADIAL_INIT, *const desc = &own;
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, radial, "radial");
    IMP_REQUIRE(ctx, out, "out");
    IMP_OPTIONS(ctx, own, radial, "radial");
    IMP_FLOAT_MODE;
    const imp_v3 axis = imp__v3_load(desc->axis);
    const double length = imp__length(axis);
    imp_field *f = NULL;
    if (desc->cells < 1 || desc->cells > CELLS_MAX)
        return imp__error(ctx, IMP_E_ARG, "radial field: %d cells", desc->cells);
    if (!(desc->radius > 0) || !isfinite(desc->radius))
        return imp__error(ctx, IMP_E_ARG, "radial field: radius %g", desc->radius);
    if (!imp__is_finite(imp__v3_load(desc->centre)))
        return imp__error(ctx, IMP_E_ARG, "radial field: the centre is not finite");
    IMP_FINITE_ALL(ctx, desc->axis, 3, "axis");
    if (desc->cylinder && !(length > 0 && isfinite(length)))
        return imp__error(ctx, IMP_E_ARG, "radial field: the axis has no direction");
    if (!(index > 0) || !isfinite(index))
        return imp__error(ctx, IMP_E_ARG, "radial field: index %g is not positive",
                          index);
    enum imp_status st = imp__field_new(
        ctx, &imp__field_radial, sizeof(struct imp__radial), (size_t)desc->cells + 3, &f);
    if (st != IMP_OK) return st;
    struct imp__radial *r = (struct imp__radial *)f;
    r->desc = *desc;
    r->desc.size = sizeof r->desc;
    r->centre = imp__v3_load(desc->centre);
    r->axis = desc->cylinder ? axis * (1 / length) : (imp_v3){0};
    r->h = desc->radius * desc->radius / desc->cells;
    f->spacing = desc->radius / desc->cells;
    for (size_t i = 0; i < f->n_theta; i++) f->theta[i] = index;
    *out = f;
    return IMP_OK;
}
