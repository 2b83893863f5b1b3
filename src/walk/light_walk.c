/* SPDX-License-Identifier: Apache-2.0
 *
 * One walk from a light is decided (light_walk.h).
 *
 * Depth: a connection from vertex k, 0 on the light, makes a path of k + 1 segments, and a
 * sensor that is met there one of k; they count up to max_depth. */
#include "light_walk.h"
#include "kind/bsdf/transport.h"
#include "scene/media_around.h"
#include "step.h"
#include <float.h>

/* In place of a pixel in the key: no pixel of a film has this number. */
#define LIGHT_WALKS UINT64_C(0x4c69676874000000)

struct light_step {
    struct imp_step s;
    struct imp_light_walk *out;
    struct imp_reach **end; /* of the list */
    /* The ray in flight: its density per area across it, where the sky sent it; else 0. */
    double pdf_across;
};

static bool depth_allows(const struct imp_step *s, int segments)
{
    const int max = s->tracer->integrator->max_depth;
    return max < 0 || segments <= max;
}

static void reach_add(struct light_step *w, struct imp_vertex *v, bool met, double px,
                      double py)
{
    struct imp_reach *r = imp__arena_take(w->s.arena, 1, sizeof *r);
    if (!r) {
        w->s.walk->dropped = IMP_DROP_MEMORY;
        return;
    }
    *r = (struct imp_reach){
        .vertex = v, .number = w->s.walk->n - 1, .met = met, .px = px, .py = py};
    *w->end = r;
    w->end = &r->next;
    w->out->n_reach++;
}

static double power_heuristic(double a, double b)
{
    return a > 0 ? a * a / (a * a + b * b) : 0;
}

/* Film area over area of a sensor that is a surface. */
static double film_per_area(const struct imp_sensor *s)
{
    return (double)s->film.width * s->film.height / s->shape->area;
}

/* ---- The sensor is met ------------------------------------------------------------ */

/* Weight of meeting the sensor's surface against a connection to it, both per area of the
 * surface. `d`: of the ray; t: its length. */
static double met_weight(const struct light_step *w, double cosine, double t)
{
    const struct imp_step *s = &w->s;
    const double connects = 1 / s->tracer->sensor->shape->area;
    const double meets =
        w->pdf_across > 0 ? w->pdf_across * cosine : s->pdf * cosine / (t * t);
    if (!s->tracer->integrator->lights || !(meets > 0)) return 1;
    return power_heuristic(meets, connects);
}

static void sensor_meet(struct light_step *w, struct imp_vertex *v,
                        const struct imp_surface *at)
{
    struct imp_step *s = &w->s;
    const struct imp_sensor *sensor = s->tracer->sensor;
    const double cosine = -imp__dot(at->ng, s->d);
    if (!(cosine > 0) || !depth_allows(s, s->depth)) return;
    if (s->tracer->integrator->hide_emitters && s->depth == 1) return;
    const double weight =
        imp__decide1(film_per_area(sensor) * met_weight(w, cosine, v->t));
    const bool square = sensor->shape->ops->flags & IMP_SHAPE_SQUARE;
    const struct imp_key key = s->walk->key;
    const double u =
        square ? at->uv[0] : imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT));
    const double t =
        square ? at->uv[1] : imp__u01(key, imp__dim(s->depth, IMP_DIM_SPARE));
    v->e = imp__spec(weight);
    if (s->recorded) v->d.met.weight = (imp_decided)weight;
    reach_add(w, v, true, u * sensor->film.width, t * sensor->film.height);
}

/* ---- Connections ------------------------------------------------------------------ */

/* With hide_emitters the sensor looks past area lights on the first segment of its rays. */
static bool seen_past_lights(const struct imp_step *s, imp_v3 o, imp_v3 d, double reach)
{
    struct imp_hit hit;
    double from = 0;
    while (imp__intersect_at(s->scene, s->walk->time, &o, &d, from, reach, &hit)) {
        if (s->scene->shapes[hit.shape]->emitter < 0) return false;
        from = hit.t + (1 + fabs(hit.t)) * IMP_RAY_EPSILON;
    }
    return true;
}

