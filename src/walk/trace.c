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
 * goes on and samples lights if k + 1 < max_depth (scene-format 11). */
#include "step.h"

/* ---- Vertices -------------------------------------------------------------------- */

/* With room behind it for n_in inputs of its BSDF. */
static struct imp_vertex *vertex_add(struct imp_step *s, int n_in)
{
    struct imp_walk *w = s->walk;
    if (imp_unlikely(w->n == IMP_WALK_MAX)) {
        w->dropped = IMP_DROP_LONG;
        return NULL;
    }
    struct imp_vertex *v =
        imp__arena_take(s->arena, 1, sizeof *v + (size_t)n_in * sizeof *v->in);
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
    v->segment = &imp__straight;
    v->in = (imp_spec *)(v + 1);
    v->w = v->e = v->beyond = (imp_spec){0};
    v->scale = 0;

    struct imp_decision *d = &v->d;
    d->shape = d->met.emitter = -1;
    d->connection = IMP_NOT_CONNECTED;
    d->glows = d->goes_on = false;
    d->pdf = 0;
    d->survive = d->passes = 1;
    d->met.weight = d->glow_weight = 1;
    return v;
}

static void decide_v3(imp_decided out[3], imp_v3 v)
{
    for (int k = 0; k < 3; k++) out[k] = (imp_decided)v[k];
}

/* Where the surface is, as decided; `t` is the length of the segment that leads there. */
void imp__vertex_place(struct imp_vertex *v, const struct imp_surface *at,
                       const struct imp_frame *frame, imp_v3 d, double t)
{
    v->ng = at->ng;
    v->t = t;
    v->d.uv[0] = (imp_decided)at->uv[0];
    v->d.uv[1] = (imp_decided)at->uv[1];
    decide_v3(v->d.p, at->p);
    decide_v3(v->d.wo, imp__to_local(frame, -d));
    const struct imp_texcoord where = imp__vertex_at(v);
    imp__evaluate_inputs(v, &where, v->in);
}

/* ---- The ray in flight ------------------------------------------------------------ */

bool imp__nearest_hit(struct imp_step *s, struct imp_hit *hit)
{
    const bool hide = s->tracer->integrator->hide_emitters && s->depth == 0;
    while (imp__intersect(s->scene, &s->o, &s->d, s->t_min, s->t_max, hit)) {
        if (!hide || s->scene->shapes[hit->shape]->emitter < 0) return true;
        const imp_v3 p = s->o + s->d * hit->t;
        const double scale = fmax(fabs(p[0]), fmax(fabs(p[1]), fabs(p[2])));
        s->t_min = hit->t + (1 + scale) * IMP_RAY_EPSILON;
    }
    return false;
}

/* ---- One step --------------------------------------------------------------------- */

/* May light that is met here make the sample valid (scene-format 11)? What is hidden from
 * the camera stays hidden behind a null material for path, and not for direct. */
static bool seen(const struct imp_step *s)
{
    const struct imp_integrator *integrator = s->tracer->integrator;
    return !integrator->hide_emitters ||
           (integrator->kind == IMP_INTEGRATOR_DIRECT && s->depth > 0);
}

/* The ray leaves the scene and meets the environment. */
static void sky_meet(struct imp_step *s, bool counts)
{
    const bool hidden = s->tracer->integrator->hide_emitters && s->depth == 0;
    if (s->scene->environment < 0 || hidden || !counts) return;
    struct imp_vertex *v = vertex_add(s, 0);
    if (!v) return;
    v->t = INFINITY;
    v->d.scatterer = IMP_AT_SKY;
    v->d.uv[0] = v->d.uv[1] = 0;
    decide_v3(v->d.p, s->d);
    imp__emission_meet(s, v, s->scene->environment, NULL, NULL);
    s->walk->valid |= seen(s);
}

/* The surface that was met, and its material there. NULL: the walk is dropped. */
static struct imp_vertex *surface_meet(struct imp_step *s, struct imp_hit *hit,
                                       struct imp_surface *at, struct imp_frame *frame)
{
    const struct imp_shape *shape = s->scene->shapes[hit->shape];
    shape->ops->surface(shape, hit, &s->o, &s->d, at);
    const struct imp_bsdf *bsdf = imp__shape_bsdf(s->scene, shape);
    struct imp_vertex *v = vertex_add(s, bsdf->n_in);
    if (!v) return NULL;
    v->shape = shape;
    v->bsdf = bsdf;
    v->d.shape = hit->shape;
    v->d.scatterer = bsdf->flags & IMP_BSDF_NULL ? IMP_AT_BOUNDARY : IMP_AT_SURFACE;
    *frame = (struct imp_frame){at->s, at->t, at->n};
    imp__vertex_place(v, at, frame, s->d, hit->t);
    if (imp_unlikely(s->segment->arrive != NULL)) {
        if (!s->segment->arrive(s, v, hit, at)) return NULL;
        *frame = (struct imp_frame){at->s, at->t, at->n};
    }
    return v;
}

/* Light that leaves the vertex by itself: what its BSDF glows with, and its emitter. */
static void emission_add(struct imp_step *s, struct imp_vertex *v,
                         const struct imp_hit *hit, const struct imp_surface *at)
{
    if (v->bsdf->flags & IMP_BSDF_EMIT) {
        const imp_v3 wo = imp__decided_v3(v->d.wo);
        v->d.glows = true;
        v->e += imp__evaluate_glow(v, v->in, &wo);
    }
    if (v->shape->emitter >= 0) {
        imp__emission_meet(s, v, v->shape->emitter, hit, at);
        s->walk->valid |= seen(s);
    }
}

