/* SPDX-License-Identifier: Apache-2.0
 *
 * The visitor of a vertex: every piece of gradient that falls off there (walk_parts.h). A value whose
 * derivative another estimator gives adds that piece here, once for all modes. */
#ifndef IMP_WALK_VERTEX_PIECES_H
#define IMP_WALK_VERTEX_PIECES_H

#include "walk/core/pieces.h"
#include "walk/core/vertex.h"
#include "walk/media/media_pieces.h"

#define IMP_PIECES_INLINE static inline __attribute__((always_inline))

/* Do inputs of its scatterer count? */
static inline bool imp__scatterer_active(const struct imp_tracer *t,
                                         const struct imp_vertex *v)
{
    const struct imp_bsdf *b = v->bsdf;
    if (!b || b->index < 0 || !t->active->bsdf[b->index]) return false;
    return t->active->bsdf[b->index] != IMP_BY_EXTINCTION || t->collisions_fixed ||
           v->d.fixed;
}

static inline struct imp_adjoints imp__adjoints_at(const struct imp_walk *walk, int depth,
                                                   imp_spec P)
{
    const struct imp_entry *entry =
        imp_likely(!walk->entry) ? NULL : &walk->entry[depth - walk->depth];
    return imp_likely(!entry) ? (struct imp_adjoints){P, P, P}
                              : (struct imp_adjoints){P, P * entry->e, P * entry->b};
}

/* ---- Derivatives of values by inputs of the scatterer, lane by lane: d [n_in] ---------- */

/* E_k through its own emission. */
static inline void imp__glow_d(const struct imp_vertex *v, imp_spec *d)
{
    const imp_v3 wo = imp__vertex_wo(v);
    v->bsdf->ops->emit_d(v->bsdf, v->in, &wo, d);
    for (int j = 0; j < v->bsdf->n_in; j++) d[j] *= v->d.glow_weight;
}

/* B_k. */
static inline void imp__light_d(const struct imp_vertex *v, imp_spec *d)
{
    const struct imp_dirs dirs = imp__light_dirs(v);
    imp__bsdf_eval_d(v->bsdf, v->carried, v->in, &dirs, d);
    for (int j = 0; j < v->bsdf->n_in; j++) d[j] *= v->light_e * v->light_w;
}

/* w_k, densities frozen. */
static inline void imp__step_d(const struct imp_tracer *tracer,
                               const struct imp_walk *walk, const struct imp_vertex *v,
                               int depth, imp_spec *d)
{
    const struct imp_dirs dirs = imp__vertex_dirs(v);
    imp__bsdf_eval_d(v->bsdf, v->carried, v->in, &dirs, d);
    for (int j = 0; j < v->bsdf->n_in; j++) d[j] *= v->scale;
    if (tracer->integrator->alpha_gradient != IMP_ALPHA_DETACHED)
        imp__attached_d(walk, v, depth, d);
}

/* ---- Pieces ---------------------------------------------------------------------------- */

/* By inputs of emitters: of the one that is met, or where the walk begins, and of the light
 * sample. */
IMP_PIECES_INLINE void imp__emitter_pieces(const struct imp_pieces_ops *ops, void *taker,
                                           const struct imp_tracer *tracer,
                                           const struct imp_vertex *v,
                                           const struct imp_adjoints *a)
{
    const uint8_t *active = tracer->active->emitter;
    const struct imp_met *met = &v->d.met;
    const struct imp_light *light = &v->d.light;
    const imp_spec one = imp__spec(1);
    if (met->emitter >= 0 && active[met->emitter]) {
        const bool begins = v->d.scatterer == IMP_AT_LIGHT;
        struct imp_emitter_piece piece = {
            met->emitter,
            imp__vertex_met(v),
            imp__vertex_at(v),
            {one, one},
            imp_likely(!begins) ? a->own * met->weight : a->P * v->beyond * v->scale};
        ops->emitter(taker, &piece);
    }
    if (v->d.connection == IMP_CONNECTED && light->emitter >= 0 &&
        active[light->emitter]) {
        struct imp_emitter_piece piece = {light->emitter,
                                          imp__light_emission(light),
                                          imp__light_at(tracer->scene, v),
                                          {v->light_f, v->light_w},
                                          a->lit};
        ops->emitter(taker, &piece);
    }
}

/* By inputs of the scatterer: of its own emission, towards the light, and of the step. */
IMP_PIECES_INLINE void imp__scatterer_pieces(const struct imp_pieces_ops *ops,
                                             void *taker, const struct imp_tracer *tracer,
                                             const struct imp_walk *walk,
                                             const struct imp_vertex *v, int depth,
                                             const struct imp_adjoints *a)
{
    imp_spec d[IMP_INPUTS_MAX];
    if (!imp__scatterer_active(tracer, v)) return;
    ops->scatterer_begin(taker, v);
    if (v->d.glows) {
        imp__glow_d(v, d);
        ops->scatterer(taker, v, d, a->own);
    }
    if (v->d.connection == IMP_CONNECTED) {
        imp__light_d(v, d);
        ops->scatterer(taker, v, d, a->lit);
    }
    const imp_spec arriving = a->P * v->beyond;
    if (v->d.goes_on && !imp__is_zero_used(arriving, v->carried)) {
        imp__step_d(tracer, walk, v, depth, d);
        ops->scatterer(taker, v, d, arriving);
    }
    if (ops->scatterer_end) ops->scatterer_end(taker, v);
}

IMP_PIECES_INLINE void imp__segment_pieces(const struct imp_pieces_ops *ops, void *taker,
                                           const struct imp_tracer *tracer,
                                           const struct imp_vertex *v,
                                           const struct imp_adjoints *a)
{
    if (imp_likely(!imp__vertex_crosses(v))) return;
    imp__media_pieces(ops, taker, tracer, v, a);
    if (ops->segments_end) ops->segments_end(taker);
}

/* All of vertex v, which is the one of number `depth`. */
IMP_PIECES_INLINE void imp__vertex_pieces(const struct imp_pieces_ops *ops, void *taker,
                                          const struct imp_tracer *tracer,
                                          const struct imp_walk *walk,
                                          const struct imp_vertex *v, int depth,
                                          const struct imp_adjoints *a)
{
    imp__emitter_pieces(ops, taker, tracer, v, a);
    if (ops->segments_first) imp__segment_pieces(ops, taker, tracer, v, a);
    imp__scatterer_pieces(ops, taker, tracer, walk, v, depth, a);
    if (!ops->segments_first) imp__segment_pieces(ops, taker, tracer, v, a);
}

#endif
