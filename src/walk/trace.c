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
#include "probe.h"
#include "scene/instances.h"
#include <float.h>
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
    d->glows = d->goes_on = d->stands = d->from_light = false;
    d->drawn = IMP_DENSITY_KERNEL;
    d->pdf = 0;
    d->survive = d->passes = 1;
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

/* The ray leaves the scene and meets the environment. */
static void sky_meet(struct imp_step *s)
{
    const int max_depth = s->tracer->integrator->max_depth;
    const bool counts = max_depth < 0 || imp__bounces(s) < max_depth;
    const bool hidden = s->tracer->integrator->hide_emitters && imp__bounces(s) == 0;
    if (s->scene->environment < 0 || hidden || !counts) return;
    struct imp_vertex *v = vertex_add(s, 0);
    if (!v) return;
    v->t = INFINITY;
    s->at = (struct imp_texcoord){.p = imp__decide(s->d), .carried = s->at.carried};
    if (s->recorded) {
        v->d.scatterer = IMP_AT_SKY;
        v->d.uv[0] = v->d.uv[1] = 0;
        imp__store_v3(v->d.p, s->at.p);
    }
    imp__emission_meet(s, v, s->scene->environment, 1, NULL, NULL);
    s->walk->valid |= seen(s);
}

/* The surface that was met, and its material there. NULL: the walk is dropped. */
static struct imp_vertex *surface_meet(struct imp_step *s, struct imp_hit *hit,
                                       struct imp_surface *at, struct imp_frame *frame)
{
    const struct imp_shape *shape = s->scene->shapes[hit->shape];
    imp__hit_surface(s->scene, hit, &s->o, &s->d, at);
    const struct imp_bsdf *bsdf = imp__shape_bsdf(s->scene, shape);
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
    v->d.goes_on = true;
    v->d.pdf = 1;
    v->d.uv[0] = v->d.uv[1] = 0;
    v->d.lobe = IMP_SMOOTH;
    imp__store_v3(v->d.p, s->o);
    imp__store_v3(v->d.wo, (imp_v3){0});
    imp__store_v3(v->d.wi, s->d);
    return true;
}