/* From the ray in flight to the next one; false: the walk ends. */
static bool step(struct imp_step *s)
{
    const struct imp_integrator *integrator = s->tracer->integrator;
    const int max_depth = integrator->max_depth;
    const bool counts = max_depth < 0 || s->depth < max_depth;
    const bool goes_on = max_depth < 0 || s->depth + 1 < max_depth;
    struct imp_hit hit;
    struct imp_surface at;
    struct imp_frame frame;

    /* Follow the ray to what it meets. */
    const enum imp_meeting met = s->segment->meet(s, &hit);
    if (met == IMP_MEETS_NOTHING) sky_meet(s, counts);
    if (met != IMP_MEETS_SURFACE) return false;
    struct imp_vertex *v = surface_meet(s, &hit, &at, &frame);
    if (!v) return false;
    if (imp_unlikely(s->guided.guide != NULL)) imp__guided_arrive(s, &hit, &at);

    /* Stam's walk collects emission only where it is absorbed. */
    const bool stam = integrator->kind == IMP_INTEGRATOR_STAM;
    const bool absorbed = stam && counts && imp__absorb(s, v);
    if (stam) s->walk->valid = true;

    /* Emission that is met. */
    if (counts && v->d.met.weight > 0) emission_add(s, v, &hit, &at);
    if (absorbed || !goes_on) return false;
    if (v->d.scatterer != IMP_AT_BOUNDARY) s->walk->valid = true;

    /* The connection to a light. */
    struct imp_shadow shadow = {.wanted = false};
    if ((v->bsdf->flags & IMP_BSDF_SMOOTH) && s->segment->connects &&
        imp__wants_lights(integrator))
        imp__light_sample(s, v, &at, &frame, &shadow);

    /* The continuation. */
    const bool only_lights =
        integrator->kind == IMP_INTEGRATOR_DIRECT && integrator->bsdf_samples == 0;
    v->d.goes_on = !only_lights && imp__scatter(s, v, &at, &frame);

    /* Is the light seen? */
    if (shadow.wanted && !imp__occluded(s->scene, &shadow.o, &shadow.d, 0, shadow.reach))
        v->d.connection = IMP_CONNECTED;
    return v->d.goes_on;
}

/* ---- Walks ------------------------------------------------------------------------ */

/* Keys use full-film pixels: a crop renders the same samples as the whole picture. The
 * border of wide filters may lie outside the film, hence the offset. */
static struct imp_key walk_key(const struct imp_tracer *tracer, int x, int y,
                               int64_t sample)
{
    const struct imp_film_desc *film = &tracer->sensor->film;
    const uint64_t row = (uint64_t)(y + film->crop_y + 0x8000);
    const uint64_t column = (uint64_t)(x + film->crop_x + 0x8000);
    return imp__key(tracer->seed, row << 32 | column, (uint64_t)sample);
}

static inline void position(const struct imp_tracer *tracer, struct imp_key key, int x,
                            int y, double *px, double *py)
{
    *px = tracer->sensor->film.crop_x + x + imp__u01(key, IMP_DIM_PIXEL_X);
    *py = tracer->sensor->film.crop_y + y + imp__u01(key, IMP_DIM_PIXEL_Y);
}

void imp__walk_position(const struct imp_tracer *tracer, int x, int y, int64_t sample,
                        double *px, double *py)
{
    position(tracer, walk_key(tracer, x, y, sample), x, y, px, py);
}

/* A walk whose value no light can have is dropped. */
static enum imp_drop drop_cause(imp_spec L)
{
    if (imp_unlikely(!imp__is_finite(L)))
        return isnan(L[0] + L[1] + L[2]) ? IMP_DROP_NAN : IMP_DROP_INFINITE;
    if (imp_unlikely(L[0] < 0 || L[1] < 0 || L[2] < 0)) return IMP_DROP_NEGATIVE;
    return IMP_DROP_NONE;
}

void imp__walk_trace(const struct imp_tracer *tracer, struct imp_arena *arena, int x,
                     int y, int64_t sample, struct imp_walk *walk)
{
    const struct imp_sensor *sensor = tracer->sensor;
    const struct imp_key key = walk_key(tracer, x, y, sample);
    *walk = (struct imp_walk){.key = key};
    position(tracer, key, x, y, &walk->px, &walk->py);
    const double lens[2] = {imp__u01(key, IMP_DIM_LENS_U), imp__u01(key, IMP_DIM_LENS_V)};
    sensor->ops->ray(sensor, walk->px, walk->py, lens, &walk->ray);

    struct imp_step s = {.tracer = tracer,
                         .scene = tracer->scene,
                         .walk = walk,
                         .arena = arena,
                         .segment = imp__segment_first(tracer->scene),
                         .o = walk->ray.o,
                         .d = walk->ray.d,
                         .t_min = walk->ray.t_near,
                         .t_max = walk->ray.t_far,
                         .from = walk->ray.o,
                         .beta = {1, 1, 1, 0},
                         .eta = 1,
                         .guided.guide = tracer->guide};
    if (imp_likely(s.segment->begin == NULL) || s.segment->begin(&s))
        while (step(&s)) s.depth++;

    const imp_spec L = imp__walk_fold(walk);
    const enum imp_drop cause = drop_cause(L);
    if (imp_unlikely(cause != IMP_DROP_NONE)) walk->dropped = cause;
    walk->L = walk->dropped || !walk->valid ? (imp_spec){0} : L;
}
