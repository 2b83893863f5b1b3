/* SPDX-License-Identifier: Apache-2.0
 *
 * One walk is decided. The step below is the only place where paths are made: rendering,
 * gradients, replays and frozen checks all start from what it records. Path tracing with
 * light samples, and Stam's walk that collects emission only where it is absorbed, are
 * settings of it.
 *
 * Estimator (docs/estimators.md 8): E_k = w^B Le for emission met by chance, B_k = w^E f
 * Le/p^e for a light sample, power heuristic with exponent 2, w^B = 1 at the first vertex
 * and after a delta lobe. Depth: emission at vertex k counts if k < max_depth, scattering
 * goes on and samples lights if k + 1 < max_depth (docs/scene-format.md 11). */
#include "meter.h"
#include "scene/instances.h"
#include "walk/core/drawn.h"
#include <stddef.h>

/* ---- Vertices -------------------------------------------------------------------- */

/* With room behind it for n_in inputs of its BSDF, unless only its value counts. */
static inline struct imp_vertex *vertex_add(struct imp_step *s, int n_in)
{
    struct imp_walk *w = s->walk;
    if (imp_unlikely(w->n == IMP_WALK_MAX)) {
        w->dropped = IMP_DROP_LONG;
        return NULL;
    }
    struct imp_vertex *v = imp__arena_take(
        s->arena, 1,
        s->recorded ? sizeof *v + (size_t)n_in * sizeof *v->in : IMP_VERTEX_VALUES);
    if (imp_unlikely(!v)) {
        w->dropped = IMP_DROP_MEMORY;
        return NULL;
    }
    v->prev = w->last;
    v->next = NULL;
    if (w->last) w->last->next = v;
    else w->first = v;
    w->last = v;
    w->n++;
    v->bsdf = NULL;
    v->shape = NULL;
    v->side = NULL;
    v->w = v->e = v->b = v->beyond = (imp_spec){0};
    v->scale = (imp_spec){0};
    if (!s->recorded) return v;

    v->segment = &imp__straight;
    v->on = v->to_light = NULL;
    v->probe = NULL;
    v->in = (imp_spec *)(v + 1);
    v->carried = s->at.carried;
    struct imp_decision *d = &v->d;
    d->shape = d->met.emitter = -1;
    d->connection = IMP_NOT_CONNECTED;
    d->glows = d->goes_on = d->stands = d->from_light = d->alone = false;
    d->drawn = IMP_DENSITY_KERNEL;
    d->pdf = d->rest = 0;
    d->survive = d->passes = d->share = 1;
    d->met.weight = d->glow_weight = 1;
    return v;
}

struct imp_vertex *imp__vertex_add(struct imp_step *s, int n_in)
{
    return vertex_add(s, n_in);
}

static inline void vertex_place(struct imp_step *s, struct imp_vertex *v,
                                const struct imp_surface *at,
                                const struct imp_frame *frame, imp_v3 d, double t)
{
    imp_spec *in = s->recorded ? v->in : s->scratch;
    v->t = t;
    s->at.uv[0] = imp__decide1(at->uv[0]);
    s->at.uv[1] = imp__decide1(at->uv[1]);
    s->at.p = imp__decide(at->p);
    s->at.shape = v->shape;
    s->wo_drawn = imp__to_local(frame, -d);
    s->wo = imp__decide(s->wo_drawn);
    s->in = in;
    imp__evaluate_inputs(v->bsdf, v->shape, &s->at, in);
    if (!s->recorded) return;
    v->ng = at->ng;
    v->d.uv[0] = (imp_decided)s->at.uv[0];
    v->d.uv[1] = (imp_decided)s->at.uv[1];
    imp__store_v3(v->d.p, s->at.p);
    imp__store_v3(v->d.wo, s->wo);
}
void imp__vertex_place(struct imp_step *s, struct imp_vertex *v,
                       const struct imp_surface *at, const struct imp_frame *frame,
                       imp_v3 d, double t)
{
    vertex_place(s, v, at, frame, d, t);
}

/* ---- One step --------------------------------------------------------------------- */

