/* SPDX-License-Identifier: Apache-2.0
 *
 * Fields that are symmetric about an axis, of any profile along it: eta = f(u, z), a
 * tensor cubic B-spline in u = r^2 and in z. With y across the axis a, as in radial.c
 *     g = 2 f_u y + f_z a
 *     H = 2 f_u P + 4 f_uu y y^T + 2 f_uz (y a^T + a y^T) + f_zz a a^T
 *     theta_bar_kl += A B_k B_l + 2 (b.y) B_k' B_l + (b.a) B_k B_l'
 * (docs/bent-rays.md 3.2). */
#include "bend_rays.h"

#define CELLS_MAX 8192

struct place {
    imp_v3 y; /* across the axis */
    struct imp__bend_basis u, z;
    size_t first;
};

static inline struct place place_of(const struct imp__rz *r, imp_v3 x)
{
    struct place p;
    const imp_v3 d = x - r->centre;
    const double z = imp__dot(d, r->axis);
    p.y = d - r->axis * z;
    p.u = imp__bend_basis_of(imp__dot(p.y, p.y) * r->inv_u, r->desc.cells_r, r->inv_u);
    p.z = imp__bend_basis_of((z - r->desc.lo) * r->inv_z, r->desc.cells_z, r->inv_z);
    p.first = (size_t)p.u.first + (size_t)r->n_u * (size_t)p.z.first;
    return p;
}

/* f, f_u, f_z, f_uu, f_uz, f_zz */
static inline void derivatives(const struct imp__rz *r, const struct place *p,
                               const double *theta, int order, double f[6])
{
    for (int i = 0; i < 6; i++) f[i] = 0;
    for (int l = 0; l < 4; l++) {
        const double *row = theta + p->first + (size_t)l * (size_t)r->n_u;
        double s = 0, sd = 0, sdd = 0;
        for (int k = 0; k < 4; k++) {
            s += row[k] * p->u.b[k];
            sd += row[k] * p->u.d[k];
            if (order > 1) sdd += row[k] * p->u.dd[k];
        }
        f[0] += p->z.b[l] * s;
        f[1] += p->z.b[l] * sd;
        f[2] += p->z.d[l] * s;
        f[3] += p->z.b[l] * sdd;
        f[4] += p->z.d[l] * sd;
        f[5] += p->z.dd[l] * s;
    }
}

static void rz_eval(const imp_field *f, int n, const imp_v3 *x, int order,
                    struct imp__jet *jet)
{
    const struct imp__rz *r = (const struct imp__rz *)f;
    const imp_v3 a = r->axis;
    for (int i = 0; i < n; i++) {
        const struct place p = place_of(r, x[i]);
        double d[6];
        derivatives(r, &p, f->theta, order, d);
        jet[i].eta = d[0];
        jet[i].g = p.y * (2 * d[1]) + a * d[2];
        if (order < 2) continue;
        for (int k = 0; k < 3; k++) {
            imp_v3 e = {0};
            e[k] = 1;
            jet[i].h[k] = (e - a * a[k]) * (2 * d[1]) + p.y * (4 * d[3] * p.y[k]) +
                          (p.y * a[k] + a * p.y[k]) * (2 * d[4]) + a * (d[5] * a[k]);
        }
    }
}

static void rz_splat(const imp_field *f, const imp_v3 *x, double va, const imp_v3 *b,
                     struct imp__bar *bar)
{
    const struct imp__rz *r = (const struct imp__rz *)f;
    const struct place p = place_of(r, *x);
    const double bu = 2 * imp__dot(*b, p.y), bz = imp__dot(*b, r->axis);
    for (int l = 0; l < 4; l++) {
        const size_t at = p.first + (size_t)l * (size_t)r->n_u;
        double *row = imp__bar_reach(bar, at, 4) + at;
        const double value = va * p.z.b[l] + bz * p.z.d[l], slope = bu * p.z.b[l];
        for (int k = 0; k < 4; k++) row[k] += value * p.u.b[k] + slope * p.u.d[k];
    }
}

static void rz_tangent(const imp_field *f, const imp_v3 *x, const double *theta_dot,
                       double *eta_dot, imp_v3 *g_dot)
{
    const struct imp__rz *r = (const struct imp__rz *)f;
    const struct place p = place_of(r, *x);
    double d[6];
    derivatives(r, &p, theta_dot, 1, d);
    *eta_dot = d[0];
    *g_dot = p.y * (2 * d[1]) + r->axis * d[2];
}

const struct imp__field_ops imp__field_rz = {
    .name = "rz", .eval = rz_eval, .splat = rz_splat, .tangent = rz_tangent};

enum imp_status imp_field_rz_create(imp_context *ctx, const struct imp_field_rz *rz,
                                    double index, imp_field **out)
{
    struct imp_field_rz own = IMP_FIELD_RZ_INIT, *const desc = &own;
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, rz, "rz");
    IMP_REQUIRE(ctx, out, "out");
    IMP_OPTIONS(ctx, own, rz, "rz");
    IMP_FLOAT_MODE;
    const imp_v3 axis = imp__v3_load(desc->axis);
    const double length = imp__length(axis);
    imp_field *f = NULL;
    if (desc->cells_r < 1 || desc->cells_r > CELLS_MAX || desc->cells_z < 1 ||
        desc->cells_z > CELLS_MAX)
        return imp__error(ctx, IMP_E_ARG, "rz field: %d x %d cells", desc->cells_r,
                          desc->cells_z);
    if (!(desc->radius > 0) || !isfinite(desc->radius) || !(desc->hi > desc->lo) ||
        !isfinite(desc->hi - desc->lo))
        return imp__error(ctx, IMP_E_ARG, "rz field: radius %g, from %g to %g",
                          desc->radius, desc->lo, desc->hi);
    if (!(length > 0) || !isfinite(length) || !imp__is_finite(imp__v3_load(desc->centre)))
        return imp__error(ctx, IMP_E_ARG, "rz field: the axis has no direction");
    if (!(index > 0) || !isfinite(index))
        return imp__error(ctx, IMP_E_ARG, "rz field: index %g is not positive", index);
    const int n_u = desc->cells_r + 3, n_z = desc->cells_z + 3;
    enum imp_status st = imp__field_new(ctx, &imp__field_rz, sizeof(struct imp__rz),
                                        (size_t)n_u * (size_t)n_z, &f);
    if (st != IMP_OK) return st;
    struct imp__rz *r = (struct imp__rz *)f;
    r->desc = *desc;
    r->desc.size = sizeof r->desc;
    r->centre = imp__v3_load(desc->centre);
    r->axis = axis * (1 / length);
    r->inv_u = desc->cells_r / (desc->radius * desc->radius);
    r->inv_z = desc->cells_z / (desc->hi - desc->lo);
    r->n_u = n_u, r->n_z = n_z;
    f->spacing =
        fmin(desc->radius / desc->cells_r, (desc->hi - desc->lo) / desc->cells_z);
    for (size_t i = 0; i < f->n_theta; i++) f->theta[i] = index;
    *out = f;
    return IMP_OK;
}

enum imp_status imp_field_get_rz(const imp_field *f, struct imp_field_rz *out)
{
    IMP_REQUIRE(NULL, f, "field");
    IMP_REQUIRE(f->ctx, out, "rz");
    if (f->ops != &imp__field_rz)
        return imp__error(f->ctx, IMP_E_ARG, "a %s field is not in r^2 and z",
                          f->ops->name);
    IMP_GIVE(f->ctx, out, ((const struct imp__rz *)f)->desc, "rz");
    return IMP_OK;
}
