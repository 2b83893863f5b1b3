/* SPDX-License-Identifier: Apache-2.0
 *
 * Areas of lights and meters, and the points and directions in which light leaves.
 *
 * Random lines that meet a ball of radius R, uniform in direction and in the disk across it,
 * leave a surface in the ball at its front with the density
 *
 *     q = cos(theta)/(4 pi^2 R^2)    per area and steradian        (Crofton; Santalo 1976)
 *
 * which asks for rays alone; lines along one direction cos(theta)/(pi R^2) per area. areas: points drawn on the shape, with the density 1/area, and
 * directions by the cosine. leaves: points and directions that light walks begin with; of a
 * light that is a point, directions against lobes about some that were drawn. Sums as in
 * check_directions.c, over all points in which a line leaves the shape. */
#include "check_lobes.h"
#include "check_sources.h"
#include "kind/sensor/receiver.h"
#include "math/offset.h"
#include "math/rng.h"
#include "math/warp.h"
#include "scene/instances.h"
#include <math.h>

#define CROSSED 512 /* surfaces that a line meets, at most */
enum { WHOLE, RATIOS, QUARTERS = RATIOS + 6, AGREE = QUARTERS + 4 };

struct surface {
    const struct imp_scene *scene;
    const struct imp_shape *shape;
    const struct imp_emitter *light; /* NULL: a meter, or the area alone */
    double time;
    imp_v3 centre;
    double radius; /* of a ball about the shape */
    bool parallel; /* all light leaves along `axis`, and so do the lines */
    imp_v3 axis;
    struct imp__lobes lobes; /* of a light that is a point */
};

static void point_add(struct imp__pair *p, double pdf, double q, const double uv[2],
                      bool drawn)
{
    if (!(pdf > 0)) return;
    const double part = (drawn ? q : pdf) / (q + pdf), d = drawn ? part : 0,
                 g = drawn ? 0 : part;
    imp__pair_add(p, WHOLE, d, g);
    imp__pair_add(p, RATIOS + imp_min((int)(6 * pdf / (pdf + q)), 5), d, g);
    imp__pair_add(p, QUARTERS + (uv[0] > 0.5) + 2 * (uv[1] > 0.5), d, g);
}
static double line_density(const struct surface *x, double cosine)
{
    if (x->parallel) return cosine / (IMP_PI * imp__sqr(x->radius));
    return cosine / imp__sqr(IMP_2PI * x->radius);
}

/* What is claimed for light that leaves the surface `at` along d. */
static double claimed(const struct surface *x, const struct imp_surface *at, imp_v3 d)
{
    const double cosine = imp__dot(at->ng, d);
    if (!x->light) return cosine * IMP_INV_PI / x->shape->area;
    const struct imp_emission e = {{at->uv[0], at->uv[1]}, 1, imp__dot(at->n, d), d};
    if (!(e.cos_light > 0)) return 0;
    return x->light->ops->pdf_emission(x->light, &e) / x->shape->area;
}

static void drawn_add(const struct surface *x, const double u[4], struct imp__pair *p)
{
    if (!x->light) {
        struct imp_surface at;
        at.located.prim = -1;
        x->shape->ops->sample_area(x->shape, u, &at);
        const struct imp_frame frame = imp__frame_from_normal(at.ng);
        const imp_v3 d = imp__to_world(&frame, imp__cosine_hemisphere(u + 2));
        const double cosine = imp__dot(at.ng, d);
        if (cosine > 0)
            point_add(p, claimed(x, &at, d), line_density(x, cosine), at.uv, true);
        return;
    }
    struct imp_emission_sample s;
    s.located.prim = -1;
    if (!x->light->ops->sample_emission(x->light, &x->scene->ball, u, &s)) return;
    const double pdf = s.pdf_p * s.pdf_d, cosine = imp__dot(s.ng, s.d);
    if (!(pdf > 0) || !(cosine > 0)) return;
    const struct imp_emission e = {{s.uv[0], s.uv[1]}, 1, s.cos_light, s.d};
    point_add(p, pdf, line_density(x, cosine), s.uv, true);
    const double other = x->light->ops->pdf_emission(x->light, &e) / x->shape->area;
    imp__pair_add(p, AGREE, other > 0 ? fmin(pdf / other, 2) : 2, 1);
}

static void line_pair(const void *payload, uint64_t seed, int64_t i, struct imp__pair *p)
{
    const struct surface *x = payload;
    const struct imp_key key = imp__key(seed, 0xa4ea, (uint64_t)i);
    double u[8];
    for (int k = 0; k < 8; k++) u[k] = imp__u01(key, (uint32_t)k);
    drawn_add(x, u, p);
    const imp_v3 d = x->parallel ? x->axis : imp__uniform_sphere(u + 4);
    const struct imp_frame across = imp__frame_from_normal(d);
    const double r = x->radius * sqrt(u[6]), phi = IMP_2PI * u[7];
    const imp_v3 begin =
        x->centre +
        imp__to_world(&across, (imp_v3){r * cos(phi), r * sin(phi), -x->radius});
    imp_v3 o = begin;
    for (int k = 0; k < CROSSED; k++) {
        const double left = 2 * x->radius - imp__dot(o - begin, d);
        struct imp_hit hit;
        struct imp_surface at;
        if (!(left > 0) || !imp__intersect_at(x->scene, x->time, &o, &d, 0, left, &hit))
            return;
        imp__hit_surface(x->scene, &hit, &o, &d, &at);
        o = imp__offset(at.p, at.ng, d);
        const double cosine = imp__dot(at.ng, d);
        if (x->scene->shapes[hit.shape] == x->shape && cosine > 0)
            point_add(p, claimed(x, &at, d), line_density(x, cosine), at.uv, false);
    }
}

