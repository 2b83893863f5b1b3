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

/* By differences, whose kinks at the borders of texels are so wide; on one side where a jump is on
 * the other, which is an edge's. */
#define TURN 1e-6
imp_v3 imp__skies_slope(const struct imp_scene *scene, imp_v3 w, imp_spec bar,
                        const struct imp_carried *carried)
{
    const struct imp_frame f = imp__frame_from_normal(w);
    const imp_v3 across[2] = {f.s, f.t};
    imp_v3 slope = {0};
    for (int k = 0; k < scene->n_environments; k++) {
        const int sky = scene->environments[k];
        const struct imp_emitter *e = scene->emitters[sky];
        if (imp__emitter_even(e, carried)) continue;
        for (int i = 0; i < 2; i++) {
            double value[2], between = 0;
            for (int j = 0; j < 2; j++) {
                const double by = j ? TURN : -TURN;
                imp_v3 at = imp__normalize(w + across[i] * by);
                if (jumps_between(e, w, at)) at = w;
                else between += TURN;
                const imp_spec L = imp__sky_radiance_from(scene, sky, at, carried);
                value[j] = imp__sum_used(L * bar, scene->lanes);
            }
            if (between > 0) slope += across[i] * ((value[1] - value[0]) / between);
        }
    }
    return slope;
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
