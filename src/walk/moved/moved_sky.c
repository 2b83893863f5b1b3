/* SPDX-License-Identifier: Apache-2.0
 *
 * Radiance of skies by direction (moved_sky.h). */
#include "moved_sky.h"
#include "math/rng.h"

imp_spec imp__sky_radiance_from(const struct imp_scene *scene, int emitter, imp_v3 w,
                                const struct imp_carried *carried)
{
    const struct imp_emission x = {.dist = INFINITY, .cos_light = 1, .d = -w};
    return imp__emitter_radiance(scene, emitter, &x, w, carried);
}

imp_spec imp__skies_from(const struct imp_scene *scene, imp_v3 w,
                         const struct imp_carried *carried)
{
    imp_spec sum = {0};
    for (int k = 0; k < scene->n_environments; k++)
        sum += imp__sky_radiance_from(scene, scene->environments[k], w, carried);
    return sum;
}

/* Is a circle of this sky between two directions? */
static bool jumps_between(const struct imp_emitter *e, imp_v3 a, imp_v3 b)
{
    struct imp_sky_circle circle[IMP_SKY_CIRCLES];
    const int n = e->ops->jumps(e, circle);
    bool any = false;
    for (int k = 0; k < n; k++)
        any |= (imp__dot(a, circle[k].axis) > circle[k].cosine) !=
               (imp__dot(b, circle[k].axis) > circle[k].cosine);
    return any;
}

/* bar, by lanes, times the derivative of a sky's radiance by w, across w: by differences, whose kinks at
 * the borders of texels are so wide. Where a jump is as near, which is an edge's, they are narrower: a
 * sky may be as steep there as a root. */
#define TURN       1e-6
#define TURN_LEAST 1e-11
static void slope_add(const struct imp_scene *scene, int emitter, imp_v3 w, imp_spec bar,
                      const struct imp_carried *carried, imp_v3 *slope)
{
    const struct imp_frame f = imp__frame_from_normal(w);
    const imp_v3 across[2] = {f.s, f.t};
    const struct imp_emitter *e = scene->emitters[emitter];
    if (imp__emitter_even(e, carried)) return;
    for (int i = 0; i < 2; i++) {
        double by = TURN, value[2];
        while (by > TURN_LEAST && jumps_between(e, imp__normalize(w - across[i] * by),
                                                imp__normalize(w + across[i] * by)))
            by *= 0.25;
        if (!(by > TURN_LEAST)) continue;
        for (int j = 0; j < 2; j++) {
            const imp_v3 at = imp__normalize(w + across[i] * (j ? by : -by));
            const imp_spec L = imp__sky_radiance_from(scene, emitter, at, carried);
            value[j] = imp__sum_used(L * bar, scene->lanes);
        }
        *slope += across[i] * ((value[1] - value[0]) / (2 * by));
    }
}

imp_v3 imp__skies_slope(const struct imp_scene *scene, imp_v3 w, imp_spec bar,
                        const struct imp_carried *carried)
{
    imp_v3 slope = {0};
    for (int k = 0; k < scene->n_environments; k++)
        slope_add(scene, scene->environments[k], w, bar, carried, &slope);
    return slope;
}

void imp__skies_seen_bar(const struct imp__moves *moves, const struct imp_sensor_ray *ray,
                         imp_spec seen, const struct imp_carried *carried,
                         double *theta_bar)
{
    const struct imp_scene *scene = moves->scene;
    imp_v3 slope = {0};
    for (int k = 0; k < scene->n_environments; k++) {
        const int sky = scene->environments[k];
        const imp_v3 before = slope;
        slope_add(scene, sky, ray->d, seen, carried, &slope);
        if (imp_unlikely(moves->skies))
            imp__light_turn_bar(moves, sky, imp__cross(slope - before, ray->d),
                                theta_bar);
    }
    if (imp__is_zero(slope)) return;
    imp__camera_velocity_bar(moves, ray->o, ray->o + ray->d, slope, theta_bar);
    imp__camera_velocity_bar(moves, ray->o + ray->d, ray->o, -slope, theta_bar);
}

bool imp__sky_has_draws(const struct imp_scene *scene, int emitter)
{
    return !(scene->emitters[emitter]->ops->flags & IMP_EMITTER_UNIFORM);
}

/* Integrals of a sky's radiance and of its square over all directions, by its own draws. */
static void sky_moments(const struct imp_tracer *tracer, int emitter, imp_spec *whole,
                        imp_spec *square)
{
    enum { DRAWS = 256 };
    const struct imp_scene *scene = tracer->scene;
    const struct imp_emitter *e = scene->emitters[emitter];
    const imp_v3 from = (scene->lo + scene->hi) * 0.5;
    *whole = *square = (imp_spec){0};
    for (uint32_t k = 0; k < DRAWS; k++) {
        const struct imp_key key = imp__key(11, 4, k);
        const double u[2] = {(k + imp__u01(key, 0)) / DRAWS, imp__u01(key, 1)};
        struct imp_light_sample to;
        struct imp_waves waves;
        if (!e->ops->sample(e, &from, u, &to) || !(to.pdf > 0)) continue;
        if (tracer->wavelengths)
            imp__waves_make(tracer->wavelengths, imp__u01(key, 2), &waves);
        const imp_spec L = imp__sky_radiance_from(
            scene, emitter, to.wi, tracer->wavelengths ? &waves.carried : NULL);
        *whole += L * (1 / to.pdf) * (1. / DRAWS);
        *square += L * L * (1 / to.pdf) * (1. / DRAWS);
    }
}

double imp__sky_whole(const struct imp_tracer *tracer, int emitter)
{
    imp_spec whole, square;
    sky_moments(tracer, emitter, &whole, &square);
    return imp__max_used(whole, tracer->scene->lanes == 4);
}

bool imp__sky_is_narrow(const struct imp_tracer *tracer, int emitter)
{
    imp_spec whole, square;
    sky_moments(tracer, emitter, &whole, &square);
    return imp__sqr(imp__sum_used(whole, tracer->scene->lanes)) <
           imp__sum_used(square, tracer->scene->lanes) * tracer->scene->lanes;
}
