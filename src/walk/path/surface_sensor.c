/* SPDX-License-Identifier: Apache-2.0
 *
 * The first vertex of a walk from a sensor that is a surface: a white diffuse one, whose
 * direction is drawn by the cosine. */
#include "surface_sensor.h"
#include "kind/sensor/receiver.h"
#include "math/warp.h"
#include "scene/located.h"

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    (void)b, (void)in;
    d->wi = imp__cosine_hemisphere(u + 1);
    return d->wi[2] > 0;
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    (void)b, (void)in;
    *f = imp__spec(imp_max(d->wi[2], 0.0) * IMP_INV_PI);
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    (void)b, (void)in;
    return imp_max(d->wi[2], 0.0) * IMP_INV_PI;
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    (void)b, (void)in, (void)d, (void)df;
}

/* Nothing is lost at a sensor: roulette of photons goes by this, and not by the weight of a
 * direction that was drawn towards a small light. */
static bool directional_albedo(const struct imp_bsdf *b, const imp_spec *in,
                               const imp_v3 *wo, imp_spec *albedo)
{
    (void)b, (void)in, (void)wo;
    *albedo = imp__spec(1);
    return true;
}

static const struct imp_bsdf_ops white_ops = {.size = sizeof(struct imp_bsdf_ops),
                                              .name = "",
                                              .sample = sample,
                                              .eval = eval,
                                              .pdf = pdf,
                                              .eval_d = eval_d,
                                              .directional_albedo = directional_albedo};
static const struct imp_bsdf white = {.ops = &white_ops,
                                      .flags = IMP_BSDF_SMOOTH,
                                      .index_input = -1,
                                      .index = -1,
                                      .name = "sensor"};

struct imp_vertex *imp__meter_begin(struct imp_step *s, struct imp_surface *at,
                                    struct imp_frame *frame)
{
    struct imp_walk *walk = s->walk;
    const struct imp_sensor *sensor = s->tracer->sensor;
    double u[2];
    imp__receiver_uv(sensor, walk->px, walk->py, u);
    s->flight.medium = s->flight.here = sensor->medium;
    if (!imp__sensor_vertex(s)) return NULL;
    struct imp_vertex *v = walk->last;
    const double density = imp__decide1(1 / sensor->scale);
    imp__step_weigh(v, imp__spec(1), density, 1);
    if (s->recorded) v->d.pdf = (imp_decided)density;

    /* Its numbers are those of another walk: depth -1 has none, and its block of a point would
     * be that of the start, so that directions would depend on places. */
    walk->depth = -2;
    walk->key = imp__key_branch(walk->key, 0, 1);
    walk->point.set = imp__key_branch((struct imp_key){walk->point.set}, 0, 1).state;
    s->depth = -1;
    at->located.prim = -1;
    sensor->shape->ops->sample_area(sensor->shape, u, at);
    s->at.prim = at->located.prim;
    *frame = imp__frame_from_normal(at->ng);
    at->n = at->ng;
    at->s = frame->s;
    at->t = frame->t;
    if (imp_unlikely(s->scene->priorities != NULL) &&
        !imp__nest_begin(s, sensor->medium, imp__offset(at->p, at->ng, at->ng), at->ng))
        return NULL;
    v = imp__vertex_add(s, 0);
    if (!v) return NULL;
    v->shape = sensor->shape;
    v->bsdf = sensor->receiver ? &sensor->receiver->bsdf : &white;
    if (s->recorded) {
        v->d.shape = sensor->shape->index;
        v->d.scatterer = IMP_AT_SURFACE;
        v->d.located = imp__located_drawn(sensor->shape, &at->located, at->uv);
    }
    imp__vertex_place(s, v, at, frame, -at->ng, 0);
    return v;
}
