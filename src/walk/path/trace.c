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
#include "walk/core/drawn.h"
#include "walk/core/vertices.h"

/* ---- One step --------------------------------------------------------------------- */

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
        v = imp__surface_meet(s, &hit, &at, &frame);
        if (v && imp_unlikely(s->guided.guide != NULL)) imp__guided_arrive(s, &hit, &at);
        break;
    case IMP_MEETS_MEDIUM:
        v = imp__medium_meet(s, s->flight.here->scatterer, s->flight.here->index,
                             s->flight.at, s->flight.t, &at, &frame);
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
    struct imp_vertex *v = imp__medium_meet(s, scatterer, -1, p, 0, &at, &frame);
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
