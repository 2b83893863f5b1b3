/* SPDX-License-Identifier: Apache-2.0
 *
 * Bounds of a single light for the tree of lights, from its kind and its shape. */
#include "color/rgb.h"
#include "light_tree.h"
#include <string.h>

static double luminance(const struct imp_scene *scene, imp_spec le)
{
    const double l = scene->channels == 1 ? le[0] : imp__luminance(le[0], le[1], le[2]);
    return l > 0 && l < INFINITY ? l : 0;
}

/* Radiance (of delta lights: irradiance) that leaves for a place. */
static double radiance(const struct imp_scene *scene, const struct imp_emitter *e,
                       const struct imp_emission *x, imp_v3 p)
{
    imp_spec in[IMP_INPUTS_MAX], le;
    struct imp_texcoord at = {.p = p, .shape = e->shape};
    if (e->ops->place) e->ops->place(e, x, at.uv);
    else memcpy(at.uv, x->uv, sizeof at.uv);
    imp__inputs_eval(e->input, e->n_in, &at, in);
    e->ops->eval(e, in, x, &le);
    return luminance(scene, le);
}

void imp__light_turns(struct imp_light_turns *out)
{
    for (int k = 0; k < IMP_LIGHT_DIRECTIONS; k++) {
        const double phi = k * (IMP_PI * (3 - 2.2360679774997897));
        out->cosine[k] = cos(phi);
        out->sine[k] = sin(phi);
    }
}

/* The k-th of the directions that cover the cone of cosine `least` evenly. */
static imp_v3 direction(const struct imp_light_turns *turns, const struct imp_frame *f,
                        double least, int k)
{
    const double z = 1 - (k + 0.5) / IMP_LIGHT_DIRECTIONS * (1 - least),
                 r = sqrt(imp_max(0.0, 1 - z * z));
    return f->s * (r * turns->cosine[k]) + f->t * (r * turns->sine[k]) + f->n * z;
}

/* Mean over all directions w of cos(max(0, angle between w and a cone of normals)), where
 * light leaves within a right angle of a normal. */
static double mean_cosine(double cos_o)
{
    const double o = acos(imp_clamp(cos_o, -1.0, 1.0)),
                 end = fmin(o + IMP_PI / 2, IMP_PI);
    const double beyond = 0.25 * (cos(o) - cos(2 * end - o)) + 0.5 * (end - o) * sin(o);
    return 0.5 * (1 - cos(o) + beyond);
}

static double strength_of_point(const struct imp_scene *scene,
                                const struct imp_light_turns *turns,
                                const struct imp_emitter *e,
                                const struct imp_light_node *bound)
{
    const imp_v3 p = imp__v3(bound->lo[0], bound->lo[1], bound->lo[2]);
    const imp_v3 axis = imp__v3(bound->axis[0], bound->axis[1], bound->axis[2]);
    const struct imp_frame f = imp__frame_from_normal(axis);
    double sum = 0;
    for (int k = 0; k < IMP_LIGHT_DIRECTIONS; k++) {
        const struct imp_emission x = {
            .dist = 1, .cos_light = 1, .d = direction(turns, &f, bound->cos_normals, k)};
        sum += radiance(scene, e, &x, p);
    }
    return sum / IMP_LIGHT_DIRECTIONS / (double)bound->gain;
}

/* Mean intensity of a surface over all directions, by what arrives on a sphere around it. */
static double strength_of_surface(const struct imp_scene *scene,
                                  const struct imp_light_turns *turns,
                                  const struct imp_emitter *e)
{
    const struct imp_frame f = imp__frame_from_normal(imp__v3(0, 0, 1));
    const imp_v3 centre = (e->shape->lo + e->shape->hi) * 0.5;
    const double r = imp__length(e->shape->hi - e->shape->lo);
    double sum = 0;
    for (int k = 0; k < IMP_LIGHT_DIRECTIONS; k++) {
        const imp_v3 from = centre + direction(turns, &f, -1, k) * r;
        /* Points in Halton's order. */
        double u[2] = {0, 0}, base = 0.5;
        for (int j = k + 1; j > 0; j /= 2, base /= 2) u[0] += (j % 2) * base;
        base = 1. / 3;
        for (int j = k + 1; j > 0; j /= 3, base /= 3) u[1] += (j % 3) * base;
        struct imp_light_sample ls;
        if (!e->ops->sample(e, &from, u, &ls) || !(ls.pdf > 0)) continue;
        const struct imp_emission x = {
            {ls.uv[0], ls.uv[1]}, ls.dist, ls.cos_light, -ls.wi};
        sum += radiance(scene, e, &x, ls.p) / ls.pdf;
    }
    return sum / IMP_LIGHT_DIRECTIONS * r * r;
}