/* Is the ray free, and what does it let pass? */
static bool sees(struct imp_step *s, struct imp_vertex *v, const struct imp_surface *from,
                 const struct imp_shadow *shadow, imp_spec *T)
{
    *T = imp__spec(1);
    if (s->segment->sees) return s->segment->sees(s, v, from, shadow, T);
    if (imp_unlikely(s->tracer->integrator->hide_emitters))
        return seen_past_lights(s, shadow->o, shadow->d, shadow->reach);
    return !imp__occluded_at(s->scene, s->walk->time, &shadow->o, &shadow->d, 0,
                             shadow->reach);
}

static void sensor_numbers(const struct imp_step *s, double u[4])
{
    const struct imp_key key = s->walk->key;
    u[0] = imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT_U));
    u[1] = imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT_V));
    u[2] = imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT));
    u[3] = imp__u01(key, imp__dim(s->depth, IMP_DIM_SPARE));
}

/* Weight of a connection against a walk that meets the sensor, which has density `pdf` per
 * steradian, or `across` per area across the ray. */
static double connect_weight(const struct imp_step *s, const struct imp_sensor_sample *to,
                             double pdf, double across)
{
    const struct imp_sensor *sensor = s->tracer->sensor;
    if (!sensor->shape || !s->tracer->integrator->directions) return 1;
    const double c = to->cos_sensor;
    const double meets = across > 0 ? across * c : pdf * c / (to->dist * to->dist);
    return power_heuristic(1 / sensor->shape->area, meets);
}

/* The shadow ray from `from` to the sample. */
static void shadow_aim(const struct imp_surface *from, const struct imp_sensor_sample *to,
                       struct imp_shadow *shadow)
{
    const bool surface = imp__dot(from->ng, from->ng) > 0;
    shadow->o = surface ? imp__offset(from->p, from->ng, to->wo) : from->p;
    shadow->d = to->p - shadow->o;
    shadow->reach = imp__dot(to->ng, to->ng) > 0 ? 1 - 10 * IMP_RAY_EPSILON : 1;
    shadow->wanted = true;
}

/* What connections have in common: v is connected with f le weight, if it is seen. */
static void connection_make(struct light_step *w, struct imp_vertex *v,
                            const struct imp_surface *from,
                            const struct imp_shadow *shadow,
                            const struct imp_sensor_sample *to, imp_spec f, imp_spec le,
                            double weight)
{
    struct imp_step *s = &w->s;
    imp_spec T;
    if (s->recorded) v->d.connection = IMP_OCCLUDED;
    if (!sees(s, v, from, shadow, &T)) return;
    v->b = f * le * weight * T;
    if (s->recorded) {
        v->d.connection = IMP_CONNECTED;
        v->d.light.weight = (imp_decided)weight;
        v->light_f = f;
        v->light_e = le;
        v->light_w = T * weight;
    }
    reach_add(w, v, false, to->px, to->py);
}

/* A vertex that scatters, at `at`. */
static void vertex_connect(struct light_step *w, struct imp_vertex *v,
                           const struct imp_surface *at, const struct imp_frame *frame)
{
    struct imp_step *s = &w->s;
    const struct imp_sensor *sensor = s->tracer->sensor;
    const struct imp_bsdf *b = v->bsdf;
    const struct imp_walk_integrator *i = s->tracer->integrator;
    struct imp_sensor_sample to;
    double u[4];
    if (!i->lights || !(b->flags & IMP_BSDF_SMOOTH) || !depth_allows(s, s->depth + 1))
        return;
    if (!sensor->ops->connect || (i->hide_emitters && v->shape && v->shape->emitter >= 0))
        return;
    sensor_numbers(s, u);
    if (!sensor->ops->connect(sensor, &at->p, false, u, &to)) return;

    const struct imp_dirs dirs = {imp__decide(imp__to_local(frame, to.wo)), s->wo,
                                  IMP_SMOOTH, imp__wants_derivative(s, b)};
    const double c = v->shape
                         ? imp__bsdf_exchange(b, s->in, &dirs, imp__dot(to.wo, at->ng),
                                              imp__dot(-s->d, at->ng))
                         : 1;
    imp_spec f, p;
    imp__bsdf_eval(b, s->at.carried, s->in, &dirs, &f);
    const struct imp_dirs exchanged = {dirs.wi, dirs.wo, IMP_SMOOTH, dirs.derivative};
    if (imp_likely(!b->shaped)) p = imp__spec(b->ops->pdf(b, s->in, &exchanged));
    else imp__shaped_pdf(b, s->at.carried, s->in, &exchanged, &p);
    const double pdf = imp_likely(!b->shaped) ? p[0] : imp__lane_mis_density(s, p);
    const double weight = imp__decide1(to.weight * c * connect_weight(s, &to, pdf, 0));
    if (!(weight > 0)) return;
    if (imp__is_zero_used(f, s->at.carried) && !imp__wants_derivative(s, b)) return;
    struct imp_shadow shadow;
    shadow_aim(at, &to, &shadow);
    if (s->recorded) {
        v->d.light.emitter = -1;
        imp__store_v3(v->d.light.wi, dirs.wo);
    }
    connection_make(w, v, at, &shadow, &to, f, imp__spec(1), weight);
}

