/* SPDX-License-Identifier: Apache-2.0
 *
 * Shadow rays of a bundle through media (tracking.c, `sees`, of walks alone). Rows of in_media.h are
 * those of the shadow rays here. */
#include "in_media.h"
#include "math/exp.h"
#include "scene/instances.h"

/* The rays as they are followed: unit directions, from behind points of media. */
static void begin(struct imp_depth *d)
{
    struct imp_in_media *x = d->media;
    const struct imp_shadows *shadows = d->shadows;
    const struct imp_ray_columns *rays = &shadows->ray;
    for (int i = 0; i < rays->n; i += IMP_WIDE_LANES) {
        const imp_wide3 to = {imp__wide_load(&rays->d[0][i]),
                              imp__wide_load(&rays->d[1][i]),
                              imp__wide_load(&rays->d[2][i])};
        const imp_wide length = imp__wide3_norm(to),
                       back = imp__wide_load(&shadows->behind[i]);
        const imp_wide3 dir = imp__wide3_times(to, 1 / length),
                        from = {imp__wide_load(&rays->o[0][i]),
                                imp__wide_load(&rays->o[1][i]),
                                imp__wide_load(&rays->o[2][i])};
        const imp_wide3 start = imp__wide3_minus(from, imp__wide3_times(dir, back));
        imp__wide3_store(rays->d, i, dir);
        imp__wide3_store(rays->o, i, start);
        imp__wide3_store(x->start, i, start);
        imp__wide_store(&x->tmax[i], imp__wide_load(&rays->far[i]) * length + back);
        imp__wide_store(&x->base[i], imp__wide(0));
        imp__wide_store(&x->near[i], back);
        for (int c = 0; c < 3; c++) imp__wide_store(&x->f[c][i], imp__wide(1));
    }
    for (int i = 0; i < rays->n; i++) {
        x->medium[i] = shadows->medium[i];
        x->active[i] = i;
    }
}

static void fly(struct imp_in_media *x, const int32_t *list, int n)
{
    for (int i = 0; i < n; i += IMP_WIDE_LANES) {
        const int left = imp_min(n - i, IMP_WIDE_LANES);
        int32_t ray[IMP_WIDE_LANES], medium[IMP_WIDE_LANES];
        for (int k = 0; k < IMP_WIDE_LANES; k++) {
            ray[k] = list[i + (k < left ? k : 0)];
            medium[k] = x->medium[ray[k]];
        }
        const imp_wide length = imp__wide_decide(imp__wide_taken(x->far, ray) -
                                                 imp__wide_taken(x->near, ray));
        for (int c = 0; c < 3; c++) {
            const imp_wide sigma = imp__media_sigma(x, c, medium);
            const imp_wide T = imp__wide_choose(sigma > 0,
                                                IMP_WIDE_OF(imp__exp)(-sigma * length),
                                                imp__wide(1)),
                           f = imp__wide_taken(x->f[c], ray) * T;
            for (int k = 0; k < left; k++) x->f[c][ray[k]] = f[k];
        }
    }
}

static void arrive(struct imp_depth *d, int i)
{
    const int at = d->shadows->at[i];
    for (int c = 0; c < 3; c++) d->values->b[c][at] *= d->media->f[c][i];
}
static void hide(struct imp_depth *d, int i)
{
    const int at = d->shadows->at[i];
    for (int c = 0; c < 3; c++) d->values->b[c][at] = 0;
}

/* Ray i, number k, behind the null surface that it has met. True: it goes on. */
static bool passes(struct imp_depth *d, int i, int k, int passed)
{
    struct imp_in_media *x = d->media;
    const struct imp_scene *scene = d->bundle->tracer->scene;
    const struct imp_shape *shape = scene->shapes[x->met.shape[k]];
    const struct imp_ray_columns *rays = &d->shadows->ray;
    const struct imp_hit hit = {.shape = x->met.shape[k],
                                .prim = x->met.prim[k],
                                .t = x->met.t[k],
                                .u = x->met.u[k],
                                .v = x->met.v[k],
                                .place = x->met.place[k],
                                .time = rays->time ? rays->time[i] : rays->instant};
    const imp_v3 o = imp__column_v3(rays->o, i), dir = imp__column_v3(rays->d, i);
    struct imp_surface at;
    imp__hit_surface(scene, &hit, &o, &dir, &at);
    x->medium[i] = imp__media_beyond(shape, at.ng, dir, x->medium[i]);
    const imp_v3 next = imp__offset(at.p, at.ng, dir);
    imp__column_put(rays->o, i, next);
    x->near[i] = x->base[i] = imp__dot(next - imp__column_v3(x->start, i), dir);
    if (!(x->base[i] < x->tmax[i])) { /* it lies within rounding of the light */
        arrive(d, i);
        return false;
    }
    if (passed < IMP_WALK_MAX) return true;
    d->bundle->dropped[d->shadows->walk[i]] = IMP_DROP_LONG;
    return false;
}

static int stretch(struct imp_depth *d, int n, int passed)
{
    struct imp_in_media *x = d->media;
    const struct imp_scene *scene = d->bundle->tracer->scene;
    const struct imp_ray_columns *rays = &d->shadows->ray;
    int flying = 0, going = 0;
    for (int k = 0; k < n; k++) {
        const int i = x->active[k];
        for (int c = 0; c < 3; c++) {
            x->ahead.o[c][k] = rays->o[c][i];
            x->ahead.d[c][k] = rays->d[c][i];
        }
        x->ahead.far[k] = x->tmax[i] - x->base[i];
        if (x->ahead.time) x->ahead.time[k] = rays->time[i];
    }
    x->ahead.n = n;
    imp__intersect_columns(scene, &x->ahead, &x->met);
    for (int k = 0; k < n; k++) {
        const int i = x->active[k], shape = x->met.shape[k];
        x->far[i] = shape >= 0 ? x->base[i] + x->met.t[k] : x->tmax[i];
        if (shape >= 0 &&
            !(imp__shape_bsdf(scene, scene->shapes[shape])->flags & IMP_BSDF_NULL))
            hide(d, i);
        else if (x->medium[i] >= 0 && x->near[i] < x->far[i]) x->flying[flying++] = i;
    }
    fly(x, x->flying, flying);
    for (int k = 0; k < n; k++) {
        const int i = x->active[k], shape = x->met.shape[k];
        if (shape < 0) arrive(d, i);
        else if (imp__shape_bsdf(scene, scene->shapes[shape])->flags & IMP_BSDF_NULL &&
                 passes(d, i, k, passed))
            x->going[going++] = i;
    }
    for (int k = 0; k < going; k++) x->active[k] = x->going[k];
    return going;
}

void imp__media_see(struct imp_depth *d)
{
    int n = d->shadows->ray.n;
    begin(d);
    for (int passed = 0; n > 0; passed++) n = stretch(d, n, passed);
    d->shadows->ray.n = 0;
}
