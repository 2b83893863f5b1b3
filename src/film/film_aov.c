/* SPDX-License-Identifier: Apache-2.0
 *
 * Albedo, depth, position, normals, texture coordinates and their slopes at a sample's first hit,
 * by type of channel. */
#include "film_aov.h"
#include "kind/cleared.h"
#include "scene/instances.h"
#include "walk/core/dims.h"

int imp__aov_count(enum imp_aov_type type)
{
    int n = 0;
    while (n < 3 && imp__aov_channels[type][n]) n++;
    return n;
}

/* First hit of the ray through a film position; false: none. */
static bool first_surface(const struct imp_measure *m, double time, double px, double py,
                          const double lens[2], struct imp_sensor_ray *ray,
                          struct imp_hit *hit, struct imp_surface *at)
{
    imp__sensor_ray(m->sensor, px, py, lens, ray);
    if (!imp__intersect_at(m->scene, time, &ray->o, &ray->d, ray->t_near, ray->t_far,
                           hit))
        return false;
    imp__hit_surface(m->scene, hit, &ray->o, &ray->d, at);
    return true;
}

/* How uv changes with the film position: the neighbouring ray on the tangent plane, the
 * offset found in the basis of dp_du, dp_dv by least squares. */
static void uv_slope(const struct imp_measure *m, double px, double py,
                     const double lens[2], const struct imp_surface *at, double duv[2])
{
    struct imp_sensor_ray ray;
    imp__sensor_ray(m->sensor, px, py, lens, &ray);
    const double t = imp__dot(at->ng, at->p - ray.o) / imp__dot(at->ng, ray.d);
    const imp_v3 dp = ray.o + ray.d * t - at->p;
    const double a = imp__dot(at->dp_du, at->dp_du), b = imp__dot(at->dp_du, at->dp_dv);
    const double c = imp__dot(at->dp_dv, at->dp_dv), det = a * c - b * b;
    const double r = imp__dot(at->dp_du, dp), s = imp__dot(at->dp_dv, dp);
    duv[0] = det > 0 && isfinite(t) ? (c * r - b * s) / det : 0;
    duv[1] = det > 0 && isfinite(t) ? (a * s - b * r) / det : 0;
}

static imp_spec albedo(const struct imp_measure *m, const struct imp_hit *hit,
                       const struct imp_surface *at, imp_v3 d)
{
    const struct imp_bsdf *b = imp__shape_bsdf(m->scene, m->scene->shapes[hit->shape]);
    const struct imp_texcoord where = {
        .uv = {at->uv[0], at->uv[1]}, .p = at->p, .shape = m->scene->shapes[hit->shape]};
    const struct imp_frame frame = {at->s, at->t, at->n};
    const imp_v3 wo = imp__to_local(&frame, -d);
    imp_spec in[IMP_INPUTS_MAX], rho;
    imp__inputs_eval(b->input, b->n_in, &where, in);
    imp__bsdf_albedo(b, in, &wo, &rho);
    return rho;
}

int imp__aov_values(const struct imp_measure *m, const struct imp_channels *top,
                    const struct imp_walk *w, double *value)
{
    const double px = w->px, py = w->py;
    const double lens[2] = {imp__start_number(w->key, w->point, IMP_DIM_LENS_U),
                            imp__start_number(w->key, w->point, IMP_DIM_LENS_V)};
    struct imp_sensor_ray ray;
    struct imp_hit hit;
    struct imp_surface at;
    const bool found = first_surface(m, w->time, px, py, lens, &ray, &hit, &at);
    const double h = 1 / sqrt(fmax(m->spp, 1));
    int n = 0;
    for (int a = 0; a < top->n_aovs; a++) {
        const enum imp_aov_type type = top->aovs[a].type;
        const int count = imp__aov_count(type);
        imp_v3 v = {0};
        double duv[2];
        if (found) switch (type) {
            case IMP_AOV_ALBEDO: v = albedo(m, &hit, &at, ray.d); break;
            case IMP_AOV_DEPTH: v[0] = hit.t; break;
            case IMP_AOV_POSITION: v = at.p; break;
            case IMP_AOV_UV: v = imp__v3(at.uv[0], at.uv[1], 0); break;
            case IMP_AOV_GEO_NORMAL: v = at.ng; break;
            case IMP_AOV_SH_NORMAL: v = at.n; break;
            case IMP_AOV_DP_DU: v = at.dp_du; break;
            case IMP_AOV_DP_DV: v = at.dp_dv; break;
            case IMP_AOV_DUV_DX:
                uv_slope(m, px + h, py, lens, &at, duv);
                v = imp__v3(duv[0], duv[1], 0);
                break;
            case IMP_AOV_DUV_DY:
                uv_slope(m, px, py + h, lens, &at, duv);
                v = imp__v3(duv[0], duv[1], 0);
                break;
            case IMP_AOV_PRIM_INDEX: v[0] = hit.prim; break;
            case IMP_AOV_SHAPE_INDEX: v[0] = hit.shape; break;
            }
        for (int c = 0; c < count; c++) value[n++] = v[c];
    }
    return n;
}
