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
static void slope_add(const struct imp_scene *scene, int emitter, enum imp__sky_part part,
                      imp_v3 w, imp_spec bar, const struct imp_carried *carried,
                      imp_v3 *slope)
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
            const imp_spec L = part == IMP_SKY_WHOLE
                                   ? imp__sky_radiance_from(scene, emitter, at, carried)
                                   : imp__sky_part_from(e, part, at, carried);
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
        slope_add(scene, scene->environments[k], IMP_SKY_WHOLE, w, bar, carried, &slope);
    return slope;
}

/* ---- A sun that moves -------------------------------------------------------------------- */

imp_spec imp__sky_part_from(const struct imp_emitter *e, enum imp__sky_part part,
                            imp_v3 w, const struct imp_carried *carried)
{
    const struct imp_emission x = {.dist = INFINITY, .cos_light = 1, .d = -w};
    const struct imp_texcoord at = {.p = w, .carried = carried};
    imp_spec in[IMP_INPUTS_MAX], le;
    imp__inputs_eval(e->input, e->n_in, &at, in);
    imp__sky_part(e, part, in);
    imp__light_eval(e, carried, in, &x, &le);
    return le;
}

bool imp__sky_in_parts(const struct imp__moves *moves, int emitter)
{
    return imp__sun_mover(moves, emitter, IMP_MOVE_SUN) ||
           imp__sun_mover(moves, emitter, IMP_MOVE_DISC);
}

/* bar, by lanes, times what a part of the sky changes by from one side to the other of a way of the sun:
 * of w at rest, or, of the disc, of w that goes with it. */
static double sun_change(const struct imp__moves *moves, const struct imp__mover *m,
                         int way, enum imp__sky_part part, imp_v3 w, imp_spec bar,
                         const struct imp_carried *carried)
{
    imp_spec L[2];
    for (int j = 0; j < 2; j++) {
        const imp_v3 at = part == IMP_SKY_DISC ? imp__suns_turned(m->suns, way, j, w) : w;
        L[j] = imp__sky_part_from(&m->suns->beside[way][j], part, at, carried);
    }
    if (part == IMP_SKY_DISC && (imp__is_zero(L[0]) || imp__is_zero(L[1])))
        return 0; /* its border, rounded */
    return imp__sum_used((L[1] - L[0]) * bar, moves->scene->lanes);
}

/* By the sun's place; bar: the adjoint of the part's radiance. */
static void sun_slope_bar(const struct imp__moves *moves, const struct imp__mover *m,
                          enum imp__sky_part part, imp_v3 w, imp_spec bar,
                          const struct imp_carried *carried, double *theta_bar)
{
    imp_v3 slope = {0};
    for (int i = 0; i < 2; i++)
        slope += m->suns->across[i] *
                 (sun_change(moves, m, i, part, w, bar, carried) / (2 * IMP_SUNS_BESIDE));
    imp__move_vector_bar(theta_bar + m->first, slope * m->rate);
}

/* By both numbers of a sun; *disc: L of the disc. */
static void sun_radiance_bar(const struct imp__moves *moves, int emitter, imp_v3 w,
                             imp_spec bar, const struct imp_carried *carried,
                             imp_spec *disc, double *theta_bar)
{
    const struct imp_emitter *e = moves->scene->emitters[emitter];
    const struct imp__mover *sun = imp__sun_mover(moves, emitter, IMP_MOVE_SUN),
                            *radius = imp__sun_mover(moves, emitter, IMP_MOVE_DISC);
    struct imp__sky_sun now;
    imp__sky_sun_read(e, &now);
    *disc =
        now.radius > 0 ? imp__sky_part_from(e, IMP_SKY_DISC, w, carried) : (imp_spec){0};
    if (sun) sun_slope_bar(moves, sun, IMP_SKY_AROUND, w, bar, carried, theta_bar);
    if (sun && !imp__is_zero(*disc))
        sun_slope_bar(moves, sun, IMP_SKY_DISC, w, bar, carried, theta_bar);
    if (radius && now.power && !imp__is_zero(*disc)) /* as dim as it is large */
        theta_bar[radius->first] +=
            sun_change(moves, radius, IMP_SUNS_WIDTH, IMP_SKY_DISC, w, bar, carried) /
            (2 * IMP_SUNS_WIDER * now.radius);
}

imp_spec imp__sky_sent_bar(const struct imp__moves *moves, int emitter, imp_v3 w,
                           imp_spec bar, const struct imp_carried *carried,
                           double *theta_bar)
{
    if (!imp__sky_in_parts(moves, emitter)) return bar;
    const struct imp__mover *radius = imp__sun_mover(moves, emitter, IMP_MOVE_DISC);
    const imp_spec L = imp__sky_radiance_from(moves->scene, emitter, w, carried);
    imp_spec one = {0}, disc;
    for (int c = 0; c < 4; c++) one[c] = L[c] != 0 ? bar[c] / L[c] : 0;
    sun_radiance_bar(moves, emitter, w, one, carried, &disc, theta_bar);
    if (radius) /* its draws are as far apart */
        theta_bar[radius->first] +=
            radius->rate * imp__sum_used(one * disc, moves->scene->lanes);
    return one * disc;
}

/* The same of what the camera sees along a direction at rest. Returns the slope of the disc. */
static imp_v3 sun_seen_bar(const struct imp__moves *moves, int emitter, imp_v3 w,
                           imp_spec seen, const struct imp_carried *carried,
                           double *theta_bar)
{
    imp_v3 slope = {0};
    imp_spec disc;
    sun_radiance_bar(moves, emitter, w, seen, carried, &disc, theta_bar);
    if (!imp__is_zero(disc))
        slope_add(moves->scene, emitter, IMP_SKY_DISC, w, seen, carried, &slope);
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
        imp_v3 own = {0};
        slope_add(scene, sky, IMP_SKY_WHOLE, ray->d, seen, carried, &own);
        slope += own;
        if (imp_likely(!moves->skies)) continue;
        if (imp__sky_in_parts(moves, sky))
            own = sun_seen_bar(moves, sky, ray->d, seen, carried, theta_bar);
        imp__light_velocity_bar(moves, sky, ray->d, -own, theta_bar);
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