/* ---- The light -------------------------------------------------------------------- */

static bool is_far(const struct imp_emitter *e)
{
    return e->ops->flags & (IMP_EMITTER_ENVIRONMENT | IMP_EMITTER_FAR);
}

/* As decisions keep it. */
static struct imp_emission emission_of(const struct imp_emission_sample *e, double dist,
                                       double cos_light, imp_v3 d)
{
    return (struct imp_emission){{imp__decide1(e->uv[0]), imp__decide1(e->uv[1])},
                                 dist,
                                 imp__decide1(cos_light),
                                 imp__decide(d)};
}

/* The light itself, seen by the sensor. per: the density of the point, with the choice of
 * the light; of the sky that of the direction. */
static void light_connect(struct light_step *w, struct imp_vertex *v, int light,
                          const struct imp_emission_sample *start, imp_v3 n, double per)
{
    struct imp_step *s = &w->s;
    const struct imp_emitter *e = s->scene->emitters[light];
    const struct imp_sensor *sensor = s->tracer->sensor;
    const struct imp_walk_integrator *i = s->tracer->integrator;
    const bool far = is_far(e);
    const bool point = e->ops->flags & IMP_EMITTER_DELTA;
    if (!i->lights || i->hide_emitters || !depth_allows(s, 1) || !sensor->ops->connect ||
        (point && !sensor->shape))
        return;
    struct imp_sensor_sample to;
    double u[4], c = 1;
    const imp_v3 ref = far ? -start->d : start->p;
    sensor_numbers(s, u);
    if (!sensor->ops->connect(sensor, &ref, far, u, &to)) return;
    const imp_v3 d = far ? start->d : to.wo;
    const bool surface = imp__dot(start->ng, start->ng) > 0;
    if (surface) c = fabs(imp__dot(start->ng, d));
    const struct imp_emission x =
        emission_of(start, far ? INFINITY : 1, surface ? imp__dot(n, d) : 1, d);
    const double pdf = far ? 0 : e->ops->pdf_emission(e, &x);
    if (!far && !(pdf > 0)) return; /* this way nothing is emitted */
    const double weight =
        imp__decide1(imp__emitter_timed(e, s->walk->time, to.weight * c) *
                     connect_weight(s, &to, pdf, far ? start->pdf_p : 0) / per);
    const imp_spec le =
        imp__emitter_radiance(s->scene, light, &x, s->at.p, s->at.carried);
    const struct imp_active *active = s->tracer->active;
    if (!(weight > 0) ||
        (imp__is_zero_used(le, s->at.carried) && !(active && active->emitter[light])))
        return;
    struct imp_shadow shadow;
    struct imp_surface from = {.p = start->p, .ng = start->ng};
    if (far) { /* from the sensor to the sky */
        from = (struct imp_surface){.p = to.p, .ng = to.ng};
        shadow = (struct imp_shadow){.o = sensor->shape ? imp__offset(to.p, to.ng, -to.wo)
                                                        : to.p,
                                     .d = -to.wo,
                                     .reach = INFINITY,
                                     .wanted = true};
    } else {
        shadow_aim(&from, &to, &shadow);
    }
    if (s->recorded) {
        struct imp_light *l = &v->d.light;
        l->emitter = light;
        l->uv[0] = (imp_decided)x.uv[0];
        l->uv[1] = (imp_decided)x.uv[1];
        l->dist = (imp_decided)x.dist;
        l->cos_light = (imp_decided)x.cos_light;
        imp__store_v3(l->d, x.d);
        imp__store_v3(l->p, s->at.p);
        imp__store_v3(l->wi, (imp_v3){0});
    }
    const struct imp_medium *here = s->flight.here;
    if (far) s->flight.here = sensor->medium;
    connection_make(w, v, &from, &shadow, &to, imp__spec(1), le, weight);
    s->flight.here = here;
}