/* May light that is met here make the sample valid (docs/scene-format.md 11)? What is hidden from
 * the camera stays hidden behind a null material for path, and not for direct. */
static bool seen(const struct imp_step *s)
{
    const struct imp_walk_integrator *integrator = s->tracer->integrator;
    return !integrator->hide_emitters || (integrator->first_hit && imp__bounces(s) > 0);
}

/* A vertex that scatters nothing, passed along d. */
static void straight_on(struct imp_decision *v, imp_v3 d)
{
    v->goes_on = true;
    v->pdf = 1;
    v->lobe = IMP_SMOOTH;
    imp__store_v3(v->wi, d);
}

void imp__sky_meet(struct imp_step *s)
{
    const int max_depth = s->tracer->integrator->max_depth;
    const bool counts = max_depth < 0 || imp__bounces(s) < max_depth;
    const bool hidden = s->tracer->integrator->hide_emitters && imp__bounces(s) == 0;
    const int n = s->scene->n_environments;
    if (n == 0 || hidden || !counts) return;
    s->at.p = imp__decide(s->d);
    s->at.uv[0] = s->at.uv[1] = 0;
    s->at.shape = NULL;
    /* A vertex to each: past all but the last the walk goes straight on. */
    for (int k = 0; k < n; k++) {
        struct imp_vertex *v = vertex_add(s, 0);
        if (!v) return;
        v->t = INFINITY;
        if (k + 1 < n) imp__step_weigh(v, imp__spec(1), 1, 1);
        if (s->recorded) {
            v->d.scatterer = IMP_AT_SKY;
            v->d.uv[0] = v->d.uv[1] = 0;
            imp__store_v3(v->d.p, s->at.p);
            if (k + 1 < n) straight_on(&v->d, s->d);
        }
        imp__emission_meet(s, v, s->scene->environments[k], 1, NULL, NULL);
    }
    s->walk->valid |= seen(s);
}

/* The surface that was met, and its material there. NULL: the walk is dropped. */
static inline __attribute__((always_inline)) struct imp_vertex *
surface_meet(struct imp_step *s, struct imp_hit *hit, struct imp_surface *at,
             struct imp_frame *frame)
{
    const struct imp_shape *shape = s->scene->shapes[hit->shape];
    imp__hit_surface(s->scene, hit, &s->o, &s->d, at);
    const struct imp_bsdf *bsdf =
        imp_unlikely(s->scene->priorities != NULL)
            ? imp__nest_bsdf(s->scene, &s->flight.nest_here, shape)
            : imp__shape_bsdf(s->scene, shape);
    struct imp_vertex *v = vertex_add(s, bsdf->n_in);
    if (!v) return NULL;
    v->shape = shape;
    v->bsdf = bsdf;
    if (s->recorded) {
        v->d.shape = hit->shape;
        v->d.scatterer = bsdf->flags & IMP_BSDF_NULL ? IMP_AT_BOUNDARY : IMP_AT_SURFACE;
    }
    *frame = (struct imp_frame){at->s, at->t, at->n};
    vertex_place(s, v, at, frame, s->d, hit->t);
    if (imp_unlikely(s->segment->arrive != NULL)) {
        if (!s->segment->arrive(s, v, hit, at)) return NULL;
        *frame = (struct imp_frame){at->s, at->t, at->n};
    }
    return v;
}