double imp__light_strength(const struct imp_scene *scene,
                           const struct imp_light_turns *turns,
                           const struct imp_emitter *e)
{
    struct imp_light_node bound;
    imp__light_bound(e, -1, &bound);
    if (!e->shape) return strength_of_point(scene, turns, e, &bound);
    bool plain = true;
    for (int j = 0; j < e->n_in; j++) plain &= !e->input[j]->texture;
    if ((e->ops->flags & IMP_EMITTER_UNIFORM) && plain && bound.cos_normals >= 1) {
        const struct imp_emission x = {.dist = 1, .cos_light = 1, .d = {0, 0, 1}};
        return 0.25 * radiance(scene, e, &x, (imp_v3){0}) * e->shape->area;
    }
    return strength_of_surface(scene, turns, e);
}

double imp__light_triangle_radiance(const struct imp_scene *scene,
                                    const struct imp_emitter *e, int prim)
{
    static const double place[][2] = {
        {1. / 3, 1. / 3}, {0.6, 0.2}, {0.2, 0.6}, {0.2, 0.2}};
    double sum = 0;
    for (size_t k = 0; k < imp_count(place); k++) {
        const struct imp_hit hit = {.prim = prim, .u = place[k][0], .v = place[k][1]};
        const imp_v3 none = {0};
        struct imp_surface at;
        e->shape->ops->surface(e->shape, &hit, &none, &none, &at);
        const struct imp_emission x = {
            .uv = {at.uv[0], at.uv[1]}, .dist = 1, .cos_light = 1, .d = at.n};
        sum += radiance(scene, e, &x, at.p);
    }
    return sum / imp_count(place);
}

/* ---- Bounds ---------------------------------------------------------------------- */

/* Floats around a number: no less, no more. */
static void around(double lo, double hi, float *out_lo, float *out_hi)
{
    *out_lo = nextafterf((float)lo, -INFINITY);
    *out_hi = nextafterf((float)hi, INFINITY);
}

static float gain_of(double cos_normals, double cos_reach)
{
    return (float)(1 / (cos_reach < 1 ? mean_cosine(cos_normals)
                                      : imp_max(0.5 * (1 - cos_normals), 1e-9)));
}

static void cone_set(struct imp_light_node *node, imp_v3 axis, double cos_normals,
                     double cos_reach)
{
    for (int k = 0; k < 3; k++) node->axis[k] = (float)axis[k];
    node->cos_normals = (float)cos_normals;
    node->cos_reach = (float)cos_reach;
    node->gain = gain_of(cos_normals, cos_reach);
}

/* Corners of a triangle: their places, and the narrowest cone about their mean normal. */
static void triangle_bound(const struct imp_shape *s, int prim,
                           struct imp_light_node *node)
{
    imp_v3 n[4], mean = {0}, lo = imp__spec(INFINITY), hi = -lo;
    for (int k = 0; k < 3; k++) {
        const struct imp_hit hit = {.prim = prim, .u = k == 1, .v = k == 2};
        const imp_v3 none = {0};
        struct imp_surface at;
        s->ops->surface(s, &hit, &none, &none, &at);
        for (int j = 0; j < 3; j++) {
            lo[j] = imp_min(at.p[j], lo[j]);
            hi[j] = imp_max(at.p[j], hi[j]);
        }
        mean += n[k] = at.n;
        n[3] = at.ng;
    }
    for (int j = 0; j < 3; j++) around(lo[j], hi[j], &node->lo[j], &node->hi[j]);
    const double length = imp__length(mean + n[3]);
    double least = length > 0 ? 1 : -1;
    const imp_v3 axis = length > 0 ? (mean + n[3]) * (1 / length) : imp__v3(0, 0, 1);
    for (int k = 0; k < 4; k++) least = imp_min(imp__dot(axis, n[k]), least);
    /* Interpolated normals lie within a cap that is no more than a hemisphere. */
    if (least < 1e-3) least = -1;
    cone_set(node, axis, least < 1 - 1e-7 ? least - 1e-6 : 1, 0);
}