/* ---- Lights that are points ------------------------------------------------------------ */

static void direction_pair(const void *payload, uint64_t seed, int64_t i,
                           struct imp__pair *p)
{
    const struct surface *x = payload;
    const struct imp_emitter_ops *ops = x->light->ops;
    const struct imp_key key = imp__key(seed, 0xa4eb, (uint64_t)i);
    struct imp_emission_sample s;
    double u[7];
    for (int k = 0; k < 7; k++) u[k] = imp__u01(key, (uint32_t)k);
    s.located.prim = -1;
    if (ops->sample_emission(x->light, &x->scene->ball, u, &s) && s.pdf_d > 0) {
        const double uv[2] = {0.5 + 0.5 * s.d[0], 0.5 + 0.5 * s.d[1]};
        const struct imp_emission e = {{0, 0}, 1, 1, s.d};
        const double other = ops->pdf_emission(x->light, &e);
        point_add(p, s.pdf_d, imp__lobes_pdf(&x->lobes, s.d), uv, true);
        imp__pair_add(p, AGREE, other > 0 ? fmin(s.pdf_d / other, 2) : 2, 1);
    }
    const imp_v3 w = imp__lobes_sample(&x->lobes, u + 4);
    const double uv[2] = {0.5 + 0.5 * w[0], 0.5 + 0.5 * w[1]};
    const struct imp_emission e = {{0, 0}, 1, 1, w};
    point_add(p, ops->pdf_emission(x->light, &e), imp__lobes_pdf(&x->lobes, w), uv,
              false);
}

static void lobes_set(struct surface *x)
{
    for (uint32_t k = 0; k < IMP_LOBE_AXES; k++) {
        const struct imp_key key = imp__key(0x9107, k, 7);
        struct imp_emission_sample s;
        double u[4];
        for (uint32_t j = 0; j < 4; j++) u[j] = imp__u01(key, j);
        s.located.prim = -1;
        if (x->light->ops->sample_emission(x->light, &x->scene->ball, u, &s))
            imp__lobes_add(&x->lobes, s.d);
    }
}

/* ---- Rows -------------------------------------------------------------------------------- */

#define ALIKE 2 /* lights of one kind on shapes of one kind that have rows */

static enum imp_status surface_add(struct imp__draw_list *l, const struct imp_tracer *t,
                                   const struct imp_shape *shape,
                                   const struct imp_emitter *light, const char *method,
                                   const char *name)
{
    struct surface *x = imp__arena_array(&l->arena, 1, sizeof *x);
    if (!x) return imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check");
    *x = (struct surface){
        .scene = t->scene, .shape = shape, .light = light, .time = t->sensor->open};
    if (shape) {
        x->centre = (shape->lo + shape->hi) * 0.5;
        x->radius = 0.501 * imp__length(shape->hi - shape->lo);
    } else lobes_set(x);
    if (shape && light && light->ops->flags & IMP_EMITTER_DELTA) {
        struct imp_emission_sample s;
        s.located.prim = -1;
        if (!light->ops->sample_emission(light, &t->scene->ball,
                                         (double[4]){0.5, 0.5, 0.5, 0.5}, &s))
            return IMP_OK;
        x->parallel = true;
        x->axis = s.d;
    }
    return imp__draw_add(
        l, &(struct imp__draw_row){.method = method,
                                   .name = name,
                                   .pair = shape ? line_pair : direction_pair,
                                   .payload = x,
                                   .slack = 1e-3});
}

static bool alike(const struct imp_emitter *a, const struct imp_emitter *b)
{
    return a->ops == b->ops &&
           (a->shape ? a->shape->ops : NULL) == (b->shape ? b->shape->ops : NULL);
}
/* Walks that begin at it have densities that are looked at here; on a shape that draws no
 * points none does. */
static bool looked_at(const struct imp_emitter *e)
{
    const unsigned other = IMP_EMITTER_FAR | IMP_EMITTER_ENVIRONMENT;
    if (!e->ops->sample_emission || !e->ops->pdf_emission) return false;
    if (e->shape) return e->shape->ops->sample_area && e->shape->area > 0;
    return !(e->ops->flags & other); /* check_far.c */
}

enum imp_status imp__check_areas(struct imp__draw_list *l,
                                 const struct imp__places *places)
{
    enum imp_status st = IMP_OK;
    const struct imp_tracer *t = &places->tracer;
    const struct imp_scene *scene = t->scene;
    const struct imp_shape *meter = t->sensor->shape;
    if (meter && !imp__is_unmet(t->sensor) && meter->ops->sample_area && meter->area > 0)
        IMP_TRY(surface_add(l, t, meter, NULL, "areas", t->sensor->name));
    for (int k = 0; k < scene->n_emitters; k++) {
        const struct imp_emitter *e = scene->emitters[k];
        int before = 0;
        for (int j = 0; j < k; j++)
            before += looked_at(scene->emitters[j]) && alike(e, scene->emitters[j]);
        if (!looked_at(e) || before >= ALIKE) continue;
        const char *name = e->name ? e->name : e->ops->name;
        if (e->shape) IMP_TRY(surface_add(l, t, e->shape, NULL, "areas", name));
        IMP_TRY(surface_add(l, t, e->shape, e, "leaves", name));
    }
out:
    return st;
}