/* The point of a medium where the segment ended in a collision. */
static __attribute__((noinline)) struct imp_vertex *
medium_meet(struct imp_step *s, const struct imp_bsdf *scatterer, int medium, imp_v3 p,
            double t, struct imp_surface *at, struct imp_frame *frame)
{
    struct imp_vertex *v = vertex_add(s, scatterer->n_in);
    if (!v) return NULL;
    v->bsdf = scatterer;
    if (s->recorded) {
        v->d.shape = medium;
        v->d.scatterer = IMP_IN_MEDIUM;
        v->d.stands = s->flight.stands;
    }
    *at = (struct imp_surface){.p = p};
    *frame = (struct imp_frame){{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
    vertex_place(s, v, at, frame, s->d, t);
    s->walk->valid = true;
    return v;
}

struct imp_vertex *imp__vertex_meet(struct imp_step *s, enum imp_meeting met,
                                    struct imp_hit *hit, struct imp_surface *at,
                                    struct imp_frame *frame)
{
    if (met == IMP_MEETS_SURFACE) return surface_meet(s, hit, at, frame);
    if (met == IMP_MEETS_MEDIUM)
        return medium_meet(s, s->flight.here->scatterer, s->flight.here->index,
                           s->flight.at, s->flight.t, at, frame);
    return NULL;
}

bool imp__sensor_vertex(struct imp_step *s)
{
    struct imp_vertex *v = vertex_add(s, 0);
    if (!v) return false;
    s->walk->depth = -1;
    v->t = 0;
    imp__step_weigh(v, imp__spec(1), 1, 1);
    if (!s->recorded) return true;
    v->d.scatterer = IMP_AT_SENSOR;
    v->d.uv[0] = v->d.uv[1] = 0;
    imp__store_v3(v->d.p, s->o);
    imp__store_v3(v->d.wo, (imp_v3){0});
    straight_on(&v->d, s->d);
    return true;
}

/* Light that leaves the vertex by itself: what its BSDF glows with, and its emitter. */
static inline __attribute__((always_inline)) void
emission_add(struct imp_step *s, struct imp_vertex *v, double weight,
             const struct imp_hit *hit, const struct imp_surface *at)
{
    if (v->bsdf->flags & IMP_BSDF_EMIT) {
        imp_spec glow;
        v->bsdf->ops->emit(v->bsdf, s->in, &s->wo, &glow);
        v->e += glow * weight;
        if (s->recorded) {
            v->d.glows = true;
            v->d.glow_weight = (imp_decided)weight;
        }
    }
    if (v->shape && v->shape->emitter >= 0) {
        imp__emission_meet(s, v, v->shape->emitter, weight, hit, at);
        s->walk->valid |= seen(s);
    }
}

/* The densities at the vertex that was met, and whether it splits. */
static __attribute__((noinline)) void
mixture_meet(struct imp_step *s, const struct imp_bsdf *b, const struct imp_surface *at)
{
    imp__mixture_prepare(s, b, at->p);
    /* The vertex of a sensor that is a surface, of depth -1, is not scattering. */
    s->mixed.splits =
        s->mixed.here && s->depth >= 0 && s->depth < s->tracer->integrator->split;
}

/* The light sample counts as far as what lies between lets it pass. */
static __attribute__((noinline)) void connect_through(struct imp_step *s,
                                                      struct imp_vertex *v,
                                                      const struct imp_surface *at,
                                                      const struct imp_shadow *shadow)
{
    imp_spec T;
    if (!s->segment->sees(s, v, at, shadow, &T)) return;
    v->b = shadow->brings * T;
    if (!s->recorded) return;
    v->d.connection = IMP_CONNECTED;
    v->light_w *= T;
}

/* At a vertex: what it emits, its light sample, and where the walk goes on; false: it
 * ends. */
static inline __attribute__((always_inline)) bool
vertex_work(struct imp_step *s, struct imp_vertex *v, const struct imp_hit *hit,
            const struct imp_surface *at, const struct imp_frame *frame)
{
    const struct imp_walk_integrator *integrator = s->tracer->integrator;
    const int max_depth = integrator->max_depth;
    const bool counts = max_depth < 0 || imp__bounces(s) < max_depth;
    const bool bounces = max_depth < 0 || imp__bounces(s) + 1 < max_depth;
    const bool goes_on =
        bounces || (imp_unlikely(v->bsdf->straight) && s->segment->through && counts);
    imp__step_numbers(s);
    if (imp_unlikely(s->mixed.all != NULL || s->guided.here))
        mixture_meet(s, v->bsdf, at);
    else s->mixed.here = s->mixed.splits = false;

    /* Stam's walk collects emission only where it is absorbed. */
    double emits = 1;
    const bool absorbed =
        integrator->absorbs && counts && imp__absorb(s, v->bsdf, &emits);
    if (integrator->absorbs) s->walk->valid = true;

    /* Emission that is met. */
    if (counts && emits > 0) emission_add(s, v, emits, hit, at);
    if (absorbed || !goes_on) return false;
    /* What a sensor that is a surface receives at once is what a camera sees. */
    const bool unseen = imp_unlikely(integrator->hide_emitters) && s->depth < 0;
    if (!(v->bsdf->flags & IMP_BSDF_NULL) && !unseen) s->walk->valid = true;

    /* A point of a light, and a direction: both are drawn before either is weighed, and both are
     * weighed before the light is looked for, so that neither waits for the other's roots and
     * quotients. */
    const bool splits = imp_unlikely(s->mixed.splits) ||
                        (imp_unlikely(s->tracer->split > 1) && s->depth == 0 &&
                         s->scene->n_bodies + s->scene->n_media == 0);
    struct imp_light_point point;
    const bool lit = (v->bsdf->flags & IMP_BSDF_SMOOTH) && s->segment->connects &&
                     integrator->lights && bounces && !unseen &&
                     imp__light_point(s, v->bsdf, at, &point);
    struct imp_direction direction;
    const bool drawn = integrator->directions && !splits &&
                       imp__direction_begin(s, v, frame, &direction);

    struct imp_shadow shadow;
    shadow.wanted = false;
    if (lit) imp__light_sample(s, v, at, frame, &point, &shadow);
    const bool continues =
        drawn ? imp__scatter_along(s, v, at, frame, &direction)
              : splits && integrator->directions && imp__scatter_split(s, v, at, frame);

    /* Is the light seen? */
    if (shadow.wanted) {
        if (imp_unlikely(s->segment->sees != NULL)) connect_through(s, v, at, &shadow);
        else if (!imp__occluded_at(s->scene, s->walk->time, &shadow.o, &shadow.d, 0,
                                   shadow.reach)) {
            v->b = shadow.brings;
            if (s->recorded) v->d.connection = IMP_CONNECTED;
        }
    }
    return continues && !s->walk->dropped;
}

/* From the ray in flight to the next one; false: the walk ends. */
static inline __attribute__((always_inline)) bool step(struct imp_step *s)
{
    struct imp_hit hit;
    struct imp_surface at;
    struct imp_frame frame;
    struct imp_vertex *v;

    /* Follow the ray to what it meets. */
    switch (s->segment->meet(s, &hit)) {
    case IMP_MEETS_SURFACE:
        v = surface_meet(s, &hit, &at, &frame);
        if (v && imp_unlikely(s->guided.guide != NULL)) imp__guided_arrive(s, &hit, &at);
        break;
    case IMP_MEETS_MEDIUM:
        v = medium_meet(s, s->flight.here->scatterer, s->flight.here->index, s->flight.at,
                        s->flight.t, &at, &frame);
        break;
    case IMP_MEETS_NOTHING: imp__sky_meet(s); return false;
    default: return false;
    }
    return v && vertex_work(s, v, &hit, &at, &frame);
}

void imp__walk_on(struct imp_step *s)
{
    while (step(s)) s->depth++;
}

imp_spec imp__walk_scattered(struct imp_step *s, const struct imp_bsdf *scatterer,
                             imp_v3 p)
{
    struct imp_surface at;
    struct imp_frame frame;
    struct imp_vertex *v = medium_meet(s, scatterer, -1, p, 0, &at, &frame);
    if (!v) return (imp_spec){0};
    if (vertex_work(s, v, NULL, &at, &frame)) {
        s->depth++;
        imp__walk_on(s);
    }
    return imp__walk_fold(s->walk);
}

void imp__walk_on_meter(struct imp_step *s)
{
    struct imp_surface at;
    struct imp_frame frame;
    struct imp_vertex *v = imp__meter_begin(s, &at, &frame);
    if (!v || !vertex_work(s, v, NULL, &at, &frame)) return;
    s->depth++;
    imp__walk_on(s);
}
