/* SPDX-License-Identifier: Apache-2.0
 *
 * Straight lines between the points of a draw (boundary.h): masks let a part of the light pass, null
 * materials all of it. What passes is a factor, and moves no point behind it. */
#include "boundary_parts.h"
#include "walk/core/step.h"

#define PASSES_MOST 1024 /* surfaces on a line: of more, nothing comes through */

/* What goes straight on through a surface, along w. */
static imp_spec passed(const struct imp__edge_draw *d, const struct imp_bsdf *b,
                       const struct imp_hit *hit, const struct imp_surface *at, imp_v3 w)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const struct imp_shape *shape =
        scene->shapes[imp__placed_shape(scene, hit->shape, hit->place)];
    const struct imp_frame frame = {at->s, at->t, at->n};
    const imp_v3 wi = imp__to_local(&frame, w);
    const struct imp_texcoord place = {.uv = {at->uv[0], at->uv[1]},
                                       .p = at->p,
                                       .shape = shape,
                                       .prim = hit->prim,
                                       .carried = imp__edge_waves(d)};
    imp_spec in[IMP_INPUTS_MAX], f, sum = {0};
    imp__evaluate_inputs(b, shape, &place, in);
    for (int l = 0; l < 64; l++) {
        if (!(b->straight >> l & 1)) continue;
        const struct imp_dirs dirs = {-wi, wi, l, 0};
        imp__bsdf_eval(b, place.carried, in, &dirs, &f);
        sum += f;
    }
    return sum;
}

bool imp__edge_line(const struct imp__edge_draw *d, imp_v3 o, imp_v3 r, double till,
                    struct imp__line *line)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    *line = (struct imp__line){imp__spec(1), 1, 0};
    if (imp_likely(!d->b->passes)) return !imp__occluded_at(scene, 0, &o, &r, 0, till);
    const imp_v3 end = o + r * till;
    for (int n = 0; n < PASSES_MOST; n++) {
        struct imp_hit hit;
        struct imp_surface at;
        const double reach = isfinite(till) ? 1 : INFINITY;
        const imp_v3 way = isfinite(till) ? end - o : r;
        if (!imp__intersect(scene, &o, &way, 0, reach, &hit)) return true;
        const struct imp_bsdf *b = imp__hit_bsdf(scene, &hit);
        if (!b->straight) return false;
        imp__hit_surface(scene, &hit, &o, &way, &at);
        line->T *= passed(d, b, &hit, &at, imp__normalize(way));
        line->bounces += !d->b->through;
        o = imp__offset(at.p, at.ng, r);
        if (imp__is_zero_used(line->T, d->waves) ||
            (isfinite(till) && !(imp__dot(end - o, r) > 0)))
            return !imp__is_zero_used(line->T, d->waves);
    }
    return false;
}

#define PASS_LEAST 0.1 /* probability of either choice at a mask */

bool imp__edge_follow(const struct imp__edge_draw *d, imp_v3 o, imp_v3 w, double from,
                      unsigned dims, struct imp_hit *hit, struct imp_surface *at,
                      struct imp__line *line)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const imp_v3 start = o;
    *line = (struct imp__line){imp__spec(1), 1, 0};
    for (unsigned n = 0; n < PASSES_MOST; n++) {
        if (!imp__intersect(scene, &o, &w, from, INFINITY, hit)) return false;
        imp__hit_surface(scene, hit, &o, &w, at);
        if (imp_unlikely(n > 0)) hit->t = imp__dot(at->p - start, w);
        const struct imp_bsdf *b = imp__hit_bsdf(scene, hit);
        if (imp_likely(!b->straight)) return true;
        const imp_spec T = passed(d, b, hit, at, w);
        const double pass =
            b->flags & IMP_BSDF_SMOOTH
                ? imp_clamp(imp__max_used(T, d->waves), PASS_LEAST, 1 - PASS_LEAST)
                : 1;
        if (imp__u01(d->key, IMP_EDGE_PASS + dims * PASSES_MOST + n) >= pass) {
            line->times *= 1 / (1 - pass);
            return true;
        }
        line->times *= 1 / pass;
        line->T *= T;
        line->bounces += !d->b->through;
        if (imp__is_zero_used(line->T, d->waves)) return false;
        o = imp__offset(at->p, at->ng, w);
        from = 0;
    }
    return false;
}

bool imp__edge_passes(const struct imp__edge_draw *d)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const struct imp__edges *edges = d->b->edges;
    struct imp_hit own = {.shape = -1};
    if (imp_likely(!d->b->passes)) return false;
    if (!d->edge) {
        if (d->item->shape < 0) return false;
        own.shape = d->item->shape;
        own.place = d->item->place;
        return imp__hit_bsdf(scene, &own)->straight;
    }
    for (int k = 0; k < d->edge->n_faces; k++) {
        own.shape = edges->face[d->edge->first + (size_t)k].shape;
        own.place = edges->face[d->edge->first + (size_t)k].place;
        if (imp__hit_bsdf(scene, &own)->straight) return true;
    }
    return false;
}