/* The medium that light enters from a point of its light. */
static const struct imp_medium *medium_at(const struct imp_step *s,
                                          const struct imp_emitter *e,
                                          const struct imp_emission_sample *start)
{
    if (s->scene->n_media == 0) return NULL;
    if (e->shape && (e->shape->interior || e->shape->exterior))
        return imp__dot(start->ng, start->d) < 0 ? e->shape->interior
                                                 : e->shape->exterior;
    const bool far = is_far(e);
    return imp__medium_around(s->scene, start->p, start->d,
                              far ? NULL : s->tracer->sensor->medium);
}

/* Vertex 0: the light that sends the walk, and whither. False: nothing is sent. */
static bool begin(struct light_step *w)
{
    struct imp_step *s = &w->s;
    const struct imp_scene *scene = s->scene;
    const struct imp_key key = s->walk->key;
    struct imp_emission_sample start;
    double pmf;
    if (scene->n_emitters == 0) return false;
    const int light =
        imp__light_pick(scene, imp__u01(key, imp__dim_start(IMP_DIM_EMITTER)), &pmf);
    const struct imp_emitter *e = scene->emitters[light];
    const double u[4] = {imp__u01(key, IMP_DIM_PIXEL_X), imp__u01(key, IMP_DIM_PIXEL_Y),
                         imp__u01(key, IMP_DIM_LENS_U), imp__u01(key, IMP_DIM_LENS_V)};
    if (!(pmf > 0) || !e->ops->sample_emission(e, &scene->ball, u, &start)) return false;
    const bool far = is_far(e);
    const double per = pmf * start.pdf_p * start.pdf_d;
    if (!(per > 0)) return false;

    struct imp_vertex *v = imp__vertex_add(s, 1);
    if (!v) return false;
    v->t = 0;
    s->at.uv[0] = imp__decide1(start.uv[0]);
    s->at.uv[1] = imp__decide1(start.uv[1]);
    s->at.p = imp__decide(start.p);
    const bool surface = imp__dot(start.ng, start.ng) > 0;
    /* The shading normal is not in the sample: a shape that is smooth gives it again. */
    imp_v3 n = start.ng;
    if (surface && e->shape->smooth) {
        struct imp_surface at;
        e->shape->ops->sample_area(e->shape, u, &at);
        n = at.n;
    }
    const struct imp_emission x =
        emission_of(&start, far ? INFINITY : 1, start.cos_light, start.d);
    s->flight.medium = s->flight.here = medium_at(s, e, &start);
    if (s->recorded) {
        v->ng = start.ng;
        v->d.scatterer = IMP_AT_LIGHT;
        v->d.from_light = true;
        v->d.uv[0] = (imp_decided)s->at.uv[0];
        v->d.uv[1] = (imp_decided)s->at.uv[1];
        imp__store_v3(v->d.p, s->at.p);
        imp__store_v3(v->d.wo, (imp_v3){0});
        imp__store_v3(v->d.wi, (imp_v3){0});
        v->d.lobe = IMP_SMOOTH;
        struct imp_met *m = &v->d.met;
        m->emitter = light;
        m->weight = 0;
        m->dist = (imp_decided)x.dist;
        m->cos_light = (imp_decided)x.cos_light;
        imp__store_v3(m->d, x.d);
    }
    light_connect(w, v, light, &start, n, pmf * (far ? start.pdf_d : start.pdf_p));
    if (s->walk->dropped || !s->tracer->integrator->directions) return false;
    if (!depth_allows(s, s->tracer->sensor->shape ? 1 : 2) || !(start.cos_p > 0))
        return false;

    const double shines = imp__emitter_timed(e, s->walk->time, 1);
    if (!(shines > 0)) return false;
    const double pdf = imp__decide1(per / (start.cos_p * shines));
    const imp_spec le = imp__emitter_radiance(scene, light, &x, s->at.p, s->at.carried);
    const struct imp_active *active = s->tracer->active;
    if (imp__is_zero_used(le, s->at.carried) && !(active && active->emitter[light]))
        return false;
    imp__step_weigh(v, le, pdf, 1);
    if (s->recorded) {
        v->in[0] = le;
        v->d.pdf = (imp_decided)pdf;
        v->d.goes_on = true;
    }
    s->d = start.d;
    s->o = surface ? imp__offset(start.p, start.ng, start.d) : start.p;
    s->from = start.p;
    s->t_min = 0;
    s->t_max = INFINITY;
    s->pdf = far ? 0 : start.pdf_d;
    w->pdf_across = far ? start.pdf_p : 0;
    s->depth = 1;
    return true;
}