/* Light that leaves the vertex by itself: what its BSDF glows with, and its emitter. */
static void emission_add(struct imp_step *s, struct imp_vertex *v, double weight,
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

static void walk_on(struct imp_step *s);

/* The continuation of v counts by a share of 1/n. */
static void share(const struct imp_step *s, struct imp_vertex *v, int n)
{
    const double part = imp__decide1(1. / n);
    imp__step_pass(v, imp__spec(part));
    if (s->recorded) v->d.passes = (imp_decided)part;
}

/* Continuations of a vertex that splits: one from each member of the mixture, with weights
 * of MIS in the densities; or as many as the tracer wants, each with its share. */
static int branches(const struct imp_step *s)
{
    return s->mixed.splits ? s->mixed.members : s->tracer->split;
}
static bool branch_scatter(struct imp_step *s, struct imp_vertex *v, int i,
                           const struct imp_surface *at, const struct imp_frame *frame)
{
    if (s->mixed.splits) { /* the i-th member that has a share */
        int k = 0;
        for (;; k++)
            if (s->mixed.share[k] > 0 && i-- == 0) break;
        s->mixed.only = k;
        return imp__scatter(s, v, at, frame);
    }
    if (!imp__scatter(s, v, at, frame)) return false;
    share(s, v, s->tracer->split);
    return true;
}

/* The point of the same number in another set. */
static struct imp_point point_branch(struct imp_point point, int vertex, int i)
{
    point.set = imp__key_branch((struct imp_key){point.set}, vertex, i).state;
    return point;
}

/* Further continuations of v hang on it as side walks. `before`: the walk before its own
 * continuation was drawn. */
static __attribute__((noinline)) void split(const struct imp_step *before,
                                            struct imp_vertex *v,
                                            const struct imp_surface *at,
                                            const struct imp_frame *frame)
{
    struct imp_walk *walk = before->walk;
    const int n = branches(before);
    for (int i = 1; i < n && !walk->dropped; i++) {
        struct imp_step s = *before;
        struct imp_side *side = imp__arena_take(s.arena, 1, sizeof *side);
        if (!side) {
            walk->dropped = IMP_DROP_MEMORY;
            return;
        }
        side->next = v->side;
        v->side = side;
        side->walk = (struct imp_walk){.px = walk->px,
                                       .py = walk->py,
                                       .key = imp__key_branch(walk->key, s.depth, i),
                                       .point = point_branch(walk->point, s.depth, i),
                                       .ray = walk->ray,
                                       .time = walk->time,
                                       .waves = walk->waves,
                                       .wave = walk->wave,
                                       .depth = s.depth};
        s.walk = &side->walk;
        imp__step_numbers(&s);
        struct imp_vertex *u = vertex_add(&s, v->bsdf->n_in);
        if (!u) {
            walk->dropped = side->walk.dropped;
            return;
        }
        u->shape = v->shape;
        u->bsdf = v->bsdf;
        u->t = v->t;
        if (s.recorded) {
            u->ng = v->ng;
            u->d.shape = v->d.shape;
            u->d.scatterer = v->d.scatterer;
            u->d.uv[0] = v->d.uv[0];
            u->d.uv[1] = v->d.uv[1];
            imp__store_v3(u->d.p, s.at.p);
            imp__store_v3(u->d.wo, s.wo);
        }
        imp_spec *in = s.recorded ? u->in : s.scratch;
        imp__evaluate_inputs(u->bsdf, u->shape, &s.at, in);
        s.in = in;
        if (branch_scatter(&s, u, i, at, frame)) {
            s.depth++;
            walk_on(&s);
        }
        walk->valid |= side->walk.valid;
        side->walk.valid = true;
        walk->dropped = side->walk.dropped;
    }
}

/* The continuation of v, and its branches where the walk is split. */
static __attribute__((noinline)) bool scatter_split(struct imp_step *s,
                                                    struct imp_vertex *v,
                                                    const struct imp_surface *at,
                                                    const struct imp_frame *frame)
{
    const struct imp_step before = *s;
    const bool continues = branch_scatter(s, v, 0, at, frame);
    split(&before, v, at, frame);
    return continues;
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
    if (!(v->bsdf->flags & IMP_BSDF_NULL)) s->walk->valid = true;

    /* The connection to a light. */
    struct imp_shadow shadow;
    shadow.wanted = false;
    if ((v->bsdf->flags & IMP_BSDF_SMOOTH) && s->segment->connects &&
        integrator->lights && bounces)
        imp__light_sample(s, v, at, frame, &shadow);

    /* The continuation. */
    const bool splits = imp_unlikely(s->mixed.splits) ||
                        (imp_unlikely(s->tracer->split > 1) && s->depth == 0 &&
                         s->scene->n_bodies + s->scene->n_media == 0);
    const bool continues =
        integrator->directions &&
        (splits ? scatter_split(s, v, at, frame) : imp__scatter(s, v, at, frame));

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
    case IMP_MEETS_NOTHING: sky_meet(s); return false;
    default: return false;
    }
    return v && vertex_work(s, v, &hit, &at, &frame);
}

static void walk_on(struct imp_step *s)
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
        walk_on(s);
    }
    return imp__walk_fold(s->walk);
}

/* From a sensor that is a surface. */
static __attribute__((noinline)) void meter_walk(struct imp_step *s)
{
    struct imp_surface at;
    struct imp_frame frame;
    struct imp_vertex *v = imp__meter_begin(s, &at, &frame);
    if (!v || !vertex_work(s, v, NULL, &at, &frame)) return;
    s->depth++;
    walk_on(s);
}

/* ---- Walks ------------------------------------------------------------------------ */

/* Keys use full-film pixels: a crop renders the same samples as the whole picture. The
 * border of wide filters may lie outside the film, hence the offset. */
static struct imp_walk walk_numbered(const struct imp_tracer *tracer, int x, int y,
                                     int64_t sample)
{
    const struct imp_film_desc *film = &tracer->sensor->film;
    const uint64_t row = (uint64_t)(y + film->crop_y + 0x8000);
    const uint64_t column = (uint64_t)(x + film->crop_x + 0x8000),
                   pixel = row << 32 | column;
    struct imp_walk walk = {.key = imp__key(tracer->seed, pixel, (uint64_t)sample)};
    if (!tracer->points) return walk;
    const uint64_t set = (uint64_t)sample / IMP_SET_POINTS | 1ull << 63;
    walk.point = (struct imp_point){.points = tracer->points,
                                    .set = imp__key(tracer->seed, pixel, set).state,
                                    .index = (uint32_t)sample % IMP_SET_POINTS};
    return walk;
}

