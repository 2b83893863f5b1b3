/* SPDX-License-Identifier: Apache-2.0
 *
 * Edges between a vertex and what it receives from lit surfaces (boundary.h). */
#include "boundary_parts.h"
#include "moved_sky.h"
#include "walk/core/step.h"
#include "walk/core/vertex.h"

/* Does light go straight on there, and is that no vertex of a light sample's line? */
static bool is_on_line(const struct imp__boundary *b, const struct imp_vertex *v)
{
    return v->d.scatterer == IMP_AT_SENSOR || (b->through && imp__goes_straight(v));
}

const struct imp_vertex *imp__walk_met(const struct imp__edge_draw *d,
                                       const struct imp_walk *walk, imp_spec *T)
{
    const struct imp_vertex *v = walk->dropped ? NULL : walk->first;
    *T = imp__spec(1);
    for (; v && is_on_line(d->b, v); v = v->next) *T *= v->w;
    return v && v->d.scatterer != IMP_AT_SKY && v->d.scatterer != IMP_IN_MEDIUM ? v
                                                                                : NULL;
}

/* The part of the emission at v that is not glued to its light, as a walk from a point of a medium
 * sees it. */
static double unglued_part(const struct imp__boundary *b, const struct imp_walk *walk,
                           const struct imp_vertex *v, double farther)
{
    double slope;
    if (v->d.met.emitter < 0) return 0;
    return 1 - imp__glued_part(
                   b->tracer->scene->emitters[v->d.met.emitter],
                   imp__length(imp__decided_v3(v->d.p) - walk->ray.o) + farther, &slope);
}

imp_spec imp__arrives(const struct imp__boundary *b, const struct imp_walk *walk,
                      struct imp__seen_from x)
{
    const int max = b->tracer->integrator->max_depth;
    imp_spec L = {0}, T = imp__spec(1);
    int number = x.before;
    bool first = true; /* nothing has scattered it yet */
    if (walk->dropped || !walk->first) return L;
    for (const struct imp_vertex *v = walk->first; v; v = v->next) {
        const bool sky = v->d.scatterer == IMP_AT_SKY, on_line = is_on_line(b, v);
        /* To each sky a vertex; what a medium emits is no light's. */
        const bool left = first && !x.mirrored && v->d.scatterer != IMP_IN_MEDIUM &&
                          (!sky || (x.drawn && x.drawn[v->d.met.emitter]));
        const bool counts = max < 0 || number < max;
        if (!left && counts) L += T * v->e;
        if (imp_unlikely(left && x.floats && !sky && counts))
            L += T * v->e * unglued_part(b, walk, v, x.farther);
        if (max < 0 || number + 1 < max) L += T * v->b;
        T *= v->w;
        number += !sky && !on_line;
        first &= sky || on_line;
    }
    return L;
}

imp_spec imp__arrives_limb(const struct imp__boundary *b, const struct imp_walk *walk,
                           struct imp__seen_from x, const imp_spec *R)
{
    if (imp_likely(!R)) return imp__arrives(b, walk, x);
    x.before++;
    x.mirrored = true;
    return imp__arrives(b, walk, x) * *R;
}

void imp__look_from(struct imp__edge_draw *d, const struct imp_surface *at, imp_v3 to,
                    int before, struct imp_walk *walk)
{
    struct imp_sensor_ray ray = {.t_near = d->near, .t_far = INFINITY};
    ray.o = imp__offset(at->p, at->ng, to - at->p);
    ray.d = imp__normalize(to - ray.o);
    imp__edge_walk(d, &ray, before, NULL, walk);
}

imp_spec *imp__jumps(struct imp__edge_draw *d, const struct imp_walk *lo,
                     const struct imp_walk *hi, imp_spec times, imp_spec more,
                     struct imp__seen_from x, int *n)
{
    const int max = d->b->tracer->integrator->max_depth;
    *n = max < 0 ? 1 : max - 1;
    imp_spec *jump = imp__arena_take(d->arena, (size_t)*n, sizeof *jump);
    if (!jump) {
        d->no_memory = true;
        return NULL;
    }
    bool any = false;
    const int between = x.before;
    for (int k = 0; k < *n; k++) {
        x.before = k + 1 + between;
        jump[k] = (imp__arrives_limb(d->b, lo, x, x.limb[0]) -
                   imp__arrives_limb(d->b, hi, x, x.limb[1])) *
                      times +
                  more;
        any |= !imp__is_zero_used(jump[k], d->waves);
    }
    return any ? jump : NULL;
}