void imp__light_bound(const struct imp_emitter *e, int prim, struct imp_light_node *node)
{
    const struct imp_shape *s = e->shape;
    cone_set(node, imp__v3(0, 0, 1), -1, -1);
    if (!s) {
        struct imp_light_sample ls = {.p = {0}};
        const double u[2] = {0.5, 0.5};
        for (int k = 0; k < 2; k++) { /* a light cannot be seen from its own place */
            const imp_v3 ref = imp__spec(k);
            if (e->ops->sample(e, &ref, u, &ls)) break;
        }
        for (int k = 0; k < 3; k++) around(ls.p[k], ls.p[k], &node->lo[k], &node->hi[k]);
        imp__light_cone(e, node);
    } else if (prim >= 0) {
        triangle_bound(s, prim, node);
    } else {
        for (int k = 0; k < 3; k++)
            around(s->lo[k], s->hi[k], &node->lo[k], &node->hi[k]);
        node->cos_reach = 0;
        if (!(s->ops->flags & IMP_SHAPE_FLAT) || !s->ops->sample_area) return;
        struct imp_surface at;
        s->ops->sample_area(s, (const double[]){0.5, 0.5}, &at);
        cone_set(node, at.n, 1, 0);
    }
}

void imp__light_cone(const struct imp_emitter *e, struct imp_light_node *node)
{
    if (!e->ops->cone) return;
    imp_v3 axis;
    double cosine;
    e->ops->cone(e, &axis, &cosine);
    cone_set(node, axis, cosine, 1);
}

double imp__light_angle(const struct imp_light_node *node)
{
    return acos(imp_clamp((double)node->cos_normals, -1.0, 1.0));
}

/* The narrowest cone around two of half angles ta, tb (PBR 4e, section 3.8.4); its cosine. */
static double cone_union(const struct imp_light_node *a, double ta,
                         const struct imp_light_node *b, double tb, imp_v3 *axis)
{
    const imp_v3 wa = imp__v3(a->axis[0], a->axis[1], a->axis[2]),
                 wb = imp__v3(b->axis[0], b->axis[1], b->axis[2]);
    *axis = wa;
    if (ta >= IMP_PI) return (double)a->cos_normals;
    *axis = wb;
    if (tb >= IMP_PI) return (double)b->cos_normals;
    const imp_v3 turn = imp__cross(wa, wb);
    const double sine = imp__length(turn), td = atan2(sine, imp__dot(wa, wb));
    *axis = wa;
    if (imp_min(td + tb, IMP_PI) <= ta) return (double)a->cos_normals;
    *axis = wb;
    if (imp_min(td + ta, IMP_PI) <= tb) return (double)b->cos_normals;
    const double to = 0.5 * (ta + td + tb) + 1e-6;
    *axis = imp__v3(0, 0, 1);
    if (to >= IMP_PI || !(sine > 1e-12)) return -1;
    const double by = to - 1e-6 - ta;
    const imp_v3 across = imp__cross(turn * (1 / sine), wa);
    *axis = imp__normalize(wa * cos(by) + across * sin(by));
    return cos(to) - 1e-6;
}

double imp__light_enclose(const struct imp_light_node *a, double ta,
                          const struct imp_light_node *b, double tb,
                          struct imp_light_node *out)
{
    imp_v3 axis;
    const double cos_normals = cone_union(a, ta, b, tb, &axis);
    for (int k = 0; k < 3; k++) {
        out->lo[k] = imp_min(a->lo[k], b->lo[k]);
        out->hi[k] = imp_max(a->hi[k], b->hi[k]);
        out->axis[k] = (float)axis[k];
    }
    out->cos_normals = (float)cos_normals;
    out->cos_reach = imp_min(a->cos_reach, b->cos_reach);
    return cos_normals;
}

void imp__light_union(const struct imp_light_node *a, const struct imp_light_node *b,
                      struct imp_light_node *out)
{
    const float strength = a->strength + b->strength;
    const double cos_normals =
        imp__light_enclose(a, imp__light_angle(a), b, imp__light_angle(b), out);
    out->gain = gain_of(cos_normals, (double)out->cos_reach);
    out->strength = strength;
}
