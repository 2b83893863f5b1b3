/* SPDX-License-Identifier: Apache-2.0
 *
 * The end of a walk that begins at the sensor: what the one step (core/one_step.h) does there.
 * Path tracing with light samples, and Stam's walk that collects emission only where it is
 * absorbed, are settings of it.
 *
 * Estimator (docs/estimators.md 8): E_k = w^B Le for emission met by chance, B_k = w^E f
 * Le/p^e for a light sample, power heuristic with exponent 2, w^B = 1 at the first vertex
 * and after a delta lobe. Depth: emission at vertex k counts if k < max_depth, scattering
 * goes on and samples lights if k + 1 < max_depth (docs/scene-format.md 11). */
#include "surface_sensor.h"
#include "walk/core/one_step.h"

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
        s->walk->valid |= imp__met_is_seen(s);
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

/* ---- The end ----------------------------------------------------------------------- */

static inline bool counts(const struct imp_step *s)
{
    const int max_depth = s->tracer->integrator->max_depth;
    return max_depth < 0 || imp__bounces(s) < max_depth;
}
static inline bool bounces(const struct imp_step *s)
{
    const int max_depth = s->tracer->integrator->max_depth;
    return max_depth < 0 || imp__bounces(s) + 1 < max_depth;
}
/* What a sensor that is a surface receives at once is what a camera sees: with hide_emitters
 * its first vertex has no light sample. */
static inline bool looks_past_lights(const struct imp_step *s)
{
    return imp_unlikely(s->tracer->integrator->hide_emitters) && s->depth < 0;
}

static inline bool arrive(struct imp_step *s, struct imp_vertex *v,
                          const struct imp_hit *hit, const struct imp_surface *at,
                          const struct imp_frame *frame)
{
    (void)v, (void)frame;
    if (imp_unlikely(s->guided.guide != NULL)) imp__guided_arrive(s, hit, at);
    return true;
}

static inline void densities(struct imp_step *s, const struct imp_vertex *v,
                             const struct imp_surface *at)
{
    if (imp_unlikely(s->mixed.all != NULL || s->guided.here))
        mixture_meet(s, v->bsdf, at);
    else s->mixed.here = s->mixed.splits = false;
}

/* Emission that is met; Stam's walk collects it only where it is absorbed. */
static inline bool meet(struct imp_step *s, struct imp_vertex *v,
                        const struct imp_hit *hit, const struct imp_surface *at)
{
    const bool absorbs = s->tracer->integrator->ends_by == IMP_ENDS_BY_ABSORPTION;
    const bool within = counts(s);
    double emits = 1;
    const bool absorbed = absorbs && within && imp__absorb(s, v->bsdf, &emits);
    if (absorbs) s->walk->valid = true;
    if (within && emits > 0) emission_add(s, v, emits, hit, at);
    return !absorbed;
}

static inline void goes_on(struct imp_step *s, const struct imp_vertex *v)
{
    if (!(v->bsdf->flags & IMP_BSDF_NULL) && !looks_past_lights(s)) s->walk->valid = true;
}

static inline bool link_draw(struct imp_step *s, const struct imp_vertex *v,
                             const struct imp_surface *at, struct imp_link *link)
{
    return s->segment->connects && s->tracer->integrator->lights && bounces(s) &&
           !looks_past_lights(s) && imp__light_point(s, v->bsdf, at, &link->light);
}

static inline void link_weigh(struct imp_step *s, struct imp_vertex *v,
                              const struct imp_surface *at, const struct imp_frame *frame,
                              struct imp_link *link)
{
    imp__light_sample(s, v, at, frame, &link->light, &link->shadow);
}

static inline void link_see(struct imp_step *s, struct imp_vertex *v,
                            const struct imp_surface *at, const struct imp_link *link)
{
    const struct imp_shadow *shadow = &link->shadow;
    if (imp_unlikely(s->segment->sees != NULL)) {
        connect_through(s, v, at, shadow);
    } else if (!imp__occluded_at(s->scene, s->walk->time, &shadow->o, &shadow->d, 0,
                                 shadow->reach)) {
        v->b = shadow->brings;
        if (s->recorded) v->d.connection = IMP_CONNECTED;
    }
}

static inline bool splits(const struct imp_step *s)
{
    return imp_unlikely(s->mixed.splits) ||
           (imp_unlikely(s->tracer->split > 1) && s->depth == 0 &&
            s->scene->n_bodies + s->scene->n_media == 0);
}

static const struct imp_end_ops sensor_end = {.nothing = imp__sky_meet,
                                              .arrive = arrive,
                                              .bounces = bounces,
                                              .passes = counts,
                                              .densities = densities,
                                              .meet = meet,
                                              .goes_on = goes_on,
                                              .link_draw = link_draw,
                                              .link_weigh = link_weigh,
                                              .link_see = link_see,
                                              .splits = splits,
                                              .direction_draw = imp__direction_begin,
                                              .scatter = imp__scatter_along,
                                              .scatter_split = imp__scatter_split};

void imp__walk_on(struct imp_step *s)
{
    while (imp__one_step(&sensor_end, s)) s->depth++;
}

imp_spec imp__walk_scattered(struct imp_step *s, const struct imp_bsdf *scatterer,
                             imp_v3 p)
{
    struct imp_surface at;
    struct imp_frame frame;
    struct imp_vertex *v = imp__medium_meet(s, scatterer, -1, p, 0, &at, &frame);
    if (!v) return (imp_spec){0};
    if (imp__vertex_work(&sensor_end, s, v, NULL, &at, &frame)) {
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
    if (!v || !imp__vertex_work(&sensor_end, s, v, NULL, &at, &frame)) return;
    s->depth++;
    imp__walk_on(s);
}

void imp__walk_on_hit(struct imp_step *s, struct imp_hit *hit)
{
    struct imp_surface at;
    struct imp_frame frame;
    imp__step_numbers(s);
    struct imp_vertex *v = imp__surface_meet(s, hit, &at, &frame);
    if (!v || !arrive(s, v, hit, &at, &frame) ||
        !imp__vertex_work(&sensor_end, s, v, hit, &at, &frame))
        return;
    s->depth++;
    imp__walk_on(s);
}