void imp__look_past(struct imp__edge_draw *d, const struct imp_surface *at, imp_v3 m,
                    double apart, int before, struct imp_walk *walk)
{
    const imp_v3 r = d->p - at->p, o = imp__offset(at->p, at->ng, r);
    if (imp__edge_face_look(d, o, false, m, apart, before, walk)) return;
    imp__look_from(d, at, imp__edge_beside(d, r, m, apart), before, walk);
}

/* A line over mirrors: its light's ends at these, and what x counts. False: no memory. */
static bool mirrored_ends(struct imp__edge_draw *d, const struct imp__mirrors *mirrors,
                          imp_v3 x, imp_v3 m, struct imp__edge_light *light)
{
    struct imp__flux_end *end =
        imp__arena_take(d->arena, (size_t)mirrors->n, sizeof *end);
    if (!end) {
        d->no_memory = true;
        return false;
    }
    light->mirror_end = end;
    light->slide =
        imp__mirrors_seen(mirrors, x, d->p, -m, end, &light->n_mirror_ends).bar;
    return true;
}

void imp__draw_scatter(struct imp__edge_draw *d)
{
    const struct imp__boundary *b = d->b;
    const int max = b->tracer->integrator->max_depth;
    imp_v3 w;
    struct imp_hit hit;
    struct imp_surface at;
    if ((max >= 0 && max < 2) || !imp__edge_touched(d, &w)) return;
    const imp_v3 from = imp__edge_clear(d);
    struct imp__line line;
    if (!imp__edge_follow(d, from, w, IMP_CONTACT * b->size, 0, &hit, &at, &line)) return;

    const imp_v3 turned = imp__cross(d->along, w);
    const double sine = imp__length(turned);
    if (!(sine > 0)) return;
    const imp_v3 m = turned * (1 / sine);
    /* What sees the edge: x, or the mirror next to the edge. */
    const bool mirrored = line.mirrors.n > 0;
    const struct imp_surface *viewer = mirrored ? &line.mirrors.first->at : &at;
    const double far = mirrored ? imp__length(viewer->p - d->p) : hit.t;
    const double apart = IMP_BESIDE * (far + imp__length(d->p));
    if (imp__edge_merges(d, -w, apart) || (mirrored && far < IMP_SHORT_OF * apart))
        return;
    const imp_spec T = imp_unlikely(mirrored)
                           ? line.T_mirrored
                           : imp__edge_near(d, -w, hit.t, apart, line.T);
    const int between = mirrored ? line.bounces_mirrored : 0;
    struct imp_walk lo, hi;
    imp_spec R;
    const int limb = imp__edge_limb(d, m, &R);
    imp__look_past(d, viewer, limb < 0 ? m : -m, apart, 1 + between + (limb < 0), &lo);
    imp__look_past(d, viewer, limb > 0 ? -m : m, apart, 1 + between + (limb > 0), &hi);

    int depths;
    const imp_spec times =
        T * ((d->touches ? 1 : sine * d->spread) * d->inv_pdf * line.times);
    if (imp_likely(!mirrored)) {
        imp__seam_emission(d, &hit, &at, &lo, m, w, times);
        imp__seam_emission(d, &hit, &at, &hi, m, w, -times);
    }
    const struct imp__seen_from x = {
        .before = between,
        .floats = hit.shape < 0,
        .mirrored = mirrored,
        .drawn = b->drawn,
        .limb = {limb < 0 ? &R : NULL, limb > 0 ? &R : NULL}};
    imp_spec *jump = imp__jumps(d, &lo, &hi, times, imp__spec(0), x, &depths);
    if (!jump) return;
    struct imp__edge_light light = {.w = line.w, .slide = -m};
    if (imp_unlikely(mirrored) && !mirrored_ends(d, &line.mirrors, at.p, m, &light))
        return;
    light.light = jump[0];
    if (max >= 0) {
        light.by_depth = jump;
        light.n_depths = depths;
    }
    light.n_ends = imp__edge_ends(d, m, light.end);
    imp__edge_reach(d, &hit, &at, &light);
}
