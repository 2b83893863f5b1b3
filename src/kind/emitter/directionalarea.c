/* SPDX-License-Identifier: Apache-2.0
 *
 * directionalarea: a flat surface that emits along its normal alone. A point in the prism
 * before the surface receives the irradiance `radiance` (Mitsuba's name), measured across
 * the beam, from the foot of its perpendicular; a point elsewhere receives nothing. */
#include "emission.h"
#include "from_point.h"
#include "kind/shape/shape.h"

/* Relative tolerance of normals and of distances from a plane: positions are floats. */
#define FLATNESS 1e-5

struct beam {
    imp_v3 axis; /* unit, world: whither the light goes */
};

static const struct imp_input_desc inputs[] = {
    {.name = "radiance", .role = IMP_EMISSION, .fallback = 1, .unit = "W m^-2"}, {0}};

struct corner {
    imp_v3 p, e1, e2;
};
static struct corner corner(const struct imp_shape *s, size_t triangle)
{
    imp_v3 p[3];
    for (size_t k = 0; k < 3; k++) {
        const float *q =
            s->triangles.positions + 3 * (size_t)s->triangles.indices[3 * triangle + k];
        p[k] = imp__v3(q[0], q[1], q[2]);
    }
    return (struct corner){p[0], p[1] - p[0], p[2] - p[0]};
}

/* Do all triangles that have area lie in one plane, with one front? Sets its normal. */
static bool mesh_is_flat(const struct imp_shape *s, imp_v3 *normal)
{
    const size_t n = s->triangles.n_triangles;
    const double size = imp__length(s->hi - s->lo);
    imp_v3 sum = {0}, first = {0};
    for (size_t k = 0; k < n; k++) {
        const struct corner c = corner(s, k);
        const imp_v3 area = imp__cross(c.e1, c.e2);
        if (imp__is_zero(sum)) first = c.p;
        sum += area;
    }
    if (!(imp__length(sum) > 0)) return false;
    *normal = imp__normalize(sum);
    for (size_t k = 0; k < n; k++) {
        const struct corner c = corner(s, k);
        const imp_v3 area = imp__cross(c.e1, c.e2);
        const imp_v3 at[3] = {c.p - first, c.p + c.e1 - first, c.p + c.e2 - first};
        for (int i = 0; i < 3; i++) {
            const struct imp_hit hit = {.prim = (int)k, .u = i == 1, .v = i == 2};
            struct imp_surface x;
            if (!(fabs(imp__dot(at[i], *normal)) <= FLATNESS * size)) return false;
            if (!s->smooth) continue;
            s->ops->surface(s, &hit, normal, normal, &x);
            if (!(imp__length(x.n - *normal) <= FLATNESS)) return false;
        }
        if (imp__dot(area, *normal) < 0) return false;
    }
    return true;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    struct beam *l = self;
    const struct imp_shape *s = e->shape;
    struct imp_surface at;
    if (imp__node_prop(b->node, "to_world"))
        return imp_build_error(b, "to_world", IMP_E_SCENE,
                               "to_world has no meaning here: the light is its shape");
    if (!s) return imp_build_error(b, NULL, IMP_E_SCENE, "it must be inside a shape");
    if (!(s->area > 0))
        return imp_build_error(b, NULL, IMP_E_SCENE, "its shape '%s' (%s) has no area",
                               s->name ? s->name : "", s->ops->name);
    if (s->ops->flags & IMP_SHAPE_FLAT) {
        s->ops->sample_area(s, (double[2]){0.5, 0.5}, &at);
        l->axis = at.n;
    } else if (s->geometry != IMP_TRIANGLES || !mesh_is_flat(s, &l->axis)) {
        return imp_build_error(
            b, NULL, IMP_E_UNSUPPORTED,
            "its shape '%s' (%s) is not flat: light along normals that "
            "turn is known for no point; use a rectangle, a disk or a "
            "flat mesh",
            s->name ? s->name : "", s->ops->name);
    }
    return IMP_OK;
}

/* The foot of the perpendicular from ref, if it lies on the surface and ref before it
 * (Moeller and Trumbore 1997). */
static bool foot(const struct imp_shape *s, imp_v3 ref, imp_v3 d, struct imp_hit *hit)
{
    if (s->geometry == IMP_ANALYTIC)
        return s->ops->intersect(s, &ref, &d, 0, INFINITY, hit);
    bool found = false;
    for (size_t k = 0; !found && k < s->triangles.n_triangles; k++) {
        const struct corner c = corner(s, k);
        const imp_v3 from = ref - c.p, across = imp__cross(d, c.e2);
        const double det =
            imp__dot(c.e1, across); /* 0: u and v are no numbers in [0, 1] */
        const imp_v3 up = imp__cross(from, c.e1);
        const double u = imp__dot(from, across) / det, v = imp__dot(d, up) / det,
                     t = imp__dot(c.e2, up) / det;
        found = u >= 0 && v >= 0 && u + v <= 1 && t > 0;
        if (found) *hit = (struct imp_hit){.prim = (int)k, .t = t, .u = u, .v = v};
    }
    return found;
}

static bool sample(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                   struct imp_light_sample *out)
{
    (void)u;
    const struct beam *l = e->self;
    const imp_v3 d = -l->axis;
    struct imp_hit hit = {0};
    struct imp_surface at;
    if (!foot(e->shape, *ref, d, &hit)) return false;
    e->shape->ops->surface(e->shape, &hit, ref, &d, &at);
    *out = (struct imp_light_sample){.wi = d,
                                     .dist = hit.t,
                                     .pdf = 1,
                                     .uv = {at.uv[0], at.uv[1]},
                                     .cos_light = 1,
                                     .p = at.p,
                                     .ng = at.ng,
                                     .located = {hit.prim, {(float)hit.u, (float)hit.v}}};
    return true;
}

static bool sample_emission(const struct imp_emitter *e, const struct imp_ball *scene,
                            const double u[4], struct imp_emission_sample *out)
{
    (void)scene;
    const struct beam *l = e->self;
    struct imp_surface at;
    at.located.prim = -1;
    e->shape->ops->sample_area(e->shape, u, &at);
    *out = (struct imp_emission_sample){.p = at.p,
                                        .ng = at.ng,
                                        .d = l->axis,
                                        .uv = {at.uv[0], at.uv[1]},
                                        .cos_light = 1,
                                        .cos_p = 1,
                                        .pdf_p = 1 / e->shape->area,
                                        .pdf_d = 1,
                                        .located = at.located};
    return true;
}

const struct imp_emitter_ops imp__directionalarea = {
    .size = sizeof(struct imp_emitter_ops),
    .name = "directionalarea",
    .object_size = sizeof(struct beam),
    .flags = IMP_EMITTER_DELTA | IMP_EMITTER_FAR | IMP_EMITTER_AREA,
    .inputs = inputs,
    .build = build,
    .eval = imp__even_eval,
    .eval_d = imp__even_eval_d,
    .sample = sample,
    .pdf = imp__point_light_pdf,
    .sample_emission = sample_emission,
    .pdf_emission = imp__along_emission_pdf};
