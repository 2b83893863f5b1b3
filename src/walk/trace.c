/* SPDX-License-Identifier: Apache-2.0
 *
 * One walk. The step below is the only place where paths are made: rendering, gradients,
 * replays and frozen checks all start from what it records. Path tracing with light
 * samples, and Stam's walk that collects emission only where it is absorbed, are settings
 * of it.
 *
 * Estimator (gradients.md 8): E_k = w^B Le for emission met by chance, B_k = w^E f Le /
 * p^e for a light sample, power heuristic with exponent 2, w^B = 1 at the first vertex
 * and after a delta lobe. Depth: emission at vertex k counts if k < max_depth, scattering
 * goes on and samples lights if k + 1 < max_depth (scene-format 11). */
#include "step.h"
#include <float.h>

/* With room behind it for n_in inputs of its BSDF. */
static struct imp_vertex *vertex_add(struct imp_step *s, int n_in)
{
    if (imp_unlikely(s->walk->n == IMP_WALK_MAX)) {
        s->walk->dropped = IMP_DROP_LONG;
        return NULL;
    }
    struct imp_vertex *v =
        imp__arena_take(s->arena, 1, sizeof *v + (size_t)n_in * sizeof *v->in);
    if (imp_unlikely(!v)) {
        s->walk->dropped = IMP_DROP_MEMORY;
        return NULL;
    }
    struct imp_walk *w = s->walk;
    v->prev = w->last;
    v->next = NULL;
    if (w->last) w->last->next = v;
    else w->first = v;
    w->last = v;
    w->n++;
    v->bsdf = NULL;
    v->shape = NULL;
    v->leg = NULL;
    v->in = (imp_spec *)(v + 1);
    v->w = v->e = v->lin = (imp_spec){0};
    v->inv_ps = v->pdf = v->l_weight = 0;
    v->survive = 1;
    v->emitter = v->light = -1;
    v->glows = false;
    v->e_weight = v->g_weight = 1;
    return v;
}

/* The ray in flight, in a medium: to what it meets. The step's weight gets the ratio of
 * the squared indices at its ends: radiance/n^2 is what stays along a ray. */
static __attribute__((noinline)) bool bend_meet(struct imp_step *s, struct imp_hit *hit)
{
    struct imp_vertex *last = s->walk->last;
    double ratio;
    if (!imp__bend_meet(s->scene, s->bend, &s->from, &s->o, &s->d, hit, &ratio)) {
        s->walk->dropped = IMP_DROP_BENT;
        return false;
    }
    const double scale = ratio * ratio;
    last->inv_ps *= scale;
    last->w *= scale;
    s->beta *= scale;
    s->eta /= ratio;
    return true;
}

/* Area lights that a camera ray passes through (hide_emitters). */
static bool first_hit(struct imp_step *s, struct imp_hit *hit)
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

/* May light that is met here make the sample valid (scene-format 11)? What is hidden from
 * the camera stays hidden behind a null material for path, and not for direct. */
static bool seen(const struct imp_step *s)
{
    const struct imp_integrator *integrator = s->tracer->integrator;
    return !integrator->hide_emitters ||
           (integrator->kind == IMP_INTEGRATOR_DIRECT && s->depth > 0);
}

static void guide_find(struct imp_step *s, const struct imp_hit *hit,
                       const struct imp_surface *at)
{
    const struct imp_guide *g = s->tracer->guide;
    s->known = g->find(g, hit, at, s->d, &s->place);
    s->arrived = s->d;
    if (s->known && g->expected) {
        const double all = g->expected(g, &s->place, -s->d, &s->beyond);
        if (s->depth == 0) s->reference = all;
    }
}

