/* SPDX-License-Identifier: Apache-2.0
 *
 * The plane of a facet of a mesh with vertex normals (boundary.h): rays that leave a point of it
 * below the plane begin behind the facet, where they see something else, and the kernel, which is
 * that of the shading normal, does not vanish there. */
#include "boundary_parts.h"
#include "walk/core/step.h"

/* What a ray along w meets that begins on the side of a facet that `up` points to. */
static void look(struct imp__edge_draw *d, const struct imp_surface *at, imp_v3 up,
                 imp_v3 w, struct imp_walk *walk)
{
    struct imp_sensor_ray ray = {.d = w, .t_near = 0, .t_far = INFINITY};
    ray.o = imp__offset(at->p, at->ng, up);
    imp__edge_walk(d, &ray, 1, NULL, walk);
}

/* Emission of a light that is met first, which moves with the light. */
static void emission_reach(struct imp__edge_draw *d, const struct imp_hit *hit,
                           const struct imp_surface *at, const struct imp__glued *x,
                           const struct imp_walk *walk, imp_v3 w, double times)
{
    imp_spec T;
    const struct imp_vertex *v = imp__walk_met(d, walk, &T);
    if (!v || imp__is_zero_used(T * v->e, d->waves)) return;
    const struct imp__glued y =
        imp__glued_at(d->b->tracer->scene, v->d.shape, &v->d.located, 0, d->time, v->ng);
    const imp_v3 turn = x->n * (1 / imp__length(y.p - x->p));
    struct imp__edge_light light = {
        .w = -w, .light = T * v->e * times, .behind = 1, .horizon = true, .n_ends = 2};
    light.end[0] = (struct imp__flux_end){*x, {.n = w, .v = -turn}, false, 0, {0}};
    light.end[1] = imp__flux_glued(&y, turn);
    imp__edge_reach(d, hit, at, &light);
}

void imp__draw_horizon(struct imp__edge_draw *d)
{
    const int max = d->b->tracer->integrator->max_depth;
    struct imp_hit hit;
    struct imp_surface at;
    struct imp_walk above, below;
    if ((max >= 0 && max < 2) || !imp__edge_item_point(d, IMP_EDGE_LIGHT_U, &hit, &at))
        return;
    const double psi = IMP_2PI * imp__u01(d->key, IMP_EDGE_DIR_U);
    const struct imp_frame f = imp__frame_from_normal(at.ng);
    const imp_v3 w = f.s * cos(psi) + f.t * sin(psi);
    look(d, &at, at.ng, w, &above);
    look(d, &at, -at.ng, w, &below);
    const struct imp_located located = {hit.prim, {(float)hit.u, (float)hit.v}};
    const struct imp__glued x = imp__glued_at(d->b->tracer->scene, hit.shape, &located,
                                              hit.place, d->time, at.ng);
    const double times = IMP_2PI * d->inv_pdf;
    emission_reach(d, &hit, &at, &x, &above, w, times);
    emission_reach(d, &hit, &at, &x, &below, w, -times);
    int depths;
    imp_spec *jump = imp__jumps(d, &above, &below, imp__spec(times), imp__spec(0),
                                (struct imp__seen_from){.drawn = NULL}, &depths);
    if (!jump) return;
    struct imp__edge_light light = {
        .w = -w, .light = jump[0], .horizon = true, .n_ends = 1};
    if (max >= 0) {
        light.by_depth = jump;
        light.n_depths = depths;
    }
    light.end[0] = (struct imp__flux_end){x, {.n = w}, false, 0, {0}};
    imp__edge_reach(d, &hit, &at, &light);
}