/* ---- One step --------------------------------------------------------------------- */

/* Draw where the light goes. False: nowhere. */
static bool direction_draw(const struct imp_step *s, const struct imp_bsdf *b,
                           const double u[3], struct imp_dirs *dirs)
{
    if (imp_likely(!b->shaped)) return imp__bsdf_transposed_sample(b, s->in, u, dirs);
    imp_spec own[IMP_INPUTS_MAX];
    imp__shaped_inputs(b, s->in, imp__waves_drew(s->at.carried), own);
    return imp__bsdf_transposed_sample(b, own, u, dirs);
}

/* Its density, in all lanes together where they differ; 0: the walk ends. */
static double direction_pdf(struct imp_step *s, const struct imp_bsdf *b,
                            const struct imp_dirs *dirs)
{
    if (imp_likely(!b->shaped)) return imp__bsdf_transposed_pdf(b, s->in, dirs);
    const struct imp_dirs exchanged = {dirs->wi, dirs->wo, dirs->lobe, dirs->derivative};
    imp_spec p;
    imp__shaped_pdf(b, s->at.carried, s->in, &exchanged, &p);
    if (!(p[imp__lane_mis_drew(s)] > 0)) return 0;
    return 1 / imp__lane_mis_decide(s, p);
}

/* Whether the walk goes on, and where. */
static bool scatter(struct light_step *w, struct imp_vertex *v,
                    const struct imp_surface *at, const struct imp_frame *frame)
{
    struct imp_step *s = &w->s;
    const struct imp_walk_integrator *integrator = s->tracer->integrator;
    const struct imp_bsdf *b = v->bsdf;
    const struct imp_key key = s->walk->key;
    const double u[3] = {imp__u01(key, imp__dim(s->depth, IMP_DIM_LOBE)),
                         imp__u01(key, imp__dim(s->depth, IMP_DIM_DIR_U)),
                         imp__u01(key, imp__dim(s->depth, IMP_DIM_DIR_V))};
    struct imp_dirs dirs = {
        .wi = s->wo_drawn, .lobe = IMP_SMOOTH, .derivative = imp__wants_derivative(s, b)};
    if (!direction_draw(s, b, u, &dirs)) return false;
    const imp_v3 d = imp__to_world(frame, dirs.wo);
    dirs.wi = s->wo;
    dirs.wo = imp__decide(dirs.wo);
    const double density = direction_pdf(s, b, &dirs);
    const double c = v->shape ? imp__bsdf_exchange(b, s->in, &dirs, imp__dot(d, at->ng),
                                                   imp__dot(-s->d, at->ng))
                              : 1;
    if (!(density > 0) || !(c > 0)) return false;
    const double pdf = imp__decide1(density / c);
    imp_spec f;
    imp__bsdf_eval(b, s->at.carried, s->in, &dirs, &f);
    if (!(pdf > 0) || !imp__throughput_add(s, b, f * (1 / pdf))) return false;

    double survive = 1;
    if (s->depth >= integrator->rr_depth) {
        survive = imp__decide1(fmin(imp__max_used(s->beta, s->at.carried), 0.95));
        if (!(imp__u01(key, imp__dim(s->depth, IMP_DIM_SURVIVE)) < survive)) return false;
        s->beta *= imp__spec(1 / survive);
    }
    imp__step_weigh(v, f, pdf, survive);
    if (s->recorded) {
        imp__store_v3(v->d.wo, dirs.wo);
        v->d.lobe = (int8_t)dirs.lobe;
        v->d.pdf = (imp_decided)pdf;
        v->d.survive = (imp_decided)survive;
        v->d.goes_on = true;
    }
    s->d = d;
    s->o = v->shape ? imp__offset(at->p, at->ng, d) : at->p;
    s->from = at->p;
    s->t_min = 0;
    s->t_max = INFINITY;
    if (s->segment->leave) s->segment->leave(s, v, at);
    s->pdf = dirs.lobe == IMP_SMOOTH ? density : 0;
    w->pdf_across = 0;
    return true;
}