/* From the ray in flight to the next one; false: the walk ends. */
static bool step(struct imp_step *s)
{
    const struct imp_scene *scene = s->scene;
    const struct imp_integrator *integrator = s->tracer->integrator;
    const bool counts = integrator->max_depth < 0 || s->depth < integrator->max_depth;
    const bool goes_on =
        integrator->max_depth < 0 || s->depth + 1 < integrator->max_depth;
    struct imp_hit hit;
    if (imp_unlikely(s->bend != NULL) && s->bend->medium) {
        if (!bend_meet(s, &hit)) return false;
    } else if (!first_hit(s, &hit)) {
        const bool hidden = integrator->hide_emitters && s->depth == 0;
        if (scene->environment < 0 || hidden || !counts) return false;
        struct imp_vertex *v = vertex_add(s, 0);
        if (!v) return false;
        v->t = INFINITY;
        v->at = (struct imp_texcoord){{0, 0}, s->d};
        imp__emission_meet(s, v, scene->environment, NULL, NULL);
        s->walk->valid |= seen(s);
        return false;
    }

    const struct imp_shape *shape = scene->shapes[hit.shape];
    struct imp_surface at;
    shape->ops->surface(shape, &hit, &s->o, &s->d, &at);
    const struct imp_bsdf *bsdf = imp__shape_bsdf(scene, shape);
    struct imp_vertex *v = vertex_add(s, bsdf->n_in);
    if (!v) return false;
    struct imp_frame frame = {at.s, at.t, at.n};
    v->shape = shape;
    v->bsdf = bsdf;
    v->t = hit.t;
    v->ng = at.ng;
    v->at = (struct imp_texcoord){{at.uv[0], at.uv[1]}, at.p};
    v->dirs.wo = imp__to_local(&frame, -s->d);
    imp__inputs_eval(v->bsdf->input, v->bsdf->n_in, &v->at, v->in);
    if (imp_unlikely(s->bend != NULL)) {
        if (!imp__bend_arrive(s->tracer, s->arena, s->walk, s->bend, v, &hit, &at, s->d))
            return false;
        frame = (struct imp_frame){at.s, at.t, at.n}; /* it may have moved a little */
    }

    if (imp_unlikely(s->tracer->guide != NULL)) guide_find(s, &hit, &at);
    struct imp_shadow shadow = {.light = -1};
    const bool stam = integrator->kind == IMP_INTEGRATOR_STAM;
    const bool ended = stam && counts && imp__absorb(s, v);
    if (stam) s->walk->valid = true;
    if (counts && v->e_weight > 0) {
        if (v->bsdf->flags & IMP_BSDF_EMIT) {
            imp_spec glow;
            v->bsdf->ops->emit(v->bsdf, v->in, &v->dirs.wo, &glow);
            v->e += glow * v->g_weight;
            v->glows = true;
        }
        if (shape->emitter >= 0) {
            imp__emission_meet(s, v, shape->emitter, &hit, &at);
            s->walk->valid |= seen(s);
        }
    }
    if (ended || !goes_on) return false;
    if (!(v->bsdf->flags & IMP_BSDF_NULL)) s->walk->valid = true;
    if ((v->bsdf->flags & IMP_BSDF_SMOOTH) && imp__wants_lights(integrator) &&
        !(s->bend && s->bend->medium))
        imp__light_sample(s, v, &at, &frame, &shadow);
    const bool only_lights =
        integrator->kind == IMP_INTEGRATOR_DIRECT && integrator->bsdf_samples == 0;
    const bool continues = !only_lights && imp__scatter(s, v, &at, &frame);
    if (shadow.light >= 0 && !imp__occluded(scene, &shadow.o, &shadow.d, 0, shadow.reach))
        v->light = shadow.light;
    return continues;
}

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
                         .o = walk->ray.o,
                         .d = walk->ray.d,
                         .t_min = walk->ray.t_near,
                         .t_max = walk->ray.t_far,
                         .from = walk->ray.o,
                         .beta = {1, 1, 1, 0},
                         .eta = 1};
    struct imp_bending bend; /* large: not touched without need */
    if (imp_unlikely(tracer->scene->n_media > 0)) {
        imp__bend_begin(&bend);
        s.bend = &bend;
    }
    while (step(&s)) s.depth++;

    const imp_spec L = imp__walk_fold(walk);
    /* A picture holds floats. */
    if (imp_unlikely(
            !(fabs(L[0]) <= FLT_MAX && fabs(L[1]) <= FLT_MAX && fabs(L[2]) <= FLT_MAX)))
        walk->dropped = isnan(L[0] + L[1] + L[2]) ? IMP_DROP_NAN : IMP_DROP_INFINITE;
    else if (imp_unlikely(L[0] < 0 || L[1] < 0 || L[2] < 0))
        walk->dropped = IMP_DROP_NEGATIVE;
    walk->L = walk->dropped || !walk->valid ? (imp_spec){0} : L;
}