static inline void position(const struct imp_tracer *tracer, const struct imp_walk *w,
                            int x, int y, double *px, double *py)
{
    const struct imp_film_desc *film = &tracer->sensor->film;
    *px = film->crop_x + x + imp__start_number(w->key, w->point, IMP_DIM_PIXEL_X);
    *py = film->crop_y + y + imp__start_number(w->key, w->point, IMP_DIM_PIXEL_Y);
}

void imp__walk_position(const struct imp_tracer *tracer, int x, int y, int64_t sample,
                        double *px, double *py)
{
    const struct imp_walk walk = walk_numbered(tracer, x, y, sample);
    position(tracer, &walk, x, y, px, py);
}

/* Why a walk of this radiance is dropped: no light can have it, or no picture can hold
 * it. */
static __attribute__((noinline)) enum imp_drop drop_cause(imp_spec L)
{
    double sum = 0, largest = 0;
    for (int c = 0; c < 4; c++) {
        sum += L[c];
        largest = fmax(largest, fabs(L[c]));
    }
    if (isnan(sum)) return IMP_DROP_NAN;
    return largest <= FLT_MAX ? IMP_DROP_NEGATIVE : IMP_DROP_INFINITE;
}

void imp__walk_close(const struct imp_tracer *tracer, struct imp_walk *walk)
{
    const imp_spec L = imp__walk_fold(walk);
    imp_spec used = L;
    if (!tracer->wavelengths) used[3] = 0;
    if (imp_unlikely(!imp__is_within(used, FLT_MAX))) walk->dropped = drop_cause(used);
    walk->values = walk->dropped || !walk->valid ? (imp_spec){0} : L;
    walk->L = imp__walk_channels(tracer, walk, walk->values);
}

void imp__walk_trace(const struct imp_tracer *tracer, struct imp_arena *arena, int x,
                     int y, int64_t sample, struct imp_walk *walk)
{
    const struct imp_sensor *sensor = tracer->sensor;
    *walk = walk_numbered(tracer, x, y, sample);
    position(tracer, walk, x, y, &walk->px, &walk->py);
    const double lens[2] = {imp__start_number(walk->key, walk->point, IMP_DIM_LENS_U),
                            imp__start_number(walk->key, walk->point, IMP_DIM_LENS_V)};
    sensor->ops->ray(sensor, walk->px, walk->py, lens, &walk->ray);
    walk->time = imp__walk_time(tracer, walk);

    if (imp_unlikely(tracer->wavelengths != NULL) &&
        !imp__walk_wave(tracer, arena, imp__wave_draw(tracer, walk, sample), walk))
        return;

    imp_spec scratch[IMP_INPUTS_MAX];
    struct imp_step s = {.tracer = tracer,
                         .scene = tracer->scene,
                         .walk = walk,
                         .arena = arena,
                         .recorded = !tracer->value_only ||
                                     (tracer->active && tracer->active->body),
                         .scratch = scratch,
                         .at.carried = walk->waves ? &walk->waves->carried : NULL,
                         .segment = imp__segment_first(tracer),
                         .o = walk->ray.o,
                         .d = walk->ray.d,
                         .t_min = walk->ray.t_near,
                         .t_max = walk->ray.t_far,
                         .from = walk->ray.o,
                         .beta = {1, 1, 1, 1},
                         .eta = 1,
                         .lanes = IMP_LANE_MIS_INIT,
                         .guided.guide = tracer->guide};
    s.mixed.same = tracer->mixing != NULL;
    s.mixed.all = tracer->mixing              ? tracer->mixing
                  : tracer->integrator->mixes ? tracer->integrator->mixing
                                              : NULL;
    struct imp_probing probing = {.n = 0};
    if (imp_unlikely(tracer->active && tracer->active->medium) && s.recorded &&
        !tracer->collisions_stand && tracer->integrator->media)
        s.probing = &probing;
    if (imp_unlikely(sensor->shape != NULL)) meter_walk(&s);
    else if (imp_likely(s.segment->begin == NULL) || s.segment->begin(&s)) walk_on(&s);
    if (imp_unlikely(s.probing != NULL)) imp__probe_follow(&s);

    imp__walk_close(tracer, walk);
}