static bool step(struct light_step *w)
{
    struct imp_step *s = &w->s;
    struct imp_hit hit;
    struct imp_surface at;
    struct imp_frame frame;
    struct imp_vertex *v =
        imp__vertex_meet(s, s->segment->meet(s, &hit), &hit, &at, &frame);
    if (!v) return false;
    if (s->recorded) {
        v->d.from_light = true;
        v->d.met.weight = 0;
        imp__store_v3(v->d.wi, s->wo);
        imp__store_v3(v->d.wo, (imp_v3){0});
    }
    if (v->shape && v->shape->sensor == s->tracer->sensor) sensor_meet(w, v, &at);
    if (s->walk->dropped) return false;
    vertex_connect(w, v, &at, &frame);
    if (s->walk->dropped || !s->tracer->integrator->directions) return false;
    if (!depth_allows(s, s->depth + (s->tracer->sensor->shape ? 1 : 2))) return false;
    if (!scatter(w, v, &at, &frame)) return false;
    s->depth++;
    return !s->walk->dropped;
}

/* ---- Walks ------------------------------------------------------------------------ */

/* Why light of this amount is dropped (trace.c). */
static enum imp_drop drop_cause(imp_spec L)
{
    double sum = 0, largest = 0;
    for (int c = 0; c < 4; c++) {
        sum += L[c];
        largest = fmax(largest, fabs(L[c]));
    }
    if (isnan(sum)) return IMP_DROP_NAN;
    return largest <= FLT_MAX ? IMP_DROP_NEGATIVE : IMP_DROP_INFINITE;
}

/* What reaches the film, with the throughput up to each vertex. */
static void close(const struct imp_tracer *tracer, struct imp_light_walk *out)
{
    struct imp_walk *walk = &out->walk;
    imp_spec P = imp__spec(1);
    struct imp_reach *r = out->reach;
    for (struct imp_vertex *v = walk->first; v && r && !walk->dropped; v = v->next) {
        for (; r && r->vertex == v; r = r->next) {
            r->values = P * (r->met ? v->e : v->b);
            imp_spec used = r->values;
            if (!tracer->wavelengths) used[3] = 0;
            if (imp_unlikely(!imp__is_within(used, FLT_MAX)))
                walk->dropped = drop_cause(used);
            r->L = imp__walk_seen(walk, r->values);
        }
        P *= v->w;
    }
    if (!walk->dropped) return;
    out->reach = NULL;
    out->n_reach = 0;
}

void imp__light_walk_trace(const struct imp_tracer *tracer, struct imp_arena *arena,
                           int64_t index, struct imp_light_walk *out)
{
    const struct imp_key key = imp__key(tracer->seed, LIGHT_WALKS, (uint64_t)index);
    *out = (struct imp_light_walk){.walk = {.key = key, .valid = true}};
    struct imp_walk *walk = &out->walk;
    walk->time = imp__walk_time(tracer, walk);
    if (tracer->wavelengths &&
        !imp__walk_wave(tracer, arena, imp__wave_draw(tracer, walk, index), walk))
        return;
    imp_spec scratch[IMP_INPUTS_MAX];
    struct light_step w = {.s = {.tracer = tracer,
                                 .scene = tracer->scene,
                                 .walk = walk,
                                 .arena = arena,
                                 .recorded = !tracer->value_only,
                                 .scratch = scratch,
                                 .at.carried = walk->waves ? &walk->waves->carried : NULL,
                                 .segment = imp__segment_first(tracer),
                                 .beta = {1, 1, 1, 1},
                                 .eta = 1,
                                 .lanes = IMP_LANE_MIS_INIT},
                           .out = out,
                           .end = &out->reach};
    if (begin(&w))
        while (step(&w)) {}
    close(tracer, out);
}
